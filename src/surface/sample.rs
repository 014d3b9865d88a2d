//! Points on a surface: its vertices, area-uniform, or blue noise.

use std::cmp::Ordering;
use std::fmt;
use std::str::FromStr;

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::mesh::{TriMesh, Unit};
use crate::Vec3;
use crate::range_queue::RangeQueue;
use crate::sum::Sum;

/// How a surface is sampled.
///
/// As text: `conforming`, `conforming:20000`, `vertices`, `uniform:20000`, `blue:20000`, the latter two with an
/// optional seed as in `blue:20000:7`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Sampling {
    /// The vertices of the mesh, unaltered: as in the papers.
    MeshVertices,
    /// The vertices of the mesh, and points that are added until their Delaunay triangulation contains the
    /// surface: by [`Shape`](crate::shape::Shape), which triangulates them. To [`sample`] alone these are
    /// the vertices.
    Conforming {
        /// Number of points at least: the longest edges are split before.
        least: usize,
    },
    /// Independent points, uniformly distributed by area.
    AreaUniform {
        /// Number of points.
        count: usize,
        /// Seed of the random numbers.
        seed: u64,
    },
    /// Points with a large distance to each other, uniformly distributed by area: the best
    /// `count` of five times as many area-uniform ones.
    BlueNoise {
        /// Number of points.
        count: usize,
        /// Seed of the random numbers.
        seed: u64,
    },
}

impl Default for Sampling {
    fn default() -> Self {
        Self::Conforming { least: 0 }
    }
}

/// A text that names no sampling.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} is no sampling; use conforming, conforming:COUNT, vertices, uniform:COUNT or blue:COUNT, the last \
     two with an optional :SEED, and a count from 1 to 10000000, of conforming and blue to 1000000"
)]
pub struct ParseSamplingError(String);

/// Bound on the number of samples: more are surely a typing error.
const MAX_SAMPLES: usize = 10_000_000;
/// Bound for blue noise and conforming samples: elimination takes about two kilobytes for each, and refinement may
/// add eight for each.
const MAX_BLUE_SAMPLES: usize = 1_000_000;

impl FromStr for Sampling {
    type Err = ParseSamplingError;

    fn from_str(text: &str) -> Result<Self, ParseSamplingError> {
        let error = || ParseSamplingError(text.to_owned());
        let mut parts = text.split(':');
        let kind = parts.next();
        if text == "vertices" {
            return Ok(Self::MeshVertices);
        }
        if text == "conforming" {
            return Ok(Self::default());
        }
        // Only now: the two kinds above have no count.
        let count = parts.next().and_then(|c| c.parse().ok()).ok_or_else(error)?;
        if kind == Some("conforming")
            && parts.clone().next().is_none()
            && (1..=MAX_BLUE_SAMPLES).contains(&count)
        {
            return Ok(Self::Conforming { least: count });
        }
        let seed = parts.next().map_or(Ok(0), str::parse).map_err(|_| error())?;
        match kind {
            _ if parts.next().is_some() || !(1..=MAX_SAMPLES).contains(&count) => Err(error()),
            Some("uniform") => Ok(Self::AreaUniform { count, seed }),
            Some("blue") if count <= MAX_BLUE_SAMPLES => Ok(Self::BlueNoise { count, seed }),
            _ => Err(error()),
        }
    }
}

impl Sampling {
    /// `count` points, at least 1, of the same kind and seed; blue noise in place of the kinds that start from the vertices.
    pub fn with_count(self, count: usize) -> Self {
        match self {
            Self::Conforming { .. } | Self::MeshVertices => Self::BlueNoise { count, seed: 0 },
            Self::AreaUniform { seed, .. } => Self::AreaUniform { count, seed },
            Self::BlueNoise { seed, .. } => Self::BlueNoise { count, seed },
        }
    }

    /// The same sampling with another seed.
    pub fn with_seed(self, seed: u64) -> Self {
        match self {
            Self::Conforming { .. } | Self::MeshVertices => self,
            Self::AreaUniform { count, .. } => Self::AreaUniform { count, seed },
            Self::BlueNoise { count, .. } => Self::BlueNoise { count, seed },
        }
    }
}

