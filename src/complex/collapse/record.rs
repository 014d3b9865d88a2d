//! The record of collapses, and the mesh after any number of them.

use crate::complex::{MedialMesh, Sphere};

/// One collapse, in the ids of the initial mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collapse {
    /// The end whose id the merged vertex keeps.
    pub kept: u32,
    /// The end whose id is retired.
    pub removed: u32,
    /// The merged sphere.
    pub sphere: Sphere,
}

/// The mesh after the first collapses of a record, without doing them one by one: the image of the
/// initial mesh under the composition of their simplicial maps.
///
/// `replay(initial, &record[..t])` is, bit for bit, the mesh that the engine had after `t`
/// collapses, for every `t` and in any order of asking. Cost `O(n log n)`.
///
/// # Panics
/// If the collapses name spheres that `initial` does not have.
pub fn replay(initial: &MedialMesh, collapses: &[Collapse]) -> MedialMesh {
    let mut image: Vec<u32> = (0..initial.spheres.len() as u32).collect();
    let mut spheres = initial.spheres.clone();
    for collapse in collapses {
        spheres[collapse.kept as usize] = collapse.sphere;
        image[collapse.removed as usize] = collapse.kept;
    }
    // Later collapses decide where a kept vertex ends up: resolve from the last to the first.
    for collapse in collapses.iter().rev() {
        image[collapse.removed as usize] = image[collapse.kept as usize];
    }
    let left: Vec<bool> = image.iter().enumerate().map(|(v, &to)| v == to as usize).collect();
    let mut renumbered = vec![u32::MAX; left.len()];
    for (new, old) in (0..left.len()).filter(|&v| left[v]).enumerate() {
        renumbered[old] = new as u32;
    }
    let map = |v: u32| renumbered[image[v as usize] as usize];
    let mut edges: Vec<[u32; 2]> = initial.edges.iter().map(|e| e.map(map)).collect();
    let mut faces: Vec<[u32; 3]> = initial.faces.iter().map(|f| f.map(map)).collect();
    for edge in &mut edges {
        edge.sort_unstable();
    }
    for face in &mut faces {
        face.sort_unstable();
    }
    // Simplices whose vertices merged are degenerate; their lower-dimensional images are listed
    // anyway.
    edges.retain(|e| e[0] < e[1]);
    faces.retain(|f| f[0] < f[1] && f[1] < f[2]);
    edges.sort_unstable();
    edges.dedup();
    faces.sort_unstable();
    faces.dedup();
    let spheres = spheres.iter().zip(&left).filter(|&(_, &l)| l).map(|(&s, _)| s).collect();
    MedialMesh { spheres, edges, faces, contacts: None }
}
