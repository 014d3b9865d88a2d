//! Places where a union is farthest from a surface, both ways: for methods that mend their worst places.

use super::ascent::{OnMesh, OnUnion, Peak, SEEDS, Start, ascend};
use super::depth::Boundary;
use super::envelope::{EnvelopeOptions, sample_envelope_in};
use super::error::MetricError;
use super::pieces::{BURIAL, Patches};
use super::samples::SurfaceSamples;
use super::sweep::swept;
use crate::Vec3;
use crate::complex::MedialMesh;
use crate::geometry::trees::in_morton_order;
use crate::surface::{TriMesh, TriangleBvh};

/// Excess over the largest known distance, as a share of it, that the sweep of a search leaves out.
const SHARE: f64 = 0.02;

/// The worst places of a medial mesh, the largest distance first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Peaks {
    /// On the surface.
    pub forward: Vec<Peak>,
    /// On the boundary of the union.
    pub reverse: Vec<Peak>,
}

impl Peaks {
    /// The largest distance of both directions: a lower bound of the Hausdorff distance.
    pub fn hausdorff(&self) -> f64 {
        // The largest is the first in each list.
        let firsts = [&self.forward, &self.reverse].into_iter().filter_map(|peaks| peaks.first());
        firsts.fold(0.0, |largest, peak| largest.max(peak.distance))
    }
}

/// How densely to sample both surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DistanceOptions {
    /// Area-uniform samples on the surface; its vertices come on top.
    pub surface_samples: usize,
    /// Approximate number of samples on the boundary of the union.
    pub envelope_samples: usize,
    /// Seed of both.
    pub seed: u64,
}

/// A surface whose samples are laid out once, to be searched with many medial meshes.
pub struct PeakSearch<'a> {
    surface: &'a TriMesh,
    tree: &'a TriangleBvh,
    samples: SurfaceSamples,
    options: DistanceOptions,
}

impl<'a> PeakSearch<'a> {
    /// A search over `surface`, whose faces are in `tree`.
    ///
    /// # Errors
    /// When the surface has no area, or no samples are requested.
    pub fn new(
        surface: &'a TriMesh,
        tree: &'a TriangleBvh,
        options: DistanceOptions,
    ) -> Result<Self, MetricError> {
        let samples = SurfaceSamples::new(surface, options.surface_samples, options.seed)?;
        Ok(Self { surface, tree, samples, options })
    }

    /// The samples with the largest distances, and the points that local ascent reaches from them. If none of them is
    /// at least `swept_below` away, both surfaces are swept for larger distances.
    ///
    /// The distances are those of [`Judge::distances`](super::Judge::distances), whose maximum also counts an ascent of `mu` and
    /// can be a little larger.
    ///
    /// # Errors
    /// When the medial mesh is empty or not valid, or no samples are requested.
    pub fn of(&self, mesh: &MedialMesh, swept_below: f64) -> Result<Peaks, MetricError> {
        let Self { surface, tree, samples, options } = self;
        let (mesh, union) = samples.ordered(mesh)?;
        let pose = &samples.pose;
        let mut boundary = Boundary::new(&union, Patches::new(&mesh, pose.axes(), pose.diameter()));
        let envelope = EnvelopeOptions {
            samples: options.envelope_samples,
            burial: BURIAL * pose.diameter(),
            seed: options.seed,
        };
        let points = sample_envelope_in(pose, &mesh, &union, &envelope)?.points;
        let depths = in_morton_order(&samples.points, |near, p| boundary.of(p, near));
        let depths = boundary.values(&samples.points, &depths, &points);
        // Fewer seeds than for a final figure: searches are many, and the sweep adds to them.
        let start = Start { seeds: SEEDS / 3, ..Start::new(samples, &depths) };
        let on_mesh =
            OnMesh { mesh: tree, value: |p, near: &mut usize| boundary.estimate(p, near) };
        let forward = ascend(&on_mesh, &start);
        let values = tree.distance_batch(&points);
        let hill = OnUnion::new(&union, tree, pose.diameter());
        let reverse = ascend(&hill, &Start { points: &points, values: &values, ..start });
        let mut peaks = Peaks {
            forward: boundary.proven(sorted(forward, &samples.points, &depths)),
            reverse: sorted(reverse, &points, &values),
        };
        let known = peaks.hausdorff();
        if known < swept_below {
            let [forward, reverse] =
                swept((surface, tree), &boundary, (&on_mesh, &hill), &start, (known, SHARE));
            peaks.forward = sorted(forward, &[], &[]).into_iter().chain(peaks.forward).collect();
            peaks.reverse = sorted(reverse, &[], &[]).into_iter().chain(peaks.reverse).collect();
        }
        Ok(peaks)
    }
}

/// Peaks and samples above half the largest, the largest first.
fn sorted(peaks: Vec<Peak>, points: &[Vec3], values: &[f64]) -> Vec<Peak> {
    let mut all = peaks;
    all.extend(points.iter().zip(values).map(|(&point, &distance)| Peak { point, distance }));
    let largest = all.iter().map(|peak| peak.distance).fold(0.0, f64::max);
    all.retain(|peak| peak.distance >= 0.5 * largest);
    // Stable: peaks come before samples of the same distance.
    all.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complex::Sphere;
    use crate::metrics::{Judge, JudgeOptions, Truth};
    use crate::surface::InsideTest;
    use crate::surface::fixtures::cuboid;

    #[test]
    fn the_largest_peak_is_the_hausdorff_distance_and_lies_where_it_says() {
        let surface = cuboid(Vec3::ZERO, Vec3::ONE);
        let tree = TriangleBvh::new(&surface).unwrap();
        let ball = Sphere::new(Vec3::new(0.5, 0.5, 0.4), 0.5);
        let mesh = MedialMesh::from_simplices(vec![ball], vec![], vec![]).unwrap();
        let options = DistanceOptions { surface_samples: 500, envelope_samples: 500, seed: 3 };
        let search = PeakSearch::new(&surface, &tree, options).unwrap();
        let peaks = search.of(&mesh, 0.0).unwrap();
        let swept = search.of(&mesh, f64::INFINITY).unwrap();
        assert!(swept.hausdorff() >= peaks.hausdorff());
        // The corners above are farthest, and the ball protrudes by a tenth below.
        let corner = Vec3::new(0.5, 0.5, 0.6).length() - 0.5;
        assert!((peaks.forward[0].distance - corner).abs() < 1e-12, "{:?}", peaks.forward[0]);
        assert_eq!(peaks.forward[0].point.z, 1.0);
        let options = JudgeOptions { samples: 500, volume_depth: 0, seed: 3 };
        let inside = InsideTest::new(&surface).into();
        let judge =
            Judge::new(surface.clone(), tree.clone().into(), inside, Truth::default(), options);
        let measured = judge.distances(&mesh).unwrap();
        assert!((peaks.hausdorff() - measured.hausdorff).abs() < 1e-9);
        assert_eq!(peaks.reverse[0].distance, measured.reverse);
        let descends = |peaks: &[Peak]| peaks.is_sorted_by(|a, b| a.distance >= b.distance);
        for found in [&peaks, &swept] {
            assert!(descends(&found.forward) && descends(&found.reverse));
        }
        for peak in &peaks.reverse {
            assert!(ball.signed_distance(peak.point).abs() < 1e-9);
        }
    }
}