impl TryFrom<String> for Sampling {
    type Error = ParseSamplingError;

    fn try_from(text: String) -> Result<Self, ParseSamplingError> {
        text.parse()
    }
}

impl From<Sampling> for String {
    fn from(sampling: Sampling) -> Self {
        sampling.to_string()
    }
}

impl fmt::Display for Sampling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, count, seed) = match *self {
            Self::MeshVertices => return f.write_str("vertices"),
            Self::Conforming { least: 0 } => return f.write_str("conforming"),
            Self::Conforming { least } => ("conforming", least, 0),
            Self::AreaUniform { count, seed } => ("uniform", count, seed),
            Self::BlueNoise { count, seed } => ("blue", count, seed),
        };
        write!(f, "{kind}:{count}")?;
        if seed == 0 { Ok(()) } else { write!(f, ":{seed}") }
    }
}

/// Candidates for each point of blue noise, as C. Yuksel recommends.
const CANDIDATES: usize = 5;

/// Samples a surface. Exactly the requested number of points, in the unit of the mesh; none if the mesh
/// has no area. `conforming` gives the vertices.
///
/// # Panics
/// If a face names a vertex that does not exist.
///
/// # Cost
/// `O(F + n log F)`, blue noise `O(F + n log n)`.
///
/// ```
/// use medial::{Vec3, surface::{Sampling, TriMesh, sample}};
///
/// let triangle = TriMesh { vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y], faces: vec![[0, 1, 2]] };
/// let sampling: Sampling = "blue:100".parse()?;
/// assert_eq!(sample(&triangle, &sampling).len(), 100);
/// # Ok::<(), medial::surface::ParseSamplingError>(())
/// ```
pub fn sample(mesh: &TriMesh, sampling: &Sampling) -> Vec<Vec3> {
    match *sampling {
        Sampling::Conforming { .. } | Sampling::MeshVertices => mesh.vertices.clone(),
        Sampling::AreaUniform { count, seed } => {
            let mut areas = Areas::new(mesh);
            areas.points(count, seed).into_iter().map(|(point, _)| point).collect()
        }
        Sampling::BlueNoise { count, seed } => {
            let mut areas = Areas::new(mesh);
            let candidates = areas.points(count.saturating_mul(CANDIDATES), seed);
            let area = areas.total();
            let kept = eliminate(
                &candidates.iter().map(|&(p, _)| areas.unit.forward(p)).collect::<Vec<_>>(),
                &candidates.iter().map(|&(_, face)| areas.normal(face)).collect::<Vec<_>>(),
                area,
                count,
            );
            kept.into_iter().map(|i| candidates[i as usize].0).collect()
        }
    }
}

/// Independent points, uniformly distributed by area, each with the face that it is on: those of
/// [`Sampling::AreaUniform`]. None if the mesh has no area.
///
/// # Panics
/// If a face names a vertex that does not exist.
pub fn sample_with_faces(mesh: &TriMesh, count: usize, seed: u64) -> Vec<(Vec3, u32)> {
    Areas::new(mesh).points(count, seed)
}

/// Cumulative areas in scaled units.
struct Areas<'a> {
    mesh: &'a TriMesh,
    unit: Unit,
    up_to: Vec<f64>,
}

impl<'a> Areas<'a> {
    fn new(mesh: &'a TriMesh) -> Self {
        let unit = Unit::of(&mesh.vertices);
        let mut areas = Self { mesh, unit, up_to: Vec::with_capacity(mesh.faces.len()) };
        let mut sum = Sum::default();
        for face in 0..mesh.faces.len() {
            sum.add(0.5 * areas.area_vector(face).length());
            areas.up_to.push(sum.value());
        }
        areas
    }

    fn area_vector(&self, face: usize) -> Vec3 {
        let [a, b, c] = self.mesh.triangle(face).map(|p| self.unit.forward(p));
        (b - a).cross(c - a)
    }

    fn normal(&self, face: u32) -> Vec3 {
        self.area_vector(face as usize).normalize_or_zero()
    }

    fn total(&self) -> f64 {
        self.up_to.last().copied().unwrap_or(0.0)
    }

