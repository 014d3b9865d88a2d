//! Results accumulate: nothing runs twice, and nothing is lost at any kind of end of a run.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use medial_bench::process_tree;
use serde_json::Value;

use crate::command::{Folder, ended, faulty, without_timings};

/// `compare`: the exit code, and how many items were run and found.
fn compare(at: &Folder, line: &str) -> (i32, u64, u64) {
    let (code, object) = at.json(&format!("compare {line} --samples 200 --counts-only --quiet"));
    let [run, found] = ["run", "found"].map(|key| object[key].as_u64().expect("a number"));
    (code, run, found)
}

#[test]
fn only_what_is_missing_is_run() {
    let at = Folder::new();
    let files = || ["out/index.html", "out/results.jsonl"].map(|name| at.text(name));
    let two = "builtin:box:8 builtin:torus:16 --methods qmat,lambda --spheres 30,20 --out out";
    assert_eq!(compare(&at, two), (0, 8, 0));
    let first = files();
    assert_eq!(compare(&at, two), (0, 0, 8));
    assert!(files() == first, "nothing is written");

    // Another method, another level, a variant: each adds records.
    let more = "builtin:box:8 --methods qmat,pmat,qmat:k=0 --spheres 20,10 --out out";
    assert_eq!(compare(&at, more), (0, 5, 1));
    let [page, lines] = files();
    assert!(lines.starts_with(&first[1]), "nothing is rewritten");
    assert!(page.contains("qmat k=0") && page.contains("torus"), "the page has all records");
    for record in at.records("out") {
        let artifact = record["artifact"].as_str().expect("a result");
        assert!(at.has(format!("out/{artifact}")), "{artifact}");
    }

    // More repetitions than there are: run again, and the last record counts.
    let repeated = "builtin:box:8 --methods pmat --spheres 20 --repeat 3 --out out";
    assert_eq!(compare(&at, repeated), (0, 1, 0));
    assert_eq!(compare(&at, repeated), (0, 0, 1));
}

#[test]
fn failures_run_again_on_request_or_with_a_larger_limit() {
    let at = Folder::of(faulty());
    let compare = |more: &str| {
        let line = "builtin:box:8 --methods allocates,panics --spheres 20 --out out";
        let (_, run, found) = compare(&at, &format!("{line} {more}"));
        (run, found)
    };
    assert_eq!(compare("--memory 1500"), (2, 0));
    assert_eq!(compare("--memory 1500"), (0, 2));
    assert_eq!(compare("--memory 1501"), (1, 1), "the one that had too little memory");
    assert_eq!(compare("--memory 1501 --retry-failed"), (2, 0));
}

/// A named pipe at which the method `waits` waits.
fn gate(at: &Folder) -> PathBuf {
    let gate = at.at("gate");
    assert!(Command::new("mkfifo").arg(&gate).status().expect("mkfifo runs").success());
    gate
}

/// Starts a line whose method `waits` waits at the gate.
fn started(at: &Folder, line: &str) -> Child {
    let mut command = at.command(line);
    command.env("FAULTY_GATE", at.at("gate")).stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().expect("it starts")
}

/// Opening the pipe for writing blocks until the method reads from it: from then until the pipe is closed the run holds
/// the store.
fn opened(gate: &Path) -> fs::File {
    fs::OpenOptions::new().write(true).open(gate).expect("the method waits")
}

#[test]
fn two_runs_into_one_folder_lose_nothing() {
    let at = Folder::of(faulty());
    let gate = gate(&at);
    let line =
        "compare builtin:box:8 --spheres 40,30,20 --samples 100 --counts-only --quiet --out out";
    let mut first = started(&at, &format!("{line} --methods waits"));
    let pipe = opened(&gate);
    let (code, _, message) = at.run(&format!("{line} --methods qmat"));
    assert!(code == 1 && message.contains("is adding results"), "{message}");
    assert!(message.contains("waits"), "it names the other run: {message}");
    drop(pipe);
    assert_eq!(first.wait().expect("it ends").code(), Some(0));
    assert_eq!(at.records("out").len(), 3);
}

