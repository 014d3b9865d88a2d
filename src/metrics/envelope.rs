//! Points on the boundary of the union of medial primitives, uniform by area.
//!
//! The boundary consists of parts of spheres, of cone laterals and of the tangent triangles of
//! slabs. Each patch is sampled on its own, all with one density, and the points that lie inside
//! another primitive are dropped:
//!
//! 1. Patches and their areas: `4 pi r^2`; `pi (1 - s^2) l (r_1 + r_2)`; two triangles for a slab.
//! 2. A pilot run with an eighth of the samples estimates the share that survives.
//! 3. The main run is denser by that share, so that about the requested number survives. It makes at
//!    most ten times as many candidates as requested samples, or more until a quarter of the
//!    requested number survives.
//!
//! Spheres are sampled along an equal-area spiral, cones and triangles by low-discrepancy sequences.
//! Each patch is turned or shifted at random, so that even a single sample is uniformly distributed
//! over its patch.
//!
//! # Rounding
//! On flat parts many primitives touch, and rounding decides which of them is a hair deeper. Three
//! rules keep such a decision from moving any other sample:
//!
//! - A sample's weight falls linearly from 1 to 0 between half the burial depth and the burial depth.
//!   The pilot's share is a sum of weights, so the density changes by as little as the depths do.
//! - The order and the random turn of a patch depend on its spheres, rounded far more coarsely than any
//!   error of theirs, and not on its place in a list from which another patch may vanish.
//! - Patches get their number of samples from a running sum of areas. A patch that rounding adds or
//!   removes has almost no area.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::MetricError;
use super::samples::Pose;
use crate::Vec3;
use crate::complex::{MedialMesh, MedialUnion};
use crate::geometry::hash::splitmix;
use crate::geometry::{Cone, ConeFrame, Slab, Sphere};

/// How the boundary of a union is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvelopeOptions {
    /// Approximate number of samples.
    pub samples: usize,
    /// A point as deep as this inside some primitive is not on the boundary. In the unit of the
    /// medial mesh.
    pub burial: f64,
    /// Seed of the turns and shifts.
    pub seed: u64,
}

/// The pilot run has one candidate for this many requested samples.
const PILOT: f64 = 8.0;
/// The pilot run has at least this many candidates.
const MIN_PILOT: f64 = 1000.0;

/// The main run makes at most this many candidates per requested sample. If more were needed, nearly
/// all of the area is buried, and fewer samples than requested are returned.
const USUAL_CANDIDATES: f64 = 10.0;

/// More candidates are made only until this share of the requested samples survives, enough for a
/// maximum: many balls bury nearly all of each other.
const MIN_SHARE: f64 = 0.25;
/// But never more candidates per requested sample than this.
const MAX_CANDIDATES: f64 = 200.0;

/// The golden ratio's fractional part, and the two of the plastic number: steps of the sequences.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
const PLASTIC: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// Points on the boundary of the union of the primitives of `mesh`, uniform by area.
///
/// A union without area (all radii zero, no faces) is represented by its sphere centres. The same
/// points come out for any number of threads.
///
/// # Errors
/// When no samples are requested.
pub fn sample_envelope(
    mesh: &MedialMesh,
    union: &MedialUnion,
    options: &EnvelopeOptions,
) -> Result<Vec<Vec3>, MetricError> {
    Ok(sample_envelope_in(&Pose::coordinates(), mesh, union, options)?.points)
}

/// Samples of the boundary of a union.
#[derive(Clone, Debug, Default)]
pub(super) struct Weighted {
    pub points: Vec<Vec3>,
    /// From above 0 to 1, smaller for points that are nearly buried.
    pub weights: Vec<f64>,
}

/// As [`sample_envelope`], laid out in the frame `pose` instead of that of the coordinates.
pub(super) fn sample_envelope_in(
    pose: &Pose,
    mesh: &MedialMesh,
    union: &MedialUnion,
    options: &EnvelopeOptions,
) -> Result<Weighted, MetricError> {
    if options.samples == 0 {
        return Err(MetricError::NoSamples("envelope_samples"));
    }
    let patches = patches(mesh, pose);
    let total = patches.iter().map(|patch| patch.surface.area()).sum::<f64>();
    let wanted = options.samples as f64;
    // Candidates per area of the densest run: if this overflows, the union has almost no area.
    let densest = (wanted * MAX_CANDIDATES).max(MIN_PILOT) / total;
    if !(total > 0.0 && total.is_finite() && densest.is_finite()) {
        let points: Vec<Vec3> = mesh.spheres.iter().map(|m| m.centre).collect();
        return Ok(Weighted { weights: vec![1.0; points.len()], points });
    }
    let sampled =
        |candidates| sample_patches(&patches, pose.axes(), candidates / total, union, options);
    let pilot = (wanted / PILOT).max(MIN_PILOT);
    let share = sampled(pilot).total() / pilot;
    let mut samples = sampled(wanted * candidates_for(share));
    let survivors = samples.total() / (wanted * candidates_for(share));
    if samples.total() < MIN_SHARE * wanted && candidates_for(survivors) > candidates_for(share) {
        // The pilot run had too few survivors to estimate their share.
        samples = sampled(wanted * candidates_for(survivors));
    }
    Ok(samples)
}

