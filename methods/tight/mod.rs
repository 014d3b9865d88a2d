//! `tight`: all spheres are placed together, for the two-sided error.
//!
//! A method of this project; nothing of it is published. Q-MAT prices a collapse by planes, HEM by one
//! side of the error; here both the order of the collapses and the places of the spheres follow the
//! errors of samples on both sides: surface points that the union misses, balls that protrude, and points
//! inside that no primitive holds.
//!
//! 1. *Start.* The initial medial mesh, of `samples` samples at least, simplified by another method (Q-MAT) to
//!    `start` spheres, five times the target up to 2,500, or three times it, whichever is most (this file).
//! 2. *Residuals* (`goal.rs`): at samples of the surface and along its sharp edges `sigma`; at points of the primitives how far their
//!    ball protrudes; at interior points how far they are from being held.
//! 3. *Descent* (`descent.rs`, `block_cholesky.rs`): Levenberg-Marquardt on all spheres at once for a power of the residuals,
//!    with a sparse Cholesky factorisation. A step that would take a centre out of the
//!    solid, fold a face over or make one cross another is taken back there (`guard.rs`).
//! 4. *Collapse* (`collapse.rs`): passes of the cheapest edges, priced by the samples that their stars
//!    serve; a few steps of 3 after each pass, at the power 4. Within five times the target, the places of the
//!    largest errors join the samples after each pass, and after each swap of 5.
//! 5. *Swap* (`swap.rs`): spheres are inserted where the error is largest, and as many edges collapsed
//!    where it hurts least. Only the spheres around them move then (`settle`).
//! 6. *Rounds* (this file, `witnesses.rs`): steps of 3 at the power 32, between which the largest errors, found by
//!    local ascent and a sweep of both sides, join the samples, and balls are watched where the union came out of the solid;
//!    then swaps as in 5, each with a second chance, and rounds again. The state
//!    with the least measured error is the result.
//! 7. *Grow* (this file): where fewer spheres seem as good, steps 1 to 7 are made for the next smaller number among 10, 20, 50, 100
//!    and so on, too. That is so where a start of that number is much closer than the usual one, as if the axis is a curve or a
//!    point, and where the collapse from 4 to it does not raise the error, as of flat solids. If its error is smaller, spheres are
//!    inserted as in 5, and in the middle of edges, which leaves the union as it is. So more spheres are hardly ever worse.
//!
//! # Notation
//!
//! `m = (c, r)` a medial sphere; `D(x)` the depth of a point in the solid, negative outside; `sigma(p)` the
//! least signed distance to a primitive, negative inside. Lengths are fractions of the bounding-box
//! diagonal.
//!
//! # Invariants and their limits
//!
//! - A collapse and an insertion keep the homotopy type of the medial mesh, so its Betti numbers are those
//!   of the start. Those of the union are not looked at.
//! - The error is measured at samples and by ascent from them; it is not certified. `lambda` weighs the
//!   mean against the maximum.
//! - No collapse, insertion or step makes two faces cross by more than 1e-6 that did not (`Sheets`, `Guard`). Faces
//!   that cross at the start may stay crossed. Two exceptions: while more pairs cross than half the number of faces,
//!   as in the tangle at the axis of a tube, and where no other collapse is left.
//! - The result depends on the samples, hence on the seed and on the orientation of the input; docs/tight.md
//!   has figures.
//! - The native level `error` is a bound of the two-sided error, a fraction of the diagonal, held by a
//!   certificate. It takes one to three times as long as the number of spheres that is found.
//!
//! # Starting from a given mesh
//!
//! If the shape has an external initial medial mesh, that is the start. If it has no more spheres than requested, its
//! connectivity stays as it is and its spheres are moved (step 6 without swaps).

mod block_cholesky;
mod collapse;
mod descent;
mod goal;
mod guard;
mod part;
mod swap;
#[cfg(test)]
mod tests;
mod witnesses;

use std::ops::Bound;
use std::sync::Arc;

use descent::{Descent, Objective};
use goal::{Goal, Points};
use medial::complex::{MedialMesh, betti, crossing_faces};
use medial::metrics::topology_warning;
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, MedialSimplifier, MethodInfo, NativeLevel, ParamFields, Params, RunContext,
    Simplification, Simplified, SimplifyError,
};
use medial::surface::Sampling;
use swap::{inserted, padded, swapped};
use witnesses::Witnesses;

use crate::levels::{checked, level_within, some_spheres, within};
use crate::{Prepared, Result};

/// Spheres of [`Level::Published`].
const USUAL: usize = 100;

/// Limit of the spheres that are placed together, those of the start included. Bounds memory and time.
const MOST: usize = 15_000;

/// Spheres for each sphere of the target: above it passes are large, and a start has at least as many.
const MANY: usize = 3;

/// Exponent of the residuals until the last rounds. With 2, single balls protrude ever farther after a
/// pass, up to faces across a hole.
const POWER: i32 = 4;

/// Share of the spheres that a pass leaves, far from the target and near to it.
const LEFT: [f64; 2] = [0.4, 0.6];

