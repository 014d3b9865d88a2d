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

use crate::predicates::exact::{Differences, WeightRange, differences, minor, to_wide, widen};
use crate::predicates::integers::Wide;
use crate::predicates::{Sign, Site, exact};

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
        .unwrap_or_else(|| exact_sign::<TetrahedronSize, 3>(o, [a, b, c]))
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
    decided(value, error, [&x, &y]).unwrap_or_else(|| exact_sign::<TriangleSize, 2>(o, [a, b]))
}

/// The size of an edge.
#[inline]
pub(crate) fn edge_size([o, a]: [&Site; 2]) -> Sign {
    let x = see(o, a);
    let value = x.lift * x.lift - 4.0 * x.square * o.w;
    let error = 18.0 * U * (x.reach * x.reach + 4.0 * x.square * o.w.abs());
    decided(value, error, [&x]).unwrap_or_else(|| exact_sign::<EdgeSize, 1>(o, [a]))
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
        .unwrap_or_else(|| exact_sign::<TriangleClearance, 3>(o, [a, b, v]))
}

/// The clearance of an edge.
#[inline]
pub(crate) fn edge_clearance([o, a]: [&Site; 2], v: &Site) -> Sign {
    let (x, z) = (see(o, a), see(o, v));
    let value = z.lift * x.square - x.lift * dot(&x.d, &z.d);
    let terms = z.reach * x.square + x.reach * (x.square * z.square).sqrt();
    decided(value, 17.0 * U * terms, [&x, &z])
        .unwrap_or_else(|| exact_sign::<EdgeClearance, 2>(o, [a, v]))
}

/// The clearance of a vertex.
#[inline]
pub(crate) fn vertex_clearance(o: &Site, v: &Site) -> Sign {
    let z = see(o, v);
    decided(z.lift, 9.0 * U * z.reach, [&z])
        .unwrap_or_else(|| exact_sign::<VertexClearance, 1>(o, [v]))
}

// The exact stage: the same polynomials in fixed-width integers.
//
// Tiers as in [`super::exact`]. The size of a tetrahedron, the longest value (degree 8), takes 8, 16
// or 160 words. In the first two tiers weights have at most 122 and 250 bits in units of the squared
// quantum. So a lift has at most 125 and 254 bits, and no sum below reaches its sign bit.

/// A polynomial in `K` differences `d` to an origin of weight `w`, and the lifts `l`. The widths
/// are in words, named by degree.
trait Form<const K: usize> {
    fn sign<
        const D: usize,
        const D2: usize,
        const D3: usize,
        const D4: usize,
        const D6: usize,
        const D8: usize,
    >(
        d: &[[Wide<D>; 3]; K],
        l: &[Wide<D2>; K],
        w: Wide<D2>,
    ) -> Sign;
}

/// The sign of a form of the differences of `others` to `origin`.
#[cold]
#[inline(never)]
fn exact_sign<F: Form<K>, const K: usize>(origin: &Site, others: [&Site; K]) -> Sign {
    let weights = others.map(|s| s.w);
    let range = WeightRange::of(&weights).with(origin.w);
    let (d, quantum) = differences(others.map(|s| &s.p), &origin.p, range.quantum_cap());
    let unit = 2 * quantum;
    let w = (origin.w, weights);
    match range.tier(d, unit) {
        Differences::One(d) => evaluate::<F, K, 1, 2, 3, 4, 6, 8>(&widen(&d), w, unit),
        Differences::Two(d) => evaluate::<F, K, 2, 4, 6, 8, 12, 16>(&d, w, unit),
        Differences::Any(d) => evaluate::<F, K, 20, 40, 60, 80, 120, 160>(&d, w, unit),
    }
}

fn evaluate<
    F: Form<K>,
    const K: usize,
    const D: usize,
    const D2: usize,
    const D3: usize,
    const D4: usize,
    const D6: usize,
    const D8: usize,
>(
    d: &[[Wide<D>; 3]; K],
    (w, weights): (f64, [f64; K]),
    unit: i32,
) -> Sign {
    // One unit for weights and squares, so that lifts are sums of integers.
    let w: Wide<D2> = to_wide(w, unit);
    let mut l = [w; K];
    for i in 0..K {
        l[i] = exact::dot::<D, D2>(&d[i], &d[i]).add(w).sub(to_wide(weights[i], unit));
    }
    F::sign::<D, D2, D3, D4, D6, D8>(d, &l, w)
}

