//! Algorithm 1 of the paper: collapses the edge of least scale, until no edge is left.
//!
//! A collapse does not move the larger sphere, and the cost of an edge depends on its two spheres
//! alone. So the cost never changes while both ends exist, a queued edge is outdated only when an end
//! is gone, and only the edges that the survivor takes over must be queued. Faces do not affect the
//! order; they follow from it ([`medial::complex::collapse::Hierarchy`]).
//!
//! Each sphere has a list of neighbours. An entry may name a sphere that is gone; it stands for the
//! sphere that absorbed it, found through a disjoint-set forest. A list is read once, when its sphere
//! is absorbed. Its remaining neighbours, each once, are then appended to the list of the survivor,
//! in the same memory. No other list is touched.

use medial::complex::collapse::{LazyHeap, Prioritised, Step};
use medial::complex::{MedialMesh, Sphere};
use medial::simplifier::{RunContext, SimplifyError};
use rayon::prelude::*;

use super::cost::{Key, absorbed_first};

/// Collapses between two reports of progress.
const REPORT_EVERY: usize = 4096;

/// Fewest edges that one task evaluates.
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
        // Compared as one number, because a branch per field would be unpredictable.
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
    let mut left = Bits::ones(total);
    while let Some(cheapest) = queue.pop(|edge: &Candidate| edge.ends.iter().all(|&v| left.has(v)))
    {
        // Both ends are left, so their spheres, and with them the cost, are those of the queued edge.
        let [removed, kept] = absorbed_first(cheapest.ends, |v| graph.sphere(v).radius);
        let survivor = graph.sphere(kept);
        graph.absorb(removed, kept, |neighbour, sphere| {
            queue.push(Candidate::new([kept, neighbour], [survivor, sphere]));
        });
        left.clear(removed);
        steps.push(Step { removed, kept, cost: cheapest.key.cost() });
        if steps.len().is_multiple_of(REPORT_EVERY) {
            run.step(steps.len(), total)?;
        }
    }
    run.step(total, total)?;
    Ok(steps)
}

/// A set of spheres, one bit each, so that it fits into the cache.
struct Bits(Vec<u64>);

impl Bits {
    fn ones(len: usize) -> Self {
        Self(vec![u64::MAX; len.div_ceil(64)])
    }

    #[inline]
    fn has(&self, v: u32) -> bool {
        self.0[v as usize / 64] >> (v % 64) & 1 == 1
    }

    #[inline]
    fn clear(&mut self, v: u32) {
        self.0[v as usize / 64] &= !(1 << (v % 64));
    }
}

/// The neighbours of the spheres that are left.
struct Graph {
    nodes: Vec<Node>,
    entries: Vec<u32>,
    /// The result of [`Graph::look_ahead`]; a field to save allocations.
    ahead: Vec<u32>,
}

/// A sphere, with everything that is read of a neighbour in one cache line.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Node {
    sphere: Sphere,
    /// The sphere that absorbed this one, or a later one on the path to the survivor; itself while it
    /// is left.
    parent: u32,
    /// The last absorbed sphere of which this one was a neighbour.
    met_by: u32,
    /// The memory of this sphere's initial list, which later holds a part of the survivor's.
    segment: Segment,
}

/// Part of a list.
#[derive(Clone, Copy)]
struct Segment {
    start: u32,
    len: u32,
    /// The sphere whose segment continues the list.
    next: u32,
    /// In the first segment of a list, the sphere of the last one.
    last: u32,
}

/// Absent id of a sphere.
const NONE: u32 = u32::MAX;

impl Graph {
    fn new(mesh: &MedialMesh) -> Self {
        let total = 2 * mesh.edges.len();
        assert!(u32::try_from(total).is_ok(), "more than 2^32 incidences");
        let mut degrees = vec![0; mesh.spheres.len()];
        for &v in mesh.edges.as_flattened() {
            degrees[v as usize] += 1;
        }
        let mut start = 0;
        let node = |((v, &sphere), degree)| {
            let segment = Segment { start, len: 0, next: NONE, last: v };
            start += degree;
            Node { sphere, parent: v, met_by: NONE, segment }
        };
        let mut nodes: Vec<_> = (0..).zip(&mesh.spheres).zip(degrees).map(node).collect();
        let mut entries = vec![0; total];
        for &[a, b] in &mesh.edges {
            for [v, neighbour] in [[a, b], [b, a]] {
                let segment = &mut nodes[v as usize].segment;
                entries[(segment.start + segment.len) as usize] = neighbour;
                segment.len += 1;
            }
        }
        Self { nodes, entries, ahead: Vec::new() }
    }

    #[inline]
    fn sphere(&self, v: u32) -> Sphere {
        self.nodes[v as usize].sphere
    }

    /// The survivor that a sphere was merged into.
    #[inline]
    fn find(&mut self, mut v: u32) -> u32 {
        loop {
            let parent = self.nodes[v as usize].parent;
            if parent == v {
                return v;
            }
            // Path halving: amortised almost constant, without a second pass.
            let grandparent = self.nodes[parent as usize].parent;
            self.nodes[v as usize].parent = grandparent;
            v = grandparent;
        }
    }

    /// One step from each entry of a segment towards its survivor. The loads are independent, so
    /// their cache misses overlap instead of adding up.
    #[inline]
    fn look_ahead(&mut self, start: u32, len: u32) {
        self.ahead.clear();
        let entries = &self.entries[start as usize..(start + len) as usize];
        self.ahead.extend(entries.iter().map(|&v| self.nodes[v as usize].parent));
    }

    /// Collapses the edge between two spheres and calls `visit` once for each other neighbour of the
    /// removed one, whether or not it was a neighbour of the kept one before.
    #[inline]
    fn absorb(&mut self, removed: u32, kept: u32, mut visit: impl FnMut(u32, Sphere)) {
        // Entries that name either end are then skipped like neighbours met before.
        for v in [removed, kept] {
            self.nodes[v as usize].met_by = removed;
        }
        self.nodes[removed as usize].parent = kept;
        // The remaining neighbours overwrite what was read: writing never overtakes reading.
        let (mut target, mut written) = (removed, 0);
        let mut source = removed;
        while source != NONE {
            let Segment { start, len, next, .. } = self.nodes[source as usize].segment;
            self.look_ahead(start, len);
            for index in 0..len as usize {
                let neighbour = self.find(self.ahead[index]);
                let node = &mut self.nodes[neighbour as usize];
                // Entries that were absorbed by the same sphere name it several times.
                if node.met_by == removed {
                    continue;
                }
                node.met_by = removed;
                visit(neighbour, node.sphere);
                while written == self.nodes[target as usize].segment.len {
                    (target, written) = (self.nodes[target as usize].segment.next, 0);
                }
                let place = self.nodes[target as usize].segment.start + written;
                self.entries[place as usize] = neighbour;
                written += 1;
            }
            source = next;
        }
        let end = &mut self.nodes[target as usize].segment;
        (end.len, end.next) = (written, NONE);
        // Append in constant time; segments behind `target` are empty now and are dropped.
        let tail = self.nodes[kept as usize].segment.last;
        self.nodes[tail as usize].segment.next = removed;
        self.nodes[kept as usize].segment.last = target;
    }
}
