//! The solid angle of many far triangles: a Taylor expansion, and a bound of its error.
//!
//! The triangles of a node are within `R` of their centre `c`; the query is at `p = c - d u`,
//! `|u| = 1`, and `rho = R / d < 1`. The solid angle is the flux of `-grad 1/|x - p|` through the
//! triangles. Its Taylor polynomial of second degree in `y = x - c` (G. Barill and others, *Fast
//! winding numbers for soups and clouds*, ACM Transactions on Graphics 37(4), 2018,
//! doi:10.1145/3197517.3201337, eq. 15) is
//!
//! `omega = rho^2 [ S . u - 3 rho Q(u, u) + 15/2 rho^2 O(u, u, u) ]`
//!
//! with the moments `S = sum int n`, `Q = sum int n y`, `O = sum int n y y`, in units of `R`.
//!
//! 1. The kernel is harmonic and symmetric in its indices, so only the symmetric, trace-free parts
//!    of `Q` and `O` contribute. Only these are stored.
//! 2. *Error bound.* `1/|x - p| = sum_k |y|^k P_k(cos g) / d^(k+1)`. By the inequality of Bernstein
//!    and Szego, `(dT/dg)^2 + k^2 T^2 <= k^2 max T^2` for trigonometric polynomials `T` of degree
//!    `k`, the gradient of `|y|^k P_k(cos g)` is at most `k |y|^(k-1)`. The polynomial holds `k <= 3`;
//!    the rest is at most `sum_(k>=4) k |y|^(k-1) / d^(k+1)`, and integrated
//!
//! `|error of omega| <= M rho^5 (4 - 3 rho) / (1 - rho)^2`, `M = int |y|^3` in units of `R`.

use super::solid_angle::Facet;
use crate::Vec3;

/// Moments of the triangles below a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expansion {
    pub centre: Vec3,
    /// Radius of a ball around the centre that holds all triangles.
    pub radius: f64,
    /// `S`.
    dipole: Vec3,
    /// `Q`: xx, yy, zz, yz, zx, xy.
    quadrupole: [f64; 6],
    /// `O`: xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy, xyz.
    octupole: [f64; 10],
    /// An upper bound of `M`.
    third: f64,
}

/// A solid angle, and a bound of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    pub omega: f64,
    pub error: f64,
}

impl Expansion {
    pub fn new(facets: &[Facet]) -> Self {
        let centre = centroid(facets);
        let radius = facets
            .iter()
            .flat_map(Facet::corners)
            .fold(0.0, |r, v| f64::max(r, v.distance_squared(centre)))
            .sqrt()
            // The query's distance from the centre is rounded too.
            * (1.0 + 1e-14);
        let mut expansion = Self {
            centre,
            radius,
            dipole: Vec3::ZERO,
            quadrupole: [0.0; 6],
            octupole: [0.0; 10],
            third: 0.0,
        };
        if radius > 0.0 {
            for facet in facets {
                expansion.add(facet);
            }
        }
        remove_traces(&mut expansion.quadrupole, &mut expansion.octupole);
        expansion
    }

    /// Adds the symmetric moments of a triangle: `int y = A m` and
    /// `int y y = A/12 (sum v v + 9 m m)` over its corners `v` with mean `m`.
    fn add(&mut self, facet: &Facet) {
        let corners = facet.corners().map(|v| (v - self.centre) / self.radius);
        let n = facet.area_vector() / self.radius / self.radius;
        let m = (corners[0] + corners[1] + corners[2]) / 3.0;
        self.dipole += n;
        let second = |i: usize, j: usize| {
            (corners.iter().map(|v| v[i] * v[j]).sum::<f64>() + 9.0 * m[i] * m[j]) / 12.0
        };
        for (value, (i, j)) in self.quadrupole.iter_mut().zip(PAIRS) {
            *value += 0.5 * (n[i] * m[j] + n[j] * m[i]);
        }
        for (value, (i, j, k)) in self.octupole.iter_mut().zip(TRIPLES) {
            *value += (n[i] * second(j, k) + n[j] * second(k, i) + n[k] * second(i, j)) / 3.0;
        }
        // The integrand is convex: its mean over a triangle is at most the mean over the corners.
        let mean = corners.iter().map(|v| v.length_squared() * v.length()).sum::<f64>() / 3.0;
        self.third += n.length() * mean;
    }