/// Steps of the descent after a pass, far from the target and near to it.
const PASS_STEPS: [usize; 2] = [2, 4];

/// Limit of the swaps before the rounds.
const FIRST_SWAPS: usize = 4;

/// The method, with another one that makes its start.
pub struct Tight {
    info: MethodInfo,
    starter: Arc<dyn MedialSimplifier>,
}

/// The `tight` simplifier, starting from the result of `starter`.
///
/// Supports [`Level::Spheres`] up to a few thousand, at the cost of some hundred evaluations of all samples, and
/// [`Level::Native`], a bound of the two-sided error, at one to three times that.
pub fn method(starter: impl MedialSimplifier + 'static) -> Tight {
    let info = MethodInfo::new("tight", "Tight")
        .seeded()
        .citation("This project; not published.")
        .summary(
            "Collapses and inserts spheres in the order of the two-sided error at samples, and moves all \
             of them together to lessen its maximum.",
        )
        .published("nothing is published: 100 spheres")
        .native(NativeLevel {
            is_error_bound: true,
            ..NativeLevel::larger_is_coarser("error", "fraction of the diagonal")
        })
        .params(TightParams::describe());
    Tight { info, starter: Arc::new(starter) }
}

impl MedialSimplifier for Tight {
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(&self, shape: &'s Shape, params: &Params, run: &RunContext) -> Prepared<'s> {
        let params = params.typed::<TightParams>()?.validate()?;
        let start = Start::new(shape, Arc::clone(&self.starter), &params)?;
        let goal = Goal::new(shape, run.seed)?;
        Ok(Box::new(PreparedTight { start, goal, params, run: run.clone() }))
    }
}

/// One shape, with its start and its samples.
struct PreparedTight {
    start: Start,
    goal: Goal,
    params: TightParams,
    run: RunContext,
}

impl Simplification for PreparedTight {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let count = match some_spheres(level)? {
            Level::Spheres(count) => count,
            Level::Published => USUAL,
            Level::Native(bound) => return self.within(bound),
        };
        let mut diagnostics = Diagnostics::default();
        self.start.describe(&mut diagnostics);
        let state = self.simplified(count, &mut diagnostics)?;
        checked(level, state.mesh, None, diagnostics)
    }
}

impl PreparedTight {
    /// The level by error.
    fn within(&self, bound: f64) -> Result<Simplified> {
        let Self { start, goal, params, run } = self;
        let mut diagnostics = Diagnostics::default();
        start.describe(&mut diagnostics);
        let state = Within { start, goal, params, run, bound }.fewest(&mut diagnostics)?;
        checked(Level::Native(bound), state.mesh, Some(state.error), diagnostics)
    }

    /// Steps 1 to 7.
    fn simplified(&self, count: usize, diagnostics: &mut Diagnostics) -> Result<State> {
        let Self { goal, params, run, .. } = self;
        let (start, coarse) = self.start.meshes(count, run, diagnostics)?;
        bounded(start.spheres.len())?;
        let is_polish = start.spheres.len() <= count;
        diagnostics.count("crossing_faces_of_the_start", crossing_faces(&start).len());
        let mut descent = Descent::new(goal, goal.points(count), start)?;
        let mut witnesses = Witnesses::new(goal)?;
        let polish = Polish { goal, params, run, swaps: !is_polish, bound: None };
        if is_polish {
            if descent.mesh.spheres.len() < count {
                let spheres = descent.mesh.spheres.len();
                diagnostics
                    .warn(format!("{spheres} spheres instead of {count}: the start has no more"));
            }
            return polish.run(descent, witnesses, diagnostics);
        }
        descent.run(Objective::power(POWER, descent.largest()), PASS_STEPS[1], run)?;
        let with_fewer = |fewer| {
            let smaller = self.simplified(fewer, &mut Diagnostics::default())?;
            Ok::<_, SimplifyError>(Some(smaller).filter(|found| found.mesh.spheres.len() < count))
        };
        let fewer = fewer(count);
        if let (Some(fewer), Some(coarse)) = (fewer, coarse)
            && is_much_closer(coarse, &descent, run)?
            && let Some(smaller) = with_fewer(fewer)?
        {
            return self.grown(&smaller, count, diagnostics);
        }
        descent = reduced(descent, count, &mut witnesses, run)?;
        let reached = descent.mesh.spheres.len();
        if reached > count {
            diagnostics.warn(format!(
                "{reached} spheres instead of {count}: each further collapse would \
                 change the topology or fold a face"
            ));
        }
        let fewer = fewer.filter(|_| reached == count);
        let mut smaller = match fewer {
            Some(fewer) if is_as_good_with(&descent, fewer, run)? => with_fewer(fewer)?,
            _ => None,
        };
        if let Some(smaller) = &smaller
            && smaller.error < FAR_BELOW * descent.largest()
        {
            return self.grown(smaller, count, diagnostics);
        }
        descent = swapped_often(descent, &mut witnesses, run)?;
        let own = polish.run(descent, witnesses, diagnostics)?;
        if let Some(fewer) = fewer.filter(|_| smaller.is_none() && own.error < EXACT) {
            smaller = with_fewer(fewer)?;
        }
        match smaller {
            Some(smaller) if smaller.error < own.error => self.grown(&smaller, count, diagnostics),
            _ => Ok(own),
        }
    }

