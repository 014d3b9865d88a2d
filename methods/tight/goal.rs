//! The target of the union of the primitives: samples of the surface, points inside the solid, and
//! depths of any point.

use std::sync::Arc;

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, NearestPrimitive, Primitive, Sphere};
use medial::geometry::trees::morton_order;
use medial::geometry::{Cone, Slab};
use medial::metrics::{DistanceOptions, FINEST, MetricError, PeakSearch, certify};
use medial::shape::{Shape, ShapeError};
use medial::simplifier::SimplifyError;
use medial::surface::{
    Closest, InsideTest, Sampling, Side, TriMesh, TriangleBvh, sample, sharp_edges,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::part::Part;
use crate::Result;

/// Samples of the surface, below 500 spheres and from there on.
const SAMPLES: [usize; 2] = [6_000, 12_000];

/// Samples along sharp edges, as a share of those. With a quarter, a face grew across a hole of
/// `abc_bracket`.
const SHARE_OF_EDGES: f64 = 0.1;

/// Samples of the surface, with its vertices, from which the largest errors are searched. The union has twice as many. More
/// gave the same errors at 100 spheres.
const SEARCHED: usize = 8_000;

/// Samples for each vertex of the surface among them, at least.
const SHARE_OF_VERTICES: usize = 4;

/// Constant that separates the random numbers from those of the start and of the judge with the same
/// seed.
const STREAM: u64 = 0x7469_6768_7421_0a0b;

/// Weight of a vertex of the surface and of a point inside. An area-uniform sample has 1.
pub(super) const ASIDE: f64 = 0.3;

/// Cosine of the angle by which the surface turns at a sharp edge, at most.
const SHARP: f64 = 0.866;
/// Smallest distance of samples along sharp edges and of points of the medial mesh, a fraction of the diagonal.
pub(super) const CLOSEST: f64 = 1e-3;

/// Interior points that are residuals from the start, below 500 spheres and from there on.
const INTERIOR: [usize; 2] = [2_500, 4_000];

/// Interior points among which uncovered ones are searched.
const POOL: usize = 20_000;

/// Cells along the longest side of the grid in which interior points are laid out.
const GRID: usize = 40;

/// Depth of a clamped centre below the surface, a fraction of the diagonal, so that rounding does not
/// leave it outside.
const WITHIN: f64 = 1e-9;

/// Limit of the steps that shrink a ball.
const SHRINKS: usize = 30;
/// Share of the radius of a ball that may be occupied.
const EMPTY: f64 = 1e-3;
/// Smallest radius of a shrunk ball, a fraction of the diagonal.
const SMALLEST_BALL: f64 = 1e-4;

/// A point and how much it counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub point: Vec3,
    pub weight: f64,
}

/// A point inside the solid, with its depth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interior {
    pub point: Vec3,
    pub depth: f64,
    pub weight: f64,
}

/// The points that residuals are made for.
#[derive(Clone, Debug, Default)]
pub(super) struct Points {
    /// Points that the union's boundary should pass through.
    pub samples: Vec<Sample>,
    /// Points that the union should hold.
    pub interior: Vec<Interior>,
    /// Places outside that a union reached: balls there are watched for protruding.
    pub outside: Vec<Vec3>,
}

impl Points {
    /// The samples of the surface, and then the points inside.
    pub fn places(&self) -> impl Iterator<Item = Vec3> {
        let samples = self.samples.iter().map(|sample| sample.point);
        samples.chain(self.interior.iter().map(|inside| inside.point))
    }

    /// The signed distance at which an interior point is held well enough, by its place among all.
    pub fn enough(&self, i: usize) -> Option<f64> {
        let i = i.checked_sub(self.samples.len())?;
        Some(held_from(self.interior[i].depth.min(DEEP)))
    }
}

/// Depth of a point in the solid, negative outside, and its gradient.
#[derive(Clone, Copy, Debug)]
pub(super) struct Depth {
    pub value: f64,
    pub gradient: Vec3,
}

/// The known depth of a point and the closest face, or a lower bound of the depth and a face near to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    point: Vec3,
    depth: f64,
    face: u32,
    /// With its gradient, unless a bound.
    exact: Option<Depth>,
}

