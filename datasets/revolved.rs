//! Surfaces of revolution about the z axis, from pole to pole, with rings that grow in step with
//! their radius so that triangles keep their shape.

use std::f64::consts::TAU;

use medial::Vec3;
use medial::surface::TriMesh;

/// Vertices that each ring of a cap has more than the one above it.
pub(crate) const SECTORS: u32 = 5;

/// A circle of vertices about the z axis, or a pole when `count` is 1.
#[derive(Clone, Copy)]
pub(crate) struct Ring {
    pub(crate) count: u32,
    pub(crate) radius: f64,
    pub(crate) z: f64,
}

/// The closed surface through rings given from the top pole to the bottom pole.
pub(crate) fn surface(rings: &[Ring]) -> TriMesh {
    let mut mesh = TriMesh::default();
    let mut above: Option<(Ring, u32)> = None;
    for &ring in rings {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend((0..ring.count).map(|i| point(ring, i)));
        if let Some((upper, first_upper)) = above {
            connect(&mut mesh.faces, (upper.count, first_upper), (ring.count, first));
        }
        above = Some((ring, first));
    }
    mesh
}

fn point(ring: Ring, i: u32) -> Vec3 {
    if ring.count == 1 {
        return Vec3::new(0.0, 0.0, ring.z);
    }
    let (sin, cos) = (TAU * f64::from(i) / f64::from(ring.count)).sin_cos();
    Vec3::new(ring.radius * cos, ring.radius * sin, ring.z)
}

/// The strip between two rings, each given by its count and first vertex: always the next vertex
/// of the ring that lags behind, in angle.
fn connect(faces: &mut Vec<[u32; 3]>, upper: (u32, u32), lower: (u32, u32)) {
    let at = |(count, first): (u32, u32), i: u32| first + i % count;
    // A pole has no side of its own: its ring does not advance.
    let sides = |count: u32| if count == 1 { 0 } else { count };
    let (upper_sides, lower_sides) = (sides(upper.0), sides(lower.0));
    let (mut i, mut j) = (0, 0);
    while i < upper_sides || j < lower_sides {
        let lower_lags =
            (u64::from(j) + 1) * u64::from(upper.0) <= (u64::from(i) + 1) * u64::from(lower.0);
        if i == upper_sides || (j < lower_sides && lower_lags) {
            faces.push([at(upper, i), at(lower, j), at(lower, j + 1)]);
            j += 1;
        } else {
            faces.push([at(upper, i), at(lower, j), at(upper, i + 1)]);
            i += 1;
        }
    }
}

/// A cap of `steps` rings from a pole outward; `profile` gives radius and z at `t` in 0..=1.
pub(crate) fn cap(steps: u32, profile: impl Fn(f64) -> (f64, f64)) -> Vec<Ring> {
    let ring = |k: u32| {
        let (radius, z) = profile(f64::from(k) / f64::from(steps));
        Ring { count: if k == 0 { 1 } else { SECTORS * k }, radius, z }
    };
    (0..=steps).map(ring).collect()
}

/// The rings of a solid that is symmetric about `z = 0`: the cap on top, a cylinder of `stacks`
/// equal parts below it down to its mirror image, and the mirrored cap.
pub(crate) fn mirrored(top: &[Ring], stacks: u32) -> Vec<Ring> {
    let rim = top[top.len() - 1];
    let between = (1..stacks).map(|k| {
        let z = rim.z * (1.0 - 2.0 * f64::from(k) / f64::from(stacks));
        Ring { z, ..rim }
    });
    let bottom = top.iter().rev().map(|&ring| Ring { z: -ring.z, ..ring });
    top.iter().copied().chain(between).chain(bottom).collect()
}

/// A part of a profile, which is divided evenly.
#[derive(Clone, Copy)]
pub(crate) enum Piece {
    /// A segment; both ends as radius and z.
    Line { from: (f64, f64), to: (f64, f64) },
    /// An arc about `(0, z)`; the angles are those to the z axis.
    Zone { z: f64, radius: f64, from: f64, to: f64 },
}

impl Piece {
    /// The segments between corners.
    pub(crate) fn between(corners: &[(f64, f64)]) -> Vec<Self> {
        corners.windows(2).map(|pair| Self::Line { from: pair[0], to: pair[1] }).collect()
    }

    /// Radius and z at a share of the way.
    pub(crate) fn at(&self, t: f64) -> (f64, f64) {
        match *self {
            Self::Line { from, to } => {
                (from.0 * (1.0 - t) + to.0 * t, from.1 * (1.0 - t) + to.1 * t)
            }
            Self::Zone { z, radius, from, to } => {
                let (sin, cos) = (from * (1.0 - t) + to * t).sin_cos();
                (radius * sin, z + radius * cos)
            }
        }
    }

    fn length(&self) -> f64 {
        match *self {
            Self::Line { from, to } => (to.0 - from.0).hypot(to.1 - from.1),
            Self::Zone { radius, from, to, .. } => radius * (to - from),
        }
    }
}

/// The rings of a profile from pole to pole with edges of about `edge`: pieces in equal parts, and vertices of a
/// ring in step with its radius.
pub(crate) fn rings(pieces: &[Piece], edge: f64) -> Vec<Ring> {
    let mut points = vec![pieces[0].at(0.0)];
    for piece in pieces {
        let n = parts(piece.length(), edge, 1);
        points.extend((1..=n).map(|k| piece.at(f64::from(k) / f64::from(n))));
    }
    let last = points.len() - 1;
    let ring = |(i, (radius, z)): (usize, (f64, f64))| match i {
        // A pole is a pole, whatever the sine of pi is.
        _ if i == 0 || i == last => Ring { count: 1, radius: 0.0, z },
        _ => Ring { count: SECTORS * parts(TAU * radius / f64::from(SECTORS), edge, 1), radius, z },
    };
    points.into_iter().enumerate().map(ring).collect()
}

/// The number of equal parts of about `edge` in `length`, at least `least`.
pub(crate) fn parts(length: f64, edge: f64, least: u32) -> u32 {
    ((length / edge).round() as u32).max(least)
}
