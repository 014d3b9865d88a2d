//! The limits of a step: centres that leave the solid and faces that fold over are taken back.

use medial::Vec3;
use medial::complex::MedialMesh;
use medial::complex::collapse::folds_over;

use super::goal::Goal;

/// Rounds of taking back the steps of vertices whose faces fold. What folds after them stays folded.
const ROUNDS: usize = 8;

/// Moves centres outside of the solid to the closest point of its surface.
pub(super) fn clamp(mesh: &mut MedialMesh, goal: &Goal) {
    let centres: Vec<Vec3> = mesh.spheres.iter().map(|sphere| sphere.centre).collect();
    for (sphere, clamped) in mesh.spheres.iter_mut().zip(goal.clamped(&centres)) {
        sphere.centre = clamped.unwrap_or(sphere.centre);
    }
}

/// Brings a step within its limits: centres outside are clamped, and the corners of faces that would fold
/// over stay where they were.
pub(super) fn hold(before: &MedialMesh, after: &mut MedialMesh, goal: &Goal) {
    clamp(after, goal);
    // Taking one vertex back can fold another face of it.
    for _ in 0..ROUNDS {
        let folds = |face: &&[u32; 3]| folds_over(corners(before, face), corners(after, face));
        let folded: Vec<[u32; 3]> = before.faces.iter().filter(folds).copied().collect();
        if folded.is_empty() {
            break;
        }
        for &v in folded.as_flattened() {
            after.spheres[v as usize] = before.spheres[v as usize];
        }
    }
}

fn corners(mesh: &MedialMesh, face: &[u32; 3]) -> [Vec3; 3] {
    face.map(|v| mesh.spheres[v as usize].centre)
}
