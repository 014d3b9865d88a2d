//! `medial compare` as its users meet it.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::command::{json, run, text_path, words};

#[test]
fn compare_leaves_a_row_for_every_run() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("report");
    let (code, stdout, stderr) = run(&words(&format!(
        "compare builtin:box builtin:capsule --spheres 100,50 --counts-only \
             --samples 1000 --out {}",
        text_path(&out)
    )));
    assert_eq!(code, 0, "counts that are missed are results: {stderr}");
    insta::assert_snapshot!("compare_summary_heads", heads(&stdout));
    let lines = fs::read_to_string(out.join("results.jsonl")).expect("results");
    assert_eq!(lines.lines().count(), 2 * usual_methods() * 2);
    for line in lines.lines() {
        let record: Value = serde_json::from_str(line).expect("a record");
        let asked = record["simplify"]["level"]["spheres"].as_f64().expect("a count");
        let reached = record["simplify"]["reached"].as_f64().expect("a count");
        let near = (reached - asked).abs() <= 0.02 * asked;
        assert_eq!(record["status"], if near { "ok" } else { "other_count" }, "{record}");
        assert_eq!(record["reason"].is_null(), near, "{record}");
        assert!(record["evaluate"]["hausdorff"].is_f64(), "{record}");
        let artifact = out.join(record["artifact"].as_str().expect("an artifact"));
        assert!(artifact.exists(), "{}", artifact.display());
    }
    for file in ["index.html", "results.csv", "tables/summary.md", "tables/summary.tex"] {
        assert!(out.join(file).exists(), "{file}");
    }
    assert_eq!(run(&["report", text_path(&out)]).0, 0);
}

#[test]
fn own_levels_bounds_chains_and_the_start_are_rows() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("report");
    let (code, object) = json(&words(&format!(
        "compare builtin:capsule --methods qmat,angle --spheres 40 --max-error \
             0.05,0.0001 --after-filters qmat --levels angle=30,60,90 --certify 0.01 --samples 500 --out {}",
        text_path(&out)
    )));
    assert_eq!(code, 0, "a bound below the error of the samples is missed: {object}");
    let lines = fs::read_to_string(out.join("results.jsonl")).expect("results");
    let records: Vec<Value> =
        lines.lines().map(|line| serde_json::from_str(line).expect("a record")).collect();
    let of = |method: &str, level: Value| {
        let found = records.iter().find(|record| {
            record["simplify"]["method"] == method && record["simplify"]["level"] == level
        });
        found.unwrap_or_else(|| panic!("{method} {level}")).clone()
    };
    let hausdorff = |record: &Value| record["evaluate"]["hausdorff"].as_f64().expect("a number");
    let start = of("initial", "published".into());
    assert_eq!(start["simplify"]["spheres"], start["initial"]["spheres"]);
    for method in ["qmat", "angle", "angle+qmat", "lambda+qmat", "aof+qmat"] {
        let within = of(method, serde_json::json!({ "max_error": 0.05 }));
        assert!(within["status"] == "ok" && hausdorff(&within) <= 0.05, "{within}");
        let beyond = of(method, serde_json::json!({ "max_error": 0.0001 }));
        let why = beyond["reason"].as_str().expect("a reason");
        assert!(beyond["status"] == "bound_missed" && why.contains("lowest error"), "{beyond}");
        let certified = &within["evaluate"]["certified"];
        assert!(certified["upper"].as_f64().expect("certified") >= 0.99 * hausdorff(&within));
    }
    for level in [30.0, 60.0, 90.0] {
        assert_eq!(of("angle", serde_json::json!({ "native": level }))["status"], "ok");
    }
    // A chain starts from what the filter left, and says so.
    let chain = of("angle+qmat", serde_json::json!({ "spheres": 40 }));
    assert_eq!(chain["simplify"]["spheres"], 40);
    assert!(chain["simplify"]["warnings"].to_string().contains("to start from"), "{chain}");
    let page = fs::read_to_string(out.join("index.html")).expect("a page");
    for text in ["Equal error", "levels of its own", "angle+qmat", "theta"] {
        assert!(page.contains(text), "{text}");
    }
}

