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
//! - Centres closer than `1e-12` are one point: the cost is 0, whatever the radii.
//! - Equal costs are ordered by the smaller, then by the larger id; of two equal radii the smaller
//!   id stays.
//! - There is no published scale: Table 1 has scales between 1.18 and 17.38, picked by eye for each
//!   shape. The published level is the least of them, `s = 1.18`, with a warning that says so. The end
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
//! - The paper updates one mesh step by step along the record. Here each simplex is stored with the
//!   interval of stages in which it exists ([`medial::complex::collapse::Hierarchy`]), which gives
//!   the same meshes without replaying the record.

mod contract;
mod cost;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use medial::complex::collapse::Hierarchy;
use medial::shape::{Shape, ShapeError};
use medial::simplifier::{
    Capability, Diagnostics, Extras, Level, Method, MethodInfo, NativeLevel, NoParams, Params,
    RunContext, Simplification, Simplified, SimplifyError,
};

pub use cost::absorption_scale;

use cost::{Key, absorbed_first};

/// The scale of [`Level::Published`]: the least of the paper's Table 1.
const PUBLISHED: f64 = 1.18;

/// Name of the extra that holds all levels as a [`Hierarchy`], for [`resume`].
pub const HIERARCHY: &str = "hierarchy";

/// The source as BibTeX.
const BIBTEX: &str = "\
@inproceedings{FarajThieryBoubekeur2013,
  author    = {Faraj, Noura and Thiery, Jean-Marc and Boubekeur, Tamy},
  title     = {Progressive Medial Axis Filtration},
  booktitle = {SIGGRAPH Asia 2013 Technical Briefs},
  year      = {2013},
  doi       = {10.1145/2542355.2542359}
}";

/// Progressive medial axis filtration as a method.
///
/// Builds the whole hierarchy once, in `O(n log n)` for an initial mesh of bounded degree; then
/// each level costs in proportion to its own size.
pub fn method() -> Method<NoParams> {
    let info = MethodInfo::new("pmat", "PMAT")
        .citation(
            "Noura Faraj, Jean-Marc Thiery, Tamy Boubekeur 2013. Progressive Medial Axis \
             Filtration. SIGGRAPH Asia 2013 Technical Briefs. \
             https://doi.org/10.1145/2542355.2542359",
        )
        .bibtex(BIBTEX)
        .summary(
            "Collapses each edge into its larger sphere, in the order of the scales at which that \
             absorbs the smaller one: the scale axis as a hierarchy.",
        )
        .native(NativeLevel::larger_is_coarser("s", "factor by which all balls grow, at least 1"))
        .published(
            "s = 1.18, the least scale of the paper's Table 1, with the whole hierarchy; the paper \
             picks scales by eye for each shape",
        )
        .extra(Capability::new(HIERARCHY, "all levels at once, to go on from without the shape"));
    Method::new(info, prepare)
}

fn prepare<'s>(
    shape: &'s Shape,
    _: NoParams,
    run: &RunContext,
) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
    let initial = shape.initial()?;
    if initial.spheres.is_empty() {
        return Err(ShapeError::EmptyMedialMesh.into());
    }
    run.step(0, initial.spheres.len())?;
    let steps = contract::contract(&initial, run)?;
    let hierarchy = Hierarchy::new(initial, steps)
        .map_err(|error| SimplifyError::Hierarchy(error.to_string()))?;
    Ok(Box::new(Levels::new(Arc::new(hierarchy))))
}

/// The levels of a hierarchy that an earlier run gave among its extras, without the shape.
///
/// # Errors
/// [`SimplifyError::Hierarchy`] when it is not one of this method, [`SimplifyError::Parameter`]
/// when a parameter is set.
pub fn resume(
    hierarchy: Arc<Hierarchy>,
    params: &Params,
) -> Result<Box<dyn Simplification>, SimplifyError> {
    let NoParams {} = params.typed()?;
    check_origin(&hierarchy).map_err(SimplifyError::Hierarchy)?;
    Ok(Box::new(Levels::new(hierarchy)))
}

