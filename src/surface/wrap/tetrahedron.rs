//! Whether a tetrahedron meets a triangle, by separating axes. Errors are on the side of a meeting.
//!
//! Two convex bodies are apart if and only if their projections to some axis are. As the tetrahedron has a volume, the
//! normals of its faces and of the triangle and the cross products of their sides are enough, also for a triangle that is a
//! segment or a point (S. Gottschalk, M. Lin, D. Manocha 1996, *OBBTree*, SIGGRAPH,
//! <https://doi.org/10.1145/237170.237244>). The direction of an axis may be rounded, as any axis with a gap is a proof.

use crate::Vec3;
use crate::geometry::trees::Bounds;

/// Rounding error of a projection, as a fraction of the length of the axis times that of the vector.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// A tetrahedron with its separating axes.
pub(super) struct Tetrahedron {
    /// Origin of the relative coordinates.
    origin: Vec3,
    /// The corners, relative to the first.
    corners: [Vec3; 4],
    sides: [Vec3; 6],
    /// Normals of the faces, outward.
    normals: [Vec3; 4],
    bounds: Bounds,
}

impl Tetrahedron {
    /// The corners are positively oriented.
    pub fn new(corners: [Vec3; 4]) -> Self {
        let bounds = Bounds::of_points(corners);
        let origin = corners[0];
        let [_, b, c, d] = corners.map(|p| p - origin);
        let sides = [b, c, d, c - b, d - c, b - d];
        let normals = [sides[3].cross(sides[4]), d.cross(c), b.cross(d), c.cross(b)];
        Self { origin, corners: [Vec3::ZERO, b, c, d], sides, normals, bounds }
    }

    /// Whether a box may meet the tetrahedron. Some boxes that do not meet it pass.
    pub fn may_meet_box(&self, other: &Bounds) -> bool {
        if !self.bounds.overlaps(other) {
            return false;
        }
        let (lo, hi) = (other.lo - self.origin, other.hi - self.origin);
        let reach = lo.abs().max(hi.abs()).length();
        (0..4).all(|face| {
            let normal = self.normals[face];
            let nearest = Vec3::select(normal.cmpgt(Vec3::ZERO), lo, hi);
            // The face has every corner but its own.
            let height = self.corners[(face + 1) % 4].dot(normal);
            nearest.dot(normal) - height <= self.blur(normal, reach)
        })
    }

    /// Whether a triangle meets the tetrahedron.
    pub fn meets(&self, triangle: [Vec3; 3]) -> bool {
        if !self.bounds.overlaps(&Bounds::of_points(triangle)) {
            return false;
        }
        let triangle = triangle.map(|p| p - self.origin);
        let [a, b, c] = triangle;
        let edges = [b - a, c - b, a - c];
        let own = self.normals.into_iter().chain([edges[0].cross(edges[1])]);
        let crossed = self.sides.iter().flat_map(|side| edges.map(|edge| side.cross(edge)));
        !own.chain(crossed).any(|axis| self.separates(axis, triangle))
    }

    fn separates(&self, axis: Vec3, triangle: [Vec3; 3]) -> bool {
        let [from, to] = range(self.corners.map(|p| p.dot(axis)));
        let [first, last] = range(triangle.map(|p| p.dot(axis)));
        let reach = triangle.iter().fold(0.0, |reach: f64, p| reach.max(p.length()));
        (first - to).max(from - last) > self.blur(axis, reach)
    }

    /// Bound on the rounding error of a difference of projections of the corners and of points within `reach`.
    fn blur(&self, axis: Vec3, reach: f64) -> f64 {
        let own = self.corners.iter().fold(0.0, |own: f64, p| own.max(p.length()));
        ROUNDING * axis.length() * (own + reach)
    }
}

fn range<const N: usize>(values: [f64; N]) -> [f64; 2] {
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    values.into_iter().fold(start, |[lo, hi], value| [lo.min(value), hi.max(value)])
}
