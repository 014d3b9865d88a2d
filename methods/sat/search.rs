//! A scale for a number of spheres.

use medial::simplifier::{Diagnostics, SimplifyError};

use super::{Prepared, Scaled};

/// The first step above scale 1; each further one is twice as long.
const FIRST_STEP: f64 = 0.1;

/// Steps until the search gives up: scale 3,277.
const MOST_STEPS: i32 = 16;

/// Scales that are tried between two of these steps.
const MOST_TRIES: usize = 8;

/// A count within this fraction below the one asked ends the search.
const TOLERANCE: f64 = 0.01;

/// The scale axis with the largest count that the search meets of those not above `count`; with a
/// larger one, the smallest met, where there is none. Each scale is computed once.
pub(super) fn to_count(
    sat: &Prepared,
    count: usize,
    diagnostics: &mut Diagnostics,
) -> Result<Scaled, SimplifyError> {
    let mut tried = 0;
    let mut at = |scale: f64| {
        sat.run.step(tried, MOST_TRIES + 3)?;
        tried += 1;
        sat.scaled(scale)
    };
    let mut fine = at(1.0)?;
    let mut coarse = None;
    for step in 0..MOST_STEPS {
        if size(&fine) <= count {
            break;
        }
        let scaled = at(1.0 + FIRST_STEP * f64::powi(2.0, step))?;
        if size(&scaled) <= count {
            coarse = Some(scaled);
            break;
        }
        fine = scaled;
    }
    let found = match coarse {
        Some(coarse) => between(fine, coarse, count, &mut at)?,
        None => fine,
    };
    diagnostics.count("scales_tried", tried);
    if size(&found) != count {
        let (reached, scale) = (size(&found), found.scale);
        let why = match reached > count {
            true => "no scale tried has so few",
            false if scale == 1.0 => "the medial axis of the union of balls has no more",
            false => "the nearest count from below that the search on s met",
        };
        diagnostics.warn(format!("{reached} spheres instead of {count}, at s = {scale}: {why}"));
    }
    Ok(found)
}

fn size(scaled: &Scaled) -> usize {
    scaled.mesh.spheres.len()
}

/// Regula falsi on the logarithms of scale and count, kept off the ends of the bracket.
fn between(
    mut fine: Scaled,
    mut coarse: Scaled,
    count: usize,
    at: &mut impl FnMut(f64) -> Result<Scaled, SimplifyError>,
) -> Result<Scaled, SimplifyError> {
    let target = (count as f64).ln();
    for _ in 0..MOST_TRIES {
        if size(&coarse) as f64 >= (1.0 - TOLERANCE) * count as f64 {
            break;
        }
        let [low, high] = [&fine, &coarse].map(|s| (s.scale.ln(), (size(s) as f64).max(0.5).ln()));
        let share = ((low.1 - target) / (low.1 - high.1)).clamp(0.15, 0.85);
        let scale = (low.0 + share * (high.0 - low.0)).exp();
        if scale <= fine.scale || scale >= coarse.scale {
            break;
        }
        let scaled = at(scale)?;
        if size(&scaled) > count {
            fine = scaled;
        } else {
            coarse = scaled;
        }
    }
    Ok(coarse)
}
