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
use super::{DiffOptions, Meaning};
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
    let mut untimed = Vec::new();
    let timed: Vec<&Pair<'_>> = pairs.iter().filter(|pair| same_machine(pair)).collect();
    if timed.len() < pairs.len() {
        untimed.push(format!(
            "{} of {} pairs ran on different machines: their seconds do not compare",
            pairs.len() - timed.len(),
            pairs.len()
        ));
    }
    let enough = |pair: &&&Pair<'_>| repetitions(pair) >= LEAST_REPETITIONS;
    let repeated: Vec<&Pair<'_>> = timed.iter().filter(enough).copied().collect();
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
    let is_told = |row: &Timing| row.mesh.is_none() || row.meaning.is_some();
    (rows.filter(is_told).collect(), untimed)
}

fn same_machine(pair: &Pair<'_>) -> bool {
    let machine = |record: &Record| {
        let machine = record.machine.clone();
        (machine.cpu, machine.cores, machine.os)
    };
    machine(pair.old) == machine(pair.new)
}

fn repetitions(pair: &Pair<'_>) -> usize {
    pair.old.repetitions.len().min(pair.new.repetitions.len())
}

/// The pairs by method, and by method and mesh where there are several; the substrates likewise.
fn groups<'p, 'a>(pairs: &[&'p Pair<'a>]) -> Vec<Group<'p, 'a>> {
    let own: Part = |stages| stages.prepare + stages.simplify;
    let shared: Part = |stages| stages.substrate;
    let mut rows: BTreeMap<(&str, Option<&str>), Vec<&'p Pair<'a>>> = BTreeMap::new();
    for pair in pairs {
        rows.entry((&pair.item.method, None)).or_default().push(pair);
        rows.entry((&pair.item.method, Some(&pair.item.mesh))).or_default().push(pair);
    }
    let is_several =
        |pairs: &[&Pair<'_>]| pairs.iter().any(|pair| pair.item.mesh != pairs[0].item.mesh);
    let several: Vec<&str> = (rows.iter())
        .filter(|((_, mesh), pairs)| mesh.is_none() && is_several(pairs))
        .map(|((method, _), _)| *method)
        .collect();
    rows.retain(|(method, mesh), _| mesh.is_none() || several.contains(method));
    let group = |((method, mesh), pairs): ((&str, Option<&str>), Vec<&'p Pair<'a>>)| Group {
        method: method.to_owned(),
        mesh: mesh.map(str::to_owned),
        part: own,
        pairs,
    };
    // Of each mesh the method that uses most of what is shared.
    let mut largest: BTreeMap<&str, &'p Pair<'a>> = BTreeMap::new();
    for pair in pairs {
        let size = |pair: &Pair<'_>| median(pair.old, |r| r.cpu_seconds, shared);
        let most = largest.entry(&pair.item.mesh).or_insert(pair);
        if size(pair) > size(most) {
            *most = pair;
        }
    }
    let substrates = largest.into_values().collect();
    let substrates =
        Group { method: SUBSTRATES.to_owned(), mesh: None, part: shared, pairs: substrates };
    rows.into_iter().map(group).chain([substrates]).collect()
}

/// The median of a time over the repetitions of a record.
fn median(record: &Record, clock: Clock, part: Part) -> f64 {
    let mut all: Vec<f64> = record.repetitions.iter().map(|r| part(&clock(r))).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}

impl<'a> Group<'_, 'a> {
    /// The pairs that take long enough on both sides.
    fn long(&self, clock: Clock) -> Vec<&Pair<'a>> {
        let shortest = |pair: &Pair<'_>| {
            let sides = [pair.old, pair.new].map(|record| median(record, clock, self.part));
            sides[0].min(sides[1])
        };
        let long = self.pairs.iter().filter(|pair| shortest(pair) >= LEAST_SECONDS);
        long.copied().collect()
    }

    /// The row by one clock; `None` where all times are too short.
    fn timing(
        &self,
        &(name, clock, is_gate): &(&'static str, Clock, bool),
        options: &DiffOptions,
    ) -> Option<Timing> {
        let pairs = self.long(clock);
        let repetitions = pairs.iter().map(|pair| repetitions(pair)).min()?;
        let sides = pairs.iter().map(|pair| [pair.old, pair.new]);
        let [old, new] = [0, 1].map(|side| {
            let records: Vec<&Record> = sides.clone().map(|sides| sides[side]).collect();
            (0..repetitions).map(|k| self.mean_logarithm(&records, clock, k)).collect::<Vec<_>>()
        });
        let Shift { mean, interval, agreement } = Shift::new(&old, &new, options.alternating);
        let alone = if self.mesh.is_some() { 2.0 } else { 1.0 };
        let threshold = (alone * options.seconds).ln_1p();
        let fastest = self.fastest_shift(&pairs, clock);
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

    /// The mean logarithm of new over old seconds, of the fastest repetitions alone.
    fn fastest_shift(&self, pairs: &[&Pair<'_>], clock: Clock) -> f64 {
        let fastest = |record: &Record| {
            let seconds = record.repetitions.iter().map(|r| (self.part)(&clock(r)));
            seconds.fold(f64::INFINITY, f64::min).max(f64::MIN_POSITIVE).ln()
        };
        let shifts = pairs.iter().map(|pair| fastest(pair.new) - fastest(pair.old));
        shifts.sum::<f64>() / pairs.len().max(1) as f64
    }

    /// Of the seconds of repetition `k`, over some records.
    fn mean_logarithm(&self, records: &[&Record], clock: Clock, k: usize) -> f64 {
        let seconds = records.iter().map(|record| (self.part)(&clock(&record.repetitions[k])));
        let sum: f64 = seconds.map(|seconds| seconds.max(f64::MIN_POSITIVE).ln()).sum();
        sum / records.len().max(1) as f64
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
        let average = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let mean = average(new) - average(old);
        let mut means: Vec<f64> = (0..RESAMPLES)
            .map(|resample| {
                let draw = |side: usize, k: usize| {
                    let number = ((resample * 2 + side) * old.len() + k) as u64;
                    (splitmix(number) % old.len() as u64) as usize
                };
                let taken = |side: usize, values: &[f64]| {
                    (0..values.len()).map(|k| values[draw(side, k)]).sum::<f64>()
                        / values.len().max(1) as f64
                };
                taken(usize::from(!in_pairs), new) - taken(0, old)
            })
            .collect();
        means.sort_by(f64::total_cmp);
        let tail = (0.5 * (1.0 - CONFIDENCE) * RESAMPLES as f64) as usize;
        let agrees = |(a, b): (&f64, &f64)| (b - a) * mean > 0.0;
        let share = |agreeing: usize, all: usize| agreeing as f64 / all.max(1) as f64;
        let agreement = if in_pairs {
            share(old.iter().zip(new).filter(|&pair| agrees(pair)).count(), old.len())
        } else {
            let all = old.iter().flat_map(|a| new.iter().map(move |b| (a, b)));
            share(all.filter(|&pair| agrees(pair)).count(), old.len() * new.len())
        };
        Self { mean, interval: [means[tail], means[RESAMPLES - 1 - tail]], agreement }
    }
}
