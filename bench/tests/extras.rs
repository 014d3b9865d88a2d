//! `medial baseline` and `medial stability`, from the command line to the rebuilt report.

use std::fs;
use std::path::Path;

use assert_cmd::Command;

fn run(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let mut command = Command::cargo_bin("medial").expect("the binary is built");
    let output = command.args(arguments).current_dir(folder).output().expect("the command starts");
    let text = String::from_utf8([output.stdout, output.stderr].concat()).expect("UTF-8");
    (output.status.code().expect("no signal"), text)
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap_or_default()
}

#[test]
fn a_baseline_survives_a_rebuilt_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let (code, text) = run(at, &["datasets", "make", "torus", "-o", "same.off"]);
    assert_eq!(code, 0, "{text}");
    // An open surface is measured too: the torus without its last triangle.
    let whole = read(at, "same.off");
    let mut lines: Vec<&str> = whole.trim_end().lines().collect();
    lines.pop();
    let counts: Vec<usize> =
        lines[1].split(' ').map(|word| word.parse().expect("a number")).collect();
    let head = format!("{} {} 0", counts[0], counts[1] - 1);
    lines[1] = &head;
    fs::write(at.join("open.off"), lines.join("\n") + "\n").expect("written");
    let list = r#"{"tool": "nothing 1", "surfaces": [
        {"file": "same.off", "numbers": 400}, {"file": "open.off", "numbers": 200}]}"#;
    fs::write(at.join("list.json"), list).expect("written");
    let baseline = [
        "baseline",
        "builtin:torus",
        "--surfaces",
        "list.json",
        "--samples",
        "500",
        "--out",
        "out",
    ];
    let (code, text) = run(at, &baseline);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("no results.jsonl in out"), "{text}");

    let compare = [
        "compare",
        "builtin:torus",
        "--methods",
        "angle",
        "--counts-only",
        "--spheres",
        "100",
        "--samples",
        "500",
        "--out",
        "out",
    ];
    let (code, text) = run(at, &compare);
    assert_eq!(code, 0, "{text}");
    let table = read(at, "out/tables/baseline.md");
    assert!(table.contains("| 400 | medial method | angle |"), "{table}");
    assert!(table.contains("| 400 | baseline | nothing 1 |"), "{table}");
    let lines = read(at, "out/baselines.jsonl");
    let errors: Vec<f64> = lines
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).expect("JSON"))
        .map(|line| line["distances"]["hausdorff"].as_f64().expect("a number"))
        .collect();
    assert!(errors[0] < 1e-12 && errors[1] > 0.0, "{errors:?}");

    let page = read(at, "out/index.html");
    let (code, text) = run(at, &["report", "out"]);
    assert_eq!(code, 0, "{text}");
    assert_eq!(read(at, "out/index.html"), page);
    // Measured once more, it replaces the first.
    assert_eq!(run(at, &baseline).0, 0);
    assert_eq!(read(at, "out/baselines.jsonl").lines().count(), 2);
    let (code, text) = run(at, &["baseline", "builtin:torus", "--surfaces", "none.json"]);
    assert!(code == 1 && text.contains("none.json"), "{text}");
}

#[test]
fn stability_is_measured_against_the_clean_surface() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let stability = [
        "stability",
        "builtin:torus",
        "--methods",
        "lambda",
        "--spheres",
        "200",
        "--noise",
        "0.001,0.01",
        "--noise-seeds",
        "2",
        "--samples",
        "500",
        "--out",
        "out",
    ];
    let (code, text) = run(at, &stability);
    assert_eq!(code, 0, "{text}");
    let first = read(at, "out/stability.jsonl");
    let records: Vec<serde_json::Value> =
        first.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(records.len(), 1 + 2 * 2);
    let mean = |k: usize| records[k]["record"]["evaluate"]["mean"].as_f64().expect("a number");
    let shift = |k: usize| {
        records[k]["shift"]["in_space"]["computed_to_true_mean"].as_f64().expect("a number")
    };
    assert!(records[0]["shift"].is_null() && records[0]["noise"] == 0.0);
    assert!(mean(3) > mean(1) && mean(4) > mean(2), "more noise, more error");
    assert!(shift(3) > shift(1) && shift(1) > 0.0, "{} {}", shift(1), shift(3));
    // The clean surface's own axis is known and judged against; all runs have its diagonal.
    let diagonal = |k: usize| records[k]["record"]["evaluate"]["diagonal"].clone();
    assert!((1..5).all(|k| diagonal(k) == diagonal(0)));
    assert!(records[4]["record"]["evaluate"]["axis"].is_object());
    assert!(read(at, "out/tables/stability.md").contains("| 200 | lambda | 0.1 | 2 of 2 |"));
    assert!(read(at, "out/index.html").contains("id=\"stability\""));
    for wrong in [["--noise", "-1"], ["--noise", "nan"], ["--noise-seeds", "0"]] {
        let (code, text) = run(at, &[&["stability", "builtin:torus"], &wrong[..]].concat());
        assert_eq!(code, 2, "{text}");
    }
}