#[inline]
fn cross_wide<const D: usize, const D2: usize>(
    a: &[Wide<D>; 3],
    b: &[Wide<D>; 3],
) -> [Wide<D2>; 3] {
    [[1, 2], [2, 0], [0, 1]].map(|[y, z]| minor(&[a[y], a[z], a[y]], &[b[y], b[z], b[y]]))
}

#[inline]
fn twice<const N: usize>(a: Wide<N>) -> Wide<N> {
    a.add(a)
}

/// A form by its polynomial, in which the widths of integers are in scope by degree.
macro_rules! form {
    ($name:ident, $k:literal, |$d:pat_param, $l:pat_param, $w:pat_param| $value:expr) => {
        struct $name;

        impl Form<$k> for $name {
            fn sign<
                const D: usize,
                const D2: usize,
                const D3: usize,
                const D4: usize,
                const D6: usize,
                const D8: usize,
            >(
                $d: &[[Wide<D>; 3]; $k],
                $l: &[Wide<D2>; $k],
                $w: Wide<D2>,
            ) -> Sign {
                $value.sign()
            }
        }
    };
}

form!(TetrahedronSize, 3, |[a, b, c], l, w| {
    let normals: [[Wide<D2>; 3]; 3] = [cross_wide(b, c), cross_wide(c, a), cross_wide(a, b)];
    let n: [Wide<D4>; 3] =
        [0, 1, 2].map(|k| exact::dot(&[normals[0][k], normals[1][k], normals[2][k]], l));
    let n2: Wide<D8> = exact::dot(&n, &n);
    let [x, y, z] = [0, 1, 2].map(|k| normals[0][k].mul::<D, D3>(a[k]));
    let det = x.add(y).add(z);
    let det2: Wide<D6> = det.mul(det);
    n2.sub(det2.mul(twice(twice(w))))
});

form!(TriangleSize, 2, |[a, b], [l, m], w| {
    let (aa, bb, ab): (Wide<D2>, Wide<D2>, Wide<D2>) =
        (exact::dot(a, a), exact::dot(b, b), exact::dot(a, b));
    let nu: Wide<D4> = aa.mul::<D2, D4>(bb).sub(ab.mul(ab));
    let squares: Wide<D6> = l.mul::<D2, D4>(*l).mul::<D2, D6>(bb).add(m.mul::<D2, D4>(*m).mul(aa));
    let mixed: Wide<D6> = l.mul::<D2, D4>(*m).mul(ab);
    let size: Wide<D6> = squares.sub(twice(mixed)).sub(nu.mul(twice(twice(w))));
    size
});

form!(EdgeSize, 1, |[a], [l], w| {
    let aa: Wide<D2> = exact::dot(a, a);
    l.mul::<D2, D4>(*l).sub(aa.mul(twice(twice(w))))
});

form!(TriangleClearance, 3, |[a, b, v], [l, m, lv], _| {
    let (aa, bb, ab): (Wide<D2>, Wide<D2>, Wide<D2>) =
        (exact::dot(a, a), exact::dot(b, b), exact::dot(a, b));
    let (av, bv): (Wide<D2>, Wide<D2>) = (exact::dot(a, v), exact::dot(b, v));
    let nu: Wide<D4> = aa.mul::<D2, D4>(bb).sub(ab.mul(ab));
    let along_a: Wide<D4> = l.mul::<D2, D4>(bb).sub(m.mul(ab));
    let along_b: Wide<D4> = m.mul::<D2, D4>(aa).sub(l.mul(ab));
    nu.mul::<D2, D6>(*lv).sub(along_a.mul(av)).sub(along_b.mul(bv))
});

form!(EdgeClearance, 2, |[a, v], [l, lv], _| {
    let (aa, av): (Wide<D2>, Wide<D2>) = (exact::dot(a, a), exact::dot(a, v));
    lv.mul::<D2, D4>(aa).sub(l.mul(av))
});

