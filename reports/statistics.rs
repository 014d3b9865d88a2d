//! Which differences between methods are established: paired tests over meshes, and intervals of ratios.
//!
//! Two methods are compared on the meshes that both ran on, by the logarithm of the ratio of their values. A missing result
//! counts as infinite, so it is among the largest differences; meshes where both have none, or equal values, have no sign.
//!
//! 1. Wilcoxon, 1945, "Individual comparisons by ranking methods": the signed-rank test, two-sided. The distribution of the
//!    rank sum is exact, also for ties; above [`MOST_EXACT`] differences it is the normal one, corrected for ties.
//! 2. Holm, 1979, "A simple sequentially rejective multiple test procedure": p-values for all pairs of methods.
//! 3. Efron, 1979, "Bootstrap methods": percentiles of the geometric mean over resampled meshes.
//!
//! `scripts/check_statistics.py` computes the same with SciPy.

use medial::geometry::hash::splitmix;
use medial_run::text::significant;

use crate::metric::Mean;

/// Probability of calling any difference of a table established although there is none.
pub(crate) const LEVEL: f64 = 0.05;

/// Meshes that a test and an interval need: with fewer, no two-sided test reaches [`LEVEL`].
pub(crate) const FEWEST: usize = 6;

/// Differences up to which the rank sum has its exact distribution.
const MOST_EXACT: usize = 100;

/// Resampled sets of meshes for an interval, and their seed.
const RESAMPLES: usize = 2_000;
const SEED: u64 = 0;

/// For each mesh the value of a method, infinite without a result; `None` where the method did not run.
pub(crate) type Sample = Vec<Option<f64>>;

/// The geometric mean of one ratio for each mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ratio {
    pub(crate) value: f64,
    /// Number of meshes.
    pub(crate) meshes: usize,
    /// The 95 % interval over meshes.
    pub(crate) interval: Option<[f64; 2]>,
}

impl Ratio {
    /// From the logarithms of the ratios; `None` without any.
    pub(crate) fn of_logs(logs: &[f64]) -> Option<Self> {
        let (value, meshes) = (Mean::Arithmetic.of(logs)?.exp(), logs.len());
        Some(Self { value, meshes, interval: interval_of_logs(logs) })
    }

    /// The mean with some digits, and its interval: `0.205 [0.17, 0.25]`.
    pub(crate) fn text(&self, digits: usize) -> String {
        let ends = self.interval.map(|ends| ends.map(|end| significant(end, 2)).join(", "));
        let ends = ends.map_or_else(String::new, |ends| format!(" [{ends}]"));
        significant(self.value, digits) + &ends
    }
}

/// Two methods on the meshes that both ran on.
#[derive(Clone, Debug)]
pub(crate) struct Paired {
    /// Meshes where the first has the smaller value, where both are equal, and where it has the larger one.
    pub(crate) outcomes: [usize; 3],
    /// The ratio of the first to the second, over the meshes where both have a result.
    pub(crate) ratio: Option<Ratio>,
    /// Share of the rank sum in favour of the first minus that in favour of the second.
    pub(crate) effect: f64,
    /// Probability of a rank sum at least as extreme if no method is better.
    pub(crate) p: f64,
    /// The same, corrected for all pairs of the table.
    pub(crate) corrected: f64,
}

impl Paired {
    fn of(first: &Sample, second: &Sample) -> Self {
        let pairs = first.iter().zip(second).filter_map(|(a, b)| Some([(*a)?, (*b)?]));
        // A mesh without a result of either is left out. A perfect result is zero, which has no logarithm.
        let pairs = pairs.filter(|[a, b]| a.is_finite() || b.is_finite());
        let differences: Vec<f64> = pairs
            .map(|[a, b]| if a == b { 0.0 } else { a.max(1e-9).ln() - b.max(1e-9).ln() })
            .collect();
        let count = |is: fn(&f64) -> bool| differences.iter().filter(|d| is(d)).count();
        let outcomes = [count(|&d| d < 0.0), count(|&d| d == 0.0), count(|&d| d > 0.0)];
        let finite: Vec<f64> = differences.iter().copied().filter(|d| d.is_finite()).collect();
        let (effect, p) = signed_ranks(&differences);
        Self { outcomes, ratio: Ratio::of_logs(&finite), effect, p, corrected: p }
    }

