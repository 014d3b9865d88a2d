//! Histories of made-up runs: their files and findings.

use std::fs;

use medial_reports::diff::{Diff, Meaning};
use medial_reports::history::{Findings, Run, read_runs};
use medial_run::level::Target;
use medial_run::record::{Record, Repetition, Stages, Status};

use super::common::{failed, noise, ok};

/// The records of a run of 16 series; `change` alters a record and its seconds.
fn records(run: usize, change: impl Fn(&mut Record, &mut f64)) -> Vec<Record> {
    let mut records = Vec::new();
    for (shape, mesh) in ["bear", "box"].iter().enumerate() {
        for (rank, method) in ["qmat", "pmat", "hem", "angle"].iter().enumerate() {
            for count in [500, 100] {
                let mut record = ok(mesh, method, count, shape, rank);
                record.mesh_hash = Some(format!("{shape:064}"));
                record.result_hash = Some(format!("{rank}{count:063}"));
                let evaluation = record.evaluate.as_mut().expect("measured");
                (evaluation.betti, evaluation.expected_betti) = ([1, 0, 0], Some([1, 0, 0]));
                let mut seconds =
                    0.2 * (rank + 1) as f64 * (0.96 + 0.08 * noise(run, records.len(), 0));
                change(&mut record, &mut seconds);
                let stages = Stages::new(0.1, seconds / 2.0, seconds / 2.0);
                record.repetitions = vec![Repetition { seconds: stages, cpu_seconds: stages }];
                records.push(record);
            }
        }
    }
    records
}

fn commit(run: usize) -> String {
    format!("{:08x}{run:032x}", run.wrapping_mul(2_654_435_761) % 0xFFFF_FFFF)
}

fn date(run: usize) -> String {
    format!("{:04}-{:02}-{:02}T02:15:00Z", 2026 + run / 336, 1 + run / 28 % 12, 1 + run % 28)
}

fn run_of(records: &[Record], run: usize) -> Run {
    Run::of_records(records, &commit(run), &date(run)).expect("a run")
}

fn runs(count: usize, change: impl Fn(usize, &mut Record, &mut f64)) -> Vec<Run> {
    let run = |k| run_of(&records(k, |record, seconds| change(k, record, seconds)), k);
    (0..count).map(run).collect()
}

#[test]
fn runs_are_stored_once_and_read_back_in_order() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut runs = runs(3, |_, record, _| {
        if record.simplify.method == "hem" && record.mesh == "box" {
            *record = failed("box", "hem", 500, Status::TimedOut, "no result within 300 s");
        }
    });
    // The second run of a day sorts by its time, for any commit.
    runs[2].date = date(1).replace("02:15", "01:15");
    for run in &runs {
        assert!(run.add_to(folder.path()).expect("added").1);
    }
    let (path, is_new) = runs[0].add_to(folder.path()).expect("the same content is no error");
    assert!(!is_new);
    let (read, damaged) = read_runs(folder.path()).expect("read");
    assert!(damaged.is_empty());
    assert_eq!(read, [runs[0].clone(), runs[2].clone(), runs[1].clone()]);
    let hem = &read[0].series.iter().find(|p| p.mesh == "box" && p.method == "hem");
    assert_eq!(hem.map(|point| (point.status, point.seconds)), Some((Status::TimedOut, None)));
    let bytes = fs::metadata(&path).expect("a file").len() as usize;
    assert!(bytes < 800 * read[0].series.len(), "{bytes}");

    let other = run_of(&records(7, |_, seconds| *seconds *= 2.0), 0);
    let taken = other.add_to(folder.path()).expect_err("another run is stored there").to_string();
    assert!(
        taken.contains(&*path.to_string_lossy()) && taken.contains("remove the file"),
        "{taken}"
    );
    // A damaged file is reported and left out, and not replaced either.
    let whole = fs::read_to_string(&path).expect("read");
    let renamed = whole.replacen(&date(0), "2020-01-01", 1);
    for text in [&whole[..whole.len() / 2], "", &whole.replacen("\"ok\"", "\"fine\"", 1), &renamed]
    {
        fs::write(&path, text).expect("written");
        let (read, damaged) = read_runs(folder.path()).expect("read");
        let [error] = damaged.as_slice() else { panic!("{damaged:?}") };
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        assert!(read.len() == 2 && error.to_string().contains(&name), "{error}");
        assert!(runs[0].add_to(folder.path()).is_err());
    }
}

