//! Incidence of edges and faces: the combinatorics of a medial mesh, without coordinates.

use super::MedialMesh;

/// The edges of every face and the number of faces at every edge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Incidence {
    face_edges: Vec<[u32; 3]>,
    faces_at: Vec<u32>,
}

impl Incidence {
    /// The incidences of a mesh in canonical form. Cost `O(V + E + F log d)`, `d` the largest
    /// number of edges at a sphere.
    ///
    /// # Panics
    /// If a side of a face is not listed as an edge; see [`MedialMesh::check`].
    pub fn of(mesh: &MedialMesh) -> Self {
        let first = first_edges(mesh);
        let edge_id = |a: u32, b: u32| {
            let (from, to) = (first[a as usize], first[a as usize + 1]);
            let found = mesh.edges[from..to].binary_search_by_key(&b, |edge| edge[1]);
            let place = found.expect("every side of a face is an edge in canonical form");
            (from + place) as u32
        };
        let face_edges: Vec<[u32; 3]> = mesh
            .faces
            .iter()
            .map(|&[a, b, c]| [edge_id(a, b), edge_id(a, c), edge_id(b, c)])
            .collect();
        let mut faces_at = vec![0; mesh.edges.len()];
        for &edge in face_edges.iter().flatten() {
            faces_at[edge as usize] += 1;
        }
        Self { face_edges, faces_at }
    }

    /// For each face `[a, b, c]` the ids of its edges `ab`, `ac`, `bc`.
    pub fn face_edges(&self) -> &[[u32; 3]] {
        &self.face_edges
    }

    /// For each edge the number of its faces.
    pub fn faces_at(&self) -> &[u32] {
        &self.faces_at
    }
}

/// For each sphere the position of the first edge that starts at it or later: the edges are
/// sorted, so those that start at sphere `a` are `first[a]..first[a + 1]`.
fn first_edges(mesh: &MedialMesh) -> Vec<usize> {
    let mut first = vec![0; mesh.spheres.len() + 1];
    for &[a, _] in &mesh.edges {
        first[a as usize + 1] += 1;
    }
    for sphere in 0..mesh.spheres.len() {
        first[sphere + 1] += first[sphere];
    }
    first
}
