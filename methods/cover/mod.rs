//! `cover`: spheres alone that contain a solid, fit into it, or deviate least from it, with a proof.
//!
//! A method of this project, for collision models and grains made of spheres.
//!
//! # One problem behind three fits
//!
//! For a solid K let `depth(c)` be the distance of an inner point `c` to the surface, and
//! `f_c(p) = |p - c| - depth(c)` the distance from `p` to the largest inner ball at `c`. For centres `C`
//!
//! ```text
//! G(C) = max over p in K of min over c in C of f_c(p)
//! ```
//!
//! is the largest distance from a point of K to the inner balls. A ball of radius `depth(c) + t` is nowhere
//! farther than `t` from K. So with the radii
//!
//! - `depth(c)`, the balls fit into K, and leave `G` uncovered (`fit=inside`);
//! - `depth(c) + G`, they contain K, and protrude by `G` at most (`fit=outside`);
//! - `depth(c) + G / 2`, they do both by `G / 2` at most (`fit=balanced`),
//!
//! and for these centres no other radii do better, as long as a ball protrudes by its radius less its
//! depth. All fits minimise `G` over the centres. An inner ball that is contained in another has the larger
//! `f` everywhere, so centres of medial balls are enough.
//!
//! # Steps
//!
//! 1. Candidates are medial balls of surface samples ([`shrinking_ball`](medial::surface::shrinking_ball));
//!    the points to be covered are vertices and samples of the surface, and centres of candidates
//!    (`placement.rs`).
//! 2. *Start*: the least threshold at which a greedy choice of N candidates has all points within it, by
//!    halving.
//! 3. *Descent*: one sphere after the other takes trial steps that lower the sum of `(f / G)^P` over all
//!    points, with a rising power P. After each step the ball grows to a medial one.
//! 4. *Swaps*: the sphere that matters least moves to the point with the largest gap.
//! 5. *Rounds*: the descent sees all points with a large gap, and a part of the others, selected again and
//!    again; the witness of the certificate joins them.
//! 6. *Proof*: the upper end of the certified interval of `G` ([`CoverTest::uncovered`]) decides the radii. With
//!    `fit=outside` a margin is added to them, and doubled twice until the interval of the spheres ends at 0.
//!
//! With `radii=equal` the depth in `f_c` is that of the least deep centre, and `G` the covering radius of
//! the centres less that depth. Candidates and steps are restricted to centres of at least a common depth, which is
//! the best of a sequence of depths for the start.
//!
//! The native level is the allowed error of the fit: a search over N.

mod placement;
#[cfg(test)]
mod tests;

use std::ops::Bound;
use std::sync::Arc;

use medial::complex::{MedialMesh, Sphere};
use medial::metrics::{CoverTest, MetricError, OneSided};
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, Method, MethodInfo, NativeLevel, ParamFields, RunContext, Simplification,
    Simplified, SimplifyError,
};
use medial::surface::{InsideTest, TriangleBvh};
use placement::{Gaps, Placement, Solid};
use serde::{Deserialize, Serialize};

use crate::levels::{checked, level_within, some_spheres};
use crate::{Prepared, Result};

/// Spheres of [`Level::Published`].
const USUAL: usize = 64;

/// Limit of the spheres that are placed together.
const MOST: usize = 1_000;

/// The powers of the rounds, as exponents of 2, and of their swaps.
const POWERS: [(u32, u32); 4] = [(3, 3), (4, 4), (5, 5), (5, 5)];

/// Product of the number of spheres and the repetitions of the last round: few spheres are cheap.
const REPEATED: usize = 96;
/// Limit of these repetitions.
const MOST_REPEATED: usize = 4;

/// Selections of points in a round, and sweeps on each.
const SWEEPS: [usize; 2] = [3, 3];

/// Width of a round's certified interval of `G`, as a share of it.
const ROUGH: f64 = 0.02;

/// Width of the certified interval of `G`, as a share of it.
const WIDTH: f64 = 0.005;

/// Width of the certified interval that proves cover.
const PROOF_WIDTH: f64 = 1e-3;

/// Narrowest certified interval, in diagonals.
const LEAST_WIDTH: f64 = 1e-5;
/// Width of the first certified interval, in diagonals.
const ROUGH_FIRST: f64 = 0.01;

/// Margin of radii below the depth, in diagonals, so that files keep spheres inside.
const WITHIN: f64 = 1e-7;

/// Margin of radii for a certificate of cover, as a share of the error. The certificate takes the time of its
/// inverse.
const BEYOND_SHARE: f64 = 0.005;
/// Smallest such margin, in diagonals.
const BEYOND: f64 = 1e-5;
/// Factor of the margin where the certificate fails.
const BEYOND_FACTOR: f64 = 4.0;

/// Spheres that cover, as a method.
///
/// Supports all levels from one sphere to 1,000. Cost: about the spheres times the points in each sweep.
pub fn method() -> Method<CoverParams> {
    let info = MethodInfo::new("cover", "Covering spheres")
        .seeded()
        .citation("This project; not published.")
        .summary(
            "Places spheres, without edges, that contain the solid, fit into it, or deviate least from it, by a \
             certified bound.",
        )
        .native(NativeLevel::larger_is_coarser("error", "fraction of the diagonal"))
        .published("nothing is published: 64 spheres")
        .params(CoverParams::describe());
    Method::new(info, prepare)
}

