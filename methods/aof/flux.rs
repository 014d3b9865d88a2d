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
//! The sum is divided by the number of all samples. Where the surface that is near is one plane,
//! the gradient is the same everywhere, and need not be sampled.

use super::nearby::{NearBatch, NearSet, NearbyTriangles};
use medial::Vec3;

use super::spiral::Spiral;

/// The surface has another closest point only if it is nearer by this fraction of the distance.
const SAME: f64 = 1e-10;

/// The samples of one level.
#[derive(Clone, Debug)]
pub struct Sphere {
    /// Unit vectors.
    pub directions: Vec<Vec3>,
    /// `sigma`.
    pub radius: f64,
    /// Mean of the unit vectors: its product with a constant field is that field's flux.
    pub mean: Vec3,
    /// Length of the mean: the largest flux of a constant unit field, which should be 0.
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
        let mean = directions.iter().sum::<Vec3>() / count as f64;
        Self { directions, radius, mean, bias: mean.length() }
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
        if let Some(gradient) = triangles.constant_gradient(set) {
            return gradient.dot(self.sphere.mean);
        }
        self.samples.reset();
        self.opposite.clear();
        self.inward.clear();
        triangles.closest(set, &mut self.samples);
        let Self { sphere, samples, opposite, inward } = self;
        let mut beside_faces = 0.0;
        let inside_faces = triangles.sum_along(set, samples, |k, near| {
            let normal = sphere.directions[k];
            let along = near.gradient.dot(normal);
            if !near.on_fan {
                beside_faces += along;
            // For `along >= 0` the fan is two-sided and adds nothing, see the head.
            } else if along < 0.0 {
                let step = -2.0 * sphere.radius * along;
                let point = normal * sphere.radius + near.gradient * step;
                opposite.push(point, (near.distance + step) * (1.0 - SAME));
                inward.push(along);
            }
        });
        // Queries were `radius` times the unit directions.
        let mut sum = inside_faces / sphere.radius + beside_faces;
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
