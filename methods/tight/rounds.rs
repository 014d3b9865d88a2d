//! The last rounds: higher and higher powers, with witnesses of the largest errors joining in between.
//!
//! 1. Steps at the powers 4 and 8.
//! 2. Rounds: the places of the largest errors join the samples as witnesses, then steps at the power 16
//!    or 32 beside `lambda` times the squares. Witnesses are found by local ascent on both sides, and
//!    among the points inside.
//! 3. Swaps of a few spheres, and later of one, from the best state so far. Only the spheres around them move at
//!    first; where that lowers the sum of the powers all spheres take a few steps, and the error is
//!    measured again.
//! 4. Rounds as in 2, with the witnesses that were found meanwhile.
//!
//! What is returned is the state of the least measured error.

use std::collections::HashSet;

use medial::Vec3;
use medial::complex::MedialMesh;
use medial::metrics::{Peak, PeakSearch};
use medial::simplifier::{Diagnostics, RunContext, SimplifyError};

use super::descent::{Descent, Objective};
use super::goal::{ASIDE, Goal, Interior, Points, Sample, refused};
use super::insert::swapped;
use super::params::TightParams;
use super::rows::{held_from, uncovered, union_of};

/// Powers and steps before the first round.
const WARM: [(f64, usize); 2] = [(4.0, 9), (8.0, 14)];

/// Power of the first two rounds, and of all others.
const POWERS: [f64; 2] = [16.0, 32.0];

/// Steps of a round.
const STEPS: usize = 8;

/// Errors above this share of the largest are witnesses.
const WITNESS: f64 = 0.6;

/// Most witnesses that a round takes of each kind, the largest errors first.
const WITNESSES: usize = 300;

/// Of witnesses in a cube of this side one is enough: the errors of the others are hardly different.
const APART: f64 = 0.003;

/// A round that lowers the error by a smaller share did not help.
const GAIN: f64 = 0.01;

/// A state that is worse than this many times the best is pushed as if it were no worse: its steps would be too
/// timid otherwise.
const WORSE: f64 = 1.15;

/// Rounds without a gain that end the rounds.
const PATIENCE: usize = 2;

/// Most swaps that are tried, and swaps without a gain, one after the other, that end the search.
const SWAPS: usize = 60;
const FAILURES: usize = 8;

/// One sphere of so many is swapped at first, later fewer, and then one at a time.
const SPHERES: usize = 25;

/// A swap that raises the objective more than this many times is given up before all spheres take steps.
const HOPELESS: f64 = 2.0;

/// Steps of all spheres after a swap.
const AFTER: usize = 4;

/// The last rounds on one goal.
pub(super) struct Polish<'a> {
    pub goal: &'a Goal,
    pub params: &'a TightParams,
    pub run: &'a RunContext,
    /// Whether connectivity may change.
    pub swaps: bool,
}

/// A mesh with its measured error.
#[derive(Clone)]
pub(super) struct State {
    pub mesh: MedialMesh,
    pub error: f64,
}

impl Polish<'_> {
    /// Runs all rounds.
    ///
    /// # Errors
    /// When the run is cancelled, or the mesh cannot be measured.
    pub fn run(
        &self,
        mut descent: Descent<'_>,
        diagnostics: &mut Diagnostics,
    ) -> Result<State, SimplifyError> {
        for (power, steps) in WARM {
            descent.run(Objective::power(power, descent.largest()), steps, self.run)?;
        }
        let mut witnesses = Witnesses {
            goal: self.goal,
            search: self.goal.peaks().map_err(refused)?,
            seen: HashSet::new(),
        };
        let (mut points, mesh) = (descent.points, descent.mesh);
        let mut best = self.rounds(mesh, &mut points, &mut witnesses)?;
        if self.swaps {
            let kept = self.swapped(&mut best, &mut points, &mut witnesses)?;
            diagnostics.count("swaps_that_helped", kept);
            // With all the witnesses that were found meanwhile.
            let again = self.rounds(best.mesh.clone(), &mut points, &mut witnesses)?;
            if again.error < best.error {
                best = again;
            }
        }
        Ok(best)
    }

    /// Step 2. Returns the best state.
    fn rounds(
        &self,
        mesh: MedialMesh,
        points: &mut Points,
        witnesses: &mut Witnesses<'_>,
    ) -> Result<State, SimplifyError> {
        let error = witnesses.measure(&mesh, points)?;
        let mut now = State { mesh, error };
        let mut best = now.clone();
        let mut idle = 0;
        for round in 0..self.params.rounds {
            let mut descent = Descent::new(self.goal, std::mem::take(points), now.mesh)?;
            let power = POWERS[usize::from(round >= 2)];
            descent.run(
                self.objective(power, now.error.min(WORSE * best.error)),
                STEPS,
                self.run,
            )?;
            *points = descent.points;
            let error = witnesses.measure(&descent.mesh, points)?;
            now = State { mesh: descent.mesh, error };
            idle = if error < (1.0 - GAIN) * best.error { 0 } else { idle + 1 };
            if error < best.error {
                best = now.clone();
            }
            if idle > PATIENCE {
                break;
            }
        }
        Ok(best)
    }

    /// Step 3. Returns how many swaps helped.
    fn swapped(
        &self,
        best: &mut State,
        points: &mut Points,
        witnesses: &mut Witnesses<'_>,
    ) -> Result<usize, SimplifyError> {
        let mut each = (best.mesh.spheres.len() / SPHERES).max(1);
        let (mut skipped, mut idle, mut helped) = (0, 0, 0);
        let mut from = Descent::new(self.goal, std::mem::take(points), best.mesh.clone())?;
        for _ in 0..SWAPS {
            let objective = self.objective(POWERS[1], best.error);
            let trial = swapped(&from, each, skipped, self.run)?;
            let lower =
                |trial: &Descent<'_>| trial.value(&objective) < HOPELESS * from.value(&objective);
            let mut is_better = false;
            if let Some(mut trial) = trial.filter(lower) {
                trial.run(objective, AFTER, self.run)?;
                if trial.value(&objective) < from.value(&objective) {
                    let mut points = trial.points;
                    let error = witnesses.measure(&trial.mesh, &mut points)?;
                    is_better = error < best.error;
                    if is_better {
                        idle = if error < (1.0 - GAIN) * best.error { 0 } else { idle + 1 };
                        *best = State { mesh: trial.mesh, error };
                        helped += 1;
                    }
                    from = Descent::new(self.goal, points, best.mesh.clone())?;
                }
            }
            if is_better {
                skipped = 0;
            } else {
                idle += 1;
                // Fewer at once, then one at another place.
                if each > 1 { each /= 2 } else { skipped += 1 }
            }
            if idle >= FAILURES {
                break;
            }
        }
        *points = from.points;
        Ok(helped)
    }

    /// A little below the error counts as one, so that what exceeds it weighs heavily.
    fn objective(&self, power: f64, error: f64) -> Objective {
        Objective { power, mean: self.params.lambda, scale: 0.9 * error }
    }
}

