//! Whether a method became slower, from repeated timings of both builds.
//!
//! One number for each repetition: the mean, over the results of a method, of the logarithm of new over old CPU seconds.
//! Over the repetitions of these numbers, a slowdown is a regression only if
//!
//! 1. the confidence interval of their mean lies beyond the threshold as a whole (Student's t distribution, with
//!    Welch's degrees of freedom for sides that are not paired: few repetitions give a wide interval),
//! 2. nine of ten repetitions agree that it is slower, and
//! 3. the fastest repetitions of both sides differ by more than the threshold, too: another program on the machine
//!    delays some repetitions, hardly ever all.
//!
//! A difference has dozens of rows, of which none may raise a false alarm: the intervals hold together (C. E. Bonferroni,
//! 1936), so that each is wider the more rows there are.
//!
//! With builds that ran alternately, repetition `k` of one is compared with repetition `k` of the other, since load
//! on the machine slows both. Otherwise a busier machine looks like a slower program.
//!
//! The method's own time counts. Shared substrates have a separate row.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use medial_run::record::{Record, Stages};
use serde::Serialize;

use super::results::Pair;
use super::{ItemName, LEAST_SLOWDOWN, Meaning};
use crate::metric::{Mean, median};

/// With fewer repetitions seconds are not compared.
const LEAST_REPETITIONS: usize = 5;

/// Probability that any interval of a difference misses its ratio, at most.
const ERROR_RATE: f64 = 0.01;

/// Share of the repetitions that have to agree.
const AGREEMENT: f64 = 0.9;

/// Shorter times are not compared: they are of the size of effects of clock and caches.
const LEAST_SECONDS: f64 = 2e-3;

/// The row of the shared substrates.
const SUBSTRATES: &str = "(substrates)";

/// How the seconds of a method changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Timing {
    /// The row of the method, or `(substrates)`.
    pub method: String,
    /// The mesh of the row; `None` for the row over all meshes.
    pub mesh: Option<String>,
    /// Results that it is taken over.
    pub results: usize,
    /// Repetitions of each side.
    pub repetitions: usize,
    /// New over old seconds, the geometric mean.
    pub ratio: f64,
    /// The interval of this ratio: all hold together with a probability of 99 %.
    pub interval: [f64; 2],
    /// Share of the repetitions that are on the same side of 1 as the ratio.
    pub agreement: f64,
    /// Regression or improvement; `None` within the threshold, or if not certain.
    pub meaning: Option<Meaning>,
}

/// The compared part of the time.
type Part = fn(&Stages) -> f64;

/// The timed records of one row.
struct Group<'p, 'a> {
    method: String,
    mesh: Option<String>,
    part: Part,
    pairs: Vec<&'p Pair<'a>>,
}

