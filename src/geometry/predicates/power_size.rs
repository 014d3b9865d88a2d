//! Size and clearance of a simplex of weighted points: the predicates of alpha shapes.
//!
//! H. Edelsbrunner, E. P. Muecke: *Three-dimensional alpha shapes*, ACM Transactions on Graphics 13
//! (1994), <https://doi.org/10.1145/174462.156635>; with weights H. Edelsbrunner: *The union of
//! balls and its dual shape*, Discrete & Computational Geometry 13 (1995),
//! <https://doi.org/10.1007/BF02574053>.
//!
//! The *orthocentre* `o` of a simplex is the point of its affine hull with the same power
//! `rho^2 = |o - p|^2 - w` to all of its vertices `(p, w)`.
//!
//! * The *size* of a simplex is the sign of `rho^2`.
//! * The *clearance* of a simplex from `(v, w)` is the sign of `|o - v|^2 - w - rho^2`. A negative
//!   one means that the simplex is attached to `v`.
//!
//! With `d_i = p_i - p_0` and the lifts `l_i = |d_i|^2 + w_0 - w_i`, hence `2 d_i . (o - p_0) = l_i`:
//!
//! | simplex | size, the sign of | clearance, the sign of |
//! |---|---|---|
//! | vertex | `-w_0` | `l_v` |
//! | edge | `l_1^2 - 4 |d_1|^2 w_0` | `l_v |d_1|^2 - l_1 d_1.v` |
//! | triangle | `l_1^2 |d_2|^2 - 2 l_1 l_2 d_1.d_2 + l_2^2 |d_1|^2 - 4 nu w_0` | `l_v nu - (l_1 |d_2|^2 - l_2 d_1.d_2) d_1.v - (l_2 |d_1|^2 - l_1 d_1.d_2) d_2.v` |
//! | tetrahedron | `|sum l_i d_j x d_k|^2 - 4 det^2 w_0` | the power test |
//!
//! where `nu = |d_1|^2 |d_2|^2 - (d_1.d_2)^2` is positive.
//!
//! Filters: with `u = 2^-53` a sum of products of at most `k` roundings each is off by at most
//! `k u` times the sum of the products' absolute values, up to a second-order term that the slack
//! of the constants covers. Inner products and cross products are bounded by Cauchy-Schwarz, lifts
//! by their *reach* `|d|^2 + |w_0 - w|`. The filter never decides when a difference is so short that
//! products may underflow, or when a product overflows.

use super::power_exact::{
    self, EdgeClearance, EdgeSize, TetrahedronSize, TriangleClearance, TriangleSize,
    VertexClearance,
};
use super::{Sign, Site};

const U: f64 = f64::EPSILON / 2.0;

/// The smallest squared difference for which a filter is trusted. Above it, the error of `2^-1074`
/// of a product that underflows, even multiplied by other factors, is far below `u` times the bound
/// of the whole sum.
const SHORTEST2: f64 = 1e-60;

/// A site relative to the origin of a call.
#[derive(Clone, Copy)]
struct Seen {
    d: [f64; 3],
    /// `|d|^2`: 5 roundings.
    square: f64,
    /// 7 roundings.
    lift: f64,
    /// The sum of the absolute values of the terms of the lift.
    reach: f64,
}

#[inline(always)]
fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn see(origin: &Site, s: &Site) -> Seen {
    let d = [s.p[0] - origin.p[0], s.p[1] - origin.p[1], s.p[2] - origin.p[2]];
    let square = dot(&d, &d);
    let weight = origin.w - s.w;
    Seen { d, square, lift: square + weight, reach: square + weight.abs() }
}

/// The sign of `value` if `error` and the shortest of the differences allow it.
#[inline(always)]
fn decided<const K: usize>(value: f64, error: f64, seen: [&Seen; K]) -> Option<Sign> {
    let long = seen.iter().all(|s| s.square >= SHORTEST2);
    // An error that overflows fails the comparison. A value that overflows is excluded as such.
    (long && value.abs() > error && value.is_finite()).then(|| Sign::of(value))
}