/// The solid, as the residuals see it.
pub(super) struct Goal {
    surface: TriMesh,
    tree: Arc<TriangleBvh>,
    inside: Arc<InsideTest>,
    /// Points inside, among which uncovered ones are looked for.
    pub pool: Vec<Interior>,
    seed: u64,
}

impl Goal {
    /// Lays out the points inside.
    ///
    /// # Errors
    /// When the surface has no face.
    pub fn new(shape: &Shape, seed: u64) -> Result<Self, ShapeError> {
        let surface = shape.mesh().clone();
        let (tree, inside) = (shape.surface_tree()?, shape.inside_test());
        let mut goal = Self { surface, tree, inside, pool: Vec::new(), seed };
        goal.pool = goal.points_inside(POOL);
        Ok(goal)
    }

    /// The points that residuals are made for, when `spheres` are left.
    pub fn points(&self, spheres: usize) -> Points {
        let Self { surface, pool, seed, .. } = self;
        let many = usize::from(spheres >= 500);
        let count = SAMPLES[many];
        let spread = sample(surface, &Sampling::BlueNoise { count, seed: seed ^ STREAM });
        let mut used = vec![false; surface.vertices.len()];
        surface.faces.iter().flatten().for_each(|&v| used[v as usize] = true);
        let vertices = surface.vertices.iter().zip(used).filter(|&(_, used)| used);
        let vertices: Vec<Vec3> = vertices.map(|(&point, _)| point).collect();
        // Of a finely meshed surface a share is enough: corners are sampled by the others, too.
        let every = vertices.len().div_ceil(count / SHARE_OF_VERTICES);
        let vertices = vertices.into_iter().step_by(every.max(1));
        let vertices = vertices.map(|point| Sample { point, weight: ASIDE });
        let samples = spread.into_iter().map(|point| Sample { point, weight: 1.0 });
        let stride = (pool.len() / INTERIOR[many]).max(1);
        let interior = pool.iter().step_by(stride).copied().collect();
        let along = self.along_sharp_edges(SHARE_OF_EDGES * count as f64);
        let along = along.into_iter().map(|point| Sample { point, weight: ASIDE });
        let samples: Vec<Sample> = samples.chain(vertices).chain(along).collect();
        // Along a curve: the primitive of a sample mostly serves the next one.
        let places: Vec<Vec3> = samples.iter().map(|sample| sample.point).collect();
        let samples = morton_order(&places).into_iter().map(|(_, i)| samples[i as usize]).collect();
        Points { samples, interior, outside: Vec::new() }
    }

