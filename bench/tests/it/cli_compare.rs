//! `medial compare`: records, files and exit codes.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::command::{done, folder, json, records, refused, words};

#[test]
fn compare_records_every_run() {
    let at = folder();
    let out = at("report");
    let line = "compare builtin:box builtin:torus --spheres 100,50 --counts-only --samples 1000 --budget 300";
    // Counts that are missed are results.
    let stdout = done(&[&words(line)[..], &["--out", &out]].concat());
    insta::assert_snapshot!("compare_summary_heads", heads(&stdout));
    let methods = medial_methods::registry();
    let usual = methods.iter().filter(|entry| !entry.presentation.on_request).count();
    let records = records(&out);
    assert_eq!(records.len(), 2 * usual * 2);
    for record in records {
        let requested = record["simplify"]["level"]["spheres"].as_f64().expect("a count");
        let reached = record["simplify"]["reached"].as_f64().expect("a count");
        let near = (reached - requested).abs() <= 0.02 * requested;
        assert_eq!(record["status"], if near { "ok" } else { "other_count" }, "{record}");
        assert_eq!(record["reason"].is_null(), near, "{record}");
        assert!(record["evaluate"]["hausdorff"].is_f64(), "{record}");
        let artifact = Path::new(&out).join(record["artifact"].as_str().expect("an artifact"));
        assert!(artifact.exists(), "{}", artifact.display());
    }
    for file in ["index.html", "results.csv", "tables/summary.md", "tables/summary.tex"] {
        assert!(Path::new(&out).join(file).exists(), "{file}");
    }
    done(&["report", &out]);
    let words = [&words(line)[..], &["--out", &out, "-q", "--strict"]].concat();
    refused(&words, 3, "");
}

#[test]
fn without_a_mesh_few_shapes_run() {
    let at = folder();
    let out = at("report");
    let words = words("compare --methods pmat --spheres 50 --counts-only --samples 200 -q --out");
    assert_eq!(json(&[&words[..], &[&out]].concat()).1["run"], 3);
    let meshes = ["bracket", "torus", "blob"];
    assert!(records(&out).iter().zip(meshes).all(|(record, mesh)| record["mesh"] == mesh));
    let all = [&words[..], &[&out, "--dataset", "builtin"]].concat();
    let (_, object) = json(&all);
    assert!(object["found"] == 3 && object["records"].as_u64() > Some(10), "{object}");
}

