//! A certified interval for the Hausdorff distance between a surface and the boundary of a union.
//!
//! With the surface S, the union U of all medial primitives and `sigma` their least signed
//! distance, the certified quantity is the larger of
//!
//! - (a) the largest distance to the boundary of U over the points of S, and
//! - (b) the largest distance to S over the points of the boundary of U.
//!
//! [`Distances`](super::Distances) samples these as `epsilon_union` and `reverse`. Outside
//! U, `sigma` is the distance to its boundary. Inside, `-sigma` is only a lower bound of it ([`super::depth`]).
//!
//! The method is branch and bound. The pieces are triangles of S, and the pieces of the surfaces of all
//! primitives ([`super::pieces`]). They are divided until the distances in each are known to be below
//! `lower + tolerance`, where `lower` is the largest distance found so far at a point that is certainly on S
//! or on the boundary of U:
//!
//! 1. Distances are 1-Lipschitz: in a piece they differ from that at its centre by at most the extent
//!    of the piece.
//! 2. The signed distance to a primitive, a convex body, is a convex function, and so is the
//!    distance to one triangle. Over a piece neither exceeds its largest value at the corners of a
//!    convex polytope around the piece. So one primitive bounds `sigma` from above, and one triangle
//!    the distance to S. The error is of second order in the size of the piece.
//! 3. A point of S in U is at most as far from the boundary as from any point outside U. All points of a
//!    triangle of S share one such point, or the triangle moved by `lower + tolerance` is outside: a convex
//!    function is nowhere below its tangent plane, and for each primitive near the moved triangle the plane
//!    at the triangle's centre shows that.
//! 4. If 1 or 2 prove that another primitive contains a piece of a primitive's surface, the piece is not on
//!    the boundary of U and is dropped.
//! 5. Where the bounds of the distance at the centre of a triangle are far apart, that point is searched
//!    alone.
//!
//! All pieces of one size are evaluated in one round, so the result is the same for any number of
//! threads.
//!
//! Rounding: all of this is double precision, whose errors, at coordinates of the order of the
//! surface's diagonal, are below [`ROUNDING`] diagonals. The interval is wider by that on both sides. Gaps between
//! primitives that are narrower than [`BURIAL`](super::pieces::BURIAL) count as none.

use super::ascent::Peak;
use super::bounds::{Bound, Largest, Pieces, ROUNDING, check_tolerance};
use super::depth::{Boundary, DOUBT, Depth};
use super::error::MetricError;
use super::evaluation::{Certificate, Witness, WitnessSide};
use super::pieces::{
    EXPOSED, Patches, Piece, farthest, largest_distance, planar_frames, quartered,
};
use super::samples::Pose;
use crate::Vec3;
use crate::complex::{MedialMesh, MedialUnion, NearestPrimitive};
use crate::geometry::planar_frame::PlanarFrame;
use crate::geometry::trees::in_morton_order;
use crate::surface::{TriMesh, TriangleBvh};

/// Limits of pieces of a round for small and for large inputs: about 0.7 and 2 GB.
const MAX_PIECES: [usize; 2] = [1 << 22, 1 << 24];

/// Limit of pieces of a round for each initial piece, between the two of [`MAX_PIECES`].
const MAX_GROWTH: usize = 64;

/// Largest coordinate of a union, in the unit of the surface: rounding of several units in the last place is within
/// [`ROUNDING`].
const LARGEST_REACH: f64 = ROUNDING / (8.0 * f64::EPSILON);

