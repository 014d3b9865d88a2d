//! One stage of a hierarchy.

use std::ops::Range;

use super::Hierarchy;
use crate::complex::MedialMesh;

/// The mesh after a number of collapses, its vertices named by their ranks.
#[derive(Clone, Copy, Debug)]
pub struct Stage<'h> {
    hierarchy: &'h Hierarchy,
    stage: usize,
}

impl<'h> Stage<'h> {
    pub(super) fn new(hierarchy: &'h Hierarchy, stage: usize) -> Self {
        let last = hierarchy.last_stage();
        assert!(stage <= last, "stage {stage} of {last}");
        Self { hierarchy, stage }
    }

    /// Number of spheres. Cost `O(1)`, like the other counts.
    pub fn sphere_count(&self) -> usize {
        self.hierarchy.by_rank.len() - self.stage
    }

    /// Number of edges.
    pub fn edge_count(&self) -> usize {
        self.hierarchy.edges.count(self.stage)
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.hierarchy.faces.count(self.stage)
    }

    /// The ranks of the spheres. Cost `O(1)`.
    pub fn spheres(&self) -> Range<u32> {
        self.stage as u32..self.hierarchy.by_rank.len() as u32
    }

    /// The edges, as ascending pairs of ranks, in an unspecified but deterministic order. Cost: in
    /// proportion to their number, if the mean degree is bounded.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> + 'h {
        self.hierarchy.edges.at(self.stage)
    }

    /// The faces, as ascending triples of ranks, in an unspecified but deterministic order. Cost as
    /// for the edges.
    pub fn faces(&self) -> impl Iterator<Item = [u32; 3]> + 'h {
        self.hierarchy.faces.at(self.stage)
    }

    /// The stage as a mesh of its own, in canonical form, without contacts; the spheres keep the
    /// order that they have in the initial mesh. Bit for bit the mesh of
    /// [`replay`](super::super::replay). Cost: `O(k log d)` for `k` simplices at the stage and
    /// degrees up to `d`; uses two threads if available.
    pub fn to_mesh(&self) -> MedialMesh {
        let Hierarchy { initial, edges, faces, by_rank, .. } = self.hierarchy;
        if self.stage == 0 {
            let MedialMesh { spheres, edges, faces, .. } = initial.as_ref();
            let (spheres, edges, faces) = (spheres.clone(), edges.clone(), faces.clone());
            return MedialMesh { spheres, edges, faces, contacts: None };
        }
        let left = self.in_initial_order();
        let mut new = vec![0; by_rank.len()];
        for (place, &(_, rank)) in (0..).zip(&left) {
            new[rank as usize] = place;
        }
        let (edges, faces) = rayon::join(
            || in_order(edges.at(self.stage), self.edge_count(), left.len(), &new),
            || in_order(faces.at(self.stage), self.face_count(), left.len(), &new),
        );
        let spheres = left.iter().map(|&(vertex, _)| initial.spheres[vertex as usize]).collect();
        MedialMesh { spheres, edges, faces, contacts: None }
    }

    /// Indices in the initial mesh and ranks of the spheres, by ascending index.
    fn in_initial_order(&self) -> Vec<(u32, u32)> {
        let Hierarchy { ranks, by_rank, .. } = self.hierarchy;
        let mut left = Vec::with_capacity(self.sphere_count());
        // Sorting a few costs less than a pass over all spheres.
        if self.sphere_count() < ranks.len() / 16 {
            left.extend(self.spheres().map(|rank| (by_rank[rank as usize], rank)));
            left.sort_unstable();
        } else {
            let all = (0..).zip(ranks.iter().copied());
            left.extend(all.filter(|&(_, rank)| rank as usize >= self.stage));
        }
        left
    }
}

/// Simplices with their ranks replaced by new numbers, in lexicographic order: a counting sort by the
/// first vertex, then a sort of each short run.
fn in_order<const K: usize>(
    simplices: impl Iterator<Item = [u32; K]>,
    count: usize,
    vertices: usize,
    new: &[u32],
) -> Vec<[u32; K]> {
    let mut renumbered = Vec::with_capacity(count);
    let mut places = vec![0_u32; vertices + 1];
    for simplex in simplices {
        let mut simplex = simplex.map(|rank| new[rank as usize]);
        simplex.sort_unstable();
        places[simplex[0] as usize + 1] += 1;
        renumbered.push(simplex);
    }
    for vertex in 0..vertices {
        places[vertex + 1] += places[vertex];
    }
    let mut sorted = vec![[0; K]; renumbered.len()];
    for simplex in renumbered {
        let place = &mut places[simplex[0] as usize];
        sorted[*place as usize] = simplex;
        *place += 1;
    }
    // After the distribution each place is the end of its run.
    let mut start = 0;
    for &end in &places[..vertices] {
        sorted[start..end as usize].sort_unstable();
        start = end as usize;
    }
    sorted
}
