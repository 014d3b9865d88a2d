//! Faulty methods: each fault is classified with its reason, the rest completes, and no process remains.

use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::command::{Folder, ended, faulty, number, processes_with};

/// Runs `compare` of the faulty methods on a box, which must end in a code, and returns its records.
#[track_caller]
fn compare(line: &str, expected: i32) -> Vec<Value> {
    compare_in(&Folder::of(faulty()), line, expected)
}

#[track_caller]
fn compare_in(at: &Folder, line: &str, expected: i32) -> Vec<Value> {
    at.refused(
        &format!("compare builtin:box:8 --counts-only --quiet --out out {line}"),
        expected,
        "",
    );
    at.records("out")
}

/// Status and reason by method and number of spheres.
fn ends(records: &[Value]) -> BTreeMap<(String, u64), (String, String)> {
    let end = |record: &Value| {
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let spheres = record["simplify"]["level"]["spheres"].as_u64().expect("a count");
        let method = text(&record["simplify"]["method"]);
        ((method, spheres), (text(&record["status"]), text(&record["reason"])))
    };
    records.iter().map(end).collect()
}

#[test]
fn faults_of_methods_are_contained_and_named() {
    let at = Folder::of(faulty());
    let common = "--spheres 30,20,10 --samples 100 --memory 1500 --methods";
    let methods =
        "panics,allocates,grows,overflows,aborts,exits,invalid,empty,talks,orphans,complains,qmat";
    // Methods that end by themselves, or by their memory, may take longer on a busy machine.
    compare_in(&at, &format!("--timeout 60 {common} {methods}"), 3);
    let ends = ends(&compare_in(&at, &format!("--timeout 10 {common} loops"), 3));
    let end = |method: &str, spheres| &ends[&(method.to_owned(), spheres)];
    // Levels before the fault have results, and levels after it have the reason for which they did not run.
    let broken_at_20 = [
        ("panics", "panicked", "this method panics at 20 spheres"),
        ("loops", "timed_out", "during simplification; rerun with a larger --timeout"),
        ("allocates", "out_of_memory", "during simplification; rerun with a larger --memory"),
    ];
    for (method, status, part) in broken_at_20 {
        assert_eq!(end(method, 30).0, "ok", "{method}: {:?}", end(method, 30));
        assert_eq!(end(method, 20).0, status, "{method}: {:?}", end(method, 20));
        assert!(end(method, 20).1.contains(part), "{method}: {:?}", end(method, 20));
        assert_eq!(end(method, 10).0, status);
        assert!(end(method, 10).1.starts_with("not run"), "{:?}", end(method, 10));
    }
    let broken_at_once = [
        ("grows", "out_of_memory", "1500 MB"),
        ("overflows", "panicked", "stack overflow during preparation"),
        ("aborts", "panicked", "SIGABRT"),
        ("exits", "panicked", "exit code 0"),
        ("invalid", "invalid_output", "radius NaN"),
        ("empty", "failed", "no sphere"),
        ("complains", "failed", "unable to allocate"),
    ];
    for (method, status, part) in broken_at_once {
        let (found, reason) = end(method, 30);
        assert!(found == status && reason.contains(part), "{method}: {found}, {reason}");
    }
    for method in ["talks", "orphans", "qmat"] {
        assert!([30, 20, 10].iter().all(|&count| end(method, count).0 == "ok"), "{method}");
    }
    assert_eq!(ends.len(), 39);
    assert!(processes_with("sleep 7654").is_empty(), "an orphan still runs");
}

#[test]
fn a_nondeterministic_method_gives_a_warning() {
    let line = "--methods random,qmat --spheres 30 --repeat 3 --samples 100";
    for record in compare(line, 0) {
        assert_eq!(record["repetitions"].as_array().map(Vec::len), Some(3));
        let warnings = record["simplify"]["warnings"].to_string();
        let random = record["simplify"]["method"] == "random";
        assert_eq!(warnings.contains("not deterministic"), random, "{warnings}");
    }
}

