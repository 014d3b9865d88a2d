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
//! Most candidates are inside a ball between their own sphere or cone and a neighbour. That is tested
//! for cells of a patch before their candidates are made, then for each candidate, and only the rest is
//! searched for. The tests keep a margin, so the samples are those of searches alone.
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
use std::ops::Range;

use glam::DMat3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::error::MetricError;
use super::pieces::{across, neighbours};
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

/// Requested samples for each candidate of the pilot run.
const PILOT: f64 = 8.0;
/// Least number of candidates of the pilot run.
const MIN_PILOT: f64 = 1000.0;

/// Limit of candidates of the main run for each requested sample. If more were needed, nearly all of the area is buried,
/// and fewer samples than requested are returned.
const USUAL_CANDIDATES: f64 = 10.0;

/// Share of the requested samples, enough for a maximum, up to which more candidates are made: many balls bury nearly all
/// of each other.
const MIN_SHARE: f64 = 0.25;
/// Limit of these candidates for each requested sample.
const MAX_CANDIDATES: f64 = 200.0;

/// Approximate number of candidates in a cell of a patch.
const CELL: usize = 8;
/// Number of patches, near to each other, whose points are searched one after the other.
const RUN: usize = 16;
/// Margin of the test for buried cells, as a share of the union's diagonal: more than the rounding of distances, so that a
/// search finds each of their points buried.
const MARGIN: f64 = 1e-10;

/// Step of the one-dimensional sequence: the golden ratio's fractional part.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Steps of the two-dimensional sequence, of the plastic number.
const PLASTIC: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// Points on the boundary of the union of the primitives of `mesh`, uniform by area.
///
/// A union without area (all radii zero, no faces) is represented by its sphere centres. The same
/// points come out for any number of threads.
///
/// # Errors
/// When no samples are requested.
///
/// # Panics
/// If a side of a face of `mesh` is not an edge, as no mesh with a union has it.
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
    /// Corners, outward unit normal.
    Triangle([Vec3; 3], Vec3),
}

/// A piece to be sampled, and where it is.
struct Patch {
    surface: Surface,
    /// Spheres, laterals, and the two sides of slabs.
    kind: u64,
    /// The cells of its spheres, in ascending order; zero where it has fewer.
    cells: [[u64; 2]; 3],
    /// Other ends of the edges of a sphere; third spheres of the faces of a cone.
    neighbours: Vec<Sphere>,
}

