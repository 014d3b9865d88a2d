//! The choice of Coverage Axis++: one sphere after the other, by a score of three parts.

use medial::complex::Sphere;
use medial::simplifier::{RunContext, SimplifyError};
use rayon::prelude::*;

use super::coverage::{Coverage, common, size, subtract};
use super::params::{CoverageAxisParams, Penalty};

/// Candidates that one task scores.
const TASK: usize = 4096;

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

/// Weights and penalty of the score.
pub(super) struct Score {
    uniformity: f64,
    /// What a candidate's radius costs it, with its weight.
    penalties: Vec<f64>,
}

impl Score {
    /// The constant part of the score of all candidates.
    pub fn new(spheres: &[Sphere], params: &CoverageAxisParams) -> Self {
        let largest = spheres.iter().map(|ball| ball.radius).fold(0.0, f64::max);
        let mut penalties: Vec<f64> = match params.penalty {
            Penalty::Ratio => spheres.iter().map(|ball| 0.1 * largest / ball.radius).collect(),
            Penalty::Stand => {
                let inverse: Vec<f64> = spheres.iter().map(|ball| 1.0 / ball.radius).collect();
                let scale = Standard::of(inverse.iter().copied());
                inverse.iter().map(|&x| scale.score(x)).collect()
            }
        };
        penalties.iter_mut().for_each(|penalty| *penalty *= params.centrality);
        Self { uniformity: params.uniformity, penalties }
    }
}

/// Takes candidates until everything that can be covered is, or `limit` are taken.
///
/// In every step all candidates are scored: the number of uncovered samples that they cover plus their
/// distance to what is chosen, each standardised over all candidates, less the penalty. A candidate is
/// taken once; of equal scores the first wins.
///
/// # Cost
/// `O(n m / 64)` for each step, with `n` candidates and `m` samples.
pub(super) fn choose(
    spheres: &[Sphere],
    coverage: &Coverage,
    score: &Score,
    limit: usize,
    run: &RunContext,
) -> Result<Picks, SimplifyError> {
    let mut uncovered = coverage.coverable();
    let uncoverable = coverage.columns() - size(&uncovered);
    let mut left = size(&uncovered);
    let mut is_chosen = vec![false; spheres.len()];
    // Squared distances to the nearest sphere chosen; none yet.
    let mut nearest = vec![f64::INFINITY; spheres.len()];
    let mut counts = vec![0_u32; spheres.len()];
    let mut chosen = Vec::new();
    let total = left;
    while left > 0 && chosen.len() < limit.min(spheres.len()) {
        run.step(total - left, total)?;
        counts.par_iter_mut().with_min_len(TASK).enumerate().for_each(|(ball, count)| {
            *count = common(coverage.row(ball), &uncovered) as u32;
        });
        let best = best(&counts, &nearest, &is_chosen, score, chosen.is_empty());
        let centre = spheres[best].centre;
        nearest.par_iter_mut().with_min_len(TASK).zip(spheres).for_each(|(nearest, ball)| {
            *nearest = nearest.min(ball.centre.distance_squared(centre));
        });
        subtract(&mut uncovered, coverage.row(best));
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
    score: &Score,
    is_first: bool,
) -> usize {
    let by_count = Standard::of(counts.iter().map(|&count| f64::from(count)));
    // Nothing is chosen in the first step, so no distance counts.
    let by_distance = match is_first {
        true => Standard::constant(),
        false => Standard::of(nearest.iter().map(|squared| squared.sqrt())),
    };
    let value = |ball: usize| {
        let distance = if is_first { 0.0 } else { nearest[ball].sqrt() };
        by_count.score(f64::from(counts[ball])) + score.uniformity * by_distance.score(distance)
            - score.penalties[ball]
    };
    let free = (0..counts.len()).filter(|&ball| !is_chosen[ball]);
    // `max_by` takes the last of equals, the authors' `argmax` the first.
    let best = free.map(|ball| (value(ball), ball)).reduce(|a, b| if b.0 > a.0 { b } else { a });
    best.expect("fewer are chosen than there are").1
}

/// Mean and standard deviation of a value over all candidates.
struct Standard {
    mean: f64,
    deviation: f64,
}

impl Standard {
    /// With the divisor `n - 1`. One thread: sums in another order would be other scores.
    fn of(values: impl ExactSizeIterator<Item = f64> + Clone) -> Self {
        let count = values.len() as f64;
        let mean = values.clone().sum::<f64>() / count;
        let squares: f64 = values.map(|value| (value - mean) * (value - mean)).sum();
        Self { mean, deviation: (squares / (count - 1.0).max(1.0)).sqrt() }
    }

    /// Of a value that has no part in the score.
    fn constant() -> Self {
        Self { mean: 0.0, deviation: 0.0 }
    }

    /// 0 where all values are equal: the quotient of the formula is then 0/0.
    fn score(&self, value: f64) -> f64 {
        if self.deviation > 0.0 { (value - self.mean) / self.deviation } else { 0.0 }
    }
}
