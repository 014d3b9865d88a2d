//! Helpers of the tests: runs of the command, and its records.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// The command.
pub const MEDIAL: &str = env!("CARGO_BIN_EXE_medial");

/// The words of a command line without quotes. Temporary folders have no space in their names.
pub fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// A temporary folder as the texts of paths in it, which goes with the function.
pub fn folder() -> impl Fn(&str) -> String {
    let dir = tempfile::tempdir().expect("a folder");
    move |name| text_path(&dir.path().join(name)).to_owned()
}

/// The exit code and both outputs of a process that no signal ended.
pub fn ended(output: Output) -> (i32, String, String) {
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8"));
    let code = output.status.code().unwrap_or_else(|| panic!("a signal ended it: {stderr}"));
    (code, stdout, stderr)
}

/// Runs a program and returns its exit code and both outputs.
pub fn run_program(program: impl AsRef<Path>, arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(program.as_ref()).args(arguments).output();
    ended(output.unwrap_or_else(|error| panic!("{}: {error}", program.as_ref().display())))
}

/// Runs the command and returns its exit code and both outputs.
pub fn run(arguments: &[&str]) -> (i32, String, String) {
    run_program(MEDIAL, arguments)
}

/// Runs the command, which must succeed, and returns its standard output.
#[track_caller]
pub fn done(arguments: &[&str]) -> String {
    let (code, stdout, stderr) = run(arguments);
    assert_eq!(code, 0, "{arguments:?}: {stderr}");
    stdout
}

/// Runs the command, which must end in this code and with these words on standard error.
#[track_caller]
pub fn refused(arguments: &[&str], expected: i32, words: &str) {
    let (code, _, stderr) = run(arguments);
    assert!(code == expected && stderr.contains(words), "{arguments:?}: {code}, {stderr}");
}

/// Runs the command with `--json` and returns its exit code and the one object it prints.
#[track_caller]
pub fn json(arguments: &[&str]) -> (i32, Value) {
    json_of(MEDIAL, arguments)
}

/// [`json`] of a program that is the command with other methods.
#[track_caller]
pub fn json_of(program: impl AsRef<Path>, arguments: &[&str]) -> (i32, Value) {
    let (code, stdout, stderr) = run_program(program, &[arguments, &["--json"]].concat());
    assert_eq!(stdout.lines().count(), 1, "one line of JSON: {stdout}\n{stderr}");
    let object: Value = serde_json::from_str(&stdout).expect("JSON");
    assert!(object["warnings"].is_array() && object["version"].is_string(), "{object}");
    (code, object)
}

/// A path that is UTF-8.
pub fn text_path(path: &Path) -> &str {
    path.to_str().expect("a UTF-8 path")
}

/// The command with methods that go wrong, which cargo builds with its tests.
pub fn faulty() -> PathBuf {
    let test = std::env::current_exe().expect("the test knows its file");
    let target = test.parent().and_then(Path::parent).expect("target/PROFILE/deps/TEST");
    let file = target.join("examples/faulty");
    assert!(file.exists(), "{} is not built: cargo build --examples", file.display());
    file
}

/// The records of a folder of results.
pub fn records(out: impl AsRef<Path>) -> Vec<Value> {
    let text = fs::read_to_string(out.as_ref().join("results.jsonl")).expect("results");
    text.lines().map(|line| serde_json::from_str(line).expect("a whole record")).collect()
}

/// Records without the fields that differ from run to run: seconds, memory, the command, and the number of jobs.
pub fn without_timings(mut records: Vec<Value>) -> Vec<Value> {
    for record in &mut records {
        for key in ["evaluate_seconds", "repetitions", "command"] {
            record.as_object_mut().expect("an object").remove(key);
        }
        record["conditions"].as_object_mut().expect("an object").remove("jobs");
        let simplify = record["simplify"].as_object_mut().expect("an object");
        for key in ["seconds", "cpu_seconds", "peak_bytes", "substrates", "own_seconds"] {
            simplify.remove(key);
        }
    }
    records.sort_by_key(|record| record["key"].as_str().map(str::to_owned));
    records
}

/// Ids of the processes with a text in the command line; none on systems without `/proc`.
pub fn processes_with(text: &str) -> Vec<u32> {
    let Ok(entries) = fs::read_dir("/proc") else { return Vec::new() };
    let pids = entries.flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let has = |pid: &u32| {
        let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        String::from_utf8_lossy(&line).replace('\0', " ").contains(text)
    };
    pids.filter(has).collect()
}
