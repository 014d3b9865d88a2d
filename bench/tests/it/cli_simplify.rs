//! The verbs for one mesh: `axis`, `simplify`, `evaluate`, `convert`.

use serde_json::json;

use crate::command::{Folder, number};

#[test]
fn axis_simplify_evaluate_convert() {
    let at = Folder::new();
    at.done("datasets make box -o box.off");

    let (code, object) = at.json("axis box.off -o axis.ma");
    assert_eq!(code, 0);
    for key in "spheres edges faces isolated euler betti expected_betti samples sampling seed seconds cpu_seconds peak_bytes".split(' ') {
        assert!(object.get(key).is_some(), "{key} is missing in {object}");
    }
    for stage in ["read", "delaunay", "inside", "extract", "total"] {
        assert!(object["seconds"][stage].is_f64(), "{stage} is missing in {object}");
    }
    assert_eq!(object["betti"], object["expected_betti"]);

    for method in ["qmat", "pmat", "hem", "sat-pairwise", "angle", "lambda"] {
        let line = format!("simplify box.off --method {method} --spheres 60 -o simple.ma");
        let (code, object) = at.json(&line);
        assert_eq!(code, 0, "{object}");
        assert_eq!(object["status"], "ok");
        assert_eq!(object["spheres"], 60);
        assert_eq!(object["level"]["spheres"], 60);
        let (code, object) = at.json("evaluate box.off simple.ma --samples 2000");
        assert_eq!(code, 0);
        for key in "epsilon epsilon_union reverse hausdorff mean rms p95 p99 reverse_mean spheres_only volume_error quality spikes betti euler expected_betti counts diagonal samples seed".split(' ') {
            assert!(object.get(key).is_some(), "{key} is missing in {object}");
        }
        let [hausdorff, there, back] =
            ["hausdorff", "epsilon_union", "reverse"].map(|key| number(&object[key]));
        assert_eq!(hausdorff, there.max(back));
    }

    let (code, object) = at.json("evaluate box.off simple.ma --samples 2000 --certify 1e-3");
    assert_eq!(code, 0);
    let [lower, upper] = ["lower", "upper"].map(|key| number(&object["certified"][key]));
    assert!(lower > 0.0 && upper - lower <= 1e-3, "{object}");
    assert!(number(&object["hausdorff"]) <= upper, "{object}");

    let [published, default] = ["--level published", ""].map(|level| {
        at.json(&format!("simplify box.off --method angle {level} -o angle.ma"));
        at.text("angle.ma")
    });
    assert_eq!(published, default);
    let line = "simplify box.off --method angle --level usual";
    at.refused(line, 2, "expected a number or `published`");

    let from_file = "simplify box.off --method qmat --spheres 60 --initial axis.ma";
    assert_eq!(at.json(from_file).1["spheres"], 60);
    at.done("convert simple.ma simple.ply");
    at.done("convert simple.ply axis.ma");
    assert_eq!(at.text("axis.ma"), at.text("simple.ma"));
    at.refused("convert box.off simple.ma", 2, "compute one by `medial axis ");
    at.done("convert simple.ma simple.glb");
    at.refused("convert simple.glb axis.ma", 1, "unknown extension \"glb\"");
}

#[test]
fn a_wrong_topology_gives_a_warning() {
    // One ball where the solid has a tunnel.
    let (code, object) = Folder::new().json("simplify builtin:torus -m lambda --spheres 1");
    assert!(code == 0 && object["warnings"].to_string().contains("1 tunnel missing"), "{object}");
}

