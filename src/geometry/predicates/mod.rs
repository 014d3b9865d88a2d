//! Exact geometric predicates: signs that no rounding can turn.
//!
//! Each predicate is first evaluated in double precision with a bound on its rounding error; where
//! the bound does not decide, integers wide enough to hold the exact value do.
//!
//! # Signs
//! [`orient3d`]`(a, b, c, d)` is the sign of `det(b - a, c - a, d - a)`, positive if `d` sees
//! `a, b, c` counter-clockwise. [`in_sphere`] is positive for a point inside the circumsphere of a
//! positively oriented tetrahedron. Both are CGAL's (`orientation`, `side_of_oriented_sphere`) and
//! opposite to Shewchuk's (`orient3d`, `insphere`), whose positive tetrahedron is our negative one.
//!
//! # Ties
//! The functions here return [`Sign::Zero`] where points are coplanar or cospherical: nothing is
//! perturbed. The triangulations break these ties by a symbolic perturbation of their own.
//!
//! # Range
//! Nothing is checked. A sign means something for finite coordinates of at most
//! [`MAX_COORDINATE`] in absolute value, however small. For others, NaN among them, any sign may
//! come out, or the call panics. The triangulations refuse such points with an error.

mod exact;
mod filter;
mod integers;
mod planar;
mod power_size;

use crate::Vec3;

pub(crate) use crate::predicates::exact::{collinear as sites_collinear, highest_bit, lowest_bit};
pub(crate) use crate::predicates::filter::{
    Filter, Metric, Site, Size, UNDERFLOW, Unweighted, Weighted, approximate_orientation,
    in_conflict, in_conflict_given, lexicographic,
};
pub use crate::predicates::planar::{Point2, orient2d, project, projection_axis};
pub(crate) use crate::predicates::power_size::{
    edge_clearance, edge_size, tetrahedron_size, triangle_clearance, triangle_size,
    vertex_clearance,
};

/// The largest absolute value of a coordinate for which no product in a predicate overflows; the
/// largest that a triangulation takes.
pub const MAX_COORDINATE: f64 = 1e57;

/// The sign of an exactly evaluated expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sign {
    /// Below zero.
    Negative = -1,
    /// Exactly zero.
    Zero = 0,
    /// Above zero.
    Positive = 1,
}

impl Sign {
    /// The sign of a value; not a number counts as zero.
    #[inline]
    pub fn of(x: f64) -> Self {
        if x > 0.0 {
            Self::Positive
        } else if x < 0.0 {
            Self::Negative
        } else {
            Self::Zero
        }
    }

    /// Whether it is zero.
    pub fn is_zero(self) -> bool {
        self == Self::Zero
    }

    /// -1, 0 or 1.
    pub fn value(self) -> i32 {
        self as i32
    }

    /// Whether the two are strictly on opposite sides.
    pub fn opposes(self, other: Self) -> bool {
        self.value() * other.value() < 0
    }
}

impl std::ops::Neg for Sign {
    type Output = Self;

    fn neg(self) -> Self {
        match self {
            Self::Negative => Self::Positive,
            Self::Zero => Self::Zero,
            Self::Positive => Self::Negative,
        }
    }
}

