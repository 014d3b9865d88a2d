//! All metrics of a medial mesh against one surface.

use std::sync::Arc;

use super::axis_distance::PreparedAxis;
use super::bounds::ROUNDING;
use super::certificate::certify;
use super::cover::CoverTest;
use super::envelope::{EnvelopeOptions, sample_envelope_in};
use super::error::MetricError;
use super::evaluation::{
    AxisDistances, Certificate, Cover, Distances, Evaluation, MeanAndP95, SheetDifference,
};
use super::hausdorff::distances_with_envelope;
use super::quality::{counts, triangle_quality};
use super::samples::{Pose, SurfaceSamples};
use super::spikes::{centres_outside, protrusion, spikes};
use super::structure::{StructureSurface, sheet_difference};
use super::union_topology::topology_warning;
use super::volume::{Sides, Volumes, volumes};
use crate::complex::{MedialMesh, MedialUnion, betti, euler};
use crate::surface::{InsideTest, SignedDistance, TriMesh, TriangleBvh};

/// Mean error, as a fraction of the diagonal, above which radii that do not fit the surface cause a warning. A result with
/// a smaller error is right, for any radii.
const LARGE_MEAN: f64 = 0.005;

/// Width of the intervals of one-sided errors where none is requested, as a fraction of the diagonal.
const COVER_TOLERANCE: f64 = 1e-3;

/// Distance from the surface, as a fraction of the diagonal, below which the ratio of a radius to it means nothing.
const ON_SURFACE: f64 = 1e-6;

/// How results are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JudgeOptions {
    /// Area-uniform samples on the surface, besides its vertices, and about as many on the
    /// boundary of the union.
    pub samples: usize,
    /// Levels of subdivision of space for the volume difference; 0 skips it.
    pub volume_depth: u32,
    /// Seed of every sample.
    pub seed: u64,
}

impl Default for JudgeOptions {
    fn default() -> Self {
        Self { samples: 50_000, volume_depth: 7, seed: 0 }
    }
}

/// Known facts that every result should agree with, by any method.
#[derive(Clone, Debug, Default)]
pub struct Truth {
    /// Betti numbers that the medial axis must have by the solid's topology.
    pub betti: Option<[u64; 3]>,
    /// The exactly known medial axis, in the units of the surface.
    pub axis: Option<MedialMesh>,
    /// Bounding-box diagonal of the input, in its own units, for the record.
    pub diagonal: f64,
}

/// Measures medial meshes against one surface.
pub struct Judge {
    surface: TriMesh,
    tree: Arc<TriangleBvh>,
    inside: Arc<InsideTest>,
    truth: Truth,
    /// Samples of the surface, made once for all medial meshes.
    samples: Result<SurfaceSamples, MetricError>,
    /// The true axis. Prepared eagerly: prepared on demand inside a parallel task, a worker could
    /// wait for itself.
    true_axis: Option<Result<PreparedAxis, MetricError>>,
    structure: StructureSurface,
    options: JudgeOptions,
}

impl Judge {
    /// A judge for a closed, oriented surface of bounding-box diagonal 1, with the surface's tree
    /// and inside test.
    pub fn new(
        surface: TriMesh,
        tree: Arc<TriangleBvh>,
        inside: Arc<InsideTest>,
        truth: Truth,
        options: JudgeOptions,
    ) -> Self {
        let true_axis = truth.axis.as_ref().map(PreparedAxis::new);
        let samples = SurfaceSamples::new(&surface, options.samples, options.seed);
        let points = samples.as_ref().map_or(&[][..], |samples| &samples.points[..samples.uniform]);
        let (on_tree, on_inside) = (Arc::clone(&tree), Arc::clone(&inside));
        let structure = StructureSurface::new(&surface, on_tree, on_inside, points);
        Self { surface, tree, inside, truth, samples, true_axis, structure, options }
    }

    /// How results are measured.
    pub fn options(&self) -> JudgeOptions {
        self.options
    }

