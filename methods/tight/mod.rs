//! `tight`: all spheres are placed together, for the two-sided error.
//!
//! A method of this project; nothing of it is published. Q-MAT prices a collapse by planes, HEM by one
//! side of the error; here both the order of the collapses and the places of the spheres follow the
//! errors of samples on both sides: surface points that the union misses, balls that protrude, and points
//! inside that no primitive holds.
//!
//! 1. *Start.* The initial medial mesh, of `samples` samples at least, simplified by another method (Q-MAT) to
//!    `start` spheres, five times the target up to 2,500, or three times it, whichever is most (`start.rs`).
//! 2. *Residuals* (`goal.rs`): at samples of the surface and along its sharp edges `sigma`; at points of the primitives how far their
//!    ball protrudes; at interior points how far they are from being held.
//! 3. *Descent* (`rounds.rs`): Levenberg-Marquardt on all spheres at once for a power of the residuals,
//!    with a sparse Cholesky factorisation. A step that would take a centre out of the
//!    solid, fold a face over or make one cross another is taken back there (`collapse.rs`).
//! 4. *Collapse* (`collapse.rs`): passes of the cheapest edges, priced by the samples that their stars
//!    serve; a few steps of 3 after each pass, at the power 4. Within five times the target, the places of the
//!    largest errors join the samples after each pass, and after each swap of 5.
//! 5. *Swap* (`start.rs`): spheres are inserted where the error is largest, and as many edges collapsed
//!    where it hurts least. Only the spheres around them move then (`settle`).
//! 6. *Rounds* (`rounds.rs`): steps of 3 at powers up to 32, between which the largest errors, found by
//!    local ascent and a sweep of both sides, join the samples, and balls are watched where the union came out of the solid;
//!    then swaps as in 5, each with a second chance, and rounds again. The state
//!    with the least measured error is the result.
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
//!   certificate. It takes two to three times as long as the number of spheres that is found.
//!
//! # Starting from a given mesh
//!
//! If the shape has an external initial medial mesh, that is the start. If it has no more spheres than requested, its
//! connectivity stays as it is and its spheres are moved (step 6 without swaps).

mod collapse;
mod goal;
mod rounds;
mod start;
#[cfg(test)]
mod tests;

use std::ops::Bound;
use std::sync::Arc;

use goal::Goal;
use medial::complex::{MedialMesh, crossing_faces};
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, MedialSimplifier, MethodInfo, NativeLevel, ParamFields, Params, RunContext,
    Simplification, Simplified, SimplifyError,
};
use rounds::{Descent, Objective, Polish, State, Witnesses};
use start::Start;

use crate::levels::{checked, level_within, some_spheres, within};
use crate::{Prepared, Result};

/// Spheres of [`Level::Published`].
const USUAL: usize = 100;

/// Spheres that are placed together at most, the start's included: memory and time stay bounded.
const MOST: usize = 15_000;

/// While there are more than this many times the target, collapses are made in large passes.
const MANY: usize = 3;

/// The power until the last rounds. With squares, the steps after a pass let a single ball protrude ever farther,
/// up to faces across a hole.
const POWER: i32 = 4;

/// The share of spheres that a pass leaves, far from the target and near to it.
const LEFT: [f64; 2] = [0.4, 0.6];

/// Steps after a pass, far from the target and near to it.
const STEPS: [usize; 2] = [2, 4];

/// Swaps before the rounds.
const SWAPS: usize = 4;

/// The method, with another one that makes its start.
pub struct Tight {
    info: MethodInfo,
    starter: Arc<dyn MedialSimplifier>,
}