/// The search for the places of the largest errors.
struct Witnesses<'a> {
    goal: &'a Goal,
    search: PeakSearch<'a>,
    /// Cubes of side [`APART`] that have a witness of a kind.
    seen: HashSet<(u8, [i64; 3])>,
}

impl Witnesses<'_> {
    /// The error of a mesh, both ways. Where it is large, samples join `points`.
    fn measure(&mut self, mesh: &MedialMesh, points: &mut Points) -> Result<f64, SimplifyError> {
        let Self { goal, search, .. } = self;
        let peaks = search.of(mesh).map_err(refused)?;
        let pool: Vec<Vec3> = goal.pool.iter().map(|inside| inside.point).collect();
        let enough = |i: usize| Some(held_from(goal.pool[i].depth));
        let nearest = union_of(mesh)?.deepest_batch_near(&pool, &[], enough);
        let signed: Vec<f64> = nearest.iter().map(|nearest| nearest.signed).collect();
        // The union's boundary at a distance `sigma` from a point that it does not hold is as deep as that
        // point, less `sigma`. This finds pockets that samples of the boundary miss.
        let pockets = goal.pool.iter().zip(&signed).filter(|&(_, &signed)| signed > 0.0);
        let pockets = pockets.map(|(inside, signed)| inside.depth - signed);
        let error = pockets.fold(peaks.hausdorff(), f64::max);
        let large = |peaks: &[Peak]| -> Vec<Vec3> {
            let large = peaks.iter().take_while(|peak| peak.distance > WITNESS * error);
            large.map(|peak| peak.point).collect()
        };
        let on_surface = self.new_ones(0, large(&peaks.forward));
        points.samples.extend(on_surface.into_iter().map(|point| Sample { point, weight: 1.0 }));
        let exposed = self.new_ones(1, large(&peaks.reverse));
        for (&point, depth) in exposed.iter().zip(self.goal.depths(&exposed)) {
            // Boundary inside the solid is a pocket. Boundary outside protrudes, which other residuals see.
            if depth.value > 0.0 {
                points.interior.push(Interior { point, depth: depth.value, weight: 1.0 });
            }
        }
        let mut gaps: Vec<(f64, &Interior)> = (self.goal.pool.iter().zip(&signed))
            .map(|(inside, &signed)| (uncovered(inside.depth, signed), inside))
            .filter(|&(gap, _)| gap > WITNESS * error)
            .collect();
        gaps.sort_by(|x, y| y.0.total_cmp(&x.0));
        let gaps = self.new_ones(2, gaps.into_iter().map(|(_, inside)| inside.point).collect());
        let depths = self.goal.depths(&gaps);
        points.interior.extend(gaps.into_iter().zip(depths).map(|(point, depth)| Interior {
            point,
            depth: depth.value,
            weight: ASIDE,
        }));
        Ok(error)
    }

    /// The first witnesses of a kind, of each cube one.
    fn new_ones(&mut self, kind: u8, points: Vec<Vec3>) -> Vec<Vec3> {
        let cube = |p: &Vec3| (kind, (*p / APART).floor().to_array().map(|x| x as i64));
        let new = points.into_iter().filter(|p| self.seen.insert(cube(p)));
        new.take(WITNESSES).collect()
    }
}