#[test]
fn a_killed_run_is_continued() {
    let at = Folder::of(faulty());
    let line = "compare builtin:box:8 builtin:torus:16 --methods qmat,waits,pmat --spheres 60,30 --samples 200 \
                --counts-only --quiet --out";
    at.done(&format!("{line} whole"));
    let gate = gate(&at);
    // Killed at the first item that waits, then at the second one.
    for passed in 0..2 {
        let mut run = started(&at, &format!("{line} killed"));
        for _ in 0..passed {
            drop(opened(&gate));
        }
        let pipe = opened(&gate);
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
        let text = at.text("killed/results.jsonl");
        let complete = text.rfind('\n').map_or(0, |end| end + 1);
        for line in text[..complete].lines() {
            serde_json::from_str::<Value>(line).expect("a whole record");
        }
    }
    at.done(&format!("{line} killed"));
    let [whole, killed] = ["whole", "killed"].map(|store| without_timings(at.records(store)));
    assert_eq!(killed, whole);
    assert_eq!(axes(&at, "killed"), axes(&at, "whole"), "the same results, and no other files");
}

fn is_worker(pid: u32) -> bool {
    let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    String::from_utf8_lossy(&line).contains("worker")
}

/// Names and contents of the medial meshes of a store.
fn axes(at: &Folder, store: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = vec![];
    for folder in fs::read_dir(at.at(store).join("axes")).expect("a folder").flatten() {
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
    let at = Folder::new();
    let line = "builtin:box:8 --methods qmat --spheres 30,20 --out out";
    compare(&at, line);
    let whole = at.text("out/results.jsonl");
    at.write("out/results.jsonl", &whole[..whole.len() - 100]);
    let temporary = "out/axes/box-8/.medial-123-0.tmp";
    at.write(temporary, "half");
    // Files of the user stay, even with --fresh.
    let foreign = ["out/.x.tmp", "out/axes/mine.txt", "out/plots/mine.png"];
    foreign.iter().for_each(|name| at.write(name, "mine"));
    let line = format!("compare {line} --samples 200 --counts-only");
    at.refused(&line, 0, "removed an incomplete last line");
    assert!(!at.has(temporary));
    assert_eq!(at.records("out").len(), 2);
    at.done(&format!("{line} --fresh --quiet"));
    assert!(foreign.iter().all(|name| at.has(name)), "{foreign:?}");
}

#[test]
fn a_small_item_after_a_large_one_shows_its_own_memory() {
    let at = Folder::new();
    let peak = |methods: &str, out: &str| {
        compare(&at, &format!("builtin:blob --methods {methods} --spheres 100 --out {out}"));
        let records = at.records(out);
        let lambda = records.iter().find(|record| record["simplify"]["method"] == "lambda");
        lambda.expect("a record")["simplify"]["peak_bytes"].as_f64().expect("bytes")
    };
    let (alone, after) = (peak("lambda", "alone"), peak("aof,hem,lambda", "after"));
    assert!(alone > 1e6, "{alone}");
    assert!((after - alone).abs() < 0.05 * alone, "{after} after others, {alone} alone");
}

#[test]
fn the_study_is_written_next_to_its_results() {
    let at = Folder::new();
    let study = "meshes = [\"builtin:box:8\"]\nspheres = [30]\nsamples = 200\ncounts_only = true\n\n\
                 [[method]]\nid = \"qmat\"\n\n\
                 [[method]]\nid = \"qmat\"\nname = \"no scale\"\nparams = { k = 0 }\nspheres = [20, 10]\n\n\
                 [[method]]\nid = \"angle\"\nlevels = [30, 60]\n";
    at.write("study.toml", study);
    assert_eq!(compare(&at, "--study study.toml --out out"), (0, 6, 0));
    let page = at.text("out/index.html");
    assert!(page.contains("no scale") && page.contains("builtin:box:8"));
    let native = |r: &Value| r["simplify"]["level"]["native"].as_f64();
    // The coarse level first: it must not wait for a fine one that may take long.
    assert_eq!(at.records("out").iter().filter_map(native).collect::<Vec<_>>(), [60.0, 30.0]);

    // The copy requests the same; the command line takes precedence.
    let again = "--study out/study.toml --out out";
    assert_eq!(compare(&at, again), (0, 0, 6));
    assert_eq!(compare(&at, &format!("{again} --methods qmat --spheres 30,20")), (0, 1, 1));
    assert_eq!(at.records("out").len(), 7);
}

#[test]
#[cfg(unix)]
fn an_interrupted_run_prints_how_to_resume() {
    let at = Folder::of(faulty());
    let gate = gate(&at);
    let line = "compare builtin:box:8 --spheres 20 --samples 100 --counts-only --out out";
    at.done(&format!("{line} --methods pmat --quiet"));
    assert!(at.has("out/index.html"));
    let child = started(&at, &format!("{line} --methods qmat,waits"));
    // The second item waits: the first one is recorded by then.
    let pipe = opened(&gate);
    let workers = process_tree::descendants(child.id());
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().expect("kill runs").success());
    let output = child.wait_with_output().expect("it ends");
    drop(pipe);
    let (code, _, stderr) = ended(output);
    assert!(code == 130 && stderr.contains("recorded 1 of 2 results; run"), "{code}: {stderr}");
    assert_eq!(at.records("out").len(), 2);
    // The page of the earlier run would contradict the records.
    assert!(!at.has("out/index.html"));
    at.done("report out");
    let page = at.text("out/index.html");
    assert!(page.contains("--methods pmat") && page.contains("--methods qmat,waits"));
    assert!(!workers.iter().any(|&pid| is_worker(pid)), "a worker still runs");
}

