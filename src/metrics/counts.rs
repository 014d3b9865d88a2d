//! Sizes of a medial mesh.

use super::Counts;
use crate::complex::{Incidence, MedialMesh};

/// Numbers of spheres, edges and faces, of edges without a face, of spheres without an edge, and
/// of edges with three faces or more. Cost `O(V + E + F)`.
///
/// # Panics
/// If the mesh is not in canonical form; see [`MedialMesh::check`].
pub fn counts(mesh: &MedialMesh) -> Counts {
    let incidence = Incidence::of(mesh);
    let edges_with = |wanted: fn(u32) -> bool| {
        incidence.faces_at().iter().filter(|&&faces| wanted(faces)).count() as u64
    };
    Counts {
        spheres: mesh.spheres.len() as u64,
        edges: mesh.edges.len() as u64,
        faces: mesh.faces.len() as u64,
        lone_edges: edges_with(|faces| faces == 0),
        isolated: degrees(mesh).into_iter().filter(|&degree| degree == 0).count() as u64,
        nonmanifold_edges: edges_with(|faces| faces >= 3),
    }
}

/// For each sphere the number of its edges.
pub(super) fn degrees(mesh: &MedialMesh) -> Vec<u32> {
    let mut degrees = vec![0; mesh.spheres.len()];
    for &sphere in mesh.edges.iter().flatten() {
        degrees[sphere as usize] += 1;
    }
    degrees
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::complex::Sphere;

    #[test]
    fn every_kind_is_counted_once() {
        // Three triangles on the edge 01, a lone edge 45, two isolated spheres.
        let spheres = vec![Sphere::new(Vec3::ZERO, 1.0); 9];
        let faces = vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]];
        let mesh = MedialMesh::from_simplices(spheres, vec![[4, 5], [5, 8]], faces).unwrap();
        let expected = Counts {
            spheres: 9,
            edges: 9,
            faces: 3,
            lone_edges: 2,
            isolated: 2,
            nonmanifold_edges: 1,
        };
        assert_eq!(counts(&mesh), expected);
        assert_eq!(counts(&MedialMesh::default()).spheres, 0);
    }
}
