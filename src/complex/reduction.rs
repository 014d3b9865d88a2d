//! Rank of a sparse matrix over `Z_2` by column reduction.
//!
//! From left to right, each column is reduced: as long as an earlier reduced column has the same
//! lowest entry, that column is added. The column being reduced is a set of bits with levels of
//! summaries, after U. Bauer, M. Kerber, J. Reininghaus, H. Wagner, "PHAT - Persistent Homology
//! Algorithms Toolbox", Journal of Symbolic Computation 78 (2017),
//! <https://doi.org/10.1016/j.jsc.2016.03.008>. Adding a column costs one step per entry, and finding
//! the largest entry a few steps, whatever the number of rows.

/// Rank over `Z_2` of the matrix whose columns hold one at the listed rows.
///
/// Precondition: each column ascends without repetition.
pub(super) fn rank(columns: &[Vec<u32>]) -> usize {
    let rows = columns.iter().filter_map(|column| column.last()).max().map_or(0, |&row| row + 1);
    let mut with_pivot: Vec<Vec<u32>> = vec![Vec::new(); rows as usize];
    let mut work = BitSet::with_capacity(rows as usize);
    let mut rank = 0;
    for column in columns {
        column.iter().for_each(|&row| work.flip(row));
        while let Some(pivot) = work.largest() {
            let reducer = &mut with_pivot[pivot as usize];
            if reducer.is_empty() {
                *reducer = work.drain();
                rank += 1;
            } else {
                reducer.iter().for_each(|&row| work.flip(row));
            }
        }
    }
    rank
}

/// A set of small integers: a bit for each, and on each level above a bit for each non-zero word.
struct BitSet {
    levels: Vec<Vec<u64>>,
}

impl BitSet {
    fn with_capacity(size: usize) -> Self {
        let mut levels = vec![vec![0; size.div_ceil(64).max(1)]];
        while levels[levels.len() - 1].len() > 1 {
            let above = levels[levels.len() - 1].len().div_ceil(64);
            levels.push(vec![0; above]);
        }
        Self { levels }
    }

    /// Inserts `value` if it is absent, else removes it.
    fn flip(&mut self, value: u32) {
        let mut bit = value as usize;
        for level in &mut self.levels {
            let word = &mut level[bit / 64];
            let was_empty = *word == 0;
            *word ^= 1 << (bit % 64);
            // The level above changes only where a word becomes empty or ceases to be.
            if !was_empty && *word != 0 {
                return;
            }
            bit /= 64;
        }
    }

    fn largest(&self) -> Option<u32> {
        let mut place = 0;
        for level in self.levels.iter().rev() {
            let word = level[place];
            if word == 0 {
                return None;
            }
            place = place * 64 + 63 - word.leading_zeros() as usize;
        }
        Some(place as u32)
    }

    /// All members, the largest first, and leaves the set empty.
    fn drain(&mut self) -> Vec<u32> {
        let mut members = Vec::new();
        while let Some(largest) = self.largest() {
            members.push(largest);
            self.flip(largest);
        }
        members
    }
}
