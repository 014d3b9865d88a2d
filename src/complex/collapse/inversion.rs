//! The inversion test: whether a collapse folds a face over.

use super::CollapseComplex;
use crate::Vec3;
use crate::complex::ZERO_LENGTH;

impl CollapseComplex {
    /// A side `{p, q}` whose face folds over when both ends of the edge `{a, b}` move to `centre`:
    /// the face has exactly one of the ends, and its normal after times its normal before is
    /// negative. While none of the four was part of a collapse it stays folded.
    ///
    /// A face that is thinner than [`ZERO_LENGTH`] before has no normal and is not tested: what
    /// rounding makes of it must not hold the collapse back. Lengths in units of the diagonal.
    ///
    /// Source: Garland, Heckbert 1997, *Surface simplification using quadric error metrics*,
    /// <https://doi.org/10.1145/258734.258849>, section 3.7. Cost: the faces of both ends.
    pub fn folded_side(&self, a: u32, b: u32, centre: Vec3) -> Option<[u32; 2]> {
        self.folded_at(a, b, centre).or_else(|| self.folded_at(b, a, centre))
    }

    fn folded_at(&self, moved: u32, other: u32, to: Vec3) -> Option<[u32; 2]> {
        let from = self.sphere(moved).centre;
        let folds = |&&[p, q]: &&[u32; 2]| {
            if p == other || q == other {
                return false;
            }
            let [p, q] = [self.sphere(p).centre, self.sphere(q).centre];
            let before = (p - from).cross(q - from);
            let after = (p - to).cross(q - to);
            before.dot(after) < 0.0 && !is_thin(before, p - from, q - from)
        };
        self.opposite_sides(moved).iter().find(folds).copied()
    }
}

/// Whether the smallest height of the triangle with sides `u`, `v` and `u x v = normal` is noise.
fn is_thin(normal: Vec3, u: Vec3, v: Vec3) -> bool {
    let longest = u.length_squared().max(v.length_squared()).max((u - v).length_squared());
    normal.length_squared() <= ZERO_LENGTH * ZERO_LENGTH * longest
}
