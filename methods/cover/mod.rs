//! `cover`: spheres alone that contain a solid, fit into it, or deviate least from it, with a proof.
//!
//! A method of this project, for collision models and grains made of spheres.
//!
//! # One problem behind three moods
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
//! - `depth(c)`, the balls fit into K, and leave `G` uncovered (`mood=inside`);
//! - `depth(c) + G`, they contain K, and protrude by `G` at most (`mood=outside`);
//! - `depth(c) + G / 2`, they do both by `G / 2` at most (`mood=balanced`),
//!
//! and for these centres no other radii do better, as long as a ball protrudes by its radius less its
//! depth. All moods minimise `G` over the centres. An inner ball that is contained in another has the larger `f` everywhere, so
//! centres of medial balls are enough.
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
//! 5. *Points*: dense samples, and the witness of the certificate, join the points where their gaps are
//!    large; steps 3 and 4 go on.
//! 6. *Proof*: the upper end of the certified interval of `G` ([`CoverTest::uncovered`]) decides the radii.
//!
//! The native level is the allowed error of the mood: a search over N.

mod placement;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use medial::complex::{MedialMesh, Sphere};
use medial::metrics::{CoverTest, MetricError, OneSided};
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, Method, MethodInfo, NativeLevel, ParamFields, RunContext, Simplification,
    Simplified, SimplifyError,
};
use medial::surface::{InsideTest, TriangleBvh, sample_with_faces};
use placement::{Gaps, Placement, Solid};
use serde::{Deserialize, Serialize};

use crate::levels::{checked, level_within, some_spheres};
use crate::{Prepared, Result};

/// Spheres of [`Level::Published`].
const USUAL: usize = 64;

/// Most spheres that are placed together.
const MOST: usize = 1_000;

/// Sweeps at each power, as the exponent of 2.
const SCHEDULE: [(u32, usize); 3] = [(3, 8), (4, 8), (5, 8)];

/// Rounds of more points.
const ROUNDS: usize = 3;

/// Dense samples of a round, for each sphere and at least.
const DENSE: [usize; 2] = [200, 20_000];

/// Width of the certified interval of `G`, as a share of it.
const WIDTH: f64 = 0.005;

/// Radii are smaller than the depth by this, in diagonals, so that files keep them inside.
const WITHIN: f64 = 1e-7;

/// Radii are larger by this, in diagonals: a certificate of cover needs a margin.
const BEYOND: f64 = 1e-5;

/// Spheres that cover, as a method.
///
/// Supports all levels from one sphere to [`MOST`]. Cost: about the spheres times the points in each sweep.
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
        mood: Mood = Mood::Balanced, "balanced, outside or inside";
    }
}

/// The side on which spheres deviate from a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mood {
    /// The larger error of both sides is least.
    Balanced,
    /// Nothing is uncovered, and the overshoot is least.
    Outside,
    /// Nothing protrudes, and the uncovered distance is least.
    Inside,
}

impl Mood {
    /// The share of `G` that is added to the depths.
    fn share(self) -> f64 {
        match self {
            Self::Balanced => 0.5,
            Self::Outside => 1.0,
            Self::Inside => 0.0,
        }
    }

    /// The error of the mood for a `G`.
    fn error(self, gap: f64) -> f64 {
        if self == Self::Balanced { 0.5 * gap } else { gap }
    }
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
        self.finished(level, &placed, gap, diagnostics)
    }
}

impl PreparedCover<'_> {
    fn test(&self) -> CoverTest<'_> {
        CoverTest::new(&self.shape.mesh().vertices, &self.tree, &self.inside)
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
        let candidates = solid.candidates(count);
        if candidates.is_empty() {
            return Err(SimplifyError::unsupported(
                "no ball fits into the solid; give a surface that encloses a volume",
            ));
        }
        let points = solid.points(count, &candidates);
        let mut chosen = Gaps::new(&candidates, &points).start(count);
        // With spheres to spare, the largest ones that are left.
        let spare = (0..candidates.len()).filter(|k| !chosen.contains(k));
        let spare: Vec<usize> = spare.take(count - chosen.len()).collect();
        chosen.extend(spare);
        let balls: Vec<Sphere> = chosen.into_iter().map(|k| candidates[k]).collect();
        if balls.len() < count {
            diagnostics.warn(format!(
                "{} spheres instead of {count}: the solid has no more candidates",
                balls.len()
            ));
        }
        let mut placement = Placement::new(&solid, balls, points);
        let mut swaps = 0;
        for (squarings, sweeps) in SCHEDULE {
            for _ in 0..sweeps {
                placement.sweep(squarings, run)?;
            }
            swaps += placement.swap(&candidates, (squarings, count), run)?;
        }
        for round in 0..ROUNDS {
            let dense = (DENSE[0] * count).max(DENSE[1]);
            let samples =
                sample_with_faces(shape.mesh(), dense, run.seed.wrapping_add(2 + round as u64));
            let samples: Vec<_> = samples.into_iter().map(|(p, _)| p).collect();
            let near = 0.9 * placement.worst().0;
            let gaps = placement.gaps_of(&samples);
            placement.extend((samples.into_iter().zip(gaps)).filter(|s| s.1 > near).map(|s| s.0));
            let gap = self.gap(&placement.balls)?;
            placement.extend(gap.witness);
            for _ in 0..6 {
                placement.sweep(5, run)?;
            }
            swaps += placement.swap(&candidates, (5, count), run)?;
            for _ in 0..6 {
                placement.sweep(6, run)?;
            }
        }
        diagnostics.count("swaps", swaps);
        let gap = self.gap(&placement.balls)?;
        Ok((placement.balls, gap))
    }

    /// The certified interval of `G`.
    fn gap(&self, balls: &[Sphere]) -> Result<OneSided> {
        let test = self.test();
        let rough = test.uncovered(balls, 0.01).map_err(failed)?;
        test.uncovered(balls, (WIDTH * rough.upper).max(1e-5)).map_err(failed)
    }

    /// Step 6.
    fn finished(
        &self,
        level: Level,
        inner: &[Sphere],
        gap: OneSided,
        mut diagnostics: Diagnostics,
    ) -> Result<Simplified> {
        let mood = self.params.mood;
        let added = match mood {
            Mood::Inside => -WITHIN,
            _ => mood.share() * gap.upper + BEYOND,
        };
        let spheres =
            inner.iter().map(|ball| Sphere::new(ball.centre, (ball.radius + added).max(0.0)));
        let mesh = MedialMesh::from_simplices(spheres.collect(), vec![], vec![])?;
        let error = mood.error(gap.upper);
        diagnostics.count("error_in_millionths", (1e6 * error).ceil() as usize);
        checked(level, mesh, Some(error), diagnostics)
    }

    /// The level by error.
    fn within(&self, error: f64) -> Result<Simplified> {
        level_within("error", error, f64::MIN_POSITIVE..)?;
        Err(SimplifyError::unsupported("later"))
    }
}

fn failed(error: MetricError) -> SimplifyError {
    SimplifyError::Failed(error.to_string())
}
