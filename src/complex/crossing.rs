//! Faces of a medial mesh that cross: pairs that meet outside of the vertices and edges they share.
//!
//! The medial axis of a solid has none; that of samples has a few where sheets are thinner than the samples
//! are apart; collapses and moves of spheres make more. Exact, and of the centres alone: radii play no part.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::MedialMesh;
use crate::Vec3;
use crate::geometry::{TriangleTree, triangles_meet};

/// The pairs of faces that cross, ascending. Faces without area are not looked at.
///
/// Cost `O(F log F)` and the pairs whose boxes overlap.
///
/// # Panics
/// If a face is out of range; see [`MedialMesh::check`].
pub fn crossing_faces(mesh: &MedialMesh) -> Vec<[u32; 2]> {
    let corners = |face: u32| mesh.faces[face as usize].map(|v| mesh.spheres[v as usize].centre);
    Crossings::new(mesh.faces.clone(), corners).pairs()
}

/// Faces in a tree, for the pairs that cross.
#[derive(Clone, Debug)]
pub struct Crossings {
    faces: Vec<[u32; 3]>,
    tree: TriangleTree,
}

impl Crossings {
    /// The faces of these vertices, with the corners `corners(face)`.
    pub fn new(faces: Vec<[u32; 3]>, corners: impl Fn(u32) -> [Vec3; 3]) -> Self {
        let tree = TriangleTree::new(0..faces.len() as u32, corners);
        Self { faces, tree }
    }

    /// The faces that cross one with these vertices and corners, ascending. It need not be one of them.
    pub fn of(&self, face: [u32; 3], corners: [Vec3; 3]) -> Vec<u32> {
        self.among(face, corners, |_| true)
    }

    /// All pairs that cross, ascending.
    pub fn pairs(&self) -> Vec<[u32; 2]> {
        self.pairs_with(|_| true)
    }

    /// The pairs that cross and have a face for which `is_asked`, ascending.
    pub fn pairs_with(&self, is_asked: impl Fn(u32) -> bool + Sync) -> Vec<[u32; 2]> {
        let of = |place: usize| {
            let (face, corners) = self.tree.at(place);
            let others = if is_asked(face) {
                // Each pair once, and no face with itself.
                let is_later = |other: u32| other > face || (other < face && !is_asked(other));
                self.among(self.faces[face as usize], corners, is_later)
            } else {
                vec![]
            };
            others.into_iter().map(move |other| [face.min(other), face.max(other)])
        };
        let mut pairs: Vec<[u32; 2]> =
            (0..self.tree.len()).into_par_iter().flat_map_iter(of).collect();
        pairs.sort_unstable();
        pairs
    }

    fn among(
        &self,
        face: [u32; 3],
        corners: [Vec3; 3],
        is_asked: impl Fn(u32) -> bool,
    ) -> Vec<u32> {
        let mut found = vec![];
        self.tree.overlapping(corners, |other, place| {
            if is_asked(other) && triangles_meet(face, corners, self.faces[other as usize], place) {
                found.push(other);
            }
            ControlFlow::Continue(())
        });
        found.sort_unstable();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complex::Sphere;

    #[test]
    fn a_face_through_another_crosses_it_and_neighbours_do_not() {
        let at = |x: f64, y: f64, z: f64| Sphere::new(Vec3::new(x, y, z), 0.1);
        let spheres = vec![
            at(0.0, 0.0, 0.0),
            at(1.0, 0.0, 0.0),
            at(0.0, 1.0, 0.0),
            at(1.0, 1.0, 0.0),
            at(0.2, 0.2, -1.0),
            at(0.3, 0.2, 1.0),
            at(0.2, 0.3, 1.0),
        ];
        let faces = vec![[0, 1, 2], [1, 2, 3], [4, 5, 6], [0, 5, 6]];
        let mesh = MedialMesh::from_simplices(spheres, vec![], faces).unwrap();
        let pair = |f: [u32; 3], g: [u32; 3]| {
            let place = |f| mesh.faces.iter().position(|&x| x == f).unwrap() as u32;
            let [a, b] = [place(f), place(g)];
            [a.min(b), a.max(b)]
        };
        assert_eq!(crossing_faces(&mesh), vec![pair([0, 1, 2], [4, 5, 6])]);
    }
}
