//! The filter stage of the predicates: double precision with a bound on the rounding error.
//!
//! Notation: `u = 2^-53`; `M` the largest distance of the points to the origin of the call.
//!
//! If every product in a sum of products passes through at most `k` roundings, the computed sum is
//! off by at most `(1 + u)^k - 1` times the sum of the absolute values of the products, the
//! *permanent*.
//!
//! * Orientation: `k = 8` (two differences, product, difference of products, third difference,
//!   product, two sums). The permanent is computed.
//! * In-sphere: `k = 16` (`3 x 3` minors 8, lift 5, product, two sums), 17 with weights. By
//!   Cauchy-Schwarz `|x y'| + |y x'| <= M^2`, so the permanent is at most `12 M^3 B`, where `B` bounds
//!   the lifts, and the error at most `17 * 12 u M^3 B`.
//! * In-sphere, if that bound does not decide: the permanent itself. It shrinks with points that are
//!   flat along an axis, while `M` does not.
//!
//! Differences of coordinates may underflow gradually, which is exact. Products may underflow, each off by at
//! most `2^-1075`, and what multiplies them may be large: `M` is at most `2e57` by
//! [`MAX_COORDINATE`](super::MAX_COORDINATE), `B` at most `1.4e115`.
//!
//! * Orientation: six products of two, each multiplied by a third difference: less than `4e-266`.
//! * In-sphere: twelve products of two, each in two minors, multiplied by a third difference and a lift, and
//!   four lifts of three squares, each multiplied by a minor: less than `4e-150`.
//!
//! [`ORIENTATION_UNDERFLOW`] and [`UNDERFLOW`] cover these sums. No rounding bound does: where a large
//! coordinate meets tiny ones, the product that it multiplies is 0 in the permanent, too.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Sub};

use crate::predicates::exact::Grid;
use crate::predicates::{Sign, exact};

/// A point with its weight. The weight of a Delaunay site is zero and never read.
///
/// Aligned so that a site never straddles two cache lines: sites are read in random order.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct Site {
    pub(crate) p: [f64; 3],
    pub(crate) w: f64,
}

/// Whether the lift of a site to the paraboloid carries a weight.
pub(crate) trait Metric {
    const WEIGHTED: bool;
}

/// `|p|^2`: the Delaunay triangulation.
pub(crate) struct Unweighted;

/// `|p|^2 - w`: the regular triangulation.
pub(crate) struct Weighted;

impl Metric for Unweighted {
    const WEIGHTED: bool = false;
}

impl Metric for Weighted {
    const WEIGHTED: bool = true;
}

const U: f64 = f64::EPSILON / 2.0;
const ORIENTATION_BOUND: f64 = 8.5 * U;
const IN_SPHERE_BOUND: f64 = 216.0 * U;
/// 17 roundings of the determinant, and as many of the permanent.
const PERMANENT_BOUND: f64 = 17.5 * U;
/// Largest error of an orientation by underflow, with a margin.
const ORIENTATION_UNDERFLOW: f64 = 1e-260;
/// The same for the in-sphere test and the power test.
pub(crate) const UNDERFLOW: f64 = 1e-145;
/// The same relative to the largest lift, or 1.
const RELATIVE_UNDERFLOW: f64 = 1e-300;

#[inline(always)]
fn sub(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `det(b - a, c - a, d - a)` in double precision, without a bound on its error: for walks that are
/// finished with exact tests.
#[inline(always)]
pub(crate) fn approximate_orientation(
    a: &[f64; 3],
    b: &[f64; 3],
    c: &[f64; 3],
    d: &[f64; 3],
) -> f64 {
    let (b, c, d) = (sub(b, a), sub(c, a), sub(d, a));
    b[2] * (c[0] * d[1] - c[1] * d[0])
        + c[2] * (d[0] * b[1] - d[1] * b[0])
        + d[2] * (b[0] * c[1] - b[1] * c[0])
}

/// The filters, with knowledge common to all sites of a triangulation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Filter {
    /// If the error bound of a call is at most this, the call rounds nothing at all: every
    /// intermediate value is a small multiple of a power of the common quantum.
    exact_orientation: f64,
    exact_power: f64,
    /// The grid of the exact stage.
    grid: Option<Grid>,
}

