//! From voxels to a medial mesh: a sphere for each voxel, an edge between 26-adjacent voxels, a
//! triangle for three voxels that are mutually adjacent. Triangles are left out that would close
//! voids, so that the Betti numbers are exactly those of the union of closed voxels, as
//! [`cubical_betti`](medial::complex::cubical_betti) counts them.
//!
//! # Voids
//! The clique complex of the voxels has a simplex for any number of mutually 26-adjacent voxels. It
//! has the homotopy type of the union of closed voxels, because boxes that meet in pairs have a common
//! point (nerve theorem). A medial mesh has its triangles but not its tetrahedra, so each tetrahedron
//! is a void. As many triangles are left out as there are voids to open:
//!
//! 1. Voxels around a common corner of the lattice are a simplex. The tetrahedra at its first voxel
//!    have boundaries that span those of all its tetrahedra.
//! 2. A tetrahedron with a triangle that belongs to no other one is taken out with this triangle: an
//!    elementary collapse. The triangles with the longest sides go first.
//! 3. When no such tetrahedron is left, the boundaries of the others are reduced to distinct last
//!    triangles (H. Edelsbrunner, J. Harer, *Computational Topology*, 2010, section VII.1), and these
//!    are left out. Each of them lies on the boundary of a union of tetrahedra that does not contain
//!    the ones before it. So no loop opens, and there is one void less.
//!
//! # Memory
//! The triangles of thick sheets, and the tetrahedra that are checked for voids, far outnumber the
//! voxels. So their memory is estimated before they are made.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::LazyLock;

use medial::complex::{MedialMesh, Sphere as Ball};
use medial::simplifier::RunContext;
use rayon::prelude::*;

use super::lattice::{LatticeVoxels, Voxel};
use super::thinning::{CENTRE, offset, ones, squared, touch};
use crate::Result;

/// The medial mesh on balls of sorted voxels.
///
/// # Errors
/// When the run was cancelled.
///
/// # Panics
/// If there is not one ball for each voxel.
pub fn medial_mesh(voxels: &[Voxel], balls: Vec<Ball>, run: &RunContext) -> Result<MedialMesh> {
    assert_eq!(voxels.len(), balls.len(), "one ball for each voxel");
    let keys: Vec<[u16; 3]> = voxels.iter().map(Voxel::key).collect();
    let around: Vec<Around> =
        (0..keys.len()).into_par_iter().map(|k| Around::of(&keys, k)).collect();
    run.step(0, 1)?;
    let (mut edges, mut faces, mut first) = (Vec::new(), Vec::new(), vec![0]);
    let mut lengths = Vec::new();
    for (a, near) in (0..).zip(&around) {
        // Voxels are sorted like bits, so the later bits are the later voxels: each simplex once.
        for b in ones(near.there & AFTER_CENTRE) {
            edges.push([a, near.ids[b as usize]]);
            for c in ones(near.there & TOUCHING_AFTER[b as usize]) {
                faces.push([a, near.ids[b as usize], near.ids[c as usize]]);
                lengths.push(squared(CENTRE, b) + squared(CENTRE, c) + squared(b, c));
            }
        }
        first.push(faces.len() as u32);
    }
    let tetrahedra = tetrahedra(&faces, &first, &around, run)?;
    let (is_open, mut left_out) = collapse(&tetrahedra, &lengths, run)?;
    let rest = tetrahedra.iter().zip(is_open).filter(|&(_, is_open)| is_open);
    reduce(rest.map(|(&tetrahedron, _)| tetrahedron), &lengths, &mut left_out, run)?;
    let mut left_out = left_out.into_iter();
    faces.retain(|_| left_out.next() == Some(false));
    Ok(MedialMesh { spheres: balls, edges, faces, contacts: None })
}

/// The voxels around and at a voxel: bits as in `thinning.rs`, in the order of `z`, `y`, `x`.
struct Around {
    there: u32,
    /// Ids of the voxels that are there, ascending.
    ids: [u32; 27],
}

impl Around {
    fn of(keys: &[[u16; 3]], k: usize) -> Self {
        let [z, y, x] = keys[k].map(i32::from);
        let mut around = Self { there: 0, ids: [0; 27] };
        for bit in 0..27 {
            let [dx, dy, dz] = offset(bit);
            let near = [z + dz, y + dy, x + dx];
            if let Ok(id) = keys.binary_search_by(|key| key.map(i32::from).cmp(&near)) {
                around.there |= 1 << bit;
                around.ids[bit as usize] = id as u32;
            }
        }
        around
    }
}

