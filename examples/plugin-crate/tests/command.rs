//! Tests for a method outside this repository: it passes the conformance tests, and it appears in the tables, the
//! plots and the page of a comparison.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs the command of this crate, and returns its output.
fn medial(arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_medial-largest"));
    let output = command.args(arguments).output().expect("the command starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {message}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn it_passes_the_conformance_tests() {
    let output = medial(&["check", "largest-rust", "--timeout", "600"]);
    assert!(output.contains(" 0 failed"), "{output}");
}

#[test]
fn it_stands_beside_the_published_methods() {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("largest");
    // A comparison adds to the results in its folder.
    let _ = fs::remove_dir_all(&out);
    let arguments =
        ["compare", "builtin:box:8", "--methods", "largest-rust,qmat", "--spheres", "30,20"];
    let rest =
        ["--samples", "200", "--counts-only", "--quiet", "--out", out.to_str().expect("UTF-8")];
    medial(&[arguments, rest].concat());
    let read = |name: &str| fs::read_to_string(out.join(name)).expect("a file of the report");
    let results = read("results.jsonl");
    let own = results.lines().filter(|line| line.contains("\"method\":\"largest-rust\""));
    assert_eq!(own.filter(|line| line.contains("\"status\":\"ok\"")).count(), 2, "{results}");
    assert!(read("results.csv").contains("largest-rust"));
    assert!(read("tables/summary.md").contains("largest-rust"));
    assert!(read("index.html").contains("Largest balls first"));
    let mut plots = fs::read_dir(out.join("plots")).expect("plots").flatten();
    assert!(plots.any(|plot| {
        fs::read_to_string(plot.path()).is_ok_and(|text| text.contains("largest-rust"))
    }));
    // With all built-in methods, those that run only when named included.
    let listed = medial(&["methods"]);
    for id in ["largest-rust", "qmat", "vmas", "tight"] {
        assert!(listed.lines().any(|line| line.starts_with(id)), "{id}: {listed}");
    }
}
