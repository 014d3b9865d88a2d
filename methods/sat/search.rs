//! A scale for a number of spheres.
//!
//! 1. From scale 1 up, in steps that double, until the count is at most the requested one. The count can
//!    rise, because facets with more corners have more vertices. The ladder of scales ends when the
//!    count has stalled.
//! 2. Between the last two scales the Illinois variant of regula falsi, on logarithms of scale and
//!    count.
//!
//! No scale is tried twice.

use std::sync::Arc;

use medial::simplifier::{Diagnostics, SimplifyError};

use super::{Prepared, Scaled};

/// The first step above scale 1; each further one is twice as long.
const FIRST_STEP: f64 = 0.1;

/// Steps until the search gives up: scale 3,277.
const MAX_STEPS: usize = 16;

/// Steps before the test for a stall, up to scale 7.4: there the count can rise for long and fall later.
const STEPS_BEFORE_STALL: usize = 7;

/// The count has stalled if as many steps brought it down by less than this fraction.
const STALL: (usize, f64) = (3, 0.03);

/// Scales that are tried between two of these steps.
const MAX_TRIES: usize = 8;

/// A count within this fraction below the one asked ends the search.
const TOLERANCE: f64 = 0.01;

/// The scale axis with the largest count that the search meets of those not above `count`; with a
/// larger one, the smallest met, where there is none.
pub(super) fn to_count(
    sat: &Prepared,
    count: usize,
    diagnostics: &mut Diagnostics,
) -> Result<Arc<Scaled>, SimplifyError> {
    let mut tried = 0;
    let mut at = |scale: f64| {
        sat.run.step(tried, MAX_TRIES + 3)?;
        tried += 1;
        sat.at_scale(scale)
    };
    let (found, stalled) = match ladder(count, &mut at)? {
        Ladder::Passed { fine, coarse } => (between(&fine, coarse, count, &mut at)?, false),
        Ladder::First(only) => (only, false),
        Ladder::Above { smallest, stalled } => (smallest, stalled),
    };
    diagnostics.count("scales_tried", tried);
    if found.size() != count {
        let (reached, scale) = (found.size(), found.scale);
        let why = match reached > count {
            true if stalled => "at larger scales the count does not fall any more",
            true => "no scale tried has so few",
            false if scale == 1.0 => "the medial axis of the union of balls has no more",
            false => "the nearest count from below that the search on s met",
        };
        diagnostics.warn(format!("{reached} spheres instead of {count}, at s = {scale}: {why}"));
    }
    Ok(found)
}

/// Where the ladder of scales ended.
enum Ladder {
    /// Scale 1 has no more spheres than asked.
    First(Arc<Scaled>),
    /// Between two scales.
    Passed { fine: Arc<Scaled>, coarse: Arc<Scaled> },
    /// Nowhere: the scale with the fewest spheres, the first of several.
    Above { smallest: Arc<Scaled>, stalled: bool },
}

/// Step 1.
fn ladder(
    count: usize,
    at: &mut impl FnMut(f64) -> Result<Arc<Scaled>, SimplifyError>,
) -> Result<Ladder, SimplifyError> {
    let mut fine = at(1.0)?;
    if fine.size() <= count {
        return Ok(Ladder::First(fine));
    }
    let mut smallest = Arc::clone(&fine);
    let mut least = vec![fine.size()];
    for step in 0..MAX_STEPS {
        let scaled = at(1.0 + FIRST_STEP * f64::powi(2.0, step as i32))?;
        if scaled.size() <= count {
            return Ok(Ladder::Passed { fine, coarse: scaled });
        }
        if scaled.size() < smallest.size() {
            smallest = Arc::clone(&scaled);
        }
        least.push(smallest.size());
        fine = scaled;
        if has_stalled(&least) {
            return Ok(Ladder::Above { smallest, stalled: true });
        }
    }
    Ok(Ladder::Above { smallest, stalled: false })
}

/// Whether the ladder goes nowhere, from the least counts up to each of its scales.
fn has_stalled(least: &[usize]) -> bool {
    let (steps, fall) = STALL;
    let last = least.len() - 1;
    last >= STEPS_BEFORE_STALL && least[last] as f64 > (1.0 - fall) * least[last - steps] as f64
}

/// Step 2. Aims a little below the count, since a count above is of no use.
fn between(
    fine: &Scaled,
    mut coarse: Arc<Scaled>,
    count: usize,
    at: &mut impl FnMut(f64) -> Result<Arc<Scaled>, SimplifyError>,
) -> Result<Arc<Scaled>, SimplifyError> {
    let target = ((1.0 - TOLERANCE / 2.0) * count as f64).ln();
    let point = |s: &Scaled| (s.scale.ln(), (s.size() as f64).max(0.5).ln() - target);
    let (mut low, mut high) = (point(fine), point(&coarse));
    let mut last_was_above = None;
    for _ in 0..MAX_TRIES {
        if coarse.size() as f64 >= (1.0 - TOLERANCE) * count as f64 {
            break;
        }
        let share = (low.1 / (low.1 - high.1)).clamp(0.05, 0.95);
        let logarithm = low.0 + share * (high.0 - low.0);
        if logarithm <= low.0 || logarithm >= high.0 {
            break;
        }
        let scaled = at(logarithm.exp())?;
        let is_above = scaled.size() > count;
        // Illinois: an end that stays twice counts half.
        let again = last_was_above == Some(is_above);
        if is_above {
            low = point(&scaled);
            high.1 *= if again { 0.5 } else { 1.0 };
        } else {
            high = point(&scaled);
            low.1 *= if again { 0.5 } else { 1.0 };
            if scaled.size() >= coarse.size() {
                coarse = scaled;
            }
        }
        last_was_above = Some(is_above);
    }
    Ok(coarse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ladder_stalls_only_late_and_when_flat() {
        // A plate: rises and stays above.
        let plate = [3205; 8];
        assert!(!has_stalled(&plate[..7]) && has_stalled(&plate));
        // Falls by a third of a tenth each step.
        let slow: Vec<usize> = (0..12).map(|k| (5000.0 * 0.97_f64.powi(k)) as usize).collect();
        assert!((7..12).all(|k| !has_stalled(&slow[..=k])));
    }
}