    /// A search for the largest errors of a medial mesh.
    ///
    /// # Errors
    /// When the surface has no area.
    pub fn peaks(&self) -> Result<PeakSearch<'_>, MetricError> {
        let seed = self.seed ^ STREAM;
        let envelope_samples = 2 * SEARCHED;
        let rest = SEARCHED.saturating_sub(self.surface.vertices.len());
        let surface_samples = rest.max(SEARCHED / SHARE_OF_VERTICES);
        let options = DistanceOptions { surface_samples, envelope_samples, seed };
        PeakSearch::new(&self.surface, &self.tree, options)
    }

    /// An upper bound of the Hausdorff distance of a medial mesh, by a certificate of a width.
    ///
    /// # Errors
    /// When the certificate would need too many pieces.
    pub fn certified(&self, mesh: &MedialMesh, width: f64) -> Result<f64> {
        let certificate = certify(&self.surface, &self.tree, mesh, width.clamp(FINEST, 1.0));
        Ok(certificate.map_err(refused)?.upper)
    }

    /// Depths and their gradients, in parallel.
    pub fn depths(&self, points: &[Vec3]) -> Vec<Depth> {
        let closest = self.tree.closest_batch(points);
        let sides = self.inside.sides(points);
        let found = points.iter().zip(&closest).zip(sides);
        found.map(|((&p, closest), side)| self.signed(p, closest, side)).collect()
    }

    fn signed(&self, p: Vec3, closest: &Closest, side: Side) -> Depth {
        let inward = if side == Side::Inside { 1.0 } else { -1.0 };
        let away = (p - closest.point).try_normalize();
        // On the surface the gradient is the inward normal of the face.
        let gradient = away.map_or_else(|| -self.normal(closest.face), |away| inward * away);
        Depth { value: inward * closest.distance, gradient }
    }

    /// The depth of a place that moved: `known` holds the result at its earlier place.
    ///
    /// Depths are 1-Lipschitz, so a place that moved less than its depth is on the same side, and one
    /// that is still deeper than `enough` needs no query: `None`.
    pub fn depth_of_moved(&self, p: Vec3, enough: f64, known: &mut Option<Known>) -> Option<Depth> {
        let mut side = None;
        if let Some(known) = known {
            let moved = p.distance(known.point);
            if known.depth - moved >= enough {
                return None;
            }
            // A ball whose spheres stayed.
            if let Some(depth) = known.exact.filter(|_| moved == 0.0) {
                return Some(depth);
            }
            if known.depth.abs() > moved {
                side = Some(if known.depth > 0.0 { Side::Inside } else { Side::Outside });
            }
        }
        let side = side.unwrap_or_else(|| self.inside.side(p));
        let face = known.map(|known| known.face);
        // Inside only faces within `enough` matter.
        let closest = match side {
            Side::Inside if enough > 0.0 => self.tree.closest_within_from(p, enough, face),
            _ => Some(self.tree.closest_from(p, face)),
        };
        let exact = closest.map(|closest| self.signed(p, &closest, side));
        *known = Some(Known {
            point: p,
            depth: exact.map_or(enough, |exact| exact.value),
            face: closest.map_or(face.unwrap_or(0), |closest| closest.face),
            exact,
        });
        exact.filter(|exact| exact.value < enough)
    }

    /// A point next to the surface for each centre that is outside of the solid, the closest but for rounding.
    pub fn clamped(&self, centres: &[Vec3]) -> Vec<Option<Vec3>> {
        let clamped = centres.iter().zip(self.inside.sides(centres)).map(|(&centre, side)| {
            (side == Side::Outside).then(|| {
                let closest = self.tree.closest(centre);
                closest.point - WITHIN * self.normal(closest.face)
            })
        });
        clamped.collect()
    }

    /// The largest ball inside the solid that touches the surface next to a point (Ma, Bae, Choi 2012,
    /// *3D medial point approximation using nearest neighbors and the normal field*).
    pub fn ball_at(&self, p: Vec3) -> Sphere {
        let start = self.tree.closest(p);
        let (q, inward) = (start.point, -self.normal(start.face));
        // No ball inside is larger than half the diagonal.
        let mut radius = 0.5;
        for _ in 0..SHRINKS {
            let centre = q + radius * inward;
            let closest = self.tree.closest(centre);
            if closest.distance >= radius * (1.0 - EMPTY) {
                break;
            }
            let arm = closest.point - q;
            let along = 2.0 * arm.dot(inward);
            let next = arm.length_squared() / along.max(1e-12);
            if next >= radius {
                break;
            }
            radius = next.max(SMALLEST_BALL);
        }
        Sphere::new(q + radius * inward, radius)
    }

    fn normal(&self, face: u32) -> Vec3 {
        let [a, b, c] = self.surface.triangle(face as usize);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Points along the edges at which the surface turns by more than 30 degrees, about `count` of them, evenly.
    pub fn along_sharp_edges(&self, count: f64) -> Vec<Vec3> {
        let flat: Vec<Vec3> =
            (0..self.surface.faces.len() as u32).map(|f| self.normal(f)).collect();
        let sharp = sharp_edges(&self.surface, &flat, SHARP).into_iter();
        let sharp = sharp.map(|edge| edge.vertices.map(|v| self.surface.vertices[v as usize]));
        let sharp: Vec<[Vec3; 2]> = sharp.collect();
        let length: f64 = sharp.iter().map(|[a, b]| a.distance(*b)).sum();
        let spacing = (length / count).max(CLOSEST);
        let mut left = 0.5;
        let mut points = Vec::new();
        for [a, b] in sharp {
            let n = whole_points(a.distance(b) / spacing, &mut left);
            points.extend((0..n).map(|k| a.lerp(b, (k as f64 + 0.5) / n as f64)));
        }
        points
    }

    /// At most `count` points inside: as many random ones in each cell of a grid that reaches the solid.
    fn points_inside(&self, count: usize) -> Vec<Interior> {
        let (lo, hi) = self.surface.bounding_box().unwrap_or_default();
        let extent = hi - lo;
        let side = extent.max_element() / GRID as f64;
        let cells = (extent / side).ceil().max(Vec3::ONE);
        let [nx, ny, nz] = cells.to_array().map(|n| n as usize);
        let middles = (0..nx * ny * nz).map(|i| {
            let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)].map(|k| k as f64 + 0.5);
            lo + side * Vec3::new(x, y, z)
        });
        let middles: Vec<Vec3> = middles.collect();
        let depths = self.depths(&middles);
        // A cell farther outside than its half diagonal holds nothing.
        let reach = side * 0.75_f64.sqrt();
        let mixed: Vec<Vec3> =
            middles.iter().zip(depths).filter(|(_, d)| d.value > -reach).map(|(&m, _)| m).collect();
        let mut rng = Pcg64::seed_from_u64(self.seed ^ STREAM);
        let each = (2 * count).div_ceil(mixed.len().max(1));
        let mut points = Vec::with_capacity(each * mixed.len());
        for &m in &mixed {
            for _ in 0..each {
                let [x, y, z] = [(); 3].map(|()| rng.random::<f64>() - 0.5);
                points.push(m + side * Vec3::new(x, y, z));
            }
        }
        let depths = self.depths(&points);
        let points = points.into_iter().zip(depths);
        let points = points.map(|(point, Depth { value: depth, .. })| Interior {
            point,
            depth,
            weight: ASIDE,
        });
        let mut inside: Vec<Interior> = points.filter(|point| point.depth > 0.0).collect();
        let (all, mut k) = (inside.len(), 0);
        if all > count {
            // Thinned evenly, so that no region loses more than another.
            inside.retain(|_| {
                k += 1;
                (k - 1) * count / all != k * count / all
            });
        }
        inside
    }
}

