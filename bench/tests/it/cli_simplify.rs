//! The verbs for one mesh: `axis`, `simplify`, `evaluate`, `convert`.

use std::fs;

use crate::command::{done, folder, json, refused, text_path, words};

#[test]
fn axis_simplify_evaluate_convert() {
    let at = folder();
    let paths = ["box.off", "axis.ma", "simple.ma", "simple.ply"].map(&at);
    let [mesh, axis, simple, ply] = paths.each_ref().map(String::as_str);
    done(&["datasets", "make", "box", "-o", mesh]);

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
    done(&["convert", simple, ply]);
    done(&["convert", ply, axis]);
    assert_eq!(fs::read(axis).expect("read"), fs::read(simple).expect("read"));
    refused(&["convert", mesh, simple], 2, "compute one by `medial axis ");
}

#[test]
fn a_wrong_topology_gives_a_warning() {
    // One ball where the solid has a tunnel.
    let (code, object) = json(&["simplify", "builtin:torus", "-m", "lambda", "--spheres", "1"]);
    assert!(code == 0 && object["warnings"].to_string().contains("1 tunnel missing"), "{object}");
}

#[test]
fn several_files_give_one_table() {
    let at = folder();
    let (fine, coarse, bad) = (at("fine.ma"), at("coarse.ma"), at("bad.ma"));
    for (file, spheres) in [(&fine, "40"), (&coarse, "10")] {
        done(&["simplify", "builtin:box:8", "-m", "qmat", "--spheres", spheres, "-o", file]);
    }
    let evaluate = ["evaluate", "builtin:box:8", "--samples", "500"];
    let alone = |file: &str| json(&[&evaluate[..], &[file]].concat()).1;
    let (code, both) = json(&[&evaluate[..], &[&fine, &coarse]].concat());
    assert_eq!(code, 0, "{both}");
    for (row, file) in [&fine, &coarse].into_iter().enumerate() {
        let row = &both["files"][row];
        assert_eq!(row["file"], file.as_str());
        assert_eq!(row["hausdorff"], alone(file)["hausdorff"], "the same as alone");
    }
    let stdout = done(&[&evaluate[..], &[&fine, &coarse]].concat());
    let line = |name: &str| stdout.lines().find(|l| l.starts_with(name)).expect("a row").to_owned();
    assert!(line("spheres").ends_with("40         10"), "{stdout}");
    assert!(stdout.lines().next().is_some_and(|head| head.ends_with("fine.ma  coarse.ma")));

    // A file that cannot be read is reported, and the others are evaluated.
    fs::write(&bad, "1 0 0\nv 0 0\n").expect("written");
    let (code, object) = json(&[&evaluate[..], &[&bad, &coarse]].concat());
    assert_eq!(code, 3, "{object}");
    assert!(object["files"][0]["refused"].as_str().is_some_and(|why| why.contains("bad.ma")));
    assert!(object["files"][1]["hausdorff"].is_f64());
    assert_eq!(json(&[&evaluate[..], &[&bad, &bad]].concat()).0, 1);
}

#[test]
fn max_error_is_met() {
    let at = folder();
    let path = at("x.ma");
    let words = ["simplify", "builtin:capsule", "-m", "qmat", "--max-error", "0.02", "-o", &path];
    let (code, object) = json(&[&words[..], &["--samples", "3000"]].concat());
    assert_eq!(code, 0, "{object}");
    let (_, evaluation) = json(&["evaluate", "builtin:capsule", &path, "--samples", "3000"]);
    assert!(evaluation["hausdorff"].as_f64().expect("a number") <= 0.02, "{evaluation}");
    assert!(object["spheres"].as_u64().expect("a count") < 200, "{object}");
    assert!(object["max_error"]["hausdorff"].as_f64().expect("a number") <= 0.02, "{object}");
    assert!(object["max_error"]["tried"].is_u64() && object["warnings"] == serde_json::json!([]));
}

