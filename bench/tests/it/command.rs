//! The command as a test runs it.
#![allow(dead_code, reason = "not every test needs all of it")]

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

/// The words of a command line without quotes. Temporary folders have no space in their names.
pub fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// The command with arguments.
pub fn medial(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("medial").expect("the binary is built");
    command.args(arguments);
    command
}

/// Runs the command and returns its exit code and both outputs.
pub fn run(arguments: &[&str]) -> (i32, String, String) {
    let output = medial(arguments).output().expect("the command starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("no signal"), text(output.stdout), text(output.stderr))
}

/// Runs the command with `--json` and returns its exit code and the one object it prints.
pub fn json(arguments: &[&str]) -> (i32, Value) {
    let (code, stdout, stderr) = run(&[arguments, &["--json"]].concat());
    assert_eq!(stdout.lines().count(), 1, "one line of JSON: {stdout}\n{stderr}");
    let object: Value = serde_json::from_str(&stdout).expect("JSON");
    assert!(object["warnings"].is_array() && object["version"].is_string(), "{object}");
    (code, object)
}

/// A path that is UTF-8.
pub fn text_path(path: &Path) -> &str {
    path.to_str().expect("a UTF-8 path")
}
