//! The command as its users meet it: what it prints, what it writes, how it ends.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

fn medial(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("medial").expect("the binary is built");
    command.args(arguments);
    command
}

/// Runs the command and returns its exit code and both outputs.
fn run(arguments: &[&str]) -> (i32, String, String) {
    let output = medial(arguments).output().expect("the command starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("no signal"), text(output.stdout), text(output.stderr))
}

/// Runs the command with `--json` and returns its exit code and the one object it prints.
fn json(arguments: &[&str]) -> (i32, Value) {
    let (code, stdout, stderr) = run(&[arguments, &["--json"]].concat());
    assert_eq!(stdout.lines().count(), 1, "one line of JSON: {stdout}\n{stderr}");
    let object: Value = serde_json::from_str(&stdout).expect("JSON");
    assert!(object["warnings"].is_array() && object["version"].is_string(), "{object}");
    (code, object)
}

fn text_path(path: &Path) -> &str {
    path.to_str().expect("a UTF-8 path")
}

/// Seconds and sizes that differ from run to run become `#`.
fn without_timings(text: &str) -> String {
    let words = text.split(' ').map(|word| {
        let number = word.trim_end_matches(['s', ',']);
        if number.contains('.') && number.parse::<f64>().is_ok() { "#" } else { word }
    });
    words.collect::<Vec<_>>().join(" ")
}

#[test]
fn help_names_every_verb() {
    let (code, stdout, _) = run(&["--help"]);
    assert_eq!(code, 0);
    insta::assert_snapshot!(stdout);
}

#[test]
fn methods_and_their_parameters() {
    insta::assert_snapshot!("methods", run(&["methods"]).1);
    insta::assert_snapshot!("methods_qmat", run(&["methods", "qmat"]).1);
    insta::assert_snapshot!("methods_pmat", run(&["methods", "pmat"]).1);
    insta::assert_snapshot!("methods_hem", run(&["methods", "hem"]).1);
    insta::assert_snapshot!("methods_angle", run(&["methods", "angle"]).1);
    let (code, _, stderr) = run(&["methods", "nothing"]);
    assert_eq!(code, 2);
    insta::assert_snapshot!("methods_unknown", stderr);
}

#[test]
fn datasets_are_listed() {
    insta::assert_snapshot!(run(&["datasets", "list"]).1);
}

#[test]
fn info_on_a_built_in_shape() {
    let (code, stdout, _) = run(&["info", "builtin:torus"]);
    assert_eq!(code, 0);
    insta::assert_snapshot!(stdout);
    let (_, object) = json(&["info", "builtin:torus"]);
    for key in [
        "vertices",
        "faces",
        "components",
        "genus",
        "closed",
        "manifold",
        "oriented",
        "self_intersecting",
        "degenerate_faces",
        "diagonal",
        "repairs",
    ] {
        assert!(!object[key].is_null(), "{key} is missing in {object}");
    }
}

#[test]
fn info_describes_a_mesh_that_it_refuses() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("open.off");
    fs::write(&path, "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n")
        .expect("written");
    let (code, object) = json(&["info", text_path(&path)]);
    assert_eq!(code, 1);
    assert_eq!(object["closed"], false);
    assert_eq!(object["boundary_edges"], 3);
    assert!(
        object["reason"].as_str().is_some_and(|reason| reason.contains("open.off")),
        "{object}"
    );
}

