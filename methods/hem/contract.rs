//! The contraction: collapses the edge of smallest Hausdorff error; the survivor does not move.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use medial::complex::MedialMesh;
use medial::complex::collapse::{Candidate, CollapseComplex, CollapseQueue};
use medial::simplifier::{Diagnostics, RunContext};
use rayon::prelude::*;

use super::SampleLists;
use super::edge::{Edge, Ground, NONE, Star};
use crate::Result;

/// Collapses between two reports of progress.
const REPORT_EVERY: usize = 256;

/// Edges per parallel job. Large, because each job allocates scratch of the size of the complex.
const JOB: usize = 4096;

/// A medial mesh under contraction.
pub(super) struct Contraction {
    /// The complex as it is now, with a record of the collapses.
    pub complex: CollapseComplex,
    /// The samples as they are assigned now.
    pub samples: SampleLists,
    edges: Edges,
    queue: CollapseQueue,
    star: Star,
    /// Largest error of a collapse so far.
    pub largest: f64,
    rejected_by_link_condition: usize,
    rejected_by_inversion: usize,
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stop {
    /// At a number of spheres.
    Spheres(usize),
    /// Before the first collapse of a larger error.
    Error(f64),
}

/// The next collapse.
struct Taken {
    error: f64,
    ends: [u32; 2],
    /// The end (0 or 1) that survives.
    survivor: usize,
}

/// The state before a collapse of everything that it removes.
struct Change {
    kept: u32,
    removed: u32,
    /// Neighbours of the removed vertex, ascending, without the kept one.
    around: Vec<u32>,
    /// Sides opposite the removed vertex, without those of faces with both ends.
    sides: Vec<[u32; 2]>,
    /// The witnesses of the removed vertex's edges, in the order of `around`.
    witnesses: Vec<[u32; 2]>,
}

impl Contraction {
    /// Step 1: the samples of each sphere and the errors of all edges.
    pub(super) fn new(mesh: &MedialMesh, samples: SampleLists, run: &RunContext) -> Result<Self> {
        let mut contraction = Self {
            complex: CollapseComplex::from_mesh(mesh).recording(),
            samples,
            edges: Edges::default(),
            queue: CollapseQueue::default(),
            star: Star::new(mesh.spheres.len()),
            largest: 0.0,
            rejected_by_link_condition: 0,
            rejected_by_inversion: 0,
        };
        contraction.evaluate_all(&mesh.edges, run)?;
        Ok(contraction)
    }

    fn evaluate_all(&mut self, all: &[[u32; 2]], run: &RunContext) -> Result<()> {
        let ground = self.ground();
        let vertices = self.samples.spheres();
        let jobs: Result<Vec<Vec<Edge>>> = all
            .par_chunks(JOB)
            .map(|chunk| {
                let mut star = Star::new(vertices);
                let evaluated = chunk.iter().map(|&ends| {
                    let mut edge = Edge::unknown(NONE);
                    edge.evaluate(&ground, ends, f64::INFINITY, &mut star);
                    edge.queued = edge.cost();
                    edge
                });
                let evaluated = evaluated.collect();
                run.check()?;
                Ok(evaluated)
            })
            .collect();
        // Jobs come back in order, so candidates line up with edges for any thread order.
        let edges = jobs?.concat();
        let candidates = all
            .iter()
            .zip(&edges)
            .map(|(&ends, edge)| candidate(ground.complex, ends, edge.queued));
        self.queue = CollapseQueue::from_candidates(candidates.collect());
        self.edges = all.iter().copied().zip(edges).collect();
        Ok(())
    }

    fn ground(&self) -> Ground<'_> {
        Ground { complex: &self.complex, samples: &self.samples }
    }

    /// The stored errors of an edge.
    #[cfg(test)]
    pub(super) fn known(&self, ends: [u32; 2]) -> Option<Edge> {
        self.edges.get(&ends).copied()
    }

