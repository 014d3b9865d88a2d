//! The residuals of a medial mesh against the solid, each linear in the four numbers of up to three
//! spheres.
//!
//! With `sigma(p)` the least signed distance to a primitive, attained by the sphere
//! `(c(a), r(a)) = sum_j a_j m_j` on it, and `u` the unit vector from `c(a)` to `p`:
//! `d sigma / d c_j = -a_j u`, `d sigma / d r_j = -a_j`. The weights `a` may be held, because `sigma` is a
//! minimum over them (the envelope theorem).

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, NearestPrimitive, Primitive, Sphere};
use medial::geometry::{Cone, Slab};
use medial::simplifier::SimplifyError;

use rayon::prelude::*;

use super::goal::{Goal, Interior, Known, Points, Sample};

/// Depth from which on an uncovered interior point counts alike.
const DEEP: f64 = 0.02;

/// Weight of a point of the medial mesh whose ball may protrude.
const PROTRUDING: f64 = 0.3;

/// Points of the medial mesh at which balls are watched for protruding: about half as many as there are samples.
const HELD: usize = 6_000;

/// How much farther than needed the depth of a ball is looked for, in ways that it moved last: the next steps are
/// mostly no longer.
const FARTHER: f64 = 2.0;

/// Golden ratio's fractional part, and the two of the plastic number: steps of the sequences.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
const PLASTIC: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// A residual `error`, whose derivative by the `j`-th sphere of its simplex is
/// `weights[j] * direction`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub primitive: Primitive,
    pub weights: [f64; 3],
    pub direction: [f64; 4],
    pub error: f64,
    pub weight: f64,
    /// The sample, or the centre of the ball that protrudes.
    pub point: Vec3,
    /// Whether the union holds too much there, and not too little.
    pub covered: bool,
    /// Whether it is of a ball that protrudes, and not of a sample.
    pub protrudes: bool,
}

/// A point of the medial mesh, held to its simplex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub primitive: Primitive,
    pub weights: [f64; 3],
    /// Its depth where it was last looked at.
    pub known: Option<Known>,
}

/// All residuals of a medial mesh that are not zero, and what each sample is served by.
pub(super) struct Residuals {
    pub rows: Vec<Row>,
    /// For each sample of the surface, then each interior point.
    pub nearest: Vec<NearestPrimitive>,
}

/// How much an interior point of a depth is uncovered, if positive.
#[inline]
pub(super) fn uncovered(depth: f64, signed: f64) -> f64 {
    (2.0 * signed + depth.min(DEEP)).max(0.0)
}

/// The signed distance from which on an interior point is not uncovered.
#[inline]
pub(super) fn held_from(depth: f64) -> f64 {
    -0.5 * depth.min(DEEP)
}

/// The vertices of a simplex, and how many they are.
pub(super) fn vertices(mesh: &MedialMesh, primitive: Primitive) -> ([u32; 3], usize) {
    match primitive {
        Primitive::Sphere(v) => ([v, v, v], 1),
        Primitive::Edge(e) => {
            let [a, b] = mesh.edges[e as usize];
            ([a, b, b], 2)
        }
        Primitive::Face(f) => (mesh.faces[f as usize], 3),
    }
}

/// The sphere of a medial mesh at some weights of a simplex.
fn interpolated(mesh: &MedialMesh, held: &Held) -> Sphere {
    let (corners, count) = vertices(mesh, held.primitive);
    let (mut centre, mut radius) = (Vec3::ZERO, 0.0);
    for (v, weight) in corners.into_iter().zip(held.weights).take(count) {
        let sphere = mesh.spheres[v as usize];
        centre += weight * sphere.centre;
        radius += weight * sphere.radius;
    }
    Sphere::new(centre, radius)
}

/// About so many points of the medial mesh, but all spheres: the rest spread evenly over edges and faces, so
/// that not each small one has a point.
fn spread_over(mesh: &MedialMesh, count: usize) -> Vec<Held> {
    let centre = |v: u32| mesh.spheres[v as usize].centre;
    let length = |e: &[u32; 2]| centre(e[0]).distance(centre(e[1]));
    let area = |f: &[u32; 3]| {
        let [a, b, c] = f.map(centre);
        0.5 * (b - a).cross(c - a).length()
    };
    let (total_length, total_area) =
        (mesh.edges.iter().map(length).sum::<f64>(), mesh.faces.iter().map(area).sum::<f64>());
    // The spacing `h` with length / h + area / h^2 = count.
    let count = count as f64;
    let root = (total_length * total_length + 4.0 * total_area * count).sqrt();
    let h = (total_length + root) / (2.0 * count);
    let mut all: Vec<Held> = (0..mesh.spheres.len() as u32)
        .map(|v| Held { primitive: Primitive::Sphere(v), weights: [1.0, 0.0, 0.0], known: None })
        .collect();
    // What a simplex is too small for is left to the next one.
    let mut left = 0.5;
    let mut points = |size: f64| {
        left += if size.is_finite() { size } else { 0.0 };
        let whole = left.floor();
        left -= whole;
        (whole as usize).min(1000)
    };
    for (e, edge) in (0..).zip(&mesh.edges) {
        let n = points(length(edge) / h);
        let at = |k: usize| {
            let t = (k as f64 + 0.5) / n as f64;
            Held { primitive: Primitive::Edge(e), weights: [1.0 - t, t, 0.0], known: None }
        };
        all.extend((0..n).map(at));
    }
    for (f, face) in (0..).zip(&mesh.faces) {
        let n = points(area(face) / (h * h));
        let at = |k: usize| {
            let [mut s, mut t] = PLASTIC.map(|step| ((k as f64 + 1.0) * step + GOLDEN).fract());
            // The sequence fills a parallelogram; its other half is reflected into the triangle.
            if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            Held { primitive: Primitive::Face(f), weights: [1.0 - s - t, s, t], known: None }
        };
        all.extend((0..n).map(at));
    }
    all
}

