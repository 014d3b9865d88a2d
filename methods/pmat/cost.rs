//! The cost of an edge, and the choice of the sphere to be absorbed.

use medial::complex::{Sphere, ZERO_LENGTH};

/// The factor `c = |p_a - p_b| / |r_a - r_b|` (section 2): scaled by it, the larger of two spheres
/// absorbs the smaller. At most 1 if one ball contains the other already; infinite for equal radii;
/// 0, whatever the radii, for centres closer than [`ZERO_LENGTH`], which count as one point. Lengths
/// are in units of the bounding-box diagonal.
///
/// With the stability ratio `G` of the same edge, `G = max(0, 1 - 1 / c)`.
pub fn absorption_scale(a: Sphere, b: Sphere) -> f64 {
    let d = a.centre.distance(b.centre);
    if d < ZERO_LENGTH { 0.0 } else { d / (a.radius - b.radius).abs() }
}

/// The ends of an edge, first the one to be absorbed: the smaller sphere, or, of equal ones, the one
/// with the larger id.
#[inline]
pub(super) fn absorbed_first([a, b]: [u32; 2], radius: impl Fn(u32) -> f64) -> [u32; 2] {
    let (r, s) = (radius(a), radius(b));
    if r < s || (r == s && a > b) { [a, b] } else { [b, a] }
}

/// The key of an edge in the order of collapses: the cost, or the length if the cost is infinite.
///
/// Non-negative numbers have the order of their bits. The unused sign bit marks a length, so lengths
/// come after all costs.
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
