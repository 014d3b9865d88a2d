//! Results accumulate: nothing runs twice, and nothing is lost at any kind of end of a run.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use medial_bench::process_tree;
use serde_json::Value;

use crate::command::{
    MEDIAL, done, ended, faulty, folder, json, json_of, records, refused, run, run_program,
    text_path as text, without_timings, words,
};

/// `compare` with `--json`: the exit code and the object.
fn compare(arguments: &[&str], out: &Path) -> (i32, Value) {
    let common = ["--samples", "200", "--counts-only", "--quiet", "--out", text(out)];
    json(&[&["compare"], arguments, &common].concat())
}

fn run_and_found(object: &Value) -> (u64, u64) {
    (object["run"].as_u64().expect("a number"), object["found"].as_u64().expect("a number"))
}

#[test]
fn only_what_is_missing_is_run() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("out");
    let two =
        ["builtin:box:8", "builtin:torus:16", "--methods", "qmat,lambda", "--spheres", "30,20"];
    let (code, first) = compare(&two, &out);
    assert_eq!((code, run_and_found(&first)), (0, (8, 0)));
    let page = fs::read(out.join("index.html")).expect("a page");
    let lines = fs::read(out.join("results.jsonl")).expect("results");

    let (code, again) = compare(&two, &out);
    assert_eq!((code, run_and_found(&again)), (0, (0, 8)));
    assert_eq!(fs::read(out.join("index.html")).expect("a page"), page);
    assert_eq!(fs::read(out.join("results.jsonl")).expect("results"), lines);

    // Another method, another level, a variant: each adds records.
    let more = ["builtin:box:8", "--methods", "qmat,pmat,qmat:k=0", "--spheres", "20,10"];
    let (_, added) = compare(&more, &out);
    assert_eq!(run_and_found(&added), (5, 1));
    let all = fs::read(out.join("results.jsonl")).expect("results");
    assert!(all.starts_with(&lines), "nothing is rewritten");
    let page = fs::read_to_string(out.join("index.html")).expect("a page");
    assert!(page.contains("qmat k=0") && page.contains("torus"), "the page has all records");
    for record in records(&out) {
        let artifact = record["artifact"].as_str().expect("a result");
        assert!(out.join(artifact).exists(), "{artifact}");
    }

    // More repetitions than there are: run again, and the last record counts.
    let repeated = ["builtin:box:8", "--methods", "pmat", "--spheres", "20", "--repeat", "3"];
    assert_eq!(run_and_found(&compare(&repeated, &out).1), (1, 0));
    assert_eq!(run_and_found(&compare(&repeated, &out).1), (0, 1));
}

#[test]
fn failures_run_again_on_request_or_with_a_larger_limit() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("out");
    let compare = |more: &[&str]| {
        let arguments = [
            &["compare", "builtin:box:8", "--methods", "allocates,panics", "--spheres", "20"][..],
            &["--samples", "100", "--counts-only", "--quiet", "--out", text(&out)],
            more,
        ];
        run_and_found(&json_of(faulty(), &arguments.concat()).1)
    };
    assert_eq!(compare(&["--memory", "1500"]), (2, 0));
    assert_eq!(compare(&["--memory", "1500"]), (0, 2));
    assert_eq!(compare(&["--memory", "1501"]), (1, 1), "the one that had too little memory");
    assert_eq!(compare(&["--memory", "1501", "--retry-failed"]), (2, 0));
}

#[test]
fn two_runs_into_one_folder_lose_nothing() {
    let dir = tempfile::tempdir().expect("a folder");
    let (out, gate) = (dir.path().join("out"), gate(dir.path()));
    let arguments = |method: &'static str| {
        let words = ["compare", "builtin:box:8", "--methods", method, "--spheres", "40,30,20"];
        let more = ["--samples", "100", "--counts-only", "--quiet", "--out"];
        words.into_iter().chain(more).map(str::to_owned).chain([text(&out).to_owned()])
    };
    let program = faulty();
    let mut first = Command::new(&program);
    first.args(arguments("waits")).env("FAULTY_GATE", &gate).stdout(Stdio::null());
    let mut first = first.spawn().expect("the first run starts");
    // Opening the pipe for writing blocks until the method of the first run reads from it: from then
    // until the pipe is closed the first run holds the store.
    let pipe = fs::OpenOptions::new().write(true).open(&gate).expect("the method waits");
    let second = Command::new(&program).args(arguments("qmat")).output().expect("it starts");
    let (code, _, message) = ended(second);
    assert!(code == 1 && message.contains("is adding results"), "{message}");
    assert!(message.contains("waits"), "it names the other run: {message}");
    drop(pipe);
    assert_eq!(first.wait().expect("it ends").code(), Some(0));
    assert_eq!(records(&out).len(), 3);
}

