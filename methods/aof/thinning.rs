//! Homotopic deletion of voxels by flux.
//!
//! K. Siddiqi, S. Bouix, A. Tannenbaum, S. W. Zucker, *Hamilton-Jacobi skeletons*, International Journal
//! of Computer Vision 48(3), 2002, doi:10.1023/A:1016376116653, section 3.3: simple voxels in a heap, the
//! least medial first; an end point with a flux below a threshold is never deleted.
//!
//! 1. All border voxels are queued by flux, the largest first.
//! 2. The first is taken. If it is simple and need not be kept, it is deleted, and those of its
//!    neighbours that are not queued are queued.
//!
//! An *end point* ends an open curve in one of nine digital planes through it: of its eight neighbours
//! in the plane exactly one exists, or two that touch.
//!
//! # Simple voxels
//! Those whose removal keeps the homotopy type, with 26-connectivity for the object and 6-connectivity
//! for the background. G. Malandain, G. Bertrand, *Fast characterization of 3D simple points*, ICPR
//! 1992, doi:10.1109/ICPR.1992.201968; the criterion is that of G. Bertrand, G. Malandain, *A new
//! characterization of three-dimensional simple points*, Pattern Recognition Letters 15(2), 1994,
//! doi:10.1016/0167-8655(94)90046-9: a voxel is simple if and only if
//!
//! - `C* = 1`: its object neighbours are one 26-connected component, and
//! - `C- = 1`: the background voxels among its 18 nearest neighbours have one 6-connected component
//!   that contains a 6-neighbour of it.
//!
//! Exactly 25,985,144 of the `2^26` neighbourhoods are simple. A *neighbourhood* is 27 bits: bit
//! `dx + 1 + 3 (dy + 1) + 9 (dz + 1)`. Bit 13 is the voxel itself and does not matter.
//!
//! # The queue
//! Keys are rounded to one of 65,536 steps of their range, far finer than the sampling error of a
//! flux. Places of the same step leave in the order in which they came. So a plateau of equal keys is
//! peeled layer by layer from all sides, independent of its position in the lattice.

use std::collections::{BTreeMap, VecDeque};

use medial::simplifier::RunContext;

use super::lattice::{Bricks, Place};
use crate::Result;

/// The end of a deletion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Until {
    /// Only end points with a flux at or below this threshold are simple.
    EndPoints(f32),
    /// This number of voxels is left. End points go too.
    Count(usize),
}

/// Deletes the voxels that are simple at the time they are taken from the queue.
///
/// # Errors
/// When the run was cancelled.
pub fn thin(voxels: &mut Bricks, until: Until, run: &RunContext) -> Result<()> {
    let total = voxels.len;
    let (threshold, least) = match until {
        Until::EndPoints(threshold) => (threshold, 0),
        Until::Count(count) => (f32::NEG_INFINITY, count),
    };
    let mut queue = BucketQueue::default();
    // Places in the queue, and end points that must not be queued again.
    let mut barred = voxels.no_marks();
    for voxel in voxels.iter() {
        // With all six face neighbours a voxel is not simple; a deletion next to it will queue it.
        if voxels.neighbourhood(voxel.place) & FACES != FACES {
            barred.set(voxel.place);
            queue.push(-voxel.flux, voxel.place);
        }
    }
    let mut steps = 0_usize;
    while let Some(place) = queue.pop() {
        if voxels.len <= least {
            break;
        }
        steps += 1;
        if steps.is_multiple_of(65_536) {
            run.step((total - voxels.len).min(total), total)?;
        }
        barred.clear(place);
        let neighbourhood = voxels.neighbourhood(place);
        // Not simple now; a deletion next to it will queue it again.
        if !is_simple(neighbourhood) {
            continue;
        }
        let voxel = voxels.get(place).expect("queued voxels are there");
        if voxel.flux <= threshold && is_end_point(neighbourhood) {
            barred.set(place);
            continue;
        }
        voxels.remove(place);
        for bit in ones(neighbourhood & !(1 << CENTRE) & !barred.neighbourhood(place)) {
            let step = offset(bit);
            let near = [0, 1, 2].map(|axis| (i32::from(place[axis]) + step[axis]) as u16);
            let voxel = voxels.get(near).expect("a neighbour that is there");
            barred.set(near);
            queue.push(-voxel.flux, near);
        }
    }
    Ok(())
}

