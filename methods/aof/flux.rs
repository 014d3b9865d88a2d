//! The average outward flux through one sphere, without two-sided fans.
//!
//! With `g` the gradient of the distance at a sample and `a = g . N`:
//!
//! - Closest point on a face, a flat or a convex edge: the sample adds `a`.
//! - Closest point `B` on a concave edge or vertex, a *fan*. Its opposite `p' = p - 2 sigma a g` lies
//!   on the line through `B` and `p`.
//!   - `a >= 0`: `p'` lies between `B` and `p`, and so has the same closest point; two-sided.
//!   - `a < 0`: `p'` lies beyond `p`. The closest point of `p'` is on the same straight edge only if
//!     it is `B` itself, since `B` is the foot of the perpendicular from both. So the fan is
//!     two-sided if and only if no point of the surface is nearer to `p'` than `B`.
//!
//!   A two-sided sample adds nothing; a one-sided one adds `a`.
//!
//! The sum is divided by the number of all samples.

use medial::Vec3;
use medial::geometry::{NearBatch, NearSet, NearbyTriangles};

use super::spiral::Spiral;

/// Relative to the distance, how much nearer the surface must be for it to be another point.
const SAME: f64 = 1e-10;

/// The samples of one level.
#[derive(Clone, Debug)]
pub struct Sphere {
    /// Unit vectors.
    pub directions: Vec<Vec3>,
    /// `sigma`.
    pub radius: f64,
    /// Length of the mean of the unit vectors: what a constant field's flux is off by at most.
    pub bias: f64,
}

/// Buffers for the flux, reused from voxel to voxel.
#[derive(Clone, Debug)]
pub struct Probe<'a> {
    sphere: &'a Sphere,
    samples: NearBatch,
    opposite: NearBatch,
    /// For each opposite its `a`.
    inward: Vec<f64>,
}

impl Sphere {
    /// `count` samples on a sphere of radius `sigma`.
    pub fn new(spiral: Spiral, count: usize, radius: f64) -> Self {
        let directions = spiral.directions(count);
        let bias = directions.iter().sum::<Vec3>().length() / count as f64;
        Self { directions, radius, bias }
    }
}

impl<'a> Probe<'a> {
    /// Buffers for spheres of one radius.
    pub fn new(sphere: &'a Sphere) -> Self {
        let mut samples = NearBatch::default();
        for &direction in &sphere.directions {
            samples.push(direction * sphere.radius, f64::INFINITY);
        }
        Self { sphere, samples, opposite: NearBatch::default(), inward: Vec::new() }
    }

    /// `AOF'` through the sphere around the centre of a set, whose reach is at least the radius.
    pub fn flux(&mut self, triangles: &NearbyTriangles, set: &NearSet) -> f64 {
        self.samples.reset();
        self.opposite.clear();
        self.inward.clear();
        triangles.closest(set, &mut self.samples);
        let mut sum = 0.0;
        for (k, &normal) in self.sphere.directions.iter().enumerate() {
            let Some(near) = triangles.answer(set, &self.samples, k) else {
                continue;
            };
            let along = near.gradient.dot(normal);
            if !near.on_fan {
                sum += along;
            } else if along < 0.0 {
                let step = -2.0 * self.sphere.radius * along;
                let opposite = normal * self.sphere.radius + near.gradient * step;
                self.opposite.push(opposite, (near.distance + step) * (1.0 - SAME));
                self.inward.push(along);
            }
        }
        if !self.opposite.is_empty() {
            triangles.closest(set, &mut self.opposite);
            for (k, along) in self.inward.iter().enumerate() {
                if self.opposite.is_nearer(k) {
                    sum += along;
                }
            }
        }
        sum / self.sphere.directions.len() as f64
    }
}
