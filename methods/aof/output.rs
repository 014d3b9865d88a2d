//! From voxels to points and to a medial mesh.
//!
//! A sphere for each voxel, an edge between 26-adjacent voxels, a triangle for three voxels that
//! are mutually adjacent: the 2-skeleton of the clique complex. The clique complex itself has the
//! homotopy type of the union of closed voxels (boxes that meet in pairs have a common point:
//! nerve theorem), the 2-skeleton has voids that the union does not have. Measure the topology of
//! voxels by [`cubical_betti`](medial::complex::cubical_betti).

use medial::complex::{MedialMesh, Sphere as Ball};
use medial::geometry::TriangleBvh;
use rayon::prelude::*;

use super::bricks::{Bricks, Place, Voxel};
use super::flux::Sphere;
use super::grid::Grid;
use super::refine::refine;
use super::simple::{CENTRE, offset};

/// The voxels by `z`, then `y`, then `x`.
pub fn sorted(voxels: &Bricks) -> Vec<Voxel> {
    let mut sorted: Vec<Voxel> = voxels.iter().collect();
    sorted.sort_unstable_by_key(|voxel| key(voxel.place));
    sorted
}

fn key([x, y, z]: Place) -> [u16; 3] {
    [z, y, x]
}

/// The balls of voxels: around their centres, or around points of the axis near them.
pub fn balls(
    voxels: &[Voxel],
    grid: &Grid,
    tree: &TriangleBvh,
    onto_axis: Option<&Sphere>,
) -> Vec<Ball> {
    let ball = |voxel: &Voxel| {
        let centre = grid.centre(voxel.place);
        match onto_axis {
            Some(sphere) => refine(tree, sphere, centre).ball,
            None => Ball::new(centre, tree.closest(centre).distance),
        }
    };
    voxels.par_iter().map(ball).collect()
}

/// The medial mesh on balls of sorted voxels.
///
/// # Panics
/// If there is not one ball for each voxel.
pub fn medial_mesh(voxels: &[Voxel], balls: Vec<Ball>) -> MedialMesh {
    assert_eq!(voxels.len(), balls.len(), "one ball for each voxel");
    let keys: Vec<[u16; 3]> = voxels.iter().map(|voxel| key(voxel.place)).collect();
    let forward = |k: usize| -> Vec<u32> {
        let near = |bit: u32| {
            let [dx, dy, dz] = offset(bit);
            let [z, y, x] = keys[k].map(i32::from);
            let at = [z + dz, y + dy, x + dx];
            let at = at.iter().all(|i| (0..=i32::from(u16::MAX)).contains(i)).then_some(at)?;
            keys.binary_search(&at.map(|i| i as u16)).ok().map(|found| found as u32)
        };
        (CENTRE + 1..27).filter_map(near).collect()
    };
    let after: Vec<Vec<u32>> = (0..keys.len()).into_par_iter().map(forward).collect();
    let (mut edges, mut faces) = (Vec::new(), Vec::new());
    for (first, near) in (0_u32..).zip(&after) {
        for (place, &second) in near.iter().enumerate() {
            edges.push([first, second]);
            for &third in &near[place + 1..] {
                if after[second as usize].contains(&third) {
                    faces.push([first, second, third]);
                }
            }
        }
    }
    MedialMesh { spheres: balls, edges, faces, contacts: None }
}
