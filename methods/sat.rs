//! SAT: the scale axis transform.
//!
//! J. Giesen, B. Miklos, M. Pauly, C. Wormser 2009, *The scale axis transform*, Symposium on
//! Computational Geometry, <https://doi.org/10.1145/1542362.1542388>; B. Miklos, J. Giesen, M. Pauly
//! 2010, *Discrete scale axis representations for 3D geometry*, ACM Transactions on Graphics 29(4),
//! <https://doi.org/10.1145/1778765.1778838>.
//!
//! 1. The shape as a union of balls: the inner polar balls of its samples.
//! 2. Radii times 1.002, centres moved by up to `1e-4 r`, the *jitter*, so that balls that touch in a
//!    sample overlap in general position (the authors' tool; `methods/levels.rs`).
//! 3. Every radius is multiplied by the scale `s`.
//! 4. The medial axis of the union of the grown balls, exact ([`UnionAxis`]). A ball that the union of
//!    others covers contributes nothing.
//! 5. Radii are divided by `s`.
//!
//! Where grown parts touch, a tunnel closes or a loop appears. This is part of the transform: the result
//! has the Betti numbers of the grown union.
//!
//! # Deviations from the papers
//!
//! - The samples are those of the shape, shared with every other method, and not a restricted Delaunay
//!   refinement to `delta` = 0.01 of the model's size. The union approximates the shape as well as
//!   these samples do.
//! - The authors' tool then removes sheets with an object angle below 30 degrees at scales above 1. That
//!   filter is not here.
//! - Step 5 undoes neither part of step 2: a result at scale 1 is 0.2 % larger than the union of
//!   polar balls, and its centres keep the jitter, by which results of different seeds differ. As far as
//!   we know the authors' tool does not undo it either. Without step 2 rounding decides which polar balls
//!   meet at scale 1, and the result is torn.
//! - A number of spheres is met by a search on `s`. Not every count occurs: the result is the
//!   largest count met that does not exceed the request; a count within 1 % ends the search. The seconds
//!   of a request are those of all scales that it tried.

use std::sync::Arc;

use medial::complex::{AxisTally, MedialMesh, Sphere, UnionAxis, betti};
use medial::shape::{Shape, ShapeError};
use medial::simplifier::{
    Diagnostics, Level, Method, MethodInfo, NativeLevel, NoParams, RunContext, Simplification,
    Simplified,
};

use crate::levels::{level_within, perturbed, some_spheres};
use crate::{Prepared, Result};

/// Scale of [`Level::Published`]: the default of the authors' tool.
const PUBLISHED: f64 = 1.1;

/// Factor of all radii before the scale, so that balls that touch in a sample overlap.
const RADIUS_FACTOR: f64 = 1.002;
/// Largest displacement of a centre along each axis, in radii.
const JITTER: f64 = 1e-4;
/// Largest scale: radii of up to a million diagonals.
const LARGEST_SCALE: f64 = 1e6;

/// The scale axis transform as a method.
///
/// Has all levels. Each scale costs one regular and one Delaunay triangulation.
pub fn method() -> Method<NoParams> {
    let info = MethodInfo::new("sat", "Scale axis transform")
        .seeded()
        .citation(
            "Joachim Giesen, Balint Miklos, Mark Pauly, Camille Wormser 2009. The scale axis \
             transform. Symposium on Computational Geometry. \
             https://doi.org/10.1145/1542362.1542388; Balint Miklos, Joachim Giesen, Mark Pauly \
             2010. Discrete scale axis representations for 3D geometry. ACM Transactions on \
             Graphics 29(4). https://doi.org/10.1145/1778765.1778838",
        )
        .bibtex(crate::references(&["GiesenMiklosPaulyWormser2009", "MiklosGiesenPauly2010"]))
        .summary(
            "Grows all polar balls by a factor, takes the medial axis of their union, and shrinks \
             its balls back.",
        )
        .native(NativeLevel::larger_is_coarser("s", "scale factor"))
        .published(
            "s = 1.1, the default of the authors' tool, without its angle filter of 30 degrees",
        );
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, _: NoParams, run: &RunContext) -> Prepared<'s> {
    Ok(Box::new(PreparedSat::new(shape, run)?))
}

/// The balls of one shape, perturbed.
struct PreparedSat {
    spheres: Vec<Sphere>,
    run: RunContext,
}

fn resized(balls: &[Sphere], factor: f64) -> Vec<Sphere> {
    balls.iter().map(|ball| Sphere::new(ball.centre, ball.radius * factor)).collect()
}

/// The scale axis at one scale.
struct Scaled {
    scale: f64,
    mesh: MedialMesh,
    tally: AxisTally,
    /// Betti numbers of the grown union.
    union_betti: [u64; 3],
}

