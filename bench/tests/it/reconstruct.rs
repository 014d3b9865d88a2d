//! `medial reconstruct`: surfaces of medial meshes, and refused requests.

use serde_json::Value;

use crate::command::{Folder, number};

/// Checks the output of both methods, and that `medial info` agrees.
fn check(at: &Folder, object: &Value, output: &str, genus: u64) {
    let keys = "method vertices faces closed manifold genus components tolerance seconds cpu_seconds peak_bytes";
    for key in keys.split(' ') {
        assert!(!object[key].is_null(), "{key} is missing in {object}");
    }
    assert!(object["seconds"]["total"].is_f64(), "{object}");
    assert_eq!((&object["closed"], &object["manifold"]), (&true.into(), &true.into()), "{object}");
    assert_eq!((&object["genus"], &object["components"]), (&genus.into(), &1.into()), "{object}");
    let (code, info) = at.json(&format!("info {output}"));
    assert_eq!(code, 0, "{info}");
    assert_eq!(info["genus"], object["genus"]);
}

#[test]
fn both_methods_reconstruct_a_torus() {
    let at = Folder::new();
    at.done("simplify builtin:torus -m qmat --spheres 100 -o x.ma");
    let union = "reconstruct x.ma -o union.ply --mesh builtin:torus --tolerance 0.03";
    let (code, object) = at.json(union);
    assert_eq!((code, &object["method"]), (0, &"union".into()), "{object}");
    check(&at, &object, "union.ply", 1);
    assert!(number(&object["faces_to_union"]) < 0.03, "{object}");
    assert!(number(&object["deviation"]["max"]) < 0.1, "{object}");

    let crust = "reconstruct -o crust.off --mesh builtin:torus --method power-crust";
    let (code, object) = at.json(&format!("{crust} --sampling blue:3000"));
    assert_eq!((code, &object["method"]), (0, &"power-crust".into()), "{object}");
    check(&at, &object, "crust.off", 1);
    assert!(number(&object["deviation"]["max"]) < 0.005, "{object}");

    // The spheres of a file instead of the inner poles.
    at.done("axis builtin:torus -o all.ma");
    let (code, object) = at.json(&format!("{crust} all.ma"));
    assert_eq!(code, 0, "{object}");
    check(&at, &object, "crust.off", 1);
    assert!(at.done(&format!("{crust} all.ma")).contains("genus 1"));
}

/// The axis of a box has spheres of radius 0 in its corners, smaller than any spacing of balls.
#[test]
fn the_union_of_a_connected_mesh_is_connected() {
    let at = Folder::new();
    for mesh in ["builtin:box:8", "builtin:bracket"] {
        at.done(&format!("axis {mesh} -o x.ma"));
        let (code, object) = at.json("reconstruct x.ma -o x.ply");
        assert_eq!((code, &object["union_betti"][0]), (0, &1.into()), "{object}");
    }
}

/// A thin ring, whose hole a coarse surface closes, and a ball without such details.
#[test]
fn the_tolerance_is_as_coarse_as_the_topology_allows() {
    let at = Folder::new();
    let made = |medial_mesh: &str| {
        at.write("x.ma", medial_mesh);
        let (code, object) = at.json("reconstruct x.ma -o x.ply");
        assert_eq!(code, 0, "{object}");
        assert_eq!(object["betti"], object["union_betti"], "{object}");
        number(&object["tolerance"])
    };
    assert_eq!(made("1 0 0\nv 0 0 0 1\n"), 0.04);
    assert!(made(&ring(32, 0.97)) < 0.04);
}

/// A medial mesh of balls of this radius on a circle of radius 1, each joined to the next.
fn ring(count: u32, radius: f64) -> String {
    let corner = |k: u32| (std::f64::consts::TAU * f64::from(k) / f64::from(count)).sin_cos();
    let v = (0..count).map(|k| format!("v {} {} 0 {radius}\n", corner(k).0, corner(k).1));
    let e = (0..count).map(|k| format!("e {k} {}\n", (k + 1) % count));
    format!("{count} {count} 0\n{}{}", v.collect::<String>(), e.collect::<String>())
}

/// Faces of tiny coordinates were inside out.
#[test]
fn the_unit_of_the_coordinates_changes_the_surface_by_its_scale_alone() {
    let at = Folder::new();
    let made = |unit: i32| {
        let v = |x: f64| format!("v {x}e{unit} 0 0 1e{unit}\n");
        at.write("x.ma", format!("2 1 0\n{}{}e 0 1\n", v(0.0), v(3.0)));
        let (code, mut object) = at.json("reconstruct x.ma -o x.ply");
        assert_eq!((code, &object["warnings"]), (0, &serde_json::json!([])), "{object}");
        let diagonal = number(&object["diagonal"]);
        assert!((diagonal / 33f64.sqrt() / 10f64.powi(unit) - 1.0).abs() < 1e-9, "{object}");
        let faces = number(&object["faces"]);
        (faces, ["closed", "tolerance", "betti", "union_betti"].map(|key| object[key].take()))
    };
    let (faces, expected) = made(0);
    for unit in [-290, -160, -110, 100] {
        // Powers of ten are rounded, and so few cells lie on the other side.
        let (count, found) = made(unit);
        assert_eq!(found, expected, "1e{unit}");
        assert!((count / faces - 1.0).abs() < 0.01, "1e{unit}: {count} for {faces}");
    }
}

