//! All metrics of a medial mesh against one surface.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::axis_distance::{PreparedAxis, prepared_axis_distance};
use super::hausdorff::distances_with_envelope;
use super::samples::{Pose, SurfaceSamples};
use super::spikes::{centres_outside, protrusion};
use super::structure::{Structure, StructureSurface};
use super::volume::{Sides, Volumes, box_in, volumes_in};
use super::{
    AxisOptions, Certificate, CoverTest, DistanceOptions, EnvelopeOptions, MetricError, OneSided,
    ROUNDING, VolumeOptions, certify, sample_envelope, spikes, topology_warning,
};
use crate::Vec3;
use crate::complex::{Incidence, MedialMesh, MedialUnion, ZERO_LENGTH, betti, euler};
use crate::surface::{InsideTest, Side, SignedDistance, TriMesh, TriangleBvh};

/// Mean error from which radii that do not fit the surface cause a warning. A result with a smaller
/// error is right, for any radii.
const LARGE_MEAN: f64 = 0.005;

/// Width of the intervals of one-sided errors where none is requested.
const COVER_TOLERANCE: f64 = 1e-3;

/// For centres closer to the surface than this the ratio of radius to distance means nothing.
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
        let options = self.distance_options();
        // In parallel with each other, because each has serial parts.
        let ((distances, volumes), (axis, (quality, spikes, betti, structure))) = rayon::join(
            || {
                rayon::join(
                    || {
                        distances_with_envelope(
                            (&self.surface, &self.tree),
                            mesh,
                            union,
                            samples,
                            &options,
                        )
                    },
                    || self.volumes(mesh, union, &samples.pose),
                )
            },
            || {
                rayon::join(
                    || self.true_axis.as_ref().map(|truth| self.axis_distances(mesh, truth)),
                    || {
                        let betti = betti(mesh);
                        (triangle_quality(mesh), spikes(mesh), betti, self.structure(mesh, betti))
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
            structure: Some(structure?).filter(|_| is_connected),
            diagonal: self.truth.diagonal,
            seed: self.options.seed,
        })
    }

    /// The distances alone.
    ///
    /// # Errors
    /// As [`Judge::evaluate`].
    pub fn distances(&self, mesh: &MedialMesh) -> Result<Distances, MetricError> {
        let samples = self.samples()?;
        let (mesh, union) = samples.ordered(mesh)?;
        let options = self.distance_options();
        let surface = (&self.surface, &*self.tree);
        Ok(distances_with_envelope(surface, &mesh, &union, samples, &options)?.0)
    }

    fn samples(&self) -> Result<&SurfaceSamples, MetricError> {
        self.samples.as_ref().map_err(Clone::clone)
    }

    fn distance_options(&self) -> DistanceOptions {
        DistanceOptions {
            surface_samples: self.options.samples,
            envelope_samples: self.options.samples,
            seed: self.options.seed,
        }
    }

    /// An interval no wider than `tolerance` that holds the Hausdorff distance of
    /// [`certify`](super::certify), as fractions of the diagonal.
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
        let boundary = sample_envelope(&mesh, &union, &options)?;
        let overshoot_at = SignedDistance::closed(&self.tree, &self.inside).batch(&boundary);
        Ok(Cover {
            uncovered,
            overshoot,
            uncovered_over_surface: MeanAndP95::of(uncovered_at),
            overshoot_over_boundary: MeanAndP95::of(overshoot_at),
        })
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
        let options = VolumeOptions { depth: self.options.volume_depth, seed: self.options.seed };
        let sides = Sides {
            surface: &self.surface,
            bvh: &self.tree,
            union,
            inside: |p| self.inside.side(p) == Side::Inside,
        };
        let bounds = box_in(pose, &self.surface, &mesh.spheres);
        volumes_in(pose, bounds, &sides, &options).map(Some)
    }

    fn structure(&self, mesh: &MedialMesh, betti: [u64; 3]) -> Result<Structure, MetricError> {
        let cavities = self.truth.betti.map_or(0, |betti| betti[2]);
        let pockets = betti[2].saturating_sub(cavities);
        let axis = PreparedAxis::new(mesh)?;
        Ok(self.structure.measure(mesh, &axis, pockets, self.truth.axis.as_ref()))
    }

    fn axis_distances(
        &self,
        mesh: &MedialMesh,
        truth: &Result<PreparedAxis, MetricError>,
    ) -> Result<AxisDistances, MetricError> {
        let options = AxisOptions { samples: self.options.samples, seed: self.options.seed };
        let truth = truth.as_ref().map_err(Clone::clone)?;
        prepared_axis_distance(&PreparedAxis::new(mesh)?, truth, &options)
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

// The record of everything measured on one medial mesh: the `evaluate` object of the command.
//
// All lengths are fractions of the input's bounding-box diagonal. METHODOLOGY.md defines each
// number; the modules next to this one compute them.

/// Everything measured on one medial mesh against one surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Distances between the surface and the union of spheres, cones and slabs.
    #[serde(flatten)]
    pub distances: Distances,
    /// An interval that contains the Hausdorff distance, if it was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certified: Option<Certificate>,
    /// One-sided errors: of spheres without edges, and of every medial mesh with a certificate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cover: Option<Cover>,
    /// Volume of the symmetric difference of solid and union, over the solid's volume.
    pub volume_error: Option<f64>,
    /// Volume of the union over the solid's volume.
    #[serde(default)]
    pub volume_ratio: Option<f64>,
    /// Largest distance from the surface of a boundary point of the union that is outside the solid.
    #[serde(default)]
    pub protrusion: Option<f64>,
    /// Share of the centres that are outside the solid.
    #[serde(default)]
    pub centres_outside: Option<f64>,
    /// Angles of the medial triangles.
    pub quality: TriangleQuality,
    /// Spike measures.
    pub spikes: Spikes,
    /// Betti numbers `[b0, b1, b2]` of the medial mesh over Z2.
    pub betti: [u64; 3],
    /// Euler number of the medial mesh, vertices - edges + faces.
    pub euler: i64,
    /// The Betti numbers that the solid's topology implies: components, total genus, cavities.
    pub expected_betti: Option<[u64; 3]>,
    /// Sizes of the complex.
    pub counts: Counts,
    /// Distances to the exactly known medial axis, where the shape carries one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<AxisDistances>,
    /// Sheets, seams and features.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub structure: Option<Structure>,
    /// Bounding-box diagonal of the input, in the input's units.
    pub diagonal: f64,
    /// Seed of every random sample.
    pub seed: u64,
    /// Remarks for the reader, such as radii that do not fit the mesh.
    pub warnings: Vec<String>,
}