    /// Uniform points with their faces: a face by its share of the area, then the point
    /// `(1 - sqrt u) a + sqrt u (1 - v) b + sqrt u v c`, written with differences from `a`, so that
    /// faces in planes across an axis get points exactly in these planes.
    fn points(&mut self, count: usize, seed: u64) -> Vec<(Vec3, u32)> {
        let total = self.total();
        if total.is_nan() || total <= 0.0 {
            return Vec::new();
        }
        let mut random = Pcg64::seed_from_u64(seed);
        // 53 random bits, spelled out so that the points do not depend on a crate's version.
        let units = std::iter::repeat_with(move || {
            [(); 3].map(|()| (random.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64))
        });
        let points = units.take(count).map(|[share, u, v]| {
            let last = self.up_to.len() - 1;
            let face = self.up_to.partition_point(|&sum| sum <= share * total).min(last);
            // The root makes the points uniform by area.
            let root = u.sqrt();
            let [a, b, c] = self.mesh.triangle(face);
            (a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v), face as u32)
        });
        points.collect()
    }
}

// Blue noise by weighted sample elimination.
//
// C. Yuksel, Sample elimination for generating Poisson disk sample sets, Computer Graphics Forum
// 34 (2015), 10.1111/cgf.12538.
//
// 1. Maximal radius (eq. 3, area): `r = sqrt(A / (2 sqrt(3) N))`, half the spacing of the densest
//    packing of `N` points on the area `A`.
// 2. Weight of each sample (eq. 4): the sum over samples `j` within `2 r` of
//    `(1 - d / 2r)^8`, with `d` not below the `2 r_min` of eq. 5,
//    `r_min = r (1 - (N / M)^1.5) 0.65`, so that clusters do not decide alone.
// 3. Remove the heaviest sample and subtract its contribution from the weights of its neighbours.
//    Repeat until `N` of the `M` samples are left.
//
// Deviations from the paper:
// - Samples whose faces look in opposite directions are not neighbours: on a thin wall the two
//   sides are sampled independently, which a Voronoi diagram needs to separate them.
// - Of equally heavy samples the one with the smaller index is removed.

/// Exponent of the weight of a neighbour by its distance, as in the paper.
const ALPHA: i32 = 8;

/// Factor of the least distance, as in the paper.
const BETA: f64 = 0.65;

/// Exponent of the share of samples that stay, as in the paper.
const GAMMA: f64 = 1.5;

/// Indices, ascending, of the `count` points to keep. Points are in a unit in which neither their
/// extent nor `area` overflows when squared.
pub(super) fn eliminate(points: &[Vec3], normals: &[Vec3], area: f64, count: usize) -> Vec<u32> {
    if points.len() <= count {
        return (0..points.len() as u32).collect();
    }
    if count == 0 {
        return Vec::new();
    }
    let radius = (area / (2.0 * 3.0_f64.sqrt() * count as f64)).sqrt();
    let reach = 2.0 * radius;
    // Found once: eliminations only remove neighbours.
    let neighbours = Neighbours::within(points, normals, reach);
    let share = count as f64 / points.len() as f64;
    let least = 2.0 * radius * (1.0 - share.powf(GAMMA)) * BETA;
    let mut weights: Vec<f64> = (0..points.len())
        .into_par_iter()
        .map(|i| neighbours.of(i).iter().map(|&(_, d)| weight(d, least, reach)).sum())
        .collect();
    let heaviest = |((place, &sample), &weight)| Heaviest { weight, sample, place };
    let samples = (0..).zip(&neighbours.samples).zip(&weights);
    let mut queue = RangeQueue::new(samples.map(heaviest).collect());
    let mut is_kept = vec![true; points.len()];
    for _ in count..points.len() {
        // Weights only fall.
        let present =
            |item: Heaviest| Some(Heaviest { weight: weights[item.place as usize], ..item });
        let Some(Heaviest { place, .. }) = queue.pop(present) else { break };
        is_kept[place as usize] = false;
        for &(other, distance) in neighbours.of(place as usize) {
            weights[other as usize] -= weight(distance, least, reach);
        }
    }
    let samples = neighbours.samples.iter().zip(is_kept);
    let mut kept: Vec<u32> = samples.filter(|&(_, kept)| kept).map(|(&sample, _)| sample).collect();
    kept.par_sort_unstable();
    kept
}