/// Points whose balls are watched for protruding, for a mesh that is a `share` of the whole.
pub(super) fn places(mesh: &MedialMesh, share: f64) -> Vec<Held> {
    spread_over(mesh, (share * HELD as f64) as usize)
}

/// The residuals of a medial mesh. Another one that stays is at the distance `limits` from each sample, or
/// there is none. `near` is what served each sample when the spheres were a little elsewhere, if that is
/// known. Balls that protrude by no more than `tolerance` are left out.
///
/// # Errors
/// When the medial mesh has no union.
pub(super) fn residuals(
    mesh: &MedialMesh,
    goal: &Goal,
    points: &Points,
    limits: &[f64],
    near: &[NearestPrimitive],
    tolerance: f64,
    held: &mut [Held],
) -> Result<Residuals, SimplifyError> {
    let union = union_of(mesh)?;
    let surface = points.samples.iter().map(|sample| sample.point);
    let places: Vec<Vec3> = surface.chain(points.interior.iter().map(|x| x.point)).collect();
    let count = points.samples.len();
    // What holds an interior point deeply enough holds it: no deeper primitive is looked for.
    let enough = |i: usize| i.checked_sub(count).map(|i| held_from(points.interior[i].depth));
    let nearest = union.deepest_batch_near(&places, near, enough);
    let hulls = Hulls::new(mesh);
    let limit = |i: usize| limits.get(i).copied().unwrap_or(f64::INFINITY);
    let row = |i: usize, point: Vec3, found: &NearestPrimitive, slope: f64| {
        let primitive = found.primitive;
        if limit(i) < found.signed {
            // No sphere of this mesh decides.
            return (limit(i), ([0.0; 3], [0.0; 4]), primitive);
        }
        let (weights, direction) = hulls.derivative(mesh, point, primitive);
        (found.signed, (weights, direction.map(|d| slope * d)), primitive)
    };
    let mut rows = Vec::with_capacity(nearest.len());
    for (i, (sample, found)) in points.samples.iter().zip(&nearest).enumerate() {
        let (error, (weights, direction), primitive) = row(i, sample.point, found, 1.0);
        let Sample { point, weight } = *sample;
        rows.push(Row {
            primitive,
            weights,
            direction,
            error,
            weight,
            point,
            covered: error < 0.0,
            protrudes: false,
        });
    }
    for (i, (inside, found)) in points.interior.iter().zip(&nearest[count..]).enumerate() {
        let Interior { point, depth, weight } = *inside;
        if uncovered(depth, found.signed.min(limit(count + i))) > 0.0 {
            let (signed, (weights, direction), primitive) = row(count + i, point, found, 2.0);
            let error = uncovered(depth, signed);
            rows.push(Row {
                primitive,
                weights,
                direction,
                error,
                weight,
                point,
                covered: false,
                protrudes: false,
            });
        }
    }
    let protruding = held.par_iter_mut().map(|held| {
        let ball = interpolated(mesh, held);
        let enough = ball.radius - tolerance;
        let depth = goal.depth_of_moved(ball.centre, enough, FARTHER, &mut held.known)?;
        let [x, y, z] = depth.gradient.to_array();
        let Held { primitive, weights, .. } = *held;
        Some(Row {
            primitive,
            weights,
            direction: [-x, -y, -z, 1.0],
            error: ball.radius - depth.value,
            weight: PROTRUDING,
            point: ball.centre,
            covered: true,
            protrudes: true,
        })
    });
    let protruding: Vec<Option<Row>> = protruding.collect();
    rows.extend(protruding.into_iter().flatten());
    Ok(Residuals { rows, nearest })
}

pub(super) fn union_of(mesh: &MedialMesh) -> Result<MedialUnion, SimplifyError> {
    MedialUnion::new(mesh).map_err(|error| SimplifyError::Failed(error.to_string()))
}

/// The primitives of a medial mesh, for feet.
struct Hulls {
    cones: Vec<Cone>,
    slabs: Vec<Slab>,
}

impl Hulls {
    fn new(mesh: &MedialMesh) -> Self {
        let sphere = |v: u32| mesh.spheres[v as usize];
        let cone = |e: &[u32; 2]| Cone::new(sphere(e[0]), sphere(e[1]));
        let slab = |f: &[u32; 3]| Slab::new(f.map(sphere));
        let cones = mesh.edges.iter().map(cone).collect();
        Self { cones, slabs: mesh.faces.iter().map(slab).collect() }
    }

    /// The weights of the sphere that attains the distance of a point, and the derivative by it.
    fn derivative(&self, mesh: &MedialMesh, p: Vec3, primitive: Primitive) -> ([f64; 3], [f64; 4]) {
        let (weights, centre) = match primitive {
            Primitive::Sphere(v) => ([1.0, 0.0, 0.0], mesh.spheres[v as usize].centre),
            Primitive::Edge(e) => {
                let foot = self.cones[e as usize].foot(p);
                let [a, b] = foot.weights;
                ([a, b, 0.0], foot.sphere.centre)
            }
            Primitive::Face(f) => {
                let foot = self.slabs[f as usize].foot(p);
                (foot.weights, foot.sphere.centre)
            }
        };
        let [x, y, z] = (p - centre).normalize_or_zero().to_array();
        (weights, [-x, -y, -z, -1.0])
    }
}