pub(super) fn refused(error: MetricError) -> SimplifyError {
    SimplifyError::Failed(error.to_string())
}

// ----------------------------------------------------------------------------
// The residuals of a medial mesh against the solid, each linear in the four numbers of up to three
// spheres.
//
// With `sigma(p)` the least signed distance to a primitive, attained by the sphere
// `(c(a), r(a)) = sum_j a_j m_j` on it, and `u` the unit vector from `c(a)` to `p`:
// `d sigma / d c_j = -a_j u`, `d sigma / d r_j = -a_j`. The weights `a` may be held, because `sigma` is a
// minimum over them (the envelope theorem).

/// Depth from which on uncovered interior points count alike, a fraction of the
/// diagonal.
pub(super) const DEEP: f64 = 0.02;

/// Weight of a point of the medial mesh whose ball may protrude.
const PROTRUDING: f64 = 0.3;

/// Points of the medial mesh at which balls are watched for protruding. Twice as many gave the same
/// errors.
const HELD: usize = 1_500;

/// Fractional part of the golden ratio: offset of the sequence of points on a face.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Steps of that sequence, by the plastic number.
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

/// All residuals of a medial mesh that are not zero, and the primitive that serves each sample.
pub(super) struct Residuals {
    pub rows: Vec<Row>,
    /// For each sample of the surface, then each interior point.
    pub nearest: Vec<NearestPrimitive>,
}

/// How much an interior point is uncovered, if positive, of a depth that counts. Of a union that is smaller than the
/// solid by a length on all sides, no point is uncovered by more than that.
#[inline]
pub(super) fn uncovered(depth: f64, signed: f64) -> f64 {
    (slope(signed) * signed + depth).max(0.0)
}

/// Its derivative by the signed distance, where it is positive.
#[inline]
fn slope(signed: f64) -> f64 {
    if signed > 0.0 { 1.0 } else { 2.0 }
}