/// The patches of a mesh, in an order that neither the numbering nor rounding changes.
fn patches(mesh: &MedialMesh, pose: &Pose) -> Vec<Patch> {
    let cells: Vec<_> = mesh.spheres.iter().map(|m| pose.cell(m.centre, m.radius)).collect();
    let of = |corners: &[u32]| {
        std::array::from_fn(|k| corners.get(k).map_or([0; 2], |&v| cells[v as usize]))
    };
    let [at_spheres, at_edges] = neighbours(mesh);
    let mut patches: Vec<Patch> = (0..)
        .zip(&mesh.spheres)
        .zip(at_spheres)
        .map(|((v, &m), neighbours)| Patch {
            surface: Surface::Sphere(m),
            kind: 0,
            cells: of(&[v]),
            neighbours,
        })
        .collect();
    for (&(mut ends), neighbours) in mesh.edges.iter().zip(at_edges) {
        ends.sort_by_key(|&v| cells[v as usize]);
        let [a, b] = mesh.spheres_of(ends);
        if let Some(frame) = Cone::new(a, b).frame() {
            patches.push(Patch {
                surface: Surface::Lateral(a, b, frame),
                kind: 1,
                cells: of(&ends),
                neighbours,
            });
        }
    }
    for &(mut corners) in &mesh.faces {
        corners.sort_by_key(|&v| cells[v as usize]);
        let balls = mesh.spheres_of(corners);
        if let Some(planes) = Slab::new(balls).planes() {
            let cells = of(&corners);
            for (normal, kind) in planes.normals().into_iter().zip(2..) {
                let corners = balls.map(|m| m.centre + m.radius * normal);
                let surface = Surface::Triangle(corners, normal);
                patches.push(Patch { surface, kind, cells, neighbours: Vec::new() });
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
    let (low, high) = union.bounding_box();
    let depth = options.burial + MARGIN * low.distance(high);
    let runs = patches.par_chunks(RUN).zip(counts.par_chunks(RUN));
    let samples = runs.flat_map_iter(|(patches, counts)| {
        let places = patches.iter().zip(counts).flat_map(|(patch, &count)| {
            let mut rng = Pcg64::seed_from_u64(options.seed ^ patch.stream());
            patch.surface.sample(axes, count, &mut rng, &patch.neighbours, depth)
        });
        let (points, normals): (Vec<Vec3>, Vec<Vec3>) = places.map(|[p, n]| (p, n)).unzip();
        // Without a burial depth only points in no primitive at all are on the boundary.
        let burial = options.burial;
        let above = points.iter().zip(&normals).map(|(&p, &n)| p + burial * n);
        let unburied = union.unburied(&above.collect::<Vec<_>>(), 2.0 * burial).into_iter();
        unburied.filter_map(move |(i, above)| {
            // Nothing else is near to most.
            if above >= 0.999 * burial {
                return Some((points[i], 1.0));
            }
            let signed = union.signed(points[i]);
            let weight = (2.0 * (1.0 + signed / burial)).min(1.0);
            // Not on the wall of a gap so narrow that it counts as none.
            let probe = points[i] + (burial - signed) * normals[i];
            (weight > 0.0 && !union.buries(probe, 0.0)).then_some((points[i], weight))
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
            Self::Triangle([a, b, c], _) => (b - a).cross(c - a).length() * 0.5,
        }
    }

    /// Of `count` points the unburied ones, and some buried ones, each with its outward normal.
    fn sample(
        &self,
        axes: [Vec3; 3],
        count: usize,
        rng: &mut Pcg64,
        neighbours: &[Sphere],
        depth: f64,
    ) -> Vec<[Vec3; 2]> {
        let shift = [rng.random::<f64>(), rng.random::<f64>()];
        let turn = match self {
            Self::Sphere(_) => {
                DMat3::from_cols_array_2d(&axes.map(|axis| axis.to_array()))
                    * DMat3::from_quat(random_rotation(rng))
            }
            Self::Lateral(_, _, frame) => {
                let v = across(frame, axes);
                DMat3::from_cols(v, frame.u.cross(v), frame.u)
            }
            Self::Triangle(..) => DMat3::IDENTITY,
        };
        let mut grid = Grid::new(if neighbours.is_empty() { 0 } else { count }, self.lengths());
        let all = [0..grid.sides[0], 0..grid.sides[1]];
        grid.bury(all, &|cell| {
            let (normal, angle) = self.normals(&turn, cell);
            self.is_buried(normal, angle, neighbours, depth)
        });
        let level = |i: usize| (i as f64 + 0.5) / count as f64;
        let places = (0..count).map(|i| match self {
            Self::Sphere(_) => [level(i), (i as f64 * GOLDEN).fract()],
            Self::Lateral(..) => {
                [(level(i) + shift[0]).fract(), (i as f64 * GOLDEN + shift[1]).fract()]
            }
            Self::Triangle(..) => {
                let [s, t] = [0, 1].map(|k| (i as f64 * PLASTIC[k] + shift[k]).fract());
                // The sequence fills a parallelogram; its other half is reflected into the triangle.
                if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] }
            }
        });
        let places = places.filter(|&place| !grid.is_buried(place));
        let points = places.map(|place| (place, self.normal(&turn, place)));
        let points = points.filter(|&(_, normal)| !self.is_buried(normal, 0.0, neighbours, depth));
        points.map(|(place, normal)| [self.at(place, normal), normal]).collect()
    }

    /// The point at two coordinates from 0 to 1, of which equal areas of the square have equal areas of
    /// the surface. A sphere and a cone need the normal there.
    fn at(&self, [s, t]: [f64; 2], normal: Vec3) -> Vec3 {
        match self {
            Self::Sphere(m) => m.centre + m.radius * normal,
            Self::Lateral(a, b, _) => {
                // Area grows with the radius; this form does not cancel for equal radii.
                let sum = a.radius + b.radius;
                let radius = (a.radius * a.radius + s * (b.radius - a.radius) * sum).sqrt();
                let m = a.lerp(*b, s * sum / (a.radius + radius));
                m.centre + m.radius * normal
            }
            Self::Triangle([a, b, c], _) => *a + s * (*b - *a) + t * (*c - *a),
        }
    }

    /// The outward normal at such coordinates.
    fn normal(&self, turn: &DMat3, [s, t]: [f64; 2]) -> Vec3 {
        if let Self::Triangle(_, normal) = self {
            return *normal;
        }
        let (sin, cos) = (TAU * t).sin_cos();
        if let Self::Lateral(_, _, frame) = self {
            return frame.normal(cos * turn.x_axis + sin * turn.y_axis);
        }
        let z = 1.0 - 2.0 * s;
        let rho = ((1.0 - z) * (1.0 + z)).sqrt();
        *turn * Vec3::new(rho * cos, rho * sin, z)
    }

    /// Lengths along the coordinates, relative to each other, of cells that share a normal.
    fn lengths(&self) -> [f64; 2] {
        match self {
            Self::Sphere(_) => [PI, TAU],
            Self::Lateral(..) => [0.0, TAU],
            Self::Triangle(..) => [0.0; 2],
        }
    }

    /// The normal in the middle of a cell, and a bound on the angles of others to it.
    fn normals(&self, turn: &DMat3, [[s0, s1], [t0, t1]]: [[f64; 2]; 2]) -> (Vec3, f64) {
        let (s, t) = ((s0 + s1) / 2.0, (t0 + t1) / 2.0);
        let around = PI * (t1 - t0);
        let angle = match self {
            // Along the meridian to the middle, and from there along the circle.
            Self::Sphere(_) => {
                let [low, middle, high] = [s0, s, s1].map(|s| (1.0 - 2.0 * s).acos());
                (middle - low).max(high - middle) + around * middle.sin()
            }
            Self::Lateral(..) | Self::Triangle(..) => around,
        };
        (self.normal(turn, [s, t]), angle)
    }

    /// Whether a ball between this sphere or cone and one of some others holds all points whose normals
    /// are within an angle of `normal`, deeper than a limit.
    fn is_buried(&self, normal: Vec3, angle: f64, neighbours: &[Sphere], depth: f64) -> bool {
        let [a, b] = match self {
            Self::Sphere(m) => [m, m],
            Self::Lateral(a, b, _) => [a, b],
            Self::Triangle(..) => return false,
        };
        let radius = a.radius.min(b.radius);
        neighbours.iter().any(|c| {
            // On the way from the ball m of this surface to c, in steps k from 0 to 1, the depth of a
            // point with normal n in the ball grows by at least k * rise - k^2 |c - m|^2 / (2 r_m), with
            // rise = n * (c - m) + r_c - r_m. Along the line of a cone with this normal the rise is the same.
            let to = c.centre - a.centre;
            let up = normal.dot(to);
            let aside = (to - up * normal).length();
            let rise = up + c.radius - a.radius - angle * (aside + angle * up.abs() / 2.0);
            let square = to.length_squared().max((c.centre - b.centre).length_squared());
            let k = (rise * radius / square).min(1.0);
            rise > 0.0 && k * rise - k * k * square / (2.0 * radius) > depth
        })
    }
}

/// Cells of a patch. Points of a cell that another primitive contains need not be made.
struct Grid {
    sides: [usize; 2],
    /// Length of a cell along each coordinate.
    lengths: [f64; 2],
    buried: Vec<bool>,
}

impl Grid {
    /// Cells as square as possible.
    fn new(count: usize, mut lengths: [f64; 2]) -> Self {
        let mut sides = [1; 2];
        while sides[0] * sides[1] * CELL < count {
            let longer = usize::from(lengths[1] > lengths[0]);
            sides[longer] *= 2;
            lengths[longer] /= 2.0;
        }
        Self { sides, lengths, buried: vec![false; sides[0] * sides[1]] }
    }

    /// Marks the cells of a rectangle that are buried, from coarse to fine.
    fn bury(&mut self, cells: [Range<usize>; 2], is_buried: &impl Fn([[f64; 2]; 2]) -> bool) {
        let [rows, columns] = &cells;
        let place = |range: &Range<usize>, side: usize| {
            [range.start, range.end].map(|end| end as f64 / side as f64)
        };
        if is_buried([place(rows, self.sides[0]), place(columns, self.sides[1])]) {
            for row in rows.clone() {
                let start = row * self.sides[1];
                self.buried[start + columns.start..start + columns.end].fill(true);
            }
            return;
        }
        if rows.len() == 1 && columns.len() == 1 {
            return;
        }
        let [high, wide] = [0, 1].map(|k| cells[k].len() as f64 * self.lengths[k]);
        let split = usize::from(rows.len() == 1 || (columns.len() > 1 && wide > high));
        let Range { start, end } = cells[split];
        for half in [start..(start + end) / 2, (start + end) / 2..end] {
            let mut cells = cells.clone();
            cells[split] = half;
            self.bury(cells, is_buried);
        }
    }

    fn is_buried(&self, place: [f64; 2]) -> bool {
        let [row, column] =
            [0, 1].map(|k| ((place[k] * self.sides[k] as f64) as usize).min(self.sides[k] - 1));
        self.buried[row * self.sides[1] + column]
    }
}

/// Uniform over all rotations (Shoemake 1992, "Uniform random rotations", Graphics Gems III).
fn random_rotation(rng: &mut Pcg64) -> glam::DQuat {
    let [split, first, second] = [(); 3].map(|()| rng.random::<f64>());
    let (s1, c1) = (TAU * first).sin_cos();
    let (s2, c2) = (TAU * second).sin_cos();
    let (a, b) = ((1.0 - split).sqrt(), split.sqrt());
    glam::DQuat::from_xyzw(a * s1, a * c1, b * s2, b * c2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_and_points_that_are_not_searched_for_hold_no_samples() {
        let mut rng = Pcg64::seed_from_u64(5);
        let side = 5_u32;
        let mut ball = |k: u32| {
            let jitter = Vec3::from([(); 3].map(|()| 0.05 * rng.random::<f64>()));
            let at = 0.2 * Vec3::new(f64::from(k % side), f64::from(k / side), 0.0);
            Sphere::new(at + jitter, 0.2 + 0.1 * rng.random::<f64>())
        };
        let spheres = (0..side * side).map(&mut ball).collect();
        let corners = (0..side * (side - 1)).filter(|k| k % side < side - 1);
        let faces =
            corners.flat_map(|k| [[k, k + 1, k + side], [k + 1, k + side, k + side + 1]]).collect();
        let mesh = MedialMesh::from_simplices(spheres, vec![], faces).unwrap();
        let union = MedialUnion::new(&mesh).unwrap();
        let pose = Pose::coordinates();
        for burial in [0.0, 1e-7, 1e-2] {
            let options = EnvelopeOptions { samples: 1000, burial, seed: 1 };
            let mut patches = patches(&mesh, &pose);
            let sampled = |patches: &[Patch]| {
                let Weighted { points, weights } =
                    sample_patches(patches, pose.axes(), 2_000.0, &union, &options);
                (points, weights)
            };
            let some = sampled(&patches);
            patches.iter_mut().for_each(|patch| patch.neighbours.clear());
            assert!(some == sampled(&patches) && some.0.len() > 1000);
        }
    }
}
