//! Step 2: the sphere that fits the points of its cluster, by Gauss-Newton.
//!
//! A residual `rho(c, r)` of weight `w` has the Jacobian `-(n, k)`: `n_f` and 1 for the distance to a
//! plane, `(v - c) / |v - c|` and 1 for the distance to the sphere.

use medial::Vec3;
use medial::complex::Sphere;
use rayon::prelude::*;

use super::energy::Energy;
use super::points::{Locality, SurfacePoints};

/// Steps at most.
const STEPS: usize = 10;

/// Halvings of a step at most, until the sum of errors does not rise.
const HALVINGS: usize = 12;

/// Share of the largest diagonal element below which a pivot counts as zero.
const FLAT: f64 = 1e-14;

/// What is minimised.
pub(super) enum Residuals {
    /// The energy as written.
    Energy(Energy),
    /// What both programs minimise: for each point one residual, a weighted sum of distances to planes, and
    /// the Euclidean one with the square of `lambda`.
    Published { sums: Vec<PlaneSum>, energy: Energy },
}

/// A sum of plane distances, `level - normal . c - ties r`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PlaneSum {
    normal: Vec3,
    ties: f64,
    level: f64,
}

impl PlaneSum {
    fn add(&mut self, weight: f64, normal: Vec3, point: Vec3) {
        self.normal += weight * normal;
        self.ties += weight;
        self.level += weight * normal.dot(point);
    }
}

impl Residuals {
    /// The residuals of the published programs: `sum_f sqrt(a_f / 3) (n_f . (v - c) - r)` for a vertex
    /// (the authors); for a sample the sum over itself and its nearest ones, so over itself twice, with
    /// weights `sqrt(a) / (k + 1)` (CGAL).
    pub fn published(points: &SurfacePoints, energy: Energy) -> Self {
        let own = |v: usize, factor: f64, sum: &mut PlaneSum| {
            for plane in points.planes(v) {
                let weight = factor * (points.areas[v] * plane.share).sqrt();
                sum.add(weight, plane.normal, points.positions[v]);
            }
        };
        let of_point = |v: usize| {
            let mut sum = PlaneSum::default();
            match &points.local {
                Locality::Faces(_) => own(v, 1.0, &mut sum),
                Locality::Nearest { count, ids } => {
                    let factor = 1.0 / (count + 1) as f64;
                    own(v, factor, &mut sum);
                    for &near in &ids[v * count..(v + 1) * count] {
                        own(near as usize, factor, &mut sum);
                    }
                }
            }
            sum
        };
        let sums = (0..points.len()).into_par_iter().map(of_point).collect();
        Self::Published { sums, energy }
    }
}

/// The sphere that minimises the sum over a cluster, from `start`: at most [`STEPS`] steps, until one is shorter
/// than `shortest`. A step is halved while the sum would rise.
pub(super) fn refit(
    points: &SurfacePoints,
    residuals: &Residuals,
    cluster: &[u32],
    start: Sphere,
    shortest: f64,
) -> Sphere {
    let system = |s: &Sphere| System::of(points, residuals, cluster, s);
    let (mut sphere, mut here) = (start, system(&start));
    for _ in 0..STEPS {
        let Some(mut step) = here.solved() else { break };
        let mut next = moved(&sphere, &step);
        let mut there = system(&next);
        for _ in 0..HALVINGS {
            if there.sum <= here.sum {
                break;
            }
            step = step.map(|x| 0.5 * x);
            next = moved(&sphere, &step);
            there = system(&next);
        }
        // Not less than: a sum that is not a number ends the search too.
        if !(there.sum <= here.sum) {
            break;
        }
        (sphere, here) = (next, there);
        if step.iter().map(|x| x * x).sum::<f64>() < shortest * shortest {
            break;
        }
    }
    sphere
}

fn moved(s: &Sphere, step: &[f64; 4]) -> Sphere {
    Sphere::new(s.centre + Vec3::new(step[0], step[1], step[2]), s.radius + step[3])
}

/// The normal equations of a Gauss-Newton step, and the sum of squares where it starts.
#[derive(Clone, Copy, Debug, Default)]
struct System {
    /// Lower triangle, row by row.
    matrix: [[f64; 4]; 4],
    right: [f64; 4],
    sum: f64,
}

impl System {
    /// In the order of the cluster, so that the sums are the same with any number of threads.
    fn of(points: &SurfacePoints, residuals: &Residuals, cluster: &[u32], s: &Sphere) -> Self {
        let mut system = Self::default();
        for &v in cluster {
            let v = v as usize;
            let (u, area) = (points.positions[v] - s.centre, points.areas[v]);
            let weight = match residuals {
                Residuals::Energy(energy) => {
                    for plane in points.planes(v) {
                        let rest = plane.normal.dot(u) - s.radius;
                        system.add(plane.normal, 1.0, rest, area * plane.share);
                    }
                    energy.lambda
                }
                Residuals::Published { sums, energy } => {
                    let PlaneSum { normal, ties, level } = sums[v];
                    system.add(normal, ties, level - normal.dot(s.centre) - ties * s.radius, 1.0);
                    energy.lambda * energy.lambda
                }
            };
            let distance = u.length();
            // At the centre itself no direction is the nearest.
            let direction = if distance > 0.0 { u / distance } else { Vec3::ZERO };
            system.add(direction, 1.0, distance - s.radius, weight * area);
        }
        system
    }

    #[inline]
    fn add(&mut self, normal: Vec3, ties: f64, rest: f64, weight: f64) {
        let row = [normal.x, normal.y, normal.z, ties];
        for i in 0..4 {
            let scaled = weight * row[i];
            for j in 0..=i {
                self.matrix[i][j] += scaled * row[j];
            }
            self.right[i] += scaled * rest;
        }
        self.sum += weight * rest * rest;
    }

    /// The step, by a factorisation `L D L^T`; `None` where the points leave the sphere undetermined.
    fn solved(&self) -> Option<[f64; 4]> {
        let largest = (0..4).map(|i| self.matrix[i][i]).fold(0.0, f64::max);
        let mut factor = self.matrix;
        let mut pivots = [0.0; 4];
        for j in 0..4 {
            let before: f64 = (0..j).map(|k| factor[j][k] * factor[j][k] * pivots[k]).sum();
            pivots[j] = self.matrix[j][j] - before;
            if !(pivots[j] > FLAT * largest) {
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
