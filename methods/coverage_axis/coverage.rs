//! The coverage matrix: which inflated ball contains which sample, as rows of bits.

use medial::Vec3;
use medial::complex::Sphere;
use rayon::prelude::*;

/// Bits of a word.
pub(super) const WORD: usize = 64;

/// Rows that one task fills.
const ROWS: usize = 256;

/// A set of samples, or of balls.
pub(super) type Bits = [u64];

/// A matrix of bits with a row for each ball and a column for each sample.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coverage {
    words: Vec<u64>,
    /// Words of a row.
    width: usize,
    columns: usize,
}

impl Coverage {
    /// Sets the bit of ball `j` and sample `i` where `|p_i - c_j| < r_j + delta`: strictly, as the
    /// authors' Python has it.
    ///
    /// # Cost
    /// `O(samples * balls)` and a bit each, in parallel.
    pub fn new(samples: &[Vec3], balls: &[Sphere], delta: f64) -> Self {
        let width = samples.len().div_ceil(WORD);
        let mut words = vec![0; width * balls.len()];
        let rows = words.par_chunks_mut(width.max(1) * ROWS).zip(balls.par_chunks(ROWS));
        rows.for_each(|(rows, balls)| {
            for (row, ball) in rows.chunks_mut(width).zip(balls) {
                let reach = ball.radius + delta;
                // A word at a time in a register: the loop over its samples has no branch.
                for (word, samples) in row.iter_mut().zip(samples.chunks(WORD)) {
                    let covers = |p: &Vec3| p.distance_squared(ball.centre) < reach * reach;
                    let bits = samples.iter().enumerate().map(|(i, p)| u64::from(covers(p)) << i);
                    *word = bits.fold(0, |word, bit| word | bit);
                }
            }
        });
        Self { words, width, columns: samples.len() }
    }

    /// Number of balls.
    pub fn rows(&self) -> usize {
        self.words.len().checked_div(self.width).unwrap_or(0)
    }

    /// Number of samples.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The samples that a ball covers.
    pub fn row(&self, ball: usize) -> &Bits {
        &self.words[ball * self.width..][..self.width]
    }

    /// The samples that any ball covers.
    pub fn coverable(&self) -> Vec<u64> {
        let mut all = vec![0; self.width];
        (0..self.rows()).for_each(|ball| unite(&mut all, self.row(ball)));
        all
    }

    /// The matrix with rows and columns exchanged: which balls cover a sample.
    pub fn transposed(&self) -> Self {
        let (rows, columns) = (self.columns, self.rows());
        let width = columns.div_ceil(WORD);
        let mut words = vec![0; width * rows];
        for ball in 0..columns {
            for sample in ones(self.row(ball)) {
                words[sample * width + ball / WORD] |= 1 << (ball % WORD);
            }
        }
        Self { words, width, columns }
    }
}

/// The members of a set, ascending.
pub(super) fn ones(bits: &Bits) -> impl Iterator<Item = usize> + '_ {
    bits.iter().enumerate().flat_map(|(place, &word)| {
        // Clearing the lowest bit that is set gives the next word.
        let words = std::iter::successors(Some(word), |w| Some(w & w.wrapping_sub(1)));
        let words = words.take_while(|&w| w != 0);
        words.map(move |w| place * WORD + w.trailing_zeros() as usize)
    })
}

/// Number of members.
pub(super) fn size(bits: &Bits) -> usize {
    bits.iter().map(|word| word.count_ones() as usize).sum()
}

/// Number of members of both.
pub(super) fn common(a: &Bits, b: &Bits) -> usize {
    a.iter().zip(b).map(|(a, b)| (a & b).count_ones() as usize).sum()
}

/// Whether all members of `a` are in `b`.
pub(super) fn is_subset(a: &Bits, b: &Bits) -> bool {
    a.iter().zip(b).all(|(a, b)| a & !b == 0)
}

/// Adds the members of `more`.
pub(super) fn unite(bits: &mut Bits, more: &Bits) {
    bits.iter_mut().zip(more).for_each(|(a, b)| *a |= b);
}

/// Removes the members of `less`.
pub(super) fn subtract(bits: &mut Bits, less: &Bits) {
    bits.iter_mut().zip(less).for_each(|(a, b)| *a &= !b);
}
