//! From voxels to a medial mesh.
//!
//! A sphere for each voxel, an edge between 26-adjacent voxels, a triangle for three voxels that
//! are mutually adjacent, except for those triangles that would close voids which the voxels do
//! not have: the Betti numbers are those of the union of closed voxels, as
//! [`cubical_betti`](medial::complex::cubical_betti) counts them.
//!
//! # Voids
//! Triangles to be left out of the medial mesh, because they would close voids that the voxels do not
//! have.
//!
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
//! So the Betti numbers are those of the voxels, exactly.
//!
//! # Memory
//! A sheet of a plain result is at least two voxels thick, and voxels that touch are joined. The
//! triangles between them, and the tetrahedra that are checked for voids, far outnumber the voxels. So
//! their memory is estimated before they are made.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use medial::complex::{MedialMesh, Sphere as Ball};
use medial::simplifier::{RunContext, SimplifyError};
use rayon::prelude::*;

use super::lattice::{Bricks, Place, Voxel};
use super::solid::{Axis, BYTES_PER_VOXEL, Base, Solid};
use super::thinning::{CENTRE, offset, ones};

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
    let around: Vec<Around> = (0..keys.len())
        .into_par_iter()
        .map(|k| std::array::from_fn(|bit| neighbour(&keys, k, bit as u32)))
        .collect();
    run.step(0, 1)?;
    let (mut edges, mut faces, mut first) = (Vec::new(), Vec::new(), vec![0]);
    let mut lengths = Vec::new();
    for a in 0..keys.len() as u32 {
        // Voxels are sorted like bits, so the later bits are the later voxels: each simplex once.
        let after = &around[a as usize][AFTER_CENTRE..];
        for &b in after.iter().flatten() {
            edges.push([a, b]);
            for &c in after.iter().flatten().filter(|&&c| c > b && are_adjacent(&keys, b, c)) {
                faces.push([a, b, c]);
                lengths
                    .push([[a, b], [a, c], [b, c]].map(|pair| squared(&keys, pair)).iter().sum());
            }
        }
        first.push(faces.len() as u32);
    }
    let left_out = left_out(&Triangles { faces: &faces, first: &first }, &lengths, &around, run)?;
    let mut left_out = left_out.into_iter();
    faces.retain(|_| left_out.next() == Some(false));
    Ok(MedialMesh { spheres: balls, edges, faces, contacts: None })
}

/// The voxel at a bit of the neighbourhood of voxel `k`.
fn neighbour(keys: &[[u16; 3]], k: usize, bit: u32) -> Option<u32> {
    let [dx, dy, dz] = offset(bit);
    let [z, y, x] = keys[k].map(i32::from);
    let [Ok(z), Ok(y), Ok(x)] = [z + dz, y + dy, x + dx].map(u16::try_from) else { return None };
    keys.binary_search(&[z, y, x]).ok().map(|found| found as u32)
}

fn are_adjacent(keys: &[[u16; 3]], a: u32, b: u32) -> bool {
    let (a, b) = (keys[a as usize], keys[b as usize]);
    (0..3).all(|axis| a[axis].abs_diff(b[axis]) <= 1)
}

fn squared(keys: &[[u16; 3]], [a, b]: [u32; 2]) -> u8 {
    let (a, b) = (keys[a as usize], keys[b as usize]);
    (0..3).map(|axis| a[axis].abs_diff(b[axis]).pow(2) as u8).sum()
}

/// The voxels around and at a voxel, ascending: bits as in `thinning.rs`, in the order of `z`, `y`, `x`.
type Around = [Option<u32>; 27];

/// The first bit of voxels that come after the voxel itself.
const AFTER_CENTRE: usize = CENTRE as usize + 1;

/// Triangles, by their voxels.
struct Triangles<'a> {
    /// Ascending.
    faces: &'a [[u32; 3]],
    /// For each voxel the first triangle of which it is the first corner, and one more at the end.
    first: &'a [u32],
}