#[test]
fn axis_simplify_evaluate_convert() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = |name: &str| dir.path().join(name);
    let (mesh, axis, simple, ply) =
        (at("box.off"), at("axis.ma"), at("simple.ma"), at("simple.ply"));
    let [mesh, axis, simple, ply] = [&mesh, &axis, &simple, &ply].map(|path| text_path(path));
    assert_eq!(run(&["datasets", "make", "box", "-o", mesh]).0, 0);

    let (code, object) = json(&["axis", mesh, "-o", axis]);
    assert_eq!(code, 0);
    for key in [
        "spheres",
        "edges",
        "faces",
        "isolated",
        "euler",
        "betti",
        "expected_betti",
        "samples",
        "sampling",
        "seed",
        "seconds",
        "cpu_seconds",
        "peak_bytes",
    ] {
        assert!(object.get(key).is_some(), "{key} is missing in {object}");
    }
    for stage in ["read", "delaunay", "inside", "extract", "total"] {
        assert!(object["seconds"][stage].is_f64(), "{stage} is missing in {object}");
    }
    assert_eq!(object["betti"], object["expected_betti"]);

    for method in ["qmat", "pmat", "hem", "sat-pairwise", "angle", "lambda"] {
        let (code, object) =
            json(&["simplify", mesh, "--method", method, "--spheres", "60", "-o", simple]);
        assert_eq!(code, 0, "{object}");
        assert_eq!(object["status"], "ok");
        assert_eq!(object["spheres"], 60);
        assert_eq!(object["level"]["spheres"], 60);
        let (code, object) = json(&["evaluate", mesh, simple, "--samples", "2000"]);
        assert_eq!(code, 0);
        for key in [
            "epsilon",
            "epsilon_union",
            "reverse",
            "hausdorff",
            "mean",
            "rms",
            "p95",
            "p99",
            "reverse_mean",
            "spheres_only",
            "volume_error",
            "quality",
            "spikes",
            "betti",
            "euler",
            "expected_betti",
            "counts",
            "diagonal",
            "samples",
            "seed",
        ] {
            assert!(object.get(key).is_some(), "{key} is missing in {object}");
        }
        let number = |key: &str| object[key].as_f64().expect("a number");
        assert_eq!(number("hausdorff"), number("epsilon_union").max(number("reverse")));
    }

    let certify = ["evaluate", mesh, simple, "--samples", "2000", "--certify", "1e-3"];
    let (code, object) = json(&certify);
    assert_eq!(code, 0);
    let bound = |key: &str| object["certified"][key].as_f64().expect("a number");
    assert!(bound("lower") > 0.0 && bound("upper") - bound("lower") <= 1e-3, "{object}");
    assert!(object["hausdorff"].as_f64().expect("a number") <= bound("upper"), "{object}");

    let from_file = ["simplify", mesh, "--method", "qmat", "--spheres", "60", "--initial", axis];
    assert_eq!(json(&from_file).1["spheres"], 60);
    assert_eq!(run(&["convert", simple, ply]).0, 0);
    assert_eq!(run(&["convert", ply, axis]).0, 0);
    assert_eq!(fs::read(axis).expect("read"), fs::read(simple).expect("read"));
    assert_eq!(run(&["convert", mesh, simple]).0, 2, "a surface is no medial mesh");
}

#[test]
fn threads_change_no_byte() {
    let dir = tempfile::tempdir().expect("a folder");
    for method in ["qmat", "pmat", "hem", "sat-pairwise", "angle", "lambda"] {
        let written = ["1", "2"].map(|threads| {
            let path = dir.path().join(format!("{method}-{threads}.ma"));
            let (code, ..) = run(&[
                "simplify",
                "builtin:blob",
                "--method",
                method,
                "--spheres",
                "100",
                "--threads",
                threads,
                "-o",
                text_path(&path),
            ]);
            assert_eq!(code, 0);
            fs::read(path).expect("written")
        });
        assert_eq!(written[0], written[1], "{method}");
    }
}

#[test]
fn compare_leaves_a_row_for_every_run() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("report");
    let (code, stdout, stderr) = run(&[
        "compare",
        "builtin:box",
        "builtin:capsule",
        "--spheres",
        "100,50",
        "--counts-only",
        "--samples",
        "1000",
        "--out",
        text_path(&out),
    ]);
    assert_eq!(code, 3, "some counts are not met: {stderr}");
    insta::assert_snapshot!("compare_summary_heads", heads(&stdout));
    let lines = fs::read_to_string(out.join("results.jsonl")).expect("results");
    assert_eq!(lines.lines().count(), 2 * medial_methods::registry().len() * 2);
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
    let (code, object) = json(&[
        "compare",
        "builtin:capsule",
        "--methods",
        "qmat,angle",
        "--spheres",
        "40",
        "--max-error",
        "0.05,0.0001",
        "--after-filters",
        "qmat",
        "--levels",
        "angle=30,60,90",
        "--certify",
        "0.01",
        "--samples",
        "500",
        "--out",
        text_path(&out),
    ]);
    assert_eq!(code, 3, "a bound below the error of the samples is missed: {object}");
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

