//! What the refit minimises: the energy, or what the published programs minimise in its place.

use medial::Vec3;
use rayon::prelude::*;

use super::energy::Energy;
use super::params::Refit;
use super::points::{Locality, SurfacePoints};

/// The residuals of all points.
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
    pub normal: Vec3,
    pub ties: f64,
    pub level: f64,
}

impl PlaneSum {
    /// The distance to one plane.
    fn of(normal: Vec3, point: Vec3) -> Self {
        Self { normal, ties: 1.0, level: normal.dot(point) }
    }

    fn add(&mut self, weight: f64, normal: Vec3, point: Vec3) {
        self.normal += weight * normal;
        self.ties += weight;
        self.level += weight * normal.dot(point);
    }
}

impl Residuals {
    /// Those that a parameter names.
    pub fn new(points: &SurfacePoints, energy: Energy, refit: Refit) -> Self {
        match refit {
            Refit::Energy => Self::Energy(energy),
            Refit::Published => Self::published(points, energy),
        }
    }

    /// `sum_f sqrt(a_f) (n_f . (v - c) - r)` for a vertex (the authors); for a sample the sum over itself
    /// and its nearest ones, so over itself twice, with weights `sqrt(a) / (k + 1)` (CGAL).
    fn published(points: &SurfacePoints, energy: Energy) -> Self {
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

    /// The weight of the squared distance to the sphere, for each unit of area.
    pub fn euclidean(&self) -> f64 {
        match self {
            Self::Energy(energy) => energy.lambda,
            Self::Published { energy, .. } => energy.lambda * energy.lambda,
        }
    }

    /// The linear residuals of a point, with their weights.
    #[inline]
    pub fn each_plane(
        &self,
        points: &SurfacePoints,
        v: usize,
        mut take: impl FnMut(PlaneSum, f64),
    ) {
        match self {
            Self::Energy(_) => {
                for plane in points.planes(v) {
                    let distance = PlaneSum::of(plane.normal, points.positions[v]);
                    take(distance, points.areas[v] * plane.share);
                }
            }
            Self::Published { sums, .. } => take(sums[v], 1.0),
        }
    }
}
