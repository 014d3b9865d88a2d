//! The surfaces of all primitives of a medial mesh, in pieces that are divided where bounds need it.
//!
//! The boundary of the union is a part of them. The pieces are tangent triangles of slabs, laterals of
//! cones, and spherical triangles.

use std::f64::consts::TAU;

use crate::Vec3;
use crate::complex::{Incidence, MedialMesh, MedialUnion, NearestPrimitive, Primitive};
use crate::geometry::planar_frame::PlanarFrame;
use crate::geometry::{Cone, ConeFrame, Slab, Sphere};
use crate::surface::TriMesh;

/// The distance from a point to the farthest of some others.
pub(super) fn farthest(from: Vec3, points: &[Vec3]) -> f64 {
    points.iter().fold(0.0, |far, &p| f64::max(far, from.distance_squared(p))).sqrt()
}

/// The largest distance to a triangle over the convex hull of some points.
pub(super) fn largest_distance(triangle: &PlanarFrame, corners: &[Vec3]) -> f64 {
    // The distance is convex.
    corners.iter().map(|&corner| triangle.distance_squared(corner)).fold(0.0, f64::max).sqrt()
}

/// The triangles of a surface.
pub(super) fn planar_frames(surface: &TriMesh) -> Vec<PlanarFrame> {
    (0..surface.faces.len()).map(|face| PlanarFrame::new(surface.triangle(face)).0).collect()
}

/// For each sphere the other ends of its edges, and for each edge the third corners of its faces.
pub(super) fn neighbours(mesh: &MedialMesh) -> [Vec<Vec<Sphere>>; 2] {
    let mut at_spheres = vec![vec![]; mesh.spheres.len()];
    for &[a, b] in &mesh.edges {
        at_spheres[a as usize].push(mesh.spheres[b as usize]);
        at_spheres[b as usize].push(mesh.spheres[a as usize]);
    }
    let mut at_edges = vec![vec![]; mesh.edges.len()];
    for (&[a, b, c], edges) in mesh.faces.iter().zip(Incidence::of(mesh).face_edges()) {
        for (edge, third) in edges.iter().zip([c, b, a]) {
            at_edges[*edge as usize].push(mesh.spheres[third as usize]);
        }
    }
    [at_spheres, at_edges]
}

/// A triangle in four, by the midpoints of its sides.
pub(super) fn quartered(
    [a, b, c]: [Vec3; 3],
    middle: impl Fn(Vec3, Vec3) -> Vec3,
) -> [[Vec3; 3]; 4] {
    let [d, e, f] = [middle(b, c), middle(c, a), middle(a, b)];
    [[a, f, e], [f, b, d], [e, d, c], [d, e, f]]
}

/// Depth in a primitive, as a fraction of the surface's diameter, from which a point is not on the boundary of the union:
/// above rounding.
pub(super) const EXPOSED: f64 = 1e-12;

/// Width of a gap between two primitives, as a fraction of the surface's diameter, up to which it counts as none. Depth in
/// another primitive from which a sample of one counts as buried.
pub(super) const BURIAL: f64 = 1e-7;

/// The signed distance at the centre of a piece below which a primitive buries all of a piece of this reach, and ends a
/// search.
fn burying(reach: f64) -> f64 {
    -(EXPOSED + reach) * (1.0 + 1e-9)
}

/// Number of initial parts of a cone's lateral around its axis.
pub(super) const SECTORS: u32 = 6;

/// The surfaces of all primitives of a medial mesh.
pub(super) struct Patches<'a> {
    mesh: &'a MedialMesh,
    cones: Vec<Cone>,
    slabs: Vec<Slab>,
    /// One for each edge; `None` where one sphere holds the other.
    frames: Vec<Option<ConeFrame>>,
    /// The axes of the octants that spheres are divided into.
    axes: [Vec3; 3],
    /// Of the surface.
    pub diameter: f64,
    /// For each sphere the other ends of its edges, and for each edge the third corners of its faces.
    neighbours: [Vec<Vec<Sphere>>; 2],
}

/// A sphere relative to another one.
struct Other {
    way: Vec3,
    growth: f64,
}

impl Other {
    /// How much farther it reaches in a direction; of a longer vector as well, for convex combinations.
    fn height(&self, n: Vec3) -> f64 {
        n.dot(self.way) + self.growth
    }
}