    /// Step 7: a state with more spheres and no larger error.
    fn grown(&self, from: &State, count: usize, diagnostics: &mut Diagnostics) -> Result<State> {
        let Self { goal, params, run, .. } = self;
        diagnostics.count("grown_from_spheres", from.mesh.spheres.len());
        let mut best = from.clone();
        let mut descent = Descent::new(goal, goal.points(count), best.mesh.clone())?;
        let mut witnesses = Witnesses::new(goal)?;
        let mut error = witnesses.join(&mut descent, f64::INFINITY)?;
        let (mut idle, mut least) = (0, error);
        while error > LEAST && descent.mesh.spheres.len() < count {
            let spheres = descent.mesh.spheres.len();
            let each = (count - spheres).min(spheres.div_ceil(GROWN));
            let Some(larger) = inserted(&descent, each, 0, run)? else { break };
            descent = larger;
            descent.run(Objective::power(POWER, descent.largest()), PASS_STEPS[1], run)?;
            error = witnesses.join(&mut descent, f64::INFINITY)?;
            idle = if error < (1.0 - GAIN) * least { 0 } else { idle + 1 };
            least = least.min(error);
            if idle > PATIENCE {
                break;
            }
        }
        if descent.mesh.spheres.len() > best.mesh.spheres.len() {
            let polish = Polish { goal, params, run, swaps: false, bound: None };
            let (state, _) = polish.rounds(descent, error, &mut witnesses)?;
            if state.error < best.error {
                best = state;
            }
        }
        best.mesh = padded(&best.mesh, count);
        Ok(best)
    }
}

/// Largest error of a start of few spheres after a few steps, in errors of the usual start, up to which the axis counts as a curve
/// or a point. Spheres on its facets only hinder each other.
const CLOSER: f64 = 0.5;

/// Spheres for each one that is inserted at once while a state grows.
const GROWN: usize = 4;

/// Fourth power mean of the errors with fewer spheres before the swaps, in that with more, at which a run with fewer follows. A
/// collapse to half the spheres mostly raises it by a third and more, but not where the axis is of few flat sheets, which
/// passes find by chance.
const AS_GOOD: f64 = 1.12;
/// Least error of the result, below which it follows in any case, a fraction of the diagonal: only an axis of flat sheets is met
/// as closely.
const EXACT: f64 = 3e-4;

/// Share of the error before the swaps, below which swaps and rounds do not bring it.
const FAR_BELOW: f64 = 0.25;

/// The largest of 10, 20, 50, 100, 200 and so on below a number.
fn fewer(count: usize) -> Option<usize> {
    let rungs = std::iter::successors(Some([10, 20, 50]), |rungs| Some(rungs.map(|n| 10 * n)));
    rungs.take_while(|rungs| rungs[0] < count).flatten().take_while(|&rung| rung < count).last()
}

/// Whether a start of fewer spheres is much closer after a few steps than one of many.
fn is_much_closer(few: MedialMesh, many: &Descent<'_>, run: &RunContext) -> Result<bool> {
    let mut few = Descent::new(many.goal, many.points.clone(), few)?;
    few.run(Objective::power(POWER, few.largest()), PASS_STEPS[1], run)?;
    Ok(few.largest() < CLOSER * many.largest())
}

/// Whether fewer spheres seem to have an error as small.
fn is_as_good_with(descent: &Descent<'_>, fewer: usize, run: &RunContext) -> Result<bool> {
    let judge = Objective::power(POWER, descent.largest());
    let limit = AS_GOOD.powi(POWER) * descent.value(&judge);
    let Descent { goal, points, mesh, .. } = descent;
    let mut smaller = Descent::new(goal, points.clone(), mesh.clone())?;
    while smaller.mesh.spheres.len() > fewer {
        let target = fewer.max((smaller.mesh.spheres.len() as f64 * LEFT[1]) as usize);
        let Some(passed) = passed(&smaller, target, 1, run)? else { return Ok(false) };
        smaller = passed;
    }
    Ok(smaller.value(&judge) <= limit)
}

/// # Errors
/// When there are more spheres than can be placed together.
fn bounded(spheres: usize) -> Result<()> {
    if spheres <= MOST {
        return Ok(());
    }
    Err(SimplifyError::unsupported(format!(
        "`tight` places at most {MOST} spheres (found {spheres}); request fewer, or simplify by another \
         method first"
    )))
}

/// Step 4: passes of collapses until `count` spheres are left, or no collapse is possible. After the last ones the
/// places of the largest errors join: a face can slip across a hole between the samples.
fn reduced<'a>(
    mut descent: Descent<'a>,
    count: usize,
    witnesses: &mut Witnesses<'a>,
    run: &RunContext,
) -> Result<Descent<'a>> {
    while descent.mesh.spheres.len() > count {
        let spheres = descent.mesh.spheres.len();
        let near = usize::from(spheres <= MANY * count);
        let least = if near == 1 { count } else { MANY * count };
        let target = least.max((spheres as f64 * LEFT[near]) as usize);
        let Some(smaller) = passed(&descent, target, near, run)? else { break };
        descent = smaller;
        if near == 1 {
            witnesses.join(&mut descent, 0.0)?;
        }
    }
    Ok(descent)
}