/// A list of spheres has another error than the medial mesh that was measured.
#[test]
fn an_error_bound_is_that_of_the_written_file() {
    let at = folder();
    let path = at("x.csv");
    let words =
        ["simplify", "builtin:box:8", "--max-error", "0.1", "--samples", "500", "-o", &path];
    // Continuing levels and others.
    for method in ["qmat", "vmas"] {
        refused(&[&words[..], &["-m", method]].concat(), 2, "write .ma, or name --method cover");
    }
    assert!(fs::metadata(&path).is_err());
    done(&[&words[..], &["-m", "cover"]].concat());
    let (_, object) = json(&["evaluate", "builtin:box:8", &path, "--samples", "500"]);
    assert!(object["hausdorff"].as_f64().expect("a number") <= 0.1, "{object}");
}

/// Coarse results, whose radii fit other scales and shifts as well.
#[test]
fn exact_units_come_first_where_the_boxes_fit() {
    let at = folder();
    let (mesh, other) = (at("x.ma"), at("y.ma"));
    for (method, spheres, scale, shift, source) in [
        ("qmat", "20", 25.4, 0.0, "factor"),
        ("qmat", "20", 1e-3, 0.0, "factor"),
        ("vmas", "30", 1.7, 3.0, "fitted"),
    ] {
        done(&["simplify", "builtin:plate", "-m", method, "--spheres", spheres, "-o", &mesh]);
        let text = fs::read_to_string(&mesh).expect("read");
        let line = |line: &str| match line.strip_prefix("v ") {
            None => line.to_owned() + "\n",
            Some(numbers) => {
                let numbers =
                    words(numbers).into_iter().map(|n| n.parse::<f64>().expect("a number"));
                let [x, y, z, r] = numbers.collect::<Vec<_>>()[..] else { panic!("{line}") };
                let [x, y, z] = [x, y, z].map(|c| c * scale + shift);
                format!("v {x} {y} {z} {}\n", r * scale)
            }
        };
        fs::write(&other, text.lines().map(line).collect::<String>()).expect("written");
        let (_, object) = json(&["evaluate", "builtin:plate", &other, "--fit", "auto"]);
        let fit = &object["fit"];
        assert_eq!(fit["source"], source, "{object}");
        let back = fit["similarity"]["scale"].as_f64().expect("a scale") * scale;
        assert!((back - 1.0).abs() < if source == "factor" { 1e-12 } else { 0.1 }, "{fit}");
    }
}

#[test]
fn errors_and_topology_on_free_meshes() {
    let at = folder();
    // The errors are a tenth above those measured.
    for (name, most, betti) in
        [("body", 0.011, [1, 0, 0]), ("figure", 0.008, [1, 2, 0]), ("part", 0.116, [1, 8, 0])]
    {
        let mesh = medial_test_support::free_meshes().join(format!("{name}.off"));
        let (mesh, axis) = (text_path(&mesh), &at(&format!("{name}.ma")));
        json(&["simplify", mesh, "--method", "qmat", "--spheres", "100", "-o", axis]);
        let (_, object) = json(&["evaluate", mesh, axis]);
        let hausdorff = object["hausdorff"].as_f64().expect("a number");
        assert!(hausdorff <= most, "{name}: {hausdorff}");
        assert_eq!(object["betti"], serde_json::json!(betti), "{name}");
    }
}

#[test]
fn published_counts_and_errors_on_real_meshes() {
    let Some(meshes) = medial_test_support::meshes() else { return };
    for (file, spheres) in [("bear.off", 34_703_i64), ("dolphin.off", 54_241)] {
        let mesh = meshes.join(file);
        let (_, object) = json(&["axis", text_path(&mesh), "--sampling", "vertices"]);
        let counted = object["spheres"].as_i64().expect("a count");
        assert!((counted - spheres).abs() <= 5, "{file}: {counted}, published {spheres}");
        assert_eq!(object["betti"], serde_json::json!([1, 0, 0]), "{file}");
    }
    let (at, mesh) = (folder(), meshes.join("bear.off"));
    let (mesh, axis) = (text_path(&mesh), &at("bear.ma"));
    json(&["simplify", mesh, "--method", "qmat", "--spheres", "100", "-o", axis]);
    let (_, object) = json(&["evaluate", mesh, axis]);
    let hausdorff = object["hausdorff"].as_f64().expect("a number");
    assert!(hausdorff <= 0.0155, "{hausdorff}");
    assert_eq!(object["betti"], serde_json::json!([1, 0, 0]));
}
