//! The built-in shapes: dimensions, and a generator for each that takes the target edge length.

use std::f64::consts::TAU;

use medial::Vec3;
use medial::surface::TriMesh;

use crate::implicit::{Blend, Ellipsoid, Part, polygonise, slide};
use crate::profiles::{
    Elbow, Frustum, HOLED_HALF, Rib, across_elbow, around_hole, flat_triangle, strip,
};
use crate::solids::{
    Ring, boundary, cap, capsule_of, divided, frequency, joined, mapped, mirrored, parts, reversed,
    rings, stacks, surface, torus_grid, unit_sphere,
};

/// Semi-axes of the ellipsoid.
pub(crate) const ELLIPSOID: Vec3 = Vec3::new(1.0, 0.7, 0.45);
/// Half the sides of the box.
pub(crate) const BOX_HALF: Vec3 = Vec3::new(1.5, 1.0, 0.5);
/// Half the sides of the box that is rounded, before it grows by [`ROUNDING`].
pub(crate) const CORE_HALF: Vec3 = Vec3::new(1.0, 0.6, 0.25);
/// Radius of the edges of the rounded box.
pub(crate) const ROUNDING: f64 = 0.25;
/// Half the sides of the plate.
pub(crate) const PLATE_HALF: Vec3 = Vec3::new(1.0, 0.75, 0.05);
/// Length, width and height of the bracket, and the thickness of its two plates.
pub(crate) const BRACKET: Vec3 = Vec3::new(2.0, 1.0, 1.5);
pub(crate) const BRACKET_THICKNESS: f64 = 0.4;
/// Radius of capsule and rod.
pub(crate) const ROD_RADIUS: f64 = 0.4;
/// Half the length of the cylinder of capsule and rod.
pub(crate) const ROD_HALF: f64 = 0.8;
/// Height of the apex of the rod above the centre: cones of 45 degrees.
pub(crate) const ROD_APEX: f64 = ROD_HALF + ROD_RADIUS;
/// Centres of the ball of the pair and of its capsule's ends, and their radii.
pub(crate) const PAIR_BALL: (Vec3, f64) = (Vec3::new(-1.0, 0.0, 0.0), 0.6);
pub(crate) const PAIR_CAPSULE: (Vec3, f64, f64) = (Vec3::new(0.5, 0.0, 0.0), 0.5, 0.3);
/// Radii of the torus.
pub(crate) const TORUS: (f64, f64) = (1.0, 0.4);
/// The coil: radius of its turns, height of one, number of turns, radius of the pipe.
pub(crate) const COIL: (f64, f64, f64, f64) = (1.0, 0.8, 2.0, 0.35);
/// Radius of the cavity of the hollow sphere.
pub(crate) const CAVITY: f64 = 0.5;
/// The wedge: half its base, half its length, its height; the edge on top has 40 degrees.
// The first is 1.2 tan 20 degrees: a constant cannot call the tangent.
pub(crate) const WEDGE: Vec3 = Vec3::new(0.436_764_281_119_441_5, 0.8, 1.2);
/// The bracket as a profile with a reflex corner, and with a fillet in its place.
pub(crate) const BRACKET_ELBOW: Elbow = Elbow {
    length: BRACKET.x,
    height: BRACKET.z,
    foot: BRACKET_THICKNESS,
    leg: BRACKET_THICKNESS,
    fillet: 0.0,
    ends: true,
};
pub(crate) const FILLETED_ELBOW: Elbow = Elbow { fillet: 0.3, ..BRACKET_ELBOW };
/// The plate with a rib, and half its width.
pub(crate) const RIB: Rib = Rib { half: 1.0, plate: 0.3, half_rib: 0.06, height: 1.0 };
pub(crate) const RIB_HALF: f64 = 0.4;
/// Radius of the hole of the plate with a hole.
pub(crate) const HOLE: f64 = 0.5;
/// The frustum.
pub(crate) const FRUSTUM: Frustum = Frustum { below: 0.8, above: 0.4, half: 1.0 };
/// Radius of the cylinder with a blind hole; its wall as a leg, its bottom as half a foot.
pub(crate) const BLIND_HOLE_RADIUS: f64 = 0.8;
pub(crate) const BLIND_HOLE: Elbow = Elbow {
    length: BLIND_HOLE_RADIUS,
    height: 1.2,
    foot: 0.45,
    leg: 0.4,
    fillet: 0.0,
    ends: false,
};
// Half the sides of bounding boxes, where they are not the dimensions themselves.

