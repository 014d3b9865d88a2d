//! PMAT: progressive medial axis filtration.
//!
//! Faraj, Thiery, Boubekeur 2013, *Progressive Medial Axis Filtration*, SIGGRAPH Asia 2013
//! Technical Briefs, <https://doi.org/10.1145/2542355.2542359>.
//!
//! 1. Each edge of the medial mesh gets the scale at which the larger of its balls absorbs the
//!    smaller, when all balls grow by it: `c = |p_i - p_j| / |r_i - r_j|` (section 2).
//! 2. The cheapest edge is taken and collapsed into its larger sphere, which stays as it is; the
//!    neighbours of the smaller one become its own (Algorithm 1).
//! 3. The new edges get their costs. Steps 2 and 3 are repeated until no edge is left.
//! 4. The record of the collapses is the hierarchy; a level is the mesh after a prefix of it.
//!
//! The survivors of every level are a subset of the initial spheres, and the number of components
//! never changes. Loops may close, because the paper prescribes no test of the topology. Only
//! collapses that violate the link condition can do that; they are counted. The evaluation computes
//! the Betti numbers of a level.
//!
//! # Notation
//!
//! `m = (p, r)` a medial sphere; `c` the cost of an edge; `s` the scale of a level. Lengths are
//! fractions of the bounding-box diagonal.
//!
//! # Where the paper is silent
//!
//! - The costs of successive collapses need not ascend, since a new edge may cost less than the one
//!   just taken. The scale of a level is the largest cost in its prefix, so that "scale at most `s`"
//!   selects a prefix. Scales begin at 1: at `s = 1` every ball inside a larger one is gone.
//! - Edges between equal radii have an infinite cost. They come last, the shortest first, so that no
//!   edge is left at the end; no finite scale reaches them.
//! - Centres closer than `1e-12` are one point: the cost is 0 for all radii.
//! - Equal costs are ordered by the smaller, then by the larger id; of two equal radii the smaller
//!   id stays.
//! - There is no published scale: Table 1 has scales between 1.18 and 17.38, picked by eye for each
//!   shape. The published level is the least of them, `s = 1.18`, with a warning. The end
//!   of the algorithm, when no edge is left, is `Level::Spheres(1)`. Every level comes with the whole
//!   hierarchy.
//!
//! # Deviations from the paper
//!
//! - *The initial mesh.* The paper starts from inner polar balls, as the scale axis transform does.
//!   Here the start is the initial mesh of the harness (all Voronoi vertices inside, with the Voronoi
//!   edges and facets between them) or a given mesh, so that all methods that collapse edges start
//!   alike. Vertices near the surface that are not poles are the first to be absorbed.
//! - Algorithm 1 queues all edges of the survivor again at each collapse. The costs of its old edges
//!   have not changed, so here only the edges that it takes over are added. The collapses are the
//!   same; a test compares the two.
//! - The paper updates one mesh step by step along the record. Here a level is the image of the initial
//!   mesh under all collapses of its prefix ([`medial::complex::collapse::Hierarchy`]), which gives
//!   the same meshes in any order of levels.

#[cfg(test)]
mod tests;

use std::cmp::Ordering;
use std::sync::Arc;

use medial::complex::collapse::{CollapseComplex, Hierarchy, Step};
use medial::complex::{MedialMesh, Sphere, ZERO_LENGTH};
use medial::range_queue::RangeQueue;
use medial::shape::{Shape, ShapeError};
use medial::simplifier::{
    Capability, Diagnostics, Extras, Level, Method, MethodInfo, NativeLevel, NoParams, RunContext,
    Simplification, Simplified,
};
use rayon::prelude::*;

use crate::levels::{level_within, some_spheres};
use crate::{Prepared, Result};

/// The scale of [`Level::Published`]: the least of the paper's Table 1.
const PUBLISHED: f64 = 1.18;

