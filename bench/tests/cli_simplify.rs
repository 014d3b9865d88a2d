//! The verbs for one mesh as their users meet them.

use std::fs;

mod command;
use command::{json, run, text_path};

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
    for key in "spheres edges faces isolated euler betti expected_betti samples sampling seed seconds cpu_seconds peak_bytes".split(' ') {
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
        for key in "epsilon epsilon_union reverse hausdorff mean rms p95 p99 reverse_mean spheres_only volume_error quality spikes betti euler expected_betti counts diagonal samples seed".split(' ') {
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
fn a_wrong_topology_is_said() {
    // One ball where the solid has a tunnel.
    let (code, object) = json(&["simplify", "builtin:torus", "-m", "lambda", "--spheres", "1"]);
    assert!(code == 0 && object["warnings"].to_string().contains("1 tunnel missing"), "{object}");
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
        (mesh, &["--hierarchy", &cut], 1, "cut.hierarchy: not a file of a hierarchy: EOF"),
        (mesh, &["--hierarchy", &computed], 1, "not a file of a hierarchy"),
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
fn voxels_are_written_in_two_formats() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = |name: &str| text_path(&dir.path().join(name)).to_owned();
    let aof = |more: &[&str]| {
        json(&[&["simplify", "builtin:plate", "-m", "aof", "--spheres", "200"], more].concat())
    };
    let (ply, csv) = (at("v.ply"), at("v.csv"));
    for file in [&ply, &csv] {
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
    // The same numbers in both.
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
fn published_counts_and_errors_on_real_meshes() {
    let Some(folder) = medial_test_support::meshes() else { return };
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