/// The signed distance from which on an interior point is not uncovered.
#[inline]
pub(super) fn held_from(depth: f64) -> f64 {
    -0.5 * depth
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
pub(super) fn interpolated(mesh: &MedialMesh, held: &Held) -> Sphere {
    let (corners, count) = vertices(mesh, held.primitive);
    let (mut centre, mut radius) = (Vec3::ZERO, 0.0);
    for (v, weight) in corners.into_iter().zip(held.weights).take(count) {
        let sphere = mesh.spheres[v as usize];
        centre += weight * sphere.centre;
        radius += weight * sphere.radius;
    }
    Sphere::new(centre, radius)
}

/// About `count` points of the medial mesh, but all spheres: the rest spread evenly over edges and faces, so that not
/// each small one has a point. Those on simplices that are not `wanted` are left out.
fn spread_over(mesh: &MedialMesh, count: usize, wanted: impl Fn(&[u32]) -> bool) -> Vec<Held> {
    let lengths = mesh.edges.iter().map(|edge| {
        let [a, b] = edge.map(|v| mesh.spheres[v as usize].centre);
        a.distance(b)
    });
    let areas = mesh.faces.iter().map(|face| {
        let [a, b, c] = face.map(|v| mesh.spheres[v as usize].centre);
        0.5 * (b - a).cross(c - a).length()
    });
    let (total_length, total_area) = (lengths.clone().sum::<f64>(), areas.clone().sum::<f64>());
    // The spacing `h` with length / h + area / h^2 = count.
    let count = count as f64;
    let root = (total_length * total_length + 4.0 * total_area * count).sqrt();
    let h = ((total_length + root) / (2.0 * count)).max(CLOSEST);
    let mut all: Vec<Held> = (0..mesh.spheres.len() as u32)
        .filter(|&v| wanted(&[v]))
        .map(|v| Held { primitive: Primitive::Sphere(v), weights: [1.0, 0.0, 0.0], known: None })
        .collect();
    let mut left = 0.5;
    for (e, length) in (0..).zip(lengths).filter(|&(e, _)| wanted(&mesh.edges[e as usize])) {
        let n = whole_points(length / h, &mut left);
        all.extend((0..n).map(|k| {
            let t = (k as f64 + 0.5) / n as f64;
            Held { primitive: Primitive::Edge(e), weights: [1.0 - t, t, 0.0], known: None }
        }));
    }
    for (f, area) in (0..).zip(areas).filter(|&(f, _)| wanted(&mesh.faces[f as usize])) {
        let n = whole_points(area / (h * h), &mut left);
        all.extend((0..n).map(|k| {
            let [mut s, mut t] = PLASTIC.map(|step| ((k as f64 + 1.0) * step + GOLDEN).fract());
            // The sequence fills a parallelogram; its other half is reflected into the triangle.
            if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            Held { primitive: Primitive::Face(f), weights: [1.0 - s - t, s, t], known: None }
        }));
    }
    all
}

/// The points of a simplex of some size, in spacings, at most 1,000. `left` carries its fraction to the next one.
fn whole_points(size: f64, left: &mut f64) -> usize {
    // Without spacing, as in a mesh of one place, the size is no number.
    *left += if size.is_finite() { size } else { 0.0 };
    let whole = left.floor();
    *left -= whole;
    (whole as usize).min(1000)
}

/// The points of a medial mesh whose balls are nearest to some places.
///
/// # Errors
/// When the medial mesh has no union.
pub(super) fn nearest_balls(mesh: &MedialMesh, places: &[Vec3]) -> Result<Vec<Held>> {
    if places.is_empty() {
        return Ok(Vec::new());
    }
    let hulls = Hulls::new(mesh);
    let found = union_of(mesh)?.deepest_batch_near(places, &[], |_| None);
    let held = places.iter().zip(found).map(|(&p, NearestPrimitive { primitive, .. })| {
        let (weights, _) = hulls.derivative(mesh, p, primitive);
        Held { primitive, weights, known: None }
    });
    Ok(held.collect())
}

/// Points whose balls are watched for protruding, for a mesh that is a `share` of the whole, on the simplices that
/// are `wanted`.
pub(super) fn places(mesh: &MedialMesh, share: f64, wanted: impl Fn(&[u32]) -> bool) -> Vec<Held> {
    spread_over(mesh, (share * HELD as f64) as usize, wanted)
}

/// The primitive of a medial mesh that serves each sample of the surface, and then each interior point. `near` is what
/// served them when the spheres were a little elsewhere, if that is known.
///
/// # Errors
/// When the medial mesh has no union.
pub(super) fn nearest(
    mesh: &MedialMesh,
    points: &Points,
    near: &[NearestPrimitive],
) -> Result<Vec<NearestPrimitive>> {
    let places: Vec<Vec3> = points.places().collect();
    // A primitive that holds an interior point deeply enough is accepted: no deeper one is searched.
    Ok(union_of(mesh)?.deepest_batch_near(&places, near, |i| points.enough(i)))
}

/// A mesh after an edit.
pub(super) struct Edited<'a> {
    pub before: &'a MedialMesh,
    pub mesh: &'a MedialMesh,
    /// For each sphere its number before; `None` for a new one. Ascending.
    pub of: &'a [Option<u32>],
}

