//! Steps in a noisy sequence: at which night a method became slower or faster for good.
//!
//! After least-squares segmentation over seeded intervals (S. Kovács, H. Li, P. Bühlmann, A. Munk, Seeded
//! binary segmentation, Biometrika 110(1), 2023, doi:10.1093/biomet/asac052), with steps of our own:
//!
//! 1. Logarithms, so that a step is a ratio and noise does not grow with the value.
//! 2. Spikes are replaced by the local median: a night on a loaded machine is no step. The window is as short
//!    as can be with the nights that a step must last still its majority, and keeps its length at the ends: a step is
//!    taken for a spike as long as it has not lasted, and no longer.
//! 3. Noise: from the differences of neighbouring nights, where steps hardly count. If differences over two nights are
//!    larger than that, a night remembers the one before, and a mean over many tells less: with a correlation r from night
//!    to night its variance is (1 + r) / (1 - r) times that of independent nights.
//! 4. In each of a fixed set of intervals of all lengths: the split that lessens the squares most. A short interval finds a
//!    short episode, such as a regression that was mended after two weeks, which no split of the whole shows.
//! 5. A t test: the noise is the larger one of 3 and of what is left within the interval's two sides, for its memory enlarged. The level
//!    is divided by the number of all splits of all intervals, and by the number of series.
//! 6. From the clearest split on: each is taken unless its interval holds one taken before.
//! 7. Each step is moved to where the squares between its neighbours are least; steps that are no longer
//!    significant there, or smaller than the least size, are dropped.
//!
//! Nothing here is random: the same values give the same steps.

use super::student;

/// Robust standard deviations at which a value is a spike. The median of a short window lies near its
/// own value, so these are smaller than those of the noise by a fifth.
const CLIPPED_AT: f64 = 4.0;

/// In a short sequence so many values may be spikes: two loaded nights, or a step that has not lasted yet.
const FEW_SPIKES: f64 = 4.0;

/// Noise is taken to be at least this, as a logarithm: figures have four digits, and clocks drift.
const LEAST_NOISE: f64 = 0.002;

/// A larger correlation of neighbouring nights is not believed: a drift has one, and is no noise.
const MOST_REMEMBERED: f64 = 0.9;

/// In fewer nights a step alone looks like a correlation.
const FEWEST_REMEMBERED: usize = 60;

/// What counts as a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepOptions {
    /// Probability of any false step in all series together, if noise is normal and independent.
    pub level: f64,
    /// Least nights on either side of a step.
    pub least_nights: usize,
    /// Least size, as a share: 0.05 is 5 % up, or down by the same ratio.
    pub least_size: f64,
    /// Number of series that are looked through together.
    pub series: usize,
    /// The largest share of values that may be spikes. Where more stand out they are the noise itself, and nothing is
    /// clipped. 0 for figures that no other program disturbs: a memory that is now 100 MB and now 120 has no
    /// spikes, it is noisy.
    pub spikes: f64,
}

impl Default for StepOptions {
    fn default() -> Self {
        Self { level: 0.01, least_nights: 4, least_size: 0.05, series: 1, spikes: 0.1 }
    }
}

/// A lasting change of a sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Index of the first value after it.
    pub at: usize,
    /// Value after it over value before it.
    pub ratio: f64,
    /// The ratio is between this and [`Self::high`] with a confidence of 95 %.
    pub low: f64,
    /// See [`Self::low`].
    pub high: f64,
}

/// The steps of a sequence of positive values, in order.
pub fn steps(values: &[f64], options: &StepOptions) -> Vec<Step> {
    let least = options.least_nights.max(1);
    if values.len() < (2 * least).max(4) {
        return Vec::new();
    }
    // A clock that showed nothing: the shortest time that is told apart from it.
    let logarithms: Vec<f64> = values.iter().map(|value| value.max(1e-9).ln()).collect();
    let search = Search::new(&without_spikes(&logarithms, least, options.spikes), options);
    let mut found = search.candidates();
    loop {
        search.refine(&mut found);
        let before = found.len();
        found = search.kept(&found);
        if found.len() == before {
            break;
        }
    }
    search.told(&found)
}

/// Values with spikes replaced by the median of a window in which `majority` nights are one.
fn without_spikes(values: &[f64], majority: usize, spikes: f64) -> Vec<f64> {
    let width = (2 * majority - 1).min(values.len());
    let start = |k: usize| k.saturating_sub(majority - 1).min(values.len() - width);
    let around = |k: usize| median(&values[start(k)..start(k) + width]);
    let medians: Vec<f64> = (0..values.len()).map(around).collect();
    let residuals: Vec<f64> = values.iter().zip(&medians).map(|(v, m)| v - m).collect();
    let limit = CLIPPED_AT * spread(&residuals, spikes);
    // What stands out tells nothing of the method: beside a step, even a clipped value would move it.
    let kept = |(value, median): (&f64, &f64)| {
        if (value - median).abs() <= limit { *value } else { *median }
    };
    values.iter().zip(&medians).map(kept).collect()
}