medial::parameters! {
    /// Parameters of `cover`.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CoverParams {
        /// The spheres contain the solid (`outside`), fit into it (`inside`), or deviate from it by the same
        /// on both sides (`balanced`).
        #[serde(alias = "mood")]
        fit: Fit = Fit::Balanced, "balanced, outside or inside";
        /// Whether each sphere has the radius that suits it (`free`), or all have the same (`equal`).
        radii: Radii = Radii::Free, "free or equal";
    }
}

/// Radii of spheres in relation to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Radii {
    /// Each its own.
    Free,
    /// One for all.
    Equal,
}

/// The side on which spheres deviate from a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fit {
    /// The larger error of both sides is least.
    Balanced,
    /// Nothing is uncovered, and the overshoot is least.
    Outside,
    /// Nothing protrudes, and the uncovered distance is least.
    Inside,
}

fn prepare<'s>(shape: &'s Shape, params: CoverParams, run: &RunContext) -> Prepared<'s> {
    if shape.has_given_initial() {
        let why = "it starts from no medial mesh: leave out --initial";
        return Err(SimplifyError::unsupported(why));
    }
    run.step(0, 1)?;
    let (tree, inside) = (shape.surface_tree()?, shape.inside_test());
    Ok(Box::new(PreparedCover { shape, tree, inside, params, run: run.clone() }))
}

/// One shape.
struct PreparedCover<'s> {
    shape: &'s Shape,
    tree: Arc<TriangleBvh>,
    inside: Arc<InsideTest>,
    params: CoverParams,
    run: RunContext,
}

impl Simplification for PreparedCover<'_> {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let count = match some_spheres(level)? {
            Level::Spheres(count) => count,
            Level::Published => USUAL,
            Level::Native(error) => return self.within(error),
        };
        let mut diagnostics = Diagnostics::default();
        let (placed, gap) = self.placed(count, &mut diagnostics)?;
        let error = self.error(&placed, gap)?;
        self.finished(level, &placed, error, diagnostics)
    }
}

