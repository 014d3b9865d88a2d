//! Exact signs of orientation, and the power-of-two scaling that keeps them exact.
//!
//! Shewchuk's adaptive predicates (10.1007/PL00009321; the crate `robust`) are exact as long as
//! nothing overflows or underflows. [`Unit`] makes sure of that: it scales by a power of two, which
//! loses nothing, so that the largest coordinate lies in [1/2, 1), and sets coordinates below
//! 2^-150 to zero. A product of five coordinates and of their rounding errors then stays above
//! 2^-1015, so even the in-sphere test could not underflow.

use crate::Vec3;

/// The sign of an orientation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Sign {
    Negative,
    Zero,
    Positive,
}

impl Sign {
    pub(super) fn of(value: f64) -> Self {
        if value > 0.0 {
            Self::Positive
        } else if value < 0.0 {
            Self::Negative
        } else {
            Self::Zero
        }
    }

    pub(super) fn is_zero(self) -> bool {
        self == Self::Zero
    }

    /// -1, 0 or 1.
    pub(super) fn value(self) -> i32 {
        match self {
            Self::Negative => -1,
            Self::Zero => 0,
            Self::Positive => 1,
        }
    }

    /// Whether the two are strictly on opposite sides.
    pub(super) fn opposes(self, other: Self) -> bool {
        self.value() * other.value() < 0
    }
}

/// A point of a coordinate plane.
pub(super) type Point2 = [f64; 2];

/// Positive when `a, b, c` turn to the left. Exact.
#[inline]
pub(super) fn orient2d(a: Point2, b: Point2, c: Point2) -> Sign {
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
    let coord = |p: Point2| robust::Coord { x: p[0], y: p[1] };
    Sign::of(robust::orient2d(coord(a), coord(b), coord(c)))
}

/// Positive when `d` lies on the side from which `a, b, c` appear clockwise: for a face with
/// counter-clockwise corners seen from outside, positive means inside. Exact.
#[inline]
pub(super) fn orient3d(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> Sign {
    let coord = |p: Vec3| robust::Coord3D { x: p.x, y: p.y, z: p.z };
    Sign::of(robust::orient3d(coord(a), coord(b), coord(c), coord(d)))
}

/// The point without its coordinate `axis`, such that a triangle whose normal has a positive
/// component along `axis` turns left.
#[inline]
pub(super) fn project(p: Vec3, axis: usize) -> Point2 {
    match axis {
        0 => [p.y, p.z],
        1 => [p.z, p.x],
        _ => [p.x, p.y],
    }
}

/// A coordinate axis along which the triangle does not project to a segment, and the sense of
/// rotation of its projection; `None` for exactly collinear corners.
pub(super) fn projection_axis([a, b, c]: [Vec3; 3]) -> Option<(usize, Sign)> {
    let normal = (b - a).cross(c - a).abs();
    // The axis with the largest component first: the projection is then far from degenerate.
    let mut axes = [0, 1, 2];
    axes.sort_by(|&i, &j| normal[j].total_cmp(&normal[i]));
    axes.into_iter().find_map(|axis| {
        let turn = orient2d(project(a, axis), project(b, axis), project(c, axis));
        (!turn.is_zero()).then_some((axis, turn))
    })
}

/// Scaling by a power of two to coordinates below 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Unit {
    exponent: i32,
}

/// Smaller scaled coordinates are taken as zero.
const FLUSH: f64 = 1.0 / (1u128 << 75) as f64 / (1u128 << 75) as f64;

impl Unit {
    /// The scaling that suits these points.
    pub(super) fn of(points: &[Vec3]) -> Self {
        let largest = points.iter().fold(0.0_f64, |m, p| m.max(p.abs().max_element()));
        Self { exponent: if largest.is_finite() { exponent(largest) } else { 0 } }
    }

    /// From the unit of the file to scaled coordinates, tiny ones flushed.
    #[inline]
    pub(super) fn forward(self, p: Vec3) -> Vec3 {
        let flush = |x: f64| {
            let scaled = times_power(x, -self.exponent);
            // Adding zero turns -0 into 0.
            if scaled.abs() < FLUSH { 0.0 } else { scaled + 0.0 }
        };
        Vec3::new(flush(p.x), flush(p.y), flush(p.z))
    }

    /// The same for many points.
    pub(super) fn forward_all(self, points: &[Vec3]) -> Vec<Vec3> {
        points.iter().map(|&p| self.forward(p)).collect()
    }

    /// A quantity of the given dimension (1 length, 2 area, 3 volume) in the unit of the file, or
    /// `None` where that is not representable.
    pub(super) fn backward(self, value: f64, dimension: i32) -> Option<f64> {
        let scaled = times_power(value, dimension * self.exponent);
        (scaled.is_finite() && (scaled.is_normal() || value == 0.0)).then_some(scaled)
    }
}

/// The smallest `e` with `value < 2^e`, for finite `value`.
fn exponent(value: f64) -> i32 {
    if value == 0.0 {
        return 0;
    }
    if value < f64::MIN_POSITIVE {
        // Subnormal: scaled into the normal range first.
        return exponent(value * TWO_POW_64) - 64;
    }
    ((value.to_bits() >> 52) & 0x7ff) as i32 - 1022
}

const TWO_POW_64: f64 = 18_446_744_073_709_551_616.0;

/// `value * 2^power`, in steps small enough to be representable.
#[inline]
fn times_power(mut value: f64, mut power: i32) -> f64 {
    while power != 0 {
        let step = power.clamp(-1000, 1000);
        value *= f64::from_bits(((1023 + step) as u64) << 52);
        power -= step;
    }
    value
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn unit_scaling_is_exact_over_the_whole_range() {
        for largest in [1.0, 0.75, 1e200, 1e-160, f64::MAX, f64::MIN_POSITIVE, 5e-324, 1e12 + 1.0] {
            let unit = Unit::of(&[Vec3::new(largest, 0.0, -largest)]);
            let scaled = unit.forward(Vec3::new(largest, 0.0, -largest));
            assert!(scaled.x < 1.0 && scaled.x >= 0.5, "{largest} became {}", scaled.x);
            assert_eq!(times_power(scaled.x, unit.exponent), largest);
        }
    }

    #[test]
    fn signs_follow_their_documentation() {
        let [a, b, c] = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(orient2d([0.0, 0.0], [1.0, 0.0], [0.0, 1.0]), Sign::Positive);
        assert_eq!(orient3d(a, b, c, -Vec3::Z), Sign::Positive);
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
            let row = |p: [i64; 3]| -> [i128; 3] { std::array::from_fn(|k| i128::from(p[k] - d[k])) };
            let [x, y, z] = [a, b, c].map(row);
            let det = x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
                + x[2] * (y[0] * z[1] - y[1] * z[0]);
            let float = |p: [i64; 3]| Vec3::from_array(p.map(|v| v as f64 * 2_f64.powi(-24)));
            let sign = orient3d(float(a), float(b), float(c), float(d));
            prop_assert_eq!(sign.value(), det.signum() as i32);

            let e: [i64; 3] = std::array::from_fn(|k| a[k] + weights[0] * (b[k] - a[k]) + step[k]);
            let [u, v] = [a, b].map(|p| [p[0] - e[0], p[1] - e[1]].map(i128::from));
            let area = u[0] * v[1] - u[1] * v[0];
            let flat = |p| project(float(p), 2);
            prop_assert_eq!(orient2d(flat(a), flat(b), flat(e)).value(), area.signum() as i32);
        }
    }
}