#[test]
fn runs_are_sorted_by_the_instant_of_their_dates() {
    let folder = tempfile::tempdir().expect("a folder");
    // By text the last is the third.
    let dates = [
        "2026-03-01T01:30:00+02:00", // 23:30 of the day before
        "2026-03-01",
        "2026-03-01T00:30",
        "2026-03-02T00:30:00+05:00", // 19:30 of the day before
        "2026-03-01T20:00:00Z",
    ];
    let some = records(0, |_, _| ());
    for (k, date) in dates.iter().enumerate().rev() {
        let run = Run::of_records(&some, &commit(k), date).expect("a run");
        run.add_to(folder.path()).expect("added");
    }
    let (read, damaged) = read_runs(folder.path()).expect("read");
    assert!(damaged.is_empty(), "{damaged:?}");
    assert_eq!(read.iter().map(|run| &*run.date).collect::<Vec<_>>(), dates);
    let path = folder.path().join("2026-03-01-00000000.json");
    let whole = serde_json::to_string(&read[1]).expect("JSON");
    for wrong in ["2026-02-30", "2026-03-0é", "2026-03-01T25:00"] {
        fs::write(&path, whole.replacen("2026-03-01", wrong, 1)).expect("written");
        let (read, damaged) = read_runs(folder.path()).expect("read");
        assert_eq!((read.len(), damaged.len()), (4, 1), "{wrong}");
    }
}

#[cfg(unix)]
#[test]
fn pipes_are_skipped_without_reading() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = &runs(1, |_, _, _| {})[0];
    run.add_to(folder.path()).expect("added");
    let pipe = folder.path().join("2026-01-09-00000000.json");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("runs").success());
    let (read, damaged) = read_runs(folder.path()).expect("a history");
    assert_eq!((read.len(), damaged.len()), (1, 1));
    assert!(damaged[0].to_string().ends_with("00000000.json: not a regular file"));
    let error = medial_run::journal::read_records(&pipe).expect_err("a pipe");
    assert!(error.to_string().ends_with("not a regular file"), "{error}");
}

#[test]
fn records_of_more_than_one_run_are_rejected() {
    let refused = |records: &[Record], commit: &str, date: &str| {
        Run::of_records(records, commit, date).expect_err("refused").to_string()
    };
    let some = records(0, |_, _| ());
    assert!(refused(&[], &commit(0), "2026-11-23").contains("no record"));
    for wrong in ["HEAD", "abc", "../../etc/passwd", ""] {
        assert!(refused(&some, wrong, "2026-11-23").contains("hexadecimal"), "{wrong}");
    }
    for wrong in [
        "today",
        "2026-1-1",
        "2026/01/01",
        "2026-01-01/../x",
        "",
        "2026-02-30",
        "2026-01-01T25:00Z",
        "2026-01-01T12:00:00+99:00",
        "20260101",
        "2026-01-01T12:00[Europe/Paris]",
    ] {
        assert!(refused(&some, &commit(0), wrong).contains("YYYY-MM-DD"), "{wrong}");
    }
    let changes: [fn(&mut Record); 2] = [
        |record| record.machine.cpu = "Another".into(),
        |record| record.simplify.threads = Some(8),
    ];
    for change in changes {
        let mut mixed = some.clone();
        change(&mut mixed[3]);
        assert!(refused(&mixed, &commit(0), "2026-11-23").contains("bear, pmat"));
    }
}