/// The descent after one pass, far from the target or `near` to it.
fn passed<'a>(
    descent: &Descent<'a>,
    target: usize,
    near: usize,
    run: &RunContext,
) -> Result<Option<Descent<'a>>> {
    let Some(passed) = collapse::pass(descent, target, near == 1, run)? else { return Ok(None) };
    let mut smaller = Descent::new(descent.goal, descent.points.clone(), passed.mesh)?;
    smaller.run(Objective::power(POWER, smaller.largest()), PASS_STEPS[near], run)?;
    Ok(Some(smaller))
}

/// Step 5, while it lowers the sum of the eighth powers.
fn swapped_often<'a>(
    mut descent: Descent<'a>,
    witnesses: &mut Witnesses<'a>,
    run: &RunContext,
) -> Result<Descent<'a>> {
    let mut each = (descent.mesh.spheres.len() / 12).max(2);
    descent.run(Objective::power(POWER, descent.largest()), PASS_STEPS[1], run)?;
    let judge = Objective::power(8, descent.largest());
    for _ in 0..FIRST_SWAPS {
        let trial = swapped(&descent, each, 0, run)?;
        match trial.filter(|trial| trial.value(&judge) < descent.value(&judge)) {
            Some(trial) => {
                descent = trial;
                witnesses.join(&mut descent, 0.0)?;
            }
            None if each > 1 => each /= 2,
            None => break,
        }
    }
    Ok(descent)
}

// ----------------------------------------------------------------------------
// Step 1: the medial mesh that everything starts from.

/// Spheres of the start for each sphere of the target, up to [`MOST_NEEDED`]. With three times 500
/// spheres the mean error was a seventh larger.
const ENOUGH: usize = 5;
/// Limit of the spheres of the start that [`ENOUGH`] sets.
const MOST_NEEDED: usize = 2_500;

/// Samples of a surface that crosses itself, which has no conforming triangulation.
const OF_CROSSING: usize = 20_000;

/// A start: the initial medial mesh of a shape, with a method that simplifies it.
struct Start {
    shape: Shape,
    starter: Arc<dyn MedialSimplifier>,
    least: usize,
    betti: [u64; 3],
}

impl Start {
    /// Adds samples to a coarse surface.
    ///
    /// # Errors
    /// When the samples do not span space, or the given mesh has no sphere.
    fn new(
        shape: &Shape,
        starter: Arc<dyn MedialSimplifier>,
        params: &TightParams,
    ) -> Result<Self> {
        // Built here, so that they count as substrates of the shape.
        shape.surface_tree()?;
        shape.inside_test();
        let finer = match shape.options().sampling {
            _ if shape.has_given_initial() => None,
            Sampling::Conforming { least } => {
                let samples = shape.mesh().vertices.len().max(least);
                (samples < params.samples).then_some(Sampling::Conforming { least: params.samples })
            }
            _ => None,
        };
        let mut shape = finer.map_or_else(|| shape.clone(), |finer| shape.resampled(finer));
        let mut initial = shape.initial()?;
        if shape.sampling_warning().is_some() {
            shape = shape.resampled(Sampling::BlueNoise { count: OF_CROSSING, seed: 0 });
            initial = shape.initial()?;
        }
        Ok(Self { betti: betti(&initial), shape, starter, least: params.start })
    }

    /// Adds its warnings and counts.
    fn describe(&self, diagnostics: &mut Diagnostics) {
        diagnostics.count("samples_of_the_start", self.shape.samples().len());
        if let Some(warning) = topology_warning(self.betti, self.shape.expected_betti()) {
            diagnostics.warn(format!("the start is wrong, and so is the result: {warning}"));
        }
    }

    /// The start for a number of spheres, and one of the next smaller number.
    ///
    /// # Errors
    /// Those of the other method.
    fn meshes(
        &self,
        count: usize,
        run: &RunContext,
        diagnostics: &mut Diagnostics,
    ) -> Result<(MedialMesh, Option<MedialMesh>)> {
        let [few, many] = [MANY, ENOUGH].map(|times| times.saturating_mul(count));
        let wanted = self.least.max(few).max(many.min(MOST_NEEDED));
        let enough = if self.shape.has_given_initial() { count } else { wanted };
        self.simplified(wanted, enough, fewer(count), run, diagnostics)
    }

