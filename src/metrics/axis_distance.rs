//! Distances between two medial axes as sets of points in space.
//!
//! Each axis is sampled and measured against the triangles, lone edges and isolated points of the
//! other.
//!
//! - Maxima are over samples of all triangles and lone edges, and all spheres.
//! - The chamfer distance is half the sum of the mean squared distances both ways, over points at [`SPACING`] on all parts
//!   together (Clemot, Digne 2023, *Neural skeleton*).
//! - Means are over the parts of the highest dimension that the sampled axis has: by area if it has
//!   triangles, else by length, else over its points. A curve has no area, so it has no weight next to
//!   a sheet.

use super::error::MetricError;
use super::evaluation::AxisDistances;
use super::samples::place_on_triangles;
use crate::Vec3;
use crate::complex::{MedialMesh, UnionError};
use crate::surface::TriangleBvh;

/// Distance of the points of the chamfer distance, in diagonals.
const SPACING: f64 = 1e-3;

/// Limit of these points on the sheets, and on the curves.
const MOST_SPACED: usize = 1 << 20;

/// An axis, prepared to be sampled and to be measured against.
pub(super) struct PreparedAxis {
    pub triangles: Vec<[Vec3; 3]>,
    /// Edges without a face.
    segments: Vec<[Vec3; 2]>,
    centres: Vec<Vec3>,
    /// Of all parts: the triangles, then segments, then isolated spheres.
    pub tree: TriangleBvh,
}

impl PreparedAxis {
    /// # Errors
    /// When the mesh is empty or not valid.
    pub fn new(mesh: &MedialMesh) -> Result<Self, MetricError> {
        mesh.check().map_err(UnionError::from)?;
        if mesh.spheres.is_empty() {
            return Err(UnionError::Empty.into());
        }
        let centres: Vec<Vec3> = mesh.spheres.iter().map(|s| s.centre).collect();
        let triangles: Vec<_> =
            mesh.faces.iter().map(|face| face.map(|v| centres[v as usize])).collect();
        let segments: Vec<_> =
            mesh.lone_edges().into_iter().map(|edge| edge.map(|v| centres[v as usize])).collect();
        let mut parts = triangles.clone();
        parts.extend(segments.iter().map(|&[a, b]| [a, b, b]));
        parts.extend(mesh.isolated().into_iter().map(|v| [centres[v as usize]; 3]));
        let tree = TriangleBvh::from_triangles(&parts).map_err(MetricError::Tree)?;
        Ok(Self { triangles, segments, centres, tree })
    }

    /// Distances from this axis, which was computed, to the true one and back, in their unit. There are `samples` on the
    /// triangles of each axis, and as many on its lone edges.
    ///
    /// # Errors
    /// When no samples are requested.
    pub fn distances(
        &self,
        truth: &Self,
        samples: usize,
        seed: u64,
    ) -> Result<AxisDistances, MetricError> {
        if samples == 0 {
            return Err(MetricError::NoSamples("samples"));
        }
        let [there, back] = [(self, truth), (truth, self)]
            .map(|(from, to)| from.max_and_mean(&to.tree, samples, seed));
        Ok(AxisDistances {
            computed_to_true_max: there[0],
            computed_to_true_mean: there[1],
            true_to_computed_max: back[0],
            true_to_computed_mean: back[1],
            chamfer: None,
        })
    }

    /// The chamfer distance between this axis and another, in squared units.
    pub fn chamfer(&self, other: &Self, seed: u64) -> f64 {
        let mean_square = |from: &Self, to: &Self| {
            let distances = to.tree.distance_batch(&from.spaced(seed));
            distances.iter().map(|distance| distance * distance).sum::<f64>()
                / distances.len() as f64
        };
        0.5 * (mean_square(self, other) + mean_square(other, self))
    }

    /// Points on all parts, one on average for each square of side [`SPACING`] and each length of it, and all centres.
    fn spaced(&self, seed: u64) -> Vec<Vec3> {
        let area = |&[a, b, c]: &[Vec3; 3]| 0.5 * (b - a).cross(c - a).length();
        let area: f64 = self.triangles.iter().map(area).sum();
        let length: f64 = self.segments.iter().map(|[a, b]| a.distance(*b)).sum();
        let count = |size: f64| (size.ceil() as usize).clamp(1, MOST_SPACED);
        let placed = place_on_triangles(&self.triangles, count(area / (SPACING * SPACING)), seed);
        let sheets = placed.unwrap_or_default().into_iter().map(|(_, point)| point);
        let curves = sample_segments(&self.segments, count(length / SPACING));
        sheets.chain(curves).chain(self.centres.iter().copied()).collect()
    }

