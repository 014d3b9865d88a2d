//! The cost of an edge, and which of its spheres goes.

use medial::complex::{Sphere, ZERO_LENGTH};

/// The scale at which the larger of two spheres absorbs the smaller, when both grow by it:
/// `c = |p_a - p_b| / |r_a - r_b|` (section 2). At most 1 where one ball holds the other already;
/// infinite for equal radii; 0 for centres closer than [`ZERO_LENGTH`], which are one point up to
/// rounding, whatever their radii. Lengths are in units of the bounding-box diagonal.
///
/// With the stability ratio `G` of the same edge, `G = max(0, 1 - 1 / c)`.
pub fn absorption_scale(a: Sphere, b: Sphere) -> f64 {
    let d = a.centre.distance(b.centre);
    if d < ZERO_LENGTH { 0.0 } else { d / (a.radius - b.radius).abs() }
}

/// The ends of an edge, the one that is absorbed first: the smaller sphere, of equal ones that
/// with the larger id.
#[inline]
pub(super) fn absorbed_first([a, b]: [u32; 2], radius: impl Fn(u32) -> f64) -> [u32; 2] {
    let (r, s) = (radius(a), radius(b));
    if r < s || (r == s && a > b) { [a, b] } else { [b, a] }
}

/// The place of an edge in the order of collapses: by cost, those of infinite cost by length.
///
/// A non-negative number orders as its bits do; the free sign bit tells a length from a cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key(u64);

const LENGTH: u64 = 1 << 63;

impl Key {
    #[inline]
    pub(super) fn of([a, b]: [Sphere; 2]) -> Self {
        let cost = absorption_scale(a, b);
        if cost < f64::INFINITY {
            Self(cost.to_bits())
        } else {
            Self(LENGTH | a.centre.distance(b.centre).to_bits())
        }
    }

    #[inline]
    pub(super) fn bits(self) -> u64 {
        self.0
    }

    /// The cost.
    #[inline]
    pub(super) fn cost(self) -> f64 {
        if self.0 & LENGTH == 0 { f64::from_bits(self.0) } else { f64::INFINITY }
    }
}