#[test]
fn a_wrong_topology_is_said() {
    // One ball where the solid has a tunnel.
    let (code, object) = json(&["simplify", "builtin:torus", "-m", "lambda", "--spheres", "1"]);
    assert!(code == 0 && object["warnings"].to_string().contains("1 tunnel missing"), "{object}");
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
    let (code, object) = json(&[
        "compare",
        text_path(&bad),
        "builtin:sphere",
        "--published",
        "--counts-only",
        "--spheres",
        "20",
        "--samples",
        "500",
        "--out",
        text_path(&out),
        "--methods",
        "sat-pairwise",
    ]);
    assert_eq!(code, 3);
    assert_eq!(object["status"]["refused"], 2);
    assert_eq!(object["status"]["unsupported"], 1);
    assert_eq!(object["status"]["ok"], 1);
    let (code, _) = json(&["compare", text_path(&bad), "--counts-only", "--out", text_path(&out)]);
    assert_eq!(code, 5, "nothing was measured");
}

#[test]
fn wrong_words_end_in_usage() {
    let cases: [&[&str]; 8] = [
        &["compare", "builtin:nothing", "--methods", "nothing"],
        &["compare", "--spheres", "0"],
        &["compare", "--set", "qmat.k"],
        &["simplify", "builtin:box", "--method", "qmat", "--spheres", "5", "--set", "no=1"],
        &["simplify", "builtin:box", "--method", "angle", "--level", "999"],
        &["axis", "builtin:box", "--sampling", "red:5"],
        &["axis", "builtin:box:x"],
        &["info", "builtin:box", "--threads", "0"],
    ];
    for arguments in cases {
        let (code, _, stderr) = run(arguments);
        assert_eq!(code, 2, "{arguments:?}: {stderr}");
    }
    let (code, _, stderr) = run(&["simplify", "no-such-file.off", "--method", "qmat"]);
    assert_eq!(code, 1);
    assert!(stderr.contains("no-such-file.off"), "{stderr}");
}

#[test]
fn hierarchies_are_saved_and_taken_from_a_file() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = |name: &str| text_path(&dir.path().join(name)).to_owned();
    let (all, computed, loaded) = (at("all.hierarchy"), at("computed.ma"), at("loaded.ma"));
    let pmat =
        |mesh: &str, more: &[&str]| json(&[&["simplify", mesh, "-m", "pmat"], more].concat());
    let mesh = "builtin:torus:20";
    assert_eq!(pmat(mesh, &["--save-hierarchy", &all]).0, 0);
    for level in [["--spheres", "40"], ["--level", "1.5"], ["--max-error", "0.05"]] {
        let level = [&level[..], &["--samples", "500"]].concat();
        let first = pmat(mesh, &[&level[..], &["-o", &computed]].concat());
        let again = pmat(mesh, &[&level[..], &["-o", &loaded, "--hierarchy", &all]].concat());
        assert_eq!((first.0, again.0), (0, 0), "{again:?}");
        assert_eq!(first.1["native_level"], again.1["native_level"]);
        assert_eq!(first.1["diagnostics"], again.1["diagnostics"]);
        assert_eq!(fs::read(&computed).expect("written"), fs::read(&loaded).expect("written"));
        // Nothing was built for it; a search still measures against the surface.
        assert_eq!(again.1["substrates"], serde_json::json!({}), "{again:?}");
    }
    let other = at("other.hierarchy");
    let given = ["--initial", &computed, "--spheres", "5"];
    assert_eq!(pmat(mesh, &[&given[..], &["--save-hierarchy", &other]].concat()).0, 0);
    assert_eq!(pmat(mesh, &[&given[..], &["--hierarchy", &other]].concat()).0, 0);
    let cut = at("cut.hierarchy");
    let bytes = fs::read(&all).expect("written");
    fs::write(&cut, &bytes[..bytes.len() - 7]).expect("written");
    let cases: [(&str, &[&str], i32, &str); 8] = [
        (
            "builtin:torus:21",
            &["--hierarchy", &all],
            1,
            "all.hierarchy: it was made from another surface",
        ),
        (
            mesh,
            &["--hierarchy", &all, "--sampling", "blue:300"],
            1,
            "with --sampling vertices, not blue:300",
        ),
        (mesh, &["--hierarchy", &all, "--initial", &computed], 1, "without --initial"),
        (mesh, &["--hierarchy", &other], 1, "made with --initial"),
        (mesh, &["--hierarchy", &cut], 1, &format!("cut.hierarchy, byte {}: ", bytes.len() - 7)),
        (mesh, &["--hierarchy", &computed], 1, "signature"),
        (mesh, &["--hierarchy", "no-such-file"], 1, "no-such-file"),
        (mesh, &["--save-hierarchy", "no/such/folder/x"], 1, "there is no folder"),
    ];
    for (mesh, more, expected, part) in cases {
        let (code, object) = pmat(mesh, more);
        let error = object["error"].as_str().expect("an error");
        assert!(code == expected && error.contains(part), "{more:?}: {code}, {error}");
    }
    let (code, _, stderr) = run(&["simplify", mesh, "-m", "qmat", "--save-hierarchy", &all]);
    assert!(code == 2 && stderr.contains("no hierarchy"), "{code}, {stderr}");
    assert_eq!(fs::read(&all).expect("untouched"), bytes);
}

