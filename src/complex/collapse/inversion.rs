//! The inversion test: whether a collapse folds a face over.

use super::CollapseComplex;
use crate::Vec3;
use crate::complex::ZERO_LENGTH;

impl CollapseComplex {
    /// A face `[v, p, q]` that folds over when both ends of the edge `{a, b}` move to `centre`; `v`
    /// is the one end that belongs to the face. See [`CollapseComplex::folds`].
    ///
    /// The answer stays valid until one of `a`, `b`, `p`, `q` is part of a collapse.
    /// Cost: the faces of both ends.
    pub fn folded_face(&self, a: u32, b: u32, centre: Vec3) -> Option<[u32; 3]> {
        let folded_at = |moved: u32, other: u32| {
            let sides = self.opposite_sides(moved).iter();
            // Faces with both ends vanish, so they cannot fold.
            let mut faces = sides.filter(|&&[p, q]| p != other && q != other);
            let folded = faces.find(|&&[p, q]| self.folds([moved, p, q], centre));
            folded.map(|&[p, q]| [moved, p, q])
        };
        folded_at(a, b).or_else(|| folded_at(b, a))
    }

    /// Whether a face `[v, p, q]` folds over when `v` moves to `centre`: the dot product of its
    /// normals before and after is negative.
    ///
    /// A face thinner than [`ZERO_LENGTH`] before the move never counts as folded: its normal is
    /// rounding noise, which must not hold a collapse back. Lengths in units of the diagonal.
    ///
    /// Source: Garland, Heckbert 1997, *Surface simplification using quadric error metrics*,
    /// <https://doi.org/10.1145/258734.258849>, section 3.7.
    #[inline]
    pub fn folds(&self, face: [u32; 3], centre: Vec3) -> bool {
        let [from, p, q] = face.map(|v| self.sphere(v).centre);
        folds_over([from, p, q], [centre, p, q])
    }
}

/// Whether a triangle folds over when its corners move, as [`CollapseComplex::folds`] has it for one of
/// them.
#[inline]
pub fn folds_over(before: [Vec3; 3], after: [Vec3; 3]) -> bool {
    let [u, v] = [before[1] - before[0], before[2] - before[0]];
    let normal = u.cross(v);
    let moved = (after[1] - after[0]).cross(after[2] - after[0]);
    // Sign first: it is cheap, and few faces get past it.
    normal.dot(moved) < 0.0 && !is_thin(normal, u, v)
}

/// Whether the smallest height of the triangle with sides `u`, `v` and `u × v = normal` is noise.
fn is_thin(normal: Vec3, u: Vec3, v: Vec3) -> bool {
    let longest = u.length_squared().max(v.length_squared()).max((u - v).length_squared());
    // The smallest height is the doubled area over the longest side; squared, without division.
    normal.length_squared() <= ZERO_LENGTH * ZERO_LENGTH * longest
}