pub(crate) const ROUNDED_EXTENT: Vec3 =
    Vec3::new(CORE_HALF.x + ROUNDING, CORE_HALF.y + ROUNDING, CORE_HALF.z + ROUNDING);
pub(crate) const BRACKET_EXTENT: Vec3 =
    Vec3::new(BRACKET.x / 2.0, BRACKET.y / 2.0, BRACKET.z / 2.0);
/// The cones of the rod are as high as the hemispheres of the capsule.
pub(crate) const ROD_EXTENT: Vec3 = Vec3::new(ROD_RADIUS, ROD_RADIUS, ROD_APEX);
/// From the far side of the ball to that of the capsule; the capsule is longer than the ball is thick.
pub(crate) const PAIR_EXTENT: Vec3 = Vec3::new(
    (PAIR_CAPSULE.0.x + PAIR_CAPSULE.2 - (PAIR_BALL.0.x - PAIR_BALL.1)) / 2.0,
    PAIR_BALL.1,
    PAIR_CAPSULE.1 + PAIR_CAPSULE.2,
);
pub(crate) const TORUS_EXTENT: Vec3 = Vec3::new(TORUS.0 + TORUS.1, TORUS.0 + TORUS.1, TORUS.1);
pub(crate) const COIL_EXTENT: Vec3 =
    Vec3::new(COIL.0 + COIL.3, COIL.0 + COIL.3, COIL.1 * COIL.2 / 2.0 + COIL.3);
pub(crate) const WEDGE_EXTENT: Vec3 = Vec3::new(WEDGE.x, WEDGE.y, WEDGE.z / 2.0);
pub(crate) const RIB_EXTENT: Vec3 = Vec3::new(RIB.half, RIB_HALF, RIB.height / 2.0);
pub(crate) const FRUSTUM_EXTENT: Vec3 = Vec3::new(FRUSTUM.below, FRUSTUM.below, FRUSTUM.half);
pub(crate) const BLIND_HOLE_EXTENT: Vec3 =
    Vec3::new(BLIND_HOLE_RADIUS, BLIND_HOLE_RADIUS, BLIND_HOLE.height / 2.0);
/// Bounding-box diagonals of the blended shapes, as measured on fine meshes.
pub(crate) const DOUBLE_TORUS_DIAGONAL: f64 = 4.017;
pub(crate) const FRAME_DIAGONAL: f64 = 3.166;
pub(crate) const BLOB_DIAGONAL: f64 = 3.189;

pub(crate) fn diagonal_of(half: Vec3) -> f64 {
    2.0 * half.length()
}

pub(crate) fn sphere(edge: f64) -> TriMesh {
    unit_sphere(frequency(1.0, edge))
}

/// A stretched geodesic sphere whose vertices then slide on the ellipsoid until they are even.
pub(crate) fn ellipsoid(edge: f64) -> TriMesh {
    let mean_radius = ELLIPSOID.element_sum() / 3.0;
    let mut mesh = mapped(unit_sphere(frequency(mean_radius, edge)), |p| p * ELLIPSOID);
    let sides = mesh.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    slide(&Ellipsoid(ELLIPSOID), &mut mesh.vertices, &sides, 30);
    mesh
}

pub(crate) fn grid_box(half: Vec3, edge: f64) -> TriMesh {
    let ticks = half.to_array().map(|h| divided(&[-h, h], edge));
    boundary(&ticks, |_| true, |p| p)
}

/// A grid on the box of the same size, pushed onto the rounded box along the direction from the
/// nearest point of the core. Ticks at equal angles make equal arcs.
pub(crate) fn rounded_box(edge: f64) -> TriMesh {
    let eighth = std::f64::consts::FRAC_PI_4;
    let n = parts(ROUNDING * eighth, edge, 1);
    let ticks = CORE_HALF.to_array().map(|h| {
        let arc: Vec<f64> =
            (1..=n).map(|k| h + ROUNDING * (eighth * f64::from(k) / f64::from(n)).tan()).collect();
        let low = arc.iter().rev().map(|x| -x);
        low.chain(divided(&[-h, h], edge)).chain(arc.iter().copied()).collect()
    });
    boundary(
        &ticks,
        |_| true,
        |p| {
            let core = p.clamp(-CORE_HALF, CORE_HALF);
            core + (p - core).normalize() * ROUNDING
        },
    )
}

