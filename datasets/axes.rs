//! Medial axes that are known in closed form.
//!
//! Flat sheets and straight edges, on which the radius is linear, are exact. Curved ones are
//! triangulated finely, with vertices on the true axis; the tolerance bounds the rest.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};

use crate::curves::Curve;
use crate::geodesic::unit_sphere;
use crate::profiles::triangle;
use crate::shapes::{
    BLIND_HOLE, BLIND_HOLE_RADIUS, BOX_HALF, BRACKET, BRACKET_ELBOW, CAVITY, CHAIN, COIL,
    CORE_HALF, ELLIPSOID, FILLETED_ELBOW, FRUSTUM, HOLE, HOLED_HALF, PAIR_BALL, PAIR_CAPSULE,
    PLATE_HALF, RIB, RIB_HALF, ROD_APEX, ROD_HALF, ROD_RADIUS, ROUNDING, TORUS, TUBE, TUBE_RADIUS,
    WEDGE, coil_centre, coil_length,
};
use crate::strips::around_hole;

/// The medial axis of a built-in shape, known without sampling, in the shape's own coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownAxis {
    /// The axis with its radii.
    pub mesh: MedialMesh,
    /// How far `mesh` may be from the true axis, in centres and in radii, both ways; in the
    /// shape's own unit. Zero where it is exact up to rounding: no curved sheet or curve.
    pub tolerance: f64,
}

/// Rings of a triangulated disc, and vertices that each has more than the one inside it.
const DISC_RINGS: u32 = 32;
const DISC_SECTORS: u32 = 6;
/// Edges of a triangulated circle.
const CIRCLE_EDGES: u32 = 360;

fn known(
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    tolerance: f64,
) -> KnownAxis {
    let mesh = MedialMesh::from_simplices(spheres, edges, faces).expect("a generated complex");
    KnownAxis { mesh, tolerance }
}

/// One point.
pub(crate) fn sphere() -> KnownAxis {
    known(vec![Sphere::new(Vec3::ZERO, 1.0)], vec![], vec![], 0.0)
}

/// For semi-axes `a > b > c` the disc `(a x / (a^2 - c^2))^2 + (b y / (b^2 - c^2))^2 <= 1` in the
/// plane `z = 0`, with `r^2 = c^2 (1 - x^2 / (a^2 - c^2) - y^2 / (b^2 - c^2))`.
///
/// The normal at a surface point `p` meets the plane where `x = p.x (1 - c^2 / a^2)`, likewise
/// `y`; the distance to there is `r`, and `p.z` is zero on the rim of the disc.
pub(crate) fn ellipsoid() -> KnownAxis {
    let Vec3 { x: a, y: b, z: c } = ELLIPSOID;
    let (u, v) = (a * a - c * c, b * b - c * c);
    let on_axis = |x: f64, y: f64| {
        Sphere::new(Vec3::new(x, y, 0.0), c * (1.0 - x * x / u - y * y / v).sqrt())
    };
    let (vertices, faces) = disc();
    let spheres = vertices.iter().map(|&[s, t]| {
        // Rings at equal angles of the surface: closer towards the rim, where the radius falls
        // ever more steeply.
        let rho = s.hypot(t);
        let stretch = if rho > 0.0 { (FRAC_PI_2 * rho).sin() / rho } else { 0.0 };
        on_axis(s * stretch * u / a, t * stretch * v / b)
    });
    let mut axis = known(spheres.collect(), vec![], faces, 0.0);
    // The radius is concave, so that it is nearly farthest from linear halfway between vertices.
    let sagging = axis.mesh.edges.iter().map(|edge| {
        let [p, q] = edge.map(|sphere| axis.mesh.spheres[sphere as usize]);
        let middle = p.lerp(q, 0.5);
        on_axis(middle.centre.x, middle.centre.y).radius - middle.radius
    });
    axis.tolerance = 2.0 * sagging.fold(0.0, f64::max) + sagitta(u / a, DISC_SECTORS * DISC_RINGS);
    axis
}

/// How far a regular polygon of `sides` inscribed in a circle stays away from it.
pub(crate) fn sagitta(radius: f64, sides: u32) -> f64 {
    radius * (1.0 - (PI / f64::from(sides)).cos())
}

