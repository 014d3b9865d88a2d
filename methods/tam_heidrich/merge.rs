//! Step 1, section 3: duplicate vertices of the axis are one.
//!
//! Several polar balls pass through one sample, so that the boundary of their union has several corners
//! there, and the axis several vertices where the exact one has one, slits between them, and sheets
//! that are joined or cut along every seam. The paper merges corners by the samples that tetrahedra
//! share. Perturbed balls meet near samples only, so here it is the vertices that are merged, by their
//! distance. On a box sampled on a grid their distances have a gap: 60 % are below a thousandth of the
//! radius, 0.4 % between that and a hundredth. On curved shapes there is no gap, and many duplicates are left.
//!
//! 1. Take the edges not longer than `merge` times the smaller radius of their ends, the shortest first.
//! 2. Contract each to its first end, centres of balls being first, if that keeps the homotopy type
//!    ([`CollapseComplex::keeps_homotopy`]).
//! 3. From 1 on until none can be.
//!
//! A sliver whose short side is contracted leaves an edge, which stays as a curve where nothing else has it.
//! On the built-in double torus these are two.

use medial::complex::MedialMesh;
use medial::complex::collapse::CollapseComplex;
use medial::simplifier::{RunContext, SimplifyError};

/// The mesh with duplicate vertices merged, and for each sphere of `mesh` the one that it went into.
pub(super) fn merged(
    mesh: &MedialMesh,
    merge: f64,
    run: &RunContext,
) -> Result<(MedialMesh, Vec<u32>), SimplifyError> {
    let mut complex = CollapseComplex::from_mesh(mesh);
    let mut into: Vec<u32> = (0..mesh.spheres.len() as u32).collect();
    let mut done = 0;
    // Spheres at which something changed in the pass before: elsewhere the answers are the same.
    let mut changed: Vec<u32> = complex.vertices().collect();
    while !changed.is_empty() {
        let edges = short_edges(&complex, &changed, merge);
        changed.clear();
        for [kept, removed] in edges {
            let is_edge = complex.is_alive(kept)
                && complex.is_alive(removed)
                && complex.neighbours(removed).contains(&kept);
            if is_edge && complex.keeps_homotopy(kept, removed) {
                let sphere = complex.sphere(kept);
                complex.collapse(kept, removed, sphere);
                into[removed as usize] = kept;
                changed.push(kept);
                changed.extend(complex.neighbours(kept));
                done += 1;
                if done % 4096 == 0 {
                    run.step(done, mesh.spheres.len())?;
                }
            }
        }
        changed.retain(|&v| complex.is_alive(v));
        changed.sort_unstable();
        changed.dedup();
    }
    let mut number = vec![u32::MAX; mesh.spheres.len()];
    complex.vertices().zip(0..).for_each(|(old, new)| number[old as usize] = new);
    // What a sphere went into is smaller, so that one pass finds the last of each chain.
    for v in 0..into.len() {
        into[v] = if into[v] == v as u32 { number[v] } else { into[into[v] as usize] };
    }
    Ok((complex.to_mesh(), into))
}

/// The short edges at some spheres as ascending pairs, the shortest first.
fn short_edges(complex: &CollapseComplex, at: &[u32], merge: f64) -> Vec<[u32; 2]> {
    let mut short: Vec<(f64, [u32; 2])> = Vec::new();
    for &v in at {
        let a = complex.sphere(v);
        for &w in complex.neighbours(v) {
            let b = complex.sphere(w);
            let length = a.centre.distance(b.centre);
            if length <= merge * a.radius.min(b.radius) {
                short.push((length, [v.min(w), v.max(w)]));
            }
        }
    }
    short.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    short.dedup();
    short.into_iter().map(|s| s.1).collect()
}