impl Weighted {
    /// The sum of the weights.
    fn total(&self) -> f64 {
        self.weights.iter().sum()
    }

    /// The mean of a value at each point.
    pub fn mean(&self, values: &[f64]) -> f64 {
        let weighted = self.weights.iter().zip(values).map(|(weight, value)| weight * value);
        // Without points, as without area, there is nothing to be far from.
        weighted.sum::<f64>() / self.total().max(f64::MIN_POSITIVE)
    }
}

/// Candidates per requested sample, if this share of them survives.
fn candidates_for(share: f64) -> f64 {
    let usual = (1.0 / share).clamp(1.0, USUAL_CANDIDATES);
    (MIN_SHARE / share).clamp(usual, MAX_CANDIDATES)
}

/// A piece of the boundary of one primitive.
enum Surface {
    Sphere(Sphere),
    /// Start sphere, end sphere, frame.
    Lateral(Sphere, Sphere, ConeFrame),
    Triangle([Vec3; 3]),
}

/// A piece to be sampled, and where it is.
struct Patch {
    surface: Surface,
    /// Spheres, laterals, and the two sides of slabs.
    kind: u64,
    /// The cells of its spheres, in ascending order; zero where it has fewer.
    cells: [[u64; 2]; 3],
}

/// The patches of a mesh, in an order that neither the numbering nor rounding changes.
fn patches(mesh: &MedialMesh, pose: &Pose) -> Vec<Patch> {
    let cells: Vec<_> = mesh.spheres.iter().map(|m| pose.cell(m.centre, m.radius)).collect();
    let of = |corners: &[u32]| {
        std::array::from_fn(|k| corners.get(k).map_or([0; 2], |&v| cells[v as usize]))
    };
    let mut patches: Vec<Patch> = (0..)
        .zip(&mesh.spheres)
        .map(|(v, &m)| Patch { surface: Surface::Sphere(m), kind: 0, cells: of(&[v]) })
        .collect();
    for &(mut ends) in &mesh.edges {
        ends.sort_by_key(|&v| cells[v as usize]);
        let [a, b] = mesh.spheres_of(ends);
        if let Some(frame) = Cone::new(a, b).frame() {
            patches.push(Patch {
                surface: Surface::Lateral(a, b, frame),
                kind: 1,
                cells: of(&ends),
            });
        }
    }
    for &(mut corners) in &mesh.faces {
        corners.sort_by_key(|&v| cells[v as usize]);
        let balls = mesh.spheres_of(corners);
        if let Some(planes) = Slab::new(balls).planes() {
            for (normal, kind) in planes.normals().into_iter().zip(2..) {
                let surface = Surface::Triangle(balls.map(|m| m.centre + m.radius * normal));
                patches.push(Patch { surface, kind, cells: of(&corners) });
            }
        }
    }
    // Stable: patches of the same cells are equal but for rounding.
    patches.sort_by_key(|patch| (patch.kind, patch.cells));
    patches
}

impl Patch {
    /// The seed of the random numbers that turn it.
    fn stream(&self) -> u64 {
        self.cells.as_flattened().iter().fold(self.kind, |hash, &cell| splitmix(hash ^ cell))
    }
}