/// Progressive medial axis filtration as a method.
///
/// Builds the whole hierarchy once, in `O(n log n)` for an initial mesh of bounded degree; then
/// each level costs a pass over the initial mesh.
pub fn method() -> Method<NoParams> {
    let info = MethodInfo::new("pmat", "PMAT")
        .citation(
            "Noura Faraj, Jean-Marc Thiery, Tamy Boubekeur 2013. Progressive Medial Axis \
             Filtration. SIGGRAPH Asia 2013 Technical Briefs. \
             https://doi.org/10.1145/2542355.2542359",
        )
        .bibtex(crate::references(&["FarajThieryBoubekeur2013"]))
        .summary(
            "Collapses each edge into its larger sphere, in the order of the scales at which that \
             absorbs the smaller one: the scale axis as a hierarchy.",
        )
        .native(NativeLevel::larger_is_coarser("s", "factor by which all balls grow, at least 1"))
        .published(
            "s = 1.18, the least scale of the paper's Table 1, with the whole hierarchy; the paper \
             picks scales by eye for each shape",
        )
        .extra(Capability::new("hierarchy", "all levels at once, to go on from without the shape"));
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, _: NoParams, run: &RunContext) -> Prepared<'s> {
    let initial = shape.initial()?;
    if initial.spheres.is_empty() {
        return Err(ShapeError::EmptyMedialMesh.into());
    }
    run.step(0, initial.spheres.len())?;
    let steps = contract(&initial, run)?;
    Ok(Box::new(Levels::new(Arc::new(Hierarchy::new(initial, steps)))))
}

/// A hierarchy and the scales of its levels.
struct Levels {
    hierarchy: Arc<Hierarchy>,
    /// The largest cost of the first `t + 1` steps.
    scales: Vec<f64>,
}

impl Levels {
    fn new(hierarchy: Arc<Hierarchy>) -> Self {
        let mut largest = 0.0_f64;
        // Costs may fall along the record: the running maximum ascends, as `partition_point` needs.
        let scales = hierarchy.steps().iter().map(|step| {
            largest = largest.max(step.cost);
            largest
        });
        Self { scales: scales.collect(), hierarchy }
    }

    /// The number of collapses that a level requires.
    fn stage_of(&self, level: Level) -> Result<usize> {
        let scale = match some_spheres(level)? {
            Level::Spheres(count) => {
                let excess = self.hierarchy.initial().spheres.len().saturating_sub(count);
                // Each collapse removes one sphere; components without edges remain.
                return Ok(excess.min(self.hierarchy.steps().len()));
            }
            Level::Native(scale) => level_within("s", scale, 1.0..f64::INFINITY)?,
            Level::Published => PUBLISHED,
        };
        Ok(self.scales.partition_point(|&cost| cost <= scale))
    }

    fn diagnose(&self, level: Level, stage: usize) -> Diagnostics {
        let mut diagnostics = Diagnostics::default();
        let infinite = stage - self.scales[..stage].partition_point(|cost| cost.is_finite());
        diagnostics.count("collapses", stage);
        diagnostics.count("beyond_every_finite_scale", infinite);
        let spheres = self.hierarchy.initial().spheres.len();
        match level {
            Level::Spheres(requested) if requested > spheres => diagnostics.warn(format!(
                "{spheres} spheres instead of {requested}: the initial medial mesh has no more"
            )),
            Level::Spheres(requested) if requested < spheres - stage => diagnostics.warn(format!(
                "{} spheres instead of {requested}: no edge is left, each sphere is a separate \
                 component",
                spheres - stage
            )),
            Level::Published => diagnostics.warn(format!(
                "the paper names no default scale (its Table 1 has 1.18 to 17.38); used s = {PUBLISHED}"
            )),
            _ => {}
        }
        diagnostics
    }
}

impl Simplification for Levels {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let stage = self.stage_of(level)?;
        // The least scale at which no more spheres are left than at this stage.
        let scale = stage.checked_sub(1).map_or(1.0, |last| self.scales[last].max(1.0));
        let mut extras = Extras::default();
        extras.insert_shared(Arc::clone(&self.hierarchy));
        Ok(Simplified {
            mesh: self.hierarchy.mesh(stage),
            asked: level,
            native_level: scale.is_finite().then_some(scale),
            diagnostics: self.diagnose(level, stage),
            extras,
        })
    }
}

// ----------------------------------------------------------------------------
// Algorithm 1 of the paper: collapses the edge of least scale, until no edge is left.
//
// A collapse does not move the larger sphere, and the cost of an edge depends on its two spheres
// alone. So the cost never changes while both ends exist, a queued edge is outdated only when an end
// is gone, and only the edges that the survivor takes over must be queued. Faces do not affect the
// order, so they are left out here; they follow from it ([`medial::complex::collapse::Hierarchy`]).

/// Collapses between two reports of progress.
const REPORT_EVERY: usize = 4096;

/// Fewest edges that one task evaluates.
const TASK: usize = 4096;

