//! Connects the spheres chosen by their regions on the initial medial mesh.
//!
//! 1. Every sphere chosen is an anchor: a vertex of the initial mesh.
//! 2. Every vertex belongs to the anchor that is nearest along edges, which are as long as the distance of
//!    their centres plus `1e-12`.
//! 3. Two anchors are joined where an edge runs between their regions, three where a face has a corner in
//!    each.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use medial::complex::{MedialMesh, Sphere};
use medial::simplifier::Diagnostics;

use crate::Result;

/// Length added to every edge, as in the authors' code, so that none is 0.
const LEAST_LENGTH: f64 = 1e-12;

/// Anchor of a vertex that none reaches.
const NO_ANCHOR: u32 = u32::MAX;

/// A distance that orders by its value: none is negative, so that the bits ascend with it.
type Length = u64;

/// The complex of the spheres chosen, in their order. `anchors` are their vertices, each once.
///
/// # Errors
/// When a sphere is not valid.
///
/// # Cost
/// `O((V + E) log V + F)` of the initial mesh.
pub(super) fn by_regions(
    initial: &MedialMesh,
    anchors: &[u32],
    chosen: Vec<Sphere>,
    diagnostics: &mut Diagnostics,
) -> Result<MedialMesh> {
    let anchor_of = regions(initial, anchors);
    let lost = anchor_of.iter().filter(|&&anchor| anchor == NO_ANCHOR).count();
    diagnostics.count("vertices_that_no_anchor_reaches", lost);
    if lost > 0 {
        diagnostics.warn(format!(
            "parts of the initial medial mesh without a sphere were lost ({lost} vertices); use more \
             samples"
        ));
    }
    let edges = initial.edges.iter().map(|edge| edge.map(|v| anchor_of[v as usize]));
    // Simplices within one region shrink to a sphere or an edge that others give.
    let edges = edges.filter(|&[a, b]| a != b).collect();
    let faces = initial.faces.iter().map(|face| face.map(|v| anchor_of[v as usize]));
    let faces = faces.filter(|&[a, b, c]| a != b && b != c && a != c).collect();
    Ok(MedialMesh::from_simplices(chosen, edges, faces)?)
}

/// The place in `anchors` of the nearest one along edges, for every vertex; [`NO_ANCHOR`] where none is
/// connected. Of equal distances the smaller place.
pub(super) fn regions(initial: &MedialMesh, anchors: &[u32]) -> Vec<u32> {
    let count = initial.spheres.len();
    let (start, neighbours) = adjacency(&initial.edges, count);
    let mut reached: Vec<(f64, u32)> = vec![(f64::INFINITY, NO_ANCHOR); count];
    let mut heap = BinaryHeap::new();
    for (label, &vertex) in anchors.iter().enumerate() {
        reached[vertex as usize] = (0.0, label as u32);
        heap.push(Reverse((length(0.0), label as u32, vertex)));
    }
    while let Some(Reverse((distance, label, vertex))) = heap.pop() {
        let (best, owner) = reached[vertex as usize];
        // A shorter way was found after this one was queued.
        if (distance, label) != (length(best), owner) {
            continue;
        }
        for &next in &neighbours[start[vertex as usize]..start[vertex as usize + 1]] {
            let [from, to] = [vertex, next].map(|v| initial.spheres[v as usize].centre);
            let further = best + from.distance(to) + LEAST_LENGTH;
            if (further, label) < reached[next as usize] {
                reached[next as usize] = (further, label);
                heap.push(Reverse((length(further), label, next)));
            }
        }
    }
    reached.into_iter().map(|(_, label)| label).collect()
}

fn length(distance: f64) -> Length {
    distance.to_bits()
}

/// The neighbours of each vertex, one after the other, and where those of each begin.
fn adjacency(edges: &[[u32; 2]], count: usize) -> (Vec<usize>, Vec<u32>) {
    let mut start = vec![0; count + 1];
    edges.iter().flatten().for_each(|&v| start[v as usize + 1] += 1);
    (0..count).for_each(|v| start[v + 1] += start[v]);
    // Where the next neighbour of each vertex goes; `start` itself must stay.
    let mut next = start.clone();
    let mut neighbours = vec![0; 2 * edges.len()];
    for &[a, b] in edges {
        for (from, to) in [(a, b), (b, a)] {
            neighbours[next[from as usize]] = to;
            next[from as usize] += 1;
        }
    }
    (start, neighbours)
}
