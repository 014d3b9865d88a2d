//! From voxels to a medial mesh.
//!
//! A sphere for each voxel, an edge between 26-adjacent voxels, a triangle for three voxels that
//! are mutually adjacent, except for those triangles that would close voids which the voxels do
//! not have (file `voids.rs`): the Betti numbers are those of the union of closed voxels, as
//! [`cubical_betti`](medial::complex::cubical_betti) counts them.

use medial::complex::{MedialMesh, Sphere as Ball};
use medial::simplifier::{RunContext, SimplifyError};
use rayon::prelude::*;

use super::bricks::{Bricks, Place, Voxel};
use super::simple::{CENTRE, offset};
use super::voids::{Triangles, left_out};

/// The voxels by `z`, then `y`, then `x`.
pub fn sorted(voxels: &Bricks) -> Vec<Voxel> {
    let mut sorted: Vec<Voxel> = voxels.iter().collect();
    sorted.sort_unstable_by_key(|voxel| key(voxel.place));
    sorted
}

fn key([x, y, z]: Place) -> [u16; 3] {
    [z, y, x]
}

/// The medial mesh on balls of sorted voxels.
///
/// # Errors
/// When the run was cancelled.
///
/// # Panics
/// If there is not one ball for each voxel.
pub fn medial_mesh(
    voxels: &[Voxel],
    balls: Vec<Ball>,
    run: &RunContext,
) -> Result<MedialMesh, SimplifyError> {
    assert_eq!(voxels.len(), balls.len(), "one ball for each voxel");
    let keys: Vec<[u16; 3]> = voxels.iter().map(|voxel| key(voxel.place)).collect();
    let neighbour = |k: u32, bit: u32| {
        let [dx, dy, dz] = offset(bit);
        let [z, y, x] = keys[k as usize].map(i32::from);
        let at = [z + dz, y + dy, x + dx];
        let at = at.iter().all(|i| (0..=i32::from(u16::MAX)).contains(i)).then_some(at)?;
        keys.binary_search(&at.map(|i| i as u16)).ok().map(|found| found as u32)
    };
    let around =
        |k: u32| -> [Option<u32>; 27] { std::array::from_fn(|bit| neighbour(k, bit as u32)) };
    let around: Vec<[Option<u32>; 27]> =
        (0..keys.len() as u32).into_par_iter().map(around).collect();
    run.step(0, 1)?;
    // Voxels are sorted like bits, so the later bits are the later voxels: each simplex once.
    let after = |k: u32| around[k as usize][CENTRE as usize + 1..].iter().flatten().copied();
    let (mut edges, mut faces, mut first) = (Vec::new(), Vec::new(), vec![0]);
    let mut lengths = Vec::new();
    for a in 0..keys.len() as u32 {
        for b in after(a) {
            edges.push([a, b]);
            for c in after(a).filter(|&c| c > b && are_adjacent(&keys, b, c)) {
                faces.push([a, b, c]);
                lengths
                    .push([[a, b], [a, c], [b, c]].map(|pair| squared(&keys, pair)).iter().sum());
            }
        }
        first.push(faces.len() as u32);
    }
    let of = |k: u32| {
        let near = around[k as usize];
        let there = (0..27).fold(0, |bits, bit| bits | u32::from(near[bit].is_some()) << bit);
        let mut after = near;
        after[..=CENTRE as usize].fill(None);
        (there, after)
    };
    let left_out = left_out(&Triangles { faces: &faces, first: &first }, &lengths, of, run)?;
    let mut left_out = left_out.into_iter();
    faces.retain(|_| left_out.next() == Some(false));
    Ok(MedialMesh { spheres: balls, edges, faces, contacts: None })
}

fn are_adjacent(keys: &[[u16; 3]], a: u32, b: u32) -> bool {
    let (a, b) = (keys[a as usize], keys[b as usize]);
    (0..3).all(|axis| a[axis].abs_diff(b[axis]) <= 1)
}

fn squared(keys: &[[u16; 3]], [a, b]: [u32; 2]) -> u8 {
    let (a, b) = (keys[a as usize], keys[b as usize]);
    (0..3).map(|axis| a[axis].abs_diff(b[axis]).pow(2) as u8).sum()
}
