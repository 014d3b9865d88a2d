//! The solid angle of a triangle.
//!
//! A. van Oosterom, J. Strackee: *The solid angle of a plane triangle*, IEEE Transactions on
//! Biomedical Engineering 30(2), 1983, doi:10.1109/TBME.1983.325207. With `a, b, c` the corners as
//! seen from the query,
//!
//! `tan(omega / 2) = a . (b x c) / (|a||b||c| + (a . b)|c| + (b . c)|a| + (c . a)|b|)`.
//!
//! The numerator is taken as `a . N` with `N = (b - a) x (c - a)`, prepared once and correct to the
//! last places: the query's height over the plane is then wrong by no more than its own rounding,
//! however thin the triangle.

use crate::Vec3;
use crate::geometry::planar_frame::accurate_cross;

/// Share of `|a||N|` that rounding can put into `a . N`.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// A triangle prepared for solid angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Facet {
    corners: [Vec3; 3],
    /// `(b - a) x (c - a)`: twice the area, along the normal.
    doubled: Vec3,
    /// Length of `doubled`.
    doubled_area: f64,
}

impl Facet {
    pub fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let doubled = accurate_cross(b - a, c - a);
        Self { corners, doubled, doubled_area: doubled.length() }
    }

    pub fn corners(&self) -> [Vec3; 3] {
        self.corners
    }

    /// Area times unit normal.
    pub fn area_vector(&self) -> Vec3 {
        0.5 * self.doubled
    }

    /// Half of the solid angle, in `[-pi, pi]`: positive from the side that the normal turns its
    /// back to, where the corners run clockwise. Zero in the plane of the triangle, also on the
    /// triangle itself: the mean of its two sides.
    #[inline]
    pub fn half_solid_angle(&self, p: Vec3) -> f64 {
        let [a, b, c] = self.corners.map(|v| v - p);
        let [la, lb, lc] = [a, b, c].map(Vec3::length);
        let numerator = a.dot(self.doubled);
        if numerator.abs() <= ROUNDING * la * self.doubled_area {
            return 0.0;
        }
        numerator.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn an_octant_is_an_eighth_of_the_sphere() {
        let octant = Facet::new([Vec3::X, Vec3::Y, Vec3::Z]);
        assert!((octant.half_solid_angle(Vec3::ZERO) - PI / 4.0).abs() < 1e-15);
        let back = Facet::new([Vec3::Y, Vec3::X, Vec3::Z]);
        assert!((back.half_solid_angle(Vec3::ZERO) + PI / 4.0).abs() < 1e-15);
    }

    /// `omega = 4 asin(a b / sqrt((a^2 + h^2)(b^2 + h^2)))` for a rectangle of half sides `a, b`
    /// seen from the height `h` over its centre.
    #[test]
    fn rectangles_have_their_closed_form() {
        for (a, b, h) in [(1.0, 2.0, 0.5), (1e-3, 1.0, 1e-6), (5.0, 5.0, 1e-9), (1.0, 1.0, 300.0)] {
            let corner = |x: f64, y: f64| Vec3::new(a * x, b * y, 0.0);
            let [p, q, r, s] =
                [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            let halves = [Facet::new([p, q, r]), Facet::new([p, r, s])];
            let eye = Vec3::new(0.0, 0.0, -h);
            let omega: f64 = halves.iter().map(|f| 2.0 * f.half_solid_angle(eye)).sum();
            let exact = 4.0 * (a * b / ((a * a + h * h) * (b * b + h * h)).sqrt()).asin();
            // The eye is as near to the diagonal as to the plane; the arc sine is steep at 1.
            let size = a.hypot(b).hypot(h);
            let tolerance = 1e-15 * size.powi(3) / (a * b * h) + 1e-8 * exact;
            assert!((omega - exact).abs() <= tolerance, "{omega} for {exact}");
        }
    }

    #[test]
    fn the_plane_of_the_triangle_sees_nothing_of_it() {
        let facet = Facet::new([Vec3::ZERO, 3.0 * Vec3::X, 3.0 * Vec3::Y]);
        for p in [Vec3::ONE.with_z(0.0), Vec3::ZERO, Vec3::X, 9.0 * Vec3::X] {
            assert_eq!(facet.half_solid_angle(p), 0.0);
        }
        let flat = Facet::new([Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]);
        assert_eq!(flat.half_solid_angle(Vec3::ONE), 0.0);
    }
}
