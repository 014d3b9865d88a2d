//! Distances between two medial axes: as sets of points in space, and as sets of spheres.
//!
//! Each axis is sampled and measured against the triangles, lone edges and isolated points of the
//! other.
//!
//! - In space, radii are ignored. With radii, an axis is a set of points `(x, y, z, r)`, linear over
//!   each simplex, in four-dimensional space: two axes in the same place whose radii differ by `d`
//!   everywhere are `d` apart.
//! - Maxima are over samples of all triangles and lone edges, and all spheres.
//! - Means are over the parts of the highest dimension that the sampled axis has: by area if it has
//!   triangles, else by length, else over its points. A curve has no area, so it has no weight next to
//!   a sheet.
//! - A *sheet* of the true axis is a set of triangles connected across edges of exactly two
//!   triangles. A point of a sheet is covered if the computed axis is within [`COVERED`] of it in
//!   space.

use std::ops::Range;

use glam::DVec4;
use rayon::prelude::*;

use super::error::MetricError;
use super::evaluation::{AxisDistances, AxisSpan, SheetCoverage};
use super::samples::{Placed, place_on_triangles};
use crate::Vec3;
use crate::complex::{Incidence, MedialMesh, Sphere, UnionError};
use crate::geometry::DisjointSets;
use crate::geometry::trees::{Bounds, Node, Plan, Search, Tree};
use crate::surface::TriangleBvh;

/// Distance, in the unit of the axes, within which a point of a sheet is covered.
pub const COVERED: f64 = 0.01;

/// How densely to sample an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisOptions {
    /// Samples on the triangles of each axis, and as many on its lone edges.
    pub samples: usize,
    /// Seed.
    pub seed: u64,
}

impl Default for AxisOptions {
    fn default() -> Self {
        Self { samples: 50_000, seed: 0 }
    }
}

/// Distances between a computed medial axis and the true one, in their unit.
///
/// # Errors
/// When an axis is empty or not valid, or no samples are requested.
pub fn axis_distance(
    computed: &MedialMesh,
    truth: &MedialMesh,
    options: &AxisOptions,
) -> Result<AxisDistances, MetricError> {
    let [computed, truth] = [PreparedAxis::new(computed)?, PreparedAxis::new(truth)?];
    prepared_axis_distance(&computed, &truth, options)
}

/// [`axis_distance`] for prepared axes, which can be measured several times.
pub(super) fn prepared_axis_distance(
    computed: &PreparedAxis,
    truth: &PreparedAxis,
    options: &AxisOptions,
) -> Result<AxisDistances, MetricError> {
    if options.samples == 0 {
        return Err(MetricError::NoSamples("samples"));
    }
    let there = directed(computed, truth, options);
    let back = directed(truth, computed, options);
    Ok(AxisDistances {
        coverage: coverage(truth, &back),
        in_space: span(there.in_space, back.in_space),
        with_radius: span(there.with_radius, back.with_radius),
    })
}

fn span(there: Extent, back: Extent) -> AxisSpan {
    AxisSpan {
        computed_to_true_max: there.max,
        computed_to_true_mean: there.mean,
        true_to_computed_max: back.max,
        true_to_computed_mean: back.mean,
    }
}

/// For each triangle the smallest triangle of its sheet.
fn sheets(mesh: &MedialMesh) -> Vec<u32> {
    let incidence = Incidence::of(mesh);
    // Three triangles at an edge are a seam, where sheets end.
    let joins = |edge: u32| incidence.faces_at()[edge as usize] == 2;
    let mut first_at = vec![None; mesh.edges.len()];
    let mut sheets = DisjointSets::singletons(mesh.faces.len());
    for (face, edges) in (0..).zip(incidence.face_edges()) {
        for &edge in edges.iter().filter(|&&edge| joins(edge)) {
            sheets.join(face, *first_at[edge as usize].get_or_insert(face));
        }
    }
    (0..mesh.faces.len() as u32).map(|face| sheets.find(face)).collect()
}