/// The unit disc in concentric rings: the vertices and triangles, the centre being vertex 0.
fn disc() -> (Vec<[f64; 2]>, Vec<[u32; 3]>) {
    let count = |ring: u32| if ring == 0 { 1 } else { DISC_SECTORS * ring };
    let first = |ring: u32| if ring == 0 { 0 } else { 1 + DISC_SECTORS * ring * (ring - 1) / 2 };
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for ring in 0..=DISC_RINGS {
        let radius = f64::from(ring) / f64::from(DISC_RINGS);
        vertices.extend((0..count(ring)).map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(count(ring))).sin_cos();
            [radius * cos, radius * sin]
        }));
        let inner = |i: u32| first(ring - 1) + i % count(ring - 1);
        let outer = |i: u32| first(ring) + i % count(ring);
        for i in 0..if ring == 0 { 0 } else { count(ring) } {
            // In each sector the inner ring has one vertex less.
            let (sector, step) = (i / ring, i % ring);
            let below = sector * (ring - 1) + step;
            faces.push([inner(below), outer(i), outer(i + 1)]);
            if step + 1 < ring {
                faces.push([inner(below), outer(i + 1), inner(below + 1)]);
            }
        }
    }
    (vertices, faces)
}

/// The 13 sheets of a box with half sides `A > B > C`, from the core outward: the rectangle
/// `|x| <= A - C, |y| <= B - C` at `r = C`, a trapezoid to each horizontal edge of the box, a
/// triangle to each vertical one, all down to `r = 0`; `grown` is added to every radius.
fn box_axis(half: Vec3, grown: f64) -> KnownAxis {
    let signs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let inner = signs.map(|[x, y]| {
        let centre = Vec3::new(x * (half.x - half.z), y * (half.y - half.z), 0.0);
        Sphere::new(centre, half.z + grown)
    });
    let corners = |z: f64| {
        signs.map(|[x, y]| Sphere::new(Vec3::new(x * half.x, y * half.y, z * half.z), grown))
    };
    let spheres = [inner, corners(-1.0), corners(1.0)].concat();
    let mut faces = vec![[0, 1, 2], [0, 2, 3]];
    for i in 0..4 {
        let j = (i + 1) % 4;
        faces.push([i, 4 + i, 8 + i]);
        for level in [4, 8] {
            faces.extend([[i, j, level + j], [i, level + j, level + i]]);
        }
    }
    known(spheres, vec![], faces, 0.0)
}

pub(crate) fn cuboid() -> KnownAxis {
    box_axis(BOX_HALF, 0.0)
}

pub(crate) fn plate() -> KnownAxis {
    box_axis(PLATE_HALF, 0.0)
}

/// Growing a convex solid by a ball adds to the distance to its surface everywhere inside, and no
/// point outside the core has two nearest points.
pub(crate) fn rounded_box() -> KnownAxis {
    box_axis(CORE_HALF, ROUNDING)
}

pub(crate) fn capsule() -> KnownAxis {
    let end = |z: f64| Sphere::new(Vec3::new(0.0, 0.0, z), ROD_RADIUS);
    known(vec![end(-ROD_HALF), end(ROD_HALF)], vec![[0, 1]], vec![], 0.0)
}

pub(crate) fn pair() -> KnownAxis {
    let (ball, radius) = PAIR_BALL;
    let (centre, half, capsule_radius) = PAIR_CAPSULE;
    let end = |z: f64| Sphere::new(centre + Vec3::new(0.0, 0.0, z), capsule_radius);
    known(vec![Sphere::new(ball, radius), end(-half), end(half)], vec![[1, 2]], vec![], 0.0)
}

