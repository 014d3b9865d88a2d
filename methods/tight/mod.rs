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
//!    serve; a few steps of 3 after each pass, at the power 4.
//! 5. *Swap* (`start.rs`): spheres are inserted where the error is largest, and as many edges collapsed
//!    where it hurts least. Only the spheres around them move then (`Patch`).
//! 6. *Rounds* (`rounds.rs`): steps of 3 at powers up to 32, between which the largest errors, found by
//!    local ascent on both sides, join the samples, and balls are watched where the union came out of the solid;
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
//! - No collapse, insertion or step makes two faces cross by more than 1e-6 that did not (`Sheets`, `Guard`). Faces that cross at
//!   the start may stay crossed.
//! - The result depends on the samples, hence on the seed and on the orientation of the input; docs/tight.md
//!   has figures.
//! - The native level `error` is a bound of the two-sided error, a fraction of the diagonal, held by a
//!   certificate. It takes several times as long as a number of spheres.
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
use rounds::{Descent, Objective, Polish, State};
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
const POWER: f64 = 4.0;

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
/// [`Level::Native`], a bound of the two-sided error, at several times that.
pub fn method(starter: impl MedialSimplifier + 'static) -> Tight {
    let info = MethodInfo::new("tight", "Tight")
        .citation("This project; not published.")
        .summary(
            "Collapses and inserts spheres in the order of the two-sided error at samples, and moves all \
             of them together to lessen its maximum.",
        )
        .published("nothing is published: 100 spheres")
        .native(NativeLevel::larger_is_coarser("error", "fraction of the diagonal"))
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
        if is_polish {
            if descent.mesh.spheres.len() < count {
                let spheres = descent.mesh.spheres.len();
                diagnostics
                    .warn(format!("{spheres} spheres instead of {count}: the start has no more"));
            }
        } else {
            descent = reduced(descent, count, run)?;
            let reached = descent.mesh.spheres.len();
            if reached > count {
                diagnostics.warn(format!(
                    "{reached} spheres instead of {count}: no edge is left whose collapse keeps the \
                     homotopy type and folds no face"
                ));
            }
            descent = swapped_often(descent, run)?;
        }
        let state = Polish { goal, params, run, swaps: !is_polish }.run(descent, diagnostics)?;
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

/// Step 4: passes of collapses until `count` spheres are left, or no collapse is possible.
fn reduced<'a>(mut descent: Descent<'a>, count: usize, run: &RunContext) -> Result<Descent<'a>> {
    descent.run(Objective::power(POWER, descent.largest()), STEPS[1], run)?;
    while descent.mesh.spheres.len() > count {
        let spheres = descent.mesh.spheres.len();
        let near = usize::from(spheres <= MANY * count);
        let least = if near == 1 { count } else { MANY * count };
        let target = least.max((spheres as f64 * LEFT[near]) as usize);
        let Some(passed) = collapse::pass(&descent, target, near == 1) else { break };
        descent = Descent::new(descent.goal, descent.points, passed.mesh)?;
        descent.run(Objective::power(POWER, descent.largest()), STEPS[near], run)?;
    }
    Ok(descent)
}