impl Triangles<'_> {
    fn find(&self, [a, b, c]: [u32; 3]) -> u32 {
        let (from, to) = (self.first[a as usize], self.first[a as usize + 1]);
        let own = &self.faces[from as usize..to as usize];
        let place = own.binary_search(&[a, b, c]).expect("adjacent voxels have a triangle");
        from + place as u32
    }
}

/// For each triangle whether it is left out. `lengths` are sums of the squared sides.
fn left_out(
    triangles: &Triangles<'_>,
    lengths: &[u8],
    around: &[Around],
    run: &RunContext,
) -> Result<Vec<bool>, SimplifyError> {
    let tetrahedra = tetrahedra(triangles, around, run)?;
    let mut collapse = Collapse::new(&tetrahedra, lengths);
    collapse.run(run)?;
    let Collapse { is_open, mut left_out, .. } = collapse;
    let rest = (0..tetrahedra.len()).filter(|&k| is_open[k]).map(|k| tetrahedra[k]);
    reduce(rest, lengths, &mut left_out, run)?;
    Ok(left_out)
}

/// Bits of the eight blocks of 2 x 2 x 2 voxels that hold a voxel.
const BLOCKS: [u32; 8] = blocks();

const fn blocks() -> [u32; 8] {
    let mut masks = [0; 8];
    let mut block = 0;
    while block < 8 {
        let mut corner = 0;
        while corner < 8 {
            let x = (block & 1) + (corner & 1);
            let y = (block >> 1 & 1) + (corner >> 1 & 1);
            let z = (block >> 2 & 1) + (corner >> 2 & 1);
            masks[block as usize] |= 1 << (x + 3 * y + 9 * z);
            corner += 1;
        }
        block += 1;
    }
    masks
}

/// Step 1: each tetrahedron as its four triangles.
fn tetrahedra(
    triangles: &Triangles<'_>,
    around: &[Around],
    run: &RunContext,
) -> Result<Vec<[u32; 4]>, SimplifyError> {
    let before = (1_u32 << CENTRE) - 1;
    let (mut found, mut own): (Vec<[u32; 4]>, Vec<[u32; 3]>) = (Vec::new(), Vec::new());
    for (voxel, near) in (0_u32..).zip(around) {
        if voxel.is_multiple_of(65_536) {
            run.step(voxel as usize, around.len())?;
        }
        let there = (0..27).fold(0, |bits, bit| bits | u32::from(near[bit].is_some()) << bit);
        own.clear();
        for block in BLOCKS {
            // Another voxel of the block comes first; the block is listed there.
            if there & block & before != 0 {
                continue;
            }
            let others: Vec<u32> = (AFTER_CENTRE..27)
                .filter(|bit| block >> bit & 1 == 1)
                .filter_map(|bit| near[bit])
                .collect();
            for (i, &a) in others.iter().enumerate() {
                for (j, &b) in others.iter().enumerate().skip(i + 1) {
                    own.extend(others[j + 1..].iter().map(|&c| [a, b, c]));
                }
            }
        }
        own.sort_unstable();
        own.dedup();
        found.extend(own.iter().map(|&[a, b, c]| {
            [[voxel, a, b], [voxel, a, c], [voxel, b, c], [a, b, c]].map(|t| triangles.find(t))
        }));
    }
    Ok(found)
}

/// Step 2.
struct Collapse<'a> {
    tetrahedra: &'a [[u32; 4]],
    lengths: &'a [u8],
    is_open: Vec<bool>,
    left_out: Vec<bool>,
    /// For each triangle the number of tetrahedra left at it, and the exclusive or of their ids: with
    /// one left, that is its id.
    beside: Vec<(u32, u32)>,
    /// Triangles that have, or had, one tetrahedron.
    free: BinaryHeap<(u8, Reverse<u32>)>,
}

impl<'a> Collapse<'a> {
    fn new(tetrahedra: &'a [[u32; 4]], lengths: &'a [u8]) -> Self {
        let mut beside = vec![(0, 0); lengths.len()];
        for (k, tetrahedron) in (0..).zip(tetrahedra) {
            for &triangle in tetrahedron {
                let (count, all): &mut (u32, u32) = &mut beside[triangle as usize];
                *count += 1;
                *all ^= k;
            }
        }
        let free = (0..).zip(&beside).filter(|(_, (count, _))| *count == 1);
        let free = free.map(|(t, _): (u32, _)| (lengths[t as usize], Reverse(t))).collect();
        let is_open = vec![true; tetrahedra.len()];
        let left_out = vec![false; lengths.len()];
        Self { tetrahedra, lengths, is_open, left_out, beside, free }
    }

