//! Algorithm 1 of the paper: the cheapest edge first, the merged sphere where its error is least.

use medial::complex::collapse::{Candidate, CollapseComplex, CollapseQueue};
use medial::complex::{MedialMesh, Sphere, ZERO_LENGTH, stability_ratio};
use medial::simplifier::{Diagnostics, RunContext, SimplifyError};
use rayon::prelude::*;

use super::accumulate::{Skipped, initial_quadrics};
use super::params::QmatParams;
use super::quadric::Quadric;

/// Collapses between two reports of progress.
const REPORT_EVERY: usize = 4096;

/// Stars from this size on are evaluated in parallel.
const LARGE_STAR: usize = 2048;

/// A medial mesh under contraction.
pub(super) struct Contraction {
    params: QmatParams,
    complex: CollapseComplex,
    quadrics: Vec<Quadric>,
    queue: CollapseQueue,
    skipped: Skipped,
    tally: Tally,
}

/// What happened to the candidates that were popped.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    collapses: usize,
    fallbacks: usize,
    held_by_topology: usize,
    held_by_inversion: usize,
}

/// What is done with a popped candidate.
enum Decision {
    /// Collapse it to this sphere.
    Collapse(Sphere),
    /// It folds a face over at the optimum and costs more elsewhere: queue it at that cost.
    Postpone(Candidate),
    /// Leave it alone until its surroundings change.
    Hold(Reason),
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Reason {
    Topology,
    Inversion,
}

impl Contraction {
    /// Steps 1 and 2: quadrics of all spheres, costs of all edges.
    pub(super) fn new(mesh: &MedialMesh, params: QmatParams) -> Self {
        let complex = CollapseComplex::from_mesh(mesh);
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

    /// Number of spheres left.
    pub(super) fn sphere_count(&self) -> usize {
        self.complex.sphere_count()
    }

    /// The mesh as it is now.
    pub(super) fn to_mesh(&self) -> MedialMesh {
        self.complex.to_mesh()
    }

    /// Steps 3 to 5, until at most `target` spheres are left or no edge may be collapsed.
    pub(super) fn run_to(&mut self, target: usize, run: &RunContext) -> Result<(), SimplifyError> {
        let total = self.sphere_count().saturating_sub(target);
        let first = self.tally.collapses;
        while self.sphere_count() > target {
            let Some(cheapest) = self.queue.pop(&self.complex) else {
                break;
            };
            match self.decide(cheapest) {
                Decision::Collapse(sphere) => self.merge(cheapest.ends(), sphere),
                Decision::Postpone(dearer) => self.queue.push(dearer),
                Decision::Hold(reason) => self.hold(cheapest, reason),
            }
            let done = self.tally.collapses - first;
            if done.is_multiple_of(REPORT_EVERY) {
                run.step(done, total)?;
            }
        }
        run.step(total, total)
    }

    /// Steps 3 and 4: where the merged sphere goes, or why there is none for now.
    fn decide(&mut self, candidate: Candidate) -> Decision {
        let [a, b] = candidate.ends();
        let keep_topology = self.params.topology_from.applies(self.sphere_count());
        if keep_topology && !self.complex.link_condition(a, b) {
            return Decision::Hold(Reason::Topology);
        }
        let (quadric, ends) = edge_quadric(&self.complex, &self.quadrics, [a, b]);
        let optimum = minimise(&quadric, ends, self.params.singular_ratio);
        if !self.complex.inverts(a, b, optimum.centre) {
            return Decision::Collapse(optimum);
        }
        let upright = by_error(&quadric, ends)
            .into_iter()
            .find(|&(_, sphere)| !self.complex.inverts(a, b, sphere.centre));
        let Some((error, fallback)) = upright else {
            return Decision::Hold(Reason::Inversion);
        };
        let dearer = priced(&self.complex, &self.params, [a, b], error);
        if candidate.is_before(&dearer) {
            return Decision::Postpone(dearer);
        }
        self.tally.fallbacks += 1;
        Decision::Collapse(fallback)
    }

    fn hold(&mut self, candidate: Candidate, reason: Reason) {
        match reason {
            Reason::Topology => self.tally.held_by_topology += 1,
            Reason::Inversion => self.tally.held_by_inversion += 1,
        }
        self.queue.park(candidate);
    }

    /// Step 5: the collapse, the sum of the quadrics, new costs for the edges of the merged sphere.
    fn merge(&mut self, [a, b]: [u32; 2], sphere: Sphere) {
        let Self { params, complex, quadrics, queue, tally, .. } = self;
        let degree = |v| complex.neighbours(v).len();
        // The smaller star is renamed, so that a large one is not rewritten for each small one.
        let [kept, removed] = if degree(a) >= degree(b) { [a, b] } else { [b, a] };
        complex.collapse(kept, removed, sphere);
        let gone = quadrics[removed as usize];
        quadrics[kept as usize] += &gone;
        let around = complex.neighbours(kept);
        let renewed = |&v: &u32| candidate(complex, quadrics, params, [kept, v]);
        if around.len() < LARGE_STAR {
            around.iter().for_each(|v| queue.push(renewed(v)));
        } else {
            let candidates: Vec<_> = around.par_iter().map(renewed).collect();
            candidates.into_iter().for_each(|candidate| queue.push(candidate));
        }
        for &v in around {
            queue.wake(complex, v);
        }
        tally.collapses += 1;
    }

    /// Largest error of a sphere left, over the slabs it stands for.
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
        diagnostics.count("placed_off_the_optimum_to_avoid_inversion", tally.fallbacks);
        diagnostics.count("rejected_by_link_condition", tally.held_by_topology);
        diagnostics.count("rejected_by_inversion", tally.held_by_inversion);
    }

    /// Why no further edge may be collapsed, for the user.
    pub(super) fn why_stopped(&mut self) -> String {
        let edges: Vec<_> = self.complex.edges().collect();
        if edges.is_empty() {
            return "no edge is left, each sphere is a component of its own".to_owned();
        }
        let by_topology = edges.iter().filter(|&&[a, b]| {
            let keep_topology = self.params.topology_from.applies(self.complex.sphere_count());
            keep_topology && !self.complex.link_condition(a, b)
        });
        let by_topology = by_topology.count();
        let by_inversion = edges.len() - by_topology;
        format!(
            "of the {} edges left {by_topology} would change the topology and {by_inversion} \
             would fold a face over",
            edges.len()
        )
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
    let best = minimise(&quadric, spheres, params.singular_ratio);
    priced(complex, params, ends, quadric.value(best))
}

/// The edge with the cost `(E + k) Γ²` (equation 8); equal costs are ordered by `E`.
fn priced(complex: &CollapseComplex, params: &QmatParams, ends: [u32; 2], error: f64) -> Candidate {
    let [a, b] = ends.map(|v| complex.sphere(v));
    // Coincident centres go before everything else.
    if a.centre.distance_squared(b.centre) < ZERO_LENGTH * ZERO_LENGTH {
        return Candidate::new(complex, ends, 0.0, 0.0);
    }
    let stability = stability_ratio(a, b);
    Candidate::new(complex, ends, (error + params.k) * stability * stability, error)
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

/// The sphere of least error (equation 6 and below): the minimiser; the midpoint when its radius
/// would be negative; the best of three when there is none, or none within reach.
fn minimise(quadric: &Quadric, ends: [Sphere; 2], singular_ratio: f64) -> Sphere {
    let midpoint = ends[0].lerp(ends[1], 0.5);
    match quadric.minimiser(singular_ratio) {
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
    candidates.sort_by(|x, y| x.0.total_cmp(&y.0));
    candidates
}