impl Evaluation {
    /// Whether the Betti numbers are the solid's; `None` if these are unknown, or of spheres without edges, which have no
    /// connectivity.
    pub fn has_right_topology(&self) -> Option<bool> {
        let is_connected = self.counts.spheres == 1 || self.counts.edges > 0;
        self.expected_betti.filter(|_| is_connected).map(|expected| self.betti == expected)
    }

    /// Maps the witnesses of all intervals, as to the units of the input.
    pub fn move_witnesses(&mut self, map: impl Fn(Vec3) -> Vec3) {
        if let Some(certified) = &mut self.certified {
            certified.witness.point = map(certified.witness.point);
        }
        if let Some(cover) = &mut self.cover {
            cover.uncovered.witness = cover.uncovered.witness.map(&map);
            cover.overshoot.witness = cover.overshoot.witness.map(&map);
        }
    }
}

/// One-sided errors against a solid, as fractions of the diagonal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cover {
    /// Largest distance from a point of the solid, boundary and interior, to the union.
    pub uncovered: OneSided,
    /// Largest distance from a point of the union to the solid.
    pub overshoot: OneSided,
    /// Distances to the union over the area of the surface; covered points count as 0.
    pub uncovered_over_surface: MeanAndP95,
    /// Distances to the solid over the boundary of the union; points in the solid count as 0.
    pub overshoot_over_boundary: MeanAndP95,
}

/// Mean and 95th percentile of sampled distances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanAndP95 {
    /// The mean.
    pub mean: f64,
    /// The 95th percentile.
    pub p95: f64,
}

impl MeanAndP95 {
    /// Of signed distances, where negative ones count as 0; 0 of none.
    fn of(mut signed: Vec<f64>) -> Self {
        signed.iter_mut().for_each(|distance| *distance = distance.max(0.0));
        signed.sort_unstable_by(f64::total_cmp);
        let Some(last) = signed.len().checked_sub(1) else { return Self::default() };
        let mean = signed.iter().sum::<f64>() / signed.len() as f64;
        Self { mean, p95: signed[(0.95 * last as f64) as usize] }
    }
}

