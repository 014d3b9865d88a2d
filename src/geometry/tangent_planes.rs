//! Planes tangent to two or three balls from outside, as Q-MAT's slab quadrics need them.
//!
//! A plane with unit normal `n` touches the balls `(c_i, r_i)` from outside when `n . c_i + r_i`
//! is the same for all of them.

use super::Sphere;
use crate::Vec3;

/// The two planes tangent to the three balls of a slab, `n = -g +- k N`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlabPlanes {
    /// Unit normal `N` of the centres' plane, counter-clockwise around the centres in their order.
    pub centre_normal: Vec3,
    /// Gradient `g` of the radius in the centres' plane, shorter than 1.
    pub gradient: Vec3,
    /// `k = sqrt(1 - g.g)`, positive.
    pub rise: f64,
}

impl SlabPlanes {
    /// The planes of three spheres alone, without preparing the slab for distance queries.
    ///
    /// `None` when there are none: collinear centres, or radii that grow as fast as the centres
    /// move apart.
    pub fn new(spheres: [Sphere; 3]) -> Option<Self> {
        super::slab::SlabFace::new(spheres).map(|face| face.planes())
    }

    /// Outward unit normals `-g + k N` and `-g - k N`. Ball `i` is touched at `c_i + r_i n`.
    pub fn normals(&self) -> [Vec3; 2] {
        let lift = self.rise * self.centre_normal;
        [lift - self.gradient, -lift - self.gradient]
    }
}

/// The frame of a cone: its tangent planes have the normals `-s u + sqrt(1 - s^2) w` for all unit
/// vectors `w` orthogonal to `u`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeFrame {
    /// Unit axis, from the first centre to the second.
    pub u: Vec3,
    /// Slope of the radius along the axis, between -1 and 1.
    pub s: f64,
    /// Unit vector orthogonal to the axis.
    pub v: Vec3,
    /// Unit vector orthogonal to both.
    pub w: Vec3,
}

impl ConeFrame {
    pub(super) fn new(u: Vec3, s: f64) -> Self {
        let v = u.any_orthonormal_vector();
        Self { u, s, v, w: u.cross(v) }
    }

    /// The unit vector orthogonal to the axis in the direction of `towards`, or `None` when that is
    /// along the axis up to rounding.
    pub fn across(&self, towards: Vec3) -> Option<Vec3> {
        let rejected = towards.reject_from_normalized(self.u).try_normalize()?;
        // The remainder of a vector along the axis is rounding, and not orthogonal to the axis.
        let again = rejected.reject_from_normalized(self.u);
        let length = again.length();
        (length > 0.5).then(|| again / length)
    }

    /// Outward unit normal of the tangent plane in the direction `across`, a unit vector
    /// orthogonal to `u`.
    pub fn normal(&self, across: Vec3) -> Vec3 {
        ((1.0 - self.s) * (1.0 + self.s)).max(0.0).sqrt() * across - self.s * self.u
    }

    /// Four tangent planes a quarter turn apart. The sum of their quadrics does not depend on
    /// which four.
    pub fn normals(&self) -> [Vec3; 4] {
        [self.v, self.w, -self.v, -self.w].map(|across| self.normal(across))
    }
}