#[test]
fn a_used_budget_skips_further_levels() {
    let at = Folder::new();
    let line = "compare builtin:box:8 --methods pmat,qmat --spheres 30,20 --max-error 0.2 --samples 200 \
                --counts-only --quiet --out out --budget";
    let skipped = |budget: &str| {
        let (code, object) = at.json(&format!("{line} {budget}"));
        assert_eq!(code, 0, "{object}");
        [&object["run"], &object["status"]["skipped"]].map(|n| n.as_u64().expect("a count"))
    };
    // The first level of each method always runs.
    assert_eq!(skipped("1e-9"), [6, 4]);
    let all = at.records("out");
    let mut reasons = all.iter().filter(|r| r["status"] == "skipped").map(|r| &r["reason"]);
    assert!(reasons.all(|reason| reason.to_string().contains("--budget")));
    assert_eq!(skipped("1e-9"), [0, 4]);
    assert_eq!(skipped("1e-9 --retry-failed"), [4, 2]);
    assert_eq!(skipped("300"), [2, 0]);
    at.refused("compare builtin:box:8 --budget 0", 2, "--budget 0");
}

#[test]
fn progress_is_a_line_for_each_mesh_and_method() {
    let at = Folder::new();
    let line = "compare builtin:box:8 --methods pmat,qmat --spheres 30,20 --samples 100 --repeat 2 --counts-only";
    let (_, _, stderr) = at.run(line);
    let lines: Vec<&str> = stderr.lines().collect();
    assert_eq!(lines, ["[1/4] box-8: qmat", "[2/4] box-8: pmat"]);
    assert_eq!(at.run(line).2, "", "found results print nothing");
}