/// Distances between the surface S and the boundary of the union U of the medial primitives.
///
/// Maxima are over samples, the points that are reached from the largest of them by local ascent, and those
/// where a sweep of both surfaces finds a larger `hausdorff`: distances at actual points, and so lower bounds
/// of the true maxima.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distances {
    /// Largest distance from a point of S to the nearest primitive's surface, buried or not:
    /// the reading of the Q-MAT paper.
    pub epsilon: f64,
    /// Largest distance from a point of S to the union's boundary.
    pub epsilon_union: f64,
    /// Largest distance from a point of the union's boundary to the surface.
    pub reverse: f64,
    /// `max(epsilon_union, reverse)`.
    pub hausdorff: f64,
    /// Mean over the area-uniform surface samples of the distance to the union's boundary.
    pub mean: f64,
    /// Root mean square of the same.
    pub rms: f64,
    /// 95th percentile of the same.
    pub p95: f64,
    /// 99th percentile of the same.
    pub p99: f64,
    /// Mean distance from the boundary of the union to the surface, by area.
    pub reverse_mean: f64,
    /// Largest absolute signed distance from a point of S to the spheres alone, without cones and slabs.
    pub spheres_only: f64,
    /// Number of surface samples, the mesh vertices included.
    pub samples: usize,
    /// Number of samples on the boundary of the union, which no primitive buries. If it is small,
    /// nearly all of the primitives' area is buried, and `reverse` rests on few samples.
    pub reverse_samples: usize,
}

/// Angles of the medial triangles, in degrees: Table I of the Q-MAT paper and two further shares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TriangleQuality {
    /// Mean over the triangles of the smallest angle.
    pub min_angle_mean: Option<f64>,
    /// Mean over the triangles of the largest angle.
    pub max_angle_mean: Option<f64>,
    /// Share of the triangles with a smallest angle below 30 degrees.
    pub below_30: Option<f64>,
    /// The same below 10 degrees.
    pub below_10: Option<f64>,
    /// The same below 1 degree.
    pub below_1: Option<f64>,
    /// Triangles with a height below 1e-12, which are counted here only and enter no mean or share.
    pub zero_area: u64,
}

/// Spike measures. No paper defines them; METHODOLOGY.md does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spikes {
    /// For each threshold on the stability ratio: shares and counts.
    pub by_ratio: Vec<RatioSpikes>,
    /// Edges without a face that end in a sphere with no other edge.
    pub dangling_edges: u64,
    /// Faces with two or three boundary edges and a smallest angle below 10 degrees.
    pub fins: u64,
    /// Boundary spheres whose ball protrudes by less than 0.001 from the ball of a neighbour at least
    /// as large.
    pub idle_spheres: u64,
    /// Spheres with a separation angle below 20 degrees, where contact points are known.
    pub angle_spikes: Option<u64>,
}

/// Spike measures for one threshold on the stability ratio.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RatioSpikes {
    /// The threshold on the stability ratio of an edge.
    pub threshold: f64,
    /// Share of the edges below the threshold.
    pub edge_share: f64,
    /// Share of the total edge length below the threshold.
    pub length_share: f64,
    /// Connected components of the edges below the threshold that reach the boundary of the mesh.
    pub spikes: u64,
    /// Dangling edges below the threshold.
    pub dangling_edges: u64,
}

/// Sizes of a medial mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Spheres.
    pub spheres: u64,
    /// Edges.
    pub edges: u64,
    /// Faces.
    pub faces: u64,
    /// Edges without a face.
    pub lone_edges: u64,
    /// Spheres without an edge.
    pub isolated: u64,
    /// Edges with three faces or more.
    pub nonmanifold_edges: u64,
}

impl Counts {
    /// Floats that are stored: four for each sphere.
    pub fn numbers(&self) -> u64 {
        4 * self.spheres
    }

    /// Bytes in the plainest binary form: 8 for each float, 4 for each index; three indices for each
    /// face, two for each edge without one, since the sides of faces need not be stored.
    pub fn bytes(&self) -> u64 {
        8 * self.numbers() + 4 * (3 * self.faces + 2 * self.lone_edges)
    }
}