#[test]
fn a_killed_run_is_continued() {
    let dir = tempfile::tempdir().expect("a folder");
    let (whole, killed) = (dir.path().join("whole"), dir.path().join("killed"));
    let gate = gate(dir.path());
    let start = |out: &Path| {
        let mut run = Command::new(faulty());
        run.args(["compare", "builtin:box:8", "builtin:torus:16", "--methods", "qmat,waits,pmat"])
            .args(["--spheres", "60,30", "--samples", "200", "--counts-only", "--quiet", "--out"])
            .arg(out)
            .stdout(Stdio::null());
        run
    };
    assert!(start(&whole).status().expect("it starts").success());
    // Killed at the first item that waits, then at the second one.
    for passed in 0..2 {
        let mut run = start(&killed).env("FAULTY_GATE", &gate).spawn().expect("it starts");
        for _ in 0..passed {
            drop(fs::OpenOptions::new().write(true).open(&gate).expect("an item waits"));
        }
        let pipe = fs::OpenOptions::new().write(true).open(&gate).expect("an item waits");
        let workers = process_tree::descendants(run.id());
        run.kill().expect("it can be killed");
        run.wait().expect("it ends");
        drop(pipe);
        // The workers must notice by themselves, and end.
        let deadline = Instant::now() + Duration::from_secs(60);
        while workers.iter().any(|&pid| is_worker(pid)) {
            assert!(Instant::now() < deadline, "a worker still runs: {workers:?}");
            thread::sleep(Duration::from_millis(20));
        }
        // All lines are whole, but for a last line that may be torn.
        let text = fs::read_to_string(killed.join("results.jsonl")).expect("records");
        let complete = text.rfind('\n').map_or(0, |end| end + 1);
        for line in text[..complete].lines() {
            serde_json::from_str::<Value>(line).expect("a whole record");
        }
    }
    assert!(start(&killed).status().expect("it starts").success());
    assert_eq!(without_timings(records(&killed)), without_timings(records(&whole)));
    assert_eq!(axes(&killed), axes(&whole), "the same results, and no other files");
}

/// A named pipe at which the method `waits` waits.
fn gate(dir: &Path) -> PathBuf {
    let gate = dir.join("gate");
    assert!(Command::new("mkfifo").arg(&gate).status().expect("mkfifo runs").success());
    gate
}

fn is_worker(pid: u32) -> bool {
    let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    String::from_utf8_lossy(&line).contains("worker")
}

/// Names and contents of the medial meshes of a store.
fn axes(out: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = vec![];
    for folder in fs::read_dir(out.join("axes")).expect("a folder").flatten() {
        for file in fs::read_dir(folder.path()).expect("a folder").flatten() {
            let name = Path::new(&folder.file_name()).join(file.file_name());
            files.push((name, fs::read(file.path()).expect("read")));
        }
    }
    files.sort();
    files
}

#[test]
fn torn_lines_and_temporary_files_are_removed() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("out");
    let words = ["builtin:box:8", "--methods", "qmat", "--spheres", "30,20"];
    compare(&words, &out);
    let path = out.join("results.jsonl");
    let whole = fs::read_to_string(&path).expect("results");
    fs::write(&path, &whole[..whole.len() - 100]).expect("written");
    let temporary = out.join("axes/box-8/.medial-123-0.tmp");
    fs::write(&temporary, "half").expect("written");
    // Files of the user stay, even with --fresh.
    let foreign = [out.join(".x.tmp"), out.join("axes/mine.txt"), out.join("plots/mine.png")];
    foreign.iter().for_each(|path| fs::write(path, "mine").expect("written"));
    let common = ["--samples", "200", "--counts-only", "--out", text(&out)];
    refused(&[&["compare"], &words[..], &common].concat(), 0, "removed an incomplete last line");
    assert!(!temporary.exists());
    assert_eq!(records(&out).len(), 2);
    done(&[&["compare"], &words[..], &common, &["--fresh", "--quiet"]].concat());
    assert!(foreign.iter().all(|path| path.exists()), "{foreign:?}");
}