impl Filter {
    /// The filter without knowledge of the sites.
    pub(crate) const ANY: Self = Self { exact_orientation: -1.0, exact_power: -1.0, grid: None };

    /// The filter for sites whose coordinates are multiples of `2^quantum` and below `2^top`, and
    /// whose weights are multiples of its square.
    pub(crate) fn of_grid(quantum: i32, top: i32) -> Self {
        // Multiples of q^5 up to 2^53 q^5 are exact; q^5 itself must be a normal number.
        if !(-180..=180).contains(&quantum) {
            return Self::ANY;
        }
        Self {
            exact_orientation: ORIENTATION_BOUND * f64::powi(2.0, 52 + 3 * quantum),
            exact_power: IN_SPHERE_BOUND / 12.0 * f64::powi(2.0, 52 + 5 * quantum),
            grid: Grid::new(quantum, top),
        }
    }

    /// The sign of `det(b - a, c - a, d - a)`.
    #[inline]
    pub(crate) fn orient3d(self, a: &[f64; 3], b: &[f64; 3], c: &[f64; 3], d: &[f64; 3]) -> Sign {
        let (b1, c1, d1) = (sub(b, a), sub(c, a), sub(d, a));
        let (cxdy, cydx) = (c1[0] * d1[1], c1[1] * d1[0]);
        let (dxby, dybx) = (d1[0] * b1[1], d1[1] * b1[0]);
        let (bxcy, bycx) = (b1[0] * c1[1], b1[1] * c1[0]);
        let det = b1[2] * (cxdy - cydx) + c1[2] * (dxby - dybx) + d1[2] * (bxcy - bycx);
        let permanent = b1[2].abs() * (cxdy.abs() + cydx.abs())
            + c1[2].abs() * (dxby.abs() + dybx.abs())
            + d1[2].abs() * (bxcy.abs() + bycx.abs());
        let bound = ORIENTATION_BOUND * permanent;
        if det.abs() > bound + ORIENTATION_UNDERFLOW || bound <= self.exact_orientation {
            return Sign::of(det);
        }
        // The usual degenerate case, points in an axis-parallel plane, needs no arithmetic.
        if (0..3).any(|k| b1[k] == 0.0 && c1[k] == 0.0 && d1[k] == 0.0) {
            return Sign::Zero;
        }
        exact::orient3d(a, b, c, d, self.grid)
    }

    /// The sign of the power test of `e` against the orthosphere of four sites.
    #[inline]
    pub(crate) fn power_test<M: Metric>(self, cell: [&Site; 4], e: &Site) -> Sign {
        let (det, bound) = Self::lifted_determinant::<M>(cell, e);
        self.resolve::<M>(det, bound, cell, e)
    }

    /// The sign of the power test from the result of [`Filter::lifted_determinant`].
    #[inline(always)]
    fn resolve<M: Metric>(self, det: f64, bound: f64, cell: [&Site; 4], e: &Site) -> Sign {
        if det.abs() > bound + UNDERFLOW || bound <= self.exact_power {
            Sign::of(det)
        } else {
            precise_power_test::<M>(det, cell, e, self.grid)
        }
    }

    /// The determinant of the power test in double precision, and a bound on its error except
    /// [`UNDERFLOW`].
    #[inline(always)]
    pub(crate) fn lifted_determinant<M: Metric>(cell: [&Site; 4], e: &Site) -> (f64, f64) {
        let (det, reach2, lift) =
            lifted_determinant::<f64, M>(cell.map(|s| (s.p, s.w)), (e.p, e.w));
        (det, IN_SPHERE_BOUND * (reach2 * reach2.sqrt()) * lift)
    }

    /// [`Filter::lifted_determinant`] for two cells at once, of about some size.
    #[inline(always)]
    pub(crate) fn lifted_determinants<M: Metric>(
        [a, b]: [[&Site; 4]; 2],
        e: &Site,
        size: Size,
    ) -> [(f64, f64); 2] {
        let pair = |i: usize| {
            let (s, t) = (a[i], b[i]);
            let x = |k: usize| Pair::new([s.p[k], t.p[k]]);
            ([x(0), x(1), x(2)], Pair::new([s.w, t.w]))
        };
        let p = e.p.map(Pair::splat);
        let (det, reach2, lift) = lifted_determinant::<Pair, M>(
            [pair(0), pair(1), pair(2), pair(3)],
            (p, Pair::splat(e.w)),
        );
        let reach = reach2 * Pair::splat(size.slope) + Pair::splat(size.half);
        let bound = Pair::splat(IN_SPHERE_BOUND) * (reach2 * reach) * lift;
        let (det, bound) = (det.to_array(), bound.to_array());
        [(det[0], bound[0]), (det[1], bound[1])]
    }
}

