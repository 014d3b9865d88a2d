//! The difference of two sets of records: regressions, listed changes, ignored noise.

use medial::metrics::Evaluation;
use medial_reports::diff::{Diff, Meaning};
use medial_run::record::{Record, Repetition, Stages};

use super::common::{self, SHAPES, comparison};

const METHODS: [&str; 3] = ["qmat", "angle", "lambda"];

fn diff(old: &[Record], new: &[Record]) -> Diff {
    Diff::new(["before".into(), "after".into()], old, new, true)
}

/// Records with repetitions, from the record, its place and the number of the repetition: the shares of the wall-clock
/// and the CPU seconds, and the further share of both without the substrates.
fn repeated(repetitions: usize, shares: impl Fn(&Record, usize, usize) -> [f64; 3]) -> Vec<Record> {
    let mut records = comparison(&SHAPES[..4], &METHODS, &[500, 100]);
    for (place, record) in records.iter_mut().enumerate() {
        let Some(Stages { substrate, prepare, simplify, .. }) = record.simplify.seconds else {
            continue;
        };
        let lap = |k: usize| {
            let [wall, cpu, own] = shares(record, place, k);
            let [seconds, cpu_seconds] = [wall, cpu].map(|share| {
                Stages::new(share * substrate, share * own * prepare, share * own * simplify)
            });
            Repetition { seconds, cpu_seconds }
        };
        record.repetitions = (0..repetitions).map(lap).collect();
    }
    records
}

/// Records with ten repetitions, each with a noise of some share of its seconds, on a machine whose load in the moment
/// of a repetition slows all by up to a half.
fn timed(seed: usize, noise: f64, factor: impl Fn(&Record) -> f64) -> Vec<Record> {
    repeated(10, |record, place, k| {
        let load = 1.25 + 0.25 * (2.0 * common::noise(k, 0, 0) - 1.0);
        let random = 1.0 + noise * (2.0 * common::noise(seed, place, k + 77) - 1.0);
        [load * random, load * random, factor(record)]
    })
}

#[test]
fn equal_records_and_noise_are_no_regression() {
    for seed in 0..20 {
        let diff = diff(&timed(seed, 0.1, |_| 1.0), &timed(seed + 100, 0.1, |_| 1.0));
        assert_eq!(diff.count(Meaning::Regression), 0, "seed {seed}: {}", diff.to_markdown());
        assert_eq!((diff.count(Meaning::Improvement), diff.changes.len()), (0, 0), "seed {seed}");
        assert!(diff.compared > 20 && diff.missing.is_empty() && diff.untimed.is_empty());
        assert!(diff.to_markdown().starts_with("# No regression"));
    }
}

/// Records of a machine with two endless loops: in each repetition all CPU seconds of a build are longer by up
/// to a fifth, in one of ten by another half, and the clock on the wall runs up to three times as long.
fn busy(seed: usize, repetitions: usize, factor: f64) -> Vec<Record> {
    repeated(repetitions, |_, place, k| {
        let noise = |what| common::noise(seed, k, what);
        let share = factor * (1.0 + 0.2 * noise(1)) * if noise(2) < 0.1 { 1.5 } else { 1.0 };
        let share = share * (1.0 + 0.05 * common::noise(seed, place, k + 77));
        [share * (1.0 + 2.0 * noise(3)), share, 1.0]
    })
}

#[test]
fn a_slow_build_is_a_regression_and_a_busy_machine_is_not() {
    let silent = |alternating| {
        let names = || ["before".to_owned(), "after".to_owned()];
        (0..200).all(|seed| {
            let diff =
                Diff::new(names(), &busy(seed, 5, 1.0), &busy(seed + 1000, 5, 1.0), alternating);
            diff.count(Meaning::Regression) + diff.count(Meaning::Improvement) == 0
        })
    };
    assert!(silent(true) && silent(false));
    let found = (0..20).filter(|&seed| {
        diff(&busy(seed, 10, 1.0), &busy(seed + 1000, 10, 1.8)).count(Meaning::Regression) >= 4
    });
    let found = found.count();
    assert!(found >= 15, "{found} of 20");
}

#[test]
fn only_the_slower_method_is_reported() {
    let slower = |record: &Record| if record.simplify.method == "angle" { 1.15 } else { 1.0 };
    for seed in 0..20 {
        let diff = diff(&timed(seed, 0.1, |_| 1.0), &timed(seed + 100, 0.1, slower));
        let found = diff.timings.iter().filter(|timing| timing.meaning.is_some());
        let found: Vec<_> = found.map(|t| (t.method.as_str(), t.meaning)).collect();
        assert!(found.contains(&("angle", Some(Meaning::Regression))), "seed {seed}: {found:?}");
        assert!(found.iter().all(|(method, _)| *method == "angle"), "seed {seed}: {found:?}");
    }
    let faster = diff(&timed(1, 0.1, slower), &timed(2, 0.1, |_| 1.0));
    assert_eq!(faster.count(Meaning::Regression), 0);
    assert!(faster.count(Meaning::Improvement) > 0);
}