#[test]
fn a_small_item_after_a_large_one_shows_its_own_memory() {
    let dir = tempfile::tempdir().expect("a folder");
    let peak = |methods: &str, out: &str| {
        let out = dir.path().join(out);
        compare(&["builtin:blob", "--methods", methods, "--spheres", "100"], &out);
        let records = records(&out);
        let of = |id: &str| records.iter().find(|r| r["simplify"]["method"] == id).cloned();
        of("lambda").expect("a record")["simplify"]["peak_bytes"].as_f64().expect("bytes")
    };
    let (alone, after) = (peak("lambda", "alone"), peak("aof,hem,lambda", "after"));
    assert!(alone > 1e6, "{alone}");
    assert!((after - alone).abs() < 0.05 * alone, "{after} after others, {alone} alone");
}

#[test]
fn the_study_is_written_next_to_its_results() {
    let dir = tempfile::tempdir().expect("a folder");
    let (file, out) = (dir.path().join("study.toml"), dir.path().join("out"));
    let study = "meshes = [\"builtin:box:8\"]\nspheres = [30]\nsamples = 200\ncounts_only = true\n\n\
                 [[method]]\nid = \"qmat\"\n\n\
                 [[method]]\nid = \"qmat\"\nname = \"no scale\"\nparams = { k = 0 }\nspheres = [20, 10]\n\n\
                 [[method]]\nid = \"angle\"\nlevels = [30, 60]\n";
    fs::write(&file, study).expect("written");
    let (status, object) = compare(&["--study", text(&file)], &out);
    assert_eq!((status, run_and_found(&object)), (0, (6, 0)), "{object}");
    let page = fs::read_to_string(out.join("index.html")).expect("a page");
    assert!(page.contains("no scale") && page.contains("builtin:box:8"));
    let native = |r: &Value| r["simplify"]["level"]["native"].as_f64();
    // The coarse level first: it must not wait for a fine one that may take long.
    assert_eq!(records(&out).iter().filter_map(native).collect::<Vec<_>>(), [60.0, 30.0]);

    // The copy requests the same; the command line takes precedence.
    let copy = out.join("study.toml");
    let again = ["--study", text(&copy)];
    assert_eq!(run_and_found(&compare(&again, &out).1), (0, 6));
    let fewer = [&again[..], &["--methods", "qmat", "--spheres", "30,20"]].concat();
    assert_eq!(run_and_found(&compare(&fewer, &out).1), (1, 1));
    assert_eq!(records(&out).len(), 7);
}

#[test]
#[cfg(unix)]
fn an_interrupted_run_prints_how_to_resume() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("out");
    let words = ["compare", "builtin:box:8", "--methods", "qmat,waits", "--spheres", "20"];
    let gate = gate(dir.path());
    let more = ["--samples", "100", "--counts-only", "--out", text(&out)];
    let earlier = ["compare", "builtin:box:8", "--methods", "pmat", "--spheres", "20", "--quiet"];
    assert_eq!(run_program(faulty(), &[&earlier[..], &more].concat()).0, 0);
    assert!(out.join("index.html").exists());
    let mut run = Command::new(faulty());
    run.args(words).args(more).env("FAULTY_GATE", &gate);
    let child = run.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
    // Opening blocks until the second item waits: the first one is recorded by then.
    let pipe = fs::OpenOptions::new().write(true).open(&gate).expect("the second item waits");
    let workers = process_tree::descendants(child.id());
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().expect("kill runs").success());
    let output = child.wait_with_output().expect("it ends");
    drop(pipe);
    let (code, _, stderr) = ended(output);
    assert!(code == 130 && stderr.contains("recorded 1 of 2 results; run"), "{code}: {stderr}");
    assert_eq!(records(&out).len(), 2);
    // The page of the earlier run would contradict the records.
    assert!(!out.join("index.html").exists());
    assert_eq!(run_program(faulty(), &["report", text(&out)]).0, 0);
    let page = fs::read_to_string(out.join("index.html")).expect("a page");
    assert!(page.contains("--methods pmat") && page.contains("--methods qmat,waits"));
    assert!(!workers.iter().any(|&pid| is_worker(pid)), "a worker still runs");
}

