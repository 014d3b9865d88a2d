//! Algorithm 1 of the paper: the edge that is absorbed at the least scale first, to the last edge.
//!
//! A collapse leaves the larger sphere as it is, and costs depend on the two spheres of an edge
//! alone. So the cost of an edge never changes while both of its ends are there, a queued edge is
//! out of date only when an end is gone, and of the edges at the survivor only those that it takes
//! over are to be queued. Faces play no part in the order; they follow from it
//! ([`medial::complex::collapse::Hierarchy`]).
//!
//! The adjacency is a list for each sphere. An entry may name a sphere that is gone; it stands for
//! the one that absorbed it, found by the paths of a disjoint-set forest. A list is read once, when
//! its sphere is absorbed: what is left of it, each neighbour once, is then hung on the list of the
//! survivor, in the same memory. No other list is touched.

use medial::complex::collapse::{LazyHeap, Prioritised, Step};
use medial::complex::{MedialMesh, Sphere};
use medial::simplifier::{RunContext, SimplifyError};
use rayon::prelude::*;

use super::cost::{Key, absorbed_first};

/// Collapses between two reports of progress.
const REPORT_EVERY: usize = 4096;

/// Edges that one task evaluates.
const TASK: usize = 4096;

/// An edge in the queue.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    key: Key,
    /// Ascending.
    ends: [u32; 2],
}

impl Candidate {
    fn new([a, b]: [u32; 2], spheres: [Sphere; 2]) -> Self {
        Self { key: Key::of(spheres), ends: [a.min(b), a.max(b)] }
    }
}

impl Prioritised for Candidate {
    #[inline]
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        self.key.cmp(&other.key).then(self.ends.cmp(&other.ends))
    }

    #[inline]
    fn is_before(&self, other: &Self) -> bool {
        // As one number: without a branch.
        let whole = |c: &Self| {
            let ends = u64::from(c.ends[0]) << 32 | u64::from(c.ends[1]);
            u128::from(c.key.bits()) << 64 | u128::from(ends)
        };
        whole(self) < whole(other)
    }
}

/// All collapses, first to last, until no edge is left. Cost `O(n log n)` for degrees that are
/// bounded in the mean.
///
/// # Errors
/// [`SimplifyError::Cancelled`] when the run was cancelled.
pub(super) fn contract(mesh: &MedialMesh, run: &RunContext) -> Result<Vec<Step>, SimplifyError> {
    let spheres = &mesh.spheres;
    let total = spheres.len();
    let evaluate = |&ends: &[u32; 2]| Candidate::new(ends, ends.map(|v| spheres[v as usize]));
    let candidates = mesh.edges.par_iter().with_min_len(TASK).map(evaluate).collect();
    let mut queue = LazyHeap::from_items(candidates);
    let mut graph = Graph::new(mesh);
    let mut steps = Vec::with_capacity(total);
    while let Some(cheapest) = queue.pop(|edge: &Candidate| graph.has(edge.ends)) {
        let [removed, kept] = absorbed_first(cheapest.ends, |v| spheres[v as usize].radius);
        let survivor = spheres[kept as usize];
        graph.absorb(removed, kept, |neighbour| {
            let ends = [kept, neighbour];
            queue.push(Candidate::new(ends, [survivor, spheres[neighbour as usize]]));
        });
        steps.push(Step { removed, kept, cost: cheapest.key.cost() });
        if steps.len().is_multiple_of(REPORT_EVERY) {
            run.step(steps.len(), total)?;
        }
    }
    run.step(total, total)?;
    Ok(steps)
}

/// The edges of the spheres that are left.
struct Graph {
    nodes: Vec<Node>,
    /// Segment `v` began as the list of sphere `v`.
    segments: Vec<Segment>,
    entries: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Node {
    /// The sphere that absorbed this one, or one that absorbed that; itself while it is left.
    parent: u32,
    /// The sphere at whose absorption this one was last met as a neighbour.
    met_by: u32,
}

/// Part of a list.
#[derive(Clone, Copy)]
struct Segment {
    start: u32,
    len: u32,
    next: u32,
    /// The last segment, in the first one of a list.
    last: u32,
}

/// Absent index of a segment.
const NONE: u32 = u32::MAX;

impl Graph {
    fn new(mesh: &MedialMesh) -> Self {
        let total = 2 * mesh.edges.len();
        assert!(u32::try_from(total).is_ok(), "more than 2^32 incidences");
        let mut segments: Vec<_> = (0..mesh.spheres.len() as u32)
            .map(|v| Segment { start: 0, len: 0, next: NONE, last: v })
            .collect();
        for &v in mesh.edges.as_flattened() {
            segments[v as usize].len += 1;
        }
        let mut start = 0;
        for segment in &mut segments {
            segment.start = start;
            start += std::mem::take(&mut segment.len);
        }
        let mut entries = vec![0; total];
        for &[a, b] in &mesh.edges {
            for [v, neighbour] in [[a, b], [b, a]] {
                let segment = &mut segments[v as usize];
                entries[(segment.start + segment.len) as usize] = neighbour;
                segment.len += 1;
            }
        }
        let node = |v: u32| Node { parent: v, met_by: NONE };
        Self { nodes: (0..mesh.spheres.len() as u32).map(node).collect(), segments, entries }
    }

    /// Whether both ends of what was once an edge are left: then it still is one.
    #[inline]
    fn has(&self, ends: [u32; 2]) -> bool {
        ends.iter().all(|&v| self.nodes[v as usize].parent == v)
    }

    /// The sphere that a sphere is now part of.
    #[inline]
    fn find(&mut self, mut v: u32) -> u32 {
        loop {
            let parent = self.nodes[v as usize].parent;
            if parent == v {
                return v;
            }
            let grandparent = self.nodes[parent as usize].parent;
            self.nodes[v as usize].parent = grandparent;
            v = grandparent;
        }
    }

    /// Collapses the edge between two spheres and calls `visit` with each other neighbour of the
    /// removed one, once: new neighbours of the kept one, and some that it had already.
    #[inline]
    fn absorb(&mut self, removed: u32, kept: u32, mut visit: impl FnMut(u32)) {
        for v in [removed, kept] {
            self.nodes[v as usize].met_by = removed;
        }
        self.nodes[removed as usize].parent = kept;
        // What is left is written over what was read, in the same segments.
        let (mut target, mut written) = (removed, 0);
        let mut source = removed;
        while source != NONE {
            let Segment { start, len, next, .. } = self.segments[source as usize];
            for index in start..start + len {
                let neighbour = self.find(self.entries[index as usize]);
                let node = &mut self.nodes[neighbour as usize];
                if node.met_by == removed {
                    continue;
                }
                node.met_by = removed;
                visit(neighbour);
                while written == self.segments[target as usize].len {
                    (target, written) = (self.segments[target as usize].next, 0);
                }
                let place = self.segments[target as usize].start + written;
                self.entries[place as usize] = neighbour;
                written += 1;
            }
            source = next;
        }
        let end = &mut self.segments[target as usize];
        (end.len, end.next) = (written, NONE);
        let tail = self.segments[kept as usize].last;
        self.segments[tail as usize].next = removed;
        self.segments[kept as usize].last = target;
    }
}