    /// Steps 2 to 4, until `stop`, or until no edge may be collapsed.
    pub(super) fn run_to(&mut self, stop: Stop, run: &RunContext) -> Result<()> {
        let target = if let Stop::Spheres(target) = stop { target } else { 1 };
        let bound = if let Stop::Error(bound) = stop { bound } else { f64::INFINITY };
        let total = self.complex.sphere_count().saturating_sub(target);
        let first = self.complex.record().len();
        while self.complex.sphere_count() > target {
            run.check()?;
            let Some(next) = self.cheapest(bound) else { break };
            let Taken { error, ends, survivor } = next;
            self.collapse(ends, survivor);
            self.largest = self.largest.max(error);
            let done = self.complex.record().len() - first;
            if done.is_multiple_of(REPORT_EVERY) {
                run.step(done, total)?;
            }
        }
        run.step(total, total)
    }

    /// Step 2: the edge of smallest error, in its better direction, if it is within the bound.
    fn cheapest(&mut self, bound: f64) -> Option<Taken> {
        loop {
            let candidate = self.queue.pop(&self.complex)?;
            let (error, ends) = (candidate.cost(), candidate.ends());
            let edge = self.edges[&ends];
            if edge.queued.total_cmp(&error).is_ne() {
                // An old entry: the edge was queued again at another cost.
                continue;
            }
            if error > bound {
                // Costs are lower bounds, so no other edge is within; a later call may continue here.
                self.queue.push(candidate);
                return None;
            }
            if let Some(survivor) = edge.decided() {
                return Some(Taken { error, ends, survivor });
            }
            self.refine(ends, edge);
        }
    }

    /// Bars the directions that fail a test, evaluates the others, and queues the edge again.
    fn refine(&mut self, ends: [u32; 2], mut edge: Edge) {
        if !edge.tested {
            self.bar(ends, &mut edge);
        }
        if edge.is_open() {
            // Beyond the next candidate the exact error does not matter yet.
            let cutoff = self.queue.peek(&self.complex).map_or(f64::INFINITY, |next| next.cost());
            let Self { complex, samples, star, .. } = self;
            edge.evaluate(&Ground { complex, samples }, ends, cutoff, star);
        }
        // Its candidate was popped; a barred edge is not queued again before a collapse renews it.
        edge.queued = f64::INFINITY;
        enqueue(&mut self.queue, &self.complex, ends, &mut edge);
        self.edges.insert(ends, edge);
    }

    /// Tests the topology for the edge and the inversion for each direction; bars those that fail.
    fn bar(&mut self, ends: [u32; 2], edge: &mut Edge) {
        let [a, b] = ends;
        edge.tested = true;
        if !self.complex.keeps_homotopy(a, b) {
            self.rejected_by_link_condition += 1;
            edge.bar(0);
            edge.bar(1);
            return;
        }
        for (survivor, kept) in ends.into_iter().enumerate() {
            let centre = self.complex.sphere(kept).centre;
            if self.complex.folded_face(a, b, centre).is_some() {
                self.rejected_by_inversion += 1;
                edge.bar(survivor);
            }
        }
    }

    /// Steps 3 and 4: the collapse, the samples, the edges whose stars it changes.
    fn collapse(&mut self, ends: [u32; 2], survivor: usize) {
        // Before the collapse, which retires the link of the removed vertex.
        let change = self.take_apart(ends[survivor], ends[1 - survivor]);
        let Change { kept, removed, .. } = change;
        self.complex.collapse(kept, removed, self.complex.sphere(kept));
        self.samples.assign(removed, kept);
        let all = self.complex.neighbours(kept).len();
        // By index, because renewing an edge borrows the rest of `self`; the complex stays as it is.
        for index in 0..all {
            let other = self.complex.neighbours(kept)[index];
            self.renew_at_survivor(&change, other);
        }
        for &v in &change.around {
            for index in 0..self.complex.neighbours(v).len() {
                let other = self.complex.neighbours(v)[index];
                // An edge between two neighbours of the removed vertex is renewed once.
                if other != kept && (v < other || change.around.binary_search(&other).is_err()) {
                    self.renew_around(&change, [v, other]);
                }
            }
        }
    }

    /// Collects the changes of a collapse, and forgets the edges of the removed vertex.
    fn take_apart(&mut self, kept: u32, removed: u32) -> Change {
        let mut around = self.complex.neighbours(removed).to_vec();
        around.retain(|&v| v != kept);
        around.sort_unstable();
        let mut sides = self.complex.opposite_sides(removed).to_vec();
        sides.retain(|side| !side.contains(&kept));
        self.edges.remove(&ascending(kept, removed));
        let witnesses = around.iter().map(|&v| {
            let edge = self.edges.remove(&ascending(v, removed)).expect("every edge is stored");
            edge.into.map(|directed| directed.witness)
        });
        let witnesses = witnesses.collect();
        Change { kept, removed, around, sides, witnesses }
    }