/// Whether a voxel ends an open curve in one of the nine digital planes through it.
pub fn is_end_point(neighbourhood: u32) -> bool {
    PLANES.iter().any(|plane| {
        let there = neighbourhood & plane;
        match there.count_ones() {
            1 => true,
            2 => touch(there.trailing_zeros(), 31 - there.leading_zeros()),
            _ => false,
        }
    })
}

/// The neighbours in the planes `x = 0`, `y = 0`, `z = 0`, `x = +-y`, `y = +-z`, `z = +-x`.
const PLANES: [u32; 9] = [
    0o222_202_222,
    0o070_050_070,
    0o000_757_000,
    0o421_401_421,
    0o124_104_124,
    0o700_050_007,
    0o007_050_700,
    0o444_202_111,
    0o111_202_444,
];

/// Bit of the voxel itself.
pub(super) const CENTRE: u32 = 13;
/// Bits of a neighbourhood without its lowest column, row and layer.
const NOT_LOW: [u32; 3] = [0o666_666_666, 0o770_770_770, 0o777_777_000];
/// Bits of a neighbourhood without its highest column, row and layer.
const NOT_HIGH: [u32; 3] = [0o333_333_333, 0o077_077_077, 0o000_777_777];
/// Shift of a bit by a step along each axis.
const STEP: [u32; 3] = [1, 3, 9];
/// Bits of the 18 nearest neighbours.
const NEAREST_18: u32 = 0o272_757_272;
/// Bits of the six neighbours that share a face.
pub(super) const FACES: u32 = 1 << 4 | 1 << 10 | 1 << 12 | 1 << 14 | 1 << 16 | 1 << 22;

/// Whether a voxel with this neighbourhood is simple, in some 100 operations.
#[inline]
pub fn is_simple(neighbourhood: u32) -> bool {
    let object = neighbourhood & 0x7ff_ffff & !(1 << CENTRE);
    let rest = !neighbourhood & NEAREST_18;
    let seeds = rest & FACES;
    if object == 0 || seeds == 0 {
        return false;
    }
    // From the lowest bit: if there is one component, it is reached from any seed.
    if flood(seeds & seeds.wrapping_neg(), rest, grow_6) & seeds != seeds {
        return false;
    }
    flood(object & object.wrapping_neg(), object, grow_26) == object
}

/// The bits that can be reached from a seed within a mask.
#[inline]
fn flood(seed: u32, mask: u32, grow: impl Fn(u32) -> u32) -> u32 {
    let mut reached = seed;
    loop {
        let grown = grow(reached) & mask;
        if grown == reached {
            return reached;
        }
        reached = grown;
    }
}

#[inline]
fn neighbours(bits: u32, axis: usize) -> u32 {
    (bits & NOT_HIGH[axis]) << STEP[axis] | (bits & NOT_LOW[axis]) >> STEP[axis]
}

#[inline]
fn grow_26(bits: u32) -> u32 {
    // Axis after axis, so that diagonal neighbours are reached too.
    (0..3).fold(bits, |bits, axis| bits | neighbours(bits, axis))
}

#[inline]
fn grow_6(bits: u32) -> u32 {
    (0..3).fold(bits, |grown, axis| grown | neighbours(bits, axis))
}

/// Offset of a bit of a neighbourhood.
pub(super) fn offset(bit: u32) -> [i32; 3] {
    [bit as i32 % 3 - 1, bit as i32 / 3 % 3 - 1, bit as i32 / 9 - 1]
}

/// Squared distance of two bits of a neighbourhood, in voxels.
pub(super) fn squared(a: u32, b: u32) -> u8 {
    let (p, q) = (offset(a), offset(b));
    (0..3).map(|axis| (p[axis] - q[axis]).pow(2) as u8).sum()
}

/// Whether the voxels of two bits are equal or have a common corner.
pub(super) fn touch(a: u32, b: u32) -> bool {
    // A difference of two along an axis alone is a squared distance of four.
    squared(a, b) <= 3
}

/// The bits that are set, ascending.
pub(super) fn ones(mut bits: u32) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = (bits != 0).then(|| bits.trailing_zeros())?;
        bits &= bits - 1;
        Some(bit)
    })
}

/// Steps of the range of the keys, -1 to 1.
const BUCKETS: u16 = u16::MAX;

/// Places in the order of their keys, the least first, and of equal keys in the order in which they
/// came.
#[derive(Default)]
struct BucketQueue {
    buckets: BTreeMap<u16, VecDeque<Place>>,
}

