//! A study as a planned folder: it travels, its items are run once each by any number of processes, and gathered without
//! losing or doubling a record.

mod common;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use common::{code, example, records, run, stderr, without_timings};
use serde_json::Value;

const MEDIAL: &str = env!("CARGO_BIN_EXE_medial");

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// A verb with `--json`: the exit code and the object.
fn json(arguments: &[&str]) -> (i32, Value) {
    let output = run(MEDIAL, &[arguments, &["--json", "--quiet"]].concat());
    let object =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", stderr(&output)));
    (code(&output), object)
}

/// A study of one file, under two names, and one built-in shape, with two methods at two counts.
fn study(dir: &Path) -> PathBuf {
    for name in ["ball.off", "same.OFF"] {
        let path = dir.join(name);
        let words = ["datasets", "make", "sphere", "--resolution", "8", "-o", text(&path)];
        let written = run(MEDIAL, &words);
        assert_eq!(code(&written), 0, "{}", stderr(&written));
    }
    let file = dir.join("study.toml");
    let study = "meshes = [\"ball.off\", \"same.OFF\", \"builtin:box:8\"]\nspheres = [20, 9]\nsamples = 100\n\
                 counts_only = true\nthreads = 1\ntimeout = 60\nmemory = 2000\n\
                 [[method]]\nid = \"qmat\"\n[[method]]\nid = \"angle\"\n";
    fs::write(&file, study).expect("written");
    file
}

/// Plans that study; the folder of everything, and the planned one.
fn planned(more: &[&str]) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().expect("a folder");
    let plan = dir.path().join("plan");
    let words = ["plan", text(&study(dir.path())), "-o", text(&plan)].map(str::to_owned);
    let words: Vec<&str> = words.iter().map(String::as_str).chain(more.iter().copied()).collect();
    let (code, object) = json(&words);
    assert_eq!((code, object["levels"].as_u64()), (0, Some(12)), "{object}");
    (dir, plan)
}

fn run_item(plan: &Path, numbers: &str) -> (u64, u64) {
    let (code, object) = json(&["run-item", text(plan), "--number", numbers]);
    assert_eq!(code, 0, "{object}");
    (object["run"].as_u64().expect("a number"), object["found"].as_u64().expect("a number"))
}

/// `collect` without the report: exit code, items that are complete, records added, items missing.
fn collect(plan: &Path, more: &[&str]) -> (i32, u64, u64, u64) {
    let (code, object) = json(&[&["collect", text(plan), "--no-report"], more].concat());
    let number = |key: &str| object[key].as_u64().expect("a number");
    (code, number("complete"), number("added"), number("missing"))
}

