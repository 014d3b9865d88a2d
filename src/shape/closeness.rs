//! Places where the start is far from the surface.
//!
//! 1. Spheres that reach beyond the surface.
//! 2. Samples that no sphere touches, far from the union.
//! 3. On coarse surfaces, places from which no way leads out of the union. Along its normal each of some samples of the surface
//!    looks for a point outside the union. The lengths of these ways halve, so that one ends in the middle third of any gap.
//!    A sample is far if no way that begins near it leads out: spheres fill the gap in front of it.

use rayon::prelude::*;

use super::{ADVICE, Shape};
use crate::Vec3;
use crate::complex::{MedialMesh, MedialUnion, Sphere, is_coarse};
use crate::geometry::VertexId;
use crate::metrics::place_on_triangles;
use crate::surface::{PointGrid, Sampling};

/// Distance between the start and the surface, as a fraction of the diagonal, that users are warned of.
const FAR: f64 = 0.02;

/// Number of spheres that share the deepest place found so far.
const CHUNK: usize = 4_096;

/// Samples of the surface from which ways out of the union are sought.
const SAMPLES: usize = 20_000;

/// Number of further samples. Those near a sample that is far are used.
const DENSE_SAMPLES: usize = 200_000;

/// Number of lengths of such ways, from [`FAR`] down to 2e-5.
const WAYS: i32 = 11;

impl Shape {
    /// A sentence for each kind of places where the conforming start is farther than 2 % of the diagonal from the surface.
    pub(super) fn far_places(&self) -> Vec<String> {
        let Sampling::Conforming { .. } = self.options().sampling else { return Vec::new() };
        let Some((Ok([_, start]), _)) = self.store.of_samples.medial.get() else {
            return Vec::new();
        };
        let is_coarse = is_coarse(&self.store.mesh);
        let bare = self.bare_samples().unwrap_or_default();
        let union = (is_coarse || !bare.is_empty()).then(|| MedialUnion::new(start).ok()).flatten();
        let bareness = union.as_ref().map(|union| farthest(union, &bare));
        let depth = union.as_ref().filter(|_| is_coarse).map(|union| self.depth_of_filling(union));
        let sentences = [
            (self.reach(start), "spheres of the initial medial mesh reach", "beyond the surface"),
            (bareness, "parts of the surface are up to", "away from the initial medial mesh"),
            (
                depth,
                "spheres of the initial medial mesh fill gaps: parts of the surface are",
                "away from the nearest opening",
            ),
        ];
        let far = sentences.into_iter().filter_map(|(far, what, whence)| {
            let percent = 100.0 * far.filter(|&far| far > FAR)?;
            Some(format!("{what} {percent:.1} % of the diagonal {whence}; {ADVICE}"))
        });
        far.collect()
    }

    /// Largest distance by which a sphere of the start reaches beyond the surface.
    fn reach(&self, start: &MedialMesh) -> Option<f64> {
        let tree = self.surface_tree().ok()?;
        let deepest = |spheres: &[Sphere]| {
            spheres.iter().fold(0.0, |reach: f64, sphere| {
                let nearest = tree.closest_within_from(sphere.centre, sphere.radius - reach, None);
                nearest.map_or(reach, |nearest| reach.max(sphere.radius - nearest.distance))
            })
        };
        Some(start.spheres.par_chunks(CHUNK).map(deepest).reduce(|| 0.0, f64::max))
    }

    /// Samples that no sphere touches, far from all that one does.
    fn bare_samples(&self) -> Option<Vec<Vec3>> {
        let of_samples = &self.store.of_samples;
        let delaunay = &of_samples.delaunay.get()?.0.as_ref().ok()?.delaunay;
        let is_touched = of_samples.cells.get()?.0.as_ref().ok()?.touched(delaunay);
        let points = || (0..).zip(&is_touched).map(|(v, &is)| (delaunay.point(VertexId(v)), is));
        let touched: Vec<Vec3> = points().filter(|&(_, is)| is).map(|(p, _)| p).collect();
        let near = grid(&touched);
        let bare = points().filter(|&(p, is)| !is && !near.any_within(p, FAR));
        Some(bare.map(|(p, _)| p).collect())
    }

    /// Largest distance of a sample from which no way leads out of the union to one from which one does.
    fn depth_of_filling(&self, union: &MedialUnion) -> f64 {
        let mesh = &*self.store.mesh;
        let triangles: Vec<[Vec3; 3]> = (0..mesh.faces.len()).map(|f| mesh.triangle(f)).collect();
        let samples = |count| {
            let places = place_on_triangles(&triangles, count, 0).unwrap_or_default();
            places.into_iter().map(|(face, at)| {
                let [a, b, c] = triangles[face];
                (at, (b - a).cross(c - a).normalize_or_zero())
            })
        };
        let (mut open, buried) = by_ways_out(union, samples(SAMPLES).collect());
        let far_from = |open: &[Vec3], buried: Vec<Vec3>| -> Vec<Vec3> {
            let near = grid(open);
            buried.into_iter().filter(|&p| !near.any_within(p, FAR)).collect()
        };
        let mut far = far_from(&open, buried);
        if !far.is_empty() {
            let near = grid(&far);
            let around = samples(DENSE_SAMPLES).filter(|&(p, _)| near.any_within(p, FAR));
            open.extend(by_ways_out(union, around.collect()).0);
            far = far_from(&open, far);
        }
        let distances = far.par_iter().map(|p| {
            let squared = open.iter().map(|q| p.distance_squared(*q));
            squared.fold(f64::INFINITY, f64::min).sqrt()
        });
        distances.reduce(|| 0.0, f64::max).min(1.0)
    }
}

/// Points of the surface with outward normals: those from which a way leads out of the union, and the others.
fn by_ways_out(union: &MedialUnion, mut buried: Vec<(Vec3, Vec3)>) -> (Vec<Vec3>, Vec<Vec3>) {
    let mut open = Vec::new();
    let lengths = (0..WAYS).map(|k| FAR * 0.5_f64.powi(k));
    for length in [0.0].into_iter().chain(lengths) {
        let ends: Vec<Vec3> = buried.iter().map(|(p, outward)| *p + length * *outward).collect();
        let mut is_out = union.signed_batch(&ends).into_iter().map(|distance| distance >= 0.0);
        buried.retain(|&(p, _)| {
            let is_out = is_out.next() == Some(true);
            if is_out {
                open.push(p);
            }
            !is_out
        });
    }
    (open, buried.into_iter().map(|(p, _)| p).collect())
}

fn grid(points: &[Vec3]) -> PointGrid {
    let mut grid = PointGrid::new(FAR);
    points.iter().for_each(|&p| grid.insert(p));
    grid
}

/// Largest distance of some points from a union.
fn farthest(union: &MedialUnion, points: &[Vec3]) -> f64 {
    union.signed_batch(points).into_iter().fold(0.0, f64::max)
}
