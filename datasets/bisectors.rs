//! Medial axes of planar profiles, and of the prisms and solids of revolution over them.
//!
//! A profile is bounded by sites: lines and concave arcs, a reflex corner being an arc of radius 0. Its axis
//! is a graph of branches, on each of which two sites are equally near: a segment between two lines, a
//! parabola between a line and an arc. The shape gives nodes and branches (`profiles`); here they are
//! sampled and carried into space.
//!
//! - *Prism* over the profile `P` between caps at distance `half` on either side of its middle, for `half`
//!   larger than every radius of the profile. With `d` the depth in `P`, the depth in the prism is
//!   `min(d, half - |y|)`. So the axis is the profile's own axis, extruded as far as `|y| <= half - d`, and
//!   below each cap the roof `|y| = half - d` over all of `P`. The roof is ruled: `d` is linear along the
//!   segment from a point of the profile's axis to each of its feet.
//! - *Solid of revolution* of the half profile `rho >= 0` of a mirrored profile: the nearest point to `(rho, z)`
//!   lies in its own half plane, so the axis is that of the full profile, revolved. Branches on `rho = 0`
//!   stay segments.

use std::f64::consts::{PI, TAU};

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::geometry::glam::DVec2;

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

/// A known axis from its simplices.
pub(crate) fn known(
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    tolerance: f64,
) -> KnownAxis {
    let mesh = MedialMesh::from_simplices(spheres, edges, faces).expect("a generated complex");
    KnownAxis { mesh, tolerance, parts: [0; 3] }
}

/// How far a regular polygon of `sides` inscribed in a circle stays away from it.
pub(crate) fn sagitta(radius: f64, sides: u32) -> f64 {
    radius * (1.0 - (PI / f64::from(sides)).cos())
}

/// A ball with its centre on the z axis.
pub(crate) fn on_z(z: f64, radius: f64) -> Sphere {
    Sphere::new(Vec3::new(0.0, 0.0, z), radius)
}

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