#[test]
fn native_levels_bounds_chains_and_the_start_are_rows() {
    let at = folder();
    let out = at("report");
    let line = "compare builtin:capsule --methods qmat,angle --spheres 40 --max-error 0.05,0.0001 \
                --after-filters qmat --levels angle=30,60,90 --certify 0.01 --samples 500 --out";
    // A bound below the error of the samples is missed, which is a result.
    done(&[&words(line)[..], &[&out]].concat());
    let records = records(&out);
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
    // A chain starts from the output of the filter, with a warning.
    let chain = of("angle+qmat", serde_json::json!({ "spheres": 40 }));
    assert_eq!(chain["simplify"]["spheres"], 40);
    assert!(chain["simplify"]["warnings"].to_string().contains("to start from"), "{chain}");
    let page = fs::read_to_string(at("report/index.html")).expect("a page");
    for text in ["Equal error", "native levels", "angle+qmat", "theta"] {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn spheres_alone_have_a_table_of_cover() {
    let at = folder();
    let out = at("report");
    let line = "compare builtin:capsule --methods cover:mood=outside,cover:mood=inside,qmat --spheres 12 \
                --counts-only --samples 500 -q --out";
    let table = |more: &[&str]| {
        done(&[&words(line)[..], &[&out], more].concat());
        fs::read_to_string(at("report/tables/overview-cover.md")).expect("a table")
    };
    let rows = |table: &str| table.lines().filter(|line| line.starts_with("| 12 |")).count();
    // Q-MAT's results have edges.
    assert_eq!(rows(&table(&[])), 2);
    let alone = table(&["--spheres-alone"]);
    assert_eq!(rows(&alone), 3, "{alone}");
    for record in records(&out).iter().filter(|r| r["evaluate"]["counts"]["edges"] == 0) {
        let [uncovered, overshoot] =
            ["uncovered", "overshoot"].map(|side| &record["evaluate"]["cover"][side]["upper"]);
        match record["simplify"]["params"]["mood"].as_str() {
            Some("outside") => assert_eq!(uncovered, 0.0, "{record}"),
            Some("inside") => assert_eq!(overshoot, 0.0, "{record}"),
            _ => assert!(uncovered.as_f64() > Some(0.0), "{record}"),
        }
        assert!(record["evaluate"]["structure"].is_null(), "{record}");
    }
    assert!(fs::exists(at("report/plots/mesh-capsule-cover.svg")).expect("a folder"));
    let page = fs::read_to_string(at("report/index.html")).expect("a page");
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
    let at = folder();
    let (out, bad) = (at("report"), at("bad.off"));
    fs::write(&bad, "OFF\n1 0 0\n0 0 0\n").expect("written");
    let options = "--published --counts-only --spheres 20 --samples 500 --methods sat-pairwise";
    let compare = ["compare", &bad, "builtin:sphere", "--out", &out];
    let (code, object) = json(&[&compare[..], &words(options)].concat());
    let counts = ["refused", "unsupported", "ok"].map(|status| &object["status"][status]);
    assert_eq!((code, counts), (3, [&2.into(), &1.into(), &1.into()]));
    // The reason is printed even with --quiet, also of an earlier run.
    let alone =
        ["compare", &bad, "--methods", "qmat,angle", "--spheres", "20", "-q", "--out", &out];
    for _ in 0..2 {
        let (code, _, stderr) = crate::command::run(&alone);
        let lines: Vec<&str> = stderr.lines().collect();
        let is_reason = |line: &&str, method| line.starts_with(method) && line.contains("face");
        assert!(code == 5 && lines.len() == 3 && is_reason(&lines[1], "bad, qmat, 20"), "{stderr}");
    }
}

/// Cubes of 8 vertices, each at `x0 .. x0 + side`.
fn cubes_off(cubes: &[(f64, f64)]) -> String {
    const QUADS: [[usize; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let (mut vertices, mut faces) = (String::new(), String::new());
    for (k, (x0, side)) in cubes.iter().enumerate() {
        for i in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|bit| side * f64::from(i >> bit & 1));
            vertices += &format!("{} {y} {z}\n", x0 + x);
        }
        for [a, b, c, d] in QUADS.map(|quad| quad.map(|corner| 8 * k + corner)) {
            faces += &format!("4 {a} {b} {c} {d}\n");
        }
    }
    format!("OFF\n{} {} 0\n{vertices}{faces}", 8 * cubes.len(), 6 * cubes.len())
}

#[test]
fn meshes_with_the_same_name_get_different_results() {
    let at = folder();
    for (folder, side) in [("a", 1.0), ("b", 2.0)] {
        fs::create_dir(at(folder)).expect("made");
        fs::write(at(&format!("{folder}/x.off")), cubes_off(&[(0.0, side)])).expect("written");
    }
    let (a, b, out) = (at("a/x.off"), at("b/x.off"), at("out"));
    let mut common =
        vec!["--methods", "qmat,qmat", "--spheres", "2", "--samples", "100", "--out", &out];
    common.push("--counts-only");
    let (code, object) = json(&[&["compare", &a, &b, &a], &common[..]].concat());
    assert_eq!((code, &object["records"]), (0, &2.into()), "{object}");
    let records = records(&out);
    let artifact = |r: &Value| at(&format!("out/{}", r["artifact"].as_str().expect("a path")));
    let artifacts: Vec<String> = records.iter().map(artifact).collect();
    let [first, second] = [0, 1].map(|k| fs::read(&artifacts[k]).expect("written"));
    assert_ne!(first, second);

    // A wrong word costs no earlier result, not even with --fresh.
    let study = at("study.toml");
    let named = "[[method]]\nid = \"qmat\"\nname = \"hem\"\nparams = { k = 0 }\n";
    fs::write(&study, named).expect("written");
    let wrong: [(&[&str], i32); 9] = [
        (&["--samples", "99"], 2),
        (&["--study", &study], 2),
        (&["--methods", "qmat:k=x"], 2),
        (&["--repeat", "0"], 2),
        (&["--repeat", "1000000000000"], 2),
        (&["--methods", "qmad"], 2),
        (&["builtin:spere"], 2),
        (&["builtin:sphere:1"], 2),
        (&["no-such-file.off"], 1),
    ];
    for (words, code) in wrong {
        refused(&[&["compare", &a, "--out", &out, "--fresh"], words].concat(), code, "");
        assert_eq!(crate::command::records(&out), records);
    }
    assert_eq!(json(&[&["compare", "builtin:sphere:8"], &common[..]].concat()).0, 0);
    assert!(artifacts.iter().all(|path| Path::new(path).exists()), "another run adds");
    let fresh = [&["compare", "builtin:sphere:8", "--fresh"], &common[..]].concat();
    assert_eq!(json(&fresh).1["records"], 1);
    assert!(artifacts.iter().all(|path| !Path::new(path).exists()), "{artifacts:?}");
}

#[test]
fn empty_results_and_meshes_are_errors() {
    let at = folder();
    let (axis, empty, far) = (at("x.ma"), at("empty.ma"), at("far.off"));
    for (method, level) in [("lambda", "1"), ("angle", "180")] {
        let words = ["simplify", "builtin:sphere:8", "-m", method, "--level", level, "-o", &axis];
        refused(&words, 3, "no sphere");
        assert!(!Path::new(&axis).exists());
    }
    fs::write(&empty, "0 0 0\n").expect("written");
    let words = ["simplify", "builtin:box", "-m", "angle", "--initial", &empty, "-o", &axis];
    refused(&words, 1, "empty.ma");

    // Two cubes that are far smaller than a billionth of the distance between them.
    fs::write(&far, cubes_off(&[(0.0, 1.0), (1e12, 1.0)])).expect("written");
    let words = ["axis", &far, "--sampling", "vertices"];
    refused(&words, 1, "far.off");
    refused(&words, 1, "billionth");
}

/// A medial mesh of the built-in capsule with 20 spheres.
fn of_another_program(file: &str) {
    done(&["simplify", "builtin:capsule", "-m", "qmat", "--spheres", "20", "-o", file]);
}

#[test]
fn external_results_are_rows_without_times() {
    let at = folder();
    let [file, copy, out] = ["theirs.ma", "copy.ma", "report"].map(&at);
    of_another_program(&file);
    fs::copy(&file, &copy).expect("a copy");
    let (theirs, plus) = (format!("Q-MAT, theirs={file}"), format!("Q-MAT+={copy}"));
    let words = ["compare", "builtin:capsule", "--methods", "qmat", "--counts-only"];
    let given = ["--given", &theirs, "--given", &plus, "--samples", "500", "--out", &out];
    let words = [&words[..], &given].concat();
    let (code, object) = json(&words);
    assert_eq!(code, 0, "{object}");
    assert_eq!((&object["status"]["ok"], &object["status"]["external"]), (&1.into(), &2.into()));
    let mut records = records(&out);
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
        let [ours, given] =
            [simplified, record].map(|r| r["evaluate"]["hausdorff"].as_f64().expect("measured"));
        assert!((ours - given).abs() < 1e-12, "{ours} {given}");
    }
    let (_, again) = json(&words);
    assert_eq!((&again["run"], &again["found"]), (&0.into(), &3.into()));
}

#[test]
fn external_results_without_a_mesh_are_refused_before_any_run() {
    let at = folder();
    let [file, out] = ["theirs.ma", "report"].map(&at);
    of_another_program(&file);
    for (given, meshes, why) in [
        (format!("a={file}"), &["builtin:capsule", "builtin:box"][..], "--given a@capsule="),
        (format!("a@sphere={file}"), &["builtin:capsule"], "unknown mesh `sphere`"),
        ("a=nowhere.ma".to_owned(), &["builtin:capsule"], "nowhere.ma"),
        (file.clone(), &["builtin:capsule"], "expected NAME=FILE.ma"),
    ] {
        refused(&[&["compare"], meshes, &["--given", &given, "--out", &out]].concat(), 2, why);
        assert!(!Path::new(&out).exists(), "{given}");
    }
}

/// Values that no run can have, and names that no table can show.
#[test]
fn faults_of_a_study_are_refused_before_any_run() {
    let at = folder();
    let (file, out) = (at("study.toml"), at("report"));
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
        ("[groups]\n\"\" = [\"box\"]".to_owned(), 1, "invalid name (found \"\""),
        (
            "[groups]\nCAD = [\"bracket\", \"bracet\"]".to_owned(),
            2,
            "group \"CAD\": unknown mesh \"bracet\"",
        ),
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
        fs::write(&file, text).expect("written");
        let words = ["compare", "--study", &file, "--out", &out];
        let (found, _, message) = crate::command::run(&words);
        assert!(found == code && message.contains(why), "{found}: {message:.2000}");
        assert!(
            message.len() < 1_500 && message.trim_end().lines().count() == 1,
            "{message:.2000}"
        );
        assert!(!Path::new(&out).exists());
    }
    for level in ["nan", "inf", "-inf", "1e999"] {
        let levels = format!("angle={level}");
        let words =
            ["compare", "builtin:box", "--methods", "angle", "--levels", &levels, "--out", &out];
        refused(&words, 2, "expected a finite number");
    }
}
