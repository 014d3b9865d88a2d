//! Size and clearance against bordered determinants of squared distances, and across the stages.
//!
//! With `D_ij = |p_i - p_j|^2 - w_i - w_j` the barycentric coordinates `x` of the orthocentre satisfy
//! `D x = 2 rho^2 1` and `sum x = 1`, so that `rho^2` and `x` follow from Cramer's rule.

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
        power_exact::sign::<TetrahedronSize, 3>(a, [b, c, d]),
        power_exact::sign::<TriangleSize, 2>(a, [b, c]),
        power_exact::sign::<EdgeSize, 1>(a, [b]),
        power_exact::sign::<TriangleClearance, 3>(a, [b, c, e]),
        power_exact::sign::<EdgeClearance, 2>(a, [b, e]),
        power_exact::sign::<VertexClearance, 1>(a, [e]),
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
        // The other tiers: the same simplex beside a bit that widens the grid, in a weight that
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
fn nearly_touching_balls_are_told_apart() {
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
