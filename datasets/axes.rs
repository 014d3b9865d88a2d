//! Medial axes that are known in closed form.
//!
//! Flat sheets and straight edges, on which the radius is linear, are exact. Curved ones are
//! triangulated finely, with vertices on the true axis; the tolerance bounds the rest.

use std::f64::consts::{FRAC_PI_2, TAU};

use medial::Vec3;
use medial::complex::Sphere;

use crate::bisectors::{KnownAxis, known, on_z, sagitta};
use crate::profiles::{HOLED_HALF, around_hole};
use crate::shapes::{
    CAVITY, COIL, CORE_HALF, ELLIPSOID, HOLE, PAIR_BALL, PAIR_CAPSULE, ROD_APEX, ROD_HALF,
    ROD_RADIUS, ROUNDING, TORUS, coil_centre, coil_length,
};
use crate::solids::{sin_cos_of_part, unit_sphere};

/// [`KnownAxis::parts`] of a shape.
pub(crate) fn parts(id: &str) -> [usize; 3] {
    match id {
        "ellipsoid" | "hollow-sphere" => [1, 0, 0],
        "box" | "rounded-box" | "plate" => [13, 12, 4],
        "bracket" | "fillet" => [17, 17, 6],
        "rib" => [21, 22, 8],
        "wedge" => [9, 7, 2],
        "holed-plate" => [15, 13, 4],
        // A curve meets each cone at its tip.
        "rod" | "frustum" => [2, 0, 2],
        "blind-hole" => [5, 2, 0],
        // Points and curves.
        _ => [0, 0, 0],
    }
}

/// Rings of a triangulated disc, and vertices that each has more than the one inside it.
const DISC_RINGS: u32 = 32;
const DISC_SECTORS: u32 = 6;
/// Edges of a triangulated circle.
const CIRCLE_EDGES: u32 = 360;

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
    let (vertices, faces) = disc();
    let spheres = vertices.iter().map(|&[s, t]| {
        // Rings at equal angles of the surface: closer towards the rim, where the radius falls
        // ever more steeply.
        let rho = s.hypot(t);
        let stretch = if rho > 0.0 { (FRAC_PI_2 * rho).sin() / rho } else { 0.0 };
        ellipsoid_sphere(s * stretch * u / a, t * stretch * v / b)
    });
    let mut axis = known(spheres.collect(), vec![], faces, 0.0);
    // The radius is concave, so that it is nearly farthest from linear halfway between vertices.
    let sagging = axis.mesh.edges.iter().map(|edge| {
        let [p, q] = edge.map(|sphere| axis.mesh.spheres[sphere as usize]);
        let middle = p.lerp(q, 0.5);
        ellipsoid_sphere(middle.centre.x, middle.centre.y).radius - middle.radius
    });
    axis.tolerance = 2.0 * sagging.fold(0.0, f64::max) + sagitta(u / a, DISC_SECTORS * DISC_RINGS);
    axis
}

/// The medial sphere of the ellipsoid at a point of its plane.
fn ellipsoid_sphere(x: f64, y: f64) -> Sphere {
    let Vec3 { x: a, y: b, z: c } = ELLIPSOID;
    let (u, v) = (a * a - c * c, b * b - c * c);
    Sphere::new(Vec3::new(x, y, 0.0), c * (1.0 - x * x / u - y * y / v).sqrt())
}

/// The unit disc in concentric rings: the vertices and triangles, the centre being vertex 0.
fn disc() -> (Vec<[f64; 2]>, Vec<[u32; 3]>) {
    let mut vertices = vec![[0.0, 0.0]];
    let mut faces = Vec::new();
    for ring in 1..=DISC_RINGS {
        let radius = f64::from(ring) / f64::from(DISC_RINGS);
        let count = DISC_SECTORS * ring;
        vertices.extend((0..count).map(|i| {
            let (sin, cos) = sin_cos_of_part(i, count);
            [radius * cos, radius * sin]
        }));
        for i in 0..count {
            // In each sector the inner ring has one vertex less.
            let (sector, step) = (i / ring, i % ring);
            let below = sector * (ring - 1) + step;
            let [a, b] = [i, i + 1].map(|i| disc_vertex(ring, i));
            let [c, d] = [below, below + 1].map(|i| disc_vertex(ring - 1, i));
            faces.push([c, a, b]);
            if step + 1 < ring {
                faces.push([c, b, d]);
            }
        }
    }
    (vertices, faces)
}

