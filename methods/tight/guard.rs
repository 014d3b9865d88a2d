//! The limits of a step: no centre leaves the solid, no face folds over.

use medial::Vec3;
use medial::complex::MedialMesh;

use super::goal::Goal;

/// Rounds of taking back the steps of vertices whose faces fold. What folds after them stays folded.
const ROUNDS: usize = 8;

/// Brings a step within its limits: centres outside go to the closest point of the surface, and the
/// corners of faces that would fold over stay where they were.
pub(super) fn hold(before: &MedialMesh, after: &mut MedialMesh, goal: &Goal) {
    let centres: Vec<Vec3> = after.spheres.iter().map(|sphere| sphere.centre).collect();
    for (sphere, clamped) in after.spheres.iter_mut().zip(goal.clamped(&centres)) {
        sphere.centre = clamped.unwrap_or(sphere.centre);
    }
    // Taking one vertex back can fold another face of it.
    for _ in 0..ROUNDS {
        let folds = |face: &&[u32; 3]| normal(before, face).dot(normal(after, face)) < 0.0;
        let folded: Vec<[u32; 3]> = before.faces.iter().filter(folds).copied().collect();
        if folded.is_empty() {
            break;
        }
        for &v in folded.as_flattened() {
            after.spheres[v as usize] = before.spheres[v as usize];
        }
    }
}

fn normal(mesh: &MedialMesh, face: &[u32; 3]) -> Vec3 {
    let [a, b, c] = face.map(|v| mesh.spheres[v as usize].centre);
    (b - a).cross(c - a)
}