/// A length `s` near the distances `M` of a call, for `M <= M^2 / 2s + s / 2`: a square root for each
/// cell takes longer than the rest of the bound. Its few roundings are within the margin of
/// [`IN_SPHERE_BOUND`].
#[derive(Clone, Copy)]
pub(crate) struct Size {
    slope: f64,
    half: f64,
}

impl Size {
    /// The distance of two sites. If its square underflows, the bounds are infinite or not a number,
    /// and nothing is decided by them.
    #[inline(always)]
    pub(crate) fn of(a: &Site, b: &Site) -> Self {
        let length = norm2(difference(a.p, b.p)).sqrt();
        Self { slope: 0.5 / length, half: 0.5 * length }
    }
}

#[inline(always)]
fn difference<R: Real>(p: [R; 3], q: [R; 3]) -> [R; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

#[inline(always)]
fn norm2<R: Real>(p: [R; 3]) -> R {
    p[0] * p[0] + p[1] * p[1] + p[2] * p[2]
}

/// The determinants of three of four points each: without the first, the second, the third, the last,
/// in cyclic order.
#[inline(always)]
fn minors<R: Real>([ap, bp, cp, dp]: [[R; 3]; 4]) -> [R; 4] {
    // They share six 2 x 2 minors.
    let ab = ap[0] * bp[1] - bp[0] * ap[1];
    let bc = bp[0] * cp[1] - cp[0] * bp[1];
    let cd = cp[0] * dp[1] - dp[0] * cp[1];
    let da = dp[0] * ap[1] - ap[0] * dp[1];
    let ac = ap[0] * cp[1] - cp[0] * ap[1];
    let bd = bp[0] * dp[1] - dp[0] * bp[1];
    let abc = ap[2] * bc - bp[2] * ac + cp[2] * ab;
    let bcd = bp[2] * cd - cp[2] * bd + dp[2] * bc;
    let cda = cp[2] * da + dp[2] * ac + ap[2] * cd;
    let dab = dp[2] * ab + ap[2] * bd + bp[2] * da;
    [bcd, cda, dab, abc]
}

/// The lifted determinant of four weighted points relative to a fifth, the largest square of their
/// distances to it, and a bound on their lifts, for one cell or in lanes.
#[inline(always)]
fn lifted_determinant<R: Real, M: Metric>(
    [a, b, c, d]: [([R; 3], R); 4],
    e: ([R; 3], R),
) -> (R, R, R) {
    let (ap, bp) = (difference(a.0, e.0), difference(b.0, e.0));
    let (cp, dp) = (difference(c.0, e.0), difference(d.0, e.0));
    let [bcd, cda, dab, abc] = minors([ap, bp, cp, dp]);
    let (mut al, mut bl, mut cl, mut dl) = (norm2(ap), norm2(bp), norm2(cp), norm2(dp));
    let reach2 = al.max(bl).max(cl.max(dl));
    let mut lift = reach2;
    if M::WEIGHTED {
        let (aw, bw, cw, dw) = (e.1 - a.1, e.1 - b.1, e.1 - c.1, e.1 - d.1);
        al = al + aw;
        bl = bl + bw;
        cl = cl + cw;
        dl = dl + dw;
        lift = lift + aw.abs().max(bw.abs()).max(cw.abs().max(dw.abs()));
    }
    // Two independent pairs, as the count of roundings in the head presumes.
    let det = (al * bcd - bl * cda) + (cl * dab - dl * abc);
    (det, reach2, lift)
}

#[inline(never)]
fn precise_power_test<M: Metric>(det: f64, cell: [&Site; 4], e: &Site, grid: Option<Grid>) -> Sign {
    // On a grid the exact stage is as fast as this filter, and most calls are exact zeros.
    if grid.is_none() && det.abs() > permanent_bound::<M>(cell, e) {
        return Sign::of(det);
    }
    exact_power_test::<M>(cell, e, grid)
}

/// A bound from the permanent on the whole error of [`Filter::lifted_determinant`].
///
/// A product of degree 2 or 3 that underflows is off by `2^-1075`, and is multiplied by at most
/// three further differences or by one and a lift; all of these are below `max(1, B)^2`.
fn permanent_bound<M: Metric>(cell: [&Site; 4], e: &Site) -> f64 {
    let from_e = |i: usize| difference(cell[i].p, e.p).map(f64::abs);
    let (a, b, c, d) = (from_e(0), from_e(1), from_e(2), from_e(3));
    let minor = |u: [f64; 3], v: [f64; 3]| u[0] * v[1] + v[0] * u[1];
    let (ab, bc, cd) = (minor(a, b), minor(b, c), minor(c, d));
    let (da, ac, bd) = (minor(d, a), minor(a, c), minor(b, d));
    let lift =
        |i: usize, u: [f64; 3]| norm2(u) + if M::WEIGHTED { (e.w - cell[i].w).abs() } else { 0.0 };
    let (al, bl, cl, dl) = (lift(0, a), lift(1, b), lift(2, c), lift(3, d));
    let permanent = al * (b[2] * cd + c[2] * bd + d[2] * bc)
        + bl * (c[2] * da + d[2] * ac + a[2] * cd)
        + cl * (d[2] * ab + a[2] * bd + b[2] * da)
        + dl * (a[2] * bc + b[2] * ac + c[2] * ab);
    // At least 1, as the bound on underflow in the documentation needs.
    let reach = al.max(bl).max(cl.max(dl)).max(1.0);
    PERMANENT_BOUND * permanent + RELATIVE_UNDERFLOW * (reach * reach)
}

#[inline(never)]
fn exact_power_test<M: Metric>(s: [&Site; 4], e: &Site, grid: Option<Grid>) -> Sign {
    // Equal weights cancel: the test without weights has narrower tiers.
    if M::WEIGHTED && s.iter().any(|s| s.w != e.w) {
        exact::power_test(s.map(|s| (&s.p, s.w)), (&e.p, e.w))
    } else {
        exact::in_sphere(s.map(|s| &s.p), &e.p, grid)
    }
}

// Arithmetic on one number or two side by side, so that one formula serves both.

/// A double, or several in lanes.
trait Real: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // One instruction, unlike `f64::max`, which treats not-a-number; coordinates are finite.
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
}

