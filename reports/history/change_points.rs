//! Change points of a noisy series, such as the seconds of one item over many runs.
//!
//! 1. Take logarithms. The noise sigma of one run follows from the 90th percentile of differences between runs a few
//!    places apart: neighbours may share a load of the machine, and change points touch few of these differences.
//! 2. Clip a run that lies more than 3 sigma beyond the medians of the five runs before and after it: an outlier.
//! 3. Optimal partitioning: least squares over sigma squared plus a penalty for each change point, exactly minimised
//!    over all segmentations. B. Jackson et al., "An algorithm for optimal partitioning of data on an interval", IEEE
//!    Signal Processing Letters 12 (2005), <https://doi.org/10.1109/LSP.2001.838216>.
//! 4. Drop change points that are too small, or on which the unclipped runs around do not agree: a value that goes back
//!    and forth between two levels is noise.

use crate::metric::median;

/// A change point of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChangePoint {
    /// Index of the first run after it.
    pub at: usize,
    /// Level after over level before.
    pub ratio: f64,
}

/// Fewest runs of a level: less is an episode.
const SHORTEST: usize = 4;

/// Cost of a change point in squared standard errors: six of them. A flat history has some 400 places for a change and
/// a study some 100 series, so 4 would raise false alarms each week.
const PENALTY: f64 = 36.0;

/// Least noise: exact values, such as memory, would otherwise change at a byte.
const LEAST_NOISE: f64 = 0.002;

/// Most runs on either side that are compared with the middle of the levels.
const NEAREST: usize = 10;

/// The change points of positive values by at least `least_step` (a share), in order. Time quadratic in their number.
pub fn change_points(values: &[f64], least_step: f64) -> Vec<ChangePoint> {
    if values.len() < 2 * SHORTEST {
        return vec![];
    }
    let positive = values.iter().map(|value| value.max(f64::MIN_POSITIVE)); // has a logarithm
    // Relative to the first value, so that squares of small differences do not drown.
    let raw: Vec<f64> =
        positive.map(|value| (value / values[0].max(f64::MIN_POSITIVE)).ln()).collect();
    let sigma = noise(&raw);
    let sums = Sums::new(&without_outliers(&raw, 3.0 * sigma));
    let mut bounds = partition(&sums, sigma);
    loop {
        let segments = bounds.windows(3);
        let steps: Vec<f64> =
            segments.map(|b| sums.mean(b[1], b[2]) - sums.mean(b[0], b[1])).collect();
        let weakest = (0..steps.len())
            .filter(|&k| {
                steps[k].abs() < least_step.ln_1p() || !agrees(&raw, &bounds[k..k + 3], &sums)
            })
            .min_by(|&a, &b| steps[a].abs().total_cmp(&steps[b].abs()));
        let Some(weakest) = weakest else {
            let changes = bounds[1..].iter().zip(steps);
            return changes.map(|(&at, step)| ChangePoint { at, ratio: step.exp() }).collect();
        };
        // One at a time: the levels on both sides of a dropped change point become one.
        bounds.remove(weakest + 1);
    }
}

/// The deviation by which the mean of n runs varies is this over the root of n.
fn noise(values: &[f64]) -> f64 {
    // In a short history each change point touches a larger share of the differences, so they span fewer runs.
    let far = deviation(values, (values.len() / 20).clamp(1, 5));
    // Neighbours with a correlation r differ by less, and means of such runs vary by more (an AR(1) process).
    let correlation = (1.0 - (deviation(values, 1) / far).powi(2)).clamp(0.0, 0.7);
    far * ((1.0 + correlation) / (1.0 - correlation)).sqrt()
}

