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

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use medial::simplifier::{RunContext, SimplifyError};

/// Neighbours of a voxel in ascending order of the voxels: bits as in `simple.rs`, in the order of
/// `z`, `y`, `x`; `None` for those that come before the voxel or are not there.
pub type After = [Option<u32>; 27];

/// Triangles, by their voxels.
pub struct Triangles<'a> {
    /// Ascending.
    pub faces: &'a [[u32; 3]],
    /// For each voxel the first triangle of which it is the first corner, and one more at the end.
    pub first: &'a [u32],
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
///
/// # Errors
/// When the run was cancelled.
pub fn left_out(
    triangles: &Triangles<'_>,
    lengths: &[u8],
    after: impl Fn(u32) -> (u32, After),
    run: &RunContext,
) -> Result<Vec<bool>, SimplifyError> {
    let tetrahedra = tetrahedra(triangles, after, run)?;
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
    after: impl Fn(u32) -> (u32, After),
    run: &RunContext,
) -> Result<Vec<[u32; 4]>, SimplifyError> {
    let before = (1_u32 << super::simple::CENTRE) - 1;
    let voxels = triangles.first.len() as u32 - 1;
    let (mut found, mut own): (Vec<[u32; 4]>, Vec<[u32; 3]>) = (Vec::new(), Vec::new());
    for voxel in 0..voxels {
        if voxel.is_multiple_of(65_536) {
            run.step(voxel as usize, voxels as usize)?;
        }
        let (there, after) = after(voxel);
        own.clear();
        for block in BLOCKS {
            // Another voxel of the block comes first; the block is listed there.
            if there & block & before != 0 {
                continue;
            }
            let others: Vec<u32> =
                (0..27).filter(|bit| block >> bit & 1 == 1).filter_map(|bit| after[bit]).collect();
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
    let rank = |triangle: u32| (lengths[triangle as usize], triangle);
    let mut by_last: BTreeMap<u32, Vec<(u8, u32)>> = BTreeMap::new();
    for (steps, tetrahedron) in tetrahedra.enumerate() {
        if steps.is_multiple_of(4096) {
            run.step(steps, usize::MAX)?;
        }
        let mut boundary: Vec<(u8, u32)> = tetrahedron.map(rank).to_vec();
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
