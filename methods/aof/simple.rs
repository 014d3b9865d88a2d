//! Simple voxels: those whose removal keeps the homotopy type, with 26-connectivity for the object
//! and 6-connectivity for the background.
//!
//! G. Malandain, G. Bertrand, *Fast characterization of 3D simple points*, ICPR 1992,
//! doi:10.1109/ICPR.1992.201968; the criterion is that of G. Bertrand, G. Malandain, *A new
//! characterization of three-dimensional simple points*, Pattern Recognition Letters 15(2), 1994,
//! doi:10.1016/0167-8655(94)90046-9: a voxel is simple if and only if
//!
//! - `C* = 1`: its object neighbours are one 26-connected component, and
//! - `C- = 1`: the background voxels among its 18 nearest neighbours have one 6-connected component
//!   that contains a 6-neighbour of it.
//!
//! Exactly 25,985,144 of the `2^26` neighbourhoods are simple.
//!
//! A *neighbourhood* is 27 bits: bit `dx + 1 + 3 (dy + 1) + 9 (dz + 1)`. Bit 13 is the voxel itself and
//! does not matter. The table has one bit for each neighbourhood. It is built 64 at a time, with one
//! word per neighbour: bit `i` of the word tells whether the neighbour is in the `i`-th neighbourhood.

use std::sync::OnceLock;

use rayon::prelude::*;

/// Bit of the voxel itself.
pub const CENTRE: u32 = 13;
/// Number of neighbourhoods.
pub const NEIGHBOURHOODS: usize = 1 << 26;

/// Whether each neighbourhood is simple: 8 MiB.
pub struct SimpleTable {
    words: Vec<u64>,
}

impl SimpleTable {
    /// The table, built on first use.
    pub fn get() -> &'static Self {
        static TABLE: OnceLock<SimpleTable> = OnceLock::new();
        TABLE.get_or_init(|| {
            let words = (0..NEIGHBOURHOODS as u32 / 64).into_par_iter().map(simple_word);
            Self { words: words.collect() }
        })
    }

    /// Whether a voxel with this neighbourhood is simple.
    #[inline]
    pub fn is_simple(&self, neighbourhood: u32) -> bool {
        let index = without_centre(neighbourhood);
        self.words[(index >> 6) as usize] >> (index & 63) & 1 == 1
    }

    /// Number of simple neighbourhoods.
    pub fn count(&self) -> u64 {
        self.words.iter().map(|word| u64::from(word.count_ones())).sum()
    }
}

/// Layers of a neighbourhood without its lowest and its highest column, row and layer.
const NOT_LOW: [u32; 3] = [0o666_666_666, 0o770_770_770, 0o777_777_000];
const NOT_HIGH: [u32; 3] = [0o333_333_333, 0o077_077_077, 0o000_777_777];
/// How far a step along each axis moves a bit.
const STEP: [u32; 3] = [1, 3, 9];
/// The 18 nearest neighbours, and of them the six nearest.
const NEAREST_18: u32 = 0o272_757_272;
const NEAREST_6_BITS: u32 = 1 << 4 | 1 << 10 | 1 << 12 | 1 << 14 | 1 << 16 | 1 << 22;

