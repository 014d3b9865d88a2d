//! Steps 4 and 5: rounds.
//!
//! A round decomposes the remaining axis, sorts the parts of level 1 whose significance does not exceed
//! the threshold, and removes them, the least significant first. Rounds without a topology test remove
//! all of them; the others remove a part only if that keeps loops and components at that moment. No
//! round removes a part that touches nothing, so no component vanishes.

use medial::simplifier::{Diagnostics, RunContext};

use super::TamHeidrichParams;
use super::axis::Axis;
use super::parts::{Parts, Remaining};
use crate::Result;

/// `t_t`: largest number of triangles of a part that the rounds by triangle count remove.
const SMALL_PART: usize = 5;

/// The threshold of a round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measure {
    /// Parts of at most this many triangles.
    Triangles(usize),
    /// Parts of at most this relative volume in per cent.
    Volume(f64),
}

/// Pruning in progress.
pub(super) struct Pruning<'a> {
    pub(super) remaining: Remaining<'a>,
    /// The decomposition of the remaining complex.
    pub(super) parts: Parts,
    pub(super) diagnostics: Diagnostics,
    run: &'a RunContext,
    params: &'a TamHeidrichParams,
    /// Rounds end as near to this number of spheres as whole parts allow.
    enough: usize,
    /// The number of spheres on the other side of `enough`, once the rounds ended there.
    pub(super) other_side: Option<usize>,
    rounds: usize,
    /// The `t_v` of the last round, if it was one by volume.
    pub(super) t_v: Option<f64>,
}

impl<'a> Pruning<'a> {
    pub(super) fn new(
        axis: &'a Axis,
        params: &'a TamHeidrichParams,
        diagnostics: Diagnostics,
        run: &'a RunContext,
        enough: usize,
    ) -> Self {
        let remaining = Remaining::all(axis);
        let parts = Parts::of(&remaining);
        let (rounds, t_v, other_side) = (0, None, None);
        let mut pruning =
            Self { remaining, parts, diagnostics, run, params, enough, other_side, rounds, t_v };
        pruning.report("start", &[]);
        pruning
    }

    /// Whether the number of spheres is as near to the requested one as whole parts allow.
    pub(super) fn is_enough(&self) -> bool {
        self.other_side.is_some() || self.remaining.spheres <= self.enough
    }

    /// Removes a part, unless the result would be farther from the requested number of spheres. Returns whether it
    /// was removed.
    fn remove(&mut self, part: usize) -> bool {
        let before = self.remaining.spheres;
        let after = before - self.parts.own_spheres(part, &self.remaining);
        let is_last = after < self.enough;
        // Of the two numbers around the requested one the nearer is kept; of equal ones the smaller.
        if is_last && before - self.enough < self.enough - after {
            self.other_side = Some(after);
            return false;
        }
        self.parts.remove(part, &mut self.remaining);
        if is_last {
            self.other_side = Some(before);
        }
        true
    }

    /// The published schedule: rounds by triangle count until they bring little, then one round for
    /// each `t_v`.
    pub(super) fn published(&mut self, t_v: &[f64]) -> Result<()> {
        let params = self.params;
        let whole = self.remaining.betti();
        let mut before = 0;
        for k in 0..params.t_t_rounds {
            let removed = self.round(Measure::Triangles(SMALL_PART))?;
            // Nothing removed: the next round would find the same parts.
            if removed == 0 || k > 0 && (removed as f64) < params.drop * before as f64 {
                break;
            }
            before = removed;
        }
        for &t in t_v {
            self.round(Measure::Volume(t))?;
        }
        let left = self.remaining.betti();
        if left != whole {
            self.diagnostics.warn(format!(
                "rounds that do not check topology, as published, changed the Betti numbers from \
                 {whole:?} to {left:?}"
            ));
        }
        Ok(())
    }

    /// Further rounds by volume, with twice the threshold each, until nothing can go.
    pub(super) fn go_on(&mut self, mut t_v: f64) -> Result<()> {
        // Every round at 100 per cent but the last removes something.
        loop {
            let last = t_v >= 100.0;
            t_v = (2.0 * t_v).clamp(1.0, 100.0);
            if self.is_enough() || self.round(Measure::Volume(t_v))? == 0 && last {
                return Ok(());
            }
        }
    }

    /// One round; the number of parts removed.
    fn round(&mut self, measure: Measure) -> Result<usize> {
        if self.is_enough() {
            return Ok(0);
        }
        self.run.step(self.rounds, self.rounds + 1)?;
        let candidates = self.candidates(measure);
        let checked = matches!(measure, Measure::Volume(_));
        let (mut removed, mut refused) = (0, 0);
        for (done, &part) in candidates.iter().enumerate() {
            if self.is_enough() {
                break;
            }
            // A round may visit thousands of parts, and a cancelled run has to end soon.
            if done % 4096 == 4095 {
                self.run.step(done, candidates.len())?;
            }
            let may_go = match checked {
                true => self.parts.is_removable(part),
                false => self.parts.has_contact(part),
            };
            if may_go {
                removed += usize::from(self.remove(part));
            } else {
                refused += 1;
            }
        }
        self.rounds += 1;
        self.t_v = match measure {
            Measure::Volume(t) => Some(t),
            Measure::Triangles(_) => None,
        };
        let name = format!("round_{}", self.rounds);
        let counts =
            [("checked", usize::from(checked)), ("removed", removed), ("refused", refused)];
        // Parts that lost a neighbour may have merged, or have a free edge now.
        if removed > 0 {
            self.parts = Parts::of(&self.remaining);
        }
        self.report(&name, &counts);
        Ok(removed)
    }

    /// The parts of level 1 within the threshold, the least significant first.
    fn candidates(&self, measure: Measure) -> Vec<usize> {
        let parts = &self.parts;
        let free = (0..parts.len()).filter(|&p| parts.free[p]);
        match measure {
            Measure::Triangles(most) => {
                let mut small: Vec<usize> =
                    free.filter(|&p| parts.faces(p).len() <= most).collect();
                // Ties by id, so that the order of removal is unique.
                small.sort_by_key(|&p| (parts.faces(p).len(), p));
                small
            }
            Measure::Volume(t) => {
                let mut small: Vec<usize> =
                    free.filter(|&p| 100.0 * parts.volume[p] <= t).collect();
                small.sort_by(|&p, &q| parts.volume[p].total_cmp(&parts.volume[q]).then(p.cmp(&q)));
                small
            }
        }
    }

    /// Counts of a round, and its result.
    fn report(&mut self, name: &str, counts: &[(&str, usize)]) {
        let [b0, b1, b2] = self.remaining.betti().map(|b| b as usize);
        let level_1 = self.parts.free.iter().filter(|&&free| free).count();
        let left = [
            ("parts", self.parts.len()),
            ("parts_of_level_1", level_1),
            ("spheres", self.remaining.spheres),
            ("b0", b0),
            ("b1", b1),
            ("b2", b2),
        ];
        for (key, value) in counts.iter().copied().chain(left) {
            self.diagnostics.count(&format!("{name}_{key}"), value);
        }
    }
}
