//! Medial axes that are known in closed form.
//!
//! Flat sheets and straight edges, on which the radius is linear, are exact. Curved ones are
//! triangulated finely, with vertices on the true axis; the tolerance bounds the rest.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::geometry::glam::DVec2;

use crate::profiles::around_hole;
use crate::shapes::{
    CAVITY, CHAIN, COIL, CORE_HALF, ELLIPSOID, HOLE, HOLED_HALF, PAIR_BALL, PAIR_CAPSULE, ROD_APEX,
    ROD_HALF, ROD_RADIUS, ROUNDING, TORUS, TUBE, TUBE_RADIUS, coil_centre, coil_length,
};
use crate::solids::{Curve, sin_cos_of_part, unit_sphere};

/// The medial axis of a built-in shape, known without sampling, in the shape's own coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownAxis {
    /// The axis with its radii.
    pub mesh: MedialMesh,
    /// How far `mesh` may be from the true axis, in centres and in radii, both ways; in the
    /// shape's own unit. Zero where it is exact up to rounding: no curved sheet or curve.
    pub tolerance: f64,
    /// Numbers of sheets, seams and junctions of the true axis.
    pub parts: [usize; 3],
}

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

fn known(
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    tolerance: f64,
) -> KnownAxis {
    let mesh = MedialMesh::from_simplices(spheres, edges, faces).expect("a generated complex");
    KnownAxis { mesh, tolerance, parts: [0; 3] }
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

/// How far a regular polygon of `sides` inscribed in a circle stays away from it.
pub(crate) fn sagitta(radius: f64, sides: u32) -> f64 {
    radius * (1.0 - (PI / f64::from(sides)).cos())
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

/// A ball with its centre on the z axis.
fn on_z(z: f64, radius: f64) -> Sphere {
    Sphere::new(Vec3::new(0.0, 0.0, z), radius)
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

/// The balls along the segment of their centres; radii are linear between neighbours.
pub(crate) fn chain() -> KnownAxis {
    path(CHAIN.map(|(z, radius)| on_z(z, radius)).to_vec(), 0.0)
}

/// The centre curve: its curvature is below one over the tube's radius, and it stays away from itself.
pub(crate) fn tube() -> KnownAxis {
    let Curve { start, end, place, .. } = TUBE;
    let parts = 2 * CIRCLE_EDGES;
    // The ends of the parts and, between them, their middles.
    let shares = (0..=2 * parts).map(|i| f64::from(i) / f64::from(2 * parts));
    let points: Vec<Vec3> = shares.map(|share| place(start + (end - start) * share)).collect();
    let spheres = points.iter().step_by(2).map(|&point| Sphere::new(point, TUBE_RADIUS)).collect();
    let chords = points.windows(3).step_by(2);
    let sagging = chords.map(|p| p[1].distance(p[0].midpoint(p[2]))).fold(0.0, f64::max);
    path(spheres, 2.0 * sagging)
}

// Medial axes of planar profiles, and of the prisms and solids of revolution over them.
//
// A profile is bounded by sites: lines and concave arcs, a reflex corner being an arc of radius 0. Its axis
// is a graph of branches, on each of which two sites are equally near: a segment between two lines, a
// parabola between a line and an arc. The shape gives nodes and branches ([`crate::profiles`]); here they are
// sampled and carried into space.
//
// - *Prism* over the profile `P` between caps at distance `half` on either side of its middle, for `half`
//   larger than every radius of the profile. With `d` the depth in `P`, the depth in the prism is
//   `min(d, half - |y|)`. So the axis is the profile's own axis, extruded as far as `|y| <= half - d`, and
//   below each cap the roof `|y| = half - d` over all of `P`. The roof is ruled: `d` is linear along the
//   segment from a point of the profile's axis to each of its feet.
// - *Solid of revolution* of the half profile `rho >= 0` of a mirrored profile: the nearest point to `(rho, z)`
//   lies in its own half plane, so the axis is that of the full profile, revolved. Branches on `rho = 0`
//   stay segments.

/// Parts of a curved branch.
const CURVE_PARTS: u32 = 32;
/// Sides of a revolved circle.
const SECTORS: u32 = 192;
/// Points closer than this are one: far above rounding, far below any feature.
const WELD: f64 = 1e-9;
/// Chords are almost farthest from a smooth curve in their middle; this covers the rest.
const SAFETY: f64 = 2.0;

/// A part of the boundary of a profile.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Site {
    /// The line through a point; the unit normal points into the solid.
    Line {
        /// A point of the line.
        at: DVec2,
        /// Into the solid, of length 1.
        inward: DVec2,
    },
    /// A concave arc: the solid is outside of the circle. A reflex corner has radius 0.
    Round {
        /// Centre of the circle.
        centre: DVec2,
        /// Radius, which may be 0.
        radius: f64,
    },
}

impl Site {
    /// The line from `a` to `b` with the solid on its left.
    pub(crate) fn line(a: DVec2, b: DVec2) -> Self {
        Self::Line { at: a, inward: (b - a).normalize().perp() }
    }

    /// The distance from a point of the solid, and the direction in which it grows fastest.
    fn depth(&self, p: DVec2) -> (f64, DVec2) {
        match *self {
            Self::Line { at, inward } => ((p - at).dot(inward), inward),
            Self::Round { centre, radius } => {
                ((p - centre).length() - radius, (p - centre).normalize_or_zero())
            }
        }
    }

    /// The nearest point of the site.
    fn foot(&self, p: DVec2) -> DVec2 {
        let (depth, outward) = self.depth(p);
        p - outward * depth
    }
}

/// The axis of a profile.
#[derive(Clone, Debug, Default)]
pub(crate) struct Profile {
    /// Parts of the boundary that some branch names.
    pub(crate) sites: Vec<Site>,
    /// Ends of branches: convex corners, where the radius is 0, and junctions.
    pub(crate) nodes: Vec<DVec2>,
    /// Two nodes, and the two sites that are equally near between them.
    pub(crate) branches: Vec<([usize; 2], [usize; 2])>,
}

/// A point of a branch: its radius, and the feet on its two sites.
#[derive(Clone, Copy, Debug)]
struct Knot {
    at: DVec2,
    radius: f64,
    feet: [DVec2; 2],
}

impl Profile {
    /// The point at a share of the way along a branch, with its feet.
    ///
    /// The bisector is a graph over its chord: Newton steps orthogonal to the chord find it.
    fn knot(&self, branch: usize, share: f64) -> Knot {
        const STEPS: usize = 20;
        let ([from, to], sites) = self.branches[branch];
        let [a, b] = sites.map(|site| self.sites[site]);
        let (from, to) = (self.nodes[from], self.nodes[to]);
        let normal = (to - from).normalize().perp();
        let mut at = from.lerp(to, share);
        // Nodes are given; stepping would move them by rounding, and neighbours would no longer meet.
        let steps = if share > 0.0 && share < 1.0 && self.is_curved(branch) { STEPS } else { 0 };
        for _ in 0..steps {
            let ((depth_a, slope_a), (depth_b, slope_b)) = (a.depth(at), b.depth(at));
            at -= normal * ((depth_a - depth_b) / (slope_a - slope_b).dot(normal));
        }
        let feet = [a.foot(at), b.foot(at)];
        // Both depths are equal up to rounding; at a convex corner they are 0 up to rounding.
        let radius = a.depth(at).0;
        Knot { at, radius: if radius < WELD { 0.0 } else { radius }, feet }
    }

    /// Whether position, radius or feet are not linear along the branch.
    fn is_curved(&self, branch: usize) -> bool {
        let (_, sites) = self.branches[branch];
        sites.iter().any(|&site| matches!(self.sites[site], Site::Round { .. }))
    }

    fn parts(&self, branch: usize) -> u32 {
        if self.is_curved(branch) { CURVE_PARTS } else { 1 }
    }

    fn knots(&self, branch: usize) -> Vec<Knot> {
        let parts = self.parts(branch);
        (0..=parts).map(|k| self.knot(branch, f64::from(k) / f64::from(parts))).collect()
    }

    /// How far chords are from the branches: in position or feet, and in radius, whichever sum is largest.
    fn chord_error(&self) -> f64 {
        let mut largest = 0.0_f64;
        for branch in (0..self.branches.len()).filter(|&branch| self.is_curved(branch)) {
            let knots = self.knots(branch);
            for (k, pair) in (0_u32..).zip(knots.windows(2)) {
                let share = (f64::from(k) + 0.5) / f64::from(self.parts(branch));
                let (truth, [a, b]) = (self.knot(branch, share), [pair[0], pair[1]]);
                let off = [truth, a, b].map(|knot| [knot.at, knot.feet[0], knot.feet[1]]);
                let off = [0, 1, 2].map(|i| off[0][i].distance(off[1][i].midpoint(off[2][i])));
                let place = off.into_iter().fold(0.0, f64::max);
                largest = largest.max(place + (truth.radius - (a.radius + b.radius) / 2.0).abs());
            }
        }
        SAFETY * largest
    }

    /// The axis of the prism with the profile in the planes `y = const`, `|y - middle| <= half`; the second
    /// coordinate of the profile is `z`.
    ///
    /// # Panics
    /// If a radius of the profile reaches `half`: the two roofs would meet.
    pub(crate) fn prism(&self, middle: f64, half: f64) -> KnownAxis {
        let mut builder = Builder::default();
        for branch in 0..self.branches.len() {
            let knots = self.knots(branch);
            assert!(
                knots.iter().all(|knot| knot.radius < half),
                "a profile thicker than its prism"
            );
            let mut quads = Vec::new();
            for pair in knots.windows(2) {
                let [a, b] = [pair[0], pair[1]];
                let caps = [(middle, -half), (middle, half)];
                let [[low_a, low_b], [high_a, high_b]] = caps.map(|cap| {
                    [builder.roof(cap, a.at, a.radius), builder.roof(cap, b.at, b.radius)]
                });
                quads.push([low_a, low_b, high_b, high_a]);
                for (cap, [on_a, on_b]) in caps.into_iter().zip([[low_a, low_b], [high_a, high_b]])
                {
                    for foot in 0..2 {
                        let foot_a = builder.roof(cap, a.feet[foot], 0.0);
                        let foot_b = builder.roof(cap, b.feet[foot], 0.0);
                        quads.push([on_a, on_b, foot_b, foot_a]);
                    }
                }
            }
            quads.into_iter().for_each(|quad| builder.quad(quad));
        }
        builder.finish(self.chord_error())
    }

    /// The axis of the solid of revolution about `z` of the half profile `x >= 0`.
    pub(crate) fn revolved(&self) -> KnownAxis {
        let mut builder = Builder::default();
        let mut widest = 0.0_f64;
        for branch in 0..self.branches.len() {
            for pair in self.knots(branch).windows(2) {
                widest = widest.max(pair[0].at.x).max(pair[1].at.x);
                let [a, b] = [builder.circle(&pair[0]), builder.circle(&pair[1])];
                builder.band(&a, &b);
            }
        }
        // Chords of circles: in position, and as much in radius.
        builder.finish(self.chord_error() + 1.5 * sagitta(widest, SECTORS))
    }
}

/// A medial mesh in the making; equal places are one vertex.
#[derive(Default)]
struct Builder {
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
}

impl Builder {
    /// Linear in the number of vertices: axes have a few thousand.
    fn vertex(&mut self, sphere: Sphere) -> u32 {
        // By centre alone: at one place there is one radius on a medial axis.
        let known = self.spheres.iter().position(|s| s.centre.distance(sphere.centre) < WELD);
        known.unwrap_or_else(|| {
            self.spheres.push(sphere);
            self.spheres.len() - 1
        }) as u32
    }

    /// A quadrilateral, or a triangle where two corners are one, or nothing.
    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        for face in [[a, b, c], [a, c, d]] {
            let [u, v, w] = face;
            if u != v && v != w && w != u {
                self.faces.push(face);
            }
        }
    }

    /// The vertices of a revolved knot: one on the axis of revolution, else a circle.
    fn circle(&mut self, knot: &Knot) -> Vec<u32> {
        if knot.at.x < WELD {
            return vec![self.vertex(on_z(knot.at.y, knot.radius))];
        }
        // A circle whose first vertex is known is known.
        let first = self.vertex(Sphere::new(Vec3::new(knot.at.x, 0.0, knot.at.y), knot.radius));
        if first as usize + 1 == self.spheres.len() {
            self.spheres.extend((1..SECTORS).map(|i| {
                let (sin, cos) = (TAU * f64::from(i) / f64::from(SECTORS)).sin_cos();
                let centre = Vec3::new(knot.at.x * cos, knot.at.x * sin, knot.at.y);
                Sphere::new(centre, knot.radius)
            }));
        }
        (first..first + SECTORS).collect()
    }

    /// The strip between two circles, of which one or both may be points.
    fn band(&mut self, a: &[u32], b: &[u32]) {
        if let ([a], [b]) = (a, b) {
            self.edges.push([*a, *b]);
            return;
        }
        // A point is a circle of one vertex.
        for i in 0..SECTORS as usize {
            let [p, q] = [i, i + 1].map(|i| a[i % a.len()]);
            let [r, s] = [i, i + 1].map(|i| b[i % b.len()]);
            self.quad([p, r, s, q]);
        }
    }

    /// A vertex of a prism below the cap at distance `half` from its middle, `half` being negative for the lower one.
    fn roof(&mut self, (middle, half): (f64, f64), p: DVec2, radius: f64) -> u32 {
        let y = middle + half.signum() * (half.abs() - radius);
        self.vertex(Sphere::new(Vec3::new(p.x, y, p.y), radius))
    }

    fn finish(self, tolerance: f64) -> KnownAxis {
        known(self.spheres, self.edges, self.faces, tolerance)
    }
}