    /// Every metric of a medial mesh in normalised units: the same values for every numbering of its
    /// spheres.
    ///
    /// # Errors
    /// When the mesh has no sphere or is not valid.
    pub fn evaluate(&self, mesh: &MedialMesh) -> Result<Evaluation, MetricError> {
        // In the order of the pose, since random numbers and sums follow the order of the spheres.
        let samples = self.samples()?;
        let (mesh, union) = &samples.ordered(mesh)?;
        let JudgeOptions { samples: count, seed, .. } = self.options;
        let prepared = &PreparedAxis::new(mesh)?;
        // In parallel with each other, because each has serial parts.
        let ((distances, volumes), (axis, (quality, spikes, betti, structure))) = rayon::join(
            || {
                rayon::join(
                    || {
                        let surface = (&self.surface, &*self.tree);
                        distances_with_envelope(surface, (mesh, union), samples, (count, seed))
                    },
                    || self.volumes(mesh, union, &samples.pose),
                )
            },
            || {
                rayon::join(
                    || {
                        let truth = self.true_axis.as_ref()?;
                        let truth = truth.as_ref().map_err(Clone::clone);
                        Some(truth.and_then(|truth| prepared.distances(truth, count, seed)))
                    },
                    || {
                        let betti = betti(mesh);
                        let cavities = self.truth.betti.map_or(0, |betti| betti[2]);
                        let pockets = betti[2].saturating_sub(cavities);
                        let known = self.truth.axis.as_ref();
                        let structure = self.structure.measure(mesh, prepared, pockets, known);
                        (triangle_quality(mesh), spikes(mesh), betti, structure)
                    },
                )
            },
        );
        let ((distances, envelope), axis) = (distances?, axis.transpose()?);
        let mut warnings = self.misfits(mesh, union, &distances);
        // A list of spheres has no connectivity that could be wrong, and no structure.
        let is_connected = mesh.spheres.len() == 1 || !mesh.edges.is_empty();
        warnings.extend(topology_warning(betti, self.truth.betti).filter(|_| is_connected));
        let volumes = match volumes {
            // The surface was accepted as a solid, and all other measures are defined.
            Err(MetricError::NoVolume(volume)) => {
                warnings.push(format!(
                    "the surface's volume is lost to rounding ({volume:.1e} of the cube of its \
                     diagonal): the volume difference is not measured"
                ));
                None
            }
            other => other?,
        };
        Ok(Evaluation {
            warnings,
            distances,
            certified: None,
            cover: None,
            volume_error: volumes.map(|volumes| volumes.error),
            volume_ratio: volumes.map(|volumes| volumes.ratio),
            protrusion: Some(protrusion(&envelope, &self.inside)),
            centres_outside: Some(centres_outside(mesh, &self.inside)),
            quality,
            spikes,
            betti,
            euler: euler(mesh),
            expected_betti: self.truth.betti,
            counts: counts(mesh),
            axis,
            structure: Some(structure).filter(|_| is_connected),
            diagonal: self.truth.diagonal,
            seed: self.options.seed,
        })
    }

    /// The distances alone, in the unit of the surface.
    ///
    /// # Errors
    /// As [`Judge::evaluate`].
    pub fn distances(&self, mesh: &MedialMesh) -> Result<Distances, MetricError> {
        let samples = self.samples()?;
        let (mesh, union) = samples.ordered(mesh)?;
        let JudgeOptions { samples: count, seed, .. } = self.options;
        let surface = (&self.surface, &*self.tree);
        Ok(distances_with_envelope(surface, (&mesh, &union), samples, (count, seed))?.0)
    }

    /// Volume of the symmetric difference of solid and union, over the solid's volume; `None` if the options skip it.
    ///
    /// # Errors
    /// As [`Judge::evaluate`], and when the surface does not enclose a positive volume.
    pub fn volume_error(&self, mesh: &MedialMesh) -> Result<Option<f64>, MetricError> {
        let samples = self.samples()?;
        let (mesh, union) = samples.ordered(mesh)?;
        Ok(self.volumes(&mesh, &union, &samples.pose)?.map(|volumes| volumes.error))
    }

    fn samples(&self) -> Result<&SurfaceSamples, MetricError> {
        self.samples.as_ref().map_err(Clone::clone)
    }

    /// An interval no wider than `tolerance` that holds the Hausdorff distance of
    /// [`certify`], as fractions of the diagonal.
    ///
    /// # Errors
    /// As [`Judge::evaluate`], and when the tolerance is out of range or too fine.
    pub fn certify(&self, mesh: &MedialMesh, tolerance: f64) -> Result<Certificate, MetricError> {
        let (mesh, _) = self.samples()?.ordered(mesh)?;
        certify(&self.surface, &self.tree, &mesh, tolerance)
    }

