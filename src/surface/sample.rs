//! Points on a surface: its vertices, area-uniform, or blue noise.

use std::fmt;
use std::str::FromStr;

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use super::eliminate::eliminate;
use super::mesh::TriMesh;
use super::unit::Unit;
use crate::Vec3;
use crate::sum::Sum;

/// How a surface is sampled.
///
/// As text: `vertices`, `auto`, `uniform:20000`, `blue:20000`, the latter two with an optional seed as
/// in `blue:20000:7`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Sampling {
    /// The vertices of the mesh, unaltered.
    #[default]
    MeshVertices,
    /// The vertices of the mesh, and points that are added until the medial mesh is right: by
    /// [`Shape`](crate::shape::Shape), which knows it. To [`sample`] alone these are the vertices.
    Auto,
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

/// A text that names no sampling.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} is no sampling; use vertices, auto, uniform:COUNT or blue:COUNT, with an optional \
     :SEED, and a count from 1 to 10000000, of blue noise to 1000000"
)]
pub struct ParseSamplingError(String);

/// Bound on the number of samples: more are surely a typing error.
const MAX_SAMPLES: usize = 10_000_000;
/// Bound for blue noise: elimination takes about two kilobytes for each sample.
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
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let count = parts.next().and_then(|c| c.parse().ok()).ok_or_else(error)?;
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
    /// So many points of the same kind and seed; blue noise where the kind has a number of its
    /// own, as the vertices have. `count` is at least 1.
    pub fn with_count(self, count: usize) -> Self {
        match self {
            Self::MeshVertices | Self::Auto => Self::BlueNoise { count, seed: 0 },
            Self::AreaUniform { seed, .. } => Self::AreaUniform { count, seed },
            Self::BlueNoise { seed, .. } => Self::BlueNoise { count, seed },
        }
    }

    /// The same sampling with another seed.
    pub fn with_seed(self, seed: u64) -> Self {
        match self {
            Self::MeshVertices | Self::Auto => self,
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
            Self::Auto => return f.write_str("auto"),
            Self::AreaUniform { count, seed } => ("uniform", count, seed),
            Self::BlueNoise { count, seed } => ("blue", count, seed),
        };
        write!(f, "{kind}:{count}")?;
        if seed == 0 { Ok(()) } else { write!(f, ":{seed}") }
    }
}

/// Candidates for each point of blue noise, as C. Yuksel recommends.
const CANDIDATES: usize = 5;

/// Samples a surface. Exactly as many points as asked, in the unit of the mesh; none if the mesh
/// has no area. [`Sampling::Auto`] gives the vertices.
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
        Sampling::MeshVertices | Sampling::Auto => mesh.vertices.clone(),
        Sampling::AreaUniform { count, seed } => {
            let mut areas = Areas::new(mesh);
            areas.points(count, seed).into_iter().map(|(point, _)| point).collect()
        }
        Sampling::BlueNoise { count, seed } => {
            let mut areas = Areas::new(mesh);
            let candidates = areas.points(count.saturating_mul(CANDIDATES), seed);
            let area = areas.total();
            let scaled = |p| areas.unit.forward(p);
            let kept = eliminate(
                &candidates.iter().map(|&(p, _)| scaled(p)).collect::<Vec<_>>(),
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
        let mut unit = move || (random.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64);
        let point = |_| {
            let share = unit() * total;
            let last = self.up_to.len() - 1;
            let face = self.up_to.partition_point(|&sum| sum <= share).min(last);
            let (root, v) = (unit().sqrt(), unit());
            let [a, b, c] = self.mesh.triangle(face);
            (a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v), face as u32)
        };
        (0..count).map(point).collect()
    }
}
