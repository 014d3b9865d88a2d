//! Signed distance to the convex hull of two balls: the medial cone of an edge.
//!
//! The hull is the union of the balls `B(c(t), r(t))`, `t` in `[0, 1]`, so the signed distance is
//! the minimum over `t` of `|p - c(t)| - r(t)`: convex in `t`, which makes clamping exact.
//!
//! # Notation
//! | | |
//! |---|---|
//! | `u`, `l` | unit axis from the first to the second centre, and their distance |
//! | `s` | slope `(r_2 - r_1) / l` of the radius, `abs(s) < 1` unless one ball holds the other |
//! | `xi`, `y` | coordinate of the query along the axis, and its distance from the axis |
//! | `tau` | coordinate of the best centre, `xi + y s / sqrt(1 - s^2)` clamped to `[0, l]` |
//!
//! The distance is evaluated at `tau` and not by the closed form of the tangent line: near
//! internal tangency `tau` carries few digits, but the objective is flat there.

use super::{ConeFrame, HullFoot, Sphere};
use crate::Vec3;

/// The convex hull of two balls, prepared for distance queries.
///
/// When one ball holds the other (tangency and equality included) the hull is the larger ball.
///
/// ```
/// use medial_geometry::{Cone, Sphere, Vec3};
///
/// // A rod of radius 1 with round ends, and a query above its middle.
/// let rod = Cone::new(Sphere::new(Vec3::ZERO, 1.0), Sphere::new(4.0 * Vec3::X, 1.0));
/// let above = Vec3::new(2.0, 3.0, 0.0);
/// assert_eq!(rod.signed_distance(above), 2.0);
/// assert_eq!(rod.signed_distance(2.0 * Vec3::X), -1.0);
/// let foot = rod.foot(above);
/// assert_eq!((foot.point, foot.weights), (Vec3::new(2.0, 1.0, 0.0), [0.5, 0.5]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    start: Vec3,
    axis: Vec3,
    length: f64,
    /// Radius at `start`.
    radius: f64,
    slope: f64,
    /// `s / sqrt(1 - s^2)`: the shift of the best centre along the axis, per unit of `y`.
    lead: f64,
    /// The ball (0 or 1) that holds the other, if one does.
    larger: Option<usize>,
}

impl Cone {
    /// The hull of two balls.
    pub fn new(first: Sphere, second: Sphere) -> Self {
        let across = second.centre - first.centre;
        let growth = second.radius - first.radius;
        let length = across.length();
        if length <= growth.abs() {
            let larger = usize::from(growth > 0.0);
            return Self::ball([first, second][larger], larger);
        }
        // Product form: 1 - s^2 would cancel near tangency.
        let rise = (length - growth).sqrt() * (length + growth).sqrt();
        Self {
            start: first.centre,
            axis: across / length,
            length,
            radius: first.radius,
            slope: growth / length,
            lead: growth / rise,
            larger: None,
        }
    }

    fn ball(sphere: Sphere, larger: usize) -> Self {
        Self {
            start: sphere.centre,
            axis: Vec3::ZERO,
            length: 0.0,
            radius: sphere.radius,
            slope: 0.0,
            lead: 0.0,
            larger: Some(larger),
        }
    }

    /// Centre of the first ball.
    pub(crate) fn start(&self) -> Vec3 {
        self.start
    }

    /// `u`; zero when one ball holds the other.
    pub(crate) fn axis(&self) -> Vec3 {
        self.axis
    }

    /// `l`; zero when one ball holds the other.
    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    /// Radius of the first ball.
    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    /// `s`.
    pub(crate) fn slope(&self) -> f64 {
        self.slope
    }

    /// `s / sqrt(1 - s^2)`.
    pub(crate) fn lead(&self) -> f64 {
        self.lead
    }

    /// The ball (0 or 1) that holds the other, if one does.
    pub fn larger(&self) -> Option<usize> {
        self.larger
    }

    /// Signed distance of `p` to the boundary of the hull, negative inside: the true distance up to
    /// rounding, inside as well as outside, not a bound.
    #[inline]
    pub fn signed_distance(&self, p: Vec3) -> f64 {
        let (tau, squared) = self.best_centre(p);
        squared.sqrt() - (self.radius + tau * self.slope)
    }

    /// Signed distance of `p` as [`Cone::signed_distance`] has it, and the centre of the
    /// interpolated sphere that attains it. Cheaper than [`Cone::foot`].
    #[inline]
    pub fn nearest_centre(&self, p: Vec3) -> (f64, Vec3) {
        let (tau, squared) = self.best_centre(p);
        (squared.sqrt() - (self.radius + tau * self.slope), self.start + tau * self.axis)
    }

    /// Coordinate of the best centre, and squared distance of `p` from it.
    #[inline]
    fn best_centre(&self, p: Vec3) -> (f64, f64) {
        let w = p - self.start;
        let xi = w.dot(self.axis);
        // As a vector: sqrt(|w|^2 - xi^2) loses half the digits near the axis.
        let y_squared = (w - xi * self.axis).length_squared();
        let tau = (xi + y_squared.sqrt() * self.lead).clamp(0.0, self.length);
        (tau, (xi - tau) * (xi - tau) + y_squared)
    }

    /// The point of the hull's boundary nearest to `p`. For `p` on the axis a whole circle is
    /// nearest; one of its points is returned.
    pub fn foot(&self, p: Vec3) -> HullFoot<2> {
        let (tau, _) = self.best_centre(p);
        let radius = (self.radius + tau * self.slope).max(0.0);
        let sphere = Sphere::new(self.start + tau * self.axis, radius);
        let weights = match self.larger {
            Some(0) => [1.0, 0.0],
            Some(_) => [0.0, 1.0],
            None => {
                let t = tau / self.length;
                [1.0 - t, t]
            }
        };
        let Some(frame) = self.frame() else {
            return HullFoot::towards(sphere, weights, p, || Vec3::X);
        };
        if tau <= 0.0 || tau >= self.length {
            return HullFoot::towards(sphere, weights, p, || frame.normal(frame.v));
        }
        // On the lateral take the direction from the axis: near the axis `p - c(t)` is rounding.
        let across = frame.across(p - self.start).unwrap_or(frame.v);
        HullFoot::along(sphere, weights, p, frame.normal(across))
    }

    /// The axis frame from which the tangent planes follow, or `None` when one ball holds the
    /// other and there are none.
    pub fn frame(&self) -> Option<ConeFrame> {
        self.larger.is_none().then(|| ConeFrame::new(self.axis, self.slope))
    }
}
