//! Step 2: the sphere that fits the points of its cluster, by Gauss-Newton.
//!
//! A residual `rho(c, r)` of weight `w` has the Jacobian `-(n, k)`: `n_f` and 1 for the distance to a
//! plane, `(v - c) / |v - c|` and 1 for the distance to the sphere. The first kind is linear: its sum of
//! squares is one quadric in `s` for the whole cluster, made once. The second is summed again in each step,
//! four points at a time.

use medial::Vec3;
use medial::complex::Sphere;
use rayon::prelude::*;
use wide::f64x4;

use super::energy::Energy;
use super::points::{Locality, SurfacePoints, in_lanes};

/// Limit of the steps.
const STEPS: usize = 10;

/// Limit of the halvings of a step, until the sum of errors does not rise.
const HALVINGS: usize = 12;

/// Bound on the rounding error of a sum of errors, as a share of the sum of squared lengths in it.
const ROUNDING: f64 = 1e-14;

/// Share of the largest diagonal element below which a pivot counts as zero.
const FLAT: f64 = 1e-14;

/// Squared distance up to which a point gives no direction.
const NO_DIRECTION: f64 = 1e-300;

/// The sphere that minimises the sum over a cluster, from `start`: at most [`STEPS`] steps, until one is shorter
/// than `shortest`. A step is halved while the sum would rise.
pub(super) fn refit(
    points: &SurfacePoints,
    residuals: &Residuals,
    cluster: &[u32],
    start: Sphere,
    shortest: f64,
) -> Sphere {
    let sum = ClusterSum::new(points, residuals, cluster, start.centre);
    // Relative to the first centre, where the quadric loses the least to rounding.
    let mut at = [0.0, 0.0, 0.0, start.radius];
    let mut here = sum.system(&at);
    for _ in 0..STEPS {
        let Some(mut step) = here.solved() else { break };
        let mut next = moved(&at, &step);
        let mut there = sum.system(&next);
        for _ in 0..HALVINGS {
            if there.value <= here.value + sum.rounding {
                break;
            }
            step = step.map(|x| 0.5 * x);
            next = moved(&at, &step);
            there = sum.system(&next);
        }
        // A value that is not a number has not fallen either.
        let falls = there.value <= here.value + sum.rounding;
        if !falls {
            break;
        }
        (at, here) = (next, there);
        if step.iter().map(|x| x * x).sum::<f64>() < shortest * shortest {
            break;
        }
    }
    Sphere::new(start.centre + Vec3::new(at[0], at[1], at[2]), at[3])
}

fn moved(s: &[f64; 4], step: &[f64; 4]) -> [f64; 4] {
    [0, 1, 2, 3].map(|k| s[k] + step[k])
}

/// The normal equations of a Gauss-Newton step from a sphere, and the sum of squares there.
#[derive(Clone, Copy, Debug, Default)]
struct System {
    /// Its lower triangle.
    matrix: [[f64; 4]; 4],
    right: [f64; 4],
    value: f64,
}

/// The sum of squares that a refit minimises, relative to an origin.
struct ClusterSum {
    /// At the origin with the radius 0: the part of the planes.
    planes: System,
    /// Points in lanes of four; a lane without one has weight 0.
    points: Vec<[f64x4; 3]>,
    weights: Vec<f64x4>,
    /// Bound on the rounding error of a value.
    rounding: f64,
}

impl ClusterSum {
    /// In the order of the cluster, so that the sums are the same with any number of threads.
    fn new(points: &SurfacePoints, residuals: &Residuals, cluster: &[u32], origin: Vec3) -> Self {
        let mut planes = System::default();
        let mut squares = 0.0;
        let factor = residuals.euclidean;
        for &v in cluster {
            // The quadric is relative to `origin`, at the radius 0.
            let PlaneSum { normal, ties, level } = residuals.sums[v as usize];
            planes.add(normal, ties, level - normal.dot(origin));
            let position = points.positions[v as usize] - origin;
            squares += points.areas[v as usize] * position.length_squared();
        }
        let lanes = cluster.chunks(4).map(|four| {
            let position = [0, 1, 2].map(|axis| {
                in_lanes(four, 0.0, |&v| points.positions[v as usize][axis] - origin[axis])
            });
            (position, in_lanes(four, 0.0, |&v| factor * points.areas[v as usize]))
        });
        let (points, weights) = lanes.unzip();
        Self { planes, points, weights, rounding: ROUNDING * squares }
    }

    /// The step from a sphere and the value there.
    fn system(&self, s: &[f64; 4]) -> System {
        let mut system = self.planes.moved_to(s);
        let centre = [0, 1, 2].map(|k| f64x4::splat(s[k]));
        let radius = f64x4::splat(s[3]);
        let zero = f64x4::splat(0.0);
        // Sums of w d_i d_j in the lower triangle, of w d_i, of w, of w rho d_i, of w rho, of w rho^2.
        let (mut pairs, mut singles, mut all) = ([zero; 6], [zero; 3], zero);
        let (mut right, mut last, mut value) = ([zero; 3], zero, zero);
        for (point, &weight) in self.points.iter().zip(&self.weights) {
            let u = [0, 1, 2].map(|k| point[k] - centre[k]);
            let squared = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
            let distance = squared.sqrt();
            // At the centre itself no direction is the nearest: zero there.
            let inverse = f64x4::splat(1.0) / squared.max(f64x4::splat(NO_DIRECTION)).sqrt();
            let d = u.map(|x| x * inverse);
            let rest = distance - radius;
            let scaled = d.map(|x| weight * x);
            let weighted = weight * rest;
            for (pair, (i, j)) in
                [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)].into_iter().enumerate()
            {
                pairs[pair] += scaled[i] * d[j];
            }
            for k in 0..3 {
                singles[k] += scaled[k];
                right[k] += weighted * d[k];
            }
            all += weight;
            last += weighted;
            value += weighted * rest;
        }
        let pairs = pairs.map(f64x4::reduce_add);
        let singles = singles.map(f64x4::reduce_add);
        let rows = [
            [pairs[0], 0.0, 0.0, 0.0],
            [pairs[1], pairs[2], 0.0, 0.0],
            [pairs[3], pairs[4], pairs[5], 0.0],
            [singles[0], singles[1], singles[2], all.reduce_add()],
        ];
        for i in 0..4 {
            for j in 0..=i {
                system.matrix[i][j] += rows[i][j];
            }
            system.right[i] += if i < 3 { right[i].reduce_add() } else { last.reduce_add() };
        }
        system.value += value.reduce_add();
        system
    }
}