/// All files below a folder, but for its lock, with their bytes.
fn files(dir: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = vec![];
    let mut folders = vec![dir.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if entry.file_name() != ".lock" {
                found.push((path.clone(), fs::read(&path).expect("a file")));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn a_plan_travels_and_gives_what_compare_gives() {
    let (dir, plan) = planned(&[]);
    assert_eq!(files(&plan.join("meshes")).len(), 1, "equal meshes lie there once");
    let items = fs::read_to_string(plan.join("items.jsonl")).expect("items");
    assert_eq!(items.lines().count(), 6);
    assert!(!items.contains(text(dir.path())), "no path of this machine: {items}");

    // The same study again changes nothing; another one is refused.
    let before = files(&plan);
    let file = dir.path().join("study.toml");
    let again = run(MEDIAL, &["plan", text(&file), "-o", text(&plan)]);
    assert_eq!((code(&again), files(&plan)), (0, before), "{}", stderr(&again));
    let other = run(MEDIAL, &["plan", text(&file), "-o", text(&plan), "--split"]);
    assert!(code(&other) == 1 && stderr(&other).contains("another study"), "{}", stderr(&other));

    // Run where it was carried to, while nothing is left where it was made.
    let moved = tempfile::tempdir().expect("a folder");
    let travelled = moved.path().join("elsewhere");
    fs::rename(&plan, &travelled).expect("moved");
    let whole = dir.path().join("whole");
    let compare = ["compare", "--study", text(&file), "--out", text(&whole), "--quiet"];
    assert_eq!(code(&run(MEDIAL, &compare)), 0);
    ["ball.off", "same.OFF"].iter().for_each(|name| {
        fs::remove_file(dir.path().join(name)).expect("removed");
    });
    assert_eq!(run_item(&travelled, "0,2-4"), (4, 0));
    assert_eq!(run_item(&travelled, "0-5"), (2, 4), "what was run is found");
    assert_eq!(collect(&travelled, &[]), (0, 6, 12, 0));
    assert_eq!(without_timings(records(&travelled)), without_timings(records(&whole)));
    for record in records(&travelled) {
        let artifact = record["artifact"].as_str().expect("a result");
        assert_eq!(
            fs::read(travelled.join(artifact)).expect("a result"),
            fs::read(whole.join(artifact)).expect("a result")
        );
    }
}

#[test]
fn gathering_again_gives_the_same_bytes_and_names_what_is_missing() {
    let (dir, plan) = planned(&["--split"]);
    let store = dir.path().join("store");
    run_item(&plan, "0-4,11");
    let out = ["--out", text(&store)];
    assert_eq!(collect(&plan, &out), (3, 6, 6, 6));
    let part = fs::read(store.join("results.jsonl")).expect("results");
    assert_eq!(collect(&plan, &out), (3, 6, 0, 6));
    assert_eq!(fs::read(store.join("results.jsonl")).expect("results"), part);
    let told = run(MEDIAL, &["collect", text(&plan), "--out", text(&store), "--no-report"]);
    let told = String::from_utf8_lossy(&told.stdout).into_owned();
    assert!(told.contains("missing: 6 items, of number 5, 6, 7, 8, 9, 10\n"), "{told}");

    run_item(&plan, "5-10");
    let (code, object) = json(&["collect", text(&plan), "--out", text(&store)]);
    assert_eq!((code, object["added"].as_u64()), (0, Some(6)), "{object}");
    assert!(fs::read(store.join("results.jsonl")).expect("results").starts_with(&part));
    let page = fs::read_to_string(store.join("index.html")).expect("a page");
    assert!(page.contains("box-8") && page.contains("ball"));
    let before = files(&store);
    assert_eq!(collect(&plan, &out), (0, 12, 0, 0));
    assert_eq!(files(&store), before, "nothing is written anew");
    let keys: BTreeSet<String> = records(&store).iter().map(|r| r["key"].to_string()).collect();
    assert_eq!((keys.len(), records(&store).len()), (12, 12));
    for record in records(&store) {
        assert!(store.join(record["artifact"].as_str().expect("a result")).is_file());
    }

    // What a store has need not be planned again.
    let file = dir.path().join("study.toml");
    let rest = dir.path().join("rest");
    let words = ["plan", text(&file), "-o", text(&rest), "--without"];
    let (_, rest) = json(&[&words[..], &[text(&store)]].concat());
    assert_eq!(rest["items"], 0, "{rest}");
}

#[test]
fn two_processes_with_one_item_do_no_harm() {
    let (dir, plan) = planned(&[]);
    let start = || {
        let mut command = Command::new(MEDIAL);
        command.args(["run-item", text(&plan), "--number", "0-5", "--quiet"]);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts")
    };
    let mut running = [start(), start(), start()];
    // Gathered in the midst of it, too.
    let mut early = 0;
    while running[0].try_wait().expect("it can be asked").is_none() {
        let (code, _, added, _) = collect(&plan, &[]);
        early += added;
        assert!(code == 0 || code == 3);
    }
    for process in &mut running {
        assert!(process.wait().expect("it ends").success());
    }
    let (code, complete, added, missing) = collect(&plan, &[]);
    assert_eq!((code, complete, early + added, missing), (0, 6, 12, 0));
    let found = files(&plan.join("done"));
    assert_eq!(found.len(), 6, "a file for each item, and none beside them");
    assert_eq!(records(&plan).len(), 12);
    let strays = files(dir.path())
        .into_iter()
        .filter(|(path, _)| path.extension().is_some_and(|e| e == "tmp"));
    assert_eq!(strays.count(), 0);
}

#[test]
fn what_is_wrong_with_a_folder_is_named() {
    let (dir, plan) = planned(&[]);
    let fails = |words: &[&str], parts: &[&str]| {
        let output = run(MEDIAL, words);
        let message = stderr(&output);
        assert_eq!(code(&output), if parts[0] == "usage" { 2 } else { 1 }, "{words:?}: {message}");
        for part in &parts[1..] {
            assert!(message.contains(part), "{words:?}: no {part:?} in {message}");
        }
    };
    let item = |number: &'static str| ["run-item", text(&plan), "--number", number];
    fails(&item("6"), &["usage", "item 6", "0 to 5"]);
    fails(&["run-item", text(&plan)], &["usage", "--number"]);
    fails(&["run-item", text(dir.path()), "--number", "0"], &["input", "plan.json", "medial plan"]);
    fails(&["collect", text(dir.path())], &["input", "plan.json"]);

    // A mesh that is missing, or another.
    let mesh = files(&plan.join("meshes")).remove(0);
    fs::remove_file(&mesh.0).expect("removed");
    let name = mesh.0.file_name().expect("a name").to_str().expect("UTF-8");
    fails(&item("0-1"), &["input", name, "copy the planned folder again"]);
    fs::write(&mesh.0, b"OFF\n0 0 0\n").expect("written");
    fails(&item("0-1"), &["input", name, "not the mesh that was planned"]);
    fs::write(&mesh.0, &mesh.1).expect("written");
    assert!(!plan.join("done").exists(), "nothing of it became a record");

    // A damaged line; one that still is an item.
    let items = plan.join("items.jsonl");
    let whole = fs::read_to_string(&items).expect("items");
    let lines: Vec<&str> = whole.lines().collect();
    let third = lines[2].replacen("\"seed\":", "\"sead\":", 1);
    fs::write(&items, whole.replacen(lines[2], &third, 1)).expect("written");
    fails(&item("2"), &["input", "items.jsonl: line 3", "sead"]);
    fails(&["collect", text(&plan)], &["input", "items.jsonl: line 3"]);
    fs::write(&items, whole.replacen("\"spheres\":20", "\"spheres\":21", 1)).expect("written");
    fails(&item("2"), &["input", "items.jsonl: line 1", "not those that were planned"]);
    fs::write(&items, &whole).expect("written");

    // Records that are damaged are put aside when they are gathered, and replaced when they are run again.
    run_item(&plan, "0-5");
    let done = files(&plan.join("done"));
    fs::write(&done[1].0, &done[1].1[..100]).expect("written");
    fs::write(&done[2].0, &done[3].1).expect("written");
    let (code, object) = json(&["collect", text(&plan), "--no-report"]);
    assert_eq!((code, object["missing"].as_u64()), (3, Some(2)), "{object}");
    let warnings = object["warnings"].to_string();
    assert!(warnings.contains("000001") && warnings.contains("another item"), "{warnings}");
    assert_eq!(run_item(&plan, "0-5"), (2, 4));
    assert_eq!(collect(&plan, &[]), (0, 6, 4, 0));

    // Another build.
    let foreign = run(example("faulty"), &["run-item", text(&plan), "--number", "0"]);
    let message = stderr(&foreign);
    assert!(
        common::code(&foreign) == 1 && message.contains("planned by another build"),
        "{message}"
    );

    // Plug-ins do not travel.
    let file = dir.path().join("study.toml");
    let plugged =
        format!("plugins = [\"x.toml\"]\n{}", fs::read_to_string(&file).expect("a study"));
    fs::write(&file, plugged).expect("written");
    fails(
        &["plan", text(&file), "-o", text(&dir.path().join("p"))],
        &["usage", "x.toml", "no plug-ins"],
    );
}

#[test]
fn jobs_are_written_for_what_is_missing() {
    let (dir, plan) = planned(&["--split"]);
    run_item(&plan, "3");
    let submit = ["submit", text(&plan), "--engine", "slurm", "--dry-run", "--throttle", "4"];
    let (code, object) = json(&submit);
    assert_eq!((code, object["items"].as_u64()), (0, Some(11)), "{object}");
    let files = object["files"].as_object().expect("files");
    let script = files["slurm/000/class-0.sh"].as_str().expect("a script");
    for part in ["set -eu", "--requeue", "%4", "--time=", "--mem=", "run-item . --quiet --number"] {
        assert!(script.contains(part), "{part}: {script}");
    }
    let tasks = files["slurm/000/class-0.txt"].as_str().expect("tasks");
    assert!(tasks.starts_with("0-2,4"), "{tasks}");
    assert!(!plan.join("slurm").exists(), "nothing is written");

    // By what the same methods took: minutes rather than the limits of the study.
    run_item(&plan, "0-11");
    assert_eq!(collect(&plan, &["--out", text(&dir.path().join("store"))]).0, 0);
    fs::remove_dir_all(plan.join("done")).expect("removed");
    let minutes = |more: &[&str]| -> u64 {
        let (_, object) = json(&[&submit, more].concat());
        let script = object["files"]["slurm/000/class-0.sh"].as_str().expect("a script").to_owned();
        let time = script.lines().find_map(|line| line.strip_prefix("#SBATCH --time="));
        time.expect("a limit").parse().expect("minutes")
    };
    let store = dir.path().join("store");
    let like = ["--like", text(&store)];
    assert!(minutes(&like) < minutes(&[]), "{} {}", minutes(&like), minutes(&[]));
}