    /// A start of `wanted` spheres, and one of `fewer`; the initial medial mesh alone if it has at most `enough`.
    ///
    /// # Errors
    /// Those of the other method.
    fn simplified(
        &self,
        wanted: usize,
        enough: usize,
        fewer: Option<usize>,
        run: &RunContext,
        diagnostics: &mut Diagnostics,
    ) -> Result<(MedialMesh, Option<MedialMesh>)> {
        let initial = self.shape.initial()?;
        let (mesh, coarse) = if initial.spheres.len() <= enough {
            (MedialMesh::clone(&initial), None)
        } else {
            let mut levels = self.starter.prepare(&self.shape, &Params::none(), run)?;
            let found = levels.at(Level::Spheres(wanted))?;
            // More spheres are left than wanted where nothing more can be collapsed.
            if found.mesh.spheres.len() > wanted {
                found
                    .diagnostics
                    .warnings
                    .into_iter()
                    .for_each(|warning| diagnostics.warn(warning));
            }
            let coarse = fewer.map(|fewer| levels.at(Level::Spheres(fewer))).transpose()?;
            (found.mesh, coarse.map(|coarse| coarse.mesh))
        };
        let bare = |mesh| MedialMesh { contacts: None, ..mesh };
        Ok((bare(mesh), coarse.map(bare)))
    }
}

// ----------------------------------------------------------------------------
// Step 6: higher and higher powers, with witnesses of the largest errors joining in between.
//
// 1. Steps at the powers 4 and 8.
// 2. Rounds: the places of the largest errors join the samples as witnesses, then steps at the power 32
//    plus `lambda` times the mean.
// 3. Swaps of a few spheres, and later of one, from the best state so far. Only the spheres around them move at
//    first; where that lowers the sum of the powers all spheres take a step, and the error is measured. If it is
//    little larger than before, its places join as witnesses, and a few more steps follow: without this, most swaps
//    that lower the errors at samples fail by an error between them.
// 4. Rounds as in 2, with the witnesses that were found meanwhile.
//
// The result is the state of the least measured error.

/// Powers and steps before the first round.
const WARM: [(i32, usize); 2] = [(4, 9), (8, 14)];

/// Power of the rounds and of the swaps between them.
const ROUND_POWER: i32 = 32;

/// Steps of the descent in a round.
const ROUND_STEPS: usize = 8;

/// Share by which a round or a swap has to lower the error to count as a gain.
const GAIN: f64 = 0.01;

/// Consecutive rounds, or insertions while a state grows, without a gain that are accepted.
const PATIENCE: usize = 2;

/// Limit of the swaps after the rounds.
const MAX_SWAPS: usize = 24;
/// Consecutive swaps of one sphere without a gain that end the search.
const MAX_FAILURES: usize = 6;

/// Spheres for each sphere that the first swap replaces. Later swaps replace fewer, and then one.
const FIRST_SHARE: usize = 25;

/// Steps of all spheres after a swap, and further ones if its error is below [`CHANCE`].
const SWAP_STEPS: [usize; 2] = [1, 4];
/// Limit of the error of a swap for further steps, in least errors so far.
const CHANCE: f64 = 1.6;

/// The last rounds on one goal.
struct Polish<'a> {
    goal: &'a Goal,
    params: &'a TightParams,
    run: &'a RunContext,
    /// Whether connectivity may change.
    swaps: bool,
    /// The error bound, if there is one: swaps follow only where they can bring the error to it.
    bound: Option<f64>,
}

/// A mesh with its measured error.
#[derive(Clone)]
struct State {
    mesh: MedialMesh,
    error: f64,
}

impl<'a> Polish<'a> {
    /// Runs all rounds.
    ///
    /// # Errors
    /// When the run is cancelled, or the mesh cannot be measured.
    fn run(
        &self,
        mut descent: Descent<'a>,
        mut witnesses: Witnesses<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<State> {
        for (power, steps) in WARM {
            descent.run(Objective::power(power, descent.largest()), steps, self.run)?;
        }
        let error = witnesses.join(&mut descent, f64::INFINITY)?;
        let (mut best, points) = self.rounds(descent, error, &mut witnesses)?;
        let is_hopeless = self.bound.is_some_and(|bound| best.error > RESCUED * bound);
        if self.swaps && !is_hopeless && !self.is_within(&best) {
            let from = self.at(&best, points)?;
            let (from, helped) = self.swapped(from, &mut best, &mut witnesses)?;
            diagnostics.count("swaps_that_helped", helped);
            if self.is_within(&best) {
                return Ok(best);
            }
            // With all the witnesses that were found meanwhile.
            let (again, _) = self.rounds(from, best.error, &mut witnesses)?;
            if again.error < best.error {
                best = again;
            }
        }
        Ok(best)
    }

    /// Whether a state reaches the error that a bound aims at: a smaller error would help no one.
    fn is_within(&self, state: &State) -> bool {
        self.bound.is_some_and(|bound| state.error <= AIM * bound)
    }

    /// A descent from a state.
    fn at(&self, state: &State, points: Points) -> Result<Descent<'a>> {
        Descent::new(self.goal, points, state.mesh.clone())
    }