/// The deviation of one value, from differences `lag` places apart.
fn deviation(values: &[f64], lag: usize) -> f64 {
    let mut steps: Vec<f64> = values.windows(lag + 1).map(|w| (w[lag] - w[0]).abs()).collect();
    steps.sort_by(f64::total_cmp);
    // 90 % of a normal distribution lie within 1.645 deviations; a difference has twice the variance.
    let ninth = steps[9 * (steps.len() - 1) / 10];
    (ninth / (1.645 * std::f64::consts::SQRT_2)).max(LEAST_NOISE)
}

/// Each value within `reach` of the medians before and after it, or the nearest that is.
fn without_outliers(values: &[f64], reach: f64) -> Vec<f64> {
    const AROUND: usize = 5;
    let mut clipped = Vec::with_capacity(values.len());
    for (k, &value) in values.iter().enumerate() {
        let before = median(&values[k.saturating_sub(AROUND)..k]);
        let after = median(&values[k + 1..values.len().min(k + 1 + AROUND)]);
        // The first and the last run have neighbours on one side alone.
        let ends = [before.or(after), after.or(before)].map(|end| end.unwrap_or(value));
        // Between the two medians everything is plausible: a change point may lie there.
        clipped.push(value.clamp(ends[0].min(ends[1]) - reach, ends[0].max(ends[1]) + reach));
    }
    clipped
}

/// Sums of the first values and of their squares: any segment's mean and squared error in constant time.
struct Sums(Vec<[f64; 2]>);

impl Sums {
    fn new(values: &[f64]) -> Self {
        let mut sums = vec![[0.0; 2]];
        for (k, value) in values.iter().enumerate() {
            sums.push([sums[k][0] + value, sums[k][1] + value * value]);
        }
        Self(sums)
    }

    fn mean(&self, from: usize, to: usize) -> f64 {
        (self.0[to][0] - self.0[from][0]) / (to - from) as f64
    }

    fn squared_error(&self, from: usize, to: usize) -> f64 {
        let [sum, squares] = [0, 1].map(|k| self.0[to][k] - self.0[from][k]);
        // Rounding may leave a negative rest where all values are equal.
        (squares - sum * sum / (to - from) as f64).max(0.0)
    }
}

/// The bounds of the segments of least cost, 0 and the length included.
fn partition(sums: &Sums, sigma: f64) -> Vec<usize> {
    let length = sums.0.len() - 1;
    // For each end the least cost of the values before it, and where its last segment starts.
    let mut best = vec![(f64::INFINITY, 0); length + 1];
    best[0] = (-PENALTY, 0); // s segments have s - 1 change points
    for end in SHORTEST..=length {
        for start in 0..=end - SHORTEST {
            let error = sums.squared_error(start, end) / (sigma * sigma);
            let cost = best[start].0 + error + PENALTY;
            if cost < best[end].0 {
                best[end] = (cost, start); // of equal costs the earliest start
            }
        }
    }
    let mut bounds = vec![length];
    while bounds[bounds.len() - 1] > 0 {
        bounds.push(best[bounds[bounds.len() - 1]].1);
    }
    bounds.reverse(); // followed from the end
    bounds
}