/// Distances between a computed medial axis and the true one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisDistances {
    /// As sets of points in space.
    #[serde(flatten)]
    pub in_space: AxisSpan,
    /// As sets of points with radii, in four-dimensional space.
    pub with_radius: AxisSpan,
    /// For each sheet of the true axis how much of it the computed axis covers; the largest sheet
    /// first.
    pub coverage: Vec<SheetCoverage>,
}

/// Distances between two axes, both ways.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisSpan {
    /// Largest distance from the computed axis to the true one.
    pub computed_to_true_max: f64,
    /// Mean of the same.
    pub computed_to_true_mean: f64,
    /// Largest distance from the true axis to the computed one.
    pub true_to_computed_max: f64,
    /// Mean of the same.
    pub true_to_computed_mean: f64,
}

/// How much of one sheet of the true axis is covered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SheetCoverage {
    /// Area of the sheet.
    pub area: f64,
    /// Share of it that is covered; `None` where no sample fell on it.
    pub covered: Option<f64>,
}

// Sizes of a medial mesh.

/// Numbers of spheres, edges and faces, of edges without a face, of spheres without an edge, and
/// of edges with three faces or more. Cost `O(V + E + F)`.
///
/// # Panics
/// If the mesh is not in canonical form; see [`MedialMesh::check`].
pub fn counts(mesh: &MedialMesh) -> Counts {
    let incidence = Incidence::of(mesh);
    let faces_at = incidence.faces_at();
    Counts {
        spheres: mesh.spheres.len() as u64,
        edges: mesh.edges.len() as u64,
        faces: mesh.faces.len() as u64,
        lone_edges: faces_at.iter().filter(|&&faces| faces == 0).count() as u64,
        isolated: degrees(mesh).into_iter().filter(|&degree| degree == 0).count() as u64,
        nonmanifold_edges: faces_at.iter().filter(|&&faces| faces >= 3).count() as u64,
    }
}

/// For each sphere the number of its edges.
pub(super) fn degrees(mesh: &MedialMesh) -> Vec<u32> {
    let mut degrees = vec![0; mesh.spheres.len()];
    for &sphere in mesh.edges.iter().flatten() {
        degrees[sphere as usize] += 1;
    }
    degrees
}

// Angles of the medial triangles, as in Table I of Li, Wang, Sun, Guo, Zhang, Wang, "Q-MAT:
// Computing Medial Axis Transform by Quadratic Error Minimization", ACM TOG 35 (2015),
// <https://doi.org/10.1145/2753755>, with two shares more.

/// Angles of the triangles of centres. The angles of triangles with a height below [`ZERO_LENGTH`] are
/// rounding; such triangles are counted separately and enter no mean or share.
///
/// Lengths are in units of the bounding-box diagonal. Means and shares are `None` when no
/// triangle is left. Cost `O(F)`.
///
/// # Panics
/// If a face is out of range.
pub fn triangle_quality(mesh: &MedialMesh) -> TriangleQuality {
    let angles: Vec<[f64; 2]> =
        mesh.faces.iter().filter_map(|face| extreme_angles(corners(mesh, face))).collect();
    let share = |n: f64| (!angles.is_empty()).then(|| n / angles.len() as f64);
    let below = |limit: f64| share(angles.iter().filter(|[min, _]| *min < limit).count() as f64);
    TriangleQuality {
        min_angle_mean: share(angles.iter().map(|[min, _]| min).sum()),
        max_angle_mean: share(angles.iter().map(|[_, max]| max).sum()),
        below_30: below(30.0),
        below_10: below(10.0),
        below_1: below(1.0),
        zero_area: (mesh.faces.len() - angles.len()) as u64,
    }
}

/// The centres of a face.
pub(super) fn corners(mesh: &MedialMesh, face: &[u32; 3]) -> [Vec3; 3] {
    face.map(|sphere| mesh.spheres[sphere as usize].centre)
}

