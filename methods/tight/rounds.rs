//! The last rounds: higher and higher powers, with witnesses of the largest errors joining in between.
//!
//! 1. Steps at the powers 4 and 8.
//! 2. Rounds: the places of the largest errors join the samples as witnesses, then steps at the power 16
//!    or 32 beside `lambda` times the squares. Witnesses are found by local ascent on both sides, and
//!    among the points inside.
//! 3. When two rounds have not helped, each further one swaps spheres first, starting from the best state
//!    so far, fewer of them after each failure.
//!
//! What is returned is the state of the least measured error.

use medial::Vec3;
use medial::complex::MedialMesh;
use medial::metrics::{MetricError, Peak, PeakSearch};
use medial::simplifier::{Diagnostics, RunContext, SimplifyError};

use super::descent::{Descent, Objective};
use super::goal::{Goal, Interior, Points, Sample};
use super::insert::swapped;
use super::params::TightParams;
use super::rows::{uncovered, union_of};

/// Powers and steps before the first round.
const WARM: [(f64, usize); 2] = [(4.0, 9), (8.0, 14)];

/// Power of the first two rounds, and of all others.
const POWERS: [f64; 2] = [16.0, 32.0];

/// Steps of a round.
const STEPS: usize = 8;

/// Powers and steps after a swap, before those of the round.
const SETTLE: [(f64, usize); 2] = [(8.0, 5), (16.0, 5)];

/// Errors above this share of the largest are witnesses.
const WITNESS: f64 = 0.6;

/// Most witnesses that a round takes from the surface, and from the union's boundary.
const WITNESSES: usize = 1_500;

/// A round that lowers the error by a smaller share did not help.
const GAIN: f64 = 0.01;

/// Rounds without a gain before swaps begin.
const PATIENCE: usize = 2;

/// Rounds beyond `rounds`, all of which swap; and rounds without a gain, beyond [`PATIENCE`], that end the
/// search while it swaps.
const SWAPS: usize = 10;
const FAILURES: usize = 4;

/// The last rounds on one goal.
pub(super) struct Polish<'a> {
    pub goal: &'a Goal,
    pub params: &'a TightParams,
    pub run: &'a RunContext,
    /// Whether connectivity may change.
    pub swaps: bool,
}

/// The measured error of a mesh, and where it is large.
struct Measured {
    error: f64,
    witnesses: Points,
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
    ) -> Result<MedialMesh, SimplifyError> {
        let Self { goal, params, run, swaps } = *self;
        for (power, steps) in WARM {
            descent.run(Objective::power(power, descent.largest()), steps, run)?;
        }
        let search = goal.peaks().map_err(refused)?;
        let (mut points, mut mesh) = (descent.points, descent.mesh);
        let mut found = measured(&mesh, goal, &search)?;
        let mut best = (found.error, mesh.clone());
        let mut each = (mesh.spheres.len() / 25).max(1);
        let (mut swapping, mut idle, mut kept) = (false, 0, 0);
        let rounds = params.rounds + if swaps { SWAPS } else { 0 };
        for round in 0..rounds {
            points.samples.append(&mut found.witnesses.samples);
            points.interior.append(&mut found.witnesses.interior);
            // A little below the error, so that what exceeds it weighs heavily.
            let scale = 0.9 * found.error.min(1.15 * best.0);
            let objective = |power| Objective { power, mean: params.lambda, scale };
            let from = if swapping { best.1.clone() } else { mesh };
            let mut descent = Descent::new(goal, std::mem::take(&mut points), from)?;
            if swapping {
                let Some(other) = swapped(&descent, each, SETTLE[0].0, run)? else { break };
                descent = other;
                for (power, steps) in SETTLE {
                    descent.run(objective(power), steps, run)?;
                }
            }
            descent.run(objective(POWERS[usize::from(round >= 2)]), STEPS, run)?;
            (points, mesh) = (descent.points, descent.mesh);
            found = measured(&mesh, goal, &search)?;
            let helped = found.error < (1.0 - GAIN) * best.0;
            if found.error < best.0 {
                best = (found.error, mesh.clone());
            }
            idle = if helped { 0 } else { idle + 1 };
            kept += usize::from(helped && swapping);
            if swapping && !helped {
                each = (each / 2).max(1);
                if idle >= PATIENCE + FAILURES {
                    break;
                }
            }
            swapping |= swaps && (idle >= PATIENCE || round + 1 >= params.rounds);
            if !swaps && idle > PATIENCE {
                break;
            }
        }
        diagnostics.count("rounds_with_swaps_that_helped", kept);
        Ok(best.1)
    }
}

/// Measures both ways and collects the places of large errors.
fn measured(
    mesh: &MedialMesh,
    goal: &Goal,
    search: &PeakSearch<'_>,
) -> Result<Measured, SimplifyError> {
    let peaks = search.of(mesh).map_err(refused)?;
    let pool: Vec<Vec3> = goal.pool.iter().map(|inside| inside.point).collect();
    let signed = union_of(mesh)?.signed_batch(&pool);
    let gaps = || goal.pool.iter().zip(&signed);
    // The union's boundary at a distance `sigma` from a point that it does not hold is as deep as that
    // point, less `sigma`. This finds pockets that samples of the boundary miss.
    let pockets = gaps().filter(|&(_, &signed)| signed > 0.0);
    let pockets = pockets.map(|(inside, signed)| inside.depth - signed);
    let error = pockets.fold(peaks.hausdorff(), f64::max);
    let large = |peaks: &[Peak]| -> Vec<Vec3> {
        let large = peaks.iter().take_while(|peak| peak.distance > WITNESS * error);
        large.take(WITNESSES).map(|peak| peak.point).collect()
    };
    let samples = large(&peaks.forward).into_iter().map(|point| Sample { point, weight: 1.0 });
    let exposed = large(&peaks.reverse);
    let mut interior: Vec<Interior> = Vec::new();
    for (&point, depth) in exposed.iter().zip(goal.depths(&exposed)) {
        // Boundary inside the solid is a pocket. Boundary outside protrudes, which other residuals see.
        if depth.value > 0.0 {
            interior.push(Interior { point, depth: depth.value, weight: 1.0 });
        }
    }
    let gaps =
        gaps().filter(|(inside, signed)| uncovered(inside.depth, **signed) > WITNESS * error);
    interior.extend(gaps.map(|(inside, _)| *inside));
    Ok(Measured { error, witnesses: Points { samples: samples.collect(), interior } })
}

fn refused(error: MetricError) -> SimplifyError {
    SimplifyError::Failed(error.to_string())
}