/// A part of the surface of one primitive.
#[derive(Clone, Copy, Debug)]
pub(super) enum Piece {
    /// A part of a tangent triangle of a slab, and its outward unit normal.
    Flat([Vec3; 3], Vec3),
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

impl<'a> Patches<'a> {
    /// Divisions follow the axes, so that they turn with the shape where the axes do.
    pub fn new(mesh: &'a MedialMesh, axes: [Vec3; 3], diameter: f64) -> Self {
        let cones = mesh.edges.iter().map(|&edge| {
            let [a, b] = mesh.spheres_of(edge);
            Cone::new(a, b)
        });
        let cones: Vec<Cone> = cones.collect();
        let slabs = mesh.faces.iter().map(|&f| Slab::new(mesh.spheres_of(f))).collect();
        let frame = |cone: &Cone| {
            cone.frame().map(|frame| {
                let v = across(&frame, axes);
                ConeFrame { v, w: frame.u.cross(v), ..frame }
            })
        };
        let frames = cones.iter().map(frame).collect();
        Self { mesh, cones, slabs, frames, axes, diameter, neighbours: neighbours(mesh) }
    }

    /// The signed distance of a point to a primitive as a whole convex body, unlike the parts of a [`MedialUnion`].
    pub fn signed(&self, primitive: Primitive, p: Vec3) -> f64 {
        match primitive {
            Primitive::Sphere(v) => self.sphere(v).signed_distance(p),
            Primitive::Edge(e) => self.cones[e as usize].signed_distance(p),
            Primitive::Face(f) => self.slabs[f as usize].signed_distance(p),
        }
    }

    /// The largest signed distance to a primitive over the convex hull of some points.
    pub fn largest_over(&self, primitive: Primitive, corners: &[Vec3]) -> f64 {
        // A convex function is largest over a convex hull at one of its corners.
        corners.iter().fold(f64::NEG_INFINITY, |largest, &p| largest.max(self.signed(primitive, p)))
    }

    /// Whether a primitive contains a convex polytope, by the signed distance at a point that is within `reach` of it.
    pub fn bury(&self, at: NearestPrimitive, reach: f64, corners: &[Vec3]) -> bool {
        // The Lipschitz bound first: it costs nothing.
        at.signed < -EXPOSED
            && (at.signed + reach < -EXPOSED || self.largest_over(at.primitive, corners) < -EXPOSED)
    }

    /// Width of gaps that count as none.
    pub fn gap(&self) -> f64 {
        BURIAL * self.diameter
    }