/// Step 2: the part of a sample's weight from another one at this distance.
fn weight(distance: f32, least: f64, reach: f64) -> f64 {
    (1.0 - f64::from(distance).max(least) / reach).max(0.0).powi(ALPHA)
}

/// An entry of the queue: largest weight first, then smallest index.
#[derive(Clone, Copy)]
struct Heaviest {
    weight: f64,
    sample: u32,
    /// Its place among the neighbours.
    place: u32,
}

impl Ord for Heaviest {
    fn cmp(&self, other: &Self) -> Ordering {
        other.weight.total_cmp(&self.weight).then(self.sample.cmp(&other.sample))
    }
}

impl PartialOrd for Heaviest {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Heaviest {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Heaviest {}

/// For each sample the others near it and their distances. Samples are numbered along cells of space, so that
/// neighbours are close in memory.
struct Neighbours {
    /// The samples in this order.
    samples: Vec<u32>,
    start: Vec<usize>,
    near: Vec<(u32, f32)>,
}

/// Samples whose neighbours one task finds.
const TASK: usize = 4096;

/// Cells along one axis; three indices fit 64 bits.
const CELLS: f64 = (1 << 20) as f64;

/// The key of a cell. Cells along `z` have consecutive keys.
fn key([x, y, z]: [u64; 3]) -> u64 {
    (x << 42) | (y << 21) | z
}

impl Neighbours {
    /// All pairs closer than `reach` on faces that do not look in opposite directions.
    fn within(points: &[Vec3], normals: &[Vec3], reach: f64) -> Self {
        let lo = points.iter().fold(Vec3::INFINITY, |lo, &p| lo.min(p));
        let hi = points.iter().fold(Vec3::NEG_INFINITY, |hi, &p| hi.max(p));
        let size = reach.max((hi - lo).max_element() / CELLS);
        // One cell of margin, so that the cells beside a cell always have a valid number.
        let cell = |p: Vec3| ((p - lo) / size).to_array().map(|x| x as u64 + 1);
        let mut order: Vec<(u64, u32)> =
            (0..).zip(points).map(|(i, &p)| (key(cell(p)), i)).collect();
        order.par_sort_unstable();
        let places: Vec<_> =
            order.iter().map(|&(_, i)| (points[i as usize], normals[i as usize])).collect();
        let tasks: Vec<_> = (0..points.len()).step_by(TASK).collect();
        let (lengths, near): (Vec<Vec<_>>, Vec<Vec<_>>) = tasks
            .into_par_iter()
            .map(|first: usize| {
                let (mut lengths, mut near) = (Vec::with_capacity(TASK), Vec::new());
                for i in first..places.len().min(first + TASK) {
                    let (before, (p, normal)) = (near.len(), places[i]);
                    let [x, y, z] = cell(p);
                    for (x, y) in (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)))
                    {
                        // Keys of three cells along z are consecutive: one search instead of three.
                        let (low, high) = (key([x, y, z - 1]), key([x, y, z + 1]));
                        let from = order.partition_point(|&(k, _)| k < low);
                        let to = order[from..].iter().take_while(|&&(k, _)| k <= high).count();
                        for (j, &(q, other)) in (from..).zip(&places[from..from + to]) {
                            let distance = p.distance(q);
                            if j != i && distance < reach && normal.dot(other) >= 0.0 {
                                near.push((j as u32, distance as f32));
                            }
                        }
                    }
                    lengths.push(near.len() - before);
                }
                (lengths, near)
            })
            .unzip();
        let mut start = vec![0];
        for length in lengths.concat() {
            start.push(start[start.len() - 1] + length);
        }
        let near = near.concat();
        Self { samples: order.into_iter().map(|(_, i)| i).collect(), start, near }
    }

    /// The places of the neighbours of the sample at a place, and their distances.
    fn of(&self, place: usize) -> &[(u32, f32)] {
        &self.near[self.start[place]..self.start[place + 1]]
    }
}