/// The vertex `i`, counted around, of a ring of the disc; ring 0 is the centre.
fn disc_vertex(ring: u32, i: u32) -> u32 {
    match ring {
        0 => 0,
        _ => 1 + DISC_SECTORS * ring * (ring - 1) / 2 + i % (DISC_SECTORS * ring),
    }
}

/// The 13 sheets of a box with half sides `A > B > C`, from the core outward: the rectangle
/// `|x| <= A - C, |y| <= B - C` at `r = C`, a trapezoid to each horizontal edge of the box, a
/// triangle to each vertical one, all down to `r = 0`; `grown` is added to every radius.
pub(crate) fn box_axis(half: Vec3, grown: f64) -> KnownAxis {
    let signs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let inner = signs.map(|[x, y]| {
        let centre = Vec3::new(x * (half.x - half.z), y * (half.y - half.z), 0.0);
        Sphere::new(centre, half.z + grown)
    });
    let [bottom, top] = [-1.0, 1.0].map(|z| {
        signs.map(|[x, y]| Sphere::new(Vec3::new(x * half.x, y * half.y, z * half.z), grown))
    });
    let spheres = [inner, bottom, top].concat();
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

/// Growing a convex solid by a ball adds to the distance to its surface everywhere inside, and no
/// point outside the core has two nearest points.
pub(crate) fn rounded_box() -> KnownAxis {
    box_axis(CORE_HALF, ROUNDING)
}

/// Balls along a curve, each joined to the next.
fn path(spheres: Vec<Sphere>, tolerance: f64) -> KnownAxis {
    let edges = (1..spheres.len() as u32).map(|i| [i - 1, i]).collect();
    known(spheres, edges, vec![], tolerance)
}

pub(crate) fn capsule() -> KnownAxis {
    path([-ROD_HALF, ROD_HALF].map(|z| on_z(z, ROD_RADIUS)).to_vec(), 0.0)
}

pub(crate) fn pair() -> KnownAxis {
    let (ball, radius) = PAIR_BALL;
    let (centre, half, capsule_radius) = PAIR_CAPSULE;
    let [low, high] =
        [-half, half].map(|z| Sphere::new(centre + Vec3::new(0.0, 0.0, z), capsule_radius));
    known(vec![Sphere::new(ball, radius), low, high], vec![[1, 2]], vec![], 0.0)
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
        spheres.push(on_z(side * ROD_APEX, 0.0));
    }
    edges.push([0, spheres.len() as u32 / 2]);
    known(spheres, edges, faces, 1.5 * sagitta(ROD_RADIUS, DISC_SECTORS * DISC_RINGS))
}

/// The circle of the tube's centres.
pub(crate) fn torus() -> KnownAxis {
    let (major, minor) = TORUS;
    let spheres = (0..CIRCLE_EDGES).map(|i| {
        let (sin, cos) = sin_cos_of_part(i, CIRCLE_EDGES);
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
    let along = (0..=last).map(|i| length * (f64::from(i) / f64::from(last) - 0.5));
    let spheres = along.map(|along| Sphere::new(coil_centre(along), pipe)).collect();
    // The circle that osculates the helix has the radius R + (P / 2 pi)^2 / R.
    let rise = pitch / TAU;
    let osculating = radius + rise * rise / radius;
    let sides = TAU * osculating / (turns * (TAU * radius).hypot(pitch)) * f64::from(last);
    path(spheres, sagitta(osculating, sides as u32))
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
        [0, 1].into_iter().flat_map(move |end| lines.iter().map(move |line| (line[end], y, radius)))
    });
    let spheres = spheres.map(|([x, z], y, radius)| Sphere::new(Vec3::new(x, y, z), radius));
    let sides = level.len() as u32;
    let mut faces = Vec::new();
    for (from, to) in [(0, 1), (0, 2), (0, 4), (1, 3), (1, 5)] {
        for i in 0..sides {
            let next = (i + 1) % sides;
            let [a, b] = [i, next].map(|i| from * sides + i);
            let [c, d] = [i, next].map(|i| to * sides + i);
            faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    // A triangle to each upright edge.
    faces.extend((0..4).map(|k| [0, 2, 4].map(|ring| ring * sides + k * HOLED_SIDE)));
    // The longest arc is less than a third of the circle. Chords err in position, and as much in radius.
    known(spheres.collect(), vec![], faces, 1.5 * sagitta(HOLE + c, 3 * HOLED_SIDE))
}
