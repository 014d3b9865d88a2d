//! Samples of a surface, the same for every medial mesh that is measured against it.
//!
//! They are made in a frame of the surface ([`Pose`]) and in the order of a curve in it, so that
//! neither the orientation of the surface nor the order of its file matters. There is one exception:
//! if the surface is symmetric and the medial mesh is not, a turned input can get other samples.

use std::ops::{Add, Mul, Sub};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::MetricError;
use super::ascent::Start;
use super::pose::Pose;
use crate::Vec3;
use crate::complex::{MedialMesh, MedialUnion, UnionError};
use crate::sum::Sum;
use crate::surface::TriMesh;

/// Samples of a surface: the area-uniform ones first, then the vertices of its faces.
pub(super) struct SurfaceSamples {
    /// The frame in which they are laid out.
    pub pose: Pose,
    pub points: Vec<Vec3>,
    /// How many of them are area-uniform.
    pub uniform: usize,
    /// Typical distance between these.
    spacing: f64,
}

/// Number of samples from which an ascent starts.
pub(super) const SEEDS: usize = 72;

impl SurfaceSamples {
    /// `count` area-uniform samples of a surface, and its vertices. `O(n log n)`.
    pub fn new(surface: &TriMesh, count: usize, seed: u64) -> Result<Self, MetricError> {
        if count == 0 {
            return Err(MetricError::NoSamples("surface_samples"));
        }
        let pose = Pose::new(surface);
        let triangles = pose.triangles(surface);
        let mut points = sample_triangles(&triangles, count, seed).ok_or(MetricError::NoArea)?;
        let mut used = vec![false; surface.vertices.len()];
        for &v in surface.faces.iter().flatten() {
            used[v as usize] = true;
        }
        points.extend(surface.vertices.iter().zip(used).filter(|&(_, u)| u).map(|(&v, _)| v));
        let spacing = (area(surface) / count as f64).sqrt();
        Ok(Self { pose, points, uniform: count, spacing })
    }

    /// A medial mesh with its spheres in the order of the pose, and the union of its primitives.
    pub fn ordered(&self, mesh: &MedialMesh) -> Result<(MedialMesh, MedialUnion), MetricError> {
        mesh.check().map_err(UnionError::from)?;
        let ordered = self.pose.in_order(mesh);
        // A refusal names a sphere by its number in the mesh as it was given.
        let union = MedialUnion::new(&ordered).or_else(|_| MedialUnion::new(mesh))?;
        Ok((ordered, union))
    }

    /// An ascent from the largest of the values at the samples.
    pub fn start<'a>(&'a self, values: &'a [f64]) -> Start<'a> {
        let Self { pose, points, spacing, .. } = self;
        Start { pose, points, values, spacing: *spacing, seeds: SEEDS }
    }
}

/// The area of a surface.
fn area(surface: &TriMesh) -> f64 {
    let twice = |face: usize| {
        let [a, b, c] = surface.triangle(face);
        (b - a).cross(c - a).length()
    };
    let mut sum = Sum::default();
    (0..surface.faces.len()).for_each(|face| sum.add(0.5 * twice(face)));
    sum.value()
}

/// Makes the random numbers differ from those of [`crate::surface::sample`] with the same seed. A
/// medial mesh has no error at the samples that it was made from, so it must not be measured there.
const STREAM: u64 = 0x6d65_6173_7572_6521;

/// `count` points, uniform by area and stratified along the list of triangles; `None` when there
/// is no area or it is not finite.
///
/// Stratified, unlike the independent points of [`crate::surface::Sampling::AreaUniform`]: means
/// have less variance, and small parts are not missed by chance.
fn sample_triangles(triangles: &[[Vec3; 3]], count: usize, seed: u64) -> Option<Vec<Vec3>> {
    let placed = place_on_triangles(triangles, count, seed)?;
    Some(placed.iter().map(|placed| placed.on(triangles)).collect())
}

/// A point of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub triangle: usize,
    /// Weights of the second and third corner.
    weights: [f64; 2],
}

impl Placed {
    /// The point, for triangles in a space of any dimension.
    pub fn on<V>(&self, triangles: &[[V; 3]]) -> V
    where
        V: Copy + Add<Output = V> + Sub<Output = V> + Mul<f64, Output = V>,
    {
        let [a, b, c] = triangles[self.triangle];
        a + (b - a) * self.weights[0] + (c - a) * self.weights[1]
    }
}

/// As [`sample_triangles`], as places on the triangles.
pub(super) fn place_on_triangles(
    triangles: &[[Vec3; 3]],
    count: usize,
    seed: u64,
) -> Option<Vec<Placed>> {
    let area = |&[a, b, c]: &[Vec3; 3]| (b - a).cross(c - a).length() * 0.5;
    let total: f64 = triangles.iter().map(area).sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let mut rng = Pcg64::seed_from_u64(seed ^ STREAM);
    let mut placed = Vec::with_capacity(count);
    let (mut below, mut last) = (0.0, None);
    let mut target = rng.random::<f64>() / count as f64 * total;
    for (index, triangle) in triangles.iter().enumerate() {
        let size = area(triangle);
        below += size;
        while placed.len() < count && target < below {
            placed.push(uniform_in(index, &mut rng));
            target = (placed.len() as f64 + rng.random::<f64>()) / count as f64 * total;
        }
        if size > 0.0 {
            last = Some(index);
        }
    }
    // The running sum may end a rounding below the total.
    while let (true, Some(index)) = (placed.len() < count, last) {
        placed.push(uniform_in(index, &mut rng));
    }
    Some(placed)
}

fn uniform_in(triangle: usize, rng: &mut Pcg64) -> Placed {
    // The root makes the density uniform: it compensates for rows that widen away from a corner.
    let root = rng.random::<f64>().sqrt();
    let v = rng.random::<f64>();
    Placed { triangle, weights: [root * (1.0 - v), root * v] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{Sampling, sample};

    #[test]
    fn nothing_is_measured_where_it_was_sampled() {
        let surface = TriMesh {
            vertices: vec![Vec3::ZERO, Vec3::X, Vec3::ONE, Vec3::Y],
            faces: vec![[0, 1, 2], [0, 2, 3]],
        };
        let sampled = sample(&surface, &Sampling::AreaUniform { count: 500, seed: 3 });
        let measured = SurfaceSamples::new(&surface, 500, 3).unwrap();
        assert_eq!((measured.uniform, measured.points.len()), (500, 504));
        let apart = |p: &&Vec3| sampled.iter().all(|q| p.distance(*q) > 1e-9);
        assert_eq!(measured.points[..500].iter().filter(apart).count(), 500);
    }
}