#[test]
fn a_used_budget_skips_further_levels() {
    let at = folder();
    let out = PathBuf::from(at("out"));
    let words =
        ["builtin:box:8", "--methods", "pmat,qmat", "--spheres", "30,20", "--max-error", "0.2"];
    let skipped = |budget: &str, more: &[&str]| {
        let (code, object) = compare(&[&words[..], &["--budget", budget], more].concat(), &out);
        assert_eq!(code, 0, "{object}");
        (run_and_found(&object).0, object["status"]["skipped"].as_u64().expect("a count"))
    };
    // The first level of each method always runs.
    assert_eq!(skipped("1e-9", &[]), (6, 4));
    let all = records(&out);
    let reasons = all.iter().filter(|record| record["status"] == "skipped").map(|r| &r["reason"]);
    assert!(reasons.into_iter().all(|reason| reason.to_string().contains("--budget")));
    assert_eq!(skipped("1e-9", &[]), (0, 4));
    assert_eq!(skipped("1e-9", &["--retry-failed"]), (4, 2));
    assert_eq!(skipped("300", &[]), (2, 0));
    refused(&["compare", "builtin:box:8", "--budget", "0"], 2, "--budget 0");
}

#[test]
fn progress_is_a_line_for_each_mesh_and_method() {
    let at = folder();
    let words = words("compare builtin:box:8 --methods pmat,qmat --spheres 30,20 --samples 100");
    let more = ["--repeat", "2", "--counts-only", "--out", &at("out")];
    let (_, _, stderr) = run(&[&words[..], &more].concat());
    let lines: Vec<&str> = stderr.lines().collect();
    assert_eq!(lines, ["[1/4] box-8: qmat", "[2/4] box-8: pmat"]);
    assert_eq!(run(&[&words[..], &more].concat()).2, "", "found results print nothing");
}

#[test]
fn a_study_in_a_folder_with_any_name_is_read_back() {
    let dir = tempfile::tempdir().expect("a folder");
    // A decomposed accent, a quotation mark and a backslash.
    let folder = dir.path().join("me\u{301}di\"al\\x");
    fs::create_dir(&folder).expect("made");
    done(&["datasets", "make", "box", "--resolution", "8", "-o", text(&folder.join("b.off"))]);
    let study = "meshes = [\"b.off\"]\nspheres = [10]\nsamples = 100\ncounts_only = true\n[[method]]\nid = \"qmat\"\n";
    fs::write(folder.join("study.toml"), study).expect("written");
    let compare = |study: &Path, folder: &Path| {
        let mut command = Command::new(MEDIAL);
        command.args(["compare", "--quiet", "--json", "--out", "out", "--study"]).arg(study);
        let (code, stdout, stderr) = ended(command.current_dir(folder).output().expect("starts"));
        assert_eq!(code, 0, "{stderr}");
        run_and_found(&serde_json::from_str(&stdout).expect("JSON"))
    };
    // A name without a folder is in the working folder.
    assert_eq!(compare(Path::new("study.toml"), &folder), (1, 0));
    assert!(fs::read_dir(folder.join("out/pictures")).is_ok_and(|drawn| drawn.count() > 0));
    let copy = folder.join("out/study.toml");
    let named = fs::read_to_string(&copy).expect("a copy");
    let named: toml::Table = named.parse().expect("TOML");
    let absolute = fs::canonicalize(&folder).expect("a folder");
    let given = Path::new(named["folder"].as_str().expect("a text"));
    assert_eq!(fs::canonicalize(given).expect("a folder"), absolute);
    assert_eq!(compare(&copy, &folder), (0, 1), "the copy requests the same");
}

#[test]
fn a_folder_of_other_files_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let words = ["compare", "builtin:box:8", "--methods", "qmat", "--out", text(dir.path())];
    for name in ["index.html", "study.toml", ".lock"] {
        fs::write(dir.path().join(name), "mine").expect("written");
        refused(&words, 1, "neither empty nor a folder of results");
        assert_eq!(fs::read_dir(dir.path()).expect("a folder").count(), 1, "nothing was written");
        fs::remove_file(dir.path().join(name)).expect("it is there");
    }
}