/// Whether the steps of a hierarchy are those of this method, as far as each tells for itself.
fn check_origin(hierarchy: &Hierarchy) -> Result<(), String> {
    let spheres = &hierarchy.initial().spheres;
    for (index, step) in hierarchy.steps().iter().enumerate() {
        let ends = [step.removed, step.kept];
        let [removed, kept] = absorbed_first(ends, |v| spheres[v as usize].radius);
        let cost = Key::of(ends.map(|v| spheres[v as usize])).cost();
        if ends != [removed, kept] || step.cost.to_bits() != cost.to_bits() {
            return Err(format!(
                "step {index} absorbs sphere {} in {} at the scale {}; PMAT absorbs {removed} in \
                 {kept} at {cost}",
                step.removed, step.kept, step.cost
            ));
        }
    }
    let left = hierarchy.stage(hierarchy.last_stage()).edge_count();
    if left > 0 {
        return Err(format!("it stops while {left} edges are left, and PMAT goes on"));
    }
    Ok(())
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
        let running = |step: &medial::complex::collapse::Step| {
            largest = largest.max(step.cost);
            largest
        };
        let scales = hierarchy.steps().iter().map(running).collect();
        Self { hierarchy, scales }
    }

    /// The number of collapses that a level asks for.
    fn stage_of(&self, level: Level) -> Result<usize, SimplifyError> {
        match level {
            Level::Spheres(0) => {
                Err(SimplifyError::Level("at least one sphere must stay".to_owned()))
            }
            Level::Spheres(count) => {
                let excess = self.hierarchy.initial().spheres.len().saturating_sub(count);
                Ok(excess.min(self.hierarchy.last_stage()))
            }
            Level::Native(scale) if scale >= 1.0 && scale.is_finite() => {
                Ok(self.scales.partition_point(|&cost| cost <= scale))
            }
            Level::Native(scale) => Err(SimplifyError::Level(format!(
                "s = {scale:?} is no scale: ask for a finite number of at least 1"
            ))),
            Level::Published => Ok(self.scales.partition_point(|&cost| cost <= PUBLISHED)),
        }
    }

    /// The least scale at which no more spheres are left than at a stage.
    fn scale_at(&self, stage: usize) -> f64 {
        stage.checked_sub(1).map_or(1.0, |last| self.scales[last].max(1.0))
    }

    fn diagnose(&self, level: Level, stage: usize) -> Diagnostics {
        let mut diagnostics = Diagnostics::default();
        let infinite = stage - self.scales[..stage].partition_point(|cost| cost.is_finite());
        diagnostics.count("collapses", stage);
        diagnostics.count("against_link_condition", self.hierarchy.violations_until(stage));
        diagnostics.count("beyond_every_finite_scale", infinite);
        let spheres = self.hierarchy.initial().spheres.len();
        match level {
            Level::Spheres(asked) if asked > spheres => diagnostics.warn(format!(
                "{spheres} spheres instead of {asked}: the initial medial mesh has no more"
            )),
            Level::Spheres(asked) if asked < spheres - stage => diagnostics.warn(format!(
                "{} spheres instead of {asked}: no edge is left, each sphere is a component of its \
                 own",
                spheres - stage
            )),
            Level::Published => diagnostics.warn(format!(
                "the paper leaves the scale to the user (1.18 to 17.38 in its Table 1); this is \
                 s = {PUBLISHED}"
            )),
            _ => {}
        }
        diagnostics
    }
}

impl Simplification for Levels {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let stage = self.stage_of(level)?;
        let scale = self.scale_at(stage);
        let mut extras = Extras::default();
        extras.insert_shared(Arc::clone(&self.hierarchy));
        Ok(Simplified {
            mesh: self.hierarchy.stage(stage).to_mesh(),
            asked: level,
            native_level: scale.is_finite().then_some(scale),
            diagnostics: self.diagnose(level, stage),
            extras,
        })
    }
}
