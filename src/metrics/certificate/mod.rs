//! A certified interval for the Hausdorff distance between a surface and the boundary of a union.
//!
//! With the surface S, the union U of all medial primitives and `sigma` their least signed
//! distance, the certified quantity is the larger of
//!
//! - (a) the largest `|sigma(p)|` over the points `p` of S, and
//! - (b) the largest distance to S over the points of the boundary of U.
//!
//! These are what [`Distances`](super::Distances) samples as `epsilon_union` and `reverse`. Outside
//! U, `sigma` is the distance to U; inside, `-sigma` is the depth in the deepest single
//! primitive, which is less than the depth in U where primitives cover each other.
//!
//! The method is branch and bound. The pieces are triangles of S, and the triangles, cone laterals
//! and spherical triangles that make up the surfaces of all primitives. They are divided until the
//! distances in each are known to be below `lower + tolerance`, where `lower` is the largest distance
//! found so far at a point that is certainly on S or on the boundary of U:
//!
//! 1. Distances are 1-Lipschitz: in a piece they differ from that at its centre by at most the extent
//!    of the piece.
//! 2. The signed distance to a primitive, a convex body, is a convex function, and so is the
//!    distance to one triangle. Over a piece neither exceeds its largest value at the corners of a
//!    convex polytope around the piece. So one primitive bounds `sigma` from above, and one triangle
//!    the distance to S. The error is of second order in the size of the piece (file
//!    `union_side.rs`).
//! 3. A convex function is nowhere below its tangent plane. For each primitive that could be deep
//!    enough, the tangent plane at the centre of the piece bounds its signed distance from below
//!    (file `surface_side.rs`).
//! 4. If 1 or 2 prove that another primitive contains a piece, the piece is not on the boundary of U
//!    and is dropped.
//!
//! All pieces of one size are evaluated in one round, so the result is the same for any number of
//! threads.
//!
//! Rounding: all of this is double precision, whose errors, at coordinates of the order of the
//! surface's diagonal, are below [`ROUNDING`] diagonals. The interval is wider by that on both sides.

mod surface_side;
#[cfg(test)]
mod tests;
mod union_side;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::MetricError;
use crate::Vec3;
use crate::complex::{MedialMesh, MedialUnion, Primitive};
use crate::geometry::{Cone, Slab, Sphere};
use crate::surface::TriMesh;
use crate::surface::TriangleBvh;

use surface_side::SurfaceSide;
use union_side::UnionSide;

/// Bound on the rounding error of a distance, in units of the surface's diagonal.
pub const ROUNDING: f64 = 1e-9;

/// Finer intervals than this, in diagonals, are refused: rounding would be a part of them.
pub const FINEST: f64 = 1e-6;

/// Bound on the pieces of a round: about 2 GB.
const MAX_PIECES: usize = 1 << 24;

/// An interval that holds the Hausdorff distance between a surface and the boundary of a union.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// A lower bound: the distance at the witness, less the bound on rounding.
    pub lower: f64,
    /// An upper bound.
    pub upper: f64,
    /// The requested bound on `upper - lower`.
    pub tolerance: f64,
    /// Number of pieces that were evaluated.
    pub pieces: u64,
    /// A point at which the distance is `lower`, up to rounding.
    pub witness: Witness,
}

/// A point on one of the two surfaces, by which the lower end of an interval can be checked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Witness {
    /// Where it is.
    pub point: Vec3,
    /// The surface that it is on.
    pub on: WitnessSide,
}

/// The surface that a [`Witness`] is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WitnessSide {
    /// The surface, where `|sigma|` is the distance.
    Surface,
    /// The boundary of the union, whose distance to the surface it is.
    Union,
}

/// Encloses the Hausdorff distance in an interval no wider than `tolerance`, in the unit of both,
/// for a surface of diagonal about 1. The same for any number of threads.
///
/// The cost grows as the tolerance shrinks relative to the distance: most of the work is done where
/// the distance is within one tolerance of its maximum.
///
/// # Errors
/// A tolerance below [`FINEST`] or not a number; an interval that would need too many pieces; a
/// medial mesh without a union; a surface without faces.
pub fn certify(
    surface: &TriMesh,
    bvh: &TriangleBvh,
    mesh: &MedialMesh,
    tolerance: f64,
) -> Result<Certificate, MetricError> {
    if !(FINEST..=1.0).contains(&tolerance) {
        return Err(MetricError::Tolerance(tolerance));
    }
    if surface.faces.is_empty() {
        return Err(MetricError::NoArea);
    }
    let union = MedialUnion::new(mesh)?;
    let hulls = Hulls::new(mesh);
    // Both ends are widened by ROUNDING below; half of one more covers the rounding of these sums.
    let goal = tolerance - 2.5 * ROUNDING;
    let side = SurfaceSide { union: &union, hulls: &hulls };
    // A good lower bound before the first piece is divided: the maximum is often at a vertex.
    let (lower, point) = side.farthest_of(&surface.vertices);
    let witness = Witness { point, on: WitnessSide::Surface };
    let mut search = Search { lower, witness, upper: 0.0, goal, pieces: 0 };
    search.run(&side, side.pieces(surface))?;
    let side = UnionSide::new(surface, bvh, mesh, &union, &hulls);
    search.run(&side, side.pieces())?;
    Ok(Certificate {
        lower: (search.lower - ROUNDING).max(0.0),
        upper: search.upper.max(search.lower) + ROUNDING,
        tolerance,
        pieces: search.pieces,
        witness: search.witness,
    })
}