/// The `tight` simplifier, starting from the result of `starter`.
///
/// Supports [`Level::Spheres`] up to a few thousand, at the cost of some hundred evaluations of all samples, and
/// [`Level::Native`], a bound of the two-sided error, at two to three times that.
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
        let start = self.start.mesh(count, &self.run, &mut diagnostics)?;
        bounded(start.spheres.len())?;
        let mesh = self.simplified(start, count, &mut diagnostics)?;
        checked(level, mesh, None, diagnostics)
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

    /// Steps 2 to 6.
    fn simplified(
        &self,
        start: MedialMesh,
        count: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<MedialMesh> {
        let Self { goal, params, run, .. } = self;
        let is_polish = start.spheres.len() <= count;
        diagnostics.count("crossing_faces_of_the_start", crossing_faces(&start).len());
        let mut descent = Descent::new(goal, goal.points(count), start)?;
        let mut witnesses = Witnesses::new(goal)?;
        if is_polish {
            if descent.mesh.spheres.len() < count {
                let spheres = descent.mesh.spheres.len();
                diagnostics
                    .warn(format!("{spheres} spheres instead of {count}: the start has no more"));
            }
        } else {
            descent = reduced(descent, count, &mut witnesses, run)?;
            let reached = descent.mesh.spheres.len();
            if reached > count {
                diagnostics.warn(format!(
                    "{reached} spheres instead of {count}: no edge is left whose collapse keeps the \
                     homotopy type and folds no face"
                ));
            }
            descent = swapped_often(descent, &mut witnesses, run)?;
        }
        let polish = Polish { goal, params, run, swaps: !is_polish, bound: None };
        let state = polish.run(descent, witnesses, diagnostics)?;
        Ok(state.mesh)
    }
}