/// Step 5, while it lowers the sum of the eighth powers.
fn swapped_often<'a>(mut descent: Descent<'a>, run: &RunContext) -> Result<Descent<'a>> {
    let mut each = (descent.mesh.spheres.len() / 12).max(2);
    descent.run(Objective::power(POWER, descent.largest()), STEPS[1], run)?;
    let judge = Objective::power(8.0, descent.largest());
    for _ in 0..SWAPS {
        let trial = start::swapped(&descent, each, 0, run)?;
        match trial.filter(|trial| trial.value(&judge) < descent.value(&judge)) {
            Some(trial) => descent = trial,
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
        /// Weight of the mean of the squares next to the high powers: larger for a smaller mean error.
        lambda: f64 = 0.4, "pure number";
        /// Spheres that the start is simplified to, unless five times the target, up to 2,500, or three times it are more.
        start: usize = 1_200, "spheres";
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
// From a state within the bound the collapse continues, to seven tenths of the spheres at first and to ever
// larger shares after each failure. A state counts if its certified error is within the bound; one that
// misses it by little is tried again with swaps.

/// The share of spheres that is tried first, and the one from which on the search ends.
const FIRST_SHARE: f64 = 0.7;
const LAST_SHARE: f64 = 0.97;

/// With an error up to this many times the bound, swaps are tried.
const NEAR: f64 = 1.5;

/// Width of the certificate, a share of the bound.
const WIDTH: f64 = 0.02;

/// The search for one bound.
struct Within<'a> {
    pub start: &'a Start,
    pub goal: &'a Goal,
    pub params: &'a TightParams,
    pub run: &'a RunContext,
    /// Two-sided error, a fraction of the diagonal.
    pub bound: f64,
}

impl Within<'_> {
    /// The state with the fewest spheres that was found, with its certified error.
    ///
    /// # Errors
    /// When the bound is no length, or no state is within it.
    pub fn fewest(&self, diagnostics: &mut Diagnostics) -> Result<State> {
        let bound = self.bound;
        level_within("error", bound, (Bound::Excluded(0.0), Bound::Excluded(f64::INFINITY)))?;
        let mut kept = self.first(diagnostics)?;
        let mut share = FIRST_SHARE;
        while share < LAST_SHARE && kept.mesh.spheres.len() > 1 {
            let count = ((kept.mesh.spheres.len() as f64 * share) as usize).max(1);
            match self.continued(&kept.mesh, count)? {
                Some(next) => kept = next,
                None => share = share.sqrt(),
            }
        }
        Ok(kept)
    }

    /// A state within the bound to begin with: more spheres until one is.
    fn first(&self, diagnostics: &mut Diagnostics) -> Result<State> {
        let mut wanted = self.params.start.max(MANY);
        let mut least = f64::INFINITY;
        loop {
            // Rounded up: a start of fewer spheres than wanted is all that there is.
            let start = self.start.mesh(wanted.div_ceil(MANY), self.run, diagnostics)?;
            let spheres = start.spheres.len();
            bounded(spheres)?;
            let state = self.polished(start, false)?;
            least = least.min(state.error);
            if let Some(state) = self.held(state)? {
                return Ok(state);
            }
            if spheres < wanted || wanted >= MOST {
                return Err(SimplifyError::Level(format!(
                    "no state within {} of the diagonal was found: the least two-sided error was {least:.3e}, \
                     with {spheres} spheres",
                    self.bound
                )));
            }
            wanted = (2 * wanted).min(MOST);
        }
    }

    /// The state after collapses to `count` spheres, if it is within the bound.
    fn continued(&self, from: &MedialMesh, count: usize) -> Result<Option<State>> {
        let descent = Descent::new(self.goal, self.goal.points(count), from.clone())?;
        let smaller = reduced(descent, count, self.run)?.mesh;
        if smaller.spheres.len() >= from.spheres.len() {
            return Ok(None);
        }
        let mut state = self.polished(smaller, false)?;
        if state.error > self.bound && state.error < NEAR * self.bound {
            state = self.polished(state.mesh, true)?;
        }
        self.held(state)
    }

    fn polished(&self, mesh: MedialMesh, swaps: bool) -> Result<State> {
        let Self { goal, params, run, .. } = *self;
        let points = goal.points(mesh.spheres.len());
        let descent = Descent::new(goal, points, mesh)?;
        Polish { goal, params, run, swaps }.run(descent, &mut Diagnostics::default())
    }

    /// The state with its certified error, if that is within the bound.
    fn held(&self, state: State) -> Result<Option<State>> {
        if state.error > self.bound {
            return Ok(None);
        }
        let error = self.goal.certified(&state.mesh, WIDTH * self.bound)?;
        Ok((error <= self.bound).then_some(State { error, ..state }))
    }
}
