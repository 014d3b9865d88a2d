//! Algorithm 1 of the paper: collapses the cheapest edge, places the merged sphere where its error is
//! least.

use std::collections::HashSet;

use medial::complex::collapse::{Candidate, Collapse, CollapseComplex, CollapseQueue, replay};
use medial::complex::{MedialMesh, Sphere, ZERO_LENGTH, betti, stability_ratio};
use medial::simplifier::{Diagnostics, RunContext};
use rayon::prelude::*;

use super::QmatParams;
use super::quadric::{Skipped, initial_quadrics};
use crate::Result;
use crate::quadric::{Quadric, SINGULAR_RATIO};

/// Collapses between two reports of progress.
const REPORT_EVERY: usize = 4096;

/// Number of edges from which on a star is evaluated in parallel.
const LARGE_STAR: usize = 2048;

/// A medial mesh under contraction.
pub(super) struct Contraction {
    pub params: QmatParams,
    /// The complex as it is now.
    pub complex: CollapseComplex,
    quadrics: Vec<Quadric>,
    queue: CollapseQueue,
    skipped: Skipped,
    pub tally: Tally,
}

/// Counts of popped candidates by outcome.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    collapses: usize,
    postponed: usize,
    held_by_topology: usize,
    /// Collapses that were taken against the link condition.
    pub unlocked: usize,
    held_by_inversion: usize,
}

/// The fate of a popped candidate.
pub(super) enum Decision {
    /// Collapse it to this sphere.
    Collapse(Sphere),
    /// It folds a face over at the optimum and costs more elsewhere: queue it at that cost.
    Postpone(Candidate),
    /// Its collapse would change the topology, until one of these vertices changes.
    Hold(Vec<u32>),
    /// Each placement folds one of these faces over, until they change.
    Fold(Folded),
}

/// Faces that rule out placements of an edge; often one rules out all four placements.
#[derive(Default)]
pub(super) struct Folded(Vec<[u32; 3]>);

impl Folded {
    /// Whether a placement folds a face over: a face found before, or a new one, which is added.
    fn holds(&mut self, complex: &CollapseComplex, [a, b]: [u32; 2], sphere: Sphere) -> bool {
        // Known faces first: one test instead of both stars, and fewer obstacles to wake at.
        if self.0.iter().any(|&face| complex.folds(face, sphere.centre)) {
            return true;
        }
        let new = complex.folded_face(a, b, sphere.centre);
        self.0.extend(new);
        new.is_some()
    }

    /// The corners other than the ends of the edge, each once.
    fn obstacles(&self) -> Vec<u32> {
        let mut obstacles = Vec::with_capacity(2 * self.0.len());
        for v in self.0.iter().flat_map(|&[_, p, q]| [p, q]) {
            if !obstacles.contains(&v) {
                obstacles.push(v);
            }
        }
        obstacles
    }
}

impl Contraction {
    /// Steps 1 and 2: quadrics of all spheres, costs of all edges.
    pub(super) fn new(mesh: &MedialMesh, params: QmatParams) -> Self {
        let complex = CollapseComplex::from_mesh(mesh);
        // The oracle of the tests replays the collapses.
        #[cfg(test)]
        let complex = complex.recording();
        let (quadrics, skipped) = initial_quadrics(mesh, &complex, &params);
        let candidates = mesh
            .edges
            .par_iter()
            .with_min_len(LARGE_STAR)
            .map(|&ends| candidate(&complex, &quadrics, &params, ends))
            .collect();
        let queue = CollapseQueue::from_candidates(candidates);
        Self { params, complex, quadrics, queue, skipped, tally: Tally::default() }
    }

    /// All edges left, the cheapest first.
    pub(super) fn sorted_candidates(&self) -> Vec<Candidate> {
        let edges = self.complex.edges();
        let mut all: Vec<_> = edges
            .map(|ends| candidate(&self.complex, &self.quadrics, &self.params, ends))
            .collect();
        all.sort();
        all
    }

