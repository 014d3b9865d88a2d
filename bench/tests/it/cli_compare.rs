//! `medial compare`: records, files and exit codes.

use std::fs;

use serde_json::Value;

use crate::command::{Folder, cubes_off, ended, json_of, number};

#[test]
fn compare_records_every_run() {
    let at = Folder::new();
    let line = "compare builtin:box builtin:torus --spheres 100,50 --counts-only --samples 1000 --budget 300 \
                --out report";
    // Counts that are missed are results.
    let stdout = at.done(line);
    insta::assert_snapshot!("compare_summary_heads", heads(&stdout));
    let methods = medial_methods::registry();
    let usual = methods.iter().filter(|entry| !entry.presentation.on_request).count();
    let records = at.records("report");
    assert_eq!(records.len(), 2 * usual * 2);
    for record in records {
        let simplify = &record["simplify"];
        let [requested, reached] =
            [&simplify["level"]["spheres"], &simplify["reached"]].map(number);
        let near = (reached - requested).abs() <= 0.02 * requested;
        assert_eq!(record["status"], if near { "ok" } else { "other_count" }, "{record}");
        assert_eq!(record["reason"].is_null(), near, "{record}");
        assert!(record["evaluate"]["hausdorff"].is_f64(), "{record}");
        let artifact = record["artifact"].as_str().expect("an artifact");
        assert!(at.has(format!("report/{artifact}")), "{artifact}");
    }
    for file in ["index.html", "results.csv", "tables/summary.md", "tables/summary.tex"] {
        assert!(at.has(format!("report/{file}")), "{file}");
    }
    at.done("report report");
}

#[test]
fn without_a_mesh_few_shapes_run() {
    let at = Folder::new();
    let line = "compare --methods pmat --spheres 50 --counts-only --samples 200 -q --out report";
    assert_eq!(at.json(line).1["run"], 3);
    let meshes = ["bracket", "torus", "blob"];
    assert!(at.records("report").iter().zip(meshes).all(|(record, mesh)| record["mesh"] == mesh));
    let without = line.replace("--methods pmat", "--methods pmat,sat,qmat --without sat,qmat");
    assert_eq!(at.json(&format!("{without} --fresh")).1["run"], 3);
    let (_, object) = at.json(&format!("{line} --dataset builtin"));
    assert!(object["found"] == 3 && object["records"].as_u64() > Some(10), "{object}");
}