    /// [`Judge::evaluate`], with the intervals of [`Judge::certify`] and [`Judge::cover`] of the width `certify`.
    /// Spheres without edges get those of [`Judge::cover`] without it, 0.001 wide.
    ///
    /// # Errors
    /// As [`Judge::certify`].
    pub fn evaluate_certified(
        &self,
        mesh: &MedialMesh,
        certify: Option<f64>,
    ) -> Result<Evaluation, MetricError> {
        let certified = certify.map(|tolerance| self.certify(mesh, tolerance)).transpose()?;
        let mut evaluation = Evaluation { certified, ..self.evaluate(mesh)? };
        if let Some(tolerance) = certify.or(mesh.edges.is_empty().then_some(COVER_TOLERANCE)) {
            match self.cover(mesh, tolerance) {
                Ok(cover) => evaluation.cover = Some(cover),
                // The other measures hold without them, as of spheres in other units.
                Err(error) => evaluation.warnings.push(format!("no one-sided errors: {error}")),
            }
        }
        Ok(evaluation)
    }

    /// The one-sided errors of a medial mesh, each in an interval no wider than `tolerance`, as fractions of the
    /// diagonal.
    ///
    /// # Errors
    /// As [`Judge::certify`].
    pub fn cover(&self, mesh: &MedialMesh, tolerance: f64) -> Result<Cover, MetricError> {
        let samples = self.samples()?;
        let (mesh, union) = samples.ordered(mesh)?;
        let test = CoverTest::new(&self.surface, &self.tree, &self.inside);
        let [uncovered, overshoot] = match mesh.edges.is_empty() {
            true => [
                test.uncovered(&mesh.spheres, tolerance)?,
                test.overshoot(&mesh.spheres, tolerance)?,
            ],
            false => test.of_union(&union, tolerance)?,
        };
        let uncovered_at = union.signed_batch(&samples.points[..samples.uniform]);
        let options = EnvelopeOptions {
            samples: self.options.samples,
            burial: ROUNDING,
            seed: self.options.seed,
        };
        let boundary = sample_envelope_in(&samples.pose, &mesh, &union, &options)?.points;
        let overshoot_at = SignedDistance::closed(&self.tree, &self.inside).batch(&boundary);
        Ok(Cover {
            uncovered,
            overshoot,
            uncovered_over_surface: MeanAndP95::of(uncovered_at),
            overshoot_over_boundary: MeanAndP95::of(overshoot_at),
        })
    }

    /// The sheets of a medial mesh against those of a reference, both in units of the surface's diagonal: the same for
    /// every numbering of their spheres.
    ///
    /// # Errors
    /// When a mesh is empty or not valid, or has no union.
    pub fn sheet_difference(
        &self,
        mesh: &MedialMesh,
        reference: &MedialMesh,
    ) -> Result<SheetDifference, MetricError> {
        let samples = self.samples()?;
        sheet_difference(&samples.ordered(mesh)?.0, &samples.ordered(reference)?.0)
    }

    /// The distances between a medial mesh and a reference as sets of points, both in units of the surface's diagonal: the
    /// same for every numbering of their spheres.
    ///
    /// # Errors
    /// As [`Judge::sheet_difference`].
    pub fn axis_difference(
        &self,
        mesh: &MedialMesh,
        reference: &MedialMesh,
    ) -> Result<AxisDistances, MetricError> {
        let ordered = self.samples()?;
        let [mesh, reference] =
            [mesh, reference].map(|mesh| PreparedAxis::new(&ordered.ordered(mesh)?.0));
        let (mesh, reference) = (mesh?, reference?);
        let JudgeOptions { samples, seed, .. } = self.options;
        let chamfer = Some(mesh.chamfer(&reference, seed));
        Ok(AxisDistances { chamfer, ..mesh.distances(&reference, samples, seed)? })
    }

    fn volumes(
        &self,
        mesh: &MedialMesh,
        union: &MedialUnion,
        pose: &Pose,
    ) -> Result<Option<Volumes>, MetricError> {
        if self.options.volume_depth == 0 {
            return Ok(None);
        }
        let sides = Sides {
            surface: &self.surface,
            bvh: &self.tree,
            inside: &self.inside,
            balls: &mesh.spheres,
            union,
        };
        volumes(pose, &sides, self.options.volume_depth, self.options.seed).map(Some)
    }

