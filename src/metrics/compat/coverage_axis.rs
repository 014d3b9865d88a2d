//! Distances between the *vertices* of two meshes, as the evaluation scripts of Coverage Axis measure them.
//!
//! Z. Dou, C. Lin, R. Xu, L. Yang, S. Xin, T. Komura, W. Wang, "Coverage Axis: Inner Point Selection for 3D Shape
//! Skeletonization", Computer Graphics Forum 41 (2022), <https://doi.org/10.1111/cgf.14484>; the definitions are those
//! of the authors' `Geometry_Tools/metrics.py`.
//!
//! - *Chamfer*: the mean over the vertices of the first of the distance to the nearest vertex of the second, plus the
//!   same the other way; neither squared nor halved.
//! - *Hausdorff*: the larger of the two maxima. A helper there swaps its arguments twice and so returns one direction
//!   only; which of the two made the published tables is not known. Both directions are given.
//!
//! # Deviations from the code
//! None in the numbers. What is compared differs: the authors remesh the union with Blender's voxels (0.09 in the
//! unit of the file), or take unmerged hulls with buried vertices; here it is any mesh.
//!
//! # Trap
//! Vertices are no surface: two triangulations of the same sphere are a few per cent of its diagonal apart.

use serde::Serialize;

use super::{Spread, nearest};
use crate::Vec3;

/// Distances between two sets of vertices, in their unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VertexDistances {
    /// The larger of the two directed maxima.
    pub hausdorff: f64,
    /// The sum of the two directed means.
    pub chamfer: f64,
    /// Largest distance from a vertex of the first to the second.
    pub there_max: f64,
    /// Largest distance from a vertex of the second to the first.
    pub back_max: f64,
    /// Mean distance from the first to the second.
    pub there_mean: f64,
    /// Mean distance from the second to the first.
    pub back_mean: f64,
}

/// Distances between two sets of vertices, in their unit; `None` when one is empty or has a vertex that is not finite.
///
/// # Cost
/// `O((n + m) log(n + m))`.
///
/// ```
/// use medial::{Vec3, metrics::compat::ca_vertex_distances};
///
/// let distances = ca_vertex_distances(&[Vec3::ZERO, Vec3::X], &[Vec3::ZERO]).expect("vertices");
/// assert_eq!((distances.hausdorff, distances.chamfer), (1.0, 0.5));
/// assert_eq!(distances.back_max, 0.0);
/// ```
pub fn ca_vertex_distances(first: &[Vec3], second: &[Vec3]) -> Option<VertexDistances> {
    let directed = |from: &[Vec3], to: &[Vec3]| {
        let distances: Vec<f64> =
            nearest(to, from.iter().copied())?.into_iter().map(|(_, far)| far).collect();
        Spread::of(&distances)
    };
    let (there, back) = (directed(first, second)?, directed(second, first)?);
    Some(VertexDistances {
        hausdorff: there.max.max(back.max),
        chamfer: there.mean + back.mean,
        there_max: there.max,
        back_max: back.max,
        there_mean: there.mean,
        back_mean: back.mean,
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// The unit sphere by halving the edges of an icosahedron three times: 642 vertices.
    fn icosphere() -> Vec<Vec3> {
        let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
        let corner = |k: usize| {
            let (s, t) = ([1.0, -1.0][k & 1], [golden, -golden][k >> 1 & 1]);
            let p = [[0.0, s, t], [s, t, 0.0], [t, 0.0, s]][k >> 2];
            Vec3::from(p)
        };
        let corners: Vec<Vec3> = (0..12).map(corner).collect();
        let near = |a: Vec3, b: Vec3| a.distance_squared(b) < 4.5;
        let mut faces = Vec::new();
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    let [p, q, r] = [a, b, c].map(|k| corners[k]);
                    if near(p, q) && near(q, r) && near(p, r) {
                        faces.push([p, q, r].map(Vec3::normalize));
                    }
                }
            }
        }
        for _ in 0..3 {
            let quarters = |[a, b, c]: [Vec3; 3]| {
                let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            };
            faces = faces.into_iter().flat_map(quarters).collect();
        }
        let mut points: Vec<Vec3> = faces.into_iter().flatten().collect();
        points.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).expect("finite"));
        points.dedup_by(|a, b| a.distance(*b) < 1e-9);
        // The same point by two ways may be sorted apart.
        let mut once: Vec<Vec3> = Vec::new();
        for p in points {
            if once.iter().all(|q| q.distance(p) > 1e-9) {
                once.push(p);
            }
        }
        once
    }

    /// The unit sphere by latitude and longitude.
    fn globe(rings: usize, around: usize) -> Vec<Vec3> {
        let mut points = vec![Vec3::Z, -Vec3::Z];
        for i in 1..rings {
            for j in 0..around {
                let (t, p) = (PI * i as f64 / rings as f64, 2.0 * PI * j as f64 / around as f64);
                points.push(Vec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos()));
            }
        }
        points
    }

    /// The trap: the same sphere, tessellated twice, 2.7 % of the diagonal apart.
    #[test]
    fn vertices_are_no_surface() {
        let (first, second) = (icosphere(), globe(31, 64));
        assert_eq!((first.len(), second.len()), (642, 1922));
        let diagonal = 12.0_f64.sqrt();
        let VertexDistances { hausdorff, chamfer, .. } =
            ca_vertex_distances(&first, &second).unwrap();
        assert!((hausdorff / diagonal - 0.027).abs() < 0.002, "{}", hausdorff / diagonal);
        assert!((chamfer / diagonal - 0.025).abs() < 0.002, "{}", chamfer / diagonal);
        let none = ca_vertex_distances(&first, &first).unwrap();
        assert_eq!((none.hausdorff, none.chamfer), (0.0, 0.0));
    }

    #[test]
    fn distances_are_those_of_looking_at_all_and_scale() {
        let (first, second) = (icosphere(), globe(7, 9));
        let far =
            |p: Vec3, to: &[Vec3]| to.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
        let there: Vec<f64> = first.iter().map(|&p| far(p, &second)).collect();
        let back: Vec<f64> = second.iter().map(|&p| far(p, &first)).collect();
        let found = ca_vertex_distances(&first, &second).unwrap();
        let mean = |d: &[f64]| d.iter().sum::<f64>() / d.len() as f64;
        assert!((found.chamfer - mean(&there) - mean(&back)).abs() < 1e-12);
        assert!((found.there_max - there.iter().copied().fold(0.0, f64::max)).abs() < 1e-12);
        assert!((found.back_max - back.iter().copied().fold(0.0, f64::max)).abs() < 1e-12);
        assert_eq!(found.hausdorff, found.there_max.max(found.back_max));
        let swapped = ca_vertex_distances(&second, &first).unwrap();
        assert_eq!((swapped.hausdorff, swapped.there_max), (found.hausdorff, found.back_max));
        let times = |points: &[Vec3]| points.iter().map(|&p| p * 4.0).collect::<Vec<_>>();
        let large = ca_vertex_distances(&times(&first), &times(&second)).unwrap();
        assert!((large.hausdorff - 4.0 * found.hausdorff).abs() < 1e-12);
        assert!((large.chamfer - 4.0 * found.chamfer).abs() < 1e-12);
        assert_eq!(ca_vertex_distances(&first, &[]), None);
    }
}