#[test]
fn requests_without_a_surface_are_refused() {
    let at = Folder::new();
    for (name, text) in [
        ("ball.ma", "1 0 0\nv 0 0 0 1\n"),
        ("empty.ma", "0 0 0\n"),
        ("points.ma", "2 1 0\nv 0 0 0 0\nv 1 0 0 0\ne 0 1\n"),
        ("specks.ma", "2 0 0\nv 0 0 0 1e-4\nv 1 0 0 1e-4\n"),
        ("dust.ma", "2 0 0\nv 0 0 0 1e-300\nv 1 0 0 1e-300\n"),
        ("below.ma", "2 0 0\nv 0 0 0 1e-320\nv 1 0 0 1e-320\n"),
        ("sheet.ma", "3 3 1\nv 0 0 0 0\nv 1 0 0 1e-6\nv 0 1 0 0\ne 0 1\ne 1 2\ne 0 2\nf 0 1 2\n"),
        ("huge.ma", "1 0 0\nv 0 0 0 1e200\n"),
        ("far.ma", "1 0 0\nv 1e15 0 0 1\n"),
        ("grown.ma", "1 0 0\nv 0 0 0 100\n"),
        ("units.ma", "1 0 0\nv 0 0 0 1000\n"),
        // Two lone spheres and a point.
        ("lone.ma", "3 0 0\nv 0 0 0 1\nv 5 0 0 1\nv 9 0 0 0\n"),
        // A hole that is much narrower than the tolerance.
        ("ring.ma", &ring(6, 0.85)),
    ] {
        at.write(name, text);
    }
    let mesh = "--mesh builtin:sphere:8";
    for (words, expected, part) in [
        ("ball.ma -o x.step", 1, "(found \"step\", expected one of .ply"),
        ("ball.ma -o no/such/x.ply", 1, "the folder does not exist; create it by `mkdir -p"),
        ("no-such.ma -o x.ply", 1, "no-such.ma"),
        ("ball.ma -o x.ply --method power-crust", 2, "--mesh MESH"),
        ("-o x.ply", 2, "--method power-crust"),
        ("ball.ma -o x.ply --tolerance 0", 2, "--tolerance <FRACTION>"),
        ("ball.ma -o x.ply --tolerance 1e-7", 1, "tetrahedra); give a tolerance of"),
        ("empty.ma -o x.ply", 1, "empty.ma"),
        ("points.ma -o x.ply", 1, "points.ma: all spheres have radius zero"),
        ("specks.ma -o x.ply", 1, "specks.ma: every sphere is too thin"),
        ("dust.ma -o x.ply", 1, "dust.ma: too thin for its extent"),
        ("below.ma -o x.ply", 1, "below.ma: all spheres have radius zero, or below 2.2e-308"),
        ("sheet.ma -o x.ply", 1, "sheet.ma: too thin for its extent"),
        ("sheet.ma -o x.ply --tolerance 1e-5", 1, "give larger radii"),
        ("huge.ma -o x.ply", 1, "huge.ma"),
        (&format!("far.ma -o x.ply --method power-crust {mesh}"), 1, "far.ma"),
        // In diagonals of the mesh so fine a surface of it would be too large.
        (&format!("grown.ma -o x.ply {mesh}"), 1, "grown.ma"),
    ] {
        at.refused(&format!("reconstruct {words}"), expected, part);
        assert!(!at.has("x.ply"), "{words} wrote a file");
    }
    let (code, object) = at.json(&format!("reconstruct grown.ma {mesh} -o x.ply --tolerance 1"));
    let warnings = object["warnings"].to_string();
    assert!(code == 0 && warnings.contains("check surface and units"), "{object}");

    // No tolerance is coarse enough for spheres in other units, and each is refused in these words.
    for tolerance in ["0.001", "0.02", "1"] {
        let why = "no tolerance works; check the units of the medial mesh";
        let line = format!("reconstruct units.ma {mesh} -o x.ply --tolerance {tolerance}");
        at.refused(&line, 1, why);
        let picture = "render builtin:sphere:8 units.ma --show error -o x.png";
        at.refused(&format!("{picture} --tolerance {tolerance}"), 2, why);
    }
    // Advice is enough for the next request.
    for (name, first) in [("ball.ma", "1e-7"), ("specks.ma", "1"), ("grown.ma", "1e-7")] {
        let run = |tolerance: &str| {
            at.run(&format!("reconstruct {name} {mesh} -o x.ply --tolerance {tolerance}"))
        };
        let mut tolerance = first.to_owned();
        for _ in 0..2 {
            let (code, _, stderr) = run(&tolerance);
            let Some((_, advice)) = stderr.split_once("give a tolerance of ") else {
                assert_eq!(code, 0, "{stderr}");
                break;
            };
            tolerance = advice.split_whitespace().next().expect("a number").to_owned();
        }
        assert_eq!(run(&tolerance).0, 0, "{name}: {tolerance}");
    }

    let (code, object) = at.json("reconstruct ring.ma -o x.ply --tolerance 0.05");
    assert_eq!((code, &object["union_betti"]), (0, &serde_json::json!([1, 1, 0])), "{object}");
    assert_eq!(object["betti"], serde_json::json!([1, 0, 0]), "{object}");
    assert!(object["warnings"].to_string().contains("give a smaller tolerance"), "{object}");

    let (code, object) = at.json("reconstruct lone.ma -o x.ply");
    assert_eq!((code, &object["components"], &object["lost"]), (0, &2.into(), &1.into()));
    assert!(object["warnings"][0].as_str().is_some_and(|w| w.contains("1 sphere")), "{object}");
}
