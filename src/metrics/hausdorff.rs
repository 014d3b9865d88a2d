//! Distances between a surface and the union of medial primitives, both ways.
//!
//! 1. The surface S is sampled uniformly by area, and its vertices are added, because the largest
//!    error is usually at one. Every medial mesh gets the same samples ([`super::samples`]).
//! 2. Each sample is measured against the union U: its distance to the boundary of U, which is the signed
//!    distance to the nearest primitive outside U and bounded from both sides inside ([`super::depth`]), `mu` of
//!    [`MedialUnion`], and `|sigma|` of the spheres alone.
//! 3. The boundary of U is sampled uniformly by area ([`super::envelope`]) and measured against S.
//! 4. From the largest samples of each distance, local ascent looks for the maximum
//!    ([`super::ascent`]).
//! 5. Both surfaces are swept for places where the distance to the other one exceeds the larger maximum
//!    ([`super::sweep`]).
//!
//! Means, root mean squares and percentiles are over the area-uniform samples; maxima are over all
//! samples and the points that the ascent and the sweep reached.
//!
//! # Biases
//! - A reported maximum is the distance at an actual point, so a lower bound of the true one. Since
//!   distances are 1-Lipschitz, it falls short by at most the largest distance from a point of the
//!   surface to the nearest sample, and only if neither an ascent nor the sweep reached the true place. Only
//!   [`certify`](super::certify) proves a maximum.
//! - Means and percentiles take upper bounds where S is inside U and the nearest exit is buried: the nearest
//!   sample of the boundary, farther than its nearest point by at most the samples' spacing. Maxima are searched
//!   until they are lower bounds.
//! - A point that another primitive covers by less than the burial depth counts as on U's boundary,
//!   with a weight that falls to 0 at this depth. So strips along the curves where neighbouring
//!   primitives touch count more than once in `reverse_mean`.

use super::ascent::{OnMesh, OnUnion, Peak, SEEDS, Start, ascend};
use super::depth::Boundary;
use super::envelope::{EnvelopeOptions, sample_envelope_in};
use super::error::MetricError;
use super::evaluation::Distances;
use super::pieces::{BURIAL, Patches};
use super::samples::SurfaceSamples;
use super::sweep::{FINAL_SHARE, swept};
use crate::Vec3;
use crate::complex::{MedialMesh, MedialUnion};
use crate::surface::{TriMesh, TriangleBvh};

/// Least number of samples of a boundary that distances to it are taken from.
const LEAST_ENVELOPE: usize = 50_000;

/// Samples of the boundary of a union, with their distances from the surface.
pub(super) struct Envelope {
    pub points: Vec<Vec3>,
    pub distances: Vec<f64>,
}