/// The bits of voxels that come after the voxel itself.
const AFTER_CENTRE: u32 = 0x7ff_ffff & !((2 << CENTRE) - 1);

/// For each of the 27 bits the later ones whose voxels touch its voxel.
static TOUCHING_AFTER: LazyLock<[u32; 27]> = LazyLock::new(|| {
    std::array::from_fn(|a| {
        (a as u32 + 1..27).filter(|&b| touch(a as u32, b)).fold(0, |bits, b| bits | 1 << b)
    })
});

/// Bits of the 2 x 2 x 2 voxels at the lowest corner of a neighbourhood.
const BLOCK: u32 = 0o033_033;
/// Shifts of these bits to all corners.
const CORNERS: [u32; 8] = [0, 1, 3, 4, 9, 10, 12, 13];

/// Step 1: each tetrahedron as its four triangles. `faces` ascend; `first` has for each voxel the first
/// of which it is the first corner, and one more at the end.
fn tetrahedra(
    faces: &[[u32; 3]],
    first: &[u32],
    around: &[Around],
    run: &RunContext,
) -> Result<Vec<[u32; 4]>> {
    let before = (1_u32 << CENTRE) - 1;
    let (mut found, mut own): (Vec<[u32; 4]>, Vec<[u32; 3]>) = (Vec::new(), Vec::new());
    for (voxel, near) in (0_u32..).zip(around) {
        if voxel.is_multiple_of(65_536) {
            run.step(voxel as usize, around.len())?;
        }
        own.clear();
        for block in CORNERS.map(|corner| BLOCK << corner) {
            // Another voxel of the block comes first; the block is listed there.
            if near.there & block & before != 0 {
                continue;
            }
            let others: Vec<u32> =
                ones(near.there & block & AFTER_CENTRE).map(|bit| near.ids[bit as usize]).collect();
            for (i, &a) in others.iter().enumerate() {
                for (j, &b) in others.iter().enumerate().skip(i + 1) {
                    own.extend(others[j + 1..].iter().map(|&c| [a, b, c]));
                }
            }
        }
        own.sort_unstable();
        own.dedup();
        found.extend(own.iter().map(|&[a, b, c]| {
            [[voxel, a, b], [voxel, a, c], [voxel, b, c], [a, b, c]].map(|t| {
                let [from, to] = [0, 1].map(|k| first[t[0] as usize + k]);
                let place = faces[from as usize..to as usize].binary_search(&t);
                from + place.expect("adjacent voxels have a triangle") as u32
            })
        }));
    }
    Ok(found)
}

/// Step 2: whether each tetrahedron is still a void, and whether each triangle is left out.
fn collapse(
    tetrahedra: &[[u32; 4]],
    lengths: &[u8],
    run: &RunContext,
) -> Result<(Vec<bool>, Vec<bool>)> {
    // For each triangle the number of tetrahedra left at it, and the exclusive or of their ids: with
    // one left, that is its id.
    let mut adjacent = vec![(0_u32, 0_u32); lengths.len()];
    for (k, tetrahedron) in (0..).zip(tetrahedra) {
        for &triangle in tetrahedron {
            let (count, all) = &mut adjacent[triangle as usize];
            *count += 1;
            *all ^= k;
        }
    }
    // Triangles that have, or had, one tetrahedron.
    let free = (0..).zip(&adjacent).filter(|(_, (count, _))| *count == 1);
    let mut free: BinaryHeap<(u8, Reverse<u32>)> =
        free.map(|(t, _): (u32, _)| (lengths[t as usize], Reverse(t))).collect();
    let (mut is_open, mut left_out) = (vec![true; tetrahedra.len()], vec![false; lengths.len()]);
    let mut steps = 0_usize;
    while let Some((_, Reverse(triangle))) = free.pop() {
        let (count, tetrahedron) = adjacent[triangle as usize];
        // Its tetrahedron may have been opened through another triangle meanwhile.
        if count != 1 {
            continue;
        }
        steps += 1;
        if steps.is_multiple_of(65_536) {
            run.step(steps, tetrahedra.len())?;
        }
        left_out[triangle as usize] = true;
        is_open[tetrahedron as usize] = false;
        for side in tetrahedra[tetrahedron as usize] {
            let (count, all) = &mut adjacent[side as usize];
            *count -= 1;
            *all ^= tetrahedron;
            if *count == 1 {
                free.push((lengths[side as usize], Reverse(side)));
            }
        }
    }
    Ok((is_open, left_out))
}

