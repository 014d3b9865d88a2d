//! Steps 4 and 5: the errors of the clusters, and which spheres are split.

use medial::complex::Sphere;
use rayon::prelude::*;

use super::cluster::Clusters;
use super::energy::Energy;
use super::points::SurfacePoints;

/// Share of the spheres that are split in a round, and their number at most.
const SHARE: f64 = 0.2;
const MOST: usize = 10;

/// How well a sphere fits its cluster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Misfit {
    /// `E_s`: the errors of the cluster over its area, in squared diagonals.
    pub mean: f64,
    /// The point with the largest error, the smallest id of equal ones.
    pub worst: u32,
}

/// The misfit of every sphere; no cluster is empty.
pub(super) fn misfits(
    points: &SurfacePoints,
    energy: Energy,
    spheres: &[Sphere],
    clusters: &Clusters,
) -> Vec<Misfit> {
    let of_sphere = |(s, sphere): (usize, &Sphere)| {
        let cluster = clusters.of(s);
        let (mut sum, mut area) = (0.0, 0.0);
        let (mut largest, mut worst) = (f64::NEG_INFINITY, cluster[0]);
        for &v in cluster {
            let a = points.areas[v as usize];
            let error = a * energy.at(points, v as usize, sphere);
            sum += error;
            area += a;
            if error > largest {
                (largest, worst) = (error, v);
            }
        }
        Misfit { mean: sum / area, worst }
    };
    spheres.par_iter().enumerate().map(of_sphere).collect()
}

/// The spheres to split, those with the largest errors first: at most so many as are missing, and none of
/// which a neighbour is split. `edges` are pairs of adjacent spheres.
pub(super) fn to_split(misfits: &[Misfit], edges: &[[u32; 2]], missing: usize) -> Vec<u32> {
    let spheres = misfits.len();
    let most = ((SHARE * spheres as f64).ceil() as usize).min(MOST).min(missing);
    let mut neighbours = vec![Vec::new(); spheres];
    for &[a, b] in edges {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    let mut order: Vec<u32> = (0..spheres as u32).collect();
    order.sort_unstable_by(|&a, &b| {
        misfits[b as usize].mean.total_cmp(&misfits[a as usize].mean).then(a.cmp(&b))
    });
    let mut blocked = vec![false; spheres];
    let mut split = Vec::new();
    for sphere in order {
        if split.len() == most {
            break;
        }
        if !blocked[sphere as usize] {
            neighbours[sphere as usize].iter().for_each(|&other| blocked[other as usize] = true);
            split.push(sphere);
        }
    }
    split
}