/// # Errors
/// When there are more spheres than can be placed together.
fn bounded(spheres: usize) -> Result<()> {
    if spheres <= MOST {
        return Ok(());
    }
    Err(SimplifyError::unsupported(format!(
        "{spheres} spheres to begin with; `tight` places at most {MOST} together; request fewer, or \
         simplify them by another method first"
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
    descent.run(Objective::power(POWER, descent.largest()), STEPS[1], run)?;
    while descent.mesh.spheres.len() > count {
        let spheres = descent.mesh.spheres.len();
        let near = usize::from(spheres <= MANY * count);
        let least = if near == 1 { count } else { MANY * count };
        let target = least.max((spheres as f64 * LEFT[near]) as usize);
        let Some(smaller) = passed(&descent, target, near, run)? else { break };
        descent = smaller;
        if near == 1 {
            witnesses.measure(&mut descent, 0.0)?;
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
    smaller.run(Objective::power(POWER, smaller.largest()), STEPS[near], run)?;
    Ok(Some(smaller))
}

/// Step 5, while it lowers the sum of the eighth powers.
fn swapped_often<'a>(
    mut descent: Descent<'a>,
    witnesses: &mut Witnesses<'a>,
    run: &RunContext,
) -> Result<Descent<'a>> {
    let mut each = (descent.mesh.spheres.len() / 12).max(2);
    descent.run(Objective::power(POWER, descent.largest()), STEPS[1], run)?;
    let judge = Objective::power(8, descent.largest());
    for _ in 0..SWAPS {
        let trial = start::swapped(&descent, each, 0, run)?;
        match trial.filter(|trial| trial.value(&judge) < descent.value(&judge)) {
            Some(trial) => {
                descent = trial;
                witnesses.measure(&mut descent, 0.0)?;
            }
            None if each > 1 => each /= 2,
            None => break,
        }
    }
    Ok(descent)
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

/// Most samples that are added.
const MOST_SAMPLES: usize = 200_000;

/// Most rounds.
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
// the rounds are made for the count that is reached, and for one or two that its error foretells.

/// The descent ends where the largest error at samples is this many times the error aimed at: swaps and rounds
/// lower it by about as much.
const WATCHED: f64 = 1.9;

/// With an error this many times below that, it takes large passes.
const SMALL: f64 = 1.5;

/// A state whose error is this many times above the range [`NEAR`] before any round is given up.
const FAR: f64 = 6.0;

/// From a count within the bound, the next one is smaller by this power of the error. From a count that misses it, the next
/// one is larger by the power `MORE`, within the limits `GROWTH`. That is generous, because each miss costs a trial.
const RATE: f64 = 0.9;
const MORE: f64 = 1.3;
const GROWTH: [f64; 2] = [1.15, 1.6];

/// The next smaller count is at least this share of one within the bound.
const LEAST_SHARE: f64 = 0.35;

/// An error outside this range, in bounds, is far from the bound: swaps and rounds change it by less.
const NEAR: [f64; 2] = [0.5, WATCHED];

/// Between a count that holds the bound and one that does not, this share of the error is aimed at.
const CLOSE: f64 = 0.97;

/// Counts that are tried, if one of them is within the bound, and more where none missed it or it is this many times the
/// largest that did. A count above this share of it is not worth a trial.
const TRIALS: [usize; 2] = [3, 5];
const APART: f64 = 1.25;
const ALIKE: f64 = 0.93;

/// The measured error that is aimed at, a share of the bound, and the width of the certificate, another one.
const AIM: f64 = 0.97;
const WIDTH: f64 = 0.01;
/// A smaller bound, a fraction of the diagonal, is refused: no count of spheres in reach keeps it.
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
        // The mesh of fewest spheres far within the bound: the next trials continue from it. After a miss they start
        // from the descent again, because a mesh without rounds can miss a bound that another one of its size meets.
        let mut smallest: Option<MedialMesh> = None;
        loop {
            let mut state = self.with(&meshes, smallest.as_ref(), wanted)?;
            let now = (state.mesh.spheres.len(), state.error);
            // Trials far from the bound end early and cost little.
            trials += usize::from(!is_far(bound, now.1));
            if state.error <= bound {
                state.error = self.goal.certified(&state.mesh, WIDTH * bound)?;
            }
            least = least.min(state.error);
            if state.error <= bound {
                if held.is_none_or(|(spheres, _)| now.0 < spheres) {
                    if missed.is_none() && is_far(bound, now.1) {
                        smallest = Some(state.mesh.clone());
                    }
                    (within, held) = (Some(state), Some(now));
                }
                misses = 0;
            } else if missed.is_none_or(|(spheres, _)| spheres < now.0) {
                missed = Some((now.0, now.1.max(state.error)));
                smallest = None;
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
                    wanted.clamp(few + 1, many - 1)
                }
                (Some((spheres, error)), None) => {
                    let share = (error / aim).powf(RATE).max(LEAST_SHARE);
                    (spheres as f64 * share) as usize
                }
                (None, Some((spheres, _))) if spheres >= finest => break,
                (None, Some((spheres, error))) => {
                    let times = (error / aim).powf(MORE).clamp(GROWTH[0], GROWTH[1]);
                    (spheres as f64 * times).ceil().min(finest as f64) as usize
                }
                (None, None) => break,
            };
            let is_enough = |(spheres, _)| {
                let spheres = spheres as f64;
                let is_far = missed.is_none_or(|(missed, _)| spheres > APART * missed as f64);
                wanted == 0
                    || wanted as f64 > ALIKE * spheres
                    || trials >= TRIALS[usize::from(is_far)]
            };
            if held.is_some_and(is_enough) {
                break;
            }
        }
        within.ok_or_else(|| {
            SimplifyError::Level(format!(
                "no state within {bound} of the diagonal was found: the least two-sided error was {least:.3e}, \
                 with up to {finest} spheres"
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
            let mesh = start.simplified(wanted, wanted, run, diagnostics)?;
            let spheres = mesh.spheres.len();
            bounded(spheres)?;
            let mut descent = Descent::new(goal, goal.points(MOST), mesh)?;
            descent.run(Objective::power(POWER, descent.largest()), STEPS[1], run)?;
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

    /// The state of a number of spheres: from `smallest` if that has as many, or the last mesh with [`MANY`] times as
    /// many. Without rounds where the error is far from the bound.
    fn with(
        &self,
        meshes: &[(MedialMesh, f64)],
        smallest: Option<&MedialMesh>,
        count: usize,
    ) -> Result<State> {
        let Self { goal, params, run, .. } = *self;
        // The last passes are careful and with witnesses, as those to a given number of spheres.
        let enough = meshes.iter().rev().find(|(mesh, _)| mesh.spheres.len() >= MANY * count);
        let smallest = smallest.filter(|mesh| mesh.spheres.len() >= count);
        let mesh = smallest.unwrap_or(&enough.unwrap_or(&meshes[0]).0);
        let descent = Descent::new(goal, goal.points(count), mesh.clone())?;
        let mut witnesses = Witnesses::new(goal)?;
        let mut descent = reduced(descent, count, &mut witnesses, run)?;
        let error = witnesses.measure(&mut descent, f64::INFINITY)?;
        if error < NEAR[0] * self.bound || error > FAR * NEAR[1] * self.bound {
            return Ok(State { mesh: descent.mesh, error });
        }
        let descent = swapped_often(descent, &mut witnesses, run)?;
        let polish = Polish { goal, params, run, swaps: true, bound: Some(self.bound) };
        polish.run(descent, witnesses, &mut Diagnostics::default())
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