/// Standard deviation of residuals about 0, of which few may stand out; else so much that none does.
fn spread(residuals: &[f64], spikes: f64) -> f64 {
    let sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    // The median size of a normal deviate is 0.6745 standard deviations.
    let robust = (median(&sizes) / 0.6745).max(LEAST_NOISE);
    let out = sizes.iter().filter(|&&size| size > CLIPPED_AT * robust).count();
    let few = if spikes > 0.0 { FEW_SPIKES } else { 0.0 };
    if out as f64 <= (spikes * sizes.len() as f64).max(few) {
        return robust;
    }
    sizes.into_iter().fold(robust, f64::max)
}

/// The median; of an even number the mean of the middle two.
pub(super) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => 0.0,
        n if n % 2 == 1 => sorted[middle],
        _ => (sorted[middle - 1] + sorted[middle]) / 2.0,
    }
}

/// A sequence that is searched.
struct Search {
    /// Sums of the first k values and of their squares, so that any interval's are one subtraction.
    sums: Vec<f64>,
    squares: Vec<f64>,
    /// Standard deviation of one night.
    noise: f64,
    /// Factor on the standard error of means, for what nights remember.
    memory: f64,
    intervals: Vec<(usize, usize)>,
    /// The t value that a step must reach.
    critical: f64,
    /// The t value of an interval of 95 %.
    usual: f64,
    least_nights: usize,
    /// As a logarithm.
    least_size: f64,
}

/// A split of an interval in two.
#[derive(Clone, Copy)]
struct Split {
    interval: (usize, usize),
    at: usize,
    t: f64,
}

impl Search {
    fn new(values: &[f64], options: &StepOptions) -> Self {
        // About the mean, or the squares of values far from 0 would drown their differences.
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let running = |of: &dyn Fn(f64) -> f64| {
            let mut sum = 0.0;
            let sums = values.iter().map(|value| {
                sum += of(value - mean);
                sum
            });
            std::iter::once(0.0).chain(sums).collect::<Vec<f64>>()
        };
        let least_nights = options.least_nights.max(1);
        let intervals = seeded_intervals(values.len(), 2 * least_nights);
        let splits: usize = intervals.iter().map(|(a, b)| b - a + 1 - 2 * least_nights).sum();
        let level = options.level / (splits.max(1) * options.series.max(1)) as f64;
        let freedom = values.len() - 2;
        let kept = remembered(values, options.spikes);
        Self {
            sums: running(&|v| v),
            squares: running(&|v| v * v),
            // Neighbours that are alike differ less than the noise is large.
            noise: noise(values, options.spikes) / (1.0 - kept).sqrt(),
            memory: ((1.0 + kept) / (1.0 - kept)).sqrt(),
            intervals,
            critical: student::beyond(level, freedom),
            usual: student::beyond(0.05, freedom),
            least_nights,
            least_size: options.least_size.max(0.0).ln_1p(),
        }
    }

    fn nights(&self) -> usize {
        self.sums.len() - 1
    }

    fn mean(&self, from: usize, to: usize) -> f64 {
        (self.sums[to] - self.sums[from]) / (to - from) as f64
    }

    /// Sum of the squares about the mean.
    fn deviation(&self, from: usize, to: usize) -> f64 {
        let sum = self.sums[to] - self.sums[from];
        (self.squares[to] - self.squares[from] - sum * sum / (to - from) as f64).max(0.0)
    }

    /// Standard error of the difference of the means on the two sides.
    fn standard_error(&self, (from, to): (usize, usize), at: usize) -> f64 {
        let within = self.deviation(from, at) + self.deviation(at, to);
        let variance = within / (to - from).saturating_sub(2).max(1) as f64;
        let noise = self.noise.max(variance.sqrt());
        self.memory * noise * (1.0 / (at - from) as f64 + 1.0 / (to - at) as f64).sqrt()
    }

    /// The split of an interval that lessens the squares most; the first of equals.
    fn best(&self, interval: (usize, usize)) -> Option<Split> {
        let (from, to) = interval;
        let places = from + self.least_nights..=to.checked_sub(self.least_nights)?;
        let left = |at: usize| self.deviation(from, at) + self.deviation(at, to);
        let at = places.min_by(|&a, &b| left(a).total_cmp(&left(b)))?;
        let difference = self.mean(at, to) - self.mean(from, at);
        Some(Split { interval, at, t: difference.abs() / self.standard_error(interval, at) })
    }