    /// Step 2. Returns the best state, and the points with all witnesses.
    fn rounds(
        &self,
        from: Descent<'a>,
        mut error: f64,
        witnesses: &mut Witnesses<'_>,
    ) -> Result<(State, Points)> {
        let mut best = State { mesh: from.mesh, error };
        let mut descent = self.at(&best, from.points)?;
        let mut idle = 0;
        for _ in 0..self.params.rounds {
            let objective = self.objective(error);
            descent.run(objective, ROUND_STEPS, self.run)?;
            error = witnesses.join(&mut descent, f64::INFINITY)?;
            idle = if error < (1.0 - GAIN) * best.error { 0 } else { idle + 1 };
            if error < best.error {
                best = State { mesh: descent.mesh.clone(), error };
            }
            if idle > PATIENCE {
                break;
            }
        }
        Ok((best, descent.points))
    }

    /// Step 3, from the best state. Returns the new one with all witnesses, and how many swaps helped.
    fn swapped(
        &self,
        mut from: Descent<'a>,
        best: &mut State,
        witnesses: &mut Witnesses<'_>,
    ) -> Result<(Descent<'a>, usize)> {
        let mut each = (best.mesh.spheres.len() / FIRST_SHARE).max(1);
        let (mut skipped, mut idle, mut helped) = (0, 0, 0);
        for _ in 0..MAX_SWAPS {
            let objective = self.objective(best.error);
            let trial = swapped(&from, each, skipped, self.run)?;
            let mut error = f64::INFINITY;
            let mut is_kept = false;
            if let Some(mut trial) = trial {
                error = self.tried(&mut trial, from.value(&objective), best.error, witnesses)?;
                is_kept = error < best.error;
                if !is_kept {
                    from.join_new_of(&trial.points)?;
                } else {
                    from = trial;
                }
            }
            if error < (1.0 - GAIN) * best.error {
                idle = 0;
            } else if each == 1 {
                idle += 1;
            }
            if error < best.error {
                *best = State { mesh: from.mesh.clone(), error };
            }
            if is_kept {
                (helped, skipped) = (helped + 1, 0);
            } else if each > 1 {
                // Fewer at once, then one at another place.
                each /= 2;
            } else {
                skipped += 1;
            }
            if idle >= MAX_FAILURES || self.is_within(best) {
                break;
            }
        }
        Ok((from, helped))
    }

    /// The measured error after a swap and steps of all spheres; infinite if the value is not below `value`.
    ///
    /// Where it is little larger than the least so far, mostly at places without a sample, the witnesses of these
    /// places join, and a few steps more are taken.
    fn tried(
        &self,
        trial: &mut Descent<'a>,
        value: f64,
        least: f64,
        witnesses: &mut Witnesses<'_>,
    ) -> Result<f64> {
        let objective = self.objective(least);
        trial.run(objective, SWAP_STEPS[0], self.run)?;
        // A value that is not a number is not below.
        let is_below = trial.value(&objective) < value;
        if !is_below {
            return Ok(f64::INFINITY);
        }
        let mut error = witnesses.join(trial, least)?;
        if error >= least && error < CHANCE * least {
            trial.run(objective, SWAP_STEPS[1], self.run)?;
            error = witnesses.join(trial, least)?;
        }
        Ok(error)
    }

    /// A little below the error counts as one, so that larger ones weigh heavily.
    fn objective(&self, error: f64) -> Objective {
        Objective { power: ROUND_POWER, mean: self.params.lambda, scale: 0.9 * error }
    }
}

// ----------------------------------------------------------------------------
// The parameters of `tight`.

medial::parameters! {
    /// Parameters of `tight`.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct TightParams {
        /// Weight of the mean error next to the high powers: larger for a smaller mean error.
        lambda: f64 = 0.6, "pure number";
        /// Spheres that the start is simplified to, unless five times the target, up to 2,500, or three times it are more.
        start: usize = 800, "spheres";
        /// Samples of the initial medial mesh at least; a coarse surface gets more.
        samples: usize = 5_000, "samples";
        /// Rounds of steps at high powers before each further one begins with a swap.
        rounds: usize = 8, "rounds";
    }
}

/// Upper limit of the parameter `samples`.
const MOST_SAMPLES: usize = 200_000;

/// Upper limit of the parameter `rounds`.
const MOST_ROUNDS: usize = 1_000;

impl TightParams {
    /// The same parameters, if they make sense.
    fn validate(self) -> Result<Self> {
        within("lambda", self.lambda, 0.0..f64::INFINITY)?;
        within("samples", self.samples, 100..=MOST_SAMPLES)?;
        within("rounds", self.rounds, 0..=MOST_ROUNDS)?;
        Ok(self)
    }
}

// ----------------------------------------------------------------------------
// The level by error: few spheres whose two-sided error a certificate holds within a bound.
//
// One descent through the counts, until the largest error at samples says that the bound is near. From its meshes
// the rounds are made for the count that is reached, and for a few that its error foretells, which continue from the
// smallest mesh within the bound.

/// Largest error at samples at which the descent ends, in errors aimed at. Swaps and rounds lower it by
/// about this factor.
const WATCHED: f64 = 1.9;

/// Factor below that error from which passes are large.
const SMALL: f64 = 1.5;

/// Factor above the range [`NEAR`] from which a state is given up before any round.
const FAR: f64 = 6.0;