/// Encloses the Hausdorff distance in an interval no wider than `tolerance`, in the unit of both,
/// for a surface of diagonal about 1. The same for any number of threads.
///
/// The cost grows as the tolerance shrinks relative to the distance: most of the work is done where
/// the distance is within one tolerance of its maximum.
///
/// # Errors
/// A tolerance below [`FINEST`](super::FINEST) or not a number; an interval that would need too many pieces; a
/// medial mesh without a union, or with one so large that rounding exceeds [`ROUNDING`]; a surface without faces.
pub fn certify(
    surface: &TriMesh,
    bvh: &TriangleBvh,
    mesh: &MedialMesh,
    tolerance: f64,
) -> Result<Certificate, MetricError> {
    check_tolerance(tolerance)?;
    if surface.faces.is_empty() {
        return Err(MetricError::NoArea);
    }
    let union = MedialUnion::new(mesh)?;
    let (low, high) = union.bounding_box();
    let reach = low.abs().max(high.abs()).max_element();
    // No division narrows an interval below the rounding of its coordinates.
    if reach > LARGEST_REACH {
        return Err(MetricError::TooLarge { reach, most: LARGEST_REACH });
    }
    let pose = Pose::new(surface);
    let boundary = Boundary::new(&union, Patches::new(mesh, pose.axes(), pose.diameter()));
    // Both ends are widened by ROUNDING below; half of one more covers the rounding of these sums.
    let goal = tolerance - 2.5 * ROUNDING;
    // A good lower bound before the first piece is divided: the maximum is often at a vertex.
    let depths = in_morton_order(&surface.vertices, |near, p| boundary.of(p, near).upper);
    let vertices = surface.vertices.iter().zip(depths);
    let vertices = vertices.map(|(&point, distance)| Peak { point, distance }).collect();
    let deepest = boundary.deepest_of(vertices).0;
    let Peak { point, distance } =
        deepest.unwrap_or(Peak { point: surface.vertices[0], distance: 0.0 });
    let mut largest = Largest::above(distance);
    let triangles = (0..surface.faces.len()).map(|face| surface.triangle(face));
    let mut side = SurfaceSide { boundary: &boundary, goal, searched: 0 };
    largest.divide(&mut side, triangles.map(|triangle| (triangle, None)).collect())?;
    let mut witness =
        Witness { point: largest.witness.take().unwrap_or(point), on: WitnessSide::Surface };
    let triangles = planar_frames(surface);
    let mut side = UnionSide { bvh, triangles, boundary: &boundary, goal };
    largest.divide(&mut side, boundary.patches.pieces())?;
    if let Some(point) = largest.witness {
        witness = Witness { point, on: WitnessSide::Union };
    }
    Ok(Certificate {
        lower: (largest.lower - ROUNDING).max(0.0),
        upper: largest.upper.max(largest.lower) + ROUNDING,
        tolerance,
        pieces: largest.pieces,
        witness,
    })
}

impl Largest {
    fn divide<P: Pieces>(
        &mut self,
        side: &mut P,
        pieces: Vec<P::Piece>,
    ) -> Result<(), MetricError> {
        // A few bytes of input must not take minutes before they are rejected.
        let most = (MAX_GROWTH * pieces.len()).clamp(MAX_PIECES[0], MAX_PIECES[1]);
        self.search(side, pieces, most)
    }
}

/// Limit of pieces of the boundary in all searches of one round.
const SEARCHED: usize = 1 << 25;

// The first side: the distances from the triangles of the surface to the boundary of the union.

/// Closer than this to the centre that attains a distance, the direction of its gradient is mostly
/// rounding.
const MIN_ARM: f64 = 1e-9;

/// The triangles of a surface against the boundary of a union.
struct SurfaceSide<'a> {
    boundary: &'a Boundary<'a>,
    goal: f64,
    /// Number of pieces of the boundary that a run of this round may search.
    searched: usize,
}

impl SurfaceSide<'_> {
    /// An upper bound of `sigma` over a triangle: the best one from the primitives that are deepest at
    /// the centre or at a corner.
    fn above(&self, triangle: &[Vec3; 3], enough: f64, deepest: NearestPrimitive) -> f64 {
        let Boundary { union, patches, .. } = self.boundary;
        let mut least = patches.largest_over(deepest.primitive, triangle);
        for &corner in triangle {
            if least <= enough {
                break;
            }
            let deepest = union.deepest(corner).primitive;
            least = least.min(patches.largest_over(deepest, triangle));
        }
        least
    }

    /// Whether a triangle is outside the union, by the primitives that can meet it.
    fn is_outside(&self, triangle: &[Vec3; 3], centre: Vec3, reach: f64) -> bool {
        let mut is_outside = true;
        self.boundary.union.each_nearer(centre, reach, |signed, attained_at| {
            let arm = centre - attained_at;
            let length = arm.length();
            // The tangent plane of a convex function lies below it.
            let is_apart = |&c: &Vec3| signed + arm.dot(c - centre) / length > ROUNDING;
            is_outside &= length > MIN_ARM && triangle.iter().all(is_apart);
        });
        is_outside
    }
}