    /// The solid angle seen from `p`, and its error; `p` must be beyond the radius.
    #[inline]
    pub fn solid_angle(&self, p: Vec3) -> Estimate {
        let r = self.centre - p;
        let reciprocal = 1.0 / r.length();
        let (u, rho) = (r * reciprocal, self.radius * reciprocal);
        let [xx, yy, zz, yz, zx, xy] = self.quadrupole;
        let q = u.x * (xx * u.x + 2.0 * xy * u.y)
            + u.y * (yy * u.y + 2.0 * yz * u.z)
            + u.z * (zz * u.z + 2.0 * zx * u.x);
        let [xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy, xyz] = self.octupole;
        let squares = u * u;
        let o = squares.x * (xxx * u.x + 3.0 * (xxy * u.y + xxz * u.z))
            + squares.y * (yyy * u.y + 3.0 * (yyx * u.x + yyz * u.z))
            + squares.z * (zzz * u.z + 3.0 * (zzx * u.x + zzy * u.y))
            + 6.0 * xyz * u.x * u.y * u.z;
        let gap = 1.0 - rho;
        let squared = rho * rho;
        Estimate {
            omega: squared * (self.dipole.dot(u) - 3.0 * rho * q + 7.5 * squared * o),
            error: self.third * squared * squared * rho * (4.0 - 3.0 * rho) / (gap * gap),
        }
    }
}

const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)];
const TRIPLES: [(usize, usize, usize); 10] = [
    (0, 0, 0),
    (1, 1, 1),
    (2, 2, 2),
    (0, 0, 1),
    (0, 0, 2),
    (1, 1, 0),
    (1, 1, 2),
    (2, 2, 0),
    (2, 2, 1),
    (0, 1, 2),
];

/// Centre by area, or by corners where there is no area.
fn centroid(facets: &[Facet]) -> Vec3 {
    let (mut by_area, mut by_corners, mut area) = (Vec3::ZERO, Vec3::ZERO, 0.0);
    for facet in facets {
        let [a, b, c] = facet.corners();
        let mean = (a + b + c) / 3.0;
        let size = facet.area_vector().length();
        by_area += size * mean;
        by_corners += mean;
        area += size;
    }
    let centre = by_area / area;
    if centre.is_finite() { centre } else { by_corners / facets.len() as f64 }
}

/// Subtracts the traces from symmetric tensors, to which harmonic kernels are blind.
fn remove_traces(second: &mut [f64; 6], third: &mut [f64; 10]) {
    let trace = (second[0] + second[1] + second[2]) / 3.0;
    for diagonal in &mut second[..3] {
        *diagonal -= trace;
    }
    let [xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy, _] = *third;
    let [x, y, z] = [xxx + yyx + zzx, xxy + yyy + zzy, xxz + yyz + zzz].map(|t| t / 5.0);
    for (value, share) in third.iter_mut().zip([3.0 * x, 3.0 * y, 3.0 * z, y, z, x, z, x, y, 0.0]) {
        *value -= share;
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    #[test]
    fn the_error_is_within_its_bound_and_falls_as_fast() {
        let mut rng = Pcg64::seed_from_u64(5);
        let mut vector = || Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0;
        for case in 0..50 {
            let count = 1 + case % 9;
            let triangle = |v: &mut dyn FnMut() -> Vec3| Facet::new([v(), v(), v()]);
            let facets: Vec<Facet> = (0..count).map(|_| triangle(&mut vector)).collect();
            let expansion = Expansion::new(&facets);
            let direction = vector().normalize();
            let mut last = f64::INFINITY;
            for step in 0..7 {
                let distance = expansion.radius * 1.2 * 2_f64.powi(step);
                let p = expansion.centre - distance * direction;
                let exact: f64 = facets.iter().map(|f| 2.0 * f.half_solid_angle(p)).sum();
                let estimate = expansion.solid_angle(p);
                let error = (estimate.omega - exact).abs();
                assert!(error <= estimate.error, "{error:e} above {:e}", estimate.error);
                assert!(estimate.error < last / 20.0);
                last = estimate.error;
            }
        }
    }

    #[test]
    fn degenerate_triangles_have_no_moments() {
        let point = Facet::new([Vec3::ONE; 3]);
        let segment = Facet::new([Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]);
        for facets in [&[point][..], &[point, segment]] {
            let estimate = Expansion::new(facets).solid_angle(9.0 * Vec3::Y);
            assert_eq!(estimate, Estimate { omega: 0.0, error: 0.0 });
        }
    }
}