impl PreparedCover<'_> {
    fn test(&self) -> CoverTest<'_> {
        CoverTest::new(self.shape.mesh(), &self.tree, &self.inside)
    }

    /// The certified interval of `G`, no wider than `width`, or than the least multiple that can be certified.
    fn gap(&self, balls: &[Sphere], mut width: f64) -> Result<OneSided> {
        loop {
            match self.test().uncovered(balls, width) {
                Err(MetricError::TooFine { .. }) if width < 0.25 => width *= 4.0,
                other => return other.map_err(failed),
            }
        }
    }

    /// Steps 1 to 5: inner balls, and the interval of their `G`.
    fn placed(
        &self,
        count: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<(Vec<Sphere>, OneSided)> {
        let Self { shape, tree, inside, run, .. } = self;
        if count > MOST {
            return Err(SimplifyError::unsupported(format!(
                "{count} spheres; `cover` places at most {MOST} together; request fewer"
            )));
        }
        let solid = Solid::new(shape, tree, inside, run.seed);
        let is_equal = self.params.radii == Radii::Equal;
        let solid = if is_equal { solid.with_equal_balls(count) } else { solid };
        let candidates = solid.candidates(count);
        if candidates.is_empty() {
            return Err(SimplifyError::unsupported(
                "no ball fits into the solid; give a surface that encloses a volume",
            ));
        }
        let mut pool = solid.points(count, &candidates);
        let mut chosen = Gaps::new(&candidates, &pool).start(count).0;
        // With spheres to spare, the largest balls that are left.
        let spare = (0..candidates.len()).filter(|k| !chosen.contains(k));
        let spare: Vec<usize> = spare.take(count - chosen.len()).collect();
        chosen.extend(spare);
        if chosen.len() < count {
            let found = chosen.len();
            diagnostics.warn(format!(
                "{found} spheres instead of {count}: the solid has no more candidates"
            ));
        }
        let mut placement =
            Placement::new(&solid, chosen.into_iter().map(|k| candidates[k]).collect());
        let mut best: Option<(Vec<Sphere>, f64)> = None;
        let mut swaps = 0;
        let last = POWERS[POWERS.len() - 1];
        let repeated = std::iter::repeat_n(last, (REPEATED / count).min(MOST_REPEATED));
        for (power, swap_power) in POWERS.into_iter().chain(repeated) {
            for _ in 0..SWEEPS[0] {
                placement.focus(&pool);
                for _ in 0..SWEEPS[1] {
                    placement.sweep(power, run)?;
                }
            }
            placement.focus(&pool);
            swaps += placement.swap(&candidates, (swap_power, count), run)?;
            placement.focus(&pool);
            let width = (ROUGH * placement.worst().0).max(LEAST_WIDTH);
            let gap = self.gap(&placement.balls, width)?;
            // A swap can raise the largest gap while it lowers the sum.
            if best.as_ref().is_none_or(|&(_, least)| gap.lower < least) {
                best = Some((placement.balls.clone(), gap.lower));
            }
            pool.extend(gap.witness);
        }
        diagnostics.count("swaps", swaps);
        let mut balls = best.map_or_else(|| placement.balls.clone(), |(balls, _)| balls);
        if is_equal {
            let depths = balls.iter().map(|ball| tree.closest(ball.centre).distance);
            let least = depths.fold(f64::INFINITY, f64::min);
            balls.iter_mut().for_each(|ball| ball.radius = least);
        }
        let rough = self.gap(&balls, ROUGH_FIRST)?;
        let gap = self.gap(&balls, (WIDTH * rough.upper).max(LEAST_WIDTH))?;
        Ok((balls, gap))
    }

    /// Step 6: the certified error of the side, or sides, on which spheres of the fit deviate.
    fn error(&self, inner: &[Sphere], gap: OneSided) -> Result<f64> {
        Ok(match self.params.fit {
            Fit::Balanced => 0.5 * gap.upper,
            Fit::Outside => self.proven(inner, gap)?,
            Fit::Inside => gap.upper + WITHIN,
        })
    }

    fn finished(
        &self,
        level: Level,
        inner: &[Sphere],
        error: f64,
        diagnostics: Diagnostics,
    ) -> Result<Simplified> {
        let added = if self.params.fit == Fit::Inside { -WITHIN } else { error };
        let mesh = MedialMesh::from_simplices(grown(inner, added), vec![], vec![])?;
        checked(level, mesh, Some(error), diagnostics)
    }

    /// The radius to add to inner balls, with which a certificate proves that they contain the solid.
    fn proven(&self, inner: &[Sphere], gap: OneSided) -> Result<f64> {
        let mut margin = (BEYOND_SHARE * gap.upper).max(BEYOND);
        loop {
            let balls = grown(inner, gap.upper + margin);
            let uncovered = self.gap(&balls, PROOF_WIDTH)?;
            if uncovered.upper == 0.0 {
                return Ok(gap.upper + margin);
            }
            if margin > 1.0 {
                let why =
                    "no proof that the spheres contain the solid, even with its diagonal as margin";
                return Err(SimplifyError::Failed(why.to_owned()));
            }
            self.run.step(0, 1)?;
            margin *= BEYOND_FACTOR;
        }
    }

    /// The level by error: the fewest spheres that a search over their number finds within it.
    fn within(&self, bound: f64) -> Result<Simplified> {
        let range = (Bound::Excluded(BEYOND), Bound::Excluded(f64::INFINITY));
        level_within("error", bound, range)?;
        let fit = self.params.fit;
        let allowed = if fit == Fit::Balanced { 2.0 * bound } else { bound };
        let solid = Solid::new(self.shape, &self.tree, &self.inside, self.run.seed);
        let candidates = solid.candidates(1);
        let gaps = Gaps::new(&candidates, &solid.points(1, &candidates));
        let mut count = (LEFT * gaps.needed(allowed).unwrap_or(MOST) as f64).ceil() as usize;
        let (mut held, mut missed) = (None, 0);
        let mut least = f64::INFINITY;
        for trial in 0.. {
            count = count.clamp(missed + 1, MOST);
            let mut diagnostics = Diagnostics::default();
            let (balls, gap) = self.placed(count, &mut diagnostics)?;
            let (spheres, error) = (balls.len(), self.error(&balls, gap)?);
            least = least.min(error);
            let times = (error / bound).powf(MORE);
            if error <= bound {
                held = Some((balls, error, diagnostics));
                count = (spheres as f64 * times).floor() as usize;
                count = count.clamp(missed + 1, (spheres - 1).max(missed + 1));
            } else {
                missed = count;
                count = (count as f64 * times).ceil() as usize;
            }
            if let Some((balls, ..)) = &held {
                let upper = balls.len();
                if trial >= TRIALS || upper <= missed + 1 + upper / CLOSE {
                    break;
                }
                count = count.min(upper - 1);
            } else if missed >= MOST || spheres < missed || trial > 2 * TRIALS {
                break;
            }
        }
        let Some((balls, error, diagnostics)) = held else {
            return Err(SimplifyError::Level(format!(
                "{MOST} spheres do not reach {bound} of the diagonal: the smallest error was {least:.3e}"
            )));
        };
        self.finished(Level::Native(bound), &balls, error, diagnostics)
    }
}

/// Share of the greedy choice's spheres that the search for an error begins with.
const LEFT: f64 = 0.7;
/// Exponent of the error, by which that search changes the number of spheres.
const MORE: f64 = 1.3;

/// Limit of the counts that the search for an error tries.
const TRIALS: usize = 6;
/// Inverse of the part of a count that it does not resolve.
const CLOSE: usize = 24;

fn grown(balls: &[Sphere], by: f64) -> Vec<Sphere> {
    balls.iter().map(|ball| Sphere::new(ball.centre, ball.radius + by)).collect()
}

fn failed(error: MetricError) -> SimplifyError {
    SimplifyError::Failed(error.to_string())
}
