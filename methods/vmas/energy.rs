//! The error of a sphere at a surface point, one at a time and four at a time.
//!
//! `err_v(s) = a_v e_v(s)` with
//! `e_v(s) = sum_f w_f (n_f . (v - c) - r)^2 + lambda (|v - c| - r)^2`, where `w_f` is the share of the
//! plane `f` in the area of `v`. Which sphere has the least error does not depend on `a_v`.

use medial::complex::Sphere;
use wide::f64x4;

use super::points::{SurfacePoints, in_lanes};

/// The energy of the paper.
#[derive(Clone, Copy, Debug)]
pub(super) struct Energy {
    /// Weight of the Euclidean part.
    pub lambda: f64,
}

/// Spheres in lanes of four.
#[derive(Clone, Debug, Default)]
pub(super) struct Lanes {
    /// Centre and radius.
    spheres: Vec<[f64x4; 4]>,
    ids: Vec<f64x4>,
}

/// Radius in a lane without a sphere: its error is larger than every other.
const NO_SPHERE: f64 = 1e100;

impl Energy {
    /// `e_v(s)`: the error of a sphere at a point for each unit of the point's area.
    pub fn at(self, points: &SurfacePoints, v: usize, s: &Sphere) -> f64 {
        let u = points.positions[v] - s.centre;
        let mut planar = 0.0;
        for plane in points.planes(v) {
            let distance = plane.normal.dot(u) - s.radius;
            planar += plane.share * distance * distance;
        }
        let distance = u.length() - s.radius;
        planar + self.lambda * (distance * distance)
    }

    /// The sphere with the least error at a point, the smallest id of equal ones; the operations are
    /// those of [`Energy::at`] in the same order, so that the errors are the same bits.
    pub fn least(self, points: &SurfacePoints, v: usize, lanes: &Lanes) -> u32 {
        let p = points.positions[v].to_array().map(f64x4::splat);
        let lambda = f64x4::splat(self.lambda);
        let (mut least, mut who) = (f64x4::splat(f64::INFINITY), f64x4::splat(0.0));
        for ([x, y, z, radius], &ids) in lanes.spheres.iter().zip(&lanes.ids) {
            let u = [p[0] - *x, p[1] - *y, p[2] - *z];
            let mut planar = f64x4::splat(0.0);
            for plane in points.planes(v) {
                let n = plane.normal.to_array().map(f64x4::splat);
                let distance = n[0] * u[0] + n[1] * u[1] + n[2] * u[2] - *radius;
                planar += f64x4::splat(plane.share) * distance * distance;
            }
            let distance = (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).sqrt() - *radius;
            let error = planar + lambda * (distance * distance);
            // Ids ascend in each lane: the first of equal errors stays.
            let less = error.simd_lt(least);
            least = less.bitselect(error, least);
            who = less.bitselect(ids, who);
        }
        let in_lanes = least.to_array().into_iter().zip(who.to_array());
        let best = in_lanes.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        best.map_or(0, |(_, id)| id as u32)
    }
}

impl Lanes {
    /// Spheres `ids` of all, in ascending order.
    pub fn fill(&mut self, spheres: &[Sphere], ids: &[u32]) {
        self.spheres.clear();
        self.ids.clear();
        for four in ids.chunks(4) {
            let [x, y, z] =
                [0, 1, 2].map(|axis| in_lanes(four, 0.0, |&s| spheres[s as usize].centre[axis]));
            let radius = in_lanes(four, NO_SPHERE, |&s| spheres[s as usize].radius);
            self.spheres.push([x, y, z, radius]);
            self.ids.push(in_lanes(four, f64::MAX, |&s| f64::from(s)));
        }
    }
}