    /// The second in relation to the first.
    fn inverse(mut self) -> Self {
        self.outcomes.reverse();
        let ratio = self.ratio.map(|Ratio { value, meshes, interval }| {
            let interval = interval.map(|[low, high]| [high.recip(), low.recip()]);
            Ratio { value: value.recip(), meshes, interval }
        });
        Self { ratio, effect: 0.0 - self.effect, ..self }
    }

    /// Meshes with a result of either.
    pub(crate) fn meshes(&self) -> usize {
        self.outcomes.iter().sum()
    }

    /// Whether the difference is larger than chance explains.
    pub(crate) fn is_established(&self) -> bool {
        self.meshes() >= FEWEST && self.corrected < LEVEL
    }
}

/// All pairs of some methods, with corrected p-values.
pub(crate) struct Pairs {
    /// The series, in the order of the request.
    pub(crate) series: Vec<usize>,
    /// By rows: the first method with each later one.
    pub(crate) pairs: Vec<Paired>,
}

impl Pairs {
    /// The pairs of some series, with the values of all series.
    pub(crate) fn of(series: Vec<usize>, values: &[Sample]) -> Self {
        let firsts = series.iter().enumerate();
        let pairs = firsts.flat_map(|(k, &a)| series[k + 1..].iter().map(move |&b| (a, b)));
        let mut pairs: Vec<Paired> =
            pairs.map(|(a, b)| Paired::of(&values[a], &values[b])).collect();
        let corrected = holm(&pairs.iter().map(|pair| pair.p).collect::<Vec<_>>());
        pairs.iter_mut().zip(corrected).for_each(|(pair, p)| pair.corrected = p);
        Self { series, pairs }
    }

    /// One of the series in relation to another one; `None` for itself and for others.
    pub(crate) fn between(&self, a: usize, b: usize) -> Option<Paired> {
        let place = |series| self.series.iter().position(|&other| other == series);
        let [low, high] = [place(a)?.min(place(b)?), place(a)?.max(place(b)?)];
        let size = self.series.len();
        let pair = (low < high)
            .then(|| self.pairs[low * (2 * size - low - 1) / 2 + high - low - 1].clone())?;
        Some(if self.series[low] == a { pair } else { pair.inverse() })
    }

    /// The series that one is not established to differ from.
    pub(crate) fn alike(&self, a: usize) -> Vec<usize> {
        let is_alike = |b: &usize| self.between(a, *b).is_some_and(|pair| !pair.is_established());
        self.series.iter().copied().filter(is_alike).collect()
    }
}

/// The effect and the two-sided p-value of the signed-rank test. Zeros are left out.
fn signed_ranks(differences: &[f64]) -> (f64, f64) {
    let mut sorted: Vec<f64> = differences.iter().copied().filter(|&d| d != 0.0).collect();
    sorted.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let size = sorted.len();
    // Twice the ranks, so that the mean rank of a tie is whole.
    let (mut ranks, mut ties) = (Vec::with_capacity(size), 0.0);
    for tie in sorted.chunk_by(|a, b| a.abs() == b.abs()) {
        let (before, length) = (ranks.len(), tie.len());
        ranks.extend(std::iter::repeat_n(2 * before + length + 1, length));
        ties += (length * length * length - length) as f64;
    }
    let total: usize = ranks.iter().sum();
    if total == 0 {
        return (0.0, 1.0);
    }
    let positive: usize =
        sorted.iter().zip(&ranks).filter(|(d, _)| **d > 0.0).map(|(_, r)| r).sum();
    let effect = 1.0 - 2.0 * positive as f64 / total as f64;
    if size > MOST_EXACT {
        let n = size as f64;
        let variance = n * (n + 1.0) * (2.0 * n + 1.0) / 24.0 - ties / 48.0;
        let z = (positive as f64 - total as f64 / 2.0).abs() / 2.0 / variance.sqrt();
        return (effect, libm::erfc(z / std::f64::consts::SQRT_2));
    }
    // Probability of each sum when signs are fair coins.
    let mut sums = vec![0.0; total + 1];
    sums[0] = 1.0;
    let mut reach = 0;
    for rank in ranks {
        reach += rank;
        for sum in (0..=reach).rev() {
            sums[sum] = 0.5 * (sums[sum] + if sum >= rank { sums[sum - rank] } else { 0.0 });
        }
    }
    let tail = |range: &[f64]| range.iter().sum::<f64>();
    (effect, (2.0 * tail(&sums[..=positive]).min(tail(&sums[positive..]))).min(1.0))
}