/// The covered share of each sheet, the largest sheet first.
fn coverage(truth: &PreparedAxis, back: &Directed) -> Vec<SheetCoverage> {
    let PreparedAxis { parts: truth, sheet_of_face, .. } = truth;
    let mut sheets: Vec<(u32, SheetCoverage, [usize; 2])> = Vec::new();
    let mut index = vec![usize::MAX; sheet_of_face.len()];
    for (face, &sheet) in sheet_of_face.iter().enumerate() {
        if index[sheet as usize] == usize::MAX {
            index[sheet as usize] = sheets.len();
            sheets.push((sheet, SheetCoverage { area: 0.0, covered: None }, [0; 2]));
        }
        let [a, b, c] = truth.triangles[face].map(DVec4::truncate);
        sheets[index[sheet as usize]].1.area += (b - a).cross(c - a).length() * 0.5;
    }
    for (placed, &distance) in back.on_triangles.iter().zip(&back.of_triangles) {
        let [near, all] = &mut sheets[index[sheet_of_face[placed.triangle] as usize]].2;
        *all += 1;
        *near += usize::from(distance <= COVERED);
    }
    for (_, sheet, [near, all]) in &mut sheets {
        sheet.covered = (*all > 0).then(|| *near as f64 / *all as f64);
    }
    sheets.sort_by(|a, b| b.1.area.total_cmp(&a.1.area).then(a.0.cmp(&b.0)));
    sheets.into_iter().map(|(_, sheet, _)| sheet).collect()
}

/// A medial mesh as a set of points with radii.
pub(super) struct AxisParts {
    pub triangles: Vec<[DVec4; 3]>,
    /// Edges without a face.
    segments: Vec<[DVec4; 2]>,
    spheres: Vec<DVec4>,
    /// Spheres without an edge.
    isolated: Vec<DVec4>,
}

impl AxisParts {
    fn new(mesh: &MedialMesh) -> Result<Self, MetricError> {
        mesh.check().map_err(UnionError::from)?;
        if mesh.spheres.is_empty() {
            return Err(UnionError::Empty.into());
        }
        let spheres: Vec<DVec4> = mesh.spheres.iter().copied().map(lifted).collect();
        let segments = mesh.lone_edges().into_iter();
        Ok(Self {
            triangles: mesh.faces.iter().map(|f| f.map(|v| spheres[v as usize])).collect(),
            segments: segments.map(|e| e.map(|v| spheres[v as usize])).collect(),
            isolated: mesh.isolated().into_iter().map(|v| spheres[v as usize]).collect(),
            spheres,
        })
    }

    /// All parts: segments and points as triangles of no area.
    pub fn simplices(&self) -> Vec<[DVec4; 3]> {
        let mut parts = self.triangles.clone();
        parts.extend(self.segments.iter().map(|&[a, b]| [a, b, b]));
        parts.extend(self.isolated.iter().map(|&c| [c; 3]));
        parts
    }
}

/// An axis, prepared to be sampled and to be measured against.
pub(super) struct PreparedAxis {
    pub parts: AxisParts,
    sheet_of_face: Vec<u32>,
    pub in_space: TriangleBvh,
    with_radius: LiftedAxis,
}

impl PreparedAxis {
    /// # Errors
    /// When the mesh is empty or not valid.
    pub fn new(mesh: &MedialMesh) -> Result<Self, MetricError> {
        let parts = AxisParts::new(mesh)?;
        let simplices = parts.simplices();
        let flat: Vec<_> = simplices.iter().map(|s| s.map(DVec4::truncate)).collect();
        Ok(Self {
            parts,
            sheet_of_face: sheets(mesh),
            in_space: TriangleBvh::from_triangles(&flat).map_err(MetricError::Tree)?,
            with_radius: LiftedAxis::new(&simplices),
        })
    }
}

/// Distances from one axis to another.
struct Directed {
    in_space: Extent,
    with_radius: Extent,
    /// Where the samples of the triangles are, and their distances in space.
    on_triangles: Vec<Placed>,
    of_triangles: Vec<f64>,
}

struct Extent {
    max: f64,
    mean: f64,
}