    /// Signs that the medial mesh does not belong to this surface: some published files have wrong
    /// units or radii.
    fn misfits(
        &self,
        mesh: &MedialMesh,
        union: &MedialUnion,
        distances: &Distances,
    ) -> Vec<String> {
        let mut misfits = Vec::new();
        let (lo, hi) = union.bounding_box();
        let extent = (hi - lo).length();
        if !(0.5..=2.0).contains(&extent) {
            let times = match extent {
                0.001..1000.0 => format!("{extent:.3}"),
                _ => format!("{extent:.1e}"),
            };
            misfits.push(format!(
                "the union's bounding box has {times} times the diagonal of the surface's: \
                 is the medial mesh in other units?"
            ));
        }
        let (surface_lo, surface_hi) = self.surface.bounding_box().unwrap_or_default();
        let centres = mesh.spheres.iter().map(|s| s.centre);
        let outside =
            centres.filter(|c| c.cmplt(surface_lo).any() || c.cmpgt(surface_hi).any()).count();
        if 2 * outside > mesh.spheres.len() {
            misfits.push(format!(
                "{outside} of {} centres lie outside the bounding box of the surface: \
                 is the medial mesh moved, or of another mesh?",
                mesh.spheres.len()
            ));
        }
        if let Some([[low, median, high], beyond]) = self.radius_quartiles(mesh)
            && distances.mean > LARGE_MEAN
        {
            // Equal radii, and those that exceed the distances by the same, enclose a solid on purpose.
            let radius = mesh.spheres[0].radius;
            let is_equal = mesh.spheres[1..].iter().all(|s| s.radius == radius);
            let is_offset = beyond[0] > 0.0 && beyond[2] < 1.1 * beyond[0];
            let is_chosen = mesh.edges.is_empty() && (is_equal || is_offset);
            let off = !(2.0 / 3.0..=1.5).contains(&median);
            // The same factor for all radii is not the work of a simplification.
            let scaled = (median - 1.0).abs() > 0.1 && high < 1.1 * low;
            if (off || scaled) && !is_chosen {
                let times = match median {
                    0.01..1000.0 => format!("{median:.3}"),
                    _ => format!("{median:.1e}"),
                };
                misfits.push(format!(
                    "the radii are {times} times the distances of their centres to the surface \
                     (the median of {}): are the radii scaled, or squared?",
                    mesh.spheres.len()
                ));
            }
        }
        misfits
    }

    /// Quartiles of the ratio of radius to distance of the centre from the surface, and of their difference;
    /// `None` if all centres lie on the surface.
    fn radius_quartiles(&self, mesh: &MedialMesh) -> Option<[[f64; 3]; 2]> {
        let centres: Vec<_> = mesh.spheres.iter().map(|s| s.centre).collect();
        let depths = self.tree.distance_batch(&centres);
        let off_surface = mesh.spheres.iter().zip(depths).filter(|&(_, depth)| depth > ON_SURFACE);
        let pairs = off_surface.map(|(s, depth)| (s.radius / depth, s.radius - depth));
        let (ratios, beyond): (Vec<f64>, Vec<f64>) = pairs.unzip();
        (!ratios.is_empty()).then(|| {
            [ratios, beyond].map(|mut values| {
                values.sort_unstable_by(f64::total_cmp);
                [0.25, 0.5, 0.75].map(|share| values[(share * values.len() as f64) as usize])
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::complex::Sphere;

    #[test]
    fn a_volume_that_is_lost_to_rounding_leaves_the_other_measures() {
        // Two sides that coincide: a volume of zero.
        let surface = TriMesh {
            vertices: vec![Vec3::ZERO, Vec3::X * 0.6, Vec3::Y * 0.8],
            faces: vec![[0, 1, 2], [0, 2, 1]],
        };
        let tree = Arc::new(TriangleBvh::new(&surface).unwrap());
        let options = JudgeOptions { samples: 100, ..JudgeOptions::default() };
        let inside = Arc::new(InsideTest::new(&surface));
        let judge = Judge::new(surface, tree, inside, Truth::default(), options);
        let spheres = vec![Sphere::new(Vec3::new(0.2, 0.2, 0.0), 0.1)];
        let mesh = MedialMesh::from_simplices(spheres, vec![], vec![]).unwrap();
        let evaluation = judge.evaluate(&mesh).unwrap();
        assert_eq!(evaluation.volume_error, None);
        assert!(evaluation.warnings.iter().any(|w| w.contains("volume is lost to rounding")));
    }
}