/// An edge in the queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Candidate {
    key: Key,
    /// Ascending.
    ends: [u32; 2],
}

impl Ord for Candidate {
    /// By key, then by ends; as one number, since a queue does little else than compare.
    fn cmp(&self, other: &Self) -> Ordering {
        let number = |c: &Self| {
            u128::from(c.key.0) << 64 | u128::from(c.ends[0]) << 32 | u128::from(c.ends[1])
        };
        number(self).cmp(&number(other))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Candidate {
    fn new([a, b]: [u32; 2], spheres: [Sphere; 2]) -> Self {
        Self { key: Key::of(spheres), ends: [a.min(b), a.max(b)] }
    }
}

/// All collapses, first to last, until no edge is left. Cost `O(n log n)` for degrees that are
/// bounded in the mean.
///
/// # Errors
/// [`Cancelled`](medial::simplifier::SimplifyError::Cancelled) when the run was cancelled.
fn contract(mesh: &MedialMesh, run: &RunContext) -> Result<Vec<Step>> {
    let spheres = &mesh.spheres;
    let total = spheres.len();
    let edges = mesh.edges.par_iter().with_min_len(TASK);
    let candidate = |&ends: &[u32; 2]| Candidate::new(ends, ends.map(|v| spheres[v as usize]));
    let mut queue = RangeQueue::new(edges.map(candidate).collect());
    let (spheres, edges) = (spheres.clone(), mesh.edges.clone());
    let mut graph =
        CollapseComplex::from_mesh(&MedialMesh { spheres, edges, ..Default::default() });
    let mut steps = Vec::with_capacity(total);
    while let Some(cheapest) =
        queue.pop(|edge| edge.ends.iter().all(|&v| graph.is_alive(v)).then_some(edge))
    {
        run.check()?;
        // Both ends are left, so their spheres, and with them the cost, are those of the queued edge.
        let [removed, kept] = absorbed_first(cheapest.ends, |v| graph.sphere(v).radius);
        let survivor = graph.sphere(kept);
        for &neighbour in graph.neighbours(removed).iter().filter(|&&v| v != kept) {
            queue.push(Candidate::new([kept, neighbour], [survivor, graph.sphere(neighbour)]));
        }
        graph.collapse(kept, removed, survivor);
        steps.push(Step { removed, kept, cost: cheapest.key.cost() });
        if steps.len().is_multiple_of(REPORT_EVERY) {
            run.step(steps.len(), total)?;
        }
    }
    run.step(total, total)?;
    Ok(steps)
}

// ----------------------------------------------------------------------------
// The cost of an edge, and the choice of the sphere to be absorbed.

/// The factor `c = |p_a - p_b| / |r_a - r_b|` (section 2): scaled by it, the larger of two spheres
/// absorbs the smaller. At most 1 if one ball contains the other already; infinite for equal radii;
/// 0 for all radii, for centres closer than [`ZERO_LENGTH`], which count as one point. Lengths
/// are in units of the bounding-box diagonal.
///
/// With the stability ratio `G` of the same edge, `G = max(0, 1 - 1 / c)`.
pub fn absorption_scale(a: Sphere, b: Sphere) -> f64 {
    let d = a.centre.distance(b.centre);
    if d < ZERO_LENGTH { 0.0 } else { d / (a.radius - b.radius).abs() }
}

/// The ends of an edge, first the one to be absorbed: the smaller sphere, or, of equal ones, the one
/// with the larger id.
#[inline]
fn absorbed_first([a, b]: [u32; 2], radius: impl Fn(u32) -> f64) -> [u32; 2] {
    let (r, s) = (radius(a), radius(b));
    if r < s || (r == s && a > b) { [a, b] } else { [b, a] }
}

/// The key of an edge in the order of collapses: the cost, or the length if the cost is infinite.
///
/// Non-negative numbers have the order of their bits. The unused sign bit marks a length, so lengths
/// come after all costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key(u64);

const LENGTH: u64 = 1 << 63;

impl Key {
    #[inline]
    fn of([a, b]: [Sphere; 2]) -> Self {
        let cost = absorption_scale(a, b);
        if cost < f64::INFINITY {
            Self(cost.to_bits())
        } else {
            Self(LENGTH | a.centre.distance(b.centre).to_bits())
        }
    }

    /// The cost.
    #[inline]
    fn cost(self) -> f64 {
        if self.0 & LENGTH == 0 { f64::from_bits(self.0) } else { f64::INFINITY }
    }
}
