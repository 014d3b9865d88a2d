//! Distances between two triangle meshes, both ways: the measure of directly simplified surfaces,
//! with the samples and definitions of [`super::distances`].
//!
//! 1. The reference S is sampled as there: the same points for the same seed, its vertices added.
//! 2. Each sample is measured against the other surface T.
//! 3. T is sampled uniformly by area, its vertices are added, and both are measured against S. A
//!    decimated surface is often farthest at one of its vertices; the boundary of a union has none.
//! 4. Local ascent from the largest samples looks for the maxima, as there.
//!
//! Distances between surfaces are exact, so only the maxima are bounds: they may fall short of the
//! true ones.

use serde::{Deserialize, Serialize};

use super::hausdorff::{DistanceOptions, MetricError, highest};
use super::samples::SurfaceSamples;
use crate::Vec3;
use crate::surface::TriMesh;
use crate::surface::TriangleBvh;

/// Distances between a reference surface S and another surface T, in the unit of both.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceDistances {
    /// Largest distance from S to T, at a sample or uphill from one.
    pub forward: f64,
    /// Largest distance from T to S, likewise.
    pub reverse: f64,
    /// The larger of the two.
    pub hausdorff: f64,
    /// Mean distance from S to T, by area.
    pub mean: f64,
    /// Root mean square of the same.
    pub rms: f64,
    /// Mean distance from T to S, by area.
    pub reverse_mean: f64,
    /// Number of samples of S, its vertices included.
    pub samples: usize,
    /// The same of T.
    pub reverse_samples: usize,
}

/// Distances between `surface`, whose faces are in `tree`, and `other`.
///
/// [`DistanceOptions::envelope_samples`] are those on `other`, which need not be closed. The result
/// is the same for any number of threads.
///
/// ```
/// use medial::Vec3;
/// use medial::surface::TriangleBvh;
/// use medial::metrics::{DistanceOptions, surface_distances};
/// use medial::surface::TriMesh;
///
/// let triangle = |height: f64| TriMesh {
///     vertices: [Vec3::ZERO, Vec3::X, Vec3::Y].map(|v| v + height * Vec3::Z).to_vec(),
///     faces: vec![[0, 1, 2]],
/// };
/// let (low, high) = (triangle(0.0), triangle(0.5));
/// let tree = TriangleBvh::new(&low)?;
/// let apart = surface_distances(&low, &tree, &high, &DistanceOptions::default())?;
/// assert_eq!((apart.hausdorff, apart.mean), (0.5, 0.5));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When one of the surfaces has no area, or no samples are asked.
///
/// # Panics
/// If a face names a vertex that does not exist.
pub fn surface_distances(
    surface: &TriMesh,
    tree: &TriangleBvh,
    other: &TriMesh,
    options: &DistanceOptions,
) -> Result<SurfaceDistances, MetricError> {
    let samples = SurfaceSamples::new(surface, options.surface_samples, options.seed)?;
    surface_distances_from(&samples, tree, other, options)
}

/// As [`surface_distances`], from samples of the surface that were made before.
pub(super) fn surface_distances_from(
    on_surface: &SurfaceSamples,
    tree: &TriangleBvh,
    other: &TriMesh,
    options: &DistanceOptions,
) -> Result<SurfaceDistances, MetricError> {
    let on_other = SurfaceSamples::new(other, options.envelope_samples, options.seed)?;
    let other_tree = TriangleBvh::new(other).map_err(MetricError::Tree)?;
    let there = other_tree.distance_batch(&on_surface.points);
    let back = tree.distance_batch(&on_other.points);
    let from_surface = |p, near: &mut usize| distance_from(&other_tree, p, near);
    let forward = highest(tree, &on_surface.start(&there), from_surface);
    let from_other = |p, near: &mut usize| distance_from(tree, p, near);
    let reverse = highest(&other_tree, &on_other.start(&back), from_other);
    let mean = |values: &[f64], power: i32| {
        values.iter().map(|v| v.powi(power)).sum::<f64>() / values.len().max(1) as f64
    };
    let uniform = &there[..on_surface.uniform];
    Ok(SurfaceDistances {
        forward,
        reverse,
        hausdorff: forward.max(reverse),
        mean: mean(uniform, 1),
        rms: mean(uniform, 2).sqrt(),
        reverse_mean: mean(&back[..on_other.uniform], 1),
        samples: there.len(),
        reverse_samples: back.len(),
    })
}

/// The distance of a point from a mesh, searched from the face that was found last.
fn distance_from(tree: &TriangleBvh, p: Vec3, near: &mut usize) -> f64 {
    let closest = tree.closest_from(p, Some(*near as u32));
    *near = closest.face as usize;
    closest.distance
}