    fn run(&mut self, run: &RunContext) -> Result<(), SimplifyError> {
        let mut steps = 0_usize;
        while let Some((_, Reverse(triangle))) = self.free.pop() {
            let (count, tetrahedron) = self.beside[triangle as usize];
            // Its tetrahedron may have been opened through another triangle meanwhile.
            if count != 1 {
                continue;
            }
            steps += 1;
            if steps.is_multiple_of(65_536) {
                run.step(steps, self.tetrahedra.len())?;
            }
            self.left_out[triangle as usize] = true;
            self.is_open[tetrahedron as usize] = false;
            for side in self.tetrahedra[tetrahedron as usize] {
                let (count, all) = &mut self.beside[side as usize];
                *count -= 1;
                *all ^= tetrahedron;
                if *count == 1 {
                    self.free.push((self.lengths[side as usize], Reverse(side)));
                }
            }
        }
        Ok(())
    }
}

/// Step 3.
fn reduce(
    tetrahedra: impl Iterator<Item = [u32; 4]>,
    lengths: &[u8],
    left_out: &mut [bool],
    run: &RunContext,
) -> Result<(), SimplifyError> {
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

/// Bytes for each voxel of a result: its neighbours, its ball while it is moved, what is returned.
const PER_VOXEL: f64 = 450.0;
/// Bytes for each edge, triangle and tetrahedron, in vectors that grow.
const PER_SIMPLEX: [f64; 3] = [16.0, 50.0, 40.0];

/// Resident bytes for each byte in use: what is freed on the way does not all go back.
const RESIDENT: f64 = 1.75;

impl Solid<'_> {
    /// Memory for the voxels of a base and for the medial mesh of an axis, in megabytes.
    pub(super) fn megabytes_with_output(&self, base: &Base, axis: &Axis) -> f64 {
        let voxels = axis.bricks();
        let mut numbers = [0_u64; 3];
        for voxel in &axis.voxels {
            let own = simplices(voxels.neighbourhood(voxel.place));
            numbers.iter_mut().zip(own).for_each(|(all, own)| *all += u64::from(own));
        }
        let simplices = numbers.iter().zip(PER_SIMPLEX).map(|(&n, bytes)| n as f64 * bytes);
        let output = axis.voxels.len() as f64 * PER_VOXEL + simplices.sum::<f64>();
        let start = base.descent.tally.start as f64 * BYTES_PER_VOXEL;
        RESIDENT * (output + start) / 1e6
    }
}

/// Edges, triangles and tetrahedra of mutually adjacent voxels of which a voxel is the first.
fn simplices(neighbourhood: u32) -> [u32; 3] {
    let after = neighbourhood & !((2 << CENTRE) - 1);
    let mut numbers = [after.count_ones(), 0, 0];
    for b in ones(after) {
        let with_b = after & ADJACENT_AFTER[b as usize];
        numbers[1] += with_b.count_ones();
        for c in ones(with_b) {
            numbers[2] += (with_b & ADJACENT_AFTER[c as usize]).count_ones();
        }
    }
    numbers
}

/// For each of the 27 places the later ones that touch it.
const ADJACENT_AFTER: [u32; 27] = adjacent_after();

const fn adjacent_after() -> [u32; 27] {
    let mut masks = [0; 27];
    let mut a = 0;
    while a < 27 {
        let mut b = a + 1;
        while b < 27 {
            let (p, q) = (offset(a), offset(b));
            let near =
                (p[0] - q[0]).abs() <= 1 && (p[1] - q[1]).abs() <= 1 && (p[2] - q[2]).abs() <= 1;
            if near {
                masks[a as usize] |= 1 << b;
            }
            b += 1;
        }
        a += 1;
    }
    masks
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