/// The side of the plane `a, b, c` on which `d` lies: positive if `d` sees them counter-clockwise,
/// zero if the four points are coplanar. The sign is CGAL's, and opposite to Shewchuk's.
///
/// Exact for finite coordinates of at most [`MAX_COORDINATE`]; of others (1e300, infinity, NaN)
/// the sign means nothing, and the call may panic.
///
/// ```
/// use medial_geometry::Vec3;
/// use medial_geometry::predicates::{Sign, orient3d};
///
/// assert_eq!(orient3d(Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z), Sign::Positive);
/// assert_eq!(orient3d(Vec3::ZERO, Vec3::Y, Vec3::X, Vec3::Z), Sign::Negative);
/// assert_eq!(orient3d(Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X + Vec3::Y), Sign::Zero);
/// ```
#[inline]
pub fn orient3d(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> Sign {
    Filter::ANY.orient3d(&a.to_array(), &b.to_array(), &c.to_array(), &d.to_array())
}

/// Whether three points lie on one line, exactly: for finite coordinates of at most
/// [`MAX_COORDINATE`]. For others the result has no meaning, and the call may panic.
pub fn collinear(a: Vec3, b: Vec3, c: Vec3) -> bool {
    exact::collinear(&a.to_array(), &b.to_array(), &c.to_array())
}

/// The side of the circumsphere of `a, b, c, d` on which `e` lies: positive inside, zero on it,
/// if [`orient3d`]`(a, b, c, d)` is positive, and the opposite sign if it is negative. The sign is
/// CGAL's, and opposite to Shewchuk's. Coplanar `a, b, c, d` have no sphere, and then the sign
/// means nothing.
///
/// Exact for finite coordinates of at most [`MAX_COORDINATE`]; of others (1e300, infinity, NaN)
/// the sign means nothing, and the call may panic.
///
/// ```
/// use medial_geometry::Vec3;
/// use medial_geometry::predicates::{Sign, in_sphere};
///
/// let [a, b, c, d] = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]; // positively oriented
/// assert_eq!(in_sphere(a, b, c, d, Vec3::splat(0.5)), Sign::Positive);
/// assert_eq!(in_sphere(a, b, c, d, Vec3::splat(1.0)), Sign::Zero);
/// assert_eq!(in_sphere(a, b, c, d, Vec3::splat(1.5)), Sign::Negative);
/// ```
#[inline]
pub fn in_sphere(a: Vec3, b: Vec3, c: Vec3, d: Vec3, e: Vec3) -> Sign {
    let [a, b, c, d, e] = [a, b, c, d, e].map(|p| Site { p: p.to_array(), w: 0.0 });
    Filter::ANY.power_test::<Unweighted>([&a, &b, &c, &d], &e)
}

/// The in-sphere test of weighted points `(p, w)` with the power distance `|x - p|^2 - w`:
/// positive if the power of `e` to the orthosphere of the positively oriented `a, b, c, d` is
/// negative, that is if `e` does not allow them to be a cell of the regular triangulation.
///
/// Zero if that power is zero; the opposite sign for negatively oriented points, and none that
/// means anything for coplanar ones.
///
/// Exact, the lift `|p|^2 - w` included, for finite coordinates of at most [`MAX_COORDINATE`] and
/// finite weights of at most its square; of others the sign means nothing, and the call may panic.
pub fn power_test(
    a: (Vec3, f64),
    b: (Vec3, f64),
    c: (Vec3, f64),
    d: (Vec3, f64),
    e: (Vec3, f64),
) -> Sign {
    let [a, b, c, d, e] = [a, b, c, d, e].map(|(p, w)| Site { p: p.to_array(), w });
    Filter::ANY.power_test::<Weighted>([&a, &b, &c, &d], &e)
}

// Circumspheres and orthospheres of four points.

/// The centre and radius of the sphere through four points; `None` if they are coplanar or the
/// centre is not representable.
///
/// Computed in double precision relative to `p[0]`. If the distances to the four points then differ
/// from the radius by more than `1e-6` of it, or the cell is nearly flat, it is computed again with
/// exact numerators and denominator. The unit is that of the points, whose coordinates must be
/// finite and at most [`MAX_COORDINATE`]: with others the call may panic.
pub fn circumsphere(p: [Vec3; 4]) -> Option<(Vec3, f64)> {
    let (offset, _) = relative_orthocentre(p, [0.0; 4])?;
    Some((p[0] + offset, norm(offset)))
}

/// The orthocentre `o` of four weighted points `(p, w)` and its power `|o - p|^2 - w`, which is the
/// same for all four and may be negative; `None` if the points are coplanar or the centre is not
/// representable.
///
/// As robust as [`circumsphere`], to which it reduces for zero weights.
pub fn orthosphere(p: [Vec3; 4], w: [f64; 4]) -> Option<(Vec3, f64)> {
    let (offset, power) = relative_orthocentre(p, w)?;
    Some((p[0] + offset, power))
}

/// The orthocentre minus `p[0]`, and its power.
fn relative_orthocentre(p: [Vec3; 4], w: [f64; 4]) -> Option<(Vec3, f64)> {
    let d = [p[1] - p[0], p[2] - p[0], p[3] - p[0]];
    let lift = [0, 1, 2].map(|i| d[i].length_squared() + (w[0] - w[i + 1]));
    let normals = [d[1].cross(d[2]), d[2].cross(d[0]), d[0].cross(d[1])];
    let det = d[0].dot(normals[0]);
    let offset = (lift[0] * normals[0] + lift[1] * normals[1] + lift[2] * normals[2]) / (2.0 * det);
    let power = offset.length_squared() - w[0];
    if is_trustworthy(&d, w, det, offset, power) {
        return Some((offset, power));
    }
    let q = p.map(|p| p.to_array());
    let exact = exact::orthocentre([0, 1, 2, 3].map(|i| (&q[i], w[i])))?;
    let offset = Vec3::from_array(exact);
    offset.is_finite().then(|| (offset, offset.length_squared() - w[0]))
}

/// `|v|` without underflow or overflow on the way.
fn norm(v: Vec3) -> f64 {
    let largest = v.abs().max_element();
    // Squares of these are normal numbers.
    if (1e-140..1e140).contains(&largest) || largest == 0.0 {
        v.length()
    } else {
        largest * (v / largest).length()
    }
}

/// Whether the solution passes the residual test and its determinant is well above rounding error.
fn is_trustworthy(d: &[Vec3; 3], w: [f64; 4], det: f64, offset: Vec3, power: f64) -> bool {
    let reach = d[0].length() * d[1].length() * d[2].length();
    if det.abs() <= 1e-9 * reach || !offset.is_finite() {
        return false;
    }
    let scale = offset.length_squared() + w[0].abs();
    d.iter().zip(&w[1..]).all(|(&d, &w)| {
        ((offset - d).length_squared() - w - power).abs() <= 2e-6 * (scale + w.abs())
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn robust(p: Vec3) -> ::robust::Coord3D<f64> {
        ::robust::Coord3D { x: p.x, y: p.y, z: p.z }
    }

    /// In `robust` a point below the plane is positive, and the in-sphere test has the matching sign: both
    /// are the negatives of ours.
    fn oracle_orient3d(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> Sign {
        -Sign::of(::robust::orient3d(robust(a), robust(b), robust(c), robust(d)))
    }

    fn oracle_in_sphere(p: [Vec3; 4], e: Vec3) -> Sign {
        let [a, b, c, d] = p.map(robust);
        -Sign::of(::robust::insphere(a, b, c, d, robust(e)))
    }

    /// Points of many kinds: grids, spheres, planes, ranges of exponents, single-bit noise.
    fn point() -> impl Strategy<Value = Vec3> {
        let small = -4..5i32;
        prop_oneof![
            [small.clone(), small.clone(), small.clone()]
                .prop_map(|c| Vec3::from(c.map(f64::from))),
            [small.clone(), small.clone(), small.clone()]
                .prop_map(|c| Vec3::from(c.map(|x| f64::from(x) / 100.0))),
            [-1.0..1.0f64, -1.0..1.0, -1.0..1.0].prop_map(|c| Vec3::from(c).normalize_or_zero()),
            [-1.0..1.0f64, -1.0..1.0, -1.0..1.0].prop_map(Vec3::from),
            ([small.clone(), small.clone(), small], -60..60i32).prop_map(|(c, e)| {
                Vec3::from(c.map(f64::from)) + Vec3::splat(2f64.powi(e - 52))
            }),
            ([-1.0..1.0f64, -1.0..1.0, -1.0..1.0], -30..30i32)
                .prop_map(|(c, e)| Vec3::from(c) * 2f64.powi(e)),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn orientation_agrees_with_expansions(a in point(), b in point(), c in point(), d in point()) {
            prop_assert_eq!(orient3d(a, b, c, d), oracle_orient3d(a, b, c, d));
            prop_assert_eq!(orient3d(b, a, c, d), -orient3d(a, b, c, d));
        }

        #[test]
        fn in_sphere_agrees_with_expansions(
            a in point(), b in point(), c in point(), d in point(), e in point(),
        ) {
            let sign = in_sphere(a, b, c, d, e);
            prop_assert_eq!(sign, oracle_in_sphere([a, b, c, d], e));
            prop_assert_eq!(in_sphere(b, c, a, d, e), sign);
            prop_assert_eq!(in_sphere(b, a, c, d, e), -sign);
            // Equal weights cancel.
            let w = 0.1;
            prop_assert_eq!(power_test((a, w), (b, w), (c, w), (d, w), (e, w)), sign);
        }

        #[test]
        fn stages_agree(p in prop::array::uniform5(point()), w in prop::array::uniform5(-3..4i32)) {
            // The exact stage alone, of scaled integers and their quarter: the sign may not change.
            let site = |i: usize, unit: f64| (p[i].to_array(), f64::from(w[i]) * unit);
            for unit in [0.0, 0.25, 0.1] {
                let s = [0, 1, 2, 3, 4].map(|i| site(i, unit));
                let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|i| Site { p: s[i].0, w: s[i].1 });
                let filtered = Filter::ANY.power_test::<Weighted>([&a, &b, &c, &d], &e);
                let exact =
                    exact::power_test([0, 1, 2, 3].map(|i| (&s[i].0, s[i].1)), (&s[4].0, s[4].1));
                prop_assert_eq!(filtered, exact);
            }
        }

        #[test]
        fn circumspheres_pass_through_their_points(p in prop::array::uniform4(point())) {
            let flat = orient3d(p[0], p[1], p[2], p[3]) == Sign::Zero;
            match circumsphere(p) {
                None => prop_assert!(flat),
                Some((centre, radius)) => {
                    prop_assert!(!flat);
                    let reach = p.iter().fold(radius, |r, p| r.max(p.length()));
                    for q in p {
                        prop_assert!(((q - centre).length() - radius).abs() <= 1e-6 * reach);
                    }
                }
            }
        }
    }

    #[test]
    fn orientation_and_side_have_the_documented_signs() {
        let (o, x, y, z) = (Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z);
        assert_eq!(orient3d(o, x, y, z), Sign::Positive);
        assert_eq!(in_sphere(o, x, y, z, Vec3::splat(0.5)), Sign::Positive);
        assert_eq!(in_sphere(o, x, y, z, Vec3::splat(1.0)), Sign::Zero);
        assert_eq!(in_sphere(o, x, y, z, Vec3::splat(1.5)), Sign::Negative);
        assert_eq!(in_sphere(x, o, y, z, Vec3::splat(0.5)), Sign::Negative);
        // A heavier query is inside sooner, a lighter one later.
        let weigh = |w| power_test((o, 0.0), (x, 0.0), (y, 0.0), (z, 0.0), (Vec3::ONE, w));
        assert_eq!([weigh(1e-300), weigh(0.0), weigh(-1e-300)].map(|s| s as i32), [1, 0, -1]);
    }

    #[test]
    fn extreme_ranges_are_exact() {
        // Coordinates of 1e-300 next to others of 1e57 need the widest tier.
        let (big, tiny) = (1e57, 5e-324);
        let (o, x, y) = (Vec3::ZERO, Vec3::new(big, 0.0, 0.0), Vec3::new(0.0, big, 0.0));
        assert_eq!(orient3d(o, x, y, Vec3::new(1.0, 1.0, tiny)), Sign::Positive);
        assert_eq!(orient3d(o, x, y, Vec3::new(1.0, 1.0, -tiny)), Sign::Negative);
        let z = Vec3::new(0.0, 0.0, big);
        let corner = Vec3::splat(big);
        assert_eq!(in_sphere(o, x, y, z, corner), Sign::Zero);
        // Two chords through one point: as the corner at the origin moves in, the other end moves out.
        assert_eq!(in_sphere(Vec3::new(tiny, tiny, tiny), x, y, z, corner), Sign::Positive);
        assert_eq!(in_sphere(Vec3::new(-tiny, -tiny, -tiny), x, y, z, corner), Sign::Negative);
        // Everything underflows in double precision.
        let small = 1e-200;
        let [a, b, c, d] = [o, Vec3::X * small, Vec3::Y * small, Vec3::Z * small];
        assert_eq!(orient3d(a, b, c, d), Sign::Positive);
        assert_eq!(in_sphere(a, b, c, d, Vec3::splat(0.9 * small)), Sign::Positive);
        let (centre, radius) = circumsphere([a, b, c, d]).expect("not flat");
        assert!((centre / small - Vec3::splat(0.5)).abs().max_element() < 1e-15);
        assert!(radius > 0.0);
    }

    #[test]
    fn circumcentres_of_slivers_are_exact() {
        // Four points of a unit circle, one lifted by 2^-50: the centre is on the axis, at
        // half the lift plus the determinant's part, computed here in closed form.
        let h = f64::powi(2.0, -50);
        let p = [Vec3::X, Vec3::Y, -Vec3::X, Vec3::new(0.0, -1.0, h)];
        let (centre, radius) = circumsphere(p).expect("not flat");
        assert_eq!(centre, Vec3::new(0.0, 0.0, h / 2.0));
        assert_eq!(radius, 1.0);
    }

    #[test]
    fn huge_coordinates_next_to_tiny_ones_have_the_sign_of_the_exact_stage() {
        // Products of two tiny coordinates underflow, and a huge one multiplies the loss.
        let huge = 2.944_495_945_799_024_7e47;
        let tiny = 9.704_187_067_161_276e-101;
        let p = [
            Vec3::ZERO,
            Vec3::new(0.0, -huge, -1.000_000_5 * huge),
            Vec3::new(0.0, tiny, tiny),
            Vec3::new(1.29e-231, 0.0, 0.0),
        ];
        assert_eq!(orient3d(p[0], p[1], p[2], p[3]), Sign::Positive);
        assert_eq!(orient3d(p[0], p[2], p[1], p[3]), Sign::Negative);
        // A difference that underflows in units of the largest one is not 0.
        let p = [
            Vec3::new(0.0, 0.0, 5.703_928_001_733_1e-310),
            Vec3::new(1.112_553_905_479_973e-308, -2.923_003_275_003_422_6e48, 0.0),
            Vec3::ZERO,
            Vec3::new(0.0, 1.295_163e-318, 0.0),
        ];
        assert_eq!(orient3d(p[0], p[1], p[2], p[3]), orient3d(p[3], p[2], p[1], p[0]));
        assert_eq!(orient3d(p[0], p[1], p[2], p[3]), Sign::Positive);
        let exponents = [-320, -231, -160, -101, -60, -30, -5, 0, 20, 47, 56];
        let mut state = 1_u64;
        let mut next = |bound: u64| {
            state = crate::hash::splitmix(state);
            state % bound
        };
        for _ in 0..5_000 {
            let mut coordinate = || -> f64 {
                // Few mantissas, so that leading terms cancel.
                let mantissa = [0.0, 1.0, -1.0, 1.5, 1.000_000_5][next(5) as usize];
                mantissa * 10_f64.powi(exponents[next(11) as usize])
            };
            let mut point = || [coordinate(), coordinate(), coordinate()];
            let [a, b, c, d, e] = [point(), point(), point(), point(), point()];
            let filtered = Filter::ANY.orient3d(&a, &b, &c, &d);
            assert_eq!(filtered, exact::orient3d(&a, &b, &c, &d, None), "{a:?} {b:?} {c:?} {d:?}");
            let weights = [0, 1, 2, 3, 4].map(|_| coordinate().powi(2));
            let site = |p: [f64; 3], k: usize| Site { p, w: weights[k] };
            let [s, t, u, v, w] = [site(a, 0), site(b, 1), site(c, 2), site(d, 3), site(e, 4)];
            let filtered = Filter::ANY.power_test::<Unweighted>([&s, &t, &u, &v], &w);
            let expected = exact::in_sphere([&a, &b, &c, &d], &e, None);
            assert_eq!(filtered, expected, "{a:?} {b:?} {c:?} {d:?} {e:?}");
            let filtered = Filter::ANY.power_test::<Weighted>([&s, &t, &u, &v], &w);
            let sites = [&s, &t, &u, &v].map(|s| (&s.p, s.w));
            let expected = exact::power_test(sites, (&e, w.w));
            assert_eq!(filtered, expected, "{a:?} {b:?} {c:?} {d:?} {e:?}, {weights:?}");
        }
    }
}