/// p-values corrected for their number by Holm's step-down procedure.
fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let (mut corrected, mut largest) = (vec![0.0; p.len()], 0.0f64);
    for (k, &i) in order.iter().enumerate() {
        largest = largest.max((p.len() - k) as f64 * p[i]).min(1.0);
        corrected[i] = largest;
    }
    corrected
}

/// The 95 % interval of a geometric mean over meshes; `None` of fewer than [`FEWEST`] positive values.
pub(crate) fn interval(values: &[f64]) -> Option<[f64; 2]> {
    let logs: Vec<f64> = values.iter().filter(|v| **v > 0.0).map(|value| value.ln()).collect();
    interval_of_logs(&logs)
}

fn interval_of_logs(logs: &[f64]) -> Option<[f64; 2]> {
    (logs.len() >= FEWEST).then(|| {
        // SplitMix64 of Steele et al., 2014: a few lines in any language repeat it.
        let mut state = SEED;
        let mut below = |size: usize| {
            let random = splitmix(state);
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            ((u128::from(random) * size as u128) >> 64) as usize
        };
        let mut means: Vec<f64> = (0..RESAMPLES)
            .map(|_| {
                (0..logs.len()).map(|_| logs[below(logs.len())]).sum::<f64>() / logs.len() as f64
            })
            .collect();
        means.sort_by(f64::total_cmp);
        [0.025, 0.975].map(|share| {
            let place = share * (RESAMPLES - 1) as f64;
            let (low, part) = (means[place as usize], place.fract());
            (low + part * (means[place as usize + 1] - low)).exp()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signed_ranks_equal_enumeration() {
        // All signs of ranks with ties, counted one by one.
        let differences = [0.5, -1.0, 1.0, 2.0, 2.0, -3.0, 4.0, 0.0, f64::INFINITY, f64::INFINITY];
        let ranks = [1.0, 2.5, 2.5, 4.5, 4.5, 6.0, 7.0, 8.5, 8.5];
        let found: f64 = 45.0 - 2.5 - 6.0;
        let sum = |signs: u32| -> f64 {
            (0..9).filter(|k| signs >> k & 1 == 1).map(|k| ranks[k as usize]).sum()
        };
        let extreme = (0..512).filter(|&signs| sum(signs) >= found).count();
        let (effect, p) = signed_ranks(&differences);
        assert!((p - 2.0 * extreme as f64 / 512.0).abs() < 1e-12, "{p}");
        assert!((effect - (8.5 - found) / 45.0).abs() < 1e-12, "{effect}");
        assert_eq!(signed_ranks(&[0.0, 0.0]), (0.0, 1.0));
    }

    #[test]
    fn the_normal_distribution_continues_the_exact_one() {
        let mut differences: Vec<f64> =
            (1..=MOST_EXACT).map(|k| k as f64 * if k % 5 < 2 { -1.0 } else { 1.0 }).collect();
        let exact = signed_ranks(&differences).1;
        differences.push(0.5);
        let normal = signed_ranks(&differences).1;
        assert!((exact / normal - 1.0).abs() < 0.1, "{exact} {normal}");
    }

    #[test]
    fn holm_steps_down() {
        let corrected = holm(&[0.01, 0.04, 0.03, 0.005]);
        let expected = [0.03, 0.06, 0.06, 0.02];
        assert!(
            corrected.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
            "{corrected:?}"
        );
    }

    #[test]
    fn intervals_hold_the_mean_and_need_six_meshes() {
        let values = [0.2, 0.25, 0.3, 0.2, 0.4, 0.22, 0.31];
        let [low, high] = interval(&values).unwrap();
        assert!(0.2 < low && low < 0.26 && 0.26 < high && high < 0.4, "{low} {high}");
        assert_eq!(interval(&values[..5]), None);
        assert_eq!(interval(&values), interval(&values));
    }
}