impl Pieces for SurfaceSide<'_> {
    /// A triangle, and a point outside the union that was near to the triangle that it is a part of.
    type Piece = ([Vec3; 3], Option<Vec3>);
    /// Number of pieces of the boundary that may still be searched.
    type Near = usize;

    fn near(&self) -> usize {
        self.searched
    }

    fn begin(&mut self, pieces: &[Self::Piece], _: f64) {
        self.searched = SEARCHED / pieces.len().div_ceil(Self::RUN);
    }

    fn enough(&self, lower: f64) -> f64 {
        lower + self.goal
    }

    fn bound(
        &self,
        (triangle, outside): &mut Self::Piece,
        _: f64,
        enough: f64,
        left: &mut usize,
    ) -> Bound {
        let centre = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
        let reach = farthest(centre, triangle);
        let mut near = 0;
        let (deepest, attained_at) = self.boundary.union.deepest_from(centre, &mut near);
        let reached = deepest.signed.abs();
        let mut depth = Depth { lower: reached, upper: reached, outside: None };
        if deepest.signed < 0.0 {
            depth = self.boundary.from(centre, deepest.signed, attained_at, &mut near);
            if let Some(outside) = *outside {
                depth = depth.with(centre, outside);
            }
        }
        if depth.upper + reach <= enough {
            return Bound { reached, at: centre, upper: depth.upper + reach };
        }
        let above = self.above(triangle, enough, deepest).min(deepest.signed + reach);
        if above <= enough {
            // Points of the triangle in the union have the boundary on their way to points outside.
            let (way, to_outside) = match (depth.outside, attained_at) {
                (Some(outside), _) => (outside - centre, farthest(outside, triangle)),
                (None, Some(from)) if deepest.signed >= 0.0 => (centre - from, f64::INFINITY),
                (None, _) => (Vec3::ZERO, f64::INFINITY),
            };
            let way = enough * way.normalize_or_zero();
            let [moved @ .., at] = [triangle[0], triangle[1], triangle[2], centre].map(|p| p + way);
            if to_outside <= enough || self.is_outside(&moved, at, reach) {
                return Bound { reached, at: centre, upper: above.max(enough.min(to_outside)) };
            }
        }
        let doubt = DOUBT * reach.max(self.goal);
        if depth.upper - depth.lower > doubt {
            depth = self.boundary.within(centre, depth, [0.5 * doubt, 0.0], left);
        }
        *outside = depth.outside.or(*outside);
        Bound { reached: depth.lower, at: centre, upper: depth.upper + reach }
    }

    fn divide(&self, (triangle, outside): &Self::Piece, parts: &mut Vec<Self::Piece>) {
        parts.extend(quartered(*triangle, Vec3::midpoint).map(|part| (part, *outside)));
    }
}

// The second side: distances to the surface over the boundary of the union.

/// The surfaces of all primitives against a surface.
struct UnionSide<'a> {
    bvh: &'a TriangleBvh,
    triangles: Vec<PlanarFrame>,
    boundary: &'a Boundary<'a>,
    goal: f64,
}

impl Pieces for UnionSide<'_> {
    type Piece = Piece;
    type Near = ();

    fn near(&self) {}

    fn enough(&self, lower: f64) -> f64 {
        lower + self.goal
    }

    fn bound(&self, piece: &mut Piece, known: f64, enough: f64, (): &mut ()) -> Bound {
        let Boundary { union, patches, .. } = self.boundary;
        let enclosure = patches.enclose(piece);
        let (centre, corners) = (enclosure.centre, enclosure.corners());
        let reach = enclosure.reach();
        let closest = self.bvh.closest(centre);
        let lipschitz = closest.distance + reach;
        // Cheapest exit first; it needs no look at the union, since the piece cannot raise `lower`.
        if lipschitz <= enough && closest.distance <= known {
            return Bound::above(lipschitz);
        }
        if patches.is_overtopped(piece) {
            return Bound::above(0.0);
        }
        let Some(deepest) = patches.unburied(union, piece, &enclosure, &mut 0) else {
            return Bound::above(0.0);
        };
        let reached = if deepest.signed >= -EXPOSED { closest.distance } else { 0.0 };
        if lipschitz <= enough {
            return Bound { reached, at: centre, upper: lipschitz };
        }
        let convex = largest_distance(&self.triangles[closest.face as usize], corners);
        Bound { reached, at: centre, upper: lipschitz.min(convex) }
    }

    fn divide(&self, piece: &Piece, parts: &mut Vec<Piece>) {
        self.boundary.patches.divide(piece, parts);
    }
}
