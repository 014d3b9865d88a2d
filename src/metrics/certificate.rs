//! A certified interval for the Hausdorff distance between a surface and the boundary of a union.
//!
//! With the surface S, the union U of all medial primitives and `sigma` their least signed
//! distance, the certified quantity is the larger of
//!
//! - (a) the largest `|sigma(p)|` over the points `p` of S, and
//! - (b) the largest distance to S over the points of the boundary of U.
//!
//! [`Distances`](super::Distances) samples these as `epsilon_union` and `reverse`. Outside
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

use std::f64::consts::TAU;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::MetricError;
use crate::Vec3;
use crate::complex::{MedialMesh, MedialUnion, Primitive};
use crate::geometry::planar_frame::PlanarFrame;
use crate::geometry::{Cone, ConeFrame, Slab, Sphere};
use crate::surface::{TriMesh, TriangleBvh};

/// Bound on the rounding error of a distance, in units of the surface's diagonal.
pub const ROUNDING: f64 = 1e-9;

/// Finer intervals than this, in diagonals, are rejected: rounding would be a part of them.
pub const FINEST: f64 = 1e-6;

/// Bounds on the pieces of a round for small inputs and for any: about 0.7 and 2 GB.
const MAX_PIECES: [usize; 2] = [1 << 22, 1 << 24];

/// Between these bounds, the pieces of a round for each piece to begin with.
const MAX_GROWTH: usize = 64;

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
    let witness = Witness { point: surface.vertices[0], on: WitnessSide::Surface };
    let mut search = Search { lower: 0.0, witness, upper: 0.0, goal, pieces: 0 };
    for (signed, &point) in union.signed_batch(&surface.vertices).into_iter().zip(&surface.vertices)
    {
        if signed.abs() > search.lower {
            (search.lower, search.witness.point) = (signed.abs(), point);
        }
    }
    search.run(&side, (0..surface.faces.len()).map(|face| surface.triangle(face)).collect())?;
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
pub(super) trait Side: Sync {
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
pub(super) struct Bound {
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
        // A few bytes of input must not take minutes before they are rejected.
        let most = (MAX_GROWTH * pieces.len()).clamp(MAX_PIECES[0], MAX_PIECES[1]);
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
                    if parts.len() > most {
                        return Err(MetricError::TooFine { tolerance: self.goal, pieces: most });
                    }
                }
            }
            pieces = parts;
        }
        Ok(())
    }
}

/// The primitives as whole convex bodies, unlike the parts in [`MedialUnion`].
pub(super) struct Hulls {
    spheres: Vec<Sphere>,
    cones: Vec<Cone>,
    slabs: Vec<Slab>,
}

impl Hulls {
    pub fn new(mesh: &MedialMesh) -> Self {
        Self {
            spheres: mesh.spheres.clone(),
            cones: mesh
                .edges
                .iter()
                .map(|&edge| {
                    let [a, b] = mesh.spheres_of(edge);
                    Cone::new(a, b)
                })
                .collect(),
            slabs: mesh.faces.iter().map(|&f| Slab::new(mesh.spheres_of(f))).collect(),
        }
    }

    /// The largest signed distance to a primitive over the convex hull of some points.
    pub fn largest_over(&self, primitive: Primitive, corners: &[Vec3]) -> f64 {
        // A convex function is largest over a convex hull at one of its corners.
        corners.iter().fold(f64::NEG_INFINITY, |largest, &p| {
            largest.max(match primitive {
                Primitive::Sphere(v) => self.spheres[v as usize].signed_distance(p),
                Primitive::Edge(e) => self.cones[e as usize].signed_distance(p),
                Primitive::Face(f) => self.slabs[f as usize].signed_distance(p),
            })
        })
    }
}

/// The distance from a point to the farthest of some others.
pub(super) fn farthest(from: Vec3, points: &[Vec3]) -> f64 {
    points.iter().fold(0.0, |far, &p| f64::max(far, from.distance_squared(p))).sqrt()
}

/// A triangle in four, by the midpoints of its sides.
pub(super) fn quartered(
    [a, b, c]: [Vec3; 3],
    middle: impl Fn(Vec3, Vec3) -> Vec3,
) -> [[Vec3; 3]; 4] {
    let [d, e, f] = [middle(b, c), middle(c, a), middle(a, b)];
    [[a, f, e], [f, b, d], [e, d, c], [d, e, f]]
}

// The first side: `|sigma|` over the triangles of the surface.

/// Closer than this to the centre that attains a distance, the direction of its gradient is mostly
/// rounding.
const MIN_ARM: f64 = 1e-9;

/// The triangles of a surface against a union.
struct SurfaceSide<'a> {
    pub union: &'a MedialUnion,
    pub hulls: &'a Hulls,
}

impl SurfaceSide<'_> {
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
                let heights = triangle.iter().map(|&c| signed + arm.dot(c - centre) / length);
                lowest = heights.fold(f64::INFINITY, f64::min).max(lowest);
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