#[test]
fn a_slower_mesh_is_reported_without_its_method() {
    let slower = |record: &Record| {
        let is_it = record.simplify.method == "qmat" && record.mesh == SHAPES[2];
        if is_it { 1.18 } else { 1.0 }
    };
    let diff = diff(&timed(1, 0.02, |_| 1.0), &timed(2, 0.02, slower));
    let found: Vec<_> = (diff.timings.iter())
        .filter(|timing| timing.meaning.is_some())
        .map(|timing| (timing.method.as_str(), timing.mesh.as_deref()))
        .collect();
    assert_eq!(found, [("qmat", Some(SHAPES[2]))]);
}

#[test]
fn changes_of_exact_quantities_are_reported_by_name() {
    let old = comparison(&SHAPES[..4], &METHODS, &[500, 100]);
    type Case = (&'static str, Meaning, fn(&mut Record, &mut Evaluation));
    let cases: [Case; 7] = [
        ("evaluate.hausdorff", Meaning::Regression, |_, e| e.distances.hausdorff *= 1.01),
        ("evaluate.mean", Meaning::Improvement, |_, e| e.distances.mean *= 0.99),
        // Below the threshold, but no less listed.
        ("evaluate.hausdorff", Meaning::Changed, |_, e| e.distances.hausdorff *= 1.0 + 1e-12),
        ("evaluate.betti", Meaning::Regression, |_, e| e.betti[1] += 1),
        ("simplify.peak_bytes", Meaning::Regression, |record, _| {
            record.simplify.peak_bytes = record.simplify.peak_bytes.map(|bytes| bytes + bytes / 10);
        }),
        ("simplify.diagnostics", Meaning::Changed, |record, _| {
            *record.simplify.diagnostics.values_mut().next().unwrap() += 1;
        }),
        ("result_hash", Meaning::Changed, |record, _| record.result_hash = Some("12ab".into())),
    ];
    for (what, meaning, change) in cases {
        let mut new = old.clone();
        let one = new.iter_mut().rfind(|r| r.status.is_ok() && r.simplify.method == "qmat");
        let one = one.unwrap();
        let mut evaluation = one.evaluate.take().unwrap();
        change(one, &mut evaluation);
        one.evaluate = Some(evaluation);
        let diff = diff(&old, &new);
        let [found] = &diff.changes[..] else { panic!("{what}: {}", diff.to_markdown()) };
        assert!(found.what.starts_with(what), "{what}: {}", found.what);
        assert_eq!((&*found.item.method, found.meaning), ("qmat", meaning), "{what}");
    }
}

#[test]
fn incomparable_records_are_listed_with_the_reason() {
    let old = timed(1, 0.0, |_| 1.0);
    let mut new = old.clone();
    new.iter_mut().for_each(|record| record.machine.cpu = "another".into());
    let difference = diff(&old, &new);
    assert!(difference.timings.is_empty() && difference.untimed[0].contains("different machines"));
    assert!(difference.compared > 20);

    let mut new = old.clone();
    new.iter_mut().for_each(|record| record.simplify.threads = Some(8));
    let difference = diff(&old, &new);
    assert_eq!((difference.compared, difference.unlike.len()), (0, old.len()));
    assert_eq!(difference.unlike[0].why, "threads 8, 1 before");
    assert!(difference.to_markdown().starts_with("# Nothing could be compared"));

    let mut known = old.clone();
    known[0].mesh_hash = Some("00".repeat(32));
    let mut new = known.clone();
    new[0].mesh_hash = Some("ff".repeat(32));
    let why = &diff(&known, &new).unlike[0].why;
    assert_eq!(why, "the mesh has other content: ffffffffffff, 000000000000 before");

    let once = comparison(&SHAPES[..4], &METHODS, &[500, 100]);
    let difference = diff(&once, &once);
    assert!(difference.untimed[0].contains("fewer than 5 repetitions"), "{:?}", difference.untimed);

    let difference = diff(&old, &old[1..]);
    assert_eq!((difference.missing.len(), difference.count(Meaning::Regression)), (1, 0));
    let markdown = difference.to_markdown();
    assert!(markdown.contains("only in the older"));
    assert!(
        markdown
            .lines()
            .nth(2)
            .is_some_and(|line| line.contains("; 1 result missing in the newer."))
    );
    assert_eq!(diff(&old[1..], &old).added.len(), 1);
}