form!(VertexClearance, 1, |_, [lv], _| lv);

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Laplace expansion of a determinant of small integers.
    fn determinant(m: &[Vec<i128>]) -> i128 {
        if m.is_empty() {
            return 1;
        }
        (0..m.len())
            .map(|k| {
                let minor: Vec<Vec<i128>> = m[1..]
                    .iter()
                    .map(|row| row.iter().enumerate().filter(|e| e.0 != k).map(|e| *e.1).collect())
                    .collect();
                let sign = if k % 2 == 0 { 1 } else { -1 };
                if m[0][k] == 0 { 0 } else { sign * m[0][k] * determinant(&minor) }
            })
            .sum()
    }

    type IntegerSite = ([i32; 3], i32);

    fn entry(a: IntegerSite, b: IntegerSite) -> i128 {
        let squares = [0, 1, 2].map(|k| i128::from(a.0[k] - b.0[k]).pow(2));
        squares.iter().sum::<i128>() - i128::from(a.1) - i128::from(b.1)
    }

    /// The bordered matrix of a simplex.
    fn bordered(s: &[IntegerSite]) -> Vec<Vec<i128>> {
        let mut rows = vec![std::iter::once(0).chain(s.iter().map(|_| 1)).collect::<Vec<_>>()];
        rows.extend(
            s.iter().map(|&a| std::iter::once(1).chain(s.iter().map(|&b| entry(a, b))).collect()),
        );
        rows
    }

    /// The size; `None` for a degenerate simplex.
    fn oracle_size(s: &[IntegerSite]) -> Option<Sign> {
        let matrix = bordered(s);
        let whole = determinant(&matrix);
        let inner: Vec<Vec<i128>> = matrix[1..].iter().map(|row| row[1..].to_vec()).collect();
        // -2 rho^2 = det D / det of the bordered matrix.
        (whole != 0).then(|| Sign::of(-((determinant(&inner) * whole).signum() as f64)))
    }

    /// The clearance from `v`.
    fn oracle_clearance(s: &[IntegerSite], v: IntegerSite) -> Option<Sign> {
        let matrix = bordered(s);
        let whole = determinant(&matrix);
        // The unknowns (-2 rho^2, x) against the row (1, D_v): |o - v|^2 - w_v - rho^2.
        let row: Vec<i128> = std::iter::once(1).chain(s.iter().map(|&a| entry(a, v))).collect();
        let numerator: i128 = (0..matrix.len())
            .map(|k| {
                let mut replaced = matrix.clone();
                for (i, r) in replaced.iter_mut().enumerate() {
                    r[k] = i128::from(i == 0);
                }
                row[k] * determinant(&replaced)
            })
            .sum();
        (whole != 0).then(|| Sign::of((numerator * whole.signum()).signum() as f64))
    }

    /// Where integers go: in units of `scale`, moved by `shift`; both leave the signs as they are.
    fn placed((p, w): IntegerSite, scale: f64, shift: f64) -> Site {
        Site { p: p.map(|x| (f64::from(x) + shift) * scale), w: f64::from(w) * scale * scale }
    }

    /// All signs of a list of five sites: sizes of tetrahedron, triangle, edge, and clearances.
    fn signs(s: &[Site; 5]) -> [Sign; 6] {
        let [a, b, c, d, e] = s;
        [
            tetrahedron_size([a, b, c, d]),
            triangle_size([a, b, c]),
            edge_size([a, b]),
            triangle_clearance([a, b, c], e),
            edge_clearance([a, b], e),
            vertex_clearance(a, e),
        ]
    }

    fn exact_signs(s: &[Site; 5]) -> [Sign; 6] {
        let [a, b, c, d, e] = s;
        [
            exact_sign::<TetrahedronSize, 3>(a, [b, c, d]),
            exact_sign::<TriangleSize, 2>(a, [b, c]),
            exact_sign::<EdgeSize, 1>(a, [b]),
            exact_sign::<TriangleClearance, 3>(a, [b, c, e]),
            exact_sign::<EdgeClearance, 2>(a, [b, e]),
            exact_sign::<VertexClearance, 1>(a, [e]),
        ]
    }

    fn integer_site() -> impl Strategy<Value = IntegerSite> {
        (prop::array::uniform3(-4..5i32), -3..20i32)
    }

    fn wild_site() -> impl Strategy<Value = Site> {
        let p = prop_oneof![
            prop::array::uniform3(-4..5i32).prop_map(|p| p.map(f64::from)),
            prop::array::uniform3(-1.0..1.0f64),
            (prop::array::uniform3(-4..5i32), -70..-20i32)
                .prop_map(|(p, e)| p.map(|x| f64::from(x) + 2f64.powi(e))),
            (prop::array::uniform3(-1.0..1.0f64), -120..60i32)
                .prop_map(|(p, e)| p.map(|x| x * 2f64.powi(e))),
        ];
        let w = prop_oneof![
            (-3..20i32).prop_map(f64::from),
            (0.0..2.0f64).prop_map(|r| r * r),
            (0.0..2.0f64, -400..100i32).prop_map(|(w, e)| w * 2f64.powi(e)),
        ];
        (p, w).prop_map(|(p, w)| Site { p, w })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn integers_agree_with_bordered_determinants(s in prop::array::uniform5(integer_site())) {
            let oracle = [
                oracle_size(&s[..4]),
                oracle_size(&s[..3]),
                oracle_size(&s[..2]),
                oracle_clearance(&s[..3], s[4]),
                oracle_clearance(&s[..2], s[4]),
                oracle_clearance(&s[..1], s[4]),
            ];
            // Exact doubles near one and near 2^40; then such that filters must fail.
            for (scale, shift) in [(1.0, 0.0), (0.25, 3e12), (f64::powi(2.0, 90), 0.0), (f64::powi(2.0, -150), 1.0)] {
                let moved = s.map(|s| placed(s, scale, shift));
                for (found, expected) in
                    [signs(&moved), exact_signs(&moved)].iter().flat_map(|f| f.iter().zip(&oracle))
                {
                    if let Some(expected) = expected {
                        prop_assert_eq!(found, expected);
                    }
                }
            }
        }

        #[test]
        fn filters_agree_with_the_exact_stage(s in prop::array::uniform5(wild_site())) {
            prop_assert_eq!(signs(&s), exact_signs(&s));
            // The other tiers: the same simplex with a bit that widens the grid, in a weight that
            // no sign depends on, is covered by the wild exponents; powers of two change nothing.
            let larger = s.map(|s| Site { p: s.p.map(|x| x * 1024.0), w: s.w * 1048576.0 });
            prop_assert_eq!(exact_signs(&larger), exact_signs(&s));
        }

        #[test]
        fn the_origin_of_the_call_does_not_matter(s in prop::array::uniform5(wild_site())) {
            let [a, b, c, d, e] = &s;
            prop_assert_eq!(edge_size([a, b]), edge_size([b, a]));
            prop_assert_eq!(triangle_size([a, b, c]), triangle_size([c, a, b]));
            prop_assert_eq!(tetrahedron_size([a, b, c, d]), tetrahedron_size([d, b, a, c]));
            if a.p != b.p {
                prop_assert_eq!(edge_clearance([a, b], e), edge_clearance([b, a], e));
            }
            let [p, q, r] = [a, b, c].map(|s| crate::Vec3::from_array(s.p));
            if !crate::predicates::collinear(p, q, r) {
                prop_assert_eq!(triangle_clearance([a, b, c], e), triangle_clearance([b, c, a], e));
            }
        }
    }

    #[test]
    fn nearly_touching_balls_are_distinguished() {
        // Two unit balls at distance 2 touch; one bit further apart they do not.
        let at = |x: f64| Site { p: [x, 0.0, 0.0], w: 1.0 };
        assert_eq!(edge_size([&at(0.0), &at(2.0)]), Sign::Zero);
        assert_eq!(edge_size([&at(0.0), &at(2.0f64.next_up())]), Sign::Positive);
        assert_eq!(edge_size([&at(0.0), &at(2.0f64.next_down())]), Sign::Negative);
        // The widest tier.
        let far = Site { p: [1e57, 1.0, 0.0], w: 5e-324 };
        assert_eq!(edge_size([&far, &at(-1.0)]), Sign::Positive);
        assert_eq!(
            vertex_clearance(&at(0.0), &Site { p: [0.0; 3], w: 1.0f64.next_up() }),
            Sign::Negative
        );
    }
}