pub(crate) fn bracket(edge: f64) -> TriMesh {
    let Vec3 { x, y, z } = BRACKET;
    let ticks = [
        divided(&[0.0, BRACKET_THICKNESS, x], edge),
        divided(&[0.0, y], edge),
        divided(&[0.0, BRACKET_THICKNESS, z], edge),
    ];
    boundary(&ticks, |p| p.x < BRACKET_THICKNESS || p.z < BRACKET_THICKNESS, |p| p)
}

/// A capsule bent along a helix: sections stay in the planes normal to it, and its ends straight.
pub(crate) fn coil(edge: f64) -> TriMesh {
    let (_, _, _, pipe) = COIL;
    let half = coil_length() / 2.0;
    mapped(capsule_of(half, pipe, edge), |p| {
        let along = p.z.clamp(-half, half);
        let [tangent, normal, binormal] = coil_frame(along);
        coil_centre(along) + tangent * (p.z - along) + normal * p.x + binormal * p.y
    })
}

/// Length of the coil's centre line.
pub(crate) fn coil_length() -> f64 {
    let (radius, pitch, turns, _) = COIL;
    turns * (TAU * radius).hypot(pitch)
}

/// The point of the coil's centre line at an arc length from its middle.
pub(crate) fn coil_centre(along: f64) -> Vec3 {
    let (radius, pitch, _, _) = COIL;
    // One turn has the length of the hypotenuse of its circle and its pitch, unrolled.
    let turn = along / (TAU * radius).hypot(pitch);
    let (sin, cos) = (TAU * turn).sin_cos();
    Vec3::new(radius * cos, radius * sin, pitch * turn)
}

/// Tangent, normal and binormal there.
fn coil_frame(along: f64) -> [Vec3; 3] {
    let (radius, pitch, _, _) = COIL;
    let speed = (TAU * radius).hypot(pitch);
    let (sin, cos) = (TAU * along / speed).sin_cos();
    let tangent = Vec3::new(-TAU * radius * sin, TAU * radius * cos, pitch) / speed;
    let normal = Vec3::new(-cos, -sin, 0.0);
    [tangent, normal, tangent.cross(normal)]
}

pub(crate) fn rod(edge: f64) -> TriMesh {
    let height = ROD_APEX - ROD_HALF;
    let steps = parts(height.hypot(ROD_RADIUS), edge, 2);
    let top: Vec<Ring> = cap(steps, |t| (ROD_RADIUS * t, ROD_APEX - height * t));
    surface(&mirrored(&top, stacks(ROD_HALF, ROD_RADIUS, steps)))
}

pub(crate) fn pair(edge: f64) -> TriMesh {
    let (ball, radius) = PAIR_BALL;
    let (centre, half, capsule_radius) = PAIR_CAPSULE;
    let first = mapped(unit_sphere(frequency(radius, edge)), |p| p * radius + ball);
    joined(first, mapped(capsule_of(half, capsule_radius, edge), |p| p + centre))
}

pub(crate) fn torus(edge: f64) -> TriMesh {
    let (major, minor) = TORUS;
    torus_grid(major, minor, parts(TAU * major, edge, 8), parts(TAU * minor, edge, 6))
}

pub(crate) fn hollow_sphere(edge: f64) -> TriMesh {
    // Turned over, because faces look away from the solid, here into the cavity.
    let cavity = mapped(unit_sphere(frequency(CAVITY, edge)), |p| p * CAVITY);
    joined(sphere(edge), reversed(cavity))
}

pub(crate) fn wedge(edge: f64) -> TriMesh {
    let Vec3 { x: half, y: half_length, z: height } = WEDGE;
    // The base is shorter than the other sides: parts of about `edge` in their mean.
    let mean_side = (2.0 * half + 2.0 * half.hypot(height)) / 3.0;
    flat_triangle(half, height, parts(mean_side, edge, 2)).prism(0.0, half_length, edge)
}

pub(crate) fn fillet(edge: f64) -> TriMesh {
    let lines = across_elbow(&FILLETED_ELBOW, edge);
    let half = BRACKET.y / 2.0;
    strip(&lines, parts(BRACKET_THICKNESS, edge, 1), false).prism(half, half, edge)
}