#[test]
fn damaged_and_missing_results_run_again() {
    let dir = tempfile::tempdir().expect("a folder");
    let (out, path) = (dir.path().join("out"), dir.path().join("out/results.jsonl"));
    let words = ["builtin:box:8", "--methods", "qmat", "--spheres", "30,20,10"];
    compare(&words, &out);
    let mut lines = records(&out);
    lines[0]["evaluate"]["hausdorff"] = Value::Null;
    fs::remove_file(out.join(lines[1]["artifact"].as_str().expect("a name"))).expect("removed");
    let lines: Vec<String> = lines.iter().map(Value::to_string).collect();
    fs::write(&path, lines.join("\n") + "\n").expect("written");
    let more = ["--samples", "200", "--counts-only", "--out", text(&out)];
    let (_, stdout, stderr) = run(&[&["compare"], &words[..], &more].concat());
    assert!(stdout.contains("2 run now, 1 found"), "{stdout}");
    assert!(
        stderr.contains("1 of 3 lines have no record; their items run again; line 1"),
        "{stderr}"
    );
    assert_eq!(run_and_found(&compare(&words, &out).1), (0, 3));
}

#[test]
fn keep_selects_the_results_on_disk() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("out");
    let words =
        ["builtin:box:40", "--methods", "angle", "--spheres", "2000", "--levels", "angle=0"];
    // Whether the results at the count and at the level, both of more than 1,000 spheres, are on disk.
    let on_disk = |keep: &str, run: u64| {
        assert_eq!(
            run_and_found(&compare(&[&words[..], &["--keep", keep]].concat(), &out).1).0,
            run
        );
        let last: std::collections::HashMap<String, bool> = (records(&out).iter())
            .map(|r| (r["simplify"]["level"].to_string(), !r["artifact"].is_null()))
            .collect();
        [r#"{"spheres":2000}"#, r#"{"native":0.0}"#].map(|level| last[level])
    };
    assert_eq!(on_disk("none", 2), [false, false]);
    // Results that are now required on disk are computed again.
    assert_eq!(on_disk("small", 1), [true, false]);
    assert_eq!(on_disk("small", 0), [true, false]);
    assert_eq!(on_disk("all", 1), [true, true]);
}

#[test]
#[cfg(unix)]
fn nothing_outside_of_a_store_is_written_copied_or_removed() {
    let at = folder();
    let (out, path, mine) = (at("out"), at("out/results.jsonl"), at("mine.ma"));
    let words = ["compare", "builtin:box:8", "--methods", "qmat", "--spheres", "20", "-q", "--out"];
    done(&[&words[..], &[&out]].concat());
    fs::write(&mine, "mine").expect("written");
    for name in [".lock", "index.html", "results.csv", "plots/x.svg", "axes/box-8"] {
        let own = format!("{out}/{name}");
        let _ = fs::remove_file(&own).or_else(|_| fs::remove_dir_all(&own));
        std::os::unix::fs::symlink(at("."), &own).expect("linked");
        refused(&[&words[..], &[&out, "--fresh"]].concat(), 1, "not a regular file, in");
        fs::remove_file(&own).expect("a link");
    }
    let records_of_out = records(&out);
    let artifact = records_of_out.iter().find_map(|record| record["artifact"].as_str());
    let artifact = artifact.expect("a name").to_owned();
    let text = fs::read_to_string(&path).expect("results");
    // The folder itself may be a link.
    std::os::unix::fs::symlink(&out, at("link")).expect("linked");
    fs::write(&path, text.replace(&artifact, "axes/../../mine.ma")).expect("written");
    done(&[&words[..], &[&at("link"), "--fresh"]].concat());
    assert_eq!((fs::read_to_string(mine).expect("kept"), records(&out).len()), ("mine".into(), 2));
}