#[test]
fn a_study_in_a_folder_with_any_name_is_read_back() {
    let at = Folder::new();
    // A decomposed accent, a quotation mark and a backslash.
    let folder = at.at("me\u{301}di\"al\\x");
    fs::create_dir(&folder).expect("made");
    at.done("datasets make box --resolution 8 -o b.off");
    fs::rename(at.at("b.off"), folder.join("b.off")).expect("moved");
    let study = "meshes = [\"b.off\"]\nspheres = [10]\nsamples = 100\ncounts_only = true\n[[method]]\nid = \"qmat\"\n";
    fs::write(folder.join("study.toml"), study).expect("written");
    let compare = |study: &Path| {
        let mut command = at.command("compare --quiet --json --out out --study");
        let output = command.arg(study).current_dir(&folder).output().expect("it starts");
        let (code, stdout, stderr) = ended(output);
        assert_eq!(code, 0, "{stderr}");
        let object: Value = serde_json::from_str(&stdout).expect("JSON");
        [&object["run"], &object["found"]].map(|n| n.as_u64().expect("a number"))
    };
    // A name without a folder is in the working folder.
    assert_eq!(compare(Path::new("study.toml")), [1, 0]);
    assert!(fs::read_dir(folder.join("out/pictures")).is_ok_and(|drawn| drawn.count() > 0));
    let copy = folder.join("out/study.toml");
    let named = fs::read_to_string(&copy).expect("a copy");
    let named: toml::Table = named.parse().expect("TOML");
    let absolute = fs::canonicalize(&folder).expect("a folder");
    let given = Path::new(named["folder"].as_str().expect("a text"));
    assert_eq!(fs::canonicalize(given).expect("a folder"), absolute);
    assert_eq!(compare(&copy), [0, 1], "the copy requests the same");
}

#[test]
fn a_folder_of_other_files_is_refused() {
    let at = Folder::new();
    for name in ["index.html", "study.toml", ".lock"] {
        at.write(name, "mine");
        let line = "compare builtin:box:8 --methods qmat --out .";
        at.refused(line, 1, "neither empty nor a folder of results");
        assert_eq!(fs::read_dir(at.at("")).expect("a folder").count(), 1, "nothing was written");
        fs::remove_file(at.at(name)).expect("it is there");
    }
}

#[test]
fn damaged_and_missing_results_run_again() {
    let at = Folder::new();
    let line = "builtin:box:8 --methods qmat --spheres 30,20,10 --out out";
    compare(&at, line);
    let mut lines = at.records("out");
    lines[0]["evaluate"]["hausdorff"] = Value::Null;
    let artifact = lines[1]["artifact"].as_str().expect("a name");
    fs::remove_file(at.at("out").join(artifact)).expect("removed");
    let lines: Vec<String> = lines.iter().map(Value::to_string).collect();
    at.write("out/results.jsonl", lines.join("\n") + "\n");
    let (_, stdout, stderr) = at.run(&format!("compare {line} --samples 200 --counts-only"));
    assert!(stdout.contains("2 run now, 1 found"), "{stdout}");
    let damaged = "1 of 3 lines have no record; their items run again; line 1";
    assert!(stderr.contains(damaged), "{stderr}");
    assert_eq!(compare(&at, line), (0, 0, 3));
}

#[test]
fn large_results_at_native_levels_are_not_stored() {
    let at = Folder::new();
    let line = "builtin:box:40 --methods angle --spheres 2000 --levels angle=0 --out out";
    assert_eq!(compare(&at, line).1, 2);
    for record in at.records("out") {
        let is_native = record["simplify"]["level"]["native"].is_number();
        assert_eq!(record["artifact"].is_null(), is_native, "{record}");
    }
    assert_eq!(compare(&at, line).1, 0);
}

#[test]
#[cfg(unix)]
fn nothing_outside_of_a_store_is_written_copied_or_removed() {
    use std::os::unix::fs::symlink;
    let at = Folder::new();
    let line = "compare builtin:box:8 --methods qmat --spheres 20 -q --out";
    at.done(&format!("{line} out"));
    at.write("mine.ma", "mine");
    for name in [".lock", "index.html", "results.csv", "plots/x.svg", "axes/box-8"] {
        let own = at.at("out").join(name);
        let _ = fs::remove_file(&own).or_else(|_| fs::remove_dir_all(&own));
        symlink(at.at(""), &own).expect("linked");
        at.refused(&format!("{line} out --fresh"), 1, "not a regular file, in");
        fs::remove_file(&own).expect("a link");
    }
    let records = at.records("out");
    let artifact = records.iter().find_map(|record| record["artifact"].as_str()).expect("a name");
    // The folder itself may be a link.
    symlink(at.at("out"), at.at("link")).expect("linked");
    let text = at.text("out/results.jsonl").replace(artifact, "axes/../../mine.ma");
    at.write("out/results.jsonl", text);
    at.done(&format!("{line} link --fresh"));
    assert_eq!((at.text("mine.ma").as_str(), at.records("out").len()), ("mine", 2));
}