/// A row for each method over all meshes, and rows for single meshes with a regression or an
/// improvement. And the reasons why some seconds were not compared.
pub(super) fn timings(pairs: &[Pair<'_>], alternating: bool) -> (Vec<Timing>, Vec<String>) {
    let mut untimed = Vec::new(); // reasons, in the order of the checks
    let timed: Vec<&Pair<'_>> = pairs.iter().filter(|pair| alike(pair)).collect();
    if timed.len() < pairs.len() {
        untimed.push(format!(
            "{} of {} pairs ran on different machines or next to other items: their seconds do not compare",
            pairs.len() - timed.len(),
            pairs.len()
        ));
    }
    let mut repeated = timed.clone();
    repeated.retain(|pair| repetitions(pair) >= LEAST_REPETITIONS);
    let with_result = timed.iter().filter(|pair| repetitions(pair) > 0).count();
    if repeated.len() < with_result {
        untimed.push(format!(
            "{} of {with_result} pairs have fewer than {LEAST_REPETITIONS} repetitions: seconds vary too much to be \
             compared; use --repeat 10",
            with_result - repeated.len()
        ));
    }
    let groups = groups(&repeated);
    let error_rate = ERROR_RATE / groups.len() as f64;
    let rows = groups.iter().filter_map(|group| group.timing(alternating, error_rate));
    // Rows of single meshes without a finding would bury the others.
    (rows.filter(|row| row.mesh.is_none() || row.meaning.is_some()).collect(), untimed)
}

/// Whether both sides ran on one machine, each alone.
fn alike(pair: &Pair<'_>) -> bool {
    let (old, new) = (&pair.old.machine, &pair.new.machine);
    // Memory as the kernel reports it differs from boot to boot.
    (&old.cpu, old.cores, &old.os) == (&new.cpu, new.cores, &new.os)
        && pair.old.ran_alone()
        && pair.new.ran_alone()
}

fn repetitions(pair: &Pair<'_>) -> usize {
    pair.old.repetitions.len().min(pair.new.repetitions.len())
}

/// The pairs by method, and by method and mesh where there are several; the substrates likewise.
fn groups<'p, 'a>(pairs: &[&'p Pair<'a>]) -> Vec<Group<'p, 'a>> {
    let mut rows: BTreeMap<(&str, Option<&str>), Vec<&'p Pair<'a>>> = BTreeMap::new();
    // For each mesh the method with the most time in substrates.
    let mut largest: BTreeMap<&str, &'p Pair<'a>> = BTreeMap::new();
    for pair in pairs {
        let ItemName { mesh, method, .. } = &pair.item;
        rows.entry((method, None)).or_default().push(pair);
        rows.entry((method, Some(mesh))).or_default().push(pair);
        let most = largest.entry(mesh).or_insert(pair);
        if cpu_of_substrates(pair.old) > cpu_of_substrates(most.old) {
            *most = pair; // the largest use holds the others
        }
    }
    let mut groups = vec![];
    for (&(method, mesh), pairs) in &rows {
        // The row of the only mesh would repeat that of the method.
        let all = &rows[&(method, None)];
        if mesh.is_some() && all.len() == pairs.len() {
            continue;
        }
        groups.push(Group {
            method: method.to_owned(),
            mesh: mesh.map(str::to_owned),
            part: |stages| stages.prepare + stages.simplify,
            pairs: pairs.clone(),
        });
    }
    groups.push(Group {
        method: SUBSTRATES.to_owned(),
        mesh: None,
        part: |stages| stages.substrate,
        pairs: largest.into_values().collect(),
    });
    groups
}

fn cpu_of_substrates(record: &Record) -> f64 {
    median(&seconds(record, |stages| stages.substrate)).unwrap_or(0.0)
}

/// CPU seconds of each repetition of a record.
fn seconds(record: &Record, part: Part) -> Vec<f64> {
    record.repetitions.iter().map(|repetition| part(&repetition.cpu_seconds)).collect()
}

impl Group<'_, '_> {
    /// The row; `None` where all times are too short.
    fn timing(&self, alternating: bool, error_rate: f64) -> Option<Timing> {
        // For each pair the seconds of the repetitions of both sides, where these take long enough.
        let mut pairs: Vec<[Vec<f64>; 2]> = (self.pairs.iter())
            .map(|pair| [pair.old, pair.new].map(|record| seconds(record, self.part)))
            .collect();
        pairs.retain(|sides| {
            sides
                .iter()
                .all(|seconds| median(seconds).is_some_and(|typical| typical >= LEAST_SECONDS))
        });
        let repetitions = pairs.iter().flatten().map(Vec::len).min()?; // the same laps of all pairs
        let mean_logarithm = |side: usize, of: &dyn Fn(&[f64]) -> f64| {
            let seconds = pairs.iter().map(|sides| of(&sides[side]).max(f64::MIN_POSITIVE));
            seconds.map(f64::ln).sum::<f64>() / pairs.len() as f64
        };
        let [old, new] = [0, 1].map(|side| -> Vec<f64> {
            (0..repetitions).map(|k| mean_logarithm(side, &|seconds| seconds[k])).collect()
        });
        let least = |seconds: &[f64]| seconds.iter().copied().fold(f64::INFINITY, f64::min);
        let fastest = mean_logarithm(1, &least) - mean_logarithm(0, &least);
        let shift = Shift::new(&old, &new, alternating, error_rate);
        let Shift { mean, interval, agreement } = shift;
        let alone = if self.mesh.is_some() { 2.0 } else { 1.0 };
        let threshold = (alone * LEAST_SLOWDOWN).ln_1p();
        let evidence = [interval[0], interval[1], fastest];
        let meaning = if agreement < AGREEMENT {
            None
        } else if evidence.iter().all(|&shift| shift > threshold) {
            Some(Meaning::Regression)
        } else if evidence.iter().all(|&shift| shift < -threshold) {
            Some(Meaning::Improvement)
        } else {
            None
        };
        Some(Timing {
            method: self.method.clone(),
            mesh: self.mesh.clone(),
            results: pairs.len(),
            repetitions,
            ratio: mean.exp(),
            interval: interval.map(f64::exp),
            agreement,
            meaning,
        })
    }
}

/// How far some numbers lie above others.
struct Shift {
    mean: f64,
    interval: [f64; 2],
    agreement: f64,
}

impl Shift {
    /// In pairs, or each side by itself; an interval that misses the true shift with a probability of `error_rate`.
    fn new(old: &[f64], new: &[f64], in_pairs: bool, error_rate: f64) -> Self {
        let count = old.len(); // the same on both sides
        let least_freedom = count - 1;
        let differences: Vec<f64> = new.iter().zip(old).map(|(new, old)| new - old).collect();
        let mean = mean_of(&differences);
        let (variance, freedom) = if in_pairs {
            (variance_of(&differences), least_freedom)
        } else {
            let [a, b] = [old, new].map(variance_of);
            // Welch's, for samples of one size; not a number where nothing varies.
            let freedom = least_freedom as f64 * (a + b).powi(2) / (a * a + b * b);
            (a + b, (freedom as usize).max(least_freedom))
        };
        let reach = student_quantile(error_rate, freedom) * (variance / count as f64).sqrt();
        let (mut agreeing, mut compared) = (0, 0);
        for (i, a) in old.iter().enumerate() {
            for (k, b) in new.iter().enumerate() {
                // Without pairs any repetition of one side may meet any of the other.
                if i == k || !in_pairs {
                    agreeing += usize::from((b - a) * mean > 0.0);
                    compared += 1;
                }
            }
        }
        let agreement = agreeing as f64 / compared.max(1) as f64;
        Self { mean, interval: [mean - reach, mean + reach], agreement }
    }
}

fn mean_of(values: &[f64]) -> f64 {
    Mean::Arithmetic.of(values).unwrap_or_default()
}

/// Of a sample.
fn variance_of(values: &[f64]) -> f64 {
    let mean = mean_of(values);
    let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    squares / (values.len() - 1).max(1) as f64
}

/// The value that a number of Student's t distribution exceeds in size with a probability, for two or more degrees of
/// freedom.
fn student_quantile(probability: f64, freedom: usize) -> f64 {
    // By bisection over the angle whose tangent is t over the root of `freedom`, to the last bit.
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        match 1.0 - student_within(middle, freedom) > probability {
            true => low = middle,
            false => high = middle,
        }
    }
    (freedom as f64).sqrt() * low.tan()
}

