//! Whether a method became slower, from repeated timings of both builds.
//!
//! One number for each repetition: the mean, over the results of a method, of the logarithm of new over old CPU seconds.
//! Over the repetitions of these numbers, a slowdown is a regression only if
//!
//! 1. its mean is beyond the threshold,
//! 2. the percentile bootstrap interval of the mean excludes no change at all (B. Efron, R. J. Tibshirani: *An
//!    Introduction to the Bootstrap*, 1993, chapter 13), and
//! 3. nine of ten repetitions agree that it is slower, and
//! 4. the fastest repetitions of both sides differ by more than the threshold, too: another program on the machine
//!    delays some repetitions, hardly ever all.
//!
//! With builds that ran alternately, repetition `k` of one is compared with repetition `k` of the other: whatever
//! slowed the machine in that moment slowed both. Otherwise both sides are resampled by themselves, and a machine that
//! was busier on one of the two days cannot be told from a slower program.
//!
//! The method's own time counts. Substrates, which methods share, have their own row. Wall-clock seconds are shown and
//! have no meaning here.

use std::collections::BTreeMap;

use medial::geometry::hash::splitmix;
use serde::Serialize;

use super::results::Pair;
use super::{DiffOptions, ItemName, Meaning};
use crate::metric::median;
use crate::record::{Record, Repetition, Stages};

/// With fewer repetitions nothing is said.
const LEAST_REPETITIONS: usize = 5;

/// Level of the interval.
const CONFIDENCE: f64 = 0.99;

/// Share of the repetitions that have to agree.
const AGREEMENT: f64 = 0.9;

/// Resamples of the bootstrap.
const RESAMPLES: usize = 2000;

/// Shorter times are not compared: they are of the size of what the clock and the caches do.
const LEAST_SECONDS: f64 = 2e-3;

/// The row of what methods share.
const SUBSTRATES: &str = "(substrates)";

/// How the seconds of a method changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Timing {
    /// The row of the method, or `(substrates)`.
    pub method: String,
    /// The one mesh that this is about; all of them without.
    pub mesh: Option<String>,
    /// `cpu` or `wall`.
    pub clock: &'static str,
    /// Results that it is taken over.
    pub results: usize,
    /// Repetitions of each side.
    pub repetitions: usize,
    /// New over old seconds, the geometric mean.
    pub ratio: f64,
    /// The interval of this ratio.
    pub interval: [f64; 2],
    /// Share of the repetitions that are on the same side of 1 as the ratio.
    pub agreement: f64,
    /// What it means; nothing where it is within the threshold, or not certain.
    pub meaning: Option<Meaning>,
}

/// The clocks, and whether a change by them means anything: other programs disturb the clock on the wall, so it is shown
/// and never a gate.
const CLOCKS: [(&str, Clock, bool); 2] =
    [("cpu", |r| r.cpu_seconds, true), ("wall", |r| r.seconds, false)];

/// Stages of a repetition by a clock.
type Clock = fn(&Repetition) -> Stages;

/// The part of the time that a row is about.
type Part = fn(&Stages) -> f64;

/// What is compared in one row: who, where, and the pairs.
struct Group<'p, 'a> {
    method: String,
    mesh: Option<String>,
    part: Part,
    pairs: Vec<&'p Pair<'a>>,
}