impl PreparedSat {
    /// Steps 1 and 2.
    fn new(shape: &Shape, run: &RunContext) -> Result<Self> {
        let balls = shape.inner_balls()?;
        run.step(0, balls.spheres.len())?;
        let spheres = perturbed(&balls.spheres, RADIUS_FACTOR, JITTER, run.seed);
        Ok(Self { spheres, run: run.clone() })
    }

    /// Steps 3 to 5: the axis at a scale.
    fn at_scale(&self, scale: f64) -> Result<Arc<Scaled>> {
        let grown = resized(&self.spheres, scale);
        let axis = UnionAxis::of_balls(&grown).map_err(ShapeError::from)?;
        let mut mesh = axis.mesh();
        mesh.spheres = resized(&mesh.spheres, 1.0 / scale);
        let (tally, union_betti) = (*axis.tally(), axis.union_betti());
        Ok(Arc::new(Scaled { scale, mesh, tally, union_betti }))
    }
}

impl Scaled {
    /// Logarithms of its scale, and of its size as a share of `exp(target)`.
    fn point(&self, target: f64) -> (f64, f64) {
        // Nothing at all counts as half a sphere.
        (self.scale.ln(), (self.size() as f64).max(0.5).ln() - target)
    }

    /// Number of spheres.
    fn size(&self) -> usize {
        self.mesh.spheres.len()
    }

    fn diagnose(&self, diagnostics: &mut Diagnostics) {
        let AxisTally { open, doubtful, .. } = self.tally;
        let found = betti(&self.mesh);
        if found != self.union_betti {
            diagnostics.warn(format!(
                "the axis has Betti numbers {found:?}, the union of grown balls {:?}: rounding left \
                 {open} facets and {doubtful} groups of vertices undecided",
                self.union_betti
            ));
        }
    }
}

impl Simplification for PreparedSat {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let mut diagnostics = Diagnostics::default();
        let scaled = match some_spheres(level)? {
            Level::Published => self.at_scale(PUBLISHED)?,
            Level::Native(scale) => {
                self.at_scale(level_within("s", scale, 1.0..=LARGEST_SCALE)?)?
            }
            Level::Spheres(count) => to_count(self, count, &mut diagnostics)?,
        };
        scaled.diagnose(&mut diagnostics);
        let (mesh, native_level) = (scaled.mesh.clone(), Some(scaled.scale));
        Ok(Simplified { native_level, diagnostics, ..Simplified::new(mesh, level) })
    }
}

// A scale for a number of spheres.
//
// 1. From scale 1 up, in steps that double, until the count is at most the requested one. The count can
//    rise, because facets with more corners have more vertices. The ladder of scales ends when the
//    count has stalled.
// 2. Between the last two scales the Illinois variant of regula falsi, on logarithms of scale and
//    count.
//
// No scale is tried twice.

/// First step above scale 1. Each further one is twice as long.
const FIRST_STEP: f64 = 0.1;

/// Limit of the steps, up to scale 3,277.
const MAX_STEPS: usize = 16;

/// Steps before the test for a stall, up to scale 7.4. There the count can rise for long and fall later.
const STEPS_BEFORE_STALL: usize = 7;

/// Steps of the test for a stall, and the fall of the count below which it has stalled, as a fraction.
const STALL: (usize, f64) = (3, 0.03);

/// Limit of the scales that are tried between two of these steps.
const MAX_TRIES: usize = 8;

/// Shortfall of a count that ends the search, as a fraction.
const TOLERANCE: f64 = 0.01;

/// The scale axis with the largest count that the search meets of those not above `count`; with a
/// larger one, the smallest met, where there is none.
fn to_count(sat: &PreparedSat, count: usize, diagnostics: &mut Diagnostics) -> Result<Arc<Scaled>> {
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
    /// Scale 1 has no more spheres than requested.
    First(Arc<Scaled>),
    /// Between two scales.
    Passed { fine: Arc<Scaled>, coarse: Arc<Scaled> },
    /// Nowhere: the scale with the fewest spheres, the first of several.
    Above { smallest: Arc<Scaled>, stalled: bool },
}

/// Step 1.
fn ladder(count: usize, at: &mut impl FnMut(f64) -> Result<Arc<Scaled>>) -> Result<Ladder> {
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

/// Step 2. Aims a little below the count, since a count above is useless.
fn between(
    fine: &Scaled,
    mut coarse: Arc<Scaled>,
    count: usize,
    at: &mut impl FnMut(f64) -> Result<Arc<Scaled>>,
) -> Result<Arc<Scaled>> {
    let target = ((1.0 - TOLERANCE / 2.0) * count as f64).ln();
    let (mut low, mut high) = (fine.point(target), coarse.point(target));
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
            low = scaled.point(target);
            high.1 *= if again { 0.5 } else { 1.0 };
        } else {
            high = scaled.point(target);
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
