//! What a medial mesh has outside its faces: for formats in which a face brings its sides along.

use crate::complex::MedialMesh;

/// Edges without a face, in the order of the mesh.
pub(super) fn lone_edges(mesh: &MedialMesh) -> Vec<[u32; 2]> {
    let mut has_face = vec![false; mesh.edges.len()];
    for &[a, b, c] in &mesh.faces {
        for side in [[a, b], [a, c], [b, c]] {
            if let Ok(edge) = mesh.edges.binary_search(&side) {
                has_face[edge] = true;
            }
        }
    }
    mesh.edges.iter().zip(has_face).filter(|&(_, has)| !has).map(|(&edge, _)| edge).collect()
}

/// Spheres without an edge.
pub(super) fn isolated(mesh: &MedialMesh) -> Vec<u32> {
    let mut has_edge = vec![false; mesh.spheres.len()];
    mesh.edges.iter().flatten().for_each(|&v| has_edge[v as usize] = true);
    (0..).zip(has_edge).filter(|&(_, has)| !has).map(|(v, _)| v).collect()
}