/// Step 3.
fn reduce(
    tetrahedra: impl Iterator<Item = [u32; 4]>,
    lengths: &[u8],
    left_out: &mut [bool],
    run: &RunContext,
) -> Result<()> {
    // The longest triangles are the last ones.
    let mut by_last: BTreeMap<u32, Vec<(u8, u32)>> = BTreeMap::new();
    for (steps, tetrahedron) in tetrahedra.enumerate() {
        if steps.is_multiple_of(4096) {
            run.step(steps, usize::MAX)?;
        }
        let mut boundary: Vec<(u8, u32)> =
            tetrahedron.map(|triangle| (lengths[triangle as usize], triangle)).to_vec();
        boundary.sort_unstable();
        while let Some(&(_, last)) = boundary.last() {
            let Some(other) = by_last.get(&last) else {
                left_out[last as usize] = true;
                by_last.insert(last, boundary);
                break;
            };
            boundary = without_common(&boundary, other);
        }
    }
    Ok(())
}

/// The symmetric difference of two ascending lists: their sum over Z2.
fn without_common(a: &[(u8, u32)], b: &[(u8, u32)]) -> Vec<(u8, u32)> {
    let (mut i, mut j) = (0, 0);
    let mut sum = Vec::with_capacity(a.len() + b.len());
    while i < a.len() && j < b.len() {
        match a[i].cmp(&b[j]) {
            std::cmp::Ordering::Less => (sum.push(a[i]), i += 1).1,
            std::cmp::Ordering::Greater => (sum.push(b[j]), j += 1).1,
            std::cmp::Ordering::Equal => (i, j) = (i + 1, j + 1),
        }
    }
    sum.extend_from_slice(&a[i..]);
    sum.extend_from_slice(&b[j..]);
    sum
}

/// Bytes for each voxel of a result: its neighbours, its ball during the moves, its part of the result.
const PER_VOXEL: f64 = 450.0;
/// Bytes for each edge, triangle and tetrahedron, in vectors that grow.
const PER_SIMPLEX: [f64; 3] = [16.0, 50.0, 40.0];

/// Resident bytes for each byte in use: freed memory does not all return to the system.
const RESIDENT: f64 = 1.75;

/// Memory for the medial mesh of an axis next to other bytes, in megabytes.
pub(super) fn megabytes(axis: &LatticeVoxels, other_bytes: f64) -> f64 {
    let voxels = axis.bricks();
    let mut numbers = [0_u64; 3];
    for voxel in &axis.voxels {
        let own = simplices(voxels.neighbourhood(voxel.place));
        numbers.iter_mut().zip(own).for_each(|(all, own)| *all += u64::from(own));
    }
    let simplices = numbers.iter().zip(PER_SIMPLEX).map(|(&n, bytes)| n as f64 * bytes);
    let output = axis.voxels.len() as f64 * PER_VOXEL + simplices.sum::<f64>();
    RESIDENT * (output + other_bytes) / 1e6
}

/// Edges, triangles and tetrahedra of mutually adjacent voxels that begin with a voxel.
fn simplices(neighbourhood: u32) -> [u32; 3] {
    let after = neighbourhood & AFTER_CENTRE;
    let mut numbers = [after.count_ones(), 0, 0];
    for b in ones(after) {
        let with_b = after & TOUCHING_AFTER[b as usize];
        numbers[1] += with_b.count_ones();
        for c in ones(with_b) {
            numbers[2] += (with_b & TOUCHING_AFTER[c as usize]).count_ones();
        }
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simplices_of_a_full_block_are_its_cliques() {
        // A voxel with all its 26 neighbours: 13 come after it.
        assert_eq!(simplices((1 << 27) - 1)[0], 13);
        // The corner of a block of 2 x 2 x 2: all subsets of the seven others.
        let block = (0..27).filter(|&bit| offset(bit).iter().all(|&x| x >= 0));
        let block = block.fold(0, |bits, bit| bits | 1 << bit);
        assert_eq!(simplices(block), [7, 21, 35]);
        assert_eq!(simplices(1 << CENTRE), [0, 0, 0]);
    }
}