#[test]
fn voxels_are_written_in_three_formats() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = |name: &str| text_path(&dir.path().join(name)).to_owned();
    let aof = |more: &[&str]| {
        json(&[&["simplify", "builtin:plate", "-m", "aof", "--spheres", "200"], more].concat())
    };
    let (ply, npy, csv) = (at("v.ply"), at("v.npy"), at("v.csv"));
    for file in [&ply, &npy, &csv] {
        let (code, object) = aof(&["--voxels", file]);
        assert_eq!(code, 0, "{object}");
        let voxels = &object["voxels"];
        assert_eq!(voxels["count"], 200);
        assert_eq!(voxels["betti"], serde_json::json!([1, 0, 0]));
    }
    let read = |path: &str| fs::read(path).expect("written");
    let text = String::from_utf8(read(&csv)).expect("UTF-8");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("x,y,z,distance,flux,i,j,k"));
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(',').map(|word| word.parse().expect("a number")).collect())
        .collect();
    assert_eq!(rows.len(), 200);
    let numbers = |bytes: &[u8]| -> Vec<f64> {
        let number = |b: &[u8]| f64::from_le_bytes(b.try_into().expect("eight bytes"));
        bytes.chunks_exact(8).map(number).collect()
    };
    // The same numbers in all of them.
    let (npy, flat) = (read(&npy), rows.concat());
    assert_eq!(numbers(&npy[npy.len() - 8 * flat.len()..]), flat);
    assert_eq!((npy.len() - 8 * flat.len()) % 64, 0);
    let ply = read(&ply);
    let body = &ply[ply.len() - 200 * 52..];
    assert!(ply[..ply.len() - body.len()].ends_with(b"end_header\n"));
    for (row, expected) in body.chunks_exact(52).zip(&rows) {
        assert_eq!(numbers(&row[..40]), expected[..5]);
    }
    let (code, object) = aof(&["--voxels", &at("v.txt")]);
    assert!(code == 1 && object["error"].as_str().is_some_and(|e| e.contains(".csv")), "{object}");
    let (code, _, stderr) =
        run(&["simplify", "builtin:box", "-m", "qmat", "--voxels", &at("v.ply")]);
    assert!(code == 2 && stderr.contains("no voxels"), "{stderr}");
}

#[test]
fn max_error_is_met() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("x.ma");
    let (code, object) = json(&[
        "simplify",
        "builtin:capsule",
        "--method",
        "qmat",
        "--max-error",
        "0.02",
        "--samples",
        "3000",
        "-o",
        text_path(&path),
    ]);
    assert_eq!(code, 0, "{object}");
    let (_, evaluation) =
        json(&["evaluate", "builtin:capsule", text_path(&path), "--samples", "3000"]);
    assert!(evaluation["hausdorff"].as_f64().expect("a number") <= 0.02, "{evaluation}");
    assert!(object["spheres"].as_u64().expect("a count") < 200, "{object}");
    assert!(object["max_error"]["hausdorff"].as_f64().expect("a number") <= 0.02, "{object}");
    assert!(object["max_error"]["tried"].is_u64() && object["warnings"] == serde_json::json!([]));
}

#[test]
fn printed_results() {
    let (_, stdout, _) =
        run(&["simplify", "builtin:capsule", "--method", "qmat", "--spheres", "20"]);
    insta::assert_snapshot!("simplify", without_timings(&stdout));
    let (_, stdout, _) = run(&["axis", "builtin:capsule"]);
    insta::assert_snapshot!("axis", without_timings(&stdout));
}

#[allow(clippy::print_stderr, reason = "a skipped check must say so")]
/// Where the meshes that cannot be redistributed are, if they are.
fn shared_meshes() -> Option<PathBuf> {
    let folder = std::env::var_os("MEDIAL_MESHES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/meshes"),
        PathBuf::from,
    );
    if folder.join("bear.off").exists() {
        return Some(folder);
    }
    eprintln!("skipped: no meshes in {}", folder.display());
    None
}

