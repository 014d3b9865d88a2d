//! What the tests of the command share.

// Each test file is a crate of its own, and none uses all of it.
#![allow(dead_code)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// An example of this package, which cargo builds with its tests.
pub fn example(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("the test knows its file");
    let target = test.parent().and_then(Path::parent).expect("target/PROFILE/deps/TEST");
    let file = target.join("examples").join(name);
    assert!(file.exists(), "{} is not built: cargo build --examples", file.display());
    file
}

/// Runs a program with arguments and without progress.
pub fn run(program: impl AsRef<Path>, arguments: &[&str]) -> Output {
    let output = Command::new(program.as_ref()).args(arguments).output();
    output.unwrap_or_else(|error| panic!("{}: {error}", program.as_ref().display()))
}

/// The exit code of a process that no signal ended, with its standard error for a failing test.
pub fn code(output: &Output) -> i32 {
    let errors = String::from_utf8_lossy(&output.stderr);
    output.status.code().unwrap_or_else(|| panic!("a signal ended it: {errors}"))
}

/// Standard error as text.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The records of a folder of results.
pub fn records(out: &Path) -> Vec<Value> {
    let text = fs::read_to_string(out.join("results.jsonl")).expect("results");
    text.lines().map(|line| serde_json::from_str(line).expect("a whole record")).collect()
}

/// Records without what differs from run to run: seconds, memory, the command.
pub fn without_timings(mut records: Vec<Value>) -> Vec<Value> {
    for record in &mut records {
        for key in ["evaluate_seconds", "repetitions", "command"] {
            record.as_object_mut().expect("an object").remove(key);
        }
        let simplify = record["simplify"].as_object_mut().expect("an object");
        for key in ["seconds", "cpu_seconds", "peak_bytes", "substrates", "own_seconds"] {
            simplify.remove(key);
        }
    }
    records.sort_by_key(|record| record["key"].as_str().map(str::to_owned));
    records
}

/// Processes whose command line holds a text, by their numbers; none where the system does not tell.
pub fn processes_with(text: &str) -> Vec<u32> {
    let Ok(entries) = fs::read_dir("/proc") else { return Vec::new() };
    let pids = entries.flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let has = |pid: &u32| {
        let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        String::from_utf8_lossy(&line).replace('\0', " ").contains(text)
    };
    pids.filter(has).collect()
}