/// Two doubles.
type Pair = ::wide::f64x2;

impl Real for Pair {
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.fast_max(other)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self::abs(self)
    }
}

// Symbolic perturbation of the in-sphere and power tests.
//
// O. Devillers, M. Teillaud: *Perturbations for Delaunay and weighted Delaunay 3D
// triangulations*, Computational Geometry 44 (2011), <https://doi.org/10.1016/j.comgeo.2010.09.010>.
//
// The lift of the `k`-th of `n` sites in lexicographic order grows by `eps^(n - k)`: the larger the
// site, the larger its growth. If the test is zero, its perturbed sign is that of the first non-zero
// cofactor, from the largest of the five sites downwards. The cofactor of a vertex is the
// orientation of the cell with that vertex replaced by the query. The query's own cofactor is the
// orientation of the cell, which is never zero, so there always is a result.
//
// Orientation is never perturbed, hence no cell is flat. The result is the regular triangulation of
// infinitesimally different weights: unique for any order of insertion.

/// Whether `e` is in conflict with the positively oriented cell: inside its perturbed orthosphere.
///
/// The five positions must be distinct.
#[inline]
pub(crate) fn in_conflict<M: Metric>(filter: Filter, cell: [&Site; 4], e: &Site) -> bool {
    let (det, bound) = Filter::lifted_determinant::<M>(cell, e);
    in_conflict_given::<M>(filter, det, bound, cell, e)
}