#[test]
#[cfg(unix)]
fn pipes_devices_and_odd_names_are_refused_at_once() {
    let at = Folder::new();
    fs::create_dir(at.at("out")).expect("made");
    let pipe = at.at("out/results.jsonl");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("runs").success());
    for line in [
        "compare builtin:box:8 --out out",
        "diff out out",
        "compare --study /dev/zero",
        "compare --plugins /dev/zero",
        "compare --plugins out/results.jsonl",
    ] {
        let (code, _, stderr) = at.run(line);
        assert!(code > 0 && stderr.contains("not a regular file"), "{line}: {stderr}");
    }
    let odd: std::ffi::OsString = std::os::unix::ffi::OsStringExt::from_vec(b"odd\xff.off".into());
    at.write(Path::new(&odd), "");
    let output = at.command("compare").arg(odd).output().expect("runs");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("odd") && message.contains("not UTF-8"), "{message}");
}

#[test]
fn shards_and_jobs_have_the_results_of_one_run() {
    let at = Folder::new();
    let line =
        "builtin:box:8 builtin:torus:16 --methods hem,pmat,angle --spheres 30,20 --memory 4000";
    let (_, total, _) = compare(&at, &format!("{line} --out whole"));
    let mut made = 0;
    for k in 1..=3 {
        let shard = format!("{line} --out {k} --shard {k}/3");
        let (_, ran, _) = compare(&at, &shard);
        assert!(ran > 0 && ran < total, "{k}: {ran} of {total}");
        made += ran;
        assert_eq!(compare(&at, &shard).1, 0, "a shard that is run again has its items");
    }
    assert_eq!(made, total, "every item is in one shard");
    let merge = || {
        let (code, object) = at.json("report 3 1 2 --out all");
        assert_eq!(code, 0, "{object}");
        object
    };
    let object = merge();
    assert_eq!((&object["records"], &object["warnings"]), (&total.into(), &Value::Array(vec![])));
    // Several items at the same time: the same results in the same order.
    compare(&at, &format!("{line} --out jobs --jobs 3"));
    assert!(at.records("jobs").iter().all(|record| record["conditions"]["jobs"] == 3));
    // The tables are the same but for seconds.
    let table = |out: &str| -> Vec<Vec<String>> {
        let mut rows = csv::Reader::from_path(at.at(out).join("results.csv")).expect("a table");
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
    for out in ["all", "jobs"] {
        assert_eq!(without_timings(at.records(out)), without_timings(at.records("whole")));
        assert_eq!(table(out), table("whole"));
    }
    for record in at.records("all") {
        let artifact = record["artifact"].as_str().expect("a medial mesh");
        assert!(at.has(format!("all/{artifact}")));
    }
    // The same again changes nothing: equal records are one.
    assert_eq!(merge()["records"], total);

    // One store has another result under a key: it is reported, and the newer store counts.
    let altered = at.text("2/results.jsonl").replace("\"result_hash\":\"", "\"result_hash\":\"0");
    fs::create_dir(at.at("4")).expect("made");
    at.write("4/results.jsonl", altered);
    let (_, object) = at.json("report 2 4 --out both");
    assert!(object["warnings"].to_string().contains("differ; took the newer record"), "{object}");
    at.refused("compare builtin:box:8 --shard 4/3", 2, "--shard 4/3");
}
