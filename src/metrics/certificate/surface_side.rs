//! The first side: `|sigma|` over the triangles of the surface.

use super::{Bound, Hulls, Side, WitnessSide, farthest, quartered};
use crate::Vec3;
use crate::complex::MedialUnion;
use crate::surface::TriMesh;

/// Closer than this to the centre that attains a distance, the direction of its gradient is mostly
/// rounding.
const MIN_ARM: f64 = 1e-9;

/// The triangles of a surface against a union.
pub(super) struct SurfaceSide<'a> {
    pub union: &'a MedialUnion,
    pub hulls: &'a Hulls,
}

impl SurfaceSide<'_> {
    pub fn pieces(&self, surface: &TriMesh) -> Vec<[Vec3; 3]> {
        (0..surface.faces.len()).map(|face| surface.triangle(face)).collect()
    }

    /// The farthest of some points of the surface, the first of equally far ones, and its distance.
    pub fn farthest_of(&self, points: &[Vec3]) -> (f64, Vec3) {
        let mut farthest = (0.0, points[0]);
        for (signed, &point) in self.union.signed_batch(points).into_iter().zip(points) {
            if signed.abs() > farthest.0 {
                farthest = (signed.abs(), point);
            }
        }
        farthest
    }

    /// An upper bound of `sigma` over a triangle: the best one from the primitives that are deepest at
    /// the centre or at a corner.
    fn above(&self, triangle: &[Vec3; 3], enough: f64, first: f64) -> f64 {
        let mut least = first;
        for &corner in triangle {
            if least <= enough {
                break;
            }
            let deepest = self.union.deepest(corner).primitive;
            least = least.min(self.hulls.largest_over(deepest, triangle));
        }
        least
    }

    /// An upper bound of `-sigma` over a triangle, from the primitives with which it can exceed
    /// `enough`.
    fn below(&self, triangle: &[Vec3; 3], centre: Vec3, reach: f64, enough: f64) -> f64 {
        let mut depth = 0.0_f64;
        self.union.each_nearer(centre, reach - enough, |signed, attained_at| {
            let arm = centre - attained_at;
            let length = arm.length();
            let mut lowest = signed - reach;
            if length > MIN_ARM {
                // The tangent plane of a convex function lies below it.
                let rise = |&corner: &Vec3| signed + arm.dot(corner - centre) / length;
                lowest = triangle.iter().map(rise).fold(f64::INFINITY, f64::min).max(lowest);
            }
            depth = depth.max(-lowest);
        });
        depth
    }
}

impl Side for SurfaceSide<'_> {
    type Piece = [Vec3; 3];

    const SIDE: WitnessSide = WitnessSide::Surface;

    fn bound(&self, triangle: &[Vec3; 3], _: f64, enough: f64) -> Bound {
        let centre = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
        let reach = farthest(centre, triangle);
        let deepest = self.union.deepest(centre);
        let reached = deepest.signed.abs();
        let lipschitz = reached + reach;
        if lipschitz <= enough {
            return Bound { reached, centre, upper: lipschitz };
        }
        let first = self.hulls.largest_over(deepest.primitive, triangle);
        let above = self.above(triangle, enough, first.min(deepest.signed + reach));
        if above > enough {
            return Bound { reached, centre, upper: above };
        }
        // Primitives that `below` skips are no deeper than `enough`.
        let unseen = enough.min(reach - deepest.signed);
        let below = self.below(triangle, centre, reach, enough).max(unseen);
        Bound { reached, centre, upper: above.max(below) }
    }

    fn divide(&self, triangle: &[Vec3; 3], parts: &mut Vec<[Vec3; 3]>) {
        parts.extend(quartered(*triangle, Vec3::midpoint));
    }
}