    /// Steps 3 to 5, until at most `target` spheres are left or no edge may be collapsed.
    pub(super) fn run_to(
        &mut self,
        initial: &MedialMesh,
        target: usize,
        run: &RunContext,
    ) -> Result<()> {
        let total = self.complex.sphere_count().saturating_sub(target);
        let first = self.tally.collapses;
        while self.complex.sphere_count() > target {
            run.check()?;
            let Some(cheapest) = self.queue.pop(&self.complex) else {
                let cluster = self.unlock(initial, run)?;
                let Some(Cluster { first, others, sphere }) = cluster else { break };
                self.tally.unlocked += others.len();
                others.iter().fold(first, |kept, &v| self.merge([kept, v], sphere));
                continue;
            };
            // A candidate that is not collapsed goes back or is parked, so none is tried without need.
            match self.decide(cheapest) {
                Decision::Collapse(sphere) => {
                    self.merge(cheapest.ends(), sphere);
                }
                Decision::Postpone(dearer) => {
                    self.tally.postponed += 1;
                    self.queue.push(dearer);
                }
                Decision::Hold(obstacles) => {
                    self.tally.held_by_topology += 1;
                    self.queue.park(cheapest, &obstacles);
                }
                Decision::Fold(faces) => {
                    self.tally.held_by_inversion += 1;
                    self.queue.park(cheapest, &faces.obstacles());
                }
            }
            let done = self.tally.collapses - first;
            if done.is_multiple_of(REPORT_EVERY) {
                run.step(done, total)?;
            }
        }
        run.step(total, total)
    }

    /// Steps 3 and 4: the place of the merged sphere, or the reason against the edge.
    fn decide(&mut self, candidate: Candidate) -> Decision {
        let [a, b] = candidate.ends();
        if self.keeps_topology() && !self.complex.keeps_homotopy(a, b) {
            return Decision::Hold(self.complex.homotopy_obstacles(a, b));
        }
        self.place(candidate)
    }

    /// Whether a collapse has to keep the topology now.
    pub(super) fn keeps_topology(&self) -> bool {
        self.params.topology_from.applies(self.complex.sphere_count())
    }

    /// Step 4: where the merged sphere goes.
    pub(super) fn place(&self, candidate: Candidate) -> Decision {
        let [a, b] = candidate.ends();
        let mut faces = Folded::default();
        let (quadric, ends) = edge_quadric(&self.complex, &self.quadrics, [a, b]);
        let optimum = minimise(&quadric, ends);
        if !faces.holds(&self.complex, [a, b], optimum) {
            return Decision::Collapse(optimum);
        }
        // By ascending error, so the first placement that folds nothing is the cheapest.
        for (error, sphere) in by_error(&quadric, ends) {
            if faces.holds(&self.complex, [a, b], sphere) {
                continue;
            }
            let dearer = priced(&self.complex, &self.params, [a, b], error);
            // When it comes back at this cost, it is no dearer than itself and is collapsed.
            if candidate < dearer {
                return Decision::Postpone(dearer);
            }
            return Decision::Collapse(sphere);
        }
        Decision::Fold(faces)
    }

    /// Step 5: the collapse, the sum of the quadrics, new costs for the edges of the merged sphere,
    /// whose id is returned.
    fn merge(&mut self, [a, b]: [u32; 2], sphere: Sphere) -> u32 {
        let Self { params, complex, quadrics, queue, tally, .. } = self;
        // Rename the smaller star, so that a growing hub is not rewritten at every collapse.
        let [of_a, of_b] = [a, b].map(|v| complex.neighbours(v).len());
        let [kept, removed] = if of_a >= of_b { [a, b] } else { [b, a] };
        complex.collapse(kept, removed, sphere);
        let gone = quadrics[removed as usize];
        quadrics[kept as usize] += &gone;
        let around = complex.neighbours(kept);
        // Both branches push in the order of the neighbours: results do not depend on threads.
        let renewed = |&v: &u32| candidate(complex, quadrics, params, [kept, v]);
        if around.len() < LARGE_STAR {
            around.iter().map(renewed).for_each(|candidate| queue.push(candidate));
        } else {
            let candidates: Vec<_> = around.par_iter().map(renewed).collect();
            candidates.into_iter().for_each(|candidate| queue.push(candidate));
        }
        queue.wake(complex, kept);
        queue.wake(complex, removed);
        tally.collapses += 1;
        kept
    }