impl System {
    /// Adds a residual that is `rest` here.
    #[inline]
    fn add(&mut self, normal: Vec3, ties: f64, rest: f64) {
        let row = [normal.x, normal.y, normal.z, ties];
        for i in 0..4 {
            for j in 0..=i {
                self.matrix[i][j] += row[i] * row[j];
            }
            self.right[i] += row[i] * rest;
        }
        self.value += rest * rest;
    }

    /// The same linear residuals `y` farther: `s^T A s - 2 b . s + c` in the paper's words.
    fn moved_to(&self, y: &[f64; 4]) -> Self {
        // Only the lower triangle is filled.
        let image = [0, 1, 2, 3]
            .map(|i| (0..4).map(|j| self.matrix[i.max(j)][i.min(j)] * y[j]).sum::<f64>());
        let [quadratic, linear] =
            [&image, &self.right].map(|x| (0..4).map(|k| x[k] * y[k]).sum::<f64>());
        Self {
            matrix: self.matrix,
            right: [0, 1, 2, 3].map(|k| self.right[k] - image[k]),
            value: self.value - 2.0 * linear + quadratic,
        }
    }

    /// The step, by a factorisation `L D L^T`; `None` where the points leave the sphere undetermined.
    fn solved(&self) -> Option<[f64; 4]> {
        let largest = (0..4).map(|i| self.matrix[i][i]).fold(0.0, f64::max);
        let mut factor = self.matrix;
        let mut pivots = [0.0; 4];
        for j in 0..4 {
            let before: f64 = (0..j).map(|k| factor[j][k] * factor[j][k] * pivots[k]).sum();
            pivots[j] = self.matrix[j][j] - before;
            // Written so that a pivot that is not a number fails too.
            let is_positive = pivots[j] > FLAT * largest;
            if !is_positive {
                return None;
            }
            for i in j + 1..4 {
                let before: f64 = (0..j).map(|k| factor[i][k] * factor[j][k] * pivots[k]).sum();
                factor[i][j] = (self.matrix[i][j] - before) / pivots[j];
            }
        }
        let mut x = self.right;
        for i in 0..4 {
            x[i] -= (0..i).map(|k| factor[i][k] * x[k]).sum::<f64>();
        }
        for i in 0..4 {
            x[i] /= pivots[i];
        }
        for i in (0..4).rev() {
            x[i] -= (i + 1..4).map(|k| factor[k][i] * x[k]).sum::<f64>();
        }
        x.iter().all(|x| x.is_finite()).then_some(x)
    }
}

// ----------------------------------------------------------------------------
// The objective of the refit: that of the published programs.

/// The residuals of all points: for each point one weighted sum of distances to planes, and the Euclidean
/// one with the square of `lambda`.
pub(super) struct Residuals {
    sums: Vec<PlaneSum>,
    /// Weight of the squared distance to the sphere, for each unit of area.
    euclidean: f64,
}

/// A sum of plane distances, `level - normal . c - ties r`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PlaneSum {
    pub normal: Vec3,
    pub ties: f64,
    pub level: f64,
}

impl PlaneSum {
    /// Adds the planes of a point, each weighted by the root of its area times a factor.
    fn add_planes(&mut self, points: &SurfacePoints, v: usize, factor: f64) {
        for plane in points.planes(v) {
            let weight = factor * (points.areas[v] * plane.share).sqrt();
            self.normal += weight * plane.normal;
            self.ties += weight;
            self.level += weight * plane.normal.dot(points.positions[v]);
        }
    }
}

impl Residuals {
    /// `sum_f sqrt(a_f) (n_f . (v - c) - r)` for a vertex (the authors); for a sample the sum over itself
    /// and its nearest ones, so over itself twice, with weights `sqrt(a) / (k + 1)` (CGAL).
    pub fn new(points: &SurfacePoints, energy: Energy) -> Self {
        let sums = (0..points.len()).into_par_iter().map(|v| {
            let mut sum = PlaneSum::default();
            match &points.local {
                Locality::Edges => sum.add_planes(points, v, 1.0),
                Locality::Nearest { count, ids } => {
                    // The point itself is in its list, and counts twice, as in CGAL.
                    let factor = 1.0 / (count + 1) as f64;
                    sum.add_planes(points, v, factor);
                    for &near in &ids[v * count..(v + 1) * count] {
                        sum.add_planes(points, near as usize, factor);
                    }
                }
            }
            sum
        });
        Self { sums: sums.collect(), euclidean: energy.lambda * energy.lambda }
    }
}