/// Distances on one of the two surfaces to the other.
trait Side: Sync {
    /// A part of this surface.
    type Piece: Copy + Send + Sync;

    /// The surface that this is.
    const SIDE: WitnessSide;

    /// Bounds of the distances in a piece. The distance `known` is reached somewhere already; an upper
    /// bound below `enough` need not be improved.
    fn bound(&self, piece: &Self::Piece, known: f64, enough: f64) -> Bound;

    /// Appends pieces that together cover a piece.
    fn divide(&self, piece: &Self::Piece, parts: &mut Vec<Self::Piece>);
}

/// Bounds of the largest distance in a piece.
#[derive(Clone, Copy, Debug)]
struct Bound {
    /// The distance at `centre`; 0 if that point is not known to be on the surface.
    reached: f64,
    /// A point of the piece.
    centre: Vec3,
    /// No distance in the piece exceeds it.
    upper: f64,
}

/// The state of the branch and bound.
struct Search {
    lower: f64,
    /// The point at which `lower` is reached.
    witness: Witness,
    upper: f64,
    goal: f64,
    pieces: u64,
}

impl Search {
    fn run<S: Side>(&mut self, side: &S, mut pieces: Vec<S::Piece>) -> Result<(), MetricError> {
        while !pieces.is_empty() {
            self.pieces += pieces.len() as u64;
            let (known, enough) = (self.lower, self.lower + self.goal);
            let bounds: Vec<Bound> = pieces
                .par_iter()
                .with_min_len(64)
                .map(|piece| side.bound(piece, known, enough))
                .collect();
            // In the order of the pieces, and only now: `lower` must not depend on threads.
            for bound in &bounds {
                if bound.reached > self.lower {
                    self.lower = bound.reached;
                    self.witness = Witness { point: bound.centre, on: S::SIDE };
                }
            }
            let enough = self.lower + self.goal;
            let mut parts = Vec::new();
            for (piece, bound) in pieces.iter().zip(&bounds) {
                if bound.upper <= enough {
                    self.upper = self.upper.max(bound.upper);
                } else {
                    side.divide(piece, &mut parts);
                }
            }
            if parts.len() > MAX_PIECES {
                return Err(MetricError::TooFine { tolerance: self.goal, pieces: parts.len() });
            }
            pieces = parts;
        }
        Ok(())
    }
}

/// The primitives as whole convex bodies, unlike the parts in [`MedialUnion`].
struct Hulls {
    spheres: Vec<Sphere>,
    cones: Vec<Cone>,
    slabs: Vec<Slab>,
}

impl Hulls {
    fn new(mesh: &MedialMesh) -> Self {
        let sphere = |v: u32| mesh.spheres[v as usize];
        Self {
            spheres: mesh.spheres.clone(),
            cones: mesh.edges.iter().map(|e| Cone::new(sphere(e[0]), sphere(e[1]))).collect(),
            slabs: mesh.faces.iter().map(|f| Slab::new(f.map(sphere))).collect(),
        }
    }

    /// The largest signed distance to a primitive over the convex hull of some points.
    fn largest_over(&self, primitive: Primitive, corners: &[Vec3]) -> f64 {
        let signed = |p: Vec3| match primitive {
            Primitive::Sphere(v) => self.spheres[v as usize].signed_distance(p),
            Primitive::Edge(e) => self.cones[e as usize].signed_distance(p),
            Primitive::Face(f) => self.slabs[f as usize].signed_distance(p),
        };
        corners.iter().fold(f64::NEG_INFINITY, |largest, &p| largest.max(signed(p)))
    }
}

/// The distance from a point to the farthest of some others.
fn farthest(from: Vec3, points: &[Vec3]) -> f64 {
    points.iter().fold(0.0, |far, &p| f64::max(far, from.distance_squared(p))).sqrt()
}

/// A triangle in four, by the midpoints of its sides.
fn quartered([a, b, c]: [Vec3; 3], middle: impl Fn(Vec3, Vec3) -> Vec3) -> [[Vec3; 3]; 4] {
    let [d, e, f] = [middle(b, c), middle(c, a), middle(a, b)];
    [[a, f, e], [f, b, d], [e, d, c], [d, e, f]]
}