/// Distances between a surface, whose faces are in `bvh`, and the union of the primitives of `mesh`, in the unit of both,
/// with the samples of the reverse distance, about `count` of them. The spheres of the mesh are in the order of the
/// samples' pose. The result is the same for any number of threads.
pub(super) fn distances_with_envelope(
    (surface, bvh): (&TriMesh, &TriangleBvh),
    (mesh, union): (&MedialMesh, &MedialUnion),
    samples: &SurfaceSamples,
    (count, seed): (usize, u64),
) -> Result<(Distances, Envelope), MetricError> {
    let pose = &samples.pose;
    let patches = Patches::new(mesh, pose.axes(), pose.diameter());
    let mut boundary = Boundary::new(union, patches);
    let (depths, mu): (Vec<_>, Vec<_>) = boundary.readings(&samples.points).into_iter().unzip();
    let envelope = EnvelopeOptions { samples: count, burial: BURIAL * pose.diameter(), seed };
    let sampled = sample_envelope_in(pose, mesh, union, &envelope)?;
    // Of few samples the nearest one is far from a buried point, whatever the distance to the boundary is.
    let is_sparse = count < LEAST_ENVELOPE && !depths.iter().all(|depth| boundary.is_exact(depth));
    let dense = EnvelopeOptions { samples: LEAST_ENVELOPE, ..envelope };
    let dense = is_sparse.then(|| sample_envelope_in(pose, mesh, union, &dense)).transpose()?;
    let nearest = dense.as_ref().unwrap_or(&sampled);
    let depths = boundary.values(&samples.points, &depths, &nearest.points);
    let balls = MedialUnion::of_spheres(&mesh.spheres)?;
    let spheres = absolute(balls.signed_batch(&samples.points));
    let start = Start::new(samples, &depths);
    let depth_at = |p, near: &mut usize| boundary.estimate(p, near);
    let mut forward = ascend(&OnMesh { mesh: bvh, value: depth_at }, &start);
    let by_mu = Start { values: &mu, ..start };
    let epsilon = highest(bvh, &by_mu, |p, near| union.unsigned_from(p, near));
    // Fewer seeds: this figure is additional, and results are not compared by it.
    let aside = Start { values: &spheres, seeds: SEEDS / 3, ..start };
    let spheres_only = highest(bvh, &aside, |p, near| balls.signed_from(p, near).abs());
    let on_boundary = bvh.distance_batch(&sampled.points);
    let reverse_mean = sampled.mean(&on_boundary);
    let reverse_samples = sampled.points.len();
    let mut envelope = Envelope { points: sampled.points.clone(), distances: on_boundary };
    let hill = OnUnion::new(union, bvh, pose.diameter());
    let (points, values) = (envelope.points.as_slice(), envelope.distances.as_slice());
    let peaks = ascend(&hill, &Start { points, values, ..start });
    envelope.extend(peaks);
    let reverse = largest(&envelope.distances);
    let on_mesh = OnMesh { mesh: bvh, value: depth_at };
    forward.extend(start.peaks());
    let sampled_depth = largest(&depths);
    // After too many pieces of a boundary with hairline gaps, the samples' depths are better known than bounds of them.
    let deepest = |peaks| match boundary.deepest_of(peaks) {
        (Some(peak), true) => peak.distance,
        (peak, is_found) => {
            let least = if is_found { 0.0 } else { sampled_depth };
            peak.map_or(least, |peak| peak.distance.max(least))
        }
    };
    // The distance to the boundary is at least `mu` at every point, so the maximum found for `mu` bounds it, too.
    let epsilon_union = deepest(forward).max(epsilon);
    let known = epsilon_union.max(reverse);
    let [forward, backward] =
        swept((surface, bvh), &boundary, (&on_mesh, &hill), &start, (known, FINAL_SHARE));
    let epsilon_union = epsilon_union.max(deepest(forward));
    // A distance that is not a number must not pass for a small error.
    let epsilon_union = if depths.iter().any(|d| d.is_nan()) { f64::NAN } else { epsilon_union };
    envelope.extend(backward);
    let reverse = largest(&envelope.distances);
    let uniform = Summary::new(&depths[..samples.uniform]);
    let distances = Distances {
        epsilon,
        epsilon_union,
        reverse,
        hausdorff: epsilon_union.max(reverse),
        mean: uniform.mean,
        rms: uniform.rms,
        p95: uniform.p95,
        p99: uniform.p99,
        reverse_mean,
        spheres_only,
        samples: samples.points.len(),
        reverse_samples,
    };
    Ok((distances, envelope))
}

impl Envelope {
    /// Adds points that count for the maximum but not for the mean.
    fn extend(&mut self, peaks: Vec<Peak>) {
        self.points.extend(peaks.iter().map(|peak| peak.point));
        self.distances.extend(peaks.iter().map(|peak| peak.distance));
    }
}

/// The largest of the values at some samples of a surface and uphill from them.
pub(super) fn highest(
    mesh: &TriangleBvh,
    start: &Start<'_>,
    value: impl Fn(Vec3, &mut usize) -> f64 + Sync,
) -> f64 {
    let peaks = ascend(&OnMesh { mesh, value }, start);
    let peaks: Vec<f64> = peaks.iter().map(|peak| peak.distance).collect();
    largest(&[largest(start.values), largest(&peaks)])
}

fn absolute(mut values: Vec<f64>) -> Vec<f64> {
    for value in &mut values {
        *value = value.abs();
    }
    values
}

/// Largest of some distances; not a number if one is not, which must not pass for a small error.
fn largest(values: &[f64]) -> f64 {
    // `f64::max` would drop a NaN.
    values.iter().fold(0.0, |a, &b| if a.is_nan() || b <= a { a } else { b })
}

/// Mean, root mean square and percentiles of some values.
pub(super) struct Summary {
    pub mean: f64,
    pub rms: f64,
    pub p95: f64,
    pub p99: f64,
}

impl Summary {
    /// Percentiles are nearest ranks: the smallest value that at least this share of all values does
    /// not exceed.
    pub fn new(values: &[f64]) -> Self {
        let count = values.len().max(1) as f64;
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let [p95, p99] = [0.95, 0.99].map(|share: f64| {
            let rank = ((share * count).ceil() as usize).clamp(1, values.len().max(1));
            sorted.get(rank - 1).copied().unwrap_or(0.0)
        });
        Self {
            mean: values.iter().sum::<f64>() / count,
            rms: (values.iter().map(|v| v * v).sum::<f64>() / count).sqrt(),
            p95,
            p99,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distance_that_is_no_number_is_not_lost_in_the_largest() {
        assert_eq!(largest(&[]), 0.0);
        assert_eq!(largest(&[0.5, 2.0, 1.0]), 2.0);
        for values in [[f64::NAN, 1.0, 2.0], [1.0, f64::NAN, 2.0], [1.0, 2.0, f64::NAN]] {
            assert!(largest(&values).is_nan());
        }
    }
}