/// The size of a tetrahedron that is not flat.
#[inline]
pub(crate) fn tetrahedron_size([o, a, b, c]: [&Site; 4]) -> Sign {
    let (x, y, z) = (see(o, a), see(o, b), see(o, c));
    let (yz, zx, xy) = (cross(&y.d, &z.d), cross(&z.d, &x.d), cross(&x.d, &y.d));
    let n = [0, 1, 2].map(|k| x.lift * yz[k] + y.lift * zx[k] + z.lift * xy[k]);
    let det = dot(&x.d, &yz);
    let value = dot(&n, &n) - 4.0 * det * det * o.w;
    // Cauchy-Schwarz: the vector of the sums |y z'| + |z y'| is at most sqrt(2) |d| |d'| long.
    let (px, py, pz) = (
        x.reach * x.reach * y.square * z.square,
        y.reach * y.reach * z.square * x.square,
        z.reach * z.reach * x.square * y.square,
    );
    let product = x.square * y.square * z.square;
    let error = 34.0 * U * (6.0 * (px + py + pz) + 8.0 * product * o.w.abs());
    decided(value, error, [&x, &y, &z])
        .unwrap_or_else(|| power_exact::sign::<TetrahedronSize, 3>(o, [a, b, c]))
}

/// The size of a triangle that is not degenerate.
#[inline]
pub(crate) fn triangle_size([o, a, b]: [&Site; 3]) -> Sign {
    let (x, y) = (see(o, a), see(o, b));
    let xy = dot(&x.d, &y.d);
    let nu = x.square * y.square - xy * xy;
    let value = (x.lift * x.lift * y.square - 2.0 * x.lift * y.lift * xy
        + y.lift * y.lift * x.square)
        - 4.0 * nu * o.w;
    let terms = x.reach * x.reach * y.square + y.reach * y.reach * x.square;
    let error = 26.0 * U * (2.0 * terms + 8.0 * x.square * y.square * o.w.abs());
    decided(value, error, [&x, &y])
        .unwrap_or_else(|| power_exact::sign::<TriangleSize, 2>(o, [a, b]))
}

/// The size of an edge.
#[inline]
pub(crate) fn edge_size([o, a]: [&Site; 2]) -> Sign {
    let x = see(o, a);
    let value = x.lift * x.lift - 4.0 * x.square * o.w;
    let error = 18.0 * U * (x.reach * x.reach + 4.0 * x.square * o.w.abs());
    decided(value, error, [&x]).unwrap_or_else(|| power_exact::sign::<EdgeSize, 1>(o, [a]))
}

/// The clearance of a triangle that is not degenerate.
#[inline]
pub(crate) fn triangle_clearance([o, a, b]: [&Site; 3], v: &Site) -> Sign {
    let (x, y, z) = (see(o, a), see(o, b), see(o, v));
    let (xy, xz, yz) = (dot(&x.d, &y.d), dot(&x.d, &z.d), dot(&y.d, &z.d));
    let nu = x.square * y.square - xy * xy;
    let value = z.lift * nu
        - (x.lift * y.square - y.lift * xy) * xz
        - (y.lift * x.square - x.lift * xy) * yz;
    let terms = z.reach * x.square * y.square
        + x.reach * y.square * (x.square * z.square).sqrt()
        + y.reach * x.square * (y.square * z.square).sqrt();
    decided(value, 26.0 * U * 2.0 * terms, [&x, &y, &z])
        .unwrap_or_else(|| power_exact::sign::<TriangleClearance, 3>(o, [a, b, v]))
}

/// The clearance of an edge.
#[inline]
pub(crate) fn edge_clearance([o, a]: [&Site; 2], v: &Site) -> Sign {
    let (x, z) = (see(o, a), see(o, v));
    let value = z.lift * x.square - x.lift * dot(&x.d, &z.d);
    let terms = z.reach * x.square + x.reach * (x.square * z.square).sqrt();
    decided(value, 17.0 * U * terms, [&x, &z])
        .unwrap_or_else(|| power_exact::sign::<EdgeClearance, 2>(o, [a, v]))
}

/// The clearance of a vertex.
#[inline]
pub(crate) fn vertex_clearance(o: &Site, v: &Site) -> Sign {
    let z = see(o, v);
    decided(z.lift, 9.0 * U * z.reach, [&z])
        .unwrap_or_else(|| power_exact::sign::<VertexClearance, 1>(o, [v]))
}

#[cfg(test)]
#[path = "power_size_tests.rs"]
mod tests;
