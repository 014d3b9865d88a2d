//! The level by error: few spheres whose two-sided error a certificate holds within a bound.
//!
//! From a state within the bound the collapse goes on, to seven tenths of the spheres at first and to ever
//! larger shares after each failure. A state counts if its certified error is within the bound; one that
//! misses it by little is tried again with swaps.

use medial::complex::MedialMesh;
use medial::simplifier::{Diagnostics, RunContext, SimplifyError};

use super::descent::Descent;
use super::goal::Goal;
use super::params::TightParams;
use super::rounds::{Polish, State};
use super::start::Start;
use super::{MANY, MOST, bounded, reduced};

/// The share of spheres that is tried first, and the one from which on the search ends.
const FIRST_SHARE: f64 = 0.7;
const LAST_SHARE: f64 = 0.97;

/// With an error up to this many times the bound, swaps are tried.
const NEAR: f64 = 1.5;

/// Width of the certificate, a share of the bound.
const WIDTH: f64 = 0.02;

/// The search for one bound.
pub(super) struct Within<'a> {
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
    pub fn fewest(&self, diagnostics: &mut Diagnostics) -> Result<State, SimplifyError> {
        let bound = self.bound;
        if !(bound > 0.0 && bound.is_finite()) {
            let why = format!("a bound of {bound} is not a positive fraction of the diagonal");
            return Err(SimplifyError::Level(why));
        }
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
    fn first(&self, diagnostics: &mut Diagnostics) -> Result<State, SimplifyError> {
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
    fn continued(&self, from: &MedialMesh, count: usize) -> Result<Option<State>, SimplifyError> {
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

    fn polished(&self, mesh: MedialMesh, swaps: bool) -> Result<State, SimplifyError> {
        let Self { goal, params, run, .. } = *self;
        let points = goal.points(mesh.spheres.len());
        let descent = Descent::new(goal, points, mesh)?;
        Polish { goal, params, run, swaps }.run(descent, &mut Diagnostics::default())
    }

    /// The state with its certified error, if that is within the bound.
    fn held(&self, state: State) -> Result<Option<State>, SimplifyError> {
        if state.error > self.bound {
            return Ok(None);
        }
        let error = self.goal.certified(&state.mesh, WIDTH * self.bound)?;
        Ok((error <= self.bound).then_some(State { error, ..state }))
    }
}