    /// Renews an edge of the survivor, whose star gained that of the removed vertex. Its candidate is
    /// outdated, because the collapse changed the stamp of the survivor.
    fn renew_at_survivor(&mut self, change: &Change, other: u32) {
        let Self { complex, samples, edges, queue, star, .. } = self;
        let ground = Ground { complex, samples };
        let ends = ascending(change.kept, other);
        let edge = edges.entry(ends).or_insert_with(|| {
            // It was an edge of the removed vertex: the witnesses it had are good first guesses.
            let place = change.around.binary_search(&other).expect("a neighbour of one of both");
            let mut edge = Edge::unknown(NONE);
            edge.sound(&ground, ends, change.witnesses[place], star);
            edge
        });
        // Simplices with `other` itself vanish from the hypothetical star when the edge collapses.
        let added = change.around.iter().map(|&x| [x, NONE]);
        let added = added.chain(change.sides.iter().copied());
        let added = added.filter(|simplex| !simplex.contains(&other));
        edge.renew(&ground, ends, change.removed, added);
        edge.queued = f64::INFINITY;
        enqueue(queue, complex, ends, edge);
    }

    /// Renews another edge of a neighbour of the removed vertex: in the simplices of its star the
    /// survivor has replaced the removed vertex.
    fn renew_around(&mut self, change: &Change, [v, other]: [u32; 2]) {
        let Self { complex, samples, edges, queue, .. } = self;
        let ground = Ground { complex, samples };
        let ends = ascending(v, other);
        let edge = edges.get_mut(&ends).expect("every edge is stored");
        let is_end = |x: u32| x == v || x == other;
        // A side with one end is a new slab of that end's star; one with both is the edge itself.
        let opposite = change.sides.iter().filter_map(|&[x, y]| match (is_end(x), is_end(y)) {
            (true, false) => Some([change.kept, y]),
            (false, true) => Some([change.kept, x]),
            _ => None,
        });
        let added = std::iter::once([change.kept, NONE]).chain(opposite);
        edge.renew(&ground, ends, change.removed, added);
        enqueue(queue, complex, ends, edge);
    }

    /// Counts of the whole run so far.
    pub(super) fn diagnose(&self, diagnostics: &mut Diagnostics) {
        diagnostics.count("collapses", self.complex.record().len());
        diagnostics.count("rejected_by_link_condition", self.rejected_by_link_condition);
        diagnostics.count("rejected_by_inversion", self.rejected_by_inversion);
    }
}

/// An edge at a cost. Of equal costs, mostly zeros, the shorter edge comes first. Ordered by ids,
/// clusters of coincident spheres would grow around one hub and end in knots.
fn candidate(complex: &CollapseComplex, ends: [u32; 2], cost: f64) -> Candidate {
    let [a, b] = ends.map(|v| complex.sphere(v).centre);
    Candidate::new(complex, ends, cost, a.distance(b))
}

/// Queues an edge if its cost is below the one that it is queued at. A larger cost waits until the
/// edge is popped: the queued one is still a lower bound.
fn enqueue(queue: &mut CollapseQueue, complex: &CollapseComplex, ends: [u32; 2], edge: &mut Edge) {
    let cost = edge.cost();
    if !edge.is_barred() && cost < edge.queued {
        edge.queued = cost;
        queue.push(candidate(complex, ends, cost));
    }
}

// The table of the edges, by their ends.

/// Edges by their ends, ascending. Never iterated.
pub(super) type Edges = HashMap<[u32; 2], Edge, BuildHasherDefault<EndsHasher>>;

/// Two ends in order.
pub(super) fn ascending(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Hash of two ids: multiply and mix.
#[derive(Default)]
pub(super) struct EndsHasher(u64);

impl Hasher for EndsHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u32(u32::from(byte));
        }
    }

    #[inline]
    fn write_u32(&mut self, id: u32) {
        let mixed = (self.0 ^ u64::from(id)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = mixed ^ (mixed >> 29);
    }

    fn write_usize(&mut self, _length: usize) {
        // The length of the array, which is always two.
    }
}