    /// The places of significant splits, the clearest first, none within an interval of a clearer one.
    fn candidates(&self) -> Vec<usize> {
        let splits = self.intervals.iter().filter_map(|&interval| self.best(interval));
        let mut splits: Vec<Split> = splits.filter(|split| split.t >= self.critical).collect();
        splits.sort_by(|a, b| b.t.total_cmp(&a.t).then(a.interval.cmp(&b.interval)));
        let mut taken: Vec<usize> = Vec::new();
        for Split { interval: (from, to), at, .. } in splits {
            if !taken.iter().any(|&other| (from..to).contains(&other)) {
                taken.push(at);
            }
        }
        taken.sort_unstable();
        taken
    }

    /// What lies between the neighbours of a step.
    fn between(&self, steps: &[usize], index: usize) -> (usize, usize) {
        let from = index.checked_sub(1).map_or(0, |before| steps[before]);
        (from, steps.get(index + 1).copied().unwrap_or_else(|| self.nights()))
    }

    /// Moves each step to the best place between its neighbours, until none moves.
    fn refine(&self, steps: &mut [usize]) {
        // Each move lessens the squares; the bound is for ties alone.
        for _ in 0..steps.len() + 2 {
            let before = steps.to_vec();
            for index in 0..steps.len() {
                if let Some(split) = self.best(self.between(steps, index)) {
                    steps[index] = split.at;
                }
            }
            if before == steps {
                return;
            }
        }
    }

    /// All steps but the least clear one of those that are not clear or not large enough.
    fn kept(&self, steps: &[usize]) -> Vec<usize> {
        let t = |index: usize| {
            let interval = self.between(steps, index);
            let difference = self.difference(interval, steps[index]);
            let large = difference.abs() >= self.least_size;
            let t = difference.abs() / self.standard_error(interval, steps[index]);
            (!large || t < self.critical).then_some((index, t))
        };
        let weak = (0..steps.len()).filter_map(t).min_by(|a, b| a.1.total_cmp(&b.1));
        let kept = steps.iter().enumerate().filter(|(index, _)| weak.is_none_or(|w| w.0 != *index));
        kept.map(|(_, &at)| at).collect()
    }

    fn difference(&self, (from, to): (usize, usize), at: usize) -> f64 {
        self.mean(at, to) - self.mean(from, at)
    }

    fn told(&self, steps: &[usize]) -> Vec<Step> {
        let told = |(index, &at): (usize, &usize)| {
            let interval = self.between(steps, index);
            let difference = self.difference(interval, at);
            let reach = self.usual * self.standard_error(interval, at);
            let ratio = difference.exp();
            Step { at, ratio, low: (difference - reach).exp(), high: (difference + reach).exp() }
        };
        steps.iter().enumerate().map(told).collect()
    }
}

/// Standard deviation of one night, from the differences of neighbours, which have twice the variance.
fn noise(values: &[f64], spikes: f64) -> f64 {
    (mean_square(values, 1, spikes) / 2.0).sqrt().max(LEAST_NOISE)
}

/// The correlation of neighbouring nights. With a correlation r, differences over two nights have 1 + r times the mean
/// square of those over one. Where that is not clear it counts as none: it is less than what it is taken from varies by.
fn remembered(values: &[f64], spikes: f64) -> f64 {
    if values.len() < FEWEST_REMEMBERED {
        return 0.0;
    }
    let [one, two] = [1, 2].map(|lag| mean_square(values, lag, spikes));
    let ratio = two / one.max(LEAST_NOISE * LEAST_NOISE);
    (ratio - 1.0 - 1.0 / (values.len() as f64).sqrt()).clamp(0.0, MOST_REMEMBERED)
}

/// The mean square of differences over so many nights, those that stand out cut.
fn mean_square(values: &[f64], lag: usize, spikes: f64) -> f64 {
    let pairs = values.iter().zip(values.iter().skip(lag));
    let differences: Vec<f64> = pairs.map(|(before, after)| after - before).collect();
    let limit = CLIPPED_AT * spread(&differences, spikes);
    let squares = differences.iter().map(|d| d.clamp(-limit, limit).powi(2)).sum::<f64>();
    squares / differences.len().max(1) as f64
}

/// Intervals of lengths n, n / sqrt 2, n / 2, ... down to `shortest`, each length spread evenly so that
/// neighbours overlap by half: every step is well inside one that holds no other.
fn seeded_intervals(n: usize, shortest: usize) -> Vec<(usize, usize)> {
    let mut intervals = Vec::new();
    let mut parts = 1.0_f64;
    loop {
        let length = (n as f64 / parts).ceil() as usize;
        if length < shortest {
            break;
        }
        let count = 2 * parts.ceil() as usize - 1;
        let room = n - length;
        let start = |k: usize| if count == 1 { 0 } else { k * room / (count - 1) };
        intervals.extend((0..count).map(|k| (start(k), start(k) + length)));
        parts *= std::f64::consts::SQRT_2;
    }
    intervals.sort_unstable();
    intervals.dedup();
    intervals
}

#[cfg(test)]
mod tests;