/// Smallest and largest angle of a triangle, in degrees, or `None` where it has no area.
pub(super) fn extreme_angles([a, b, c]: [Vec3; 3]) -> Option<[f64; 2]> {
    let doubled_area = (b - a).cross(c - a).length();
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let height = doubled_area / longest;
    // Three coincident centres have no height either: 0 / 0.
    if height.is_nan() || height < ZERO_LENGTH {
        return None;
    }
    // The arc tangent is exact to rounding for needles and caps, where the arc cosine is not.
    let angles = [(b - a, c - a), (c - b, a - b), (a - c, b - c)]
        .map(|(u, v)| u.cross(v).length().atan2(u.dot(v)).to_degrees());
    let smallest = angles.into_iter().fold(f64::INFINITY, f64::min);
    let largest = angles.into_iter().fold(0.0, f64::max);
    Some([smallest, largest])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

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

    #[test]
    fn every_kind_is_counted_once() {
        // Three triangles on the edge 01, a lone edge 45, two isolated spheres.
        let spheres = vec![Sphere::new(Vec3::ZERO, 1.0); 9];
        let faces = vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]];
        let mesh = MedialMesh::from_simplices(spheres, vec![[4, 5], [5, 8]], faces).unwrap();
        let expected = Counts {
            spheres: 9,
            edges: 9,
            faces: 3,
            lone_edges: 2,
            isolated: 2,
            nonmanifold_edges: 1,
        };
        assert_eq!(counts(&mesh), expected);
        assert_eq!(counts(&MedialMesh::default()).spheres, 0);
    }

    fn mesh_of(triangles: &[[Vec3; 3]]) -> MedialMesh {
        let spheres = triangles.iter().flatten().map(|&p| Sphere::new(p, 1.0)).collect();
        let faces = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        MedialMesh::from_simplices(spheres, vec![], faces).unwrap()
    }

    fn planar(points: [[f64; 2]; 3]) -> [Vec3; 3] {
        points.map(|[x, y]| Vec3::new(x, y, 0.0))
    }

    #[test]
    fn known_triangles_give_known_angles() {
        let equilateral = planar([[0.0, 0.0], [1.0, 0.0], [0.5, 0.75f64.sqrt()]]);
        let right = planar([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let tangent = 5f64.to_radians().tan();
        let needle = planar([[0.0, 0.0], [1.0, 0.0], [1.0, tangent]]);
        let cap = planar([[0.0, 0.0], [1.0, 0.0], [0.5, 1e-3]]);
        let quality = triangle_quality(&mesh_of(&[equilateral, right, needle, cap]));
        let flat = 1e-3f64.atan2(0.5).to_degrees();
        let close = |x: Option<f64>, y: f64| assert!((x.unwrap() - y).abs() < 1e-12, "{x:?} {y}");
        close(quality.min_angle_mean, (60.0 + 45.0 + 5.0 + flat) / 4.0);
        close(quality.max_angle_mean, (60.0 + 90.0 + 90.0 + 180.0 - 2.0 * flat) / 4.0);
        assert_eq!(quality.below_30, Some(0.5));
        assert_eq!(quality.below_10, Some(0.5));
        assert_eq!(quality.below_1, Some(0.25));
        assert_eq!(quality.zero_area, 0);
    }

    #[test]
    fn triangles_without_area_are_counted_apart() {
        let collinear = planar([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]);
        let coincident = planar([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]);
        let noise = planar([[0.0, 0.0], [1e-13, 1e-13], [0.1, 0.0]]);
        let right = planar([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let quality = triangle_quality(&mesh_of(&[collinear, coincident, noise, right]));
        assert_eq!(quality.zero_area, 3);
        assert_eq!(quality.max_angle_mean, Some(90.0));
        let none = triangle_quality(&mesh_of(&[collinear]));
        assert_eq!((none.min_angle_mean, none.below_1, none.zero_area), (None, None, 1));
    }

    proptest! {
        #[test]
        fn angles_do_not_change_under_similarities(
            points in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)),
            axis in prop::array::uniform3(0.1..1.0f64), turn in 0.0..6.0f64, scale in 0.01..100.0f64,
        ) {
            let points = points.map(Vec3::from);
            let rotation = glam::DQuat::from_axis_angle(Vec3::from(axis).normalize(), turn);
            let moved = points.map(|p| rotation * p * scale + Vec3::new(3.0, -2.0, 1.0));
            if let (Some(a), Some(b)) = (extreme_angles(points), extreme_angles(moved)) {
                prop_assert!((a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6);
                prop_assert!(a[0] <= 60.0 + 1e-12 && a[1] >= 60.0 - 1e-12);
            }
        }
    }
}