/// The axis of the cylinder and, at each end, a cone out to the crease.
///
/// With the cone's half angle `phi`, a point at distance `rho` from the axis and height `z` is
/// `R - rho` from the cylinder and `(apex - z) sin phi - rho cos phi` from the cone. On the axis
/// these are equal at `z* = apex - R / sin phi`: radius `R` up to there, and down to 0 at the
/// apex. Off the axis they are equal on the cone from there to the crease, with `r = R - rho`.
pub(crate) fn rod() -> KnownAxis {
    let sin_phi = ROD_RADIUS / ROD_RADIUS.hypot(ROD_APEX - ROD_HALF);
    let fork = ROD_APEX - ROD_RADIUS / sin_phi;
    let (vertices, disc_faces) = disc();
    let (mut spheres, mut edges, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for side in [-1.0, 1.0] {
        let first = spheres.len() as u32;
        spheres.extend(vertices.iter().map(|&[s, t]| {
            // Rings at squares: an inner ring has fewer vertices, so it must be smaller in
            // proportion for its chords to stay as close to the cone as those of the crease.
            let rho = s.hypot(t);
            let centre = Vec3::new(
                ROD_RADIUS * s * rho,
                ROD_RADIUS * t * rho,
                side * (fork + (ROD_HALF - fork) * rho * rho),
            );
            Sphere::new(centre, ROD_RADIUS * (1.0 - rho * rho).max(0.0))
        }));
        faces.extend(disc_faces.iter().map(|face| face.map(|v| v + first)));
        edges.push([first, spheres.len() as u32]);
        spheres.push(Sphere::new(Vec3::new(0.0, 0.0, side * ROD_APEX), 0.0));
    }
    edges.push([0, spheres.len() as u32 / 2]);
    known(spheres, edges, faces, 1.5 * sagitta(ROD_RADIUS, DISC_SECTORS * DISC_RINGS))
}

/// The circle of the tube's centres.
pub(crate) fn torus() -> KnownAxis {
    let (major, minor) = TORUS;
    let spheres = (0..CIRCLE_EDGES).map(|i| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(CIRCLE_EDGES)).sin_cos();
        Sphere::new(Vec3::new(major * cos, major * sin, 0.0), minor)
    });
    let edges = (0..CIRCLE_EDGES).map(|i| [i, (i + 1) % CIRCLE_EDGES]).collect();
    known(spheres.collect(), edges, vec![], sagitta(major, CIRCLE_EDGES))
}

/// The centre line of the pipe: its curvature is below one over the pipe's radius, and its turns
/// are farther apart than two of those.
pub(crate) fn coil() -> KnownAxis {
    let (radius, pitch, turns, pipe) = COIL;
    let (length, last) = (coil_length(), 2 * CIRCLE_EDGES);
    let at = |i: u32| coil_centre(length * (f64::from(i) / f64::from(last) - 0.5));
    let spheres = (0..=last).map(|i| Sphere::new(at(i), pipe)).collect();
    let edges = (0..last).map(|i| [i, i + 1]).collect();
    // The circle that osculates the helix has the radius R + (P / 2 pi)^2 / R.
    let rise = pitch / TAU;
    let osculating = radius + rise * rise / radius;
    let sides = TAU * osculating / (turns * (TAU * radius).hypot(pitch)) * f64::from(last);
    known(spheres, edges, vec![], sagitta(osculating, sides as u32))
}

/// The sphere halfway between outer surface and cavity.
pub(crate) fn hollow_sphere() -> KnownAxis {
    const FREQUENCY: u32 = 24;
    let middle = (1.0 + CAVITY) / 2.0;
    let mesh = unit_sphere(FREQUENCY);
    // The planes of the triangles come nearest to the centre at their circumcentres.
    let nearest = (0..mesh.faces.len())
        .map(|face| {
            let [a, b, c] = mesh.triangle(face);
            (b - a).cross(c - a).normalize().dot(a)
        })
        .fold(1.0, f64::min);
    let radius = (1.0 - CAVITY) / 2.0;
    let spheres = mesh.vertices.iter().map(|&v| Sphere::new(v * middle, radius)).collect();
    known(spheres, vec![], mesh.faces, middle * (1.0 - nearest))
}

/// Three sheets along the edges of the prism, and three below each end.
pub(crate) fn wedge() -> KnownAxis {
    let Vec3 { x: half, y: half_length, z: height } = WEDGE;
    triangle(half, height).prism(0.0, half_length)
}

/// Flat middle sheets of the two plates, a sheet from the outer edge, and between them two parabolic cylinders
/// about the reflex edge.
pub(crate) fn bracket() -> KnownAxis {
    BRACKET_ELBOW.profile().prism(BRACKET.y / 2.0, BRACKET.y / 2.0)
}

/// As of the bracket; the parabolas' focus is the centre of the fillet.
pub(crate) fn fillet() -> KnownAxis {
    FILLETED_ELBOW.profile().prism(BRACKET.y / 2.0, BRACKET.y / 2.0)
}