impl Edited<'_> {
    /// Which spheres are new or were moved. Each new simplex has one of them as a corner.
    pub fn moved(&self) -> Vec<bool> {
        let spheres = self.of.iter().zip(&self.mesh.spheres);
        let moved = spheres
            .map(|(&of, sphere)| of.is_none_or(|old| self.before.spheres[old as usize] != *sphere));
        moved.collect()
    }

    /// For each primitive before, by kind, the same one now, if it was not moved.
    pub fn kept(&self, moved: &[bool]) -> Kept {
        let Self { before, mesh, of } = self;
        let mut spheres = vec![None; before.spheres.len()];
        for (new, &old) in (0..).zip(*of).filter(|&(new, _)| !moved[new as usize]) {
            if let Some(old) = old {
                spheres[old as usize] = Some(new);
            }
        }
        let same = |v: u32| spheres[v as usize];
        let edges = before.edges.iter().map(|&[a, b]| {
            let place = mesh.edges.binary_search(&[same(a)?, same(b)?]).ok()?;
            Some(place as u32)
        });
        let faces = before.faces.iter().map(|&[a, b, c]| {
            let place = mesh.faces.binary_search(&[same(a)?, same(b)?, same(c)?]).ok()?;
            Some(place as u32)
        });
        let (edges, faces) = (edges.collect(), faces.collect());
        Kept { spheres, edges, faces }
    }
}

/// For each primitive before an edit, the same one after it.
pub(super) struct Kept {
    spheres: Vec<Option<u32>>,
    edges: Vec<Option<u32>>,
    faces: Vec<Option<u32>>,
}

impl Kept {
    pub fn of(&self, primitive: Primitive) -> Option<Primitive> {
        match primitive {
            Primitive::Sphere(v) => self.spheres[v as usize].map(Primitive::Sphere),
            Primitive::Edge(e) => self.edges[e as usize].map(Primitive::Edge),
            Primitive::Face(f) => self.faces[f as usize].map(Primitive::Face),
        }
    }
}

/// [`nearest`] after an edit, from what it was `before`: only the part that was moved is searched, except for points
/// that it served.
///
/// # Errors
/// When the medial mesh has no union.
pub(super) fn nearest_after(
    mesh: &MedialMesh,
    moved: &Part,
    kept: &Kept,
    points: &Points,
    before: &[NearestPrimitive],
) -> Result<Vec<NearestPrimitive>> {
    let places: Vec<Vec3> = points.places().collect();
    let (mut all, mut lost) = (Vec::with_capacity(before.len()), Vec::new());
    let mut limits = Vec::with_capacity(before.len());
    for (i, found) in before.iter().enumerate() {
        let same = kept.of(found.primitive);
        let is_enough = points.enough(i).is_some_and(|enough| found.signed <= enough);
        if same.is_none() {
            lost.push(i);
        }
        limits.push(if same.is_none() || is_enough { f64::NEG_INFINITY } else { found.signed });
        all.push(NearestPrimitive { primitive: same.unwrap_or(found.primitive), ..*found });
    }
    let closer = union_of(&moved.mesh)?.below_batch(&places, &limits);
    for (found, closer) in all.iter_mut().zip(closer) {
        if let Some(NearestPrimitive { signed, primitive }) = closer {
            *found = NearestPrimitive { signed, primitive: moved.in_whole(mesh, primitive) };
        }
    }
    let places: Vec<Vec3> = lost.iter().map(|&i| places[i]).collect();
    let searched = union_of(mesh)?.deepest_batch_near(&places, &[], |k| points.enough(lost[k]));
    for (i, found) in lost.into_iter().zip(searched) {
        all[i] = found;
    }
    Ok(all)
}