#[test]
#[cfg(unix)]
fn pipes_devices_and_odd_names_are_refused_at_once() {
    let at = folder();
    fs::create_dir(at("out")).expect("made");
    assert!(Command::new("mkfifo").arg(at("out/results.jsonl")).status().expect("runs").success());
    for words in [
        &["compare", "builtin:box:8", "--out", &at("out")][..],
        &["diff", &at("out"), &at("out")],
        &["compare", "--study", "/dev/zero"],
        &["compare", "--plugins", "/dev/zero"],
        &["compare", "--plugins", &at("out/results.jsonl")],
    ] {
        let (code, _, stderr) = run(words);
        assert!(code > 0 && stderr.contains("not a regular file"), "{words:?}: {stderr}");
    }
    let odd: std::ffi::OsString = std::os::unix::ffi::OsStringExt::from_vec(b"odd\xff.off".into());
    fs::write(Path::new(&at("")).join(&odd), "").expect("written");
    let output = Command::new(MEDIAL).arg("compare").arg(odd).current_dir(at("")).output();
    let message = String::from_utf8_lossy(&output.expect("runs").stderr).into_owned();
    assert!(message.contains("odd") && message.contains("not UTF-8"), "{message}");
}

#[test]
fn shards_and_jobs_have_the_results_of_one_run() {
    let path = folder();
    let at = |name: &str| PathBuf::from(path(name));
    let words =
        "builtin:box:8 builtin:torus:16 --methods hem,pmat,angle --spheres 30,20 --memory 4000";
    let words: Vec<&str> = words.split_whitespace().collect();
    let (_, whole) = compare(&words, &at("whole"));
    let total = whole["run"].as_u64().expect("a count");
    let mut made = 0;
    for shard in ["1/3", "2/3", "3/3"] {
        let out = at(&shard[..1]);
        let (_, object) = compare(&[&words[..], &["--shard", shard]].concat(), &out);
        let ran = object["run"].as_u64().expect("a count");
        assert!(ran > 0 && ran < total, "{shard}: {ran} of {total}");
        made += ran;
        let (_, again) = compare(&[&words[..], &["--shard", shard]].concat(), &out);
        assert_eq!(again["run"], 0, "a shard that is run again has its items");
    }
    assert_eq!(made, total, "every item is in one shard");
    let merge = |out: &str| {
        let (code, object) =
            json(&["report", &path("3"), &path("1"), &path("2"), "--out", &path(out)]);
        assert_eq!(code, 0, "{object}");
        object
    };
    let object = merge("all");
    assert_eq!((&object["records"], &object["warnings"]), (&total.into(), &Value::Array(vec![])));
    assert_eq!(without_timings(records(at("all"))), without_timings(records(at("whole"))));
    // Several items at the same time: the same results in the same order.
    compare(&[&words[..], &["--jobs", "3"]].concat(), &at("jobs"));
    assert!(records(at("jobs")).iter().all(|record| record["conditions"]["jobs"] == 3));
    assert_eq!(without_timings(records(at("jobs"))), without_timings(records(at("whole"))));
    // The tables are the same but for seconds.
    let table = |out: &str| -> Vec<Vec<String>> {
        let mut rows = csv::Reader::from_path(at(out).join("results.csv")).expect("a table");
        let heads = rows.headers().expect("a head").clone();
        let columns: Vec<usize> = (0..heads.len())
            .filter(|&k| {
                let timed = ["seconds", "substrate_", "bytes", "command", "repetition", "jobs"];
                !timed.iter().any(|word| heads[k].contains(word))
            })
            .collect();
        rows.records()
            .map(|row| row.expect("a row"))
            .map(|row| columns.iter().map(|&k| row[k].to_owned()).collect())
            .collect()
    };
    assert_eq!([table("all"), table("jobs")], [table("whole"), table("whole")]);
    for record in records(at("all")) {
        let artifact = record["artifact"].as_str().expect("a medial mesh");
        assert!(at("all").join(artifact).exists());
    }
    // The same again changes nothing: equal records are one.
    assert_eq!(merge("all")["records"], total);

    // One store has another result under a key: it is reported, and the newer store counts.
    let altered = fs::read_to_string(at("2/results.jsonl"))
        .expect("results")
        .replace("\"result_hash\":\"", "\"result_hash\":\"0");
    fs::create_dir(at("4")).expect("made");
    fs::write(at("4/results.jsonl"), altered).expect("written");
    let (_, object) = json(&["report", &path("2"), &path("4"), "--out", &path("both")]);
    assert!(object["warnings"].to_string().contains("differ; took the newer record"), "{object}");
    refused(&["compare", "builtin:box:8", "--shard", "4/3"], 2, "--shard 4/3");
}