#[test]
fn a_change_point_is_reported_once_with_its_commits() {
    let runs = runs(60, |run, record, seconds| {
        if run >= 30 && record.simplify.method == "pmat" && record.mesh == "box" {
            *seconds *= 1.2;
        }
    });
    let findings = Findings::of(&runs);
    assert_eq!((findings.change_points.len(), findings.changes.len()), (2, 0));
    for change in &findings.change_points {
        let item = &change.change.item;
        assert_eq!((item.mesh.as_str(), item.method.as_str()), ("box", "pmat"), "{change:?}");
        assert_eq!(change.change.meaning, Meaning::Regression);
        assert!(!change.shared && !change.news, "an old change is no news");
        assert!((change.change.relative.expect("known") - 0.2).abs() < 0.03, "{change:?}");
        assert_eq!((&change.last_before.commit, change.run), (&commit(29), 30));
    }
    let text = findings.to_markdown();
    let range = format!("{}..{}", &commit(29)[..8], &commit(30)[..8]);
    assert!(text.contains(&range) && text.starts_with("# No regression"), "{text}");
    let json = serde_json::to_value(&findings).expect("JSON");
    assert_eq!(json["change_points"][0]["first_after"]["commit"], commit(30));
    // Both series are found within some runs: the method alarms once, for any size of the step.
    for factor in [1.2, 1.5, 5.7] {
        let runs = self::runs(50, |run, record, seconds| {
            if run >= 30 && record.simplify.method == "pmat" && record.mesh == "box" {
                *seconds *= factor;
            }
        });
        let news: Vec<usize> =
            (25..=50).map(|count| Findings::of(&runs[..count]).regressions).collect();
        assert_eq!(
            (news.iter().sum::<usize>(), news[9..14].iter().sum::<usize>()),
            (1, 1),
            "{news:?}"
        );
        let night = 25 + news.iter().position(|&count| count == 1).expect("an alarm");
        let text = Findings::of(&runs[..night]).to_markdown();
        let words = if factor == 5.7 { " times slower on box" } else { " % slower on box" };
        let first = text.lines().next().expect("a line");
        assert!(first.starts_with("# pmat ") && first.ends_with(words), "{first}");
    }
}

#[test]
fn a_step_of_most_series_is_attributed_to_the_machine() {
    let runs = runs(50, |run, record, seconds| {
        *seconds *= if run >= 30 { 1.15 } else { 1.0 };
        // Beyond that, one method is slower by itself.
        *seconds *= if run >= 30 && record.simplify.method == "angle" { 1.5 } else { 1.0 };
    });
    let findings = Findings::of(&runs);
    assert_eq!(findings.change_points.len(), 16);
    for change in &findings.change_points {
        assert_eq!(change.shared, change.change.item.method != "angle", "{change:?}");
    }
    assert!(findings.to_markdown().contains("the machine"));
    for count in 31..=50 {
        let findings = Findings::of(&runs[..count]);
        assert!(findings.news().all(|change| change.change.item.method == "angle"), "{count}");
    }
}

#[test]
fn exact_values_change_after_one_run() {
    let runs = runs(10, |run, record, _| {
        if run >= 9 && record.simplify.method == "qmat" && record.mesh == "bear" {
            record.result_hash = Some("f".repeat(64));
            let evaluation = record.evaluate.as_mut().expect("measured");
            evaluation.distances.hausdorff *= 1.1;
            evaluation.betti = [1, 2, 0];
        }
        if run >= 5 && record.simplify.method == "hem" {
            record.result_hash = Some("e".repeat(64));
        }
    });
    let findings = Findings::of(&runs);
    let found: Vec<(usize, &str, Meaning)> = (findings.changes.iter())
        .map(|dated| (dated.run, &*dated.change.what, dated.change.meaning))
        .collect();
    let newest = [
        (9, "evaluate.betti", Meaning::Regression),
        (9, "evaluate.hausdorff", Meaning::Regression),
        (9, "result_hash", Meaning::Changed),
    ];
    let older = [(5, "result_hash", Meaning::Changed); 4];
    assert_eq!(found, [&newest[..], &newest, &older].concat());
    assert!((findings.changes[1].change.relative.expect("known") - 0.1).abs() < 1e-5);
    // Two results of one method, each counted once.
    assert_eq!((findings.regressions, findings.compared), (2, 16));
    let text = findings.to_markdown();
    assert!(text.starts_with("# qmat worse on 1 of 2 meshes, topology lost\n"), "{text}");
    assert!(text.contains("+10.0 %"), "{text}");
}