#[test]
fn several_files_give_one_table() {
    let at = Folder::new();
    for (file, spheres) in [("fine.ma", 40), ("coarse.ma", 10)] {
        at.done(&format!("simplify builtin:box:8 -m qmat --spheres {spheres} -o {file}"));
    }
    let line = |files: &str| format!("evaluate builtin:box:8 --samples 500 {files}");
    let evaluate = |files: &str| at.json(&line(files));
    let (code, both) = evaluate("fine.ma coarse.ma");
    assert_eq!(code, 0, "{both}");
    for (row, file) in ["fine.ma", "coarse.ma"].into_iter().enumerate() {
        let row = &both["files"][row];
        assert_eq!(row["file"], file);
        assert_eq!(row["hausdorff"], evaluate(file).1["hausdorff"], "the same as alone");
    }
    let stdout = at.done(&line("fine.ma coarse.ma"));
    let line = |name: &str| stdout.lines().find(|l| l.starts_with(name)).expect("a row").to_owned();
    assert!(line("spheres").ends_with("40         10"), "{stdout}");
    assert!(stdout.lines().next().is_some_and(|head| head.ends_with("fine.ma  coarse.ma")));

    // A file that cannot be read is reported, and the others are evaluated.
    at.write("bad.ma", "1 0 0\nv 0 0\n");
    let (code, object) = evaluate("bad.ma coarse.ma");
    assert_eq!(code, 3, "{object}");
    assert!(object["files"][0]["refused"].as_str().is_some_and(|why| why.contains("bad.ma")));
    assert!(object["files"][1]["hausdorff"].is_f64());
    assert_eq!(evaluate("bad.ma bad.ma").0, 1);
}

#[test]
fn max_error_is_met() {
    let at = Folder::new();
    let line = "simplify builtin:capsule -m qmat --max-error 0.02 -o x.ma --samples 3000";
    let (code, object) = at.json(line);
    assert_eq!(code, 0, "{object}");
    let (_, evaluation) = at.json("evaluate builtin:capsule x.ma --samples 3000");
    assert!(number(&evaluation["hausdorff"]) <= 0.02, "{evaluation}");
    assert!(object["spheres"].as_u64().expect("a count") < 200, "{object}");
    assert!(number(&object["max_error"]["hausdorff"]) <= 0.02, "{object}");
    assert!(object["max_error"]["tried"].is_u64() && object["warnings"] == json!([]));
}

/// A list of spheres has another error than the medial mesh that was measured.
#[test]
fn an_error_bound_is_that_of_the_written_file() {
    let at = Folder::new();
    let line = "simplify builtin:box:8 --max-error 0.1 --samples 500 -o x.csv -m";
    // Continuing levels and others.
    for method in ["qmat", "vmas"] {
        at.refused(&format!("{line} {method}"), 2, "write .ma, or name --method cover");
    }
    assert!(!at.has("x.csv"));
    at.done(&format!("{line} cover"));
    let (_, object) = at.json("evaluate builtin:box:8 x.csv --samples 500");
    assert!(number(&object["hausdorff"]) <= 0.1, "{object}");
}

/// Coarse results, whose radii fit other scales and shifts as well.
#[test]
fn exact_units_come_first_where_the_boxes_fit() {
    let at = Folder::new();
    for (method, spheres, scale, shift, source) in [
        ("qmat", 20, 25.4, 0.0, "factor"),
        ("qmat", 20, 1e-3, 0.0, "factor"),
        ("vmas", 30, 1.7, 3.0, "fitted"),
    ] {
        at.done(&format!("simplify builtin:plate -m {method} --spheres {spheres} -o x.ma"));
        let text = at.text("x.ma");
        let line = |line: &str| match line.strip_prefix("v ") {
            None => line.to_owned() + "\n",
            Some(numbers) => {
                let numbers = numbers.split(' ').map(|n| n.parse::<f64>().expect("a number"));
                let [x, y, z, r] = numbers.collect::<Vec<_>>()[..] else { panic!("{line}") };
                let [x, y, z] = [x, y, z].map(|c| c * scale + shift);
                format!("v {x} {y} {z} {}\n", r * scale)
            }
        };
        at.write("y.ma", text.lines().map(line).collect::<String>());
        let (_, object) = at.json("evaluate builtin:plate y.ma --fit auto");
        let fit = &object["fit"];
        assert_eq!(fit["source"], source, "{object}");
        let back = number(&fit["similarity"]["scale"]) * scale;
        assert!((back - 1.0).abs() < if source == "factor" { 1e-12 } else { 0.1 }, "{fit}");
    }
}