#[test]
fn native_levels_bounds_and_the_start_are_rows() {
    let at = Folder::new();
    // A bound below the error of the samples is missed, which is a result.
    at.done(
        "compare builtin:capsule --methods qmat,angle --spheres 40 --max-error 0.05,0.0001 \
         --levels angle=30,60,90 --certify 0.01 --samples 500 --out report",
    );
    let records = at.records("report");
    let of = |method: &str, level: Value| {
        let found = records.iter().find(|record| {
            record["simplify"]["method"] == method && record["simplify"]["level"] == level
        });
        found.unwrap_or_else(|| panic!("{method} {level}")).clone()
    };
    let hausdorff = |record: &Value| number(&record["evaluate"]["hausdorff"]);
    let start = of("initial", "published".into());
    assert_eq!(start["simplify"]["spheres"], start["initial"]["spheres"]);
    for method in ["qmat", "angle"] {
        let within = of(method, serde_json::json!({ "max_error": 0.05 }));
        assert!(within["status"] == "ok" && hausdorff(&within) <= 0.05, "{within}");
        let beyond = of(method, serde_json::json!({ "max_error": 0.0001 }));
        let why = beyond["reason"].as_str().expect("a reason");
        assert!(beyond["status"] == "bound_missed" && why.contains("lowest error"), "{beyond}");
        let certified = &within["evaluate"]["certified"];
        assert!(number(&certified["upper"]) >= 0.99 * hausdorff(&within));
    }
    for level in [30.0, 60.0, 90.0] {
        assert_eq!(of("angle", serde_json::json!({ "native": level }))["status"], "ok");
    }
    let page = at.text("report/index.html");
    for text in ["Equal error", "native levels", "theta"] {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn spheres_alone_have_a_table_of_cover() {
    let at = Folder::new();
    let line = "compare builtin:capsule --methods cover:fit=outside,cover:fit=inside,qmat --spheres 12 \
                --counts-only --samples 500 -q --out report";
    let table = |more: &str| {
        at.done(&format!("{line} {more}"));
        at.text("report/tables/overview-cover.md")
    };
    let rows = |table: &str| table.lines().filter(|line| line.starts_with("| 12 |")).count();
    // Q-MAT's results have edges.
    assert_eq!(rows(&table("")), 2);
    let alone = table("--spheres-alone");
    assert_eq!(rows(&alone), 3, "{alone}");
    let records = at.records("report");
    for record in records.iter().filter(|r| r["evaluate"]["counts"]["edges"] == 0) {
        let [uncovered, overshoot] =
            ["uncovered", "overshoot"].map(|side| &record["evaluate"]["cover"][side]["upper"]);
        match record["simplify"]["params"]["fit"].as_str() {
            Some("outside") => assert_eq!(uncovered, 0.0, "{record}"),
            Some("inside") => assert_eq!(overshoot, 0.0, "{record}"),
            _ => assert!(uncovered.as_f64() > Some(0.0), "{record}"),
        }
        assert!(record["evaluate"]["structure"].is_null(), "{record}");
    }
    assert!(at.has("report/plots/mesh-capsule-cover.svg"));
    let page = at.text("report/index.html");
    assert!(page.contains("Cover: one-sided errors"), "no table on the page");
}

/// The table of the summary without its numbers.
fn heads(stdout: &str) -> String {
    let lines = stdout.lines().take_while(|text| !text.contains("in % of the diagonal"));
    let heads = lines.map(|line| line.split_whitespace().next().unwrap_or_default());
    heads.collect::<Vec<_>>().join("\n")
}

#[test]
fn a_refused_mesh_and_an_unsupported_level_are_rows() {
    let at = Folder::new();
    at.write("bad.off", "OFF\n1 0 0\n0 0 0\n");
    let (code, object) = at.json(
        "compare bad.off builtin:sphere --published --counts-only --spheres 20 --samples 500 --methods sat-pairwise \
         --out report",
    );
    let counts = ["refused", "unsupported", "ok"].map(|status| &object["status"][status]);
    assert_eq!((code, counts), (3, [&2.into(), &1.into(), &1.into()]));
    // The reason is printed even with --quiet, also of an earlier run.
    for _ in 0..2 {
        let line = "compare bad.off --methods qmat,angle --spheres 20 -q --out report";
        let (code, _, stderr) = at.run(line);
        let lines: Vec<&str> = stderr.lines().collect();
        let is_reason = |line: &&str, method| line.starts_with(method) && line.contains("face");
        assert!(code == 5 && lines.len() == 3 && is_reason(&lines[1], "bad, qmat, 20"), "{stderr}");
    }
}

#[test]
fn meshes_with_the_same_name_get_different_results() {
    let at = Folder::new();
    for (folder, side) in [("a", 1.0), ("b", 2.0)] {
        fs::create_dir(at.at(folder)).expect("made");
        at.write(format!("{folder}/x.off"), cubes_off(&[([0.0; 3], side)]));
    }
    let compare = |meshes: &str| {
        let options = "--methods qmat,qmat --spheres 2 --samples 100 --out out --counts-only";
        at.json(&format!("compare {meshes} {options}"))
    };
    let (code, object) = compare("a/x.off b/x.off a/x.off");
    assert_eq!((code, &object["records"]), (0, &2.into()), "{object}");
    let records = at.records("out");
    let artifact = |r: &Value| format!("out/{}", r["artifact"].as_str().expect("a path"));
    let artifacts: Vec<String> = records.iter().map(artifact).collect();
    assert_ne!(at.text(&artifacts[0]), at.text(&artifacts[1]));

    // A wrong word costs no earlier result, not even with --fresh.
    at.write("study.toml", "[[method]]\nid = \"qmat\"\nname = \"hem\"\nparams = { k = 0 }\n");
    for (words, code) in [
        ("--samples 99", 2),
        ("--study study.toml", 2),
        ("--methods qmat:k=x", 2),
        ("--repeat 0", 2),
        ("--repeat 1000000000000", 2),
        ("--methods qmad", 2),
        ("builtin:spere", 2),
        ("builtin:sphere:1", 2),
        ("no-such-file.off", 1),
    ] {
        at.refused(&format!("compare a/x.off --out out --fresh {words}"), code, "");
        assert_eq!(at.records("out"), records);
    }
    assert_eq!(compare("builtin:sphere:8").0, 0);
    assert!(artifacts.iter().all(|path| at.has(path)), "another run adds");
    assert_eq!(compare("builtin:sphere:8 --fresh").1["records"], 1);
    assert!(!artifacts.iter().any(|path| at.has(path)), "{artifacts:?}");
}

#[test]
fn empty_results_and_meshes_are_errors() {
    let at = Folder::new();
    for level in ["lambda --level 1", "angle --level 180"] {
        at.refused(&format!("simplify builtin:sphere:8 -o x.ma -m {level}"), 3, "no sphere");
        assert!(!at.has("x.ma"));
    }
    at.write("empty.ma", "0 0 0\n");
    at.refused("simplify builtin:box -m angle --initial empty.ma -o x.ma", 1, "empty.ma");

    // Two cubes that are far smaller than a billionth of the distance between them.
    at.write("far.off", cubes_off(&[([0.0; 3], 1.0), ([1e12, 0.0, 0.0], 1.0)]));
    at.refused("axis far.off --sampling vertices", 1, "far.off");
    at.refused("axis far.off --sampling vertices", 1, "billionth");
}

/// A folder with a medial mesh of the built-in capsule with 20 spheres.
fn of_another_program() -> Folder {
    let at = Folder::new();
    at.done("simplify builtin:capsule -m qmat --spheres 20 -o theirs.ma");
    at
}

#[test]
fn external_results_are_rows_without_times() {
    let at = of_another_program();
    fs::copy(at.at("theirs.ma"), at.at("copy.ma")).expect("a copy");
    let line =
        "compare builtin:capsule --methods qmat --counts-only --samples 500 --out report --json";
    let compare = || {
        let mut command = at.command(line);
        command.args(["--given", "Q-MAT, theirs=theirs.ma", "--given", "Q-MAT+=copy.ma"]);
        json_of(ended(command.output().expect("it starts")))
    };
    let (code, object) = compare();
    assert_eq!(code, 0, "{object}");
    assert_eq!((&object["status"]["ok"], &object["status"]["external"]), (&1.into(), &2.into()));
    let mut records = at.records("report");
    // External results run first, in the order of the command line.
    records.rotate_left(2);
    let simplified = &records[0];
    assert_eq!(simplified["simplify"]["level"]["spheres"], 20, "the count of the files");
    for (record, name) in records[1..].iter().zip(["Q-MAT, theirs", "Q-MAT+"]) {
        assert_eq!(
            (&record["status"], &record["simplify"]["variant"]),
            (&"external".into(), &name.into())
        );
        assert!(record["simplify"]["seconds"].is_null(), "{record}");
        // Written with all digits and read again: the same errors but for rounding.
        let [ours, given] = [simplified, record].map(|r| number(&r["evaluate"]["hausdorff"]));
        assert!((ours - given).abs() < 1e-12, "{ours} {given}");
    }
    let (_, again) = compare();
    assert_eq!((&again["run"], &again["found"]), (&0.into(), &3.into()));
}

#[test]
fn external_results_without_a_mesh_are_refused_before_any_run() {
    let at = of_another_program();
    for (words, why) in [
        ("builtin:box --given a=theirs.ma", "--given a@capsule="),
        ("--given a@sphere=theirs.ma", "unknown mesh `sphere`"),
        ("--given a=nowhere.ma", "nowhere.ma"),
        ("--given theirs.ma", "expected NAME=FILE.ma"),
    ] {
        at.refused(&format!("compare builtin:capsule {words} --out report"), 2, why);
        assert!(!at.has("report"), "{words}");
    }
}

/// Values that no run can have, and names that no table can show.
#[test]
fn faults_of_a_study_are_refused_before_any_run() {
    let at = Folder::new();
    let long = "n".repeat(100_000);
    let method = |text: &str| format!("[[method]]\nid = \"angle\"\n{text}");
    for (text, code, why) in [
        (method("levels = [30.0, nan]"), 2, "--levels angle=NaN: expected a finite number"),
        (method("levels = [inf]"), 2, "--levels angle=inf: expected a finite number"),
        (method("levels = [-inf]"), 2, "--levels angle=-inf: expected a finite number"),
        (method("name = \"\""), 1, "invalid name (found \"\", expected 1 to 100 characters"),
        (method("name = \" \""), 1, "invalid name (found \" \""),
        (method("name = \"a\\u001b[2Jb\""), 1, "invalid name (found \"a\\u{1b}[2Jb\""),
        (method(&format!("name = \"{long}\"")), 1, "invalid name (found \"nnn"),
        ("[[given]]\nname = \"\"\nfile = \"a.ma\"".to_owned(), 1, "invalid name (found \"\""),
        (format!("{long} = 1"), 1, "study.toml: line 1: unknown field `nnn"),
        ("spheres = [1,\nmeshes = 3".to_owned(), 1, "study.toml: line "),
        (format!("meshes = []\nspheres = \"{long}\""), 1, "study.toml: line 2: invalid type"),
        (format!("[[method]]\nid = \"{long}\""), 2, "unknown method `nnn"),
        ("[[method]]\nid = \"qmad\"".to_owned(), 2, "did you mean `qmat`"),
        ("[[method]]\nname = \"x\"".to_owned(), 1, "missing field `id`"),
        ("spheres = [-3]".to_owned(), 1, "study.toml: line 1"),
        ("timeout = 0".to_owned(), 2, "--timeout 0"),
        ("threads = 0".to_owned(), 2, "--threads 0"),
        ("meshes = [\"nowhere.off\"]".to_owned(), 1, "nowhere.off"),
        ("plugins = [\"nowhere.toml\"]".to_owned(), 2, "nowhere.toml"),
    ] {
        at.write("study.toml", text);
        let (found, _, message) = at.run("compare --study study.toml --out report");
        assert!(found == code && message.contains(why), "{found}: {message:.2000}");
        assert!(
            message.len() < 1_500 && message.trim_end().lines().count() == 1,
            "{message:.2000}"
        );
        assert!(!at.has("report"));
    }
    for level in ["nan", "inf", "-inf", "1e999"] {
        let line = format!("compare builtin:box --methods angle --levels angle={level}");
        at.refused(&line, 2, "expected a finite number");
    }
}

#[test]
fn changes_of_a_solid_are_said_wherever_it_is_used() {
    let at = Folder::new();
    // A cube in another becomes a cavity. A cube far from the origin loses digits in single precision.
    at.write("boss.off", cubes_off(&[([0.0; 3], 4.0), ([1.0; 3], 2.0)]));
    at.write("far.off", cubes_off(&[([1e6, 0.0, 0.0], 1.0)]));
    at.done("axis boss.off -o boss.ma -q");
    at.done("axis far.off -o far.ma -q");
    let compare = "compare boss.off far.off --methods qmat,angle --spheres 20 --counts-only --samples 500 --out report";
    let text = at.done(compare);
    let page = at.text("report/index.html");
    for (mesh, words) in [("boss", "turned 1 component inward"), ("far", "digits are lost")] {
        let line = text.lines().find(|line| line.starts_with(&format!("{mesh}: ")));
        assert!(line.is_some_and(|line| line.contains(words)), "{text}");
        assert!(page.contains(words), "page of {mesh}");
        for line in [
            format!("axis {mesh}.off -o again.ma"),
            format!("evaluate {mesh}.off {mesh}.ma --samples 500"),
            format!("simplify {mesh}.off -m qmat --spheres 20 -o less.ma"),
            format!("render {mesh}.off {mesh}.ma -o x.png --size 100x100"),
            format!("reconstruct {mesh}.ma --mesh {mesh}.off -o x.off --tolerance 0.1"),
        ] {
            let text = at.done(&line);
            assert_eq!(text.matches(words).count(), 1, "{line}\n{text}");
        }
    }
    let warnings = &at.json(compare).1["warnings"];
    assert_eq!(warnings.as_array().map(Vec::len), Some(2), "{warnings}");
}
