//! Histories of made-up nights: what is kept, what is refused, what is found and what is said of it.

use std::fs;
use std::path::Path;

use super::common::ok;
use medial_reports::history::{Findings, History, HistoryError, Night, Quantity};
use medial_reports::{Record, Repetition, Stages, Status};

const METHODS: [&str; 4] = ["qmat", "pmat", "hem", "angle"];
const MESHES: [&str; 2] = ["bear", "box"];

/// A number in [-1, 1) that depends on its arguments alone.
fn noise(night: usize, series: usize) -> f64 {
    let mut x = (night as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (series as u64 + 3).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    for _ in 0..3 {
        x ^= x >> 31;
        x = x.wrapping_mul(0xD6E8_FEB8_6659_FD93);
    }
    (x >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// The records of a night; `change` makes it another one than the rest.
fn records(night: usize, change: &dyn Fn(&mut Record, &mut f64)) -> Vec<Record> {
    let mut records = Vec::new();
    for (shape, mesh) in MESHES.iter().enumerate() {
        for (rank, method) in METHODS.iter().enumerate() {
            for count in [500, 100] {
                let mut record = ok(mesh, method, count, shape, rank);
                record.mesh_hash = Some(format!("{shape:064}"));
                record.result_hash = Some(format!("{rank}{count:063}"));
                record.evaluate.as_mut().expect("measured").betti = [1, 0, 0];
                record.evaluate.as_mut().expect("measured").expected_betti = Some([1, 0, 0]);
                let mut seconds =
                    0.2 * (rank + 1) as f64 * (1.0 + 0.04 * noise(night, records.len()));
                change(&mut record, &mut seconds);
                let stages = Stages::new(0.1, seconds / 2.0, seconds / 2.0);
                record.repetitions = vec![Repetition { seconds: stages, cpu_seconds: stages }];
                records.push(record);
            }
        }
    }
    records
}

fn commit(night: usize) -> String {
    format!("{:08x}{:032x}", night.wrapping_mul(2_654_435_761) % 0xFFFF_FFFF, night)
}

fn date(night: usize) -> String {
    format!("{:04}-{:02}-{:02}", 2026 + night / 336, 1 + night / 28 % 12, 1 + night % 28)
}

/// A history in a folder, where `change` is told the night.
fn history(folder: &Path, nights: usize, change: impl Fn(usize, &mut Record, &mut f64)) -> History {
    for night in 0..nights {
        let records = records(night, &|record, seconds| change(night, record, seconds));
        let night = Night::of_records(&records, &commit(night), &date(night)).expect("a night");
        History::add(folder, night).expect("added");
    }
    History::read(folder).expect("read")
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

#[test]
fn nights_survive_their_files_and_are_small() {
    let folder = folder();
    let history = history(folder.path(), 3, |_, record, _| {
        // Everything that may be missing is missing somewhere.
        if record.simplify.method == "hem" && record.mesh == "box" {
            *record = super::common::failed(
                "box",
                "hem",
                500,
                Status::TimedOut,
                "no result within 300 s",
            );
            record.mesh_hash = None;
        }
    });
    assert_eq!(history.nights.len(), 3);
    assert!(history.damaged.is_empty());
    let night = &history.nights[1];
    assert_eq!(night.series.len(), 15, "two levels of hem on the box became one");
    let (_, lost) = night.series.iter().find(|(name, _)| name.row == "hem").expect("hem");
    assert!(lost.seconds.is_some());
    let text = night.to_text();
    assert_eq!(Night::parse(&text, Path::new(&night.file_name())).expect("reads back"), *night);
    let bytes = text.len() / night.series.len();
    assert!(bytes < 150, "{bytes} bytes for each series");
}

#[test]
fn a_night_is_kept_once() {
    let folder = folder();
    let same = |_: &mut Record, _: &mut f64| ();
    let add = |records: &[Record], date: &str| {
        History::add(folder.path(), Night::of_records(records, &commit(7), date).expect("a night"))
    };
    let (path, new) = add(&records(7, &same), "2026-11-23").expect("added");
    assert!(new);
    let text = fs::read(&path).expect("read");
    let again = add(&records(7, &same), "2026-11-23").expect("the same content is no error");
    assert_eq!(again, (path.clone(), false));
    let other = records(7, &|_, seconds| *seconds *= 2.0);
    match add(&other, "2026-11-23") {
        Err(HistoryError::Taken(taken)) => assert_eq!(taken, path),
        other => panic!("{other:?}"),
    }
    assert_eq!(fs::read(&path).expect("read"), text, "nothing was written");
    assert!(add(&other, "2026-11-24").expect("another night").1);
}

#[test]
fn nights_of_one_date_keep_the_order_in_which_they_came() {
    let folder = folder();
    let records = records(0, &|_, _| ());
    for commit in ["ffffffff1", "aaaaaaaa2", "cccccccc3"] {
        let night = Night::of_records(&records, commit, "2026-11-23").expect("a night");
        History::add(folder.path(), night).expect("added");
    }
    let nights = History::read(folder.path()).expect("read").nights;
    let commits: Vec<&str> = nights.iter().map(|night| night.commit.as_str()).collect();
    assert_eq!(commits, ["ffffffff1", "aaaaaaaa2", "cccccccc3"]);
}

#[test]
fn what_is_no_night_is_refused() {
    let night = |records: &[Record], commit: &str, date: &str| {
        Night::of_records(records, commit, date).expect_err("refused").to_string()
    };
    let some = records(0, &|_, _| ());
    assert!(night(&[], &commit(0), "2026-11-23").contains("no record"));
    for wrong in ["HEAD", "abc", "../../etc/passwd", ""] {
        assert!(night(&some, wrong, "2026-11-23").contains("hexadecimal"), "{wrong}");
    }
    for wrong in ["today", "2026-13-01", "2026-1-1", "2026-01-32", "2026-01-01-01", "2026/01/01"] {
        assert!(night(&some, &commit(0), wrong).contains("YYYY-MM-DD"), "{wrong}");
    }
    let mut mixed = some.clone();
    mixed[3].machine.cpu = "Another".into();
    assert!(night(&mixed, &commit(0), "2026-11-23").contains("machine"));
    let mut mixed = some.clone();
    mixed[3].simplify.threads = Some(8);
    assert!(night(&mixed, &commit(0), "2026-11-23").contains("threads"));
    let mut mixed = some;
    mixed[0].mesh_hash = Some("1".repeat(64));
    assert!(night(&mixed, &commit(0), "2026-11-23").contains("content"));
}

#[test]
fn damaged_files_are_named_and_left_out() {
    let folder = folder();
    history(folder.path(), 4, |_, _, _| ());
    let path =
        |night: usize| folder.path().join(format!("{}-{}.tsv", date(night), &commit(night)[..8]));
    let whole = fs::read_to_string(path(1)).expect("read");
    let damages: [(&str, String); 6] = [
        ("cut", whole[..whole.len() / 2].to_owned()),
        ("empty", String::new()),
        ("number", whole.replacen("\tok\t", "\tok\tNaN", 1)),
        ("status", whole.replacen("\tok\t", "\tfine\t", 1)),
        ("date", whole.replacen(&date(1), "2020-01-01", 1)),
        ("twice", format!("{whole}{}\n", whole.lines().last().expect("a line"))),
    ];
    for (what, text) in damages {
        fs::write(path(1), text).expect("written");
        let history = History::read(folder.path()).expect("read");
        assert_eq!(history.nights.len(), 3, "{what}");
        let [error] = history.damaged.as_slice() else { panic!("{what}: {:?}", history.damaged) };
        let name = path(1).file_name().expect("a name").to_string_lossy().into_owned();
        assert!(error.to_string().contains(&name), "{what}: {error}");
        // Not replaced either, as if it were not there.
        let night = Night::of_records(&records(1, &|_, _| ()), &commit(1), &date(1));
        assert!(History::add(folder.path(), night.expect("a night")).is_err(), "{what}");
    }
}

#[test]
fn a_step_is_named_with_its_night_and_commits() {
    let folder = folder();
    let slower = |night: usize, record: &mut Record, seconds: &mut f64| {
        if night >= 30 && record.simplify.method == "pmat" && record.mesh == "box" {
            *seconds *= 1.2;
        }
    };
    let history = history(folder.path(), 60, slower);
    let findings = Findings::of(&history, 0.05);
    assert_eq!(findings.steps.len(), 2, "{:?}", findings.steps);
    for step in &findings.steps {
        let name = findings.tracks[step.track].name;
        assert_eq!((name.mesh.as_str(), name.row.as_str()), ("box", "pmat"));
        assert_eq!((step.quantity, step.before, step.night), (Quantity::Seconds, 29, 30));
        assert!(step.is_worse() && !step.shared && !step.news);
        assert!((step.step.ratio - 1.2).abs() < 0.02, "{step:?}");
    }
    assert!(findings.changes.is_empty() && findings.shared.is_empty());
    assert_eq!(findings.regressions().0.len(), 0, "an old step is no news");
    // Worst first.
    let worst = findings.tracks[findings.worst_first()[0]].name;
    assert_eq!((worst.mesh.as_str(), worst.row.as_str()), ("box", "pmat"));
    let text = findings.to_markdown();
    let range = format!("{}..{}", &commit(29)[..8], &commit(30)[..8]);
    assert!(text.contains(&range) && text.contains(&date(30)), "{text}");
    let json = findings.to_json();
    assert_eq!(json["steps"][0]["commits"]["last_before"]["commit"], commit(29));
    assert_eq!(json["steps"][0]["commits"]["first_after"]["commit"], commit(30));
}

#[test]
fn a_step_is_news_on_one_night_alone() {
    let folder = folder();
    let slower = |night: usize, record: &mut Record, seconds: &mut f64| {
        if night >= 30 && record.simplify.method == "pmat" {
            *seconds *= 1.3;
        }
    };
    let mut whole = history(folder.path(), 45, slower);
    let all = std::mem::take(&mut whole.nights);
    let news: Vec<usize> = (25..=45)
        .map(|nights| {
            let history = History { nights: all[..nights].to_vec(), damaged: vec![] };
            Findings::of(&history, 0.05).regressions().0.len()
        })
        .collect();
    // Four series; after the fourth night or soon after, each once.
    assert_eq!(news.iter().sum::<usize>(), 4, "{news:?}");
    assert!(
        news[..9].iter().all(|&n| n == 0) && news[9..14].iter().sum::<usize>() == 4,
        "{news:?}"
    );
}

#[test]
fn what_most_series_do_is_the_machine() {
    let folder = folder();
    let slower = |night: usize, record: &mut Record, seconds: &mut f64| {
        if night >= 30 {
            *seconds *= 1.15;
        }
        // Beyond that, one method is slower by itself.
        if night >= 30 && record.simplify.method == "angle" {
            *seconds *= 1.5;
        }
    };
    let mut whole = history(folder.path(), 50, slower);
    let all = std::mem::take(&mut whole.nights);
    let findings = |nights: usize| History { nights: all[..nights].to_vec(), damaged: vec![] };
    let told = findings(50);
    let told = Findings::of(&told, 0.05);
    assert_eq!(told.shared.len(), 1, "{:?}", told.shared);
    assert_eq!(told.shared[0].night, 30);
    assert!((told.shared[0].ratio - 1.15).abs() < 0.03, "{:?}", told.shared);
    for step in &told.steps {
        let own = told.tracks[step.track].name.row == "angle";
        assert_eq!(step.shared, !own, "{:?} {step:?}", told.tracks[step.track].name);
    }
    assert!(told.to_markdown().contains("the machine"), "{}", told.to_markdown());
    // No alarm on any night but for that method.
    for nights in 31..=50 {
        let history = findings(nights);
        let findings = Findings::of(&history, 0.05);
        let (steps, _) = findings.regressions();
        assert!(steps.iter().all(|step| findings.tracks[step.track].name.row == "angle"));
    }
}

#[test]
fn exact_figures_change_at_once() {
    let folder = folder();
    let change = |night: usize, record: &mut Record, _: &mut f64| {
        if night >= 9 && record.simplify.method == "qmat" && record.mesh == "bear" {
            record.result_hash = Some("f".repeat(64));
            let evaluation = record.evaluate.as_mut().expect("measured");
            evaluation.distances.hausdorff *= 1.1;
            evaluation.betti = [1, 2, 0];
        }
        if night >= 5 && record.simplify.method == "hem" {
            record.result_hash = Some("e".repeat(64));
        }
    };
    let history = history(folder.path(), 10, change);
    let findings = Findings::of(&history, 0.05);
    let at: Vec<usize> = findings.changes.iter().map(|change| change.night).collect();
    assert_eq!(at, [9, 9, 5, 5, 5, 5], "the newest first");
    let whats: Vec<&str> = findings.changes[0].differences.iter().map(|d| d.what).collect();
    assert_eq!(whats, ["topology", "hausdorff", "result"]);
    assert!((findings.changes[0].differences[1].ratio.expect("known") - 1.1).abs() < 1e-5);
    assert!(!findings.changes[2].is_worse(), "another result alone is no loss");
    let (steps, changes) = findings.regressions();
    assert_eq!((steps.len(), changes.len()), (0, 2));
    let text = findings.to_markdown();
    assert!(text.contains("2 lost the topology") && text.contains("+10.0 %"), "{text}");
}

#[test]
fn machines_that_take_turns_are_not_compared() {
    let folder = folder();
    let other = |night: usize, record: &mut Record, seconds: &mut f64| {
        if night.is_multiple_of(3) {
            record.machine.cpu = "Another".to_owned();
            record.result_hash = Some("a".repeat(64));
            *seconds *= 2.0;
        }
        if night >= 40 && record.simplify.method == "hem" {
            *seconds *= 1.3;
        }
    };
    let history = history(folder.path(), 80, other);
    let findings = Findings::of(&history, 0.05);
    assert_eq!(findings.groups.len(), 2);
    assert_eq!(findings.tracks.len(), 32);
    assert!(findings.changes.is_empty());
    // Found on both, each with the nights of that machine.
    assert_eq!(findings.steps.len(), 8, "{:?}", findings.steps);
    for step in &findings.steps {
        let on_other = findings.tracks[step.track].group == 0;
        assert_eq!((step.before, step.night), if on_other { (39, 42) } else { (38, 40) });
    }
    let text = findings.to_markdown();
    assert!(text.contains("Another") && text.contains("not compared"), "{text}");
}

#[test]
fn pages_stay_small_and_hold_no_script() {
    let folder = folder();
    let slower = |night: usize, record: &mut Record, seconds: &mut f64| {
        if night >= 300 && record.simplify.method == "pmat" {
            *seconds *= 1.2;
        }
        if night >= 250 {
            *seconds *= 0.8;
        }
        if night == 399 && record.simplify.method == "hem" && record.mesh == "box" {
            record.evaluate.as_mut().expect("measured").betti = [2, 0, 0];
        }
        record.mesh = format!("{}<b>", record.mesh);
    };
    let history = history(folder.path(), 400, slower);
    let findings = Findings::of(&history, 0.05);
    let html = findings.to_html(&["a remark".to_owned()]);
    if let Some(path) = std::env::var_os("MEDIAL_HISTORY_PAGE") {
        fs::write(path, &html).expect("written");
    }
    assert!(!html.contains("<script") && !html.contains("<b>") && !html.contains("http"));
    assert_eq!(html, Findings::of(&history, 0.05).to_html(&["a remark".to_owned()]));
    let style = html.find("</style>").expect("a style");
    let each = (html.len() - style) / findings.tracks.len();
    assert!(each < 4000, "{each} bytes for each series");
    assert!(html.contains("topology lost") && html.contains("a remark"));
}