/// The residuals of a medial mesh, by the primitives that are `nearest` to the points. Another one that stays is at
/// the distance `limits` from each sample, or there is none. Balls that protrude by no more than `tolerance` are left
/// out.
pub(super) fn residuals(
    mesh: &MedialMesh,
    goal: &Goal,
    points: &Points,
    limits: &[f64],
    nearest: Vec<NearestPrimitive>,
    tolerance: f64,
    held: &mut [Held],
) -> Residuals {
    let count = points.samples.len();
    let hulls = Hulls::new(mesh);
    let limits = limits.iter().copied().chain(std::iter::repeat(f64::INFINITY));
    let mut rows = Vec::with_capacity(nearest.len());
    for (i, (found, limit)) in nearest.iter().zip(limits).enumerate() {
        // No `min`: a distance that is not a number stays one.
        let signed = if limit < found.signed { limit } else { found.signed };
        let (point, weight, error, slope) = match points.samples.get(i) {
            Some(&Sample { point, weight }) => (point, weight, signed, 1.0),
            None => {
                let Interior { point, depth, weight } = points.interior[i - count];
                (point, weight, uncovered(depth.min(DEEP), signed), slope(signed))
            }
        };
        if i >= count && error <= 0.0 {
            continue;
        }
        // Where the limit is less, no sphere of this mesh decides.
        let (weights, direction) = if limit < found.signed {
            ([0.0; 3], [0.0; 4])
        } else {
            let (weights, direction) = hulls.derivative(mesh, point, found.primitive);
            (weights, direction.map(|d| slope * d))
        };
        rows.push(Row {
            primitive: found.primitive,
            weights,
            direction,
            error,
            weight,
            point,
            covered: i < count && error < 0.0,
            protrudes: false,
        });
    }
    let protruding = held.par_iter_mut().map(|held| {
        let ball = interpolated(mesh, held);
        let enough = ball.radius - tolerance;
        let depth = goal.depth_of_moved(ball.centre, enough, &mut held.known)?;
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
    Residuals { rows, nearest }
}

pub(super) fn union_of(mesh: &MedialMesh) -> Result<MedialUnion> {
    MedialUnion::new(mesh).map_err(|error| SimplifyError::Failed(error.to_string()))
}

/// The primitives of a medial mesh, for feet.
struct Hulls {
    cones: Vec<Cone>,
    slabs: Vec<Slab>,
}

impl Hulls {
    fn new(mesh: &MedialMesh) -> Self {
        let cones = mesh.edges.iter().map(|edge| {
            let [a, b] = edge.map(|v| mesh.spheres[v as usize]);
            Cone::new(a, b)
        });
        let slabs = mesh.faces.iter().map(|face| Slab::new(face.map(|v| mesh.spheres[v as usize])));
        Self { cones: cones.collect(), slabs: slabs.collect() }
    }

    /// The weights of the sphere that attains the distance of a point, and the derivative by it.
    fn derivative(&self, mesh: &MedialMesh, p: Vec3, primitive: Primitive) -> ([f64; 3], [f64; 4]) {
        let (weights, centre) = match primitive {
            Primitive::Sphere(v) => ([1.0, 0.0, 0.0], mesh.spheres[v as usize].centre),
            Primitive::Edge(e) => {
                let (sphere, [a, b]) = self.cones[e as usize].nearest_sphere(p);
                ([a, b, 0.0], sphere.centre)
            }
            Primitive::Face(f) => {
                let (sphere, weights) = self.slabs[f as usize].nearest_sphere(p);
                (weights, sphere.centre)
            }
        };
        let [x, y, z] = (p - centre).normalize_or_zero().to_array();
        (weights, [-x, -y, -z, -1.0])
    }
}