/// The summary without its numbers.
fn heads(stdout: &str) -> String {
    let line = |line: &str| line.split_whitespace().next().unwrap_or_default().to_owned();
    stdout
        .lines()
        .take_while(|text| !text.contains("page:"))
        .map(line)
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn a_refused_mesh_and_an_unsupported_level_are_rows() {
    let dir = tempfile::tempdir().expect("a folder");
    let (out, bad) = (dir.path().join("report"), dir.path().join("bad.off"));
    fs::write(&bad, "OFF\n1 0 0\n0 0 0\n").expect("written");
    let (code, object) = json(&words(&format!(
        "compare {} builtin:sphere --published --counts-only --spheres 20 --samples \
             500 --out {} --methods sat-pairwise",
        text_path(&bad),
        text_path(&out)
    )));
    assert_eq!(code, 3);
    assert_eq!(object["status"]["refused"], 2);
    assert_eq!(object["status"]["unsupported"], 1);
    assert_eq!(object["status"]["ok"], 1);
    let (code, _) = json(&["compare", text_path(&bad), "--counts-only", "--out", text_path(&out)]);
    assert_eq!(code, 5, "nothing was measured");
}

/// A cube of 8 vertices at `x0 .. x0 + side`.
fn cube_off(x0: f64, side: f64) -> String {
    let corner = |i: u32| {
        let c = |bit: u32| side * f64::from(i >> bit & 1);
        format!("{} {} {}\n", x0 + c(0), c(1), c(2))
    };
    let quads = "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n";
    format!("OFF\n8 6 0\n{}{quads}", (0..8).map(corner).collect::<String>())
}

#[test]
fn meshes_of_one_name_stay_apart() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = |name: &str| text_path(&dir.path().join(name)).to_owned();
    for (folder, side) in [("a", 1.0), ("b", 2.0)] {
        fs::create_dir(at(folder)).expect("made");
        fs::write(at(&format!("{folder}/x.off")), cube_off(0.0, side)).expect("written");
    }
    let (a, b, out) = (at("a/x.off"), at("b/x.off"), at("out"));
    let mut common =
        vec!["--methods", "qmat,qmat", "--spheres", "2", "--samples", "100", "--out", &out];
    common.push("--counts-only");
    let (code, object) = json(&[&["compare", &a, &b, &a], &common[..]].concat());
    assert_eq!((code, &object["records"]), (0, &2.into()), "{object}");
    let records = fs::read_to_string(at("out/results.jsonl")).expect("results");
    let artifact = |line: &str| {
        let record: Value = serde_json::from_str(line).expect("a record");
        at(&format!("out/{}", record["artifact"].as_str().expect("an artifact")))
    };
    let artifacts: Vec<String> = records.lines().map(artifact).collect();
    let written = artifacts.iter().map(|path| fs::read(path).expect("written"));
    let written: Vec<Vec<u8>> = written.collect();
    assert_ne!(written[0], written[1]);

    // A wrong word costs no earlier result, not even with --fresh.
    let wrong: [(&[&str], i32); 8] = [
        (&["--samples", "0"], 2),
        (&["--set", "qmat.k=x"], 2),
        (&["--repeat", "0"], 2),
        (&["--repeat", "1000000000000"], 2),
        (&["--methods", "qmad"], 2),
        (&["builtin:spere"], 2),
        (&["builtin:sphere:1"], 2),
        (&["no-such-file.off"], 1),
    ];
    for (words, code) in wrong {
        let words = [&["compare", &a, "--out", &out, "--fresh"], words].concat();
        assert_eq!(run(&words).0, code, "{words:?}");
        assert_eq!(fs::read_to_string(at("out/results.jsonl")).expect("results"), records);
    }
    assert_eq!(json(&[&["compare", "builtin:sphere:8"], &common[..]].concat()).0, 0);
    assert!(artifacts.iter().all(|path| Path::new(path).exists()), "another run adds");
    let fresh = [&["compare", "builtin:sphere:8", "--fresh"], &common[..]].concat();
    assert_eq!(json(&fresh).1["records"], 1);
    assert!(artifacts.iter().all(|path| !Path::new(path).exists()), "{artifacts:?}");
}

#[test]
fn nothing_is_no_success() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = |name: &str| text_path(&dir.path().join(name)).to_owned();
    let (axis, empty, far) = (at("x.ma"), at("empty.ma"), at("far.off"));
    for (method, level) in [("lambda", "1"), ("angle", "180")] {
        let words = ["simplify", "builtin:sphere:8", "-m", method, "--level", level, "-o", &axis];
        let (code, _, stderr) = run(&words);
        assert_eq!(code, 1, "{stderr}");
        assert!(stderr.contains("no sphere") && !Path::new(&axis).exists(), "{stderr}");
    }
    fs::write(&empty, "0 0 0\n").expect("written");
    let (code, _, stderr) = run(&["simplify", "builtin:box", "-m", "angle", "--initial", &empty]);
    assert!(code == 1 && stderr.contains("empty.ma"), "{stderr}");

    // Two cubes that are far smaller than a billionth of the distance between them.
    let pair = cube_off(0.0, 1.0).replace("8 6 0", "16 12 0");
    let (header, rest) = pair.split_at("OFF\n16 12 0\n".len());
    let second = cube_off(1e12, 1.0);
    let lines = |text: &str, skip: usize, take: usize| {
        text.lines().skip(skip).take(take).map(|line| format!("{line}\n")).collect::<String>()
    };
    let moved = lines(&second, 10, 6).lines().fold(String::new(), |text, line| {
        let corners = line.split(' ').skip(1).map(|i| i.parse::<u32>().expect("an index") + 8);
        text + "4 " + &corners.map(|i| i.to_string()).collect::<Vec<_>>().join(" ") + "\n"
    });
    let (ours, theirs) = (lines(rest, 0, 8), lines(&second, 2, 8));
    fs::write(&far, format!("{header}{ours}{theirs}{}{moved}", lines(rest, 8, 6)))
        .expect("written");
    let (code, _, stderr) = run(&["axis", &far]);
    assert!(code == 1 && stderr.contains("far.off") && stderr.contains("billionth"), "{stderr}");
}