/// Whether the runs nearest to the middle bound lie on their own side of the two levels' middle: all of the fewest,
/// seven of ten.
fn agrees(raw: &[f64], bounds: &[usize], sums: &Sums) -> bool {
    let [start, at, end] = [bounds[0], bounds[1], bounds[2]];
    let levels = [sums.mean(start, at), sums.mean(at, end)];
    let middle = 0.5 * (levels[0] + levels[1]);
    let near = [&raw[start.max(at.saturating_sub(NEAREST))..at], &raw[at..end.min(at + NEAREST)]];
    near.iter().zip(levels).all(|(near, level)| {
        let off = near.iter().filter(|&&value| (value > middle) != (level > middle)).count();
        off <= (near.len() - SHORTEST) / 2 // no segment is shorter
    })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    const RUNS: usize = 400;

    /// Log-normal noise of 3 %; in 2 % of the runs the machine was loaded: 30 to 100 % more.
    fn history(seed: u64, level: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let run = |k: usize| {
            let [u, v, loaded, more]: [f64; 4] = std::array::from_fn(|_| rng.random());
            let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos();
            let spike = if loaded < 0.02 { 1.3 + 0.7 * more } else { 1.0 };
            0.25 * level(k) * (0.03 * normal).exp() * spike
        };
        (0..RUNS).map(run).collect()
    }

    fn found(values: &[f64]) -> Vec<ChangePoint> {
        change_points(values, 0.05)
    }

    #[test]
    fn a_step_of_a_tenth_is_found_at_its_run() {
        let mut near = 0;
        for seed in 0..100 {
            let at = 20 + (seed as usize * 37) % 360;
            let size = if seed % 2 == 0 { 1.1 } else { 1.0 / 1.1 };
            let changes = found(&history(seed, |k| if k < at { 1.0 } else { size }));
            if let [change] = changes[..] {
                near += usize::from(change.at.abs_diff(at) <= 3);
                assert!((change.ratio / size - 1.0).abs() < 0.035, "seed {seed}: {change:?}");
            }
        }
        assert!(near >= 95, "{near} of 100");
    }

    #[test]
    fn flat_histories_have_no_change_point() {
        for seed in 1000..1020 {
            assert_eq!(found(&history(seed, |_| 1.0)), [], "seed {seed}");
        }
        let mut alarms = 0;
        for seed in 30_000..30_100 {
            let mut values = history(seed, |_| 1.0);
            // Half of the noise of a run is still there in the next.
            for k in 1..values.len() {
                values[k] = 0.25 * (values[k] / 0.25).powf(0.866) * (values[k - 1] / 0.25).sqrt();
            }
            alarms += usize::from(!found(&values).is_empty());
        }
        assert!(alarms <= 10, "{alarms} of 100");
    }

    #[test]
    fn outliers_and_flickering_values_are_not_changes() {
        let mut values = vec![1.0; 60];
        values[30] = 8.0;
        assert_eq!(found(&values), []);
        let mut values: Vec<f64> = (0..60).map(|k| if k < 30 { 1.0 } else { 2.0 }).collect();
        values[29] = 1.7;
        assert!(matches!(found(&values)[..], [change] if change.at.abs_diff(30) <= 1));
        // A memory that is now 100 and now 120, as threads meet.
        for seed in 0..20 {
            for share in [0.02, 0.1, 0.3, 0.5] {
                let mut rng = Pcg64::seed_from_u64(seed);
                let flicker = |_| if rng.random::<f64>() < share { 120.0 } else { 100.0 };
                let values: Vec<f64> = (0..RUNS).map(flicker).collect();
                assert_eq!(found(&values), [], "seed {seed}, share {share}");
            }
        }
    }

    #[test]
    fn an_episode_of_two_weeks_is_two_changes() {
        for seed in 0..10 {
            let level = |k: usize| if (200..214).contains(&k) { 1.15 } else { 1.0 };
            let changes = found(&history(seed, level));
            let [up, down] = changes[..] else { panic!("seed {seed}: {changes:?}") };
            assert!(up.at.abs_diff(200) <= 1 && down.at.abs_diff(214) <= 1, "{changes:?}");
            assert!(up.ratio > 1.0 && down.ratio < 1.0);
        }
    }

    #[test]
    fn exact_values_change_after_the_fewest_runs_and_by_the_least_step() {
        let mut values = vec![5e6; 40];
        values.extend([5.6e6; 3]);
        assert_eq!(found(&values), []);
        values.push(5.6e6);
        assert!(matches!(found(&values)[..], [change] if change.at == 40));
        assert_eq!(change_points(&values, 0.2), []);
        for values in [&[][..], &[1.0], &[1.0, 2.0, 1.0, 2.0, 1.0], &[0.0; 30]] {
            assert_eq!(found(values), [], "{values:?}");
        }
    }
}