/// The Hausdorff error of 100 spheres by Q-MAT is at most `most`, and the Betti numbers are those of the solid.
#[track_caller]
fn check_qmat(mesh: &str, most: f64, betti: [u32; 3]) {
    let at = Folder::new();
    at.json(&format!("simplify {mesh} --method qmat --spheres 100 -o axis.ma"));
    let (_, object) = at.json(&format!("evaluate {mesh} axis.ma"));
    assert!(number(&object["hausdorff"]) <= most, "{mesh}: {object}");
    assert_eq!(object["betti"], json!(betti), "{mesh}");
}

#[test]
fn errors_and_topology_on_free_meshes() {
    let folder = medial_test_support::free_meshes();
    // The errors are a tenth above those measured.
    for (name, most, betti) in
        [("body", 0.011, [1, 0, 0]), ("figure", 0.008, [1, 2, 0]), ("part", 0.116, [1, 8, 0])]
    {
        check_qmat(&format!("{}/{name}.off", folder.display()), most, betti);
    }
}

#[test]
fn published_counts_and_errors_on_real_meshes() {
    let Some(meshes) = medial_test_support::meshes() else { return };
    for (file, spheres) in [("bear.off", 34_703_i64), ("dolphin.off", 54_241)] {
        let mesh = meshes.join(file);
        let line = format!("axis {} --sampling vertices", mesh.display());
        let (_, object) = Folder::new().json(&line);
        let counted = object["spheres"].as_i64().expect("a count");
        assert!((counted - spheres).abs() <= 5, "{file}: {counted}, published {spheres}");
        assert_eq!(object["betti"], json!([1, 0, 0]), "{file}");
    }
    check_qmat(&meshes.join("bear.off").display().to_string(), 0.0155, [1, 0, 0]);
}

/// Distances to a reference are those between two sets of points: zero to itself, the same both ways.
#[test]
fn a_reference_is_compared_as_a_set_of_points() {
    let at = Folder::new();
    for (spheres, file) in [(60, "fine.ma"), (20, "coarse.ma")] {
        at.done(&format!("simplify builtin:torus -m qmat --spheres {spheres} -o {file}"));
    }
    let to = |file: &str, reference: &str| {
        let line = format!("evaluate builtin:torus {file} --samples 500 --reference {reference}");
        let (code, object) = at.json(&line);
        assert_eq!(code, 0, "{object}");
        let keys = ["chamfer", "computed_to_true_max", "true_to_computed_max"];
        keys.map(|key| number(&object["axis"][key]))
    };
    assert!(to("fine.ma", "fine.ma").into_iter().all(|distance| distance < 1e-12));
    let (there, back) = (to("coarse.ma", "fine.ma"), to("fine.ma", "coarse.ma"));
    assert_eq!([there[0], there[1], there[2]], [back[0], back[2], back[1]]);
    // A polygon of 20 corners is off the finer one by the height of its arcs.
    assert!(there[0] > 1e-8 && there[0] < 1e-4 && there[1] < 0.02, "{there:?}");
}

/// A ball within a ball covers the cube of the ratio of radii, one around it the whole.
#[test]
fn covered_and_outside_volume_are_those_of_balls() {
    let at = Folder::new();
    for (radius, covered, outside) in [(0.5, 12.5, 0.0), (1.5, 100.0, 237.5)] {
        at.write("ball.ma", format!("1 0 0\nv 0 0 0 {radius}\n"));
        let text = at.done("evaluate builtin:sphere:64 ball.ma --samples 500 --all");
        let value = |name: &str| -> f64 {
            let line = text.lines().find(|line| line.trim_start().starts_with(name));
            let word = line.and_then(|line| line.split_whitespace().last()).expect(name);
            word.parse().expect("a number")
        };
        // Of the octree's finest cells and of the facets of the sphere.
        assert!((value("covered volume") - covered).abs() < 2.0, "{radius}: {text}");
        assert!(
            (value("volume outside") - outside).abs() < 0.02 * (outside + 50.0),
            "{radius}: {text}"
        );
    }
}
