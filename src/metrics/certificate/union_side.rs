//! The second side: distances to the surface over the boundary of the union.

use std::f64::consts::TAU;

use super::{Bound, Hulls, Side, WitnessSide, farthest, quartered};
use crate::Vec3;
use crate::complex::{MedialMesh, MedialUnion};
use crate::geometry::planar_frame::PlanarFrame;
use crate::geometry::{Cone, ConeFrame, Slab, Sphere};
use crate::surface::TriMesh;
use crate::surface::TriangleBvh;

/// A point of a primitive's surface is on the boundary of the union, up to rounding, if it is no
/// deeper than this in any primitive.
const EXPOSED: f64 = 1e-12;

/// Initial parts of a cone's lateral around its axis.
const SECTORS: u32 = 6;

/// The surfaces of all primitives against a surface.
pub(super) struct UnionSide<'a> {
    bvh: &'a TriangleBvh,
    triangles: Vec<PlanarFrame>,
    mesh: &'a MedialMesh,
    frames: Vec<Option<ConeFrame>>,
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
struct Enclosure {
    centre: Vec3,
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
            union,
            hulls,
        }
    }

    pub fn pieces(&self) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for v in 0..self.mesh.spheres.len() as u32 {
            for signs in 0..8 {
                let sign = |k: u32| if signs >> k & 1 == 0 { 1.0 } else { -1.0 };
                let corners = [sign(0) * Vec3::X, sign(1) * Vec3::Y, sign(2) * Vec3::Z];
                pieces.push(Piece::Round(v, corners));
            }
        }
        for (edge, frame) in (0..).zip(&self.frames) {
            if frame.is_some() {
                let angle = |k: u32| TAU * f64::from(k) / f64::from(SECTORS);
                let sectors = (0..SECTORS).map(|k| [angle(k), angle(k + 1)]);
                pieces.extend(sectors.map(|sector| Piece::Lateral(edge, [0.0, 1.0], sector)));
            }
        }
        for corners in &self.mesh.faces {
            let corners = corners.map(|v| self.mesh.spheres[v as usize]);
            if let Some(planes) = Slab::new(corners).planes() {
                let touched = |n: Vec3| corners.map(|m| m.centre + m.radius * n);
                pieces.extend(planes.normals().map(|n| Piece::Flat(touched(n))));
            }
        }
        pieces
    }

    fn sphere(&self, v: u32) -> Sphere {
        self.mesh.spheres[v as usize]
    }

    /// The interpolated sphere of a cone at a share of its axis, and the cone's frame.
    fn interpolated(&self, edge: u32, share: f64) -> (Sphere, ConeFrame) {
        let [a, b] = self.mesh.edges[edge as usize].map(|v| self.sphere(v));
        (a.lerp(b, share), self.frames[edge as usize].expect("laterals have a frame"))
    }

    fn enclose(&self, piece: &Piece) -> Enclosure {
        match *piece {
            Piece::Flat([a, b, c]) => Enclosure::new((a + b + c) / 3.0, &[a, b, c]),
            Piece::Round(v, [a, b, c]) => {
                // Between the plane of its corners and the parallel tangent plane the piece is
                // within the cone over its corners.
                let Sphere { centre, radius } = self.sphere(v);
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let height = normal.dot(a).abs();
                let at = |direction: Vec3| centre + radius * direction;
                let beyond = [a, b, c].map(|corner| at(corner / height));
                let middle = at((a + b + c).normalize());
                Enclosure::new(middle, &[at(a), at(b), at(c), beyond[0], beyond[1], beyond[2]])
            }
            Piece::Lateral(edge, shares, [from, to]) => {
                // Around the axis, between the chord and the tangents at its ends.
                let bulge = 1.0 / (0.5 * (to - from)).cos();
                let middle = 0.5 * (from + to);
                let mut corners = [Vec3::ZERO; 6];
                for (k, share) in shares.into_iter().enumerate() {
                    let (sphere, frame) = self.interpolated(edge, share);
                    let rings = [(from, 1.0), (middle, bulge), (to, 1.0)];
                    for (corner, (angle, lift)) in corners[3 * k..].iter_mut().zip(rings) {
                        *corner = lateral_point(sphere, &frame, angle, lift);
                    }
                }
                let (sphere, frame) = self.interpolated(edge, 0.5 * (shares[0] + shares[1]));
                Enclosure::new(lateral_point(sphere, &frame, middle, 1.0), &corners)
            }
        }
    }
}

/// The point of a cone's sphere in the direction of the lateral's normal, with the component of the
/// normal across the axis multiplied by `lift`.
fn lateral_point(sphere: Sphere, frame: &ConeFrame, angle: f64, lift: f64) -> Vec3 {
    let (sin, cos) = angle.sin_cos();
    sphere.centre + sphere.radius * frame.normal(lift * (cos * frame.v + sin * frame.w))
}

impl Enclosure {
    fn new(centre: Vec3, points: &[Vec3]) -> Self {
        let mut corners = [Vec3::ZERO; 6];
        corners[..points.len()].copy_from_slice(points);
        Self { centre, corners, count: points.len() }
    }

    fn corners(&self) -> &[Vec3] {
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
        let deepest = self.union.deepest(centre);
        let held = || self.hulls.largest_over(deepest.primitive, corners) < -EXPOSED;
        if deepest.signed < -EXPOSED && (deepest.signed + reach < -EXPOSED || held()) {
            return Bound { reached: 0.0, centre, upper: 0.0 };
        }
        let reached = if deepest.signed >= -EXPOSED { closest.distance } else { 0.0 };
        if lipschitz <= enough {
            return Bound { reached, centre, upper: lipschitz };
        }
        let triangle = &self.triangles[closest.face as usize];
        let squared = |&corner: &Vec3| triangle.distance_squared(corner);
        let convex = corners.iter().map(squared).fold(0.0, f64::max).sqrt();
        Bound { reached, centre, upper: lipschitz.min(convex) }
    }

    fn divide(&self, piece: &Piece, parts: &mut Vec<Piece>) {
        match *piece {
            Piece::Flat(triangle) => {
                parts.extend(quartered(triangle, Vec3::midpoint).map(Piece::Flat));
            }
            Piece::Round(v, corners) => {
                let middle = |a: Vec3, b: Vec3| (a + b).normalize();
                parts.extend(quartered(corners, middle).map(|c| Piece::Round(v, c)));
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