/// Exponent of the error, by which the next count after one within the bound is smaller.
const RATE: f64 = 0.9;
/// Exponent of the error, by which the next count after a miss is larger. Generous, because each miss
/// costs a trial.
const MORE: f64 = 1.3;
/// Smallest and largest factor of the count after a miss.
const GROWTH: [f64; 2] = [1.15, 1.6];

/// Smallest and largest share of a count within the bound that the next count has.
const SHARES: [f64; 2] = [0.35, 0.87];

/// Range of errors that swaps and rounds can bring to the bound, in bounds.
const NEAR: [f64; 2] = [0.5, WATCHED];

/// Largest error after the rounds, in bounds, that swaps can bring to the bound.
const RESCUED: f64 = 1.5;

/// Error aimed at between a count within the bound and one that misses it, as a share of the first aim.
const CLOSE: f64 = 0.97;

/// Limit of the tried counts once one is within the bound.
const TRIALS: usize = 4;
/// Ratio of a count within the bound to the largest miss, up to which no count between them is tried.
const APART: f64 = 1.15;

/// Measured error that is aimed at, as a share of the bound.
const AIM: f64 = 0.97;
/// Width of the certificate, as a share of the difference between the bound and the measured error.
const WIDTH: f64 = 0.2;
/// Smallest and largest width of the certificate, in bounds. The narrower, the slower.
const WIDTHS: [f64; 2] = [0.002, 0.1];
/// Smallest bound, a fraction of the diagonal. No number of spheres in reach keeps a smaller one.
const LEAST: f64 = 1e-5;

/// The search for one bound.
struct Within<'a> {
    start: &'a Start,
    goal: &'a Goal,
    params: &'a TightParams,
    run: &'a RunContext,
    /// Two-sided error, a fraction of the diagonal.
    bound: f64,
}

