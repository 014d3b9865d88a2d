//! A medial axis as a set of spheres: points `(x, y, z, r)` of four-dimensional space.
//!
//! Triangles, segments and points are found through a tree of their boxes in space. Space is a
//! projection of the four dimensions, so a box is never farther than its contents.

use std::ops::Range;

use glam::DVec4;
use rayon::prelude::*;

use crate::Vec3;
use crate::complex::Sphere;
use crate::geometry::trees::{Bounds, Node, Plan, Search, Tree};

/// Squared sine of the angle of two sides, below which only the sides of a triangle are measured.
const MIN_SINE_SQUARED: f64 = 1e-24;

/// The sphere as a point.
pub(super) fn lifted(sphere: &Sphere) -> DVec4 {
    sphere.centre.extend(sphere.radius)
}

/// Simplices in space and radius, prepared for distance queries.
pub(super) struct LiftedAxis {
    tree: Tree,
    /// In leaf order. A segment repeats a corner, a point is three times the same.
    simplices: Vec<[DVec4; 3]>,
}

impl LiftedAxis {
    pub fn new(simplices: &[[DVec4; 3]]) -> Self {
        let bounds = |s: &[DVec4; 3]| (Bounds::of_points(s.map(DVec4::truncate)), 0.0);
        let boxes: Vec<_> = simplices.iter().map(bounds).collect();
        let tree = Tree::build(&boxes, Plan { max_leaf: 4, group: 1, padding: 0.0 });
        let simplices = tree.order().iter().map(|&s| simplices[s as usize]).collect();
        Self { tree, simplices }
    }

    /// Distances of some points, in their order, in parallel. Faster if each point is close to the one
    /// before, because that one's nearest simplex is tried first.
    pub fn distances(&self, points: &[DVec4]) -> Vec<f64> {
        let along = |chunk: &[DVec4]| {
            let mut nearest = None;
            let distance = |&p: &DVec4| {
                let mut search = Nearest::of(self, p);
                if let Some(last) = nearest {
                    search.visit(last..last + 1);
                }
                self.tree.search(&mut search);
                nearest = search.simplex;
                search.distance
            };
            chunk.iter().map(distance).collect::<Vec<f64>>()
        };
        points.par_chunks(256).flat_map_iter(along).collect()
    }
}

struct Nearest<'a> {
    axis: &'a LiftedAxis,
    p: DVec4,
    place: Vec3,
    distance: f64,
    /// The simplex at that distance.
    simplex: Option<usize>,
    /// From the point to the nearest one of that simplex.
    to: DVec4,
}

impl<'a> Nearest<'a> {
    fn of(axis: &'a LiftedAxis, p: DVec4) -> Self {
        let distance = f64::INFINITY;
        Self { axis, p, place: p.truncate(), distance, simplex: None, to: DVec4::ZERO }
    }

    /// Whether all corners, and so the simplex, lie beyond the plane through the nearest point so far
    /// orthogonal to the direction to it. Then the simplex is no nearer, and need not be measured.
    #[inline]
    fn is_beyond(&self, corners: &[DVec4; 3]) -> bool {
        let squared = self.distance * self.distance;
        corners.iter().all(|&corner| (corner - self.p).dot(self.to) >= squared)
    }
}

impl Search for Nearest<'_> {
    #[inline]
    fn bound(&self, node: &Node) -> f64 {
        node.bounds.distance_squared(self.place).sqrt()
    }

    #[inline]
    fn limit(&self) -> f64 {
        self.distance
    }

    fn visit(&mut self, places: Range<usize>) {
        for simplex in places {
            let corners = &self.axis.simplices[simplex];
            if self.simplex.is_some() && self.is_beyond(corners) {
                continue;
            }
            let to = towards(self.p, corners);
            let distance = to.length();
            if distance < self.distance {
                (self.distance, self.simplex, self.to) = (distance, Some(simplex), to);
            }
        }
    }
}

/// The vector from a point to the nearest point of a triangle, degenerate or not.
#[inline]
fn towards(p: DVec4, &[a, b, c]: &[DVec4; 3]) -> DVec4 {
    let (u, v, w) = (b - a, c - a, p - a);
    let [uu, uv, vv] = [u.dot(u), u.dot(v), v.dot(v)];
    let [wu, wv] = [w.dot(u), w.dot(v)];
    let determinant = uu * vv - uv * uv;
    if determinant > MIN_SINE_SQUARED * uu * vv {
        let (s, t) = ((wu * vv - wv * uv) / determinant, (wv * uu - wu * uv) / determinant);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            return s * u + t * v - w;
        }
    }
    let shorter = |x: DVec4, y: DVec4| if y.length_squared() < x.length_squared() { y } else { x };
    let sides = shorter(towards_segment(p, a, b), towards_segment(p, c, a));
    shorter(sides, towards_segment(p, b, c))
}

/// The vector from a point to the nearest point of a segment.
#[inline]
fn towards_segment(p: DVec4, from: DVec4, to: DVec4) -> DVec4 {
    let (along, w) = (to - from, p - from);
    let squared = along.length_squared();
    let share = if squared > 0.0 { (w.dot(along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    share * along - w
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    /// Against the nearest of many points of each simplex.
    #[test]
    fn distances_match_dense_points() {
        let mut rng = Pcg64::seed_from_u64(4);
        let mut random = || DVec4::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
        let mut simplices: Vec<[DVec4; 3]> = (0..40).map(|_| [(); 3].map(|()| random())).collect();
        for k in 0..10 {
            simplices[k][2] = simplices[k][1];
            simplices[k / 2] = [simplices[k / 2][0]; 3];
        }
        let axis = LiftedAxis::new(&simplices);
        const STEPS: u32 = 100;
        for _ in 0..40 {
            let p = 1.5 * random();
            let told = axis.distances(&[p])[0];
            let mut dense = f64::INFINITY;
            for [a, b, c] in &simplices {
                for i in 0..=STEPS {
                    for j in 0..=STEPS - i {
                        let [s, t] = [i, j].map(|k| f64::from(k) / f64::from(STEPS));
                        dense = dense.min(p.distance(a + s * (b - a) + t * (c - a)));
                    }
                }
            }
            assert!(told <= dense + 1e-12 && dense - told < 0.01, "{told} for {dense}");
        }
    }
}