/// The candidates of all patches at one density (points per area) that are not buried.
fn sample_patches(
    patches: &[Patch],
    axes: [Vec3; 3],
    density: f64,
    union: &MedialUnion,
    options: &EnvelopeOptions,
) -> Weighted {
    // Rounding the running sum, not each patch, keeps the density right for small patches.
    let mut expected = Pcg64::seed_from_u64(options.seed).random::<f64>();
    let counts: Vec<usize> = patches
        .iter()
        .map(|patch| {
            let before = expected.floor();
            expected += patch.surface.area() * density;
            (expected.floor() - before) as usize
        })
        .collect();
    let samples = patches.par_iter().zip(&counts).flat_map_iter(|(patch, &count)| {
        let mut points = Vec::new();
        if count > 0 {
            let mut rng = Pcg64::seed_from_u64(options.seed ^ patch.stream());
            patch.surface.sample(axes, count, &mut rng, &mut points);
            // Most buried points are found by the first primitive that is tried.
            union.retain_unburied(&mut points, options.burial);
        }
        let mut near = 0;
        points.into_iter().filter_map(move |point| {
            let depth = -union.signed_from(point, &mut near);
            let weight = (2.0 * (1.0 - depth / options.burial)).min(1.0);
            // Without a burial depth only points in no primitive at all are on the boundary.
            let weight = if options.burial > 0.0 { weight } else { 1.0 };
            (weight > 0.0).then_some((point, weight))
        })
    });
    let (points, weights) = samples.unzip();
    Weighted { points, weights }
}

impl Surface {
    fn area(&self) -> f64 {
        match self {
            Self::Sphere(m) => 4.0 * PI * m.radius * m.radius,
            Self::Lateral(a, b, frame) => {
                let rise_squared = (1.0 - frame.s) * (1.0 + frame.s);
                PI * rise_squared * a.centre.distance(b.centre) * (a.radius + b.radius)
            }
            Self::Triangle([a, b, c]) => (b - a).cross(c - a).length() * 0.5,
        }
    }

    fn sample(&self, axes: [Vec3; 3], count: usize, rng: &mut Pcg64, points: &mut Vec<Vec3>) {
        let shift = [rng.random::<f64>(), rng.random::<f64>()];
        let level = |i: usize| (i as f64 + 0.5) / count as f64;
        match self {
            Self::Sphere(m) => {
                let turn = glam::DMat3::from_cols_array_2d(&axes.map(|axis| axis.to_array()))
                    * glam::DMat3::from_quat(random_rotation(rng));
                points.extend((0..count).map(|i| {
                    let z = 1.0 - 2.0 * level(i);
                    let (sin, cos) = (TAU * (i as f64 * GOLDEN).fract()).sin_cos();
                    let rho = ((1.0 - z) * (1.0 + z)).sqrt();
                    m.centre + m.radius * (turn * Vec3::new(rho * cos, rho * sin, z))
                }));
            }
            Self::Lateral(a, b, frame) => {
                let v = across(frame, axes);
                let w = frame.u.cross(v);
                points.extend((0..count).map(|i| {
                    let share = (level(i) + shift[0]).fract();
                    let (sin, cos) = (TAU * (i as f64 * GOLDEN + shift[1]).fract()).sin_cos();
                    // Area grows with the radius; this form does not cancel for equal radii.
                    let sum = a.radius + b.radius;
                    let radius = (a.radius * a.radius + share * (b.radius - a.radius) * sum).sqrt();
                    let m = a.lerp(*b, share * sum / (a.radius + radius));
                    m.centre + m.radius * frame.normal(cos * v + sin * w)
                }));
            }
            Self::Triangle([a, b, c]) => points.extend((0..count).map(|i| {
                let [mut s, mut t] = [0, 1].map(|k| (i as f64 * PLASTIC[k] + shift[k]).fract());
                // The sequence fills a parallelogram; its other half is reflected into the triangle.
                if s + t > 1.0 {
                    (s, t) = (1.0 - s, 1.0 - t);
                }
                *a + s * (*b - *a) + t * (*c - *a)
            })),
        }
    }
}

/// The unit vector orthogonal to a cone's axis in the direction of the first of `axes` that is not
/// nearly parallel to the cone's axis.
pub(super) fn across(frame: &ConeFrame, axes: [Vec3; 3]) -> Vec3 {
    let [x, y, _] = axes;
    // Below one half, so that one of two orthogonal axes always qualifies; not a simple fraction, so
    // that rounding does not decide for symmetric shapes.
    let is_across = x.reject_from_normalized(frame.u).length_squared() > 0.2137;
    frame.across(if is_across { x } else { y }).unwrap_or(frame.v)
}

/// Uniform over all rotations (Shoemake 1992, "Uniform random rotations", Graphics Gems III).
fn random_rotation(rng: &mut Pcg64) -> glam::DQuat {
    let [split, first, second] = [(); 3].map(|()| rng.random::<f64>());
    let (s1, c1) = (TAU * first).sin_cos();
    let (s2, c2) = (TAU * second).sin_cos();
    let (a, b) = ((1.0 - split).sqrt(), split.sqrt());
    glam::DQuat::from_xyzw(a * s1, a * c1, b * s2, b * c2)
}