impl Within<'_> {
    /// A state of few spheres within the bound, with its certified error.
    ///
    /// # Errors
    /// When the bound is no length, or no state is within it.
    pub fn fewest(&self, diagnostics: &mut Diagnostics) -> Result<State> {
        let bound = self.bound;
        level_within("error", bound, (Bound::Excluded(LEAST), Bound::Excluded(f64::INFINITY)))?;
        let aim = AIM * bound;
        let limit = WATCHED * aim;
        let meshes = self.descended(limit, diagnostics)?;
        let finest = meshes[0].0.spheres.len();
        let of = |(mesh, error): &(MedialMesh, f64)| (mesh.spheres.len(), *error);
        let mut wanted = match &meshes[..] {
            [.., above, below] if below.1 > limit => between(of(above), of(below), limit),
            [.., last] => last.0.spheres.len(),
            [] => unreachable!("the start is a mesh"),
        };
        let mut least = f64::INFINITY;
        // The state, and the count and measured error of it and of the largest count that missed the bound.
        let (mut within, mut held, mut missed) = (None, None, None::<(usize, f64)>);
        let (mut trials, mut misses) = (0, 0);
        // The mesh of fewest spheres within the bound.
        let mut smallest: Option<MedialMesh> = None;
        loop {
            let count = wanted;
            let mut state = self.with(&meshes, smallest.as_ref(), count)?;
            let now = (state.mesh.spheres.len(), state.error);
            // Trials far from the bound end early and cost little.
            trials += usize::from(!is_far(bound, now.1));
            if state.error <= bound {
                let width =
                    (WIDTH * (bound - state.error)).clamp(WIDTHS[0] * bound, WIDTHS[1] * bound);
                state.error = self.goal.certified(&state.mesh, width)?;
            }
            least = least.min(state.error);
            if state.error <= bound {
                if held.is_none_or(|(spheres, _)| now.0 < spheres) {
                    smallest = Some(state.mesh.clone());
                    (within, held) = (Some(state), Some(now));
                }
                misses = 0;
            } else if missed.is_none_or(|(spheres, _)| spheres < now.0) {
                missed = Some((now.0, now.1.max(state.error)));
                misses += 1;
            }
            wanted = match (held, missed) {
                (Some((many, _)), Some((few, _))) if many <= few + 1 => break,
                (Some(held), Some(missed)) => {
                    let (many, few) = (held.0, missed.0);
                    // Errors that fall in a step, as of flat solids, mislead an interpolation.
                    let is_step = misses > 1 || is_far(aim, held.1) || is_far(aim, missed.1);
                    let wanted = if is_step {
                        ((few * many) as f64).sqrt().round() as usize
                    } else {
                        between(held, missed, CLOSE * aim)
                    };
                    wanted.min((SHARES[1] * many as f64) as usize).clamp(few + 1, many - 1)
                }
                (Some((spheres, error)), None) => {
                    let share = (error / aim).powf(RATE).clamp(SHARES[0], SHARES[1]);
                    (spheres as f64 * share) as usize
                }
                (None, Some((spheres, _))) if spheres >= finest => break,
                (None, Some((spheres, error))) => {
                    let times = (error / aim).powf(MORE).clamp(GROWTH[0], GROWTH[1]);
                    (spheres as f64 * times).ceil().min(finest as f64) as usize
                }
                (None, None) => break,
            };
            // No collapse is left that keeps the homotopy type: fewer spheres are out of reach.
            let is_last = now.0 > count;
            let is_enough = |(spheres, _)| {
                let is_close = missed.is_some_and(|(few, _)| spheres as f64 <= APART * few as f64);
                wanted == 0 || is_last || is_close || trials >= TRIALS
            };
            if held.is_some_and(is_enough) {
                break;
            }
        }
        within.ok_or_else(|| {
            SimplifyError::Level(format!(
                "no result within {bound} of the diagonal: the smallest error was {least:.3e}, with up to \
                 {finest} spheres"
            ))
        })
    }

    /// The meshes of a descent until the largest error at samples rises above a limit, with these errors.
    fn descended(
        &self,
        limit: f64,
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<(MedialMesh, f64)>> {
        let Self { start, goal, run, .. } = *self;
        let mut wanted = self.params.start.max(MANY);
        loop {
            let (mesh, _) = start.simplified(wanted, wanted, None, run, diagnostics)?;
            let spheres = mesh.spheres.len();
            bounded(spheres)?;
            let mut descent = Descent::new(goal, goal.points(MOST), mesh)?;
            descent.run(Objective::power(POWER, descent.largest()), PASS_STEPS[1], run)?;
            let mut meshes = vec![(descent.mesh.clone(), descent.largest())];
            // The start of a flat solid can be worse than its coarser meshes.
            let mut is_below = descent.largest() < limit;
            let goes_on =
                |largest: f64, is_below: bool| largest < if is_below { limit } else { FAR * limit };
            while goes_on(descent.largest(), is_below) && descent.mesh.spheres.len() > 1 {
                let near = usize::from(SMALL * descent.largest() > limit);
                let target = (descent.mesh.spheres.len() as f64 * LEFT[near]) as usize;
                let Some(smaller) = passed(&descent, target.max(1), near, run)? else { break };
                descent = smaller;
                is_below |= descent.largest() < limit;
                meshes.push((descent.mesh.clone(), descent.largest()));
            }
            // A start of fewer spheres than wanted is all that there is, and the finest start has to do.
            if is_below || spheres < wanted || wanted >= MOST {
                return Ok(meshes);
            }
            wanted = (2 * wanted).min(MOST);
        }
    }

    /// The state of a number of spheres, from `smallest` or the last mesh with [`MANY`] times as many, whichever
    /// collapses to the smaller error. Without rounds where that error is far from the bound.
    fn with(
        &self,
        meshes: &[(MedialMesh, f64)],
        smallest: Option<&MedialMesh>,
        count: usize,
    ) -> Result<State> {
        let Self { goal, params, run, .. } = *self;
        let enough = meshes.iter().rev().find(|(mesh, _)| mesh.spheres.len() >= MANY * count);
        let (mesh, _) = enough.unwrap_or(&meshes[0]);
        let (mut descent, mut witnesses, mut error) = self.collapsed(mesh, count)?;
        // Either way can end in a bad state of a flat solid, whose errors fall in steps.
        if let Some(mesh) = smallest.filter(|mesh| mesh.spheres.len() >= count) {
            let other = self.collapsed(mesh, count)?;
            if other.2 < error {
                (descent, witnesses, error) = other;
            }
        }
        if error < NEAR[0] * self.bound || error > FAR * NEAR[1] * self.bound {
            return Ok(State { mesh: descent.mesh, error });
        }
        let descent = swapped_often(descent, &mut witnesses, run)?;
        let polish = Polish { goal, params, run, swaps: true, bound: Some(self.bound) };
        polish.run(descent, witnesses, &mut Diagnostics::default())
    }

    /// A mesh collapsed to a number of spheres, with its measured error. The last passes are careful and with witnesses, as
    /// those to a given number of spheres.
    fn collapsed(
        &self,
        mesh: &MedialMesh,
        count: usize,
    ) -> Result<(Descent<'_>, Witnesses<'_>, f64)> {
        let Self { goal, run, .. } = *self;
        let mut descent = Descent::new(goal, goal.points(count), mesh.clone())?;
        descent.run(Objective::power(POWER, descent.largest()), PASS_STEPS[1], run)?;
        let mut witnesses = Witnesses::new(goal)?;
        descent = reduced(descent, count, &mut witnesses, run)?;
        let error = witnesses.join(&mut descent, f64::INFINITY)?;
        Ok((descent, witnesses, error))
    }
}

/// Whether an error is far from a bound.
fn is_far(bound: f64, error: f64) -> bool {
    !(NEAR[0] * bound..=NEAR[1] * bound).contains(&error)
}

/// The number of spheres between two at which an error is to be expected: between them the error is a power of it.
fn between((few, large): (usize, f64), (many, small): (usize, f64), error: f64) -> usize {
    let part = (error / large).ln() / (small / large).ln();
    let count = few as f64 * (many as f64 / few as f64).powf(part.clamp(0.0, 1.0));
    if count.is_finite() { count.round() as usize } else { few.midpoint(many) }
}
