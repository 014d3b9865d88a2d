//! Where a union is farthest from a surface, both ways: for methods that mend their worst places.

use super::ascent::{OnMesh, OnUnion, ascend};
use super::envelope::{EnvelopeOptions, sample_envelope_along};
use super::hausdorff::{BURIAL, EXPOSED};
use super::samples::SurfaceSamples;
use super::{DistanceOptions, MetricError};
use crate::Vec3;
use crate::complex::MedialMesh;
use crate::surface::{TriMesh, TriangleBvh};

/// A place and its distance from the other surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// A point of the surface, or of the union's boundary.
    pub point: Vec3,
    /// How far it is from the other one: `|sigma|` of a point of the surface, the distance from the
    /// surface of a point of the union's boundary.
    pub distance: f64,
}

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
        let first = |peaks: &[Peak]| peaks.first().map_or(0.0, |peak| peak.distance);
        first(&self.forward).max(first(&self.reverse))
    }
}

/// A surface whose samples are laid out once, to be searched with many medial meshes.
pub struct PeakSearch<'a> {
    tree: &'a TriangleBvh,
    samples: SurfaceSamples,
    options: DistanceOptions,
}

impl<'a> PeakSearch<'a> {
    /// A search over `surface`, whose faces are in `tree`.
    ///
    /// # Errors
    /// When the surface has no area, or no samples are asked.
    pub fn new(
        surface: &TriMesh,
        tree: &'a TriangleBvh,
        options: DistanceOptions,
    ) -> Result<Self, MetricError> {
        let samples = SurfaceSamples::new(surface, options.surface_samples, options.seed)?;
        Ok(Self { tree, samples, options })
    }

    /// The samples with the largest distances, and the points that local ascent reaches from them.
    ///
    /// The distances are those of [`super::distances`], whose maximum also counts an ascent of `mu` and
    /// can be a little larger.
    ///
    /// # Errors
    /// When the medial mesh is empty or not valid, or no samples are asked.
    pub fn of(&self, mesh: &MedialMesh) -> Result<Peaks, MetricError> {
        let Self { tree, samples, options } = self;
        let (mesh, union) = samples.ordered(mesh)?;
        let pose = &samples.pose;
        let mut sigma = union.signed_batch(&samples.points);
        sigma.iter_mut().for_each(|value| *value = value.abs());
        let value = |p, near: &mut usize| union.signed_from(p, near).abs();
        let forward = ascend(&OnMesh { mesh: tree, value }, &samples.start(&sigma));
        let envelope = EnvelopeOptions {
            samples: options.envelope_samples,
            burial: BURIAL * pose.diameter(),
            seed: options.seed,
        };
        let points = sample_envelope_along(pose.axes(), &mesh, &union, &envelope)?;
        let values = tree.distance_batch(&points);
        let hill = OnUnion { union: &union, surface: tree, burial: EXPOSED * pose.diameter() };
        let start = samples.start(&sigma);
        let reverse =
            ascend(&hill, &super::ascent::Start { points: &points, values: &values, ..start });
        Ok(Peaks {
            forward: sorted(forward, &samples.points, &sigma),
            reverse: sorted(reverse, &points, &values),
        })
    }
}

/// Peaks and samples above half the largest, the largest first.
fn sorted(peaks: Vec<super::ascent::Peak>, points: &[Vec3], values: &[f64]) -> Vec<Peak> {
    let peaks = peaks.into_iter().map(|peak| Peak { point: peak.point, distance: peak.value });
    let samples = points.iter().zip(values);
    let samples = samples.map(|(&point, &distance)| Peak { point, distance });
    let mut all: Vec<Peak> = peaks.chain(samples).collect();
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
    use crate::metrics::distances;

    #[test]
    fn the_largest_peak_is_the_hausdorff_distance_and_lies_where_it_says() {
        let corners =
            [0.0, 1.0].map(|x| [0.0, 1.0].map(|y| [0.0, 1.0].map(|z| Vec3::new(x, y, z))));
        let vertices: Vec<Vec3> = corners.as_flattened().as_flattened().to_vec();
        let square = |a, b, c, d| [[a, b, c], [a, c, d]];
        let sides = [
            square(0, 1, 3, 2),
            square(4, 6, 7, 5),
            square(0, 4, 5, 1),
            square(2, 3, 7, 6),
            square(0, 2, 6, 4),
            square(1, 5, 7, 3),
        ];
        let surface = TriMesh { vertices, faces: sides.as_flattened().to_vec() };
        let tree = TriangleBvh::new(&surface).unwrap();
        let ball = Sphere::new(Vec3::new(0.5, 0.5, 0.4), 0.5);
        let mesh = MedialMesh::from_simplices(vec![ball], vec![], vec![]).unwrap();
        let options = DistanceOptions { surface_samples: 500, envelope_samples: 500, seed: 3 };
        let peaks = PeakSearch::new(&surface, &tree, options).unwrap().of(&mesh).unwrap();
        // The corners above are farthest, and the ball protrudes by a tenth below.
        let corner = Vec3::new(0.5, 0.5, 0.6).length() - 0.5;
        assert!((peaks.forward[0].distance - corner).abs() < 1e-12, "{:?}", peaks.forward[0]);
        assert_eq!(peaks.forward[0].point.z, 1.0);
        let measured = distances(&surface, &tree, &mesh, &options).unwrap();
        assert!((peaks.hausdorff() - measured.hausdorff).abs() < 1e-9);
        assert_eq!(peaks.reverse[0].distance, measured.reverse);
        let descends = |peaks: &[Peak]| peaks.is_sorted_by(|a, b| a.distance >= b.distance);
        assert!(descends(&peaks.forward) && descends(&peaks.reverse));
        for peak in &peaks.reverse {
            assert!(ball.signed_distance(peak.point).abs() < 1e-9);
        }
    }
}