// The second side: distances to the surface over the boundary of the union.

/// A point of a primitive's surface is on the boundary of the union, up to rounding, if it is no
/// deeper than this in any primitive.
pub(super) const EXPOSED: f64 = 1e-12;

/// The signed distance at the centre of a piece of some reach from which on a primitive buries all of it: any such
/// primitive ends a search.
pub(super) fn burying(reach: f64) -> f64 {
    -(EXPOSED + reach) * (1.0 + 1e-9)
}

/// Initial parts of a cone's lateral around its axis.
pub(super) const SECTORS: u32 = 6;

/// The surfaces of all primitives against a surface.
pub(super) struct UnionSide<'a> {
    pub bvh: &'a TriangleBvh,
    pub triangles: Vec<PlanarFrame>,
    pub mesh: &'a MedialMesh,
    pub frames: Vec<Option<ConeFrame>>,
    /// The axes of the octants that spheres are divided into.
    pub axes: [Vec3; 3],
    union: &'a MedialUnion,
    hulls: &'a Hulls,
}

/// A part of the surface of one primitive.
#[derive(Clone, Copy, Debug)]
pub(super) enum Piece {
    /// A part of a tangent triangle of a slab.
    Flat([Vec3; 3]),
    /// A spherical triangle: a sphere, and unit vectors towards its corners.
    Round(u32, [Vec3; 3]),
    /// A part of a cone's lateral: an edge, ranges of the share along the axis and of the angle
    /// around it.
    Lateral(u32, [f64; 2], [f64; 2]),
}

/// A point of a piece, and the corners of a convex polytope around the piece.
pub(super) struct Enclosure {
    pub centre: Vec3,
    corners: [Vec3; 6],
    count: usize,
}

impl<'a> UnionSide<'a> {
    pub fn new(
        surface: &TriMesh,
        bvh: &'a TriangleBvh,
        mesh: &'a MedialMesh,
        union: &'a MedialUnion,
        hulls: &'a Hulls,
    ) -> Self {
        let faces = 0..surface.faces.len();
        Self {
            bvh,
            triangles: faces.map(|f| PlanarFrame::new(surface.triangle(f)).0).collect(),
            mesh,
            frames: hulls.cones.iter().map(Cone::frame).collect(),
            axes: Vec3::AXES,
            union,
            hulls,
        }
    }

    pub fn pieces(&self) -> Vec<Piece> {
        let mut pieces = Vec::new();
        let [e, f, g] = self.axes;
        for v in 0..self.mesh.spheres.len() as u32 {
            for signs in 0..8 {
                // Bit `k` of `signs` chooses the half space along axis `k`: one octant each.
                let [x, y, z] = [0, 1, 2].map(|k| if signs >> k & 1 == 0 { 1.0 } else { -1.0 });
                pieces.push(Piece::Round(v, [x * e, y * f, z * g]));
            }
        }
        for (edge, frame) in (0..).zip(&self.frames) {
            if frame.is_some() {
                pieces.extend((0..SECTORS).map(|k| {
                    let sector = [k, k + 1].map(|k| TAU * f64::from(k) / f64::from(SECTORS));
                    Piece::Lateral(edge, [0.0, 1.0], sector)
                }));
            }
        }
        for corners in &self.mesh.faces {
            let corners = corners.map(|v| self.mesh.spheres[v as usize]);
            if let Some(planes) = Slab::new(corners).planes() {
                let flat = planes.normals().map(|n| corners.map(|m| m.centre + m.radius * n));
                pieces.extend(flat.map(Piece::Flat));
            }
        }
        pieces
    }

    pub fn sphere(&self, v: u32) -> Sphere {
        self.mesh.spheres[v as usize]
    }

    /// The interpolated sphere of a cone at a share of its axis, and the cone's frame.
    fn interpolated(&self, edge: u32, share: f64) -> (Sphere, ConeFrame) {
        let [a, b] = self.mesh.edges[edge as usize].map(|v| self.sphere(v));
        (a.lerp(b, share), self.frames[edge as usize].expect("laterals have a frame"))
    }

    /// The corners of a convex polytope around the normals of a curved piece, none of a flat one.
    pub fn normals(&self, piece: &Piece) -> ([Vec3; 6], usize) {
        let mut normals = [Vec3::ZERO; 6];
        match *piece {
            Piece::Flat(_) => (normals, 0),
            Piece::Round(_, [a, b, c]) => {
                // Between the plane of its corners and the parallel tangent plane the piece is
                // within the cone over its corners.
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let height = normal.dot(a).abs();
                ([a, b, c, a / height, b / height, c / height], 6)
            }
            Piece::Lateral(edge, [t0, _], [from, to]) => {
                // Around the axis, between the chord and the tangents at its ends.
                let bulge = 1.0 / (0.5 * (to - from)).cos();
                let (_, frame) = self.interpolated(edge, t0);
                let rings = [(from, 1.0), (0.5 * (from + to), bulge), (to, 1.0)];
                for (normal, (angle, lift)) in normals.iter_mut().zip(rings) {
                    *normal = lateral_normal(&frame, angle, lift);
                }
                (normals, 3)
            }
        }
    }

