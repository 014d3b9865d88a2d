//! The power-of-two scaling that keeps exact predicates within the range of `f64`.
//!
//! [`Unit`] scales so that the largest coordinate lies in [1/2, 1), which loses nothing, and sets
//! coordinates below 2^-150 to zero. A product of five coordinates and of their rounding errors then stays
//! above 2^-1015, so that no predicate of [`crate::geometry::predicates`] can underflow.

use crate::Vec3;

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
}
