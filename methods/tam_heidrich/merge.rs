//! Step 1, section 3: merges vertices of the axis that are still nearly at one position.
//!
//! Several polar balls pass through one sample, so that the boundary of their perturbed union has several
//! corners there, and the axis several vertices where the exact one has one. Those are merged by their
//! distance. On a box sampled on a grid the distances have a gap, on curved shapes there is none.
//!
//! 1. Take the edges not longer than `merge` times the smaller radius of their ends, the shortest first.
//! 2. Contract each to its first end, centres of balls being first, if that keeps the homotopy type
//!    ([`CollapseComplex::keeps_homotopy`]).
//! 3. From 1 on until none can be.
//!
//! A sliver whose short side is contracted leaves an edge, which stays as a curve where nothing else has it.

use medial::complex::MedialMesh;
use medial::complex::collapse::CollapseComplex;
use medial::simplifier::{RunContext, SimplifyError};
use rayon::prelude::*;

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
    // Spheres merge into smaller ids, so that one ascending pass resolves every chain.
    for v in 0..into.len() {
        into[v] = if into[v] == v as u32 { number[v] } else { into[into[v] as usize] };
    }
    Ok((complex.to_mesh(), into))
}

/// The short edges at some spheres as ascending pairs, the shortest first.
fn short_edges(complex: &CollapseComplex, at: &[u32], merge: f64) -> Vec<[u32; 2]> {
    let of_sphere = |&v: &u32| {
        let a = complex.sphere(v);
        let lengths = complex.neighbours(v).iter().map(move |&w| {
            let b = complex.sphere(w);
            (a.centre.distance(b.centre), merge * a.radius.min(b.radius), w)
        });
        let short = lengths.filter(|&(length, most, _)| length <= most);
        // The bits of numbers that are not negative are in their order.
        short.map(move |(length, _, w)| (length.to_bits(), [v.min(w), v.max(w)]))
    };
    let mut short: Vec<(u64, [u32; 2])> =
        at.par_iter().with_min_len(1 << 10).flat_map_iter(of_sphere).collect();
    short.par_sort_unstable();
    short.dedup();
    short.into_iter().map(|s| s.1).collect()
}