impl BucketQueue {
    /// Adds a place; a key outside -1 to 1 counts as the nearer end.
    fn push(&mut self, key: f32, place: Place) {
        // The cast saturates at both ends.
        let bucket = ((key + 1.0) * (f32::from(BUCKETS) / 2.0)) as u16;
        self.buckets.entry(bucket).or_default().push_back(place);
    }

    fn pop(&mut self) -> Option<Place> {
        let mut first = self.buckets.first_entry()?;
        let place = first.get_mut().pop_front();
        if first.get().is_empty() {
            first.remove();
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;
    use rayon::prelude::*;

    use super::*;

    /// Components of bits that are at most a squared distance apart.
    fn components(bits: impl Iterator<Item = u32>, reach: u8) -> Vec<Vec<u32>> {
        bits.fold(Vec::new(), |components, bit| {
            let (joined, mut apart): (Vec<_>, Vec<Vec<u32>>) = components
                .into_iter()
                .partition(|bits: &Vec<u32>| bits.iter().any(|&b| squared(b, bit) <= reach));
            apart.push([joined.concat(), vec![bit]].concat());
            apart
        })
    }

    /// By the definition, one neighbourhood at a time.
    fn is_simple_by_definition(neighbourhood: u32) -> bool {
        let object = ones(neighbourhood & !(1 << CENTRE));
        let rest = (0..27).filter(|&bit| {
            neighbourhood >> bit & 1 == 0 && (1..=2).contains(&squared(bit, CENTRE))
        });
        let at_face = |bits: &Vec<u32>| bits.iter().any(|&bit| squared(bit, CENTRE) == 1);
        components(object, 3).len() == 1
            && components(rest, 1).iter().filter(|bits| at_face(bits)).count() == 1
    }

    #[test]
    fn simple_voxels_have_the_known_count_and_agree_with_the_definition() {
        let mut rng = Pcg64::seed_from_u64(7);
        for k in 0..4000 {
            // Sparse and dense ones too.
            let [word, other] = [(); 2].map(|()| rng.random_range(0..1_u32 << 27));
            let word = [word, word & other, word | other][k % 3];
            assert_eq!(is_simple(word), is_simple_by_definition(word), "{word:027b}");
        }
        let with_centre = |k: u32| (k & 0x1fff) | (k >> 13 << 14);
        let all = (0..1_u32 << 26).into_par_iter().with_min_len(1 << 16);
        assert_eq!(all.filter(|&k| is_simple(with_centre(k))).count(), 25_985_144);
    }

    #[test]
    fn bits_and_offsets_agree() {
        for bit in 0..27 {
            let o = offset(bit);
            for axis in 0..3 {
                assert_eq!(NOT_LOW[axis] >> bit & 1 == 1, o[axis] > -1);
                assert_eq!(NOT_HIGH[axis] >> bit & 1 == 1, o[axis] < 1);
            }
            let distance = squared(bit, CENTRE);
            assert_eq!(NEAREST_18 >> bit & 1 == 1, distance == 1 || distance == 2);
            assert_eq!(FACES >> bit & 1 == 1, distance == 1);
            let [x, y, z] = o;
            let normals = [x, y, z, x - y, x + y, y - z, y + z, z - x, z + x];
            for (plane, along) in PLANES.iter().zip(normals) {
                assert_eq!(plane >> bit & 1 == 1, along == 0 && bit != CENTRE);
            }
        }
    }

    #[test]
    fn places_leave_by_key_and_then_as_they_came() {
        let mut queue = BucketQueue::default();
        let mut rng = Pcg64::seed_from_u64(3);
        let mut expected: Vec<(usize, usize, Place)> = Vec::new();
        for round in 0..20_000 {
            if rng.random_range(0..5) < 3 {
                // Few keys, some of them beyond the range.
                let key = rng.random_range(0..12_usize);
                let place = [round as u16, (round >> 3) as u16, key as u16];
                queue.push((key as f32 - 5.0) * 0.2 * 1.2, place);
                expected.push((key.min(10), round, place));
            } else {
                let least = (0..expected.len()).min_by_key(|&k| (expected[k].0, expected[k].1));
                assert_eq!(queue.pop(), least.map(|k| expected.remove(k).2));
            }
        }
        expected.sort_unstable();
        for (_, _, place) in expected {
            assert_eq!(queue.pop(), Some(place));
        }
        assert_eq!(queue.pop(), None);
    }
}