    /// Largest error of a remaining sphere against the slabs that were merged into it.
    #[cfg(test)]
    pub(super) fn largest_error(&self) -> f64 {
        let error = |v| self.quadrics[v as usize].value(self.complex.sphere(v));
        self.complex.vertices().map(error).fold(0.0, f64::max)
    }

    /// Counts of the whole run so far.
    pub(super) fn diagnose(&self, diagnostics: &mut Diagnostics) {
        let Self { skipped, tally, .. } = self;
        diagnostics.count("slabs_without_tangent_planes", skipped.slabs);
        diagnostics.count("cones_without_tangent_planes", skipped.cones);
        diagnostics.count("collapses", tally.collapses);
        diagnostics.count("postponed_to_avoid_inversion", tally.postponed);
        diagnostics.count("rejected_by_link_condition", tally.held_by_topology);
        diagnostics.count("taken_against_link_condition", tally.unlocked);
        diagnostics.count("rejected_by_inversion", tally.held_by_inversion);
    }
}

/// The edge at the cost of its best placement.
fn candidate(
    complex: &CollapseComplex,
    quadrics: &[Quadric],
    params: &QmatParams,
    ends: [u32; 2],
) -> Candidate {
    let (quadric, spheres) = edge_quadric(complex, quadrics, ends);
    priced(complex, params, ends, quadric.value(minimise(&quadric, spheres)))
}

/// The edge with the cost `(E + k) Γ²` (equation 8); equal costs are ordered by `E`.
fn priced(complex: &CollapseComplex, params: &QmatParams, ends: [u32; 2], error: f64) -> Candidate {
    let [a, b] = ends.map(|v| complex.sphere(v));
    if are_coincident(a, b) {
        // Before everything else, and the smaller stars first: clusters that grow evenly rarely
        // violate the link condition, one hub that swallows its neighbours soon does.
        let [m, n] = ends.map(|v| complex.neighbours(v).len());
        return Candidate::new(complex, ends, 0.0, -1.0 / (m + n) as f64);
    }
    let stability = stability_ratio(a, b);
    Candidate::new(complex, ends, (error + params.k) * stability * stability, error)
}

/// Whether two centres are one point up to rounding.
pub(super) fn are_coincident(a: Sphere, b: Sphere) -> bool {
    a.centre.distance_squared(b.centre) < ZERO_LENGTH * ZERO_LENGTH
}

/// `E` of an edge: the sum over its ends (equation 5).
fn edge_quadric(
    complex: &CollapseComplex,
    quadrics: &[Quadric],
    [a, b]: [u32; 2],
) -> (Quadric, [Sphere; 2]) {
    let mut quadric = quadrics[a as usize];
    quadric += &quadrics[b as usize];
    (quadric, [complex.sphere(a), complex.sphere(b)])
}

/// The sphere of least error (equation 6 and below): the minimiser; the midpoint if the minimiser has
/// a negative radius; the best of both ends and the midpoint if there is no minimiser within reach.
fn minimise(quadric: &Quadric, ends: [Sphere; 2]) -> Sphere {
    let midpoint = ends[0].lerp(ends[1], 0.5);
    match quadric.minimiser(SINGULAR_RATIO) {
        Some(sphere) if is_in_reach(sphere, midpoint, ends) => {
            if sphere.radius < 0.0 {
                midpoint
            } else {
                sphere
            }
        }
        _ => by_error(quadric, ends)[0].1,
    }
}

/// Whether a minimiser is no farther from the midpoint than the two balls extend; never for one
/// that is not finite.
fn is_in_reach(sphere: Sphere, midpoint: Sphere, [a, b]: [Sphere; 2]) -> bool {
    let reach = a.centre.distance(b.centre) + a.radius.max(b.radius);
    sphere.centre.distance_squared(midpoint.centre) <= reach * reach
        && (sphere.radius - midpoint.radius).abs() <= reach
}

/// Both ends and the midpoint with their errors, the least first.
fn by_error(quadric: &Quadric, [a, b]: [Sphere; 2]) -> [(f64, Sphere); 3] {
    let mut candidates = [a, b, a.lerp(b, 0.5)].map(|sphere| (quadric.value(sphere), sphere));
    // Stable: of equal errors the smaller id, then the larger one, then the midpoint.
    candidates.sort_by(|x, y| x.0.total_cmp(&y.0));
    candidates
}