#[test]
fn the_error_of_a_bound_is_that_of_the_result() {
    let at = Folder::of(faulty());
    at.done("datasets make box --resolution 8 -o box.off");
    // A level of `forgets` has fewer spheres alone than in the search. One that is within the bound alone, too, is
    // written, and what is printed is its error.
    for (method, certify) in [("forgets", false), ("forgets", true), ("qmat", false)] {
        let certifying = if certify { "--certify" } else { "" };
        let line = format!("simplify box.off -m {method} --max-error 0.2 -o x.ma {certifying}");
        let (code, object) = at.json(&line);
        assert_eq!(code, 0, "{object}");
        let of_file = at.json("evaluate box.off x.ma --certify 0.001").1;
        let printed = &object["max_error"];
        assert_eq!(printed["spheres"], of_file["counts"]["spheres"], "{object}");
        let (error, own) = (number(&printed["hausdorff"]), number(&of_file["hausdorff"]));
        if certify {
            let [lower, upper] = ["lower", "upper"].map(|end| number(&of_file["certified"][end]));
            assert!(lower <= error && error <= upper + 0.05 * 0.2, "{object}, {of_file}");
        } else {
            assert!((error - own).abs() < 1e-6, "{object}, {of_file}");
        }
        assert!(own <= 0.2, "{of_file}");
    }
    // No level of `warms-up` is within the bound alone.
    let line = "--methods warms-up --max-error 0.3 --spheres 30 --samples 500";
    let records = compare(line, 0);
    let missed = records.iter().find(|record| record["simplify"]["level"]["max_error"] == 0.3);
    assert_eq!(missed.expect("a record")["status"], "bound_missed");
}

#[test]
#[cfg(target_os = "linux")]
fn the_memory_of_a_worker_that_sends_events_is_limited() {
    let line = "--methods chatters --spheres 30 --samples 100 --timeout 60 --memory 1000";
    let ends = ends(&compare(line, 5));
    let (status, reason) = &ends[&("chatters".to_owned(), 30)];
    assert!(status == "out_of_memory" && reason.contains("1000 MB"), "{status}, {reason}");
}

#[test]
fn a_panic_of_the_command_is_a_failure_of_one_line() {
    let at = Folder::of(faulty());
    // Of the command, where methods are listed, and of a method.
    let lines = ["methods", "simplify builtin:box:8 -m panics --spheres 20 --json"];
    for (line, message) in lines.into_iter().zip(["FAULTY_INFO", "panics at 20 spheres"]) {
        let run = |backtrace: &str| {
            let mut command = at.command(line);
            command.env("RUST_BACKTRACE", backtrace);
            if line == "methods" {
                command.env("FAULTY_INFO", at.at(""));
            }
            ended(command.output().expect("it starts"))
        };
        let (code, _, stderr) = run("0");
        assert!(code == 70 && stderr.lines().count() == 1, "{code}: {stderr}");
        let advice = "this is a bug of medial, please report it with the input";
        assert!(stderr.contains(message) && stderr.trim_end().ends_with(advice), "{stderr}");
        assert!(run("1").2.contains("stack backtrace"));
    }
}

/// Writes `plugins.toml` with faulty programs, each a line for `sh`.
fn plugins(at: &Folder, programs: &[(&str, &str)]) {
    let mut text = String::new();
    for (id, script) in programs {
        at.write(format!("{id}.sh"), script);
        text += &format!(
            "[[method]]\nid = \"{id}\"\ntitle = \"{id}\"\nlevels = [\"spheres\"]\n\
             command = [\"sh\", \"{id}.sh\", \"{{initial}}\", \"{{output}}\", \"{{spheres}}\"]\n"
        );
    }
    at.write("plugins.toml", text);
}