/// Whether a voxel with this neighbourhood is simple, without the table: some 100 operations.
#[inline]
pub fn is_simple(neighbourhood: u32) -> bool {
    let object = neighbourhood & 0x7ff_ffff & !(1 << CENTRE);
    let rest = !neighbourhood & NEAREST_18;
    let seeds = rest & NEAREST_6_BITS;
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

/// The 26 neighbours as consecutive bits.
#[inline]
pub fn without_centre(neighbourhood: u32) -> u32 {
    (neighbourhood & ((1 << CENTRE) - 1)) | (neighbourhood >> 14 << 13)
}

/// Offset of a bit of a neighbourhood.
pub const fn offset(bit: u32) -> [i32; 3] {
    [bit as i32 % 3 - 1, bit as i32 / 3 % 3 - 1, bit as i32 / 9 - 1]
}

/// Which neighbours touch each other, as masks of 27 bits: by faces, edges or corners (`26`), or
/// by faces alone, among the 18 nearest (`6`).
struct Adjacency {
    by_26: [u32; 27],
    by_6: [u32; 27],
}

const ADJACENCY: Adjacency = adjacency();
/// The six nearest neighbours.
const NEAREST_6: [usize; 6] = [4, 10, 12, 14, 16, 22];

const fn adjacency() -> Adjacency {
    let mut table = Adjacency { by_26: [0; 27], by_6: [0; 27] };
    let mut a = 0;
    while a < 27 {
        let mut b = 0;
        while b < 27 {
            let (p, q) = (offset(a), offset(b));
            let d = [(p[0] - q[0]).abs(), (p[1] - q[1]).abs(), (p[2] - q[2]).abs()];
            let near = d[0] <= 1 && d[1] <= 1 && d[2] <= 1;
            if a != b && a != CENTRE && b != CENTRE && near {
                table.by_26[a as usize] |= 1 << b;
                let far_p = p[0] != 0 && p[1] != 0 && p[2] != 0;
                let far_q = q[0] != 0 && q[1] != 0 && q[2] != 0;
                if d[0] + d[1] + d[2] == 1 && !far_p && !far_q {
                    table.by_6[a as usize] |= 1 << b;
                }
            }
            b += 1;
        }
        a += 1;
    }
    table
}

/// The 64 bits of the table from neighbourhood `64 word` on.
fn simple_word(word: u32) -> u64 {
    // Bit `i` of these is bit `k` of `i`.
    const LOW: [u64; 6] = [
        0xaaaa_aaaa_aaaa_aaaa,
        0xcccc_cccc_cccc_cccc,
        0xf0f0_f0f0_f0f0_f0f0,
        0xff00_ff00_ff00_ff00,
        0xffff_0000_ffff_0000,
        0xffff_ffff_0000_0000,
    ];
    let mut object = [0_u64; 27];
    let bits = (0..27).filter(|&bit| bit != CENTRE as usize);
    for (k, bit) in bits.enumerate() {
        object[bit] = match k {
            0..6 => LOW[k],
            _ => 0_u64.wrapping_sub(u64::from(word >> (k - 6) & 1)),
        };
    }
    let mut background = object.map(|plane| !plane);
    background[CENTRE as usize] = 0;
    one_component(&object, &(0..27).collect::<Vec<_>>(), &ADJACENCY.by_26, true)
        & one_component(&background, &NEAREST_6, &ADJACENCY.by_6, false)
}

/// The graphs, of 64 at once, in which at least one vertex of `seeds` exists and all that exist are
/// connected with each other. With `all`, `seeds` are all vertices.
fn one_component(there: &[u64; 27], seeds: &[usize], near: &[u32; 27], all: bool) -> u64 {
    debug_assert!(!all || seeds.len() == 27);
    let mut reached = [0_u64; 27];
    let mut any = 0;
    for &seed in seeds {
        reached[seed] = there[seed] & !any;
        any |= there[seed];
    }
    loop {
        let mut grown = 0;
        // Forward and backward, so that paths in either direction are followed in one round.
        for vertex in (0..27).chain((0..27).rev()) {
            let open = there[vertex] & !reached[vertex];
            if open == 0 {
                continue;
            }
            let (mut mask, mut around) = (near[vertex], 0);
            while mask != 0 {
                around |= reached[mask.trailing_zeros() as usize];
                mask &= mask - 1;
            }
            reached[vertex] |= open & around;
            grown |= open & around;
        }
        if grown == 0 {
            break;
        }
    }
    let missed = seeds.iter().fold(0, |missed, &seed| missed | (there[seed] & !reached[seed]));
    any & !missed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the definition, one neighbourhood at a time.
    fn is_simple_by_definition(neighbourhood: u32) -> bool {
        let components =
            |bits: &[u32], near: &dyn Fn([i32; 3]) -> bool, counts: &dyn Fn(u32) -> bool| {
                let mut label: Vec<usize> = (0..bits.len()).collect();
                for _ in 0..bits.len() {
                    for i in 0..bits.len() {
                        for j in 0..bits.len() {
                            let (p, q) = (offset(bits[i]), offset(bits[j]));
                            if near([0, 1, 2].map(|k| (p[k] - q[k]).abs())) {
                                label[i] = label[i].min(label[j]);
                            }
                        }
                    }
                }
                let mut labels: Vec<usize> =
                    (0..bits.len()).filter(|&i| counts(bits[i])).map(|i| label[i]).collect();
                labels.sort_unstable();
                labels.dedup();
                labels.len()
            };
        let norm = |bit: u32| offset(bit).iter().map(|x| x.abs()).sum::<i32>();
        let around = || (0..27).filter(|&bit| bit != CENTRE);
        let object: Vec<u32> = around().filter(|&bit| neighbourhood >> bit & 1 == 1).collect();
        let rest: Vec<u32> =
            around().filter(|&bit| neighbourhood >> bit & 1 == 0 && norm(bit) <= 2).collect();
        components(&object, &|d| d.iter().all(|&x| x <= 1), &|_| true) == 1
            && components(&rest, &|d| d.iter().sum::<i32>() <= 1, &|bit| norm(bit) == 1) == 1
    }

    #[test]
    fn the_table_has_the_known_count_and_agrees_with_the_definition() {
        let table = SimpleTable::get();
        assert_eq!(table.count(), 25_985_144);
        let mut state = 7_u32;
        for k in 0..4000_u32 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // Sparse and dense ones too.
            let word = (state >> 3) & if k % 3 == 0 { state.rotate_left(9) } else { u32::MAX };
            let word = (if k % 3 == 1 { word | state.rotate_left(17) } else { word }) & 0x7ff_ffff;
            assert_eq!(table.is_simple(word), is_simple_by_definition(word), "{word:027b}");
        }
        // Both ways to tell, everywhere.
        let with_centre = |k: u32| (k & 0x1fff) | (k >> 13 << 14);
        let differs = |&k: &u32| is_simple(with_centre(k)) != table.is_simple(with_centre(k));
        assert_eq!((0..NEIGHBOURHOODS as u32).into_par_iter().find_any(differs), None);
    }

    #[test]
    fn bits_and_offsets_agree() {
        for bit in 0..27 {
            let o = offset(bit);
            for axis in 0..3 {
                assert_eq!(NOT_LOW[axis] >> bit & 1 == 1, o[axis] > -1);
                assert_eq!(NOT_HIGH[axis] >> bit & 1 == 1, o[axis] < 1);
            }
            let steps = o.iter().map(|x| x.abs()).sum::<i32>();
            assert_eq!(NEAREST_18 >> bit & 1 == 1, steps == 1 || steps == 2);
            assert_eq!(NEAREST_6_BITS >> bit & 1 == 1, steps == 1);
        }
    }
}