    pub fn enclose(&self, piece: &Piece) -> Enclosure {
        let (normals, count) = self.normals(piece);
        let normals = &normals[..count];
        match *piece {
            Piece::Flat([a, b, c]) => Enclosure::new((a + b + c) / 3.0, [a, b, c]),
            Piece::Round(v, [a, b, c]) => {
                let Sphere { centre, radius } = self.sphere(v);
                let at = |direction: Vec3| centre + radius * direction;
                Enclosure::new(at((a + b + c).normalize()), normals.iter().map(|&n| at(n)))
            }
            Piece::Lateral(edge, [t0, t1], [from, to]) => {
                let ends = [t0, t1].map(|share| self.interpolated(edge, share).0);
                let corners = ends
                    .into_iter()
                    .flat_map(|end| normals.iter().map(move |&n| end.centre + end.radius * n));
                let (middle, frame) = self.interpolated(edge, 0.5 * (t0 + t1));
                let normal = lateral_normal(&frame, 0.5 * (from + to), 1.0);
                Enclosure::new(middle.centre + middle.radius * normal, corners)
            }
        }
    }
}

/// The normal of a cone's lateral at an angle, with its component across the axis multiplied by
/// `lift`.
pub(super) fn lateral_normal(frame: &ConeFrame, angle: f64, lift: f64) -> Vec3 {
    let (sin, cos) = angle.sin_cos();
    frame.normal(lift * (cos * frame.v + sin * frame.w))
}

impl Enclosure {
    fn new(centre: Vec3, points: impl IntoIterator<Item = Vec3>) -> Self {
        let mut enclosure = Self { centre, corners: [Vec3::ZERO; 6], count: 0 };
        for point in points {
            enclosure.corners[enclosure.count] = point;
            enclosure.count += 1;
        }
        enclosure
    }

    pub fn corners(&self) -> &[Vec3] {
        &self.corners[..self.count]
    }
}

impl Side for UnionSide<'_> {
    type Piece = Piece;

    const SIDE: WitnessSide = WitnessSide::Union;

    fn bound(&self, piece: &Piece, known: f64, enough: f64) -> Bound {
        let enclosure = self.enclose(piece);
        let (centre, corners) = (enclosure.centre, enclosure.corners());
        let reach = farthest(centre, corners);
        let closest = self.bvh.closest(centre);
        let lipschitz = closest.distance + reach;
        // Cheapest exit first; it needs no look at the union, since the piece cannot raise `lower`.
        if lipschitz <= enough && closest.distance <= known {
            return Bound { reached: 0.0, centre, upper: lipschitz };
        }
        let deepest = self.union.deepest_or(centre, &mut 0, burying(reach));
        // The Lipschitz bound first: it costs nothing.
        if deepest.signed < -EXPOSED
            && (deepest.signed + reach < -EXPOSED
                || self.hulls.largest_over(deepest.primitive, corners) < -EXPOSED)
        {
            return Bound { reached: 0.0, centre, upper: 0.0 };
        }
        let reached = if deepest.signed >= -EXPOSED { closest.distance } else { 0.0 };
        if lipschitz <= enough {
            return Bound { reached, centre, upper: lipschitz };
        }
        let triangle = &self.triangles[closest.face as usize];
        // The distance to one triangle is convex, so its largest value is at a corner.
        let squared = corners.iter().map(|&corner| triangle.distance_squared(corner));
        let convex = squared.fold(0.0, f64::max).sqrt();
        Bound { reached, centre, upper: lipschitz.min(convex) }
    }

    fn divide(&self, piece: &Piece, parts: &mut Vec<Piece>) {
        match *piece {
            Piece::Flat(triangle) => {
                parts.extend(quartered(triangle, Vec3::midpoint).map(Piece::Flat));
            }
            Piece::Round(v, corners) => {
                let parts_of = quartered(corners, |a, b| (a + b).normalize());
                parts.extend(parts_of.map(|corners| Piece::Round(v, corners)));
            }
            Piece::Lateral(edge, [t0, t1], [from, to]) => {
                let [(first, _), (second, _)] = [t0, t1].map(|t| self.interpolated(edge, t));
                let around = (to - from) * first.radius.max(second.radius);
                // The longer direction, so that pieces stay compact and the bounds sharp.
                if around > first.centre.distance(second.centre) {
                    let middle = 0.5 * (from + to);
                    let halves = [[from, middle], [middle, to]];
                    parts.extend(halves.map(|sector| Piece::Lateral(edge, [t0, t1], sector)));
                } else {
                    let middle = 0.5 * (t0 + t1);
                    let halves = [[t0, middle], [middle, t1]];
                    parts.extend(halves.map(|shares| Piece::Lateral(edge, shares, [from, to])));
                }
            }
        }
    }
}