/// The middle sheets of plate and rib, joined below the rib by parabolic cylinders about both reflex edges.
pub(crate) fn rib() -> KnownAxis {
    RIB.profile().prism(0.0, RIB_HALF)
}

/// A segment and, at each end, a cone out to the crease.
pub(crate) fn frustum() -> KnownAxis {
    FRUSTUM.half_profile().revolved()
}

/// The middle disc of the bottom and the middle cylinder of the wall, joined by two surfaces of revolution of
/// parabolas about the reflex edge, and cones to the creases.
pub(crate) fn blind_hole() -> KnownAxis {
    BLIND_HOLE.mirrored(BLIND_HOLE_RADIUS).revolved()
}

/// Parts of each side of the rectangles of the holed plate.
const HOLED_SIDE: u32 = 60;

/// The axis of a box, but its middle sheet ends where the hole is as near as the plate's faces; from there two
/// cones of 45 degrees go to the edges of the hole.
///
/// With half thickness `c` and a hole of radius `R` about y, the hole is nearest where `rho - R < c - |y|`.
pub(crate) fn holed_plate() -> KnownAxis {
    let Vec3 { x: a, y: c, z: b } = HOLED_HALF;
    let level = around_hole(HOLE + c, [a - c, b - c], [HOLED_SIDE; 2]);
    let creases = around_hole(HOLE, [a, b], [HOLED_SIDE; 2]);
    // The rings of the middle sheet, then those of both faces: of the rectangle, and of the circle.
    let rings = [(&level, 0.0, c), (&creases, -c, 0.0), (&creases, c, 0.0)];
    let spheres = rings.iter().flat_map(|&(lines, y, radius)| {
        let ring = move |end: usize| lines.iter().map(move |line| (line[end], y, radius));
        ring(0).chain(ring(1))
    });
    let spheres = spheres.map(|([x, z], y, radius)| Sphere::new(Vec3::new(x, y, z), radius));
    let sides = level.len() as u32;
    let mut faces = Vec::new();
    for (from, to) in [(0, 1), (0, 2), (0, 4), (1, 3), (1, 5)] {
        for i in 0..sides {
            let at = |ring: u32, i: u32| ring * sides + i % sides;
            faces.push([at(from, i), at(from, i + 1), at(to, i + 1)]);
            faces.push([at(from, i), at(to, i + 1), at(to, i)]);
        }
    }
    // A triangle to each upright edge.
    faces.extend((0..4).map(|k| [0, 2, 4].map(|ring| ring * sides + k * HOLED_SIDE)));
    // The longest arc is less than a third of the circle. Chords err in position, and as much in radius.
    known(spheres.collect(), vec![], faces, 1.5 * sagitta(HOLE + c, 3 * HOLED_SIDE))
}

/// The balls along the segment of their centres; radii are linear between neighbours.
pub(crate) fn chain() -> KnownAxis {
    let ball = |&(z, radius): &(f64, f64)| Sphere::new(Vec3::new(0.0, 0.0, z), radius);
    let spheres: Vec<Sphere> = CHAIN.iter().map(ball).collect();
    let edges = (1..spheres.len() as u32).map(|i| [i - 1, i]).collect();
    known(spheres, edges, vec![], 0.0)
}

/// The centre curve: its curvature is below one over the tube's radius, and it stays away from itself.
pub(crate) fn tube() -> KnownAxis {
    let curve = TUBE;
    let Curve { start, end, .. } = curve;
    let parts = 2 * CIRCLE_EDGES;
    let at = |share: f64| (curve.place)(start + (end - start) * share);
    let share = |i: u32, offset: f64| (f64::from(i) + offset) / f64::from(parts);
    let spheres = (0..=parts).map(|i| Sphere::new(at(share(i, 0.0)), TUBE_RADIUS)).collect();
    let edges = (0..parts).map(|i| [i, i + 1]).collect();
    let sagging = (0..parts)
        .map(|i| at(share(i, 0.5)).distance(at(share(i, 0.0)).midpoint(at(share(i, 1.0)))))
        .fold(0.0, f64::max);
    known(spheres, edges, vec![], 2.0 * sagging)
}