#[test]
fn a_history_counts_as_its_difference_does() {
    type Case = (&'static str, fn(&mut Record));
    let cases: [Case; 6] = [
        ("# No regression\n", |_| ()),
        ("# qmat worse on 2 of 2 meshes, Hausdorff +10 to +30 %\n", |record| {
            let factor = if record.mesh == "bear" { 1.1 } else { 1.3 };
            let distances = &mut record.evaluate.as_mut().expect("measured").distances;
            distances.hausdorff *= factor;
            distances.mean *= 2.0; // a result counts once
        }),
        ("# qmat worse on 2 of 2 meshes, topology lost\n", |record| {
            record.evaluate.as_mut().expect("measured").betti = [1, 2, 0];
        }),
        ("# qmat worse on 2 of 2 meshes, result lost\n", |record| {
            *record = failed(&record.mesh, "qmat", 100, Status::TimedOut, "no result within 300 s");
        }),
        ("# qmat worse on 2 of 2 meshes, memory +20 %\n", |record| {
            let bytes = record.simplify.peak_bytes.as_mut().expect("measured");
            *bytes = 50_000_000 * if record.seeds.contains_key("worse") { 6 } else { 5 } / 5;
        }),
        ("# No regression\n", |record| record.result_hash = Some("a".repeat(64))),
    ];
    for (first, change) in cases {
        let night = |run: usize| {
            records(run, |record, _| {
                if record.simplify.method == "qmat" && record.simplify.level == Target::Spheres(100)
                {
                    let seeds = record.seeds.clone();
                    if run == 1 || first.contains("memory") {
                        record.seeds.extend((run == 1).then(|| ("worse".to_owned(), 0)));
                        let hash = record.mesh_hash.clone();
                        change(record);
                        record.mesh_hash = hash;
                    }
                    record.seeds = seeds;
                }
            })
        };
        let [old, new] = [night(0), night(1)];
        let difference = Diff::new(["old".into(), "new".into()], &old, &new, false);
        let mut runs: Vec<Run> =
            [&old, &new, &new].into_iter().enumerate().map(|(k, r)| run_of(r, k)).collect();
        let again = Findings::of(&runs);
        assert_eq!((again.regressions, again.headline.as_deref()), (0, None), "{first}");
        runs.pop();
        let findings = Findings::of(&runs);
        assert_eq!(findings.regressions, difference.count(Meaning::Regression), "{first}");
        assert_eq!(findings.regressions, if first.contains("qmat") { 2 } else { 0 });
        for text in [findings.to_markdown(), difference.to_markdown()] {
            assert!(text.starts_with(first), "{first}: {text}");
        }
        let text = Findings::of(&runs[..1]).to_markdown();
        assert!(text.starts_with("# First run, nothing to compare\n"), "{text}");
    }
}

#[test]
fn alternating_machines_are_compared_separately() {
    let runs = runs(80, |run, record, seconds| {
        if run.is_multiple_of(3) {
            record.machine.cpu = "Another".to_owned();
            record.result_hash = Some("a".repeat(64));
            *seconds *= 2.0;
        }
        *seconds *= if run >= 40 && record.simplify.method == "hem" { 1.3 } else { 1.0 };
    });
    let findings = Findings::of(&runs);
    assert!(findings.changes.is_empty());
    let places: Vec<usize> = findings.change_points.iter().map(|change| change.run).collect();
    assert_eq!(places, [42, 42, 42, 42, 40, 40, 40, 40]);
    assert!(findings.to_markdown().contains("Another"));
}