/// A row for each method over all meshes by each clock, and rows for single meshes where they mean something. And why
/// some seconds were not compared.
pub(super) fn timings(pairs: &[Pair<'_>], options: &DiffOptions) -> (Vec<Timing>, Vec<String>) {
    let mut untimed = Vec::new(); // reasons, in the order of the checks
    let timed: Vec<&Pair<'_>> = pairs.iter().filter(|pair| same_machine(pair)).collect();
    if timed.len() < pairs.len() {
        untimed.push(format!(
            "{} of {} pairs ran on different machines: their seconds do not compare",
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
             compared; ask for --repeat 10",
            with_result - repeated.len()
        ));
    }
    let rows = groups(&repeated)
        .into_iter()
        .flat_map(|group| CLOCKS.iter().filter_map(move |clock| group.timing(clock, options)));
    // Rows of single meshes that mean nothing would bury the others.
    (rows.filter(|row| row.mesh.is_none() || row.meaning.is_some()).collect(), untimed)
}

fn same_machine(pair: &Pair<'_>) -> bool {
    let (old, new) = (&pair.old.machine, &pair.new.machine);
    // Memory as the kernel reports it differs from boot to boot.
    (&old.cpu, old.cores, &old.os) == (&new.cpu, new.cores, &new.os)
}

fn repetitions(pair: &Pair<'_>) -> usize {
    pair.old.repetitions.len().min(pair.new.repetitions.len())
}

/// The pairs by method, and by method and mesh where there are several; the substrates likewise.
fn groups<'p, 'a>(pairs: &[&'p Pair<'a>]) -> Vec<Group<'p, 'a>> {
    let mut rows: BTreeMap<(&str, Option<&str>), Vec<&'p Pair<'a>>> = BTreeMap::new();
    // Of each mesh the method that uses most of what is shared.
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
    let seconds = seconds(record, |repetition| repetition.cpu_seconds, |stages| stages.substrate);
    median(&seconds).unwrap_or(0.0)
}

/// A time of each repetition of a record.
fn seconds(record: &Record, clock: Clock, part: Part) -> Vec<f64> {
    record.repetitions.iter().map(|repetition| part(&clock(repetition))).collect()
}

impl Group<'_, '_> {
    /// The row by one clock; `None` where all times are too short.
    fn timing(
        &self,
        &(name, clock, is_gate): &(&'static str, Clock, bool),
        options: &DiffOptions,
    ) -> Option<Timing> {
        // For each pair the seconds of the repetitions of both sides, where these take long enough.
        let mut pairs: Vec<[Vec<f64>; 2]> = (self.pairs.iter())
            .map(|pair| [pair.old, pair.new].map(|record| seconds(record, clock, self.part)))
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
        let Shift { mean, interval, agreement } = Shift::new(&old, &new, options.alternating);
        let alone = if self.mesh.is_some() { 2.0 } else { 1.0 };
        let threshold = (alone * options.seconds).ln_1p();
        // The smaller of the two shifts, where they have one sign.
        let least = if mean * fastest > 0.0 { mean.abs().min(fastest.abs()) } else { 0.0 };
        let is_certain = agreement >= AGREEMENT && interval[0] * interval[1] > 0.0;
        let meaning = (is_gate && least > threshold && is_certain).then_some(match mean > 0.0 {
            true => Meaning::Regression,
            false => Meaning::Improvement,
        });
        Some(Timing {
            method: self.method.clone(),
            mesh: self.mesh.clone(),
            clock: name,
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
    /// In pairs, or each side by itself.
    fn new(old: &[f64], new: &[f64], in_pairs: bool) -> Self {
        let count = old.len(); // the same on both sides
        let mean = mean_of(new.iter()) - mean_of(old.iter());
        let mut means: Vec<f64> = (0..RESAMPLES)
            .map(|resample| {
                // In pairs both sides draw the same repetitions. Splitmix instead of a generator: no state, no seed.
                let [old, new] = [(0, old), (usize::from(!in_pairs), new)].map(|(side, values)| {
                    mean_of((0..count).map(|k| {
                        let number = ((resample * 2 + side) * count + k) as u64;
                        &values[(splitmix(number) % count as u64) as usize]
                    }))
                });
                new - old
            })
            .collect();
        means.sort_by(f64::total_cmp); // percentiles
        let tail = (0.5 * (1.0 - CONFIDENCE) * RESAMPLES as f64) as usize;
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
        Self { mean, interval: [means[tail], means[RESAMPLES - 1 - tail]], agreement }
    }
}

fn mean_of<'a>(values: impl ExactSizeIterator<Item = &'a f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}