impl Extent {
    /// Of the distances of samples of triangles, of lone edges, and of spheres.
    fn of(sets: &[Vec<f64>; 3]) -> Self {
        let max = sets.iter().flatten().copied().fold(0.0, f64::max);
        let highest = sets.iter().find(|set| !set.is_empty());
        let mean = highest.map_or(0.0, |set| set.iter().sum::<f64>() / set.len() as f64);
        Self { max, mean }
    }
}

fn directed(from: &PreparedAxis, to: &PreparedAxis, options: &AxisOptions) -> Directed {
    let from = &from.parts;
    let in_space: Vec<_> = from.triangles.iter().map(|t| t.map(DVec4::truncate)).collect();
    let placed = place_on_triangles(&in_space, options.samples, options.seed).unwrap_or_default();
    let sheets = placed.iter().map(|placed| placed.on(&from.triangles)).collect();
    let curves = sample_segments(&from.segments, options.samples);
    let sets: [Vec<DVec4>; 3] = [sheets, curves, from.spheres.clone()];
    let with_radius = [0, 1, 2].map(|k| to.with_radius.distances(&sets[k]));
    let in_space = sets.map(|set| {
        let points: Vec<Vec3> = set.into_iter().map(DVec4::truncate).collect();
        to.in_space.distance_batch(&points)
    });
    let (with_radius, extent) = (Extent::of(&with_radius), Extent::of(&in_space));
    let [of_triangles, ..] = in_space;
    Directed { in_space: extent, with_radius, on_triangles: placed, of_triangles }
}

/// `count` points, equally spaced along the list of segments; none when they have no length.
pub(super) fn sample_segments(segments: &[[DVec4; 2]], count: usize) -> Vec<DVec4> {
    let total: f64 = segments.iter().map(length).sum();
    let mut points = Vec::new();
    if !(total > 0.0 && total.is_finite()) {
        return points;
    }
    let spacing = total / count as f64;
    let mut below = 0.0;
    for segment in segments {
        let ([a, b], length) = (*segment, length(segment));
        while let at = (points.len() as f64 + 0.5) * spacing
            && at < below + length
        {
            points.push(a.lerp(b, ((at - below) / length).clamp(0.0, 1.0)));
        }
        below += length;
    }
    points
}

/// The length in space: radii do not count.
fn length([a, b]: &[DVec4; 2]) -> f64 {
    a.truncate().distance(b.truncate())
}

// A medial axis as a set of spheres: points `(x, y, z, r)` of four-dimensional space.
//
// Triangles, segments and points are found through a tree of their boxes in space. Space is a
// projection of the four dimensions, so a box is never farther than its contents.

/// Squared sine of the angle of two sides, below which only the sides of a triangle are measured.
const MIN_SINE_SQUARED: f64 = 1e-24;

/// The sphere as a point.
pub(super) fn lifted(sphere: Sphere) -> DVec4 {
    sphere.centre.extend(sphere.radius)
}

/// Simplices in space and radius, prepared for distance queries.
pub(super) struct LiftedAxis {
    tree: Tree,
    /// In leaf order. A segment repeats a corner, a point is three times the same.
    simplices: Vec<[DVec4; 3]>,
}

impl LiftedAxis {
    pub fn new(simplices: &[[DVec4; 3]]) -> Self {
        let corners = simplices.iter().map(|simplex| simplex.map(DVec4::truncate));
        let boxes: Vec<_> = corners.map(|corners| (Bounds::of_points(corners), 0.0)).collect();
        let tree = Tree::build(&boxes, Plan { max_leaf: 4, group: 1, padding: 0.0 });
        let simplices = tree.order().iter().map(|&s| simplices[s as usize]).collect();
        Self { tree, simplices }
    }

    /// Distances of some points, in their order, in parallel. Faster if each point is close to the one
    /// before, because that one's nearest simplex is tried first.
    pub fn distances(&self, points: &[DVec4]) -> Vec<f64> {
        let chunks = points.par_chunks(256).flat_map_iter(|chunk| {
            let mut nearest = None;
            chunk.iter().map(move |&p| {
                let mut search = Nearest::of(self, p);
                // A first bound close to the result prunes most of the tree.
                if let Some(last) = nearest {
                    search.visit(last..last + 1);
                }
                self.tree.search(&mut search);
                nearest = search.simplex;
                search.distance
            })
        });
        chunks.collect()
    }
}