// ----------------------------------------------------------------------------
// Collapses against the link condition that do not harm the topology.
//
// The link condition is sufficient for a collapse to keep the topology, not necessary. When it
// rejects every edge left of a small complex, the Betti numbers decide: a collapse is taken if it
// brings them no farther from those of the initial mesh. So a void that arose before the topology
// was checked can be filled again, and a knot of spheres can be contracted in which each edge
// violates the condition in two ways that cancel.
//
// Spheres whose centres coincide up to rounding can form a knot that no single collapse undoes.
// Since they are one point in space, they are contracted together, on the same terms.

/// Spheres up to which Betti numbers of single collapses are computed.
const MAX_UNLOCKED_SPHERES: usize = 500;

/// Spheres that become one: the others are merged into the first in their order, each of which then
/// shares an edge with it.
pub(super) struct Cluster {
    pub first: u32,
    pub others: Vec<u32>,
    pub sphere: Sphere,
}

impl Contraction {
    /// The cheapest edge whose collapse violates the link condition but not the topology of
    /// `initial`, else the first such cluster of coincident spheres. `None` when there is neither.
    ///
    /// # Errors
    /// When the run is cancelled: there are as many Betti numbers to compute as edges.
    pub(super) fn unlock(
        &mut self,
        initial: &MedialMesh,
        run: &RunContext,
    ) -> Result<Option<Cluster>> {
        if !self.keeps_topology() || self.complex.sphere_count() > MAX_UNLOCKED_SPHERES {
            return Ok(None);
        }
        // Computed on demand: few runs get here.
        let goal = betti(initial);
        let mesh = self.complex.to_mesh();
        let ids: Vec<u32> = self.complex.vertices().collect();
        // The mesh numbers the vertices left by ascending id.
        let place = |id: u32| ids.partition_point(|&other| other < id) as u32;
        let now = difference(betti(&mesh), goal);
        let keeps = |cluster: &Cluster| {
            let kept = place(cluster.first);
            let collapse = |&v: &u32| Collapse { kept, removed: place(v), sphere: cluster.sphere };
            let collapses: Vec<Collapse> = cluster.others.iter().map(collapse).collect();
            difference(betti(&replay(&mesh, &collapses)), goal) <= now
        };
        let edges = self.sorted_candidates().into_iter().filter_map(|candidate| {
            let [first, other] = candidate.ends();
            let sphere = self.placement_without_topology(candidate)?;
            Some(Cluster { first, others: vec![other], sphere })
        });
        for cluster in edges.chain(self.coincident_clusters()) {
            run.check()?;
            if keeps(&cluster) {
                return Ok(Some(cluster));
            }
        }
        Ok(None)
    }

    /// The connected sets of three and more spheres whose centres are one point, in the order of
    /// their smallest ids.
    fn coincident_clusters(&self) -> Vec<Cluster> {
        let complex = &self.complex;
        let mut seen = HashSet::new();
        let mut clusters = Vec::new();
        for first in complex.vertices() {
            if !seen.insert(first) {
                continue;
            }
            let mut members = vec![first];
            let mut next = 0;
            while next < members.len() {
                let v = members[next];
                next += 1;
                // The order of neighbours is deterministic, so the order of the members is, too.
                for &w in complex.neighbours(v) {
                    if are_coincident(complex.sphere(v), complex.sphere(w)) && seen.insert(w) {
                        members.push(w);
                    }
                }
            }
            if members.len() > 2 {
                let others = members.split_off(1);
                clusters.push(Cluster { first, others, sphere: complex.sphere(first) });
            }
        }
        clusters
    }

    /// The placement of the merged sphere of an edge; `None` if each folds a face over.
    fn placement_without_topology(&self, candidate: Candidate) -> Option<Sphere> {
        match self.place(candidate) {
            Decision::Collapse(sphere) => Some(sphere),
            // Ends: at the cost of its placement the candidate is not postponed again.
            Decision::Postpone(dearer) => self.placement_without_topology(dearer),
            Decision::Hold(_) | Decision::Fold(_) => None,
        }
    }
}

/// The sum of the absolute differences of the Betti numbers.
fn difference(betti: [u64; 3], goal: [u64; 3]) -> u64 {
    betti.iter().zip(goal).map(|(&number, goal)| number.abs_diff(goal)).sum()
}