#[test]
fn published_counts_and_errors_on_real_meshes() {
    let Some(folder) = shared_meshes() else { return };
    for (file, spheres) in [("bear.off", 34_703_i64), ("dolphin.off", 54_241)] {
        let mesh = folder.join(file);
        let (_, object) = json(&["axis", text_path(&mesh)]);
        let counted = object["spheres"].as_i64().expect("a count");
        assert!((counted - spheres).abs() <= 5, "{file}: {counted}, published {spheres}");
        assert_eq!(object["betti"], serde_json::json!([1, 0, 0]), "{file}");
    }
    let dir = tempfile::tempdir().expect("a folder");
    let (mesh, axis) = (folder.join("bear.off"), dir.path().join("bear.ma"));
    let (mesh, axis) = (text_path(&mesh), text_path(&axis));
    json(&["simplify", mesh, "--method", "qmat", "--spheres", "100", "-o", axis]);
    let (_, object) = json(&["evaluate", mesh, axis]);
    let hausdorff = object["hausdorff"].as_f64().expect("a number");
    assert!(hausdorff <= 0.0155, "{hausdorff}");
    assert_eq!(object["betti"], serde_json::json!([1, 0, 0]));
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

#[test]
fn absurd_requests_are_refused_at_once() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = |name: &str| text_path(&dir.path().join(name)).to_owned();
    let (ball, huge, nowhere) = (at("ball.ma"), at("huge.ma"), at("no/such/folder/x.ma"));
    fs::write(&ball, "1 0 0\nv 0 0 0 1\n").expect("written");
    fs::write(&huge, "1 0 0\nv 0 0 0 1e200\n").expect("written");
    let mesh = "builtin:sphere:8";
    let cases: [(&[&str], i32, &str); 9] = [
        (&["info", mesh, "--threads", "100000"], 2, "1024"),
        (&["evaluate", mesh, &ball, "--samples", "99999999999"], 2, "10000000"),
        (&["evaluate", mesh, &ball, "--certify", "1e-9"], 2, "1e-6"),
        (&["evaluate", mesh, &huge], 1, "huge.ma: sphere 0"),
        (&["simplify", mesh, "-m", "qmat", "-o", &nowhere], 1, "there is no folder"),
        (&["simplify", mesh, "-m", "qmat", "-o", "x.xyz"], 1, "\"xyz\" is not one of"),
        (&["simplify", mesh, "-m", "qmat", "--max-error", "inf"], 2, "inf"),
        (&["simplify", mesh, "-m", "qmat", "--set", "k=x"], 2, "k = \"x\""),
        (&["simplify", "builtin:nothing", "-m", "qmat"], 2, "`nothing`"),
    ];
    for (arguments, expected, part) in cases {
        let (code, _, stderr) = run(arguments);
        assert!(code == expected && stderr.contains(part), "{arguments:?}: {code}, {stderr}");
    }
}

#[test]
fn published_tables_are_repeated_or_say_what_is_missing() {
    let (code, list, _) = run(&["paper"]);
    assert_eq!(code, 0);
    insta::assert_snapshot!("paper_list", list);

    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("paper.md");
    let arguments = ["paper", "qmat-figure-15", "--samples", "500", "-o", text_path(&report)];
    let (code, object) = json(&arguments);
    assert_eq!(code, 0);
    let exhibit = &object["exhibits"][0];
    assert_eq!(exhibit["rows"][0]["ours"]["spheres"], 1.0);
    assert_eq!(exhibit["verdicts"][0]["holds"], true);
    let text = fs::read_to_string(&report).unwrap();
    assert!(text.contains("| Sphere | builtin:sphere:16 | 7,156 |"), "{text}");

    let empty = text_path(folder.path());
    let (code, stdout, _) = run(&["paper", "qmat-table-2", "--meshes", empty, "--quiet"]);
    assert_eq!(code, 5);
    assert!(stdout.contains("bear.off is not there: see --meshes"), "{stdout}");
    assert_eq!(run(&["paper", "nothing"]).0, 2);
}

#[test]
fn published_noise_can_be_measured_against_the_clean_surface() {
    let (code, object) = json(&["paper", "chazal-noise", "--samples", "200", "--quiet"]);
    assert_eq!(code, 0, "{object}");
    for row in object["exhibits"][0]["rows"].as_array().expect("rows") {
        let ours = |key: &str| row["ours"][key].as_f64().expect("measured");
        // The axis of a noisy surface is another, and a filter keeps what noise moves little.
        assert!(0.0 < ours("to") && ours("to") < ours("whole_to"), "{row}");
    }
}
