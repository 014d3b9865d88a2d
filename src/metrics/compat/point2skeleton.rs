//! CD and HD of reconstructions and of skeletons, as Point2Skeleton measures them.
//!
//! C. Lin, C. Li, Y. Liu, N. Chen, Y.-K. Choi, W. Wang, "Point2Skeleton: Learning Skeletal Representations from Point
//! Clouds", CVPR 2021, <https://arxiv.org/abs/2012.00230>; the sums are those of the authors' `DistFunc.py`, the
//! division by the counts is the first author's reply to a question about it.
//!
//! 1. The skeleton is sampled to `M` spheres: on faces as many as `A / (A + E)` of them, on edges without a face the
//!    rest, with the area `A` of all faces and `E` half the sum of the squared lengths of these edges; a face by its
//!    area, an edge by its square. On a face the weights are three random numbers over their sum, on an edge two:
//!    *not* uniform, denser in the middle.
//! 2. CD-Recon `= 1/N sum_p | |p - c_k(p)| - r_k(p) | + 1/M sum_k | min_p |c_k - p| - r_k |`, where `k(p)` is the
//!    nearest *centre*. HD-Recon is the larger of the two maxima.
//! 3. CD-MAT, HD-MAT: the same of centres and points without radii.
//!
//! # Deviations
//! - HD is not in the public code; a maximum in place of each mean is by analogy. Both directions are given.
//! - Without faces the code fails; here all samples are on edges. Without both, the spheres themselves are the
//!   samples. Spheres without an edge beside others are not sampled, as there.
//!
//! # Trap
//! The nearest centre is not the nearest sphere: with a large sphere beside a small one a point on the large one may
//! be measured against the small one.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;

use super::{Spread, nearest};
use crate::Vec3;
use crate::complex::{MedialMesh, Sphere};

/// A distance both ways, in the unit of its arguments.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TwoSided {
    /// Sum of the two means.
    pub cd: f64,
    /// The larger of the two maxima.
    pub hd: f64,
    /// Mean from the first argument to the second.
    pub there_mean: f64,
    /// Mean from the second to the first.
    pub back_mean: f64,
    /// Maximum from the first to the second.
    pub there_max: f64,
    /// Maximum from the second to the first.
    pub back_max: f64,
}

impl TwoSided {
    fn of(there: &[f64], back: &[f64]) -> Option<Self> {
        let (there, back) = (Spread::of(there)?, Spread::of(back)?);
        Some(Self {
            cd: there.mean + back.mean,
            hd: there.max.max(back.max),
            there_mean: there.mean,
            back_mean: back.mean,
            there_max: there.max,
            back_max: back.max,
        })
    }
}

/// Spheres on a medial mesh, by its faces and its edges without a face, radii interpolated; as many as asked, or the
/// spheres of the mesh where it has neither. In the unit of the mesh. `O(n log n)`.
///
/// # Panics
/// If the mesh is not in canonical form; see [`MedialMesh::check`].
pub fn p2s_sample_skeleton(mesh: &MedialMesh, count: usize, seed: u64) -> Vec<Sphere> {
    let edges = lone_edges(mesh);
    let centre = |v: u32| mesh.spheres[v as usize].centre;
    let area =
        |&[a, b, c]: &[u32; 3]| 0.5 * (centre(b) - centre(a)).cross(centre(c) - centre(a)).length();
    let square = |&[a, b]: &[u32; 2]| 0.5 * centre(a).distance_squared(centre(b));
    let areas = Weighted::new(mesh.faces.iter().map(area));
    let squares = Weighted::new(edges.iter().map(square));
    let total = areas.total() + squares.total();
    if !(total > 0.0 && total.is_finite()) {
        return mesh.spheres.clone();
    }
    let on_faces = (areas.total() / total * count as f64) as usize;
    let mut random = Pcg64::seed_from_u64(seed);
    // 53 random bits, spelled out so that the samples do not depend on a crate's version.
    let mut unit = move || (random.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64);
    let mut samples = Vec::with_capacity(count);
    for _ in 0..on_faces {
        let face = mesh.faces[areas.pick(unit())];
        samples.push(mixed(mesh, face, [unit(), unit(), unit()]));
    }
    // The share of faces is 1 to rounding where no edge has a length.
    for _ in on_faces..if squares.total() > 0.0 { count } else { on_faces } {
        let edge = edges[squares.pick(unit())];
        samples.push(mixed(mesh, edge, [unit(), unit()]));
    }
    samples
}

