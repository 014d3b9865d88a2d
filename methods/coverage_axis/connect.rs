//! Connects the spheres chosen by their regions on the initial medial mesh.
//!
//! 1. Every sphere chosen is an anchor: a vertex of the initial mesh.
//! 2. Every vertex belongs to the anchor that is nearest along edges, which are as long as the distance of
//!    their centres plus `1e-12`.
//! 3. Two anchors are joined where an edge runs between their regions, three where a face has a corner in
//!    each.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::geometry::trees::PointTree;
use medial::simplifier::{Diagnostics, SimplifyError};

use crate::Result;

/// Added to the length of every edge, as in the authors' code, so that none is 0.
const LEAST_LENGTH: f64 = 1e-12;

/// In place of the anchor of a vertex that none reaches.
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

/// The vertex nearest to the centre of each sphere, each vertex once, and how many spheres had to take
/// another than the nearest.
///
/// # Errors
/// When there are more spheres than vertices.
pub(super) fn anchors(initial: &MedialMesh, chosen: &[Sphere]) -> Result<(Vec<u32>, usize)> {
    let vertices = initial.spheres.len();
    if chosen.len() > vertices {
        return Err(SimplifyError::unsupported(format!(
            "{} spheres: too many to connect on an initial medial mesh of {vertices}; request fewer, or \
             use more samples",
            chosen.len()
        )));
    }
    let tree = PointTree::new(&initial.spheres.iter().map(|ball| ball.centre).collect::<Vec<_>>());
    let mut is_taken = vec![false; vertices];
    let mut moved = 0;
    let mut anchors = Vec::with_capacity(chosen.len());
    for ball in chosen {
        let (mut vertex, squared) = tree.nearest(ball.centre).expect("a mesh has vertices");
        if is_taken[vertex as usize] {
            vertex = nearest_free(&tree, initial, &is_taken, (ball.centre, squared));
            moved += 1;
        }
        is_taken[vertex as usize] = true;
        anchors.push(vertex);
    }
    Ok((anchors, moved))
}

/// The nearest vertex that is free, of those farther than the nearest of all. There is one, as there are
/// not more anchors than vertices.
fn nearest_free(
    tree: &PointTree,
    initial: &MedialMesh,
    is_taken: &[bool],
    (place, nearest): (Vec3, f64),
) -> u32 {
    let mut reach = nearest.max(1e-12);
    loop {
        let found = tree.within(place, reach);
        let free = found.into_iter().filter(|&v| !is_taken[v as usize]);
        let free = free.map(|v| {
            let squared = initial.spheres[v as usize].centre.distance_squared(place);
            (length(squared), v)
        });
        if let Some((_, vertex)) = free.min() {
            return vertex;
        }
        // Twice the radius: the sphere searched holds eight times the volume.
        reach *= 4.0;
    }
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