struct Nearest<'a> {
    axis: &'a LiftedAxis,
    p: DVec4,
    place: Vec3,
    distance: f64,
    /// The simplex at that distance.
    simplex: Option<usize>,
    /// From the point to the nearest one of that simplex.
    to: DVec4,
}

impl<'a> Nearest<'a> {
    fn of(axis: &'a LiftedAxis, p: DVec4) -> Self {
        let distance = f64::INFINITY;
        Self { axis, p, place: p.truncate(), distance, simplex: None, to: DVec4::ZERO }
    }

    /// Whether all corners, and so the simplex, lie beyond the plane through the nearest point so far
    /// orthogonal to the direction to it. Then the simplex is no nearer, and need not be measured.
    #[inline]
    fn is_beyond(&self, corners: &[DVec4; 3]) -> bool {
        let squared = self.distance * self.distance;
        corners.iter().all(|&corner| (corner - self.p).dot(self.to) >= squared)
    }
}

impl Search for Nearest<'_> {
    #[inline]
    fn bound(&self, node: &Node) -> f64 {
        node.bounds.distance_squared(self.place).sqrt()
    }

    #[inline]
    fn limit(&self) -> f64 {
        self.distance
    }

    fn visit(&mut self, places: Range<usize>) {
        for simplex in places {
            let corners = &self.axis.simplices[simplex];
            if self.simplex.is_some() && self.is_beyond(corners) {
                continue;
            }
            let to = towards(self.p, corners);
            let distance = to.length();
            if distance < self.distance {
                (self.distance, self.simplex, self.to) = (distance, Some(simplex), to);
            }
        }
    }
}

/// The vector from a point to the nearest point of a triangle, degenerate or not.
#[inline]
fn towards(p: DVec4, &[a, b, c]: &[DVec4; 3]) -> DVec4 {
    let (u, v, w) = (b - a, c - a, p - a);
    let [uu, uv, vv] = [u.dot(u), u.dot(v), v.dot(v)];
    let [wu, wv] = [w.dot(u), w.dot(v)];
    let determinant = uu * vv - uv * uv;
    if determinant > MIN_SINE_SQUARED * uu * vv {
        let (s, t) = ((wu * vv - wv * uv) / determinant, (wv * uu - wu * uv) / determinant);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            return s * u + t * v - w;
        }
    }
    let sides = shorter(towards_segment(p, a, b), towards_segment(p, c, a));
    shorter(sides, towards_segment(p, b, c))
}

/// The shorter vector, the first of equally long ones.
#[inline]
fn shorter(x: DVec4, y: DVec4) -> DVec4 {
    if y.length_squared() < x.length_squared() { y } else { x }
}

/// The vector from a point to the nearest point of a segment.
#[inline]
fn towards_segment(p: DVec4, from: DVec4, to: DVec4) -> DVec4 {
    let (along, w) = (to - from, p - from);
    let squared = along.length_squared();
    let share = if squared > 0.0 { (w.dot(along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    share * along - w
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    /// Against the nearest of many points of each simplex.
    #[test]
    fn distances_match_dense_points() {
        let mut rng = Pcg64::seed_from_u64(4);
        let mut random = || DVec4::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
        let mut simplices: Vec<[DVec4; 3]> = (0..40).map(|_| [(); 3].map(|()| random())).collect();
        for k in 0..10 {
            simplices[k][2] = simplices[k][1];
            simplices[k / 2] = [simplices[k / 2][0]; 3];
        }
        let axis = LiftedAxis::new(&simplices);
        const STEPS: u32 = 100;
        for _ in 0..40 {
            let p = 1.5 * random();
            let found = axis.distances(&[p])[0];
            let mut dense = f64::INFINITY;
            for [a, b, c] in &simplices {
                for i in 0..=STEPS {
                    for j in 0..=STEPS - i {
                        let [s, t] = [i, j].map(|k| f64::from(k) / f64::from(STEPS));
                        dense = dense.min(p.distance(a + s * (b - a) + t * (c - a)));
                    }
                }
            }
            assert!(found <= dense + 1e-12 && dense - found < 0.01, "{found} for {dense}");
        }
    }
}