/// The sphere of some spheres, weighted by numbers over their sum.
fn mixed<const N: usize>(mesh: &MedialMesh, of: [u32; N], weights: [f64; N]) -> Sphere {
    let sum: f64 = weights.iter().sum();
    let mut sphere = Sphere::new(Vec3::ZERO, 0.0);
    for (v, weight) in of.into_iter().zip(weights) {
        let share = if sum > 0.0 { weight / sum } else { 1.0 / N as f64 };
        sphere.centre += mesh.spheres[v as usize].centre * share;
        sphere.radius += mesh.spheres[v as usize].radius * share;
    }
    sphere
}

fn lone_edges(mesh: &MedialMesh) -> Vec<[u32; 2]> {
    let mut has_face = vec![false; mesh.edges.len()];
    for &[a, b, c] in &mesh.faces {
        for side in [[a, b], [a, c], [b, c]] {
            let edge = mesh.edges.binary_search(&side).expect("a side of a face is an edge");
            has_face[edge] = true;
        }
    }
    mesh.edges.iter().zip(has_face).filter(|&(_, has)| !has).map(|(&edge, _)| edge).collect()
}

/// Things with weights, picked by them.
struct Weighted {
    up_to: Vec<f64>,
}

impl Weighted {
    fn new(weights: impl Iterator<Item = f64>) -> Self {
        let add = |sum: &mut f64, weight: f64| {
            *sum += weight;
            Some(*sum)
        };
        Self { up_to: weights.scan(0.0, add).collect() }
    }

    fn total(&self) -> f64 {
        self.up_to.last().copied().unwrap_or(0.0)
    }

    /// The thing at a place from 0 to 1 along all weights.
    fn pick(&self, place: f64) -> usize {
        let share = place * self.total();
        self.up_to.partition_point(|&sum| sum <= share).min(self.up_to.len() - 1)
    }
}

/// CD-Recon and HD-Recon of points of the surface and spheres of the skeleton, in their unit: `there` from the points
/// to the spheres. `None` when one is empty or has what is not finite. `O((n + m) log(n + m))`.
///
/// ```
/// use medial::complex::Sphere;
/// use medial::{Vec3, metrics::compat::p2s_recon};
///
/// // The nearest centre is that of the small sphere, but the point is 0.05 from the large one.
/// let spheres = [Sphere::new(Vec3::ZERO, 1.5), Sphere::new(Vec3::X * 2.0, 0.2)];
/// let recon = p2s_recon(&[Vec3::X * 1.45], &spheres).expect("points and spheres");
/// assert!((recon.there_max - 0.35).abs() < 1e-12);
/// ```
pub fn p2s_recon(points: &[Vec3], skeleton: &[Sphere]) -> Option<TwoSided> {
    let centres: Vec<Vec3> = skeleton.iter().map(|sphere| sphere.centre).collect();
    let there = nearest(&centres, points.iter().copied())?;
    let there: Vec<f64> =
        there.into_iter().map(|(k, far)| (far - skeleton[k].radius).abs()).collect();
    let back = nearest(points, centres.into_iter())?;
    let back: Vec<f64> =
        back.into_iter().zip(skeleton).map(|((_, far), s)| (far - s.radius).abs()).collect();
    TwoSided::of(&there, &back)
}

