//! The limits of a step: centres that leave the solid, faces that fold over and faces that come to cross are
//! taken back.

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::collapse::folds_over;
use medial::complex::{Crossings, MedialMesh};

use super::goal::Goal;
use super::sheets::corners;

/// Faces that stay where they are, beside a mesh that moves. Vertices that are not of the mesh have larger
/// numbers than those that are.
#[derive(Clone, Debug, Default)]
pub(super) struct Still {
    pub faces: Vec<[u32; 3]>,
    pub corners: Vec<[Vec3; 3]>,
}

/// What a mesh must not come to do while its spheres move.
pub(super) struct Guard {
    /// The faces of the mesh, and then those that stay.
    faces: Vec<[u32; 3]>,
    still: Vec<[Vec3; 3]>,
    /// Pairs that cross already.
    known: BTreeSet<[u32; 2]>,
}

impl Guard {
    pub fn new(mesh: &MedialMesh, still: Still) -> Self {
        let faces = mesh.faces.iter().copied().chain(still.faces).collect();
        let mut this = Self { faces, still: still.corners, known: BTreeSet::new() };
        this.known = this.crossing(mesh).into_iter().collect();
        this
    }

    /// Brings a step within its limits: centres outside are clamped, and the corners of faces that would fold
    /// over, or come to cross another one, stay where they were.
    pub fn hold(&self, before: &MedialMesh, after: &mut MedialMesh, goal: &Goal) {
        clamp(after, goal);
        // Taking one vertex back can fold another face of it. This ends: what is all taken back is as before.
        loop {
            let mut back: Vec<[u32; 3]> = before.faces.iter().copied().collect();
            back.retain(|&face| folds_over(corners(before, face), corners(after, face)));
            let new = self.crossing(after).into_iter().filter(|pair| !self.known.contains(pair));
            back.extend(new.flatten().map(|face| self.faces[face as usize]));
            let moved = |v: &u32| {
                let of = |mesh: &MedialMesh| mesh.spheres.get(*v as usize).copied();
                of(before) != of(after)
            };
            let back: BTreeSet<u32> = back.into_iter().flatten().filter(moved).collect();
            if back.is_empty() {
                break;
            }
            for v in back {
                after.spheres[v as usize] = before.spheres[v as usize];
            }
        }
    }

    fn crossing(&self, mesh: &MedialMesh) -> Vec<[u32; 2]> {
        let own = mesh.faces.len();
        let of = |face: u32| match (face as usize).checked_sub(own) {
            Some(still) => self.still[still],
            None => corners(mesh, self.faces[face as usize]),
        };
        Crossings::new(&self.faces, of).pairs()
    }
}

/// Moves centres outside of the solid to the closest point of its surface.
pub(super) fn clamp(mesh: &mut MedialMesh, goal: &Goal) {
    let centres: Vec<Vec3> = mesh.spheres.iter().map(|sphere| sphere.centre).collect();
    for (sphere, clamped) in mesh.spheres.iter_mut().zip(goal.clamped(&centres)) {
        sphere.centre = clamped.unwrap_or(sphere.centre);
    }
}