pub(crate) fn rib(edge: f64) -> TriMesh {
    let Rib { half, plate, half_rib, height } = RIB;
    let ticks = [
        divided(&[-half, -half_rib, half_rib, half], edge),
        divided(&[-RIB_HALF, RIB_HALF], edge),
        divided(&[0.0, plate, height], edge),
    ];
    boundary(&ticks, |p| p.z < plate || p.x.abs() < half_rib, |p| p)
}

pub(crate) fn holed_plate(edge: f64) -> TriMesh {
    let Vec3 { x, y, z } = HOLED_HALF;
    let corner = z.atan2(x);
    // Between a side of the plate and its arc of the hole.
    let upright = parts((2.0 * z + 2.0 * corner * HOLE) / 2.0, edge, 2);
    let level = parts((2.0 * x + (TAU / 2.0 - 2.0 * corner) * HOLE) / 2.0, edge, 2);
    let lines = around_hole(HOLE, [x, z], [upright, level]);
    let mean_width = (x + z) / 2.0 - HOLE;
    strip(&lines, parts(mean_width, edge, 1), true).prism(0.0, y, edge)
}

pub(crate) fn frustum(edge: f64) -> TriMesh {
    let Frustum { below, above, half } = FRUSTUM;
    // From the top pole down, as `surface` orients its faces.
    let corners = [(0.0, half), (above, half), (below, -half), (0.0, -half)];
    surface(&rings(&corners, edge))
}

pub(crate) fn blind_hole(edge: f64) -> TriMesh {
    let Elbow { height, foot, leg, .. } = BLIND_HOLE;
    let (outer, inner) = (BLIND_HOLE_RADIUS, BLIND_HOLE_RADIUS - leg);
    let corners =
        [(0.0, foot), (inner, foot), (inner, height), (outer, height), (outer, 0.0), (0.0, 0.0)];
    surface(&rings(&corners, edge))
}

pub(crate) fn double_torus(edge: f64) -> TriMesh {
    // Genus 2 has the Euler number 2 - 2 * 2.
    polygonise(&double_torus_field(), Vec3::new(1.8, 1.0, 0.3), edge, -2)
}

pub(crate) fn double_torus_field() -> Blend {
    let centres = [-0.8, 0.8].map(|x| Vec3::new(x, 0.0, 0.0));
    let rings = centres.map(|centre| Part::Torus { centre, major: 0.7, minor: 0.25 });
    Blend { parts: rings.to_vec(), sharpness: 20.0 }
}

pub(crate) fn frame(edge: f64) -> TriMesh {
    // Six edges on four corners leave three independent loops: 2 - 2 * 3.
    polygonise(&frame_field(), Vec3::splat(1.0), edge, -4)
}

pub(crate) fn frame_field() -> Blend {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let corners = corners.map(|c| Vec3::from(c) * 0.7);
    let pairs = (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j)));
    let tubes = pairs.map(|(i, j)| Part::Tube { a: corners[i], b: corners[j], radius: 0.17 });
    Blend { parts: tubes.collect(), sharpness: 25.0 }
}

pub(crate) fn blob(edge: f64) -> TriMesh {
    polygonise(&blob_field(), Vec3::new(1.7, 0.8, 1.0), edge, 2)
}

pub(crate) fn blob_field() -> Blend {
    let tubes = [
        ([-0.5, 0.0, 0.0], [0.45, 0.05, 0.05], 0.32),
        ([0.75, 0.05, 0.38], [0.95, 0.05, 0.42], 0.24),
        ([-0.75, 0.0, 0.1], [-1.25, 0.1, 0.42], 0.14),
        ([0.4, 0.25, -0.1], [0.55, 0.42, -0.65], 0.15),
        ([0.4, -0.2, -0.1], [0.65, -0.38, -0.62], 0.15),
        ([-0.5, 0.25, -0.1], [-0.6, 0.4, -0.66], 0.16),
        ([-0.5, -0.25, -0.1], [-0.42, -0.42, -0.64], 0.16),
    ];
    let tubes = tubes.map(|(a, b, radius)| Part::Tube { a: a.into(), b: b.into(), radius });
    Blend { parts: tubes.to_vec(), sharpness: 14.0 }
}
