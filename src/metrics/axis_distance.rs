//! Distances between two medial axes as point sets in space, radii left aside.
//!
//! Each axis is sampled and measured against the triangles, lone edges and isolated points of the
//! other.
//!
//! - Maxima are over samples of all triangles and lone edges, and all sphere centres.
//! - Means are over the parts of the highest dimension that the sampled axis has: by area where it
//!   has triangles, else by length, else over its points. A curve has no area to weigh it against
//!   a sheet.

use super::hausdorff::sample_triangles;
use super::{AxisDistances, MetricError};
use crate::Vec3;
use crate::complex::{MedialMesh, UnionError};
use crate::geometry::{BvhError, TriangleBvh};

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
/// When an axis is empty or not valid, or no samples are asked.
pub fn axis_distance(
    computed: &MedialMesh,
    truth: &MedialMesh,
    options: &AxisOptions,
) -> Result<AxisDistances, MetricError> {
    if options.samples == 0 {
        return Err(MetricError::NoSamples("samples"));
    }
    let [computed, truth] = [AxisParts::new(computed)?, AxisParts::new(truth)?];
    let there = directed(&computed, &truth, options)?;
    let back = directed(&truth, &computed, options)?;
    Ok(AxisDistances {
        computed_to_true_max: there.max,
        computed_to_true_mean: there.mean,
        true_to_computed_max: back.max,
        true_to_computed_mean: back.mean,
    })
}

/// A medial mesh as a point set.
struct AxisParts {
    triangles: Vec<[Vec3; 3]>,
    /// Edges without a face.
    segments: Vec<[Vec3; 2]>,
    centres: Vec<Vec3>,
}

impl AxisParts {
    fn new(mesh: &MedialMesh) -> Result<Self, MetricError> {
        mesh.check().map_err(UnionError::from)?;
        if mesh.spheres.is_empty() {
            return Err(UnionError::Empty.into());
        }
        let centre = |v: u32| mesh.spheres[v as usize].centre;
        let mut with_face = vec![false; mesh.edges.len()];
        for &[a, b, c] in &mesh.faces {
            for side in [[a, b], [a, c], [b, c]] {
                if let Ok(edge) = mesh.edges.binary_search(&side) {
                    with_face[edge] = true;
                }
            }
        }
        let lone = mesh.edges.iter().zip(with_face).filter(|&(_, with)| !with);
        Ok(Self {
            triangles: mesh.faces.iter().map(|f| f.map(centre)).collect(),
            segments: lone.map(|(e, _)| e.map(centre)).collect(),
            centres: mesh.spheres.iter().map(|m| m.centre).collect(),
        })
    }

    /// A tree over all parts: segments and points as triangles of no area.
    fn tree(&self) -> Result<TriangleBvh, BvhError> {
        let mut parts = self.triangles.clone();
        parts.extend(self.segments.iter().map(|&[a, b]| [a, b, b]));
        parts.extend(self.centres.iter().map(|&c| [c; 3]));
        TriangleBvh::from_triangles(&parts)
    }
}

struct Directed {
    max: f64,
    mean: f64,
}

fn directed(
    from: &AxisParts,
    to: &AxisParts,
    options: &AxisOptions,
) -> Result<Directed, MetricError> {
    let sheets = sample_triangles(&from.triangles, options.samples, options.seed);
    let curves = sample_segments(&from.segments, options.samples);
    let tree = to.tree().map_err(MetricError::Tree)?;
    let sets = [sheets.unwrap_or_default(), curves, from.centres.clone()];
    let distances = sets.map(|points| tree.distance_batch(&points));
    let max = distances.iter().flatten().copied().fold(0.0, f64::max);
    let highest = distances.iter().find(|set| !set.is_empty());
    let mean = highest.map_or(0.0, |set| set.iter().sum::<f64>() / set.len() as f64);
    Ok(Directed { max, mean })
}

/// `count` points, equally spaced along the list of segments; none when they have no length.
fn sample_segments(segments: &[[Vec3; 2]], count: usize) -> Vec<Vec3> {
    let total: f64 = segments.iter().map(|[a, b]| a.distance(*b)).sum();
    let mut points = Vec::new();
    if !(total > 0.0 && total.is_finite()) {
        return points;
    }
    let spacing = total / count as f64;
    let mut below = 0.0;
    for &[a, b] in segments {
        let length = a.distance(b);
        while let at = (points.len() as f64 + 0.5) * spacing
            && at < below + length
        {
            points.push(a.lerp(b, ((at - below) / length).clamp(0.0, 1.0)));
        }
        below += length;
    }
    points
}
