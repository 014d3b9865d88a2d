//! The coverage matrix: which inflated ball contains which sample, as rows of bits.

use medial::Vec3;
use medial::complex::Sphere;
use medial::simplifier::RunContext;
use rayon::prelude::*;

use crate::Result;

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
        // Bits beyond the last sample stay 0, so that counts of bits are counts of samples.
        let width = samples.len().div_ceil(WORD);
        let mut words = vec![0; width * balls.len()];
        let rows = words.par_chunks_mut(width.max(1) * ROWS).zip(balls.par_chunks(ROWS));
        rows.for_each(|(rows, balls)| {
            for (row, ball) in rows.chunks_mut(width).zip(balls) {
                let reach = ball.radius + delta;
                // A word at a time in a register: the loop over its samples has no branch.
                for (word, samples) in row.iter_mut().zip(samples.chunks(WORD)) {
                    *word = samples.iter().enumerate().fold(0, |word, (i, p)| {
                        let is_covered = p.distance_squared(ball.centre) < reach * reach;
                        word | u64::from(is_covered) << i
                    });
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

// ----------------------------------------------------------------------------
// The choice of Coverage Axis++: one sphere after the other, by a score of three parts.

/// The spheres chosen, in the order in which they were.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Picks {
    /// Indices of candidates.
    pub chosen: Vec<u32>,
    /// Samples that could be covered and are not.
    pub uncovered: usize,
    /// Samples that no candidate covers.
    pub uncoverable: usize,
}

/// The constant part of the score: the penalty of each candidate's radius, `0.1 max r / r`, as the scripts call it.
pub(super) fn penalties(spheres: &[Sphere]) -> Vec<f64> {
    let largest = spheres.iter().map(|ball| ball.radius).fold(0.0, f64::max);
    spheres.iter().map(|ball| 0.1 * largest / ball.radius).collect()
}

/// Takes candidates until everything that can be covered is, or `limit` are taken.
///
/// In every step all candidates are scored: the number of uncovered samples that they cover plus their
/// distance to the chosen candidates, each standardised over all candidates, less the penalty. A candidate is
/// taken once; of equal scores the first wins.
///
/// # Cost
/// `O(n)` for each step, with `n` candidates, and for all steps together one for each candidate and
/// sample that it covers.
pub(super) fn choose(
    spheres: &[Sphere],
    coverage: &Coverage,
    penalties: &[f64],
    limit: usize,
    run: &RunContext,
) -> Result<Picks> {
    let mut uncovered = coverage.coverable();
    let uncoverable = coverage.columns() - size(&uncovered);
    let mut left = size(&uncovered);
    let mut is_chosen = vec![false; spheres.len()];
    // Distances to the nearest sphere chosen; none yet.
    let mut nearest = vec![f64::INFINITY; spheres.len()];
    // Each sample is covered once, and then only the candidates that cover it too are counted down.
    let covering = coverage.transposed();
    let mut counts: Vec<u32> =
        (0..spheres.len()).map(|ball| size(coverage.row(ball)) as u32).collect();
    let mut chosen = Vec::new();
    let total = left;
    while left > 0 && chosen.len() < limit.min(spheres.len()) {
        run.step(total - left, total)?;
        let best = best(&counts, &nearest, &is_chosen, penalties, chosen.is_empty());
        let centre = spheres[best].centre;
        for (nearest, ball) in nearest.iter_mut().zip(spheres) {
            let squared = ball.centre.distance_squared(centre);
            // Seldom, so that few roots are taken.
            if squared < *nearest * *nearest {
                *nearest = nearest.min(squared.sqrt());
            }
        }
        let mut fresh = coverage.row(best).to_vec();
        fresh.iter_mut().zip(&uncovered).for_each(|(a, b)| *a &= b);
        for ball in ones(&fresh).flat_map(|sample| ones(covering.row(sample))) {
            counts[ball] -= 1;
        }
        subtract(&mut uncovered, &fresh);
        left = size(&uncovered);
        is_chosen[best] = true;
        chosen.push(best as u32);
    }
    run.step(total - left, total)?;
    Ok(Picks { chosen, uncovered: left, uncoverable })
}

/// The candidate of the largest score.
fn best(
    counts: &[u32],
    nearest: &[f64],
    is_chosen: &[bool],
    penalties: &[f64],
    is_first: bool,
) -> usize {
    let both = counts.iter().zip(nearest);
    let [by_count, mut by_distance] = Standard::of(both.map(|(&c, &d)| [f64::from(c), d]));
    // Nothing is chosen in the first step, so no distance counts.
    if is_first {
        by_distance = Standard { mean: 0.0, deviation: 0.0 };
    }
    let free = (0..counts.len()).filter(|&ball| !is_chosen[ball]);
    let scored = free.map(|ball| {
        let distance = if is_first { 0.0 } else { nearest[ball] };
        let value =
            by_count.score(f64::from(counts[ball])) + by_distance.score(distance) - penalties[ball];
        (value, ball)
    });
    // `max_by` takes the last of equals, the authors' `argmax` the first.
    let best = scored.reduce(|a, b| if b.0 > a.0 { b } else { a });
    best.expect("fewer are chosen than there are").1
}

/// Mean and standard deviation of a value over all candidates.
struct Standard {
    mean: f64,
    deviation: f64,
}

impl Standard {
    /// Those of `K` values of each candidate, with the divisor `n - 1`. One thread: sums in another
    /// order would be other scores.
    fn of<const K: usize>(values: impl ExactSizeIterator<Item = [f64; K]> + Clone) -> [Self; K] {
        let count = values.len() as f64;
        let (mut means, mut squares) = ([0.0; K], [0.0; K]);
        for values in values.clone() {
            (0..K).for_each(|k| means[k] += values[k]);
        }
        means.iter_mut().for_each(|mean| *mean /= count);
        for values in values {
            (0..K).for_each(|k| squares[k] += (values[k] - means[k]) * (values[k] - means[k]));
        }
        let deviations = squares.map(|squares| (squares / (count - 1.0).max(1.0)).sqrt());
        std::array::from_fn(|k| Self { mean: means[k], deviation: deviations[k] })
    }

    /// 0 where all values are equal: the quotient of the formula is then 0/0.
    fn score(&self, value: f64) -> f64 {
        if self.deviation > 0.0 { (value - self.mean) / self.deviation } else { 0.0 }
    }
}