    fn max_and_mean(&self, to: &TriangleBvh, samples: usize, seed: u64) -> [f64; 2] {
        let placed = place_on_triangles(&self.triangles, samples, seed).unwrap_or_default();
        let sheets: Vec<Vec3> = placed.into_iter().map(|(_, point)| point).collect();
        let curves = sample_segments(&self.segments, samples);
        let sets = [&sheets, &curves, &self.centres].map(|points| to.distance_batch(points));
        let max = sets.iter().flatten().copied().fold(0.0, f64::max);
        let highest = sets.iter().find(|set| !set.is_empty());
        let mean = highest.map_or(0.0, |set| set.iter().sum::<f64>() / set.len() as f64);
        [max, mean]
    }
}

/// `count` points, equally spaced along the list of segments; none when they have no length.
pub(super) fn sample_segments(segments: &[[Vec3; 2]], count: usize) -> Vec<Vec3> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complex::Sphere;
    use crate::metrics::spikes::tests::box_axis;

    fn compare(computed: &MedialMesh, truth: &MedialMesh) -> Result<AxisDistances, MetricError> {
        PreparedAxis::new(computed)?.distances(&PreparedAxis::new(truth)?, 5_000, 0)
    }

    #[test]
    fn axes_are_compared_as_point_sets() {
        let axis = box_axis();
        let same = compare(&axis, &axis).unwrap();
        assert!(same.computed_to_true_max < 1e-14 && same.true_to_computed_mean < 1e-15);

        let shifted = axis.transformed(1.0, |p| p + 0.01 * Vec3::Z);
        let off = compare(&shifted, &axis).unwrap();
        assert!((off.computed_to_true_max - 0.01).abs() < 1e-6, "{off:?}");

        // Each point is as far as the shift across the sheets, and less along them.
        let [a, b] = [&axis, &shifted].map(|mesh| PreparedAxis::new(mesh).unwrap());
        let chamfer = a.chamfer(&b, 0);
        assert!(chamfer > 0.0 && chamfer < 1e-4 && a.chamfer(&a, 0) < 1e-28, "{chamfer}");

        // A segment against a longer one: everything of the short one is near, but not conversely.
        let segment = |length: f64, y: f64| {
            let ends = [0.0, length].map(|x| Sphere::new(Vec3::new(x, y, 0.0), 0.1));
            MedialMesh::from_simplices(ends.to_vec(), vec![[0, 1]], vec![]).unwrap()
        };
        let (short, long) = (segment(1.0, 0.5), segment(2.0, 0.0));
        let d = compare(&short, &long).unwrap();
        assert!((d.computed_to_true_max - 0.5).abs() < 1e-15);
        assert!((d.computed_to_true_mean - 0.5).abs() < 1e-15);
        assert!((d.true_to_computed_max - 1.25_f64.sqrt()).abs() < 1e-15);
        // Mean over [1, 2] of the hypotenuse over (x - 1, 0.5), by its antiderivative.
        let tail = 0.5 * 1.25_f64.sqrt() + 0.125 * 2.0_f64.asinh();
        assert!((d.true_to_computed_mean - (0.5 + tail) / 2.0).abs() < 1e-6);

        // 0.25 along the short one; the integral of 0.25 + max(x - 1, 0)² over the long one is 0.5 + 1/3.
        let [a, b] = [&short, &long].map(|mesh| PreparedAxis::new(mesh).unwrap());
        let exact = 0.5 * (0.25 + (0.5 + 1.0 / 3.0) / 2.0);
        assert!((a.chamfer(&b, 0) - exact).abs() < 1e-3, "{}", a.chamfer(&b, 0));

        let point = vec![Sphere::new(Vec3::Y, 0.1)];
        let d = compare(&MedialMesh::from_simplices(point, vec![], vec![]).unwrap(), &long);
        let d = d.unwrap();
        assert_eq!((d.computed_to_true_max, d.computed_to_true_mean), (1.0, 1.0));
        assert!((d.true_to_computed_max - 5.0_f64.sqrt()).abs() < 1e-15);
        assert!(compare(&MedialMesh::default(), &axis).is_err());
    }
}