#[test]
#[cfg(unix)]
fn faults_of_programs_are_contained_and_named() {
    let at = Folder::of(faulty());
    let programs = [
        ("p-loops", "while :; do sleep 1; done"),
        ("p-garbage", "head -c 100000 /dev/urandom > \"$2\""),
        ("p-nan", "echo '1 0 0\nv 0 0 0 nan' > \"$2\""),
        ("p-nothing", "exit 0"),
        ("p-unsupported", "echo 'no such shapes' >&2; exit 65"),
        ("p-fails", "echo 'out of luck' >&2; exit 3"),
        ("p-killed", "kill -9 $$"),
        ("p-loud", "head -c 1000000000 /dev/zero >&2; cp \"$1\" \"$2\""),
        ("p-stray", "sleep 8765 > /dev/null 2>&1 & cp \"$1\" \"$2\""),
        ("p-memory", "exec tail -n 1 /dev/zero"),
        ("p-killer", "kill -9 $PPID; sleep 5"),
        ("p-fine", "cp \"$1\" \"$2\""),
    ];
    plugins(&at, &programs);
    let methods = programs.map(|(id, _)| id).join(",");
    let limits = "--samples 100 --timeout 10 --memory 1500";
    let line = format!("--methods {methods} --spheres 20 --plugins plugins.toml {limits}");
    let records = compare_in(&at, &line, 3);
    let ends = ends(&records);
    let expected = [
        ("p-loops", "timed_out", "--timeout"),
        ("p-garbage", "invalid_output", ""),
        ("p-nan", "invalid_output", ""),
        ("p-nothing", "invalid_output", "no file"),
        ("p-unsupported", "unsupported", "no such shapes"),
        ("p-fails", "failed", "out of luck"),
        ("p-killed", "panicked", "p-killed: ended by SIGKILL"),
        ("p-loud", "other_count", "spheres where 20 were"),
        ("p-stray", "other_count", ""),
        ("p-memory", "out_of_memory", ""),
        ("p-killer", "panicked", "SIGKILL"),
        ("p-fine", "other_count", ""),
    ];
    for (method, status, part) in expected {
        let (found, reason) = &ends[&(method.to_owned(), 20)];
        assert!(found == status && reason.contains(part), "{method}: {found}, {reason}");
    }
    assert!(processes_with("sleep 8765").is_empty(), "an orphan still runs");
    let with_orphan = records.iter().find(|r| r["simplify"]["method"] == "p-stray");
    let warnings = with_orphan.expect("a record")["simplify"]["warnings"].to_string();
    assert!(warnings.contains("processes that the program left running: 1"), "{warnings}");
}

#[test]
#[cfg(target_os = "linux")]
fn only_the_tree_of_the_worker_ends_with_it() {
    let at = Folder::of("bash");
    // The shell's other child becomes a child of the command by `exec`. It must not hold the pipes of
    // the command, because the test waits for their end.
    let script = format!(
        "sleep 7777 > /dev/null 2>&1 & echo $! > pid; exec '{}' compare builtin:box:8 --methods loops --spheres 20 \
         --counts-only --samples 100 --timeout 2 --quiet --out out",
        faulty().display()
    );
    let (code, _, stderr) = ended(at.command("-c").arg(script).output().expect("it starts"));
    assert_eq!(code, 5, "{stderr}");
    assert_eq!(at.records("out")[0]["status"], "timed_out");
    let pid = at.text("pid").trim().to_owned();
    let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    assert!(String::from_utf8_lossy(&line).contains("7777"), "the neighbour still runs");
    assert!(Command::new("kill").arg(&pid).status().expect("kill runs").success());
}

#[test]
#[cfg(target_os = "linux")]
fn a_program_ends_with_the_command_that_is_terminated() {
    let at = Folder::new();
    plugins(&at, &[("p-waits", "sleep 6543")]);
    let line = "simplify builtin:box:8 -m p-waits --spheres 20 --json --plugins plugins.toml";
    let mut child = at.command(line).stdout(Stdio::null()).spawn().expect("it starts");
    while processes_with("sleep 6543").is_empty() && child.try_wait().expect("state").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let killed = Command::new("kill").arg(child.id().to_string()).status().expect("kill runs");
    assert!(killed.success());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert!(processes_with("sleep 6543").is_empty(), "the program still runs");
}

#[test]
fn bounds_that_were_found_survive_a_method_that_hangs_later() {
    let line =
        "--methods hangs-late --max-error 0.3,0.0000001 --spheres 30 --samples 500 --timeout 10";
    let records = compare(line, 3);
    let status = |bound: f64| {
        let of = |r: &&Value| r["simplify"]["level"]["max_error"] == bound;
        let record = records.iter().find(of).expect("a record");
        (record["status"].clone(), record["reason"].clone())
    };
    assert_eq!(status(0.3).0, "ok", "{:?}", status(0.3));
    assert_eq!(status(0.000_000_1).0, "timed_out", "{:?}", status(0.000_000_1));
    let count = |r: &Value| r["simplify"]["level"]["spheres"] == 30 && r["status"] == "ok";
    assert!(records.iter().any(count));
}