    /// The initial pieces. Laterals are cut where a face begins or ends to overtop them.
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
            let Some(frame) = frame else { continue };
            let sectors = (0..=SECTORS).map(|k| TAU * f64::from(k) / f64::from(SECTORS));
            let mut cuts: Vec<f64> = sectors.collect();
            let normal = |angle| lateral_normal(frame, angle, 1.0);
            for other in self.others(&Piece::Lateral(edge, [0.0, 1.0], [0.0, TAU])) {
                // The height of the other sphere in the direction of the normal at an angle is a constant
                // and a cosine.
                let [start, quarter, half] =
                    [0.0, 0.25, 0.5].map(|t| other.height(normal(t * TAU)));
                let mean = 0.5 * (start + half);
                let (cos, sin) = (start - mean, quarter - mean);
                let swing = (-mean / cos.hypot(sin)).acos();
                let cuts_of = [-swing, swing].map(|by| (sin.atan2(cos) + by).rem_euclid(TAU));
                // Not a number if the height has the same sign all around.
                cuts.extend(cuts_of.into_iter().filter(|cut| cut.is_finite()));
            }
            cuts.sort_by(f64::total_cmp);
            for sector in cuts.windows(2) {
                let piece = Piece::Lateral(edge, [0.0, 1.0], [sector[0], sector[1]]);
                if !self.is_overtopped_along(&piece, &[normal(0.5 * (sector[0] + sector[1]))]) {
                    pieces.push(piece);
                }
            }
        }
        for corners in &self.mesh.faces {
            let corners = corners.map(|v| self.mesh.spheres[v as usize]);
            if let Some(planes) = Slab::new(corners).planes() {
                pieces.extend(planes.normals().map(|normal| {
                    Piece::Flat(corners.map(|m| m.centre + m.radius * normal), normal)
                }));
            }
        }
        pieces
    }

    /// The spheres that can reach farther than a curved piece.
    fn others(&self, piece: &Piece) -> impl Iterator<Item = Other> {
        let [at_spheres, at_edges] = &self.neighbours;
        let (sphere, others): (_, &[Sphere]) = match *piece {
            Piece::Flat(..) => (0, &[]),
            Piece::Round(v, _) => (v, &at_spheres[v as usize]),
            Piece::Lateral(e, ..) => (self.mesh.edges[e as usize][0], &at_edges[e as usize]),
        };
        let own = self.sphere(sphere);
        others.iter().map(move |other| Other {
            way: other.centre - own.centre,
            growth: other.radius - own.radius,
        })
    }

    /// Whether another sphere reaches farther in the direction of each normal of a curved piece. Then the primitive of both
    /// contains it: a point of a sphere is on the surface of no hull that reaches farther in the direction of its normal.
    pub fn is_overtopped(&self, piece: &Piece) -> bool {
        let (normals, count) = self.normals(piece);
        self.is_overtopped_along(piece, &normals[..count])
    }

    /// As [`is_overtopped`](Self::is_overtopped), in these directions alone.
    pub fn is_overtopped_along(&self, piece: &Piece, normals: &[Vec3]) -> bool {
        self.others(piece).any(|other| normals.iter().all(|&n| other.height(n) > EXPOSED))
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
            Piece::Flat(..) => (normals, 0),
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

    /// The outward normal in the middle of a piece.
    fn normal(&self, piece: &Piece) -> Vec3 {
        match *piece {
            Piece::Flat(_, normal) => normal,
            Piece::Round(_, [a, b, c]) => (a + b + c).normalize(),
            Piece::Lateral(edge, [t0, t1], [from, to]) => {
                let (_, frame) = self.interpolated(edge, 0.5 * (t0 + t1));
                lateral_normal(&frame, 0.5 * (from + to), 1.0)
            }
        }
    }

    /// The primitive that is deepest in the middle of a piece, searched from that at `near`; `None` where one contains
    /// the whole piece.
    ///
    /// Tried for the piece moved outward by the width of a gap before: a wall between primitives that touch is inside their
    /// union, although each of its points is on the surface of both. The piece that is not moved is tried where that
    /// differs, since next to the wall a moved piece may cross from one primitive to the other.
    pub fn unburied(
        &self,
        union: &MedialUnion,
        piece: &Piece,
        enclosure: &Enclosure,
        near: &mut usize,
    ) -> Option<NearestPrimitive> {
        let reach = enclosure.reach();
        let mut deepest_at = |outward: Vec3| {
            let corners = enclosure.corners.map(|corner| corner + outward);
            let deepest = union.deepest_or(enclosure.centre + outward, near, burying(reach));
            let is_buried = self.bury(deepest, reach, &corners[..enclosure.count]);
            (!is_buried).then_some(deepest)
        };
        let moved = deepest_at(self.gap() * self.normal(piece))?;
        if moved.signed >= self.gap() - EXPOSED {
            return Some(moved);
        }
        let deepest = deepest_at(Vec3::ZERO)?;
        Some(if moved.signed < deepest.signed { moved } else { deepest })
    }

    pub fn enclose(&self, piece: &Piece) -> Enclosure {
        let (normals, count) = self.normals(piece);
        let normals = &normals[..count];
        match *piece {
            Piece::Flat([a, b, c], _) => Enclosure::new((a + b + c) / 3.0, [a, b, c]),
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

    /// Appends pieces that together cover a piece.
    pub fn divide(&self, piece: &Piece, parts: &mut Vec<Piece>) {
        match *piece {
            Piece::Flat(triangle, normal) => {
                let quarters = quartered(triangle, Vec3::midpoint);
                parts.extend(quarters.map(|quarter| Piece::Flat(quarter, normal)));
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

/// The unit vector orthogonal to a cone's axis in the direction of the first of `axes` that is not
/// nearly parallel to the cone's axis.
pub(super) fn across(frame: &ConeFrame, axes: [Vec3; 3]) -> Vec3 {
    let [x, y, _] = axes;
    // Below one half, so that one of two orthogonal axes always qualifies; not a simple fraction, so
    // that rounding does not decide for symmetric shapes.
    let is_across = x.reject_from_normalized(frame.u).length_squared() > 0.2137;
    frame.across(if is_across { x } else { y }).unwrap_or(frame.v)
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

    /// The distance from the centre within which the piece is.
    pub fn reach(&self) -> f64 {
        farthest(self.centre, self.corners())
    }

    pub fn corners(&self) -> &[Vec3] {
        &self.corners[..self.count]
    }
}
