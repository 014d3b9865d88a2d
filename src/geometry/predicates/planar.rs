//! Orientation in the coordinate planes.
//!
//! Shewchuk's adaptive predicate (10.1007/PL00009321; the crate `robust`).

use super::Sign;
use crate::Vec3;

/// A point of a coordinate plane.
pub type Point2 = [f64; 2];

/// Positive when `a, b, c` turn to the left, zero when they lie on one line.
///
/// Exact for finite coordinates of which products of two neither overflow nor underflow; of others
/// the sign means nothing. It is Shewchuk's, and CGAL's.
#[inline]
pub fn orient2d(a: Point2, b: Point2, c: Point2) -> Sign {
    // Shewchuk's first stage, inlined: nearly every call ends here.
    let left = (a[0] - c[0]) * (b[1] - c[1]);
    let right = (a[1] - c[1]) * (b[0] - c[0]);
    let det = left - right;
    if det.abs() > FILTER_2D * (left.abs() + right.abs()) {
        return Sign::of(det);
    }
    orient2d_exact(a, b, c)
}

/// (3 + 16 u) u with the unit roundoff u = 2^-53, rounded up.
const FILTER_2D: f64 = 3.330_669_073_875_472e-16;

#[cold]
fn orient2d_exact(a: Point2, b: Point2, c: Point2) -> Sign {
    let [a, b, c] = [a, b, c].map(|[x, y]| robust::Coord { x, y });
    Sign::of(robust::orient2d(a, b, c))
}

/// The point without its coordinate `axis`. The order of the other two is such that a triangle whose
/// normal has a positive component along `axis` turns left.
#[inline]
pub fn project(p: Vec3, axis: usize) -> Point2 {
    match axis {
        0 => [p.y, p.z],
        1 => [p.z, p.x],
        _ => [p.x, p.y],
    }
}

/// A coordinate axis along which the projection of the triangle is not degenerate, and the sense of
/// rotation of the projection; `None` for exactly collinear corners.
pub fn projection_axis([a, b, c]: [Vec3; 3]) -> Option<(usize, Sign)> {
    let normal = (b - a).cross(c - a).abs();
    // The axis with the largest component first: the projection is then far from degenerate.
    let mut axes = [0, 1, 2];
    axes.sort_by(|&i, &j| normal[j].total_cmp(&normal[i]));
    axes.into_iter().find_map(|axis| {
        let turn = orient2d(project(a, axis), project(b, axis), project(c, axis));
        (!turn.is_zero()).then_some((axis, turn))
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::orient3d;
    use super::*;

    #[test]
    fn signs_follow_their_documentation() {
        let [a, b, c] = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(orient2d([0.0, 0.0], [1.0, 0.0], [0.0, 1.0]), Sign::Positive);
        assert_eq!(orient3d(a, b, c, Vec3::Z), Sign::Positive);
        for axis in 0..3 {
            let rotated = [a, b, c].map(|p| match axis {
                0 => Vec3::new(p.z, p.x, p.y),
                1 => Vec3::new(p.y, p.z, p.x),
                _ => p,
            });
            assert_eq!(projection_axis(rotated), Some((axis, Sign::Positive)));
        }
        assert_eq!(projection_axis([a, b, b * 2.0]), None);
    }

    proptest! {
        /// Against integers of 128 bits, near degeneracy: points of a line or plane, moved a step.
        #[test]
        fn signs_agree_with_integers(
            base in prop::array::uniform3(prop::array::uniform3(-1_000_000_i64..1_000_000)),
            weights in prop::array::uniform2(-3_i64..4),
            step in prop::array::uniform3(-1_i64..2),
        ) {
            let [a, b, c] = base;
            let d: [i64; 3] = std::array::from_fn(|k| {
                a[k] + weights[0] * (b[k] - a[k]) + weights[1] * (c[k] - a[k]) + step[k]
            });
            let [x, y, z] = [a, b, c].map(|p: [i64; 3]| -> [i128; 3] { std::array::from_fn(|k| i128::from(p[k] - d[k])) });
            let det = x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
                + x[2] * (y[0] * z[1] - y[1] * z[0]);
            let float = |p: [i64; 3]| Vec3::from_array(p.map(|v| v as f64 * 2_f64.powi(-24)));
            let sign = orient3d(float(a), float(b), float(c), float(d));
            prop_assert_eq!(-sign.value(), det.signum() as i32);

            let e: [i64; 3] = std::array::from_fn(|k| a[k] + weights[0] * (b[k] - a[k]) + step[k]);
            let [u, v] = [a, b].map(|p| [p[0] - e[0], p[1] - e[1]].map(i128::from));
            let area = u[0] * v[1] - u[1] * v[0];
            let flat = |p| project(float(p), 2);
            prop_assert_eq!(orient2d(flat(a), flat(b), flat(e)).value(), area.signum() as i32);
        }
    }
}