/// CD-MAT and HD-MAT of the centres of a skeleton and points of a reference, in their unit. `None` as [`p2s_recon`].
pub fn p2s_mat(skeleton: &[Sphere], reference: &[Vec3]) -> Option<TwoSided> {
    let centres: Vec<Vec3> = skeleton.iter().map(|sphere| sphere.centre).collect();
    let far = |from: &[Vec3], to: &[Vec3]| {
        let found = nearest(to, from.iter().copied())?;
        Some(found.into_iter().map(|(_, far)| far).collect::<Vec<_>>())
    };
    TwoSided::of(&far(&centres, reference)?, &far(reference, &centres)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64, z: f64, r: f64) -> Sphere {
        Sphere::new(Vec3::new(x, y, z), r)
    }

    fn points_on(sphere: Sphere, count: usize) -> Vec<Vec3> {
        (0..count)
            .map(|k| {
                let z = 1.0 - (2 * k + 1) as f64 / count as f64;
                let turn = 2.399_963 * k as f64;
                let ring = (1.0 - z * z).sqrt();
                sphere.centre + Vec3::new(ring * turn.cos(), ring * turn.sin(), z) * sphere.radius
            })
            .collect()
    }

    #[test]
    fn one_exact_sphere_has_no_error_and_lengths_scale() {
        let sphere = at(1.0, 2.0, 3.0, 0.5);
        let points = points_on(sphere, 500);
        let mesh = MedialMesh::from_simplices(vec![sphere], vec![], vec![]).unwrap();
        let samples = p2s_sample_skeleton(&mesh, 100, 0);
        assert_eq!(samples, [sphere]);
        let recon = p2s_recon(&points, &samples).unwrap();
        assert!(recon.cd < 1e-14 && recon.hd < 1e-14, "{recon:?}");
        let small = p2s_recon(&points, &[at(1.0, 2.0, 3.0, 0.25)]).unwrap();
        assert!((small.cd - 0.5).abs() < 1e-12 && (small.hd - 0.25).abs() < 1e-12);
        let scaled: Vec<Vec3> = points.iter().map(|&p| p * 8.0).collect();
        let large = p2s_recon(&scaled, &[at(8.0, 16.0, 24.0, 2.0)]).unwrap();
        assert!((large.cd - 8.0 * small.cd).abs() < 1e-11);
        assert_eq!(p2s_recon(&[], &samples), None);
    }

    /// The trap: against the nearest sphere the point would be 0.05 away.
    #[test]
    fn the_nearest_centre_is_not_the_nearest_sphere() {
        let spheres = [at(0.0, 0.0, 0.0, 1.5), at(2.0, 0.0, 0.0, 0.2)];
        let point = Vec3::X * 1.45;
        let recon = p2s_recon(&[point], &spheres).unwrap();
        assert!((recon.there_mean - 0.35).abs() < 1e-12);
        let nearest = spheres.iter().map(|s| (s.centre.distance(point) - s.radius).abs());
        assert!((nearest.fold(f64::INFINITY, f64::min) - 0.05).abs() < 1e-12);
    }

    #[test]
    fn samples_are_shared_by_area_and_half_the_squares() {
        // A face of area 0.5, and an edge of length 1: half of the samples each.
        let spheres = vec![
            at(0.0, 0.0, 0.0, 1.0),
            at(1.0, 0.0, 0.0, 2.0),
            at(0.0, 1.0, 0.0, 3.0),
            at(0.0, 0.0, 5.0, 4.0),
            at(0.0, 0.0, 6.0, 5.0),
        ];
        let mesh = MedialMesh::from_simplices(spheres, vec![[3, 4]], vec![[0, 1, 2]]).unwrap();
        let samples = p2s_sample_skeleton(&mesh, 20_000, 7);
        assert_eq!(samples, p2s_sample_skeleton(&mesh, 20_000, 7));
        let (flat, high): (Vec<Sphere>, Vec<Sphere>) =
            samples.iter().partition(|s| s.centre.z == 0.0);
        assert_eq!((flat.len(), high.len()), (10_000, 10_000));
        // Radii are linear on either.
        assert!(
            flat.iter().all(|s| (s.radius - 1.0 - s.centre.x - 2.0 * s.centre.y).abs() < 1e-12)
        );
        assert!(high.iter().all(|s| (s.radius - s.centre.z + 1.0).abs() < 1e-12));
        // Not uniform: half of them in the middle quarter, whose weights are all below one half.
        let middle = |s: &&Sphere| {
            let (v, w) = (s.centre.x, s.centre.y);
            v < 0.5 && w < 0.5 && v + w > 0.5
        };
        let share = flat.iter().filter(middle).count() as f64 / flat.len() as f64;
        assert!((share - 0.5).abs() < 0.02, "{share}");
        let edges = MedialMesh { faces: vec![], edges: vec![[3, 4]], ..mesh };
        assert_eq!(p2s_sample_skeleton(&edges, 50, 0).len(), 50);
    }

    #[test]
    fn identical_skeletons_are_nowhere_apart() {
        let samples = [at(0.0, 0.0, 0.0, 1.0), at(1.0, 0.0, 0.0, 2.0)];
        let points = samples.map(|s| s.centre);
        let none = p2s_mat(&samples, &points).unwrap();
        assert_eq!((none.cd, none.hd), (0.0, 0.0));
        let moved = p2s_mat(&samples, &[Vec3::ZERO]).unwrap();
        assert_eq!((moved.cd, moved.hd), (0.5, 1.0));
    }
}