/// [`in_conflict`] with the determinant and the bound that [`Filter::lifted_determinant`] returned.
#[inline(always)]
pub(crate) fn in_conflict_given<M: Metric>(
    filter: Filter,
    det: f64,
    bound: f64,
    cell: [&Site; 4],
    e: &Site,
) -> bool {
    match filter.resolve::<M>(det, bound, cell, e) {
        Sign::Positive => true,
        Sign::Negative => false,
        Sign::Zero if bound <= filter.exact_power => perturbed_exact(cell, e),
        Sign::Zero => perturbed(filter, cell, e),
    }
}

/// [`perturbed`] where the determinant was not rounded: then its minors, the cofactors, were not
/// either, since they are shorter. Without branches, which would be unpredictable.
#[inline(never)]
fn perturbed_exact(cell: [&Site; 4], e: &Site) -> bool {
    let p = |i: usize| sub(&cell[i].p, &e.p);
    let [bcd, cda, dab, abc] = minors([p(0), p(1), p(2), p(3)]);
    let (mut largest, mut sign) = (e, 0.0);
    for (s, cofactor) in cell.into_iter().zip([bcd, -cda, dab, -abc]) {
        let decides = precedes(&largest.p, &s.p) & (cofactor != 0.0);
        largest = if decides { s } else { largest };
        sign = if decides { cofactor } else { sign };
    }
    sign > 0.0
}

#[cold]
#[inline(never)]
fn perturbed(filter: Filter, cell: [&Site; 4], e: &Site) -> bool {
    // Only vertices above the query matter, in descending order; the query ends the search.
    let mut above = [0; 4];
    let mut count = 0;
    for (i, s) in cell.iter().enumerate() {
        above[count] = i;
        count += usize::from(precedes(&e.p, &s.p));
    }
    // One step of a selection sort per cofactor, since the first usually decides.
    for rank in 0..count {
        for i in rank + 1..count {
            if precedes(&cell[above[rank]].p, &cell[above[i]].p) {
                above.swap(rank, i);
            }
        }
        let mut replaced = cell;
        replaced[above[rank]] = e;
        let [a, b, c, d] = replaced;
        match filter.orient3d(&a.p, &b.p, &c.p, &d.p) {
            Sign::Positive => return true,
            Sign::Negative => return false,
            Sign::Zero => {}
        }
    }
    // The query is next: its lift grows, which moves it out of the sphere.
    false
}

/// Whether `a` is lexicographically smaller, without branches.
#[inline(always)]
fn precedes(a: &[f64; 3], b: &[f64; 3]) -> bool {
    let z = (a[1] == b[1]) & (a[2] < b[2]);
    let y = (a[0] == b[0]) & ((a[1] < b[1]) | z);
    (a[0] < b[0]) | y
}

/// Lexicographic order of positions, none of which has a coordinate of -0.0.
#[inline]
pub(crate) fn lexicographic(a: &[f64; 3], b: &[f64; 3]) -> Ordering {
    for k in 0..3 {
        if a[k] != b[k] {
            return if a[k] < b[k] { Ordering::Less } else { Ordering::Greater };
        }
    }
    Ordering::Equal
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn perturbations_agree(p in prop::array::uniform5(prop::array::uniform3(-2..3i32))) {
            if p.iter().enumerate().any(|(i, q)| p[..i].contains(q)) {
                return Ok(());
            }
            let [a, b, c, d, e] = p.map(|p| Site { p: p.map(f64::from), w: 0.0 });
            for cell in [[&a, &b, &c, &d], [&b, &a, &c, &d]] {
                prop_assert_eq!(perturbed_exact(cell, &e), perturbed(Filter::ANY, cell, &e));
            }
        }

        #[test]
        fn bounds_of_pairs_are_no_smaller(
            p in prop::array::uniform5(prop::array::uniform3(-1.0..1.0f64)),
            length in -6..7i32,
        ) {
            let [a, b, c, d, e] = p.map(|p| Site { p, w: 0.0 });
            let far = Site { p: [e.p[0] + 10f64.powi(length), e.p[1], e.p[2]], w: 0.0 };
            let cell = [&a, &b, &c, &d];
            let (det, bound) = Filter::lifted_determinant::<Unweighted>(cell, &e);
            let size = Size::of(&e, &far);
            for pair in Filter::lifted_determinants::<Unweighted>([cell, cell], &e, size) {
                prop_assert_eq!(pair.0, det);
                prop_assert!(pair.1 >= bound * (1.0 - 1e-15));
            }
        }
    }
}