/// The probability that the angle is smaller in size: M. Abramowitz, I. A. Stegun, *Handbook of Mathematical Functions*,
/// 1964, equations 26.7.3 and 26.7.4.
fn student_within(angle: f64, freedom: usize) -> f64 {
    let (sine, cosine) = angle.sin_cos();
    let is_odd = freedom % 2 == 1;
    let mut term = if is_odd { cosine } else { 1.0 };
    let mut sum = term;
    // A series in powers of the cosine: each term follows from the one before.
    for power in (2..freedom - 1).filter(|power| (power % 2 == 1) == is_odd) {
        term *= cosine * cosine * (power - 1) as f64 / power as f64;
        sum += term;
    }
    if is_odd { (angle + sine * sum) / FRAC_PI_2 } else { sine * sum }
}

#[cfg(test)]
mod tests {
    use super::student_quantile;

    #[test]
    fn quantiles_match_published_tables() {
        for (probability, freedom, expected) in
            [(0.01, 4, 4.6041), (0.01, 9, 3.2498), (0.001, 5, 6.8688), (0.05, 30, 2.0423)]
        {
            let quantile = student_quantile(probability, freedom);
            assert!((quantile - expected).abs() < 1e-4, "{probability}, {freedom}: {quantile}");
        }
    }
}
