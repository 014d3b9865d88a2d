//! Algorithm 1 of the paper: the cheapest edge first, the merged sphere where its error is least.

use medial::complex::collapse::{COINCIDENT, Candidate, CollapseComplex, CollapseQueue};
use medial::complex::{MedialMesh, Sphere};
use medial::simplifier::{Diagnostics, RunContext, SimplifyError};
use rayon::prelude::*;

use super::accumulate::{Skipped, initial_quadrics};
use super::params::QmatParams;
use super::quadric::Quadric;
use super::tangent::stability_ratio;

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

/// Why an edge is not collapsed.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Held {
    ByTopology,
    ByInversion,
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
            match self.placement(cheapest.ends()) {
                Ok(sphere) => self.merge(cheapest.ends(), sphere),
                Err(held) => {
                    match held {
                        Held::ByTopology => self.tally.held_by_topology += 1,
                        Held::ByInversion => self.tally.held_by_inversion += 1,
                    }
                    self.queue.park(cheapest);
                    continue;
                }
            }
            let done = self.tally.collapses - first;
            if done.is_multiple_of(REPORT_EVERY) {
                run.step(done, total)?;
            }
        }
        run.step(total, total)
    }

    /// Steps 3 and 4: where the merged sphere goes, or why there is none.
    fn placement(&mut self, [a, b]: [u32; 2]) -> Result<Sphere, Held> {
        let keep_topology = self.params.topology_from.applies(self.sphere_count());
        if keep_topology && !self.complex.link_condition(a, b) {
            return Err(Held::ByTopology);
        }
        let (quadric, ends) = edge_quadric(&self.complex, &self.quadrics, [a, b]);
        let best = minimise(&quadric, ends, self.params.singular_ratio);
        if !self.complex.inverts(a, b, best.centre) {
            return Ok(best);
        }
        self.tally.fallbacks += 1;
        by_error(&quadric, ends)
            .into_iter()
            .find(|sphere| !self.complex.inverts(a, b, sphere.centre))
            .ok_or(Held::ByInversion)
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
        let mut by_topology = 0;
        for &ends in &edges {
            by_topology += usize::from(self.placement(ends) == Err(Held::ByTopology));
        }
        let by_inversion = edges.len() - by_topology;
        format!(
            "of the {} edges left {by_topology} would change the topology and {by_inversion} \
             would fold a face over",
            edges.len()
        )
    }
}

/// The edge with its cost `(E + k) Γ²` (equation 8); equal costs are ordered by `E`.
fn candidate(
    complex: &CollapseComplex,
    quadrics: &[Quadric],
    params: &QmatParams,
    ends: [u32; 2],
) -> Candidate {
    let (quadric, [a, b]) = edge_quadric(complex, quadrics, ends);
    // Coincident centres go before everything else.
    if a.centre.distance_squared(b.centre) < COINCIDENT * COINCIDENT {
        return Candidate::new(complex, ends, 0.0, 0.0);
    }
    let error = quadric.value(minimise(&quadric, [a, b], params.singular_ratio));
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

/// The sphere of least error (equation 6 and below): the minimiser, the midpoint when its radius
/// would be negative, the best of three when there is no unique minimiser.
fn minimise(quadric: &Quadric, ends: [Sphere; 2], singular_ratio: f64) -> Sphere {
    match quadric.minimiser(singular_ratio) {
        Some(sphere) if !(sphere.centre.is_finite() && sphere.radius.is_finite()) => {
            by_error(quadric, ends)[0]
        }
        Some(sphere) if sphere.radius >= 0.0 => sphere,
        Some(_) => ends[0].lerp(ends[1], 0.5),
        None => by_error(quadric, ends)[0],
    }
}

/// Both ends and the midpoint, the least error first.
fn by_error(quadric: &Quadric, [a, b]: [Sphere; 2]) -> [Sphere; 3] {
    let mut candidates = [a, b, a.lerp(b, 0.5)].map(|sphere| (quadric.value(sphere), sphere));
    candidates.sort_by(|x, y| x.0.total_cmp(&y.0));
    candidates.map(|(_, sphere)| sphere)
}