/// A medial mesh of the built-in capsule with 20 spheres.
fn of_another_program(file: &Path) {
    let words = ["simplify", "builtin:capsule", "-m", "qmat", "--spheres", "20", "-o"];
    let (code, _, stderr) = run(&[&words[..], &[text_path(file)]].concat());
    assert_eq!(code, 0, "{stderr}");
}

#[test]
fn given_files_are_rows_without_times_beside_the_methods() {
    let dir = tempfile::tempdir().expect("a folder");
    let [file, copy, out] = ["theirs.ma", "copy.ma", "report"].map(|name| dir.path().join(name));
    of_another_program(&file);
    fs::copy(&file, &copy).expect("a copy");
    let named = [("Q-MAT, theirs", &file), ("Q-MAT+", &copy)];
    let [theirs, plus] = named.map(|(name, file)| format!("{name}={}", text_path(file)));
    let words =
        ["compare", "builtin:capsule", "--methods", "qmat", "--counts-only", "--given", &theirs];
    let words =
        [&words[..], &["--given", &plus, "--samples", "500", "--out", text_path(&out)]].concat();
    let (code, object) = json(&words);
    assert_eq!(code, 0, "{object}");
    assert_eq!((&object["status"]["ok"], &object["status"]["external"]), (&1.into(), &2.into()));
    let lines = fs::read_to_string(out.join("results.jsonl")).expect("results");
    let records: Vec<Value> =
        lines.lines().map(|line| serde_json::from_str(line).expect("a record")).collect();
    let simplified = &records[0];
    assert_eq!(simplified["simplify"]["level"]["spheres"], 20, "the count of the files");
    for (record, (name, other)) in
        records[1..].iter().zip([("Q-MAT, theirs", "Q-MAT+"), ("Q-MAT+", "Q-MAT, theirs")])
    {
        assert_eq!(
            (&record["status"], &record["simplify"]["variant"]),
            (&"external".into(), &name.into())
        );
        assert!(record["simplify"]["seconds"].is_null(), "{record}");
        let warnings = record["simplify"]["warnings"].as_array().expect("a list");
        let same = format!("the same bytes are given as {other}, too");
        assert!(warnings.contains(&same.into()), "{record}");
        // Written with all digits and read again: the same errors but for rounding.
        let [ours, given] =
            [simplified, record].map(|r| r["evaluate"]["hausdorff"].as_f64().expect("measured"));
        assert!((ours - given).abs() < 1e-12, "{ours} {given}");
    }
    let (_, again) = json(&words);
    assert_eq!((&again["run"], &again["found"]), (&0.into(), &3.into()));
}

#[test]
fn given_files_that_fit_no_mesh_are_refused_before_anything_runs() {
    let dir = tempfile::tempdir().expect("a folder");
    let [file, out] = ["theirs.ma", "report"].map(|name| dir.path().join(name));
    of_another_program(&file);
    let file = text_path(&file);
    for (given, meshes, why) in [
        (format!("a={file}"), &["builtin:capsule", "builtin:box"][..], "--given a@capsule="),
        (format!("a@sphere={file}"), &["builtin:capsule"], "no mesh is called `sphere`"),
        ("a=nowhere.ma".to_owned(), &["builtin:capsule"], "nowhere.ma"),
        (file.to_owned(), &["builtin:capsule"], "write NAME=FILE.ma"),
    ] {
        let words = [&["compare"], meshes, &["--given", &given, "--out", text_path(&out)]].concat();
        let (code, _, stderr) = run(&words);
        assert!((1..=2).contains(&code) && stderr.contains(why), "{given}: {code}, {stderr}");
        assert!(!out.exists(), "{given}");
    }
}

/// Number of methods that run when none is named.
fn usual_methods() -> usize {
    medial_methods::registry().iter().filter(|entry| !entry.presentation.on_request).count()
}
