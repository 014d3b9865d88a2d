//! Views on a hierarchy: one stage, and what lies between two.

use super::Hierarchy;
use crate::complex::MedialMesh;

/// The mesh after a number of collapses. Ids are those of the initial mesh.
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

    /// Number of collapses up to here.
    pub fn index(&self) -> usize {
        self.stage
    }

    /// Number of spheres. Cost `O(1)`, as of the other counts.
    pub fn sphere_count(&self) -> usize {
        self.hierarchy.ranks.len() - self.stage
    }

    /// Number of edges.
    pub fn edge_count(&self) -> usize {
        self.hierarchy.edges.count(self.stage)
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.hierarchy.faces.count(self.stage)
    }

    /// Whether a sphere of the initial mesh is left.
    pub fn has_sphere(&self, vertex: u32) -> bool {
        self.hierarchy.ranks[vertex as usize] as usize >= self.stage
    }

    /// The spheres left, ascending. Cost: `k log k` for `k` of them.
    pub fn spheres(&self) -> Vec<u32> {
        let Hierarchy { ranks, by_rank, .. } = self.hierarchy;
        let count = self.sphere_count();
        // Sorting few costs less than passing over all.
        if count < ranks.len() / 16 {
            let mut left = by_rank[self.stage..].to_vec();
            left.sort_unstable();
            return left;
        }
        let mut left = Vec::with_capacity(count);
        left.extend((0..ranks.len() as u32).filter(|&v| self.has_sphere(v)));
        left
    }

    /// The edges, as ascending pairs, in no particular but a deterministic order.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let mut edges = Vec::with_capacity(self.edge_count());
        let named = |edge| edges.push(self.hierarchy.named(edge));
        self.hierarchy.edges.for_each(self.stage, named);
        edges
    }

    /// The faces, as ascending triples, in no particular but a deterministic order.
    pub fn faces(&self) -> Vec<[u32; 3]> {
        let mut faces = Vec::with_capacity(self.face_count());
        let named = |face| faces.push(self.hierarchy.named(face));
        self.hierarchy.faces.for_each(self.stage, named);
        faces
    }

    /// The stage as a mesh of its own, in canonical form, without contacts; the spheres keep their
    /// order. Bit for bit that of [`super::super::replay`]. Cost: `k log d` for `k` simplices at
    /// the stage and degrees up to `d`.
    pub fn to_mesh(&self) -> MedialMesh {
        if self.stage == 0 {
            let MedialMesh { spheres, edges, faces, .. } = self.hierarchy.initial.as_ref();
            let (spheres, edges, faces) = (spheres.clone(), edges.clone(), faces.clone());
            return MedialMesh { spheres, edges, faces, contacts: None };
        }
        let Hierarchy { initial, ranks, edges, faces, .. } = self.hierarchy;
        let left = self.spheres();
        let mut new = vec![0; ranks.len()];
        for (place, &vertex) in (0..).zip(&left) {
            new[ranks[vertex as usize] as usize] = place;
        }
        let (edges, faces) = rayon::join(
            || {
                let mut all = Vec::with_capacity(self.edge_count());
                edges.for_each(self.stage, |edge| all.push(renumbered(edge, &new)));
                in_order(&all, left.len())
            },
            || {
                let mut all = Vec::with_capacity(self.face_count());
                faces.for_each(self.stage, |face| all.push(renumbered(face, &new)));
                in_order(&all, left.len())
            },
        );
        let spheres = left.iter().map(|&vertex| initial.spheres[vertex as usize]).collect();
        MedialMesh { spheres, edges, faces, contacts: None }
    }
}

impl Hierarchy {
    /// A simplex of a layer in the ids of the initial mesh.
    fn named<const K: usize>(&self, simplex: [u32; K]) -> [u32; K] {
        renumbered(simplex, &self.by_rank)
    }
}

#[inline]
fn renumbered<const K: usize>(simplex: [u32; K], new: &[u32]) -> [u32; K] {
    let mut simplex = simplex.map(|v| new[v as usize]);
    simplex.sort_unstable();
    simplex
}

/// Simplices in lexicographic order: dealt out by their first vertices, then sorted at each.
fn in_order<const K: usize>(simplices: &[[u32; K]], vertices: usize) -> Vec<[u32; K]> {
    let mut places = vec![0_u32; vertices + 1];
    for simplex in simplices {
        places[simplex[0] as usize + 1] += 1;
    }
    for vertex in 0..vertices {
        places[vertex + 1] += places[vertex];
    }
    let mut sorted = vec![[0; K]; simplices.len()];
    for &simplex in simplices {
        let place = &mut places[simplex[0] as usize];
        sorted[*place as usize] = simplex;
        *place += 1;
    }
    // Each place has moved on to where the next vertex began.
    let mut start = 0;
    for &end in &places[..vertices] {
        sorted[start..end as usize].sort_unstable();
        start = end as usize;
    }
    sorted
}

/// What comes and goes on the way from one stage to another, in either direction. Each list is
/// in a deterministic order, in the ids of the initial mesh, and costs in proportion to what the
/// collapses between the stages change, or to the finer stage, whichever is less.
#[derive(Clone, Copy, Debug)]
pub struct Change<'h> {
    hierarchy: &'h Hierarchy,
    fine: usize,
    coarse: usize,
    backward: bool,
}

impl<'h> Change<'h> {
    pub(super) fn new(hierarchy: &'h Hierarchy, from: usize, to: usize) -> Self {
        let last = hierarchy.last_stage();
        assert!(from.max(to) <= last, "stages {from} and {to} of {last}");
        Self { hierarchy, fine: from.min(to), coarse: from.max(to), backward: from > to }
    }

    /// The spheres that go, in the order of the collapses.
    pub fn spheres_removed(&self) -> &'h [u32] {
        if self.backward { &[] } else { self.spheres_between() }
    }

    /// The spheres that come, the one that was removed last at the end.
    pub fn spheres_added(&self) -> &'h [u32] {
        if self.backward { self.spheres_between() } else { &[] }
    }

    fn spheres_between(&self) -> &'h [u32] {
        &self.hierarchy.by_rank[self.fine..self.coarse]
    }

    /// The edges that go.
    pub fn edges_removed(&self) -> Vec<[u32; 2]> {
        self.edges(!self.backward)
    }

    /// The edges that come.
    pub fn edges_added(&self) -> Vec<[u32; 2]> {
        self.edges(self.backward)
    }

    /// The faces that go.
    pub fn faces_removed(&self) -> Vec<[u32; 3]> {
        self.faces(!self.backward)
    }

    /// The faces that come.
    pub fn faces_added(&self) -> Vec<[u32; 3]> {
        self.faces(self.backward)
    }

    /// The edges of the finer stage alone, or of the coarser one.
    fn edges(&self, of_fine: bool) -> Vec<[u32; 2]> {
        let (layer, mut edges) = (&self.hierarchy.edges, Vec::new());
        let named = |edge| edges.push(self.hierarchy.named(edge));
        if of_fine {
            layer.for_each_dying(self.fine, self.coarse, named);
        } else {
            layer.for_each_arising(self.fine, self.coarse, named);
        }
        edges
    }

    /// The faces of the finer stage alone, or of the coarser one.
    fn faces(&self, of_fine: bool) -> Vec<[u32; 3]> {
        let (layer, mut faces) = (&self.hierarchy.faces, Vec::new());
        let named = |face| faces.push(self.hierarchy.named(face));
        if of_fine {
            layer.for_each_dying(self.fine, self.coarse, named);
        } else {
            layer.for_each_arising(self.fine, self.coarse, named);
        }
        faces
    }
}
