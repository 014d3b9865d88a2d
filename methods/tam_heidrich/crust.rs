//! The last step of the paper's pipeline, section 5: the poles that are left, for the power crust.
//!
//! 1. An inner pole is left if its polar ball is on the remaining axis. A pole whose ball is hidden by
//!    another is on no part, so it is not left.
//! 2. For objects with sharp corners the outer poles of removed features go too. An outer pole is
//!    that of a removed feature if no inner polar ball that is left touches any of its samples.
//! 3. The power crust of both ([`medial::geometry::PowerCrust`]). The balls are the polar balls as they
//!    are, neither moved nor grown.

use medial::Vec3;
use medial::complex::Sphere;
use medial::geometry::{Delaunay, PolarBall, Poles, PowerCrust};
use medial::shape::{Shape, ShapeError};
use medial::surface::Side;

use super::duplicates::DistinctBalls;

/// The poles that pruning left, in normalised units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RemainingPoles {
    /// Inner polar balls on the remaining parts.
    pub inner: Vec<Sphere>,
    /// For each sample of the shape whether one of them touches it.
    pub is_touched: Vec<bool>,
}

/// The outer poles that the power crust takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OuterPoles {
    /// All of the samples: what the paper does for most objects.
    All,
    /// Without those of removed features: what it offers for objects with sharp corners.
    OfRemaining,
}

/// Corners of a box so far out, in diagonals, are added to the samples, so that no pole is at infinity.
const BOX: f64 = 2.5;

impl RemainingPoles {
    /// The power crust of the poles that are left, of the shape that was pruned.
    ///
    /// # Errors
    /// When the samples or the poles have no triangulation.
    pub fn power_crust(&self, shape: &Shape, outer: OuterPoles) -> Result<PowerCrust, ShapeError> {
        Ok(PowerCrust::new(&self.inner, &self.outer(shape, outer)?)?)
    }

    /// Outer polar balls of the samples of the shape that was pruned. Costs a triangulation.
    ///
    /// # Errors
    /// When the samples have no triangulation.
    pub fn outer(&self, shape: &Shape, which: OuterPoles) -> Result<Vec<Sphere>, ShapeError> {
        let is_of_remaining = |ball: &PolarBall| {
            let mut samples = ball.samples.iter().map(|&s| s as usize);
            samples.any(|s| self.is_touched.get(s).copied().unwrap_or(false))
        };
        let mut balls = outer_balls(shape)?;
        balls.retain(|ball| which == OuterPoles::All || is_of_remaining(ball));
        Ok(balls.into_iter().map(|ball| ball.sphere).collect())
    }
}

fn outer_balls(shape: &Shape) -> Result<Vec<PolarBall>, ShapeError> {
    let mut points = shape.samples().to_vec();
    let side = |k: usize| if k & 1 == 1 { BOX } else { -BOX };
    points.extend((0..8).map(|k| Vec3::new(side(k), side(k >> 1), side(k >> 2))));
    let samples = points.len() - 8;
    let mut balls = Poles::new(&Delaunay::new(&points)?).balls().to_vec();
    // Poles of the corners alone are of no sample.
    balls.retain(|ball| ball.samples.iter().any(|&s| (s as usize) < samples));
    let centres: Vec<Vec3> = balls.iter().map(|ball| ball.sphere.centre).collect();
    let mut sides = shape.inside_test().sides(&centres).into_iter();
    balls.retain(|_| sides.next() != Some(Side::Inside));
    Ok(balls)
}

/// The inner poles of an axis before pruning.
#[derive(Default)]
pub(super) struct AxisPoles {
    /// For each polar ball its sphere of the axis, and the samples that it touches.
    inner: Vec<(Sphere, u32, Vec<u32>)>,
    samples: usize,
}

impl AxisPoles {
    /// Those of `samples` samples; `on_axis` has the balls of `poles` that are on the axis, with the
    /// spheres of the axis that they are.
    pub(super) fn of(
        samples: usize,
        poles: &DistinctBalls,
        on_axis: impl Iterator<Item = (u32, u32)>,
    ) -> Self {
        let inner = on_axis.map(|(ball, sphere)| {
            (poles.balls[ball as usize], sphere, poles.samples_of(ball).to_vec())
        });
        Self { inner: inner.collect(), samples }
    }

    /// The poles left when these spheres of the axis are left.
    pub(super) fn remaining(&self, sphere_kept: &[bool]) -> RemainingPoles {
        let (mut inner, mut is_touched) = (Vec::new(), vec![false; self.samples]);
        for (ball, _, samples) in self.inner.iter().filter(|i| sphere_kept[i.1 as usize]) {
            inner.push(*ball);
            samples.iter().for_each(|&s| is_touched[s as usize] = true);
        }
        RemainingPoles { inner, is_touched }
    }
}
