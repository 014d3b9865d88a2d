//! The sphere, its signed distance, and the answer type shared by sphere, cone and slab.

use crate::Vec3;

/// A medial sphere `m = (c, r)`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sphere {
    /// Centre `c`.
    pub centre: Vec3,
    /// Radius `r`. It should not be negative, which is not enforced: distances follow their formula
    /// with any number, while [`DualComplex::of_balls`](crate::DualComplex::of_balls) and
    /// [`PowerCrust::new`](crate::PowerCrust::new) refuse a negative radius.
    pub radius: f64,
}

impl Sphere {
    /// A sphere from its centre and radius.
    pub const fn new(centre: Vec3, radius: f64) -> Self {
        Self { centre, radius }
    }

    /// The point `(1 - t) self + t other` of the edge between two spheres, in `R^4`.
    pub fn lerp(self, other: Self, t: f64) -> Self {
        Self::new(self.centre.lerp(other.centre, t), self.radius + t * (other.radius - self.radius))
    }

    /// Signed distance of `p` to the sphere, negative inside. A sphere of radius 0 is a point.
    pub fn signed_distance(&self, p: Vec3) -> f64 {
        p.distance(self.centre) - self.radius
    }

    /// Where `p` is nearest to the sphere. From the centre itself every point is nearest, and the
    /// one in direction `x` is returned.
    pub fn foot(&self, p: Vec3) -> HullFoot<1> {
        HullFoot::towards(*self, [1.0], p, || Vec3::X)
    }
}

/// The nearest point on the boundary of the convex hull of `N` balls: one ball is a sphere, two a
/// cone, three a slab.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HullFoot<const N: usize> {
    /// Signed distance of the query to the hull, negative inside.
    pub signed_distance: f64,
    /// The interpolated sphere `sum_i weights[i] m_i` that attains the distance.
    pub sphere: Sphere,
    /// Barycentric weights of that sphere over the given ones: non-negative, of sum 1.
    pub weights: [f64; N],
    /// The nearest point, on `sphere` and on the boundary of the hull.
    pub point: Vec3,
}

/// The vector from a centre to the query, if shorter than this share of the radius, gives no
/// direction: its rounding error is too large.
const SHORT_ARM: f64 = 1e-8;

impl<const N: usize> HullFoot<N> {
    /// The foot of `p` on the interpolated sphere that attains its distance: on the ray from the
    /// centre through `p`, or in the direction `apart` if `p` is too close to the centre.
    pub(super) fn towards(
        sphere: Sphere,
        weights: [f64; N],
        p: Vec3,
        apart: impl FnOnce() -> Vec3,
    ) -> Self {
        let arm = p - sphere.centre;
        let distance = arm.length();
        let tells = distance > 0.0 && distance > SHORT_ARM * sphere.radius;
        Self::along(sphere, weights, p, if tells { arm / distance } else { apart() })
    }

    /// The foot of `p` in a known direction from the centre.
    pub(super) fn along(sphere: Sphere, weights: [f64; N], p: Vec3, direction: Vec3) -> Self {
        let signed_distance = sphere.signed_distance(p);
        let point = sphere.centre + sphere.radius * direction;
        Self { signed_distance, sphere, weights, point }
    }
}
