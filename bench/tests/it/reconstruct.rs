//! `medial reconstruct`: surfaces of medial meshes, and refused requests.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::command::{done, folder, json, refused, run};

/// Checks the output of both methods, and that `medial info` agrees.
fn check(object: &Value, output: &str, genus: u64) {
    let keys = "method vertices faces closed manifold genus components tolerance seconds cpu_seconds peak_bytes";
    for key in keys.split(' ') {
        assert!(!object[key].is_null(), "{key} is missing in {object}");
    }
    assert!(object["seconds"]["total"].is_f64(), "{object}");
    assert_eq!((&object["closed"], &object["manifold"]), (&true.into(), &true.into()), "{object}");
    assert_eq!((&object["genus"], &object["components"]), (&genus.into(), &1.into()), "{object}");
    let (code, info) = json(&["info", output]);
    assert_eq!(code, 0, "{info}");
    assert_eq!(info["genus"], object["genus"]);
}

#[test]
fn both_methods_reconstruct_a_torus() {
    let at = folder();
    let (axis, mesh) = (at("x.ma"), "builtin:torus");
    done(&["simplify", mesh, "-m", "qmat", "--spheres", "100", "-o", &axis]);

    let union = at("union.ply");
    let (code, object) =
        json(&["reconstruct", &axis, "-o", &union, "--mesh", mesh, "--tolerance", "0.03"]);
    assert_eq!((code, &object["method"]), (0, &"union".into()), "{object}");
    check(&object, &union, 1);
    assert!(object["faces_to_union"].as_f64().expect("a number") < 0.03, "{object}");
    assert!(object["deviation"]["max"].as_f64().expect("a number") < 0.1, "{object}");

    let crust = at("crust.off");
    let words = ["reconstruct", "-o", &crust, "--mesh", mesh, "--method", "power-crust"];
    let (code, object) = json(&[&words[..], &["--sampling", "blue:3000"]].concat());
    assert_eq!((code, &object["method"]), (0, &"power-crust".into()), "{object}");
    check(&object, &crust, 1);
    assert!(object["deviation"]["max"].as_f64().expect("a number") < 0.005, "{object}");

    // The spheres of a file instead of the inner poles.
    let all = at("all.ma");
    done(&["axis", mesh, "-o", &all]);
    let (code, object) = json(&[&words[..], &[&all]].concat());
    assert_eq!(code, 0, "{object}");
    check(&object, &crust, 1);
    assert!(done(&[&words[..], &[&all]].concat()).contains("genus 1"));
}

/// The axis of a box has spheres of radius 0 in its corners, smaller than any spacing of balls.
#[test]
fn the_union_of_a_connected_mesh_is_connected() {
    let at = folder();
    for mesh in ["builtin:box:8", "builtin:bracket"] {
        done(&["axis", mesh, "-o", &at("x.ma")]);
        let (code, object) = json(&["reconstruct", &at("x.ma"), "-o", &at("x.ply")]);
        assert_eq!((code, &object["union_betti"][0]), (0, &1.into()), "{object}");
    }
}

/// A thin ring, whose hole a coarse surface closes, and a ball without such details.
#[test]
fn the_tolerance_is_as_coarse_as_the_topology_allows() {
    let at = folder();
    let made = |name: &str, medial_mesh: String| {
        fs::write(at(name), medial_mesh).expect("written");
        let (code, object) = json(&["reconstruct", &at(name), "-o", &at("x.ply")]);
        assert_eq!(code, 0, "{object}");
        assert_eq!(object["betti"], object["union_betti"], "{object}");
        object["tolerance"].as_f64().expect("a number")
    };
    assert_eq!(made("ball.ma", "1 0 0\nv 0 0 0 1\n".into()), 0.04);
    let corner = |k: u32| (std::f64::consts::TAU * f64::from(k) / 32.0).sin_cos();
    let v = (0..32).map(|k| format!("v {} {} 0 0.97\n", corner(k).0, corner(k).1));
    let e = (0..32).map(|k| format!("e {k} {}\n", (k + 1) % 32));
    let ring = format!("32 32 0\n{}{}", v.collect::<String>(), e.collect::<String>());
    assert!(made("ring.ma", ring) < 0.04);
}

/// Faces of tiny coordinates were inside out.
#[test]
fn the_unit_of_the_coordinates_changes_the_surface_by_its_scale_alone() {
    let at = folder();
    let made = |unit: i32| {
        let v = |x: f64| format!("v {x}e{unit} 0 0 1e{unit}\n");
        fs::write(at("x.ma"), format!("2 1 0\n{}{}e 0 1\n", v(0.0), v(3.0))).expect("written");
        let (code, mut object) = json(&["reconstruct", &at("x.ma"), "-o", &at("x.ply")]);
        assert_eq!((code, &object["warnings"]), (0, &serde_json::json!([])), "{object}");
        let diagonal = object["diagonal"].as_f64().expect("a number");
        assert!((diagonal / 33f64.sqrt() / 10f64.powi(unit) - 1.0).abs() < 1e-9, "{object}");
        let faces = object["faces"].as_f64().expect("a count");
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
    let at = folder();
    let write = |name: &str, text: &str| {
        fs::write(at(name), text).expect("written");
        at(name)
    };
    let ball = write("ball.ma", "1 0 0\nv 0 0 0 1\n");
    let empty = write("empty.ma", "0 0 0\n");
    let points = write("points.ma", "2 1 0\nv 0 0 0 0\nv 1 0 0 0\ne 0 1\n");
    let specks = write("specks.ma", "2 0 0\nv 0 0 0 1e-4\nv 1 0 0 1e-4\n");
    let dust = write("dust.ma", "2 0 0\nv 0 0 0 1e-300\nv 1 0 0 1e-300\n");
    let below = write("below.ma", "2 0 0\nv 0 0 0 1e-320\nv 1 0 0 1e-320\n");
    let sheet = write(
        "sheet.ma",
        "3 3 1\nv 0 0 0 0\nv 1 0 0 1e-6\nv 0 1 0 0\ne 0 1\ne 1 2\ne 0 2\nf 0 1 2\n",
    );
    let huge = write("huge.ma", "1 0 0\nv 0 0 0 1e200\n");
    let far = write("far.ma", "1 0 0\nv 1e15 0 0 1\n");
    let (out, nowhere) = (at("x.ply"), at("no/such/folder/x.ply"));
    let mesh = "builtin:sphere:8";
    let crust = ["--method", "power-crust"];
    let crust_of = ["--method", "power-crust", "--mesh", mesh];
    let cases: [(&[&str], &[&str], i32, &str); 16] = [
        (&[&ball, "-o", "x.stl"], &[], 1, "(found \"stl\", expected one of .ply"),
        (&[&ball, "-o", &nowhere], &[], 1, "the folder does not exist; create it by `mkdir -p"),
        (&["no-such.ma", "-o", &out], &[], 1, "no-such.ma"),
        (&[&ball, "-o", &out], &crust, 2, "--mesh MESH"),
        (&["-o", &out], &[], 2, "--method power-crust"),
        (&[&ball, "-o", &out], &["--tolerance", "0"], 2, "--tolerance <FRACTION>"),
        (&[&ball, "-o", &out], &["--tolerance", "1e-7"], 1, "tetrahedra); give a tolerance of"),
        (&[&empty, "-o", &out], &[], 1, "empty.ma"),
        (&[&points, "-o", &out], &[], 1, "points.ma: all spheres have radius zero"),
        (&[&specks, "-o", &out], &[], 1, "specks.ma: every sphere is too thin"),
        (&[&dust, "-o", &out], &[], 1, "dust.ma: too thin for its extent"),
        (
            &[&below, "-o", &out],
            &[],
            1,
            "below.ma: all spheres have radius zero, or below 2.2e-308",
        ),
        (&[&sheet, "-o", &out], &[], 1, "sheet.ma: too thin for its extent"),
        (&[&sheet, "-o", &out], &["--tolerance", "1e-5"], 1, "give larger radii"),
        (&[&huge, "-o", &out], &[], 1, "huge.ma"),
        (&[&far, "-o", &out], &crust_of, 1, "far.ma"),
    ];
    for (words, more, expected, part) in cases {
        refused(&[&["reconstruct"], words, more].concat(), expected, part);
        assert!(!Path::new(&out).exists(), "{words:?} wrote a file");
    }
    let grown = write("grown.ma", "1 0 0\nv 0 0 0 100\n");
    // In diagonals of the mesh so fine a surface of it would be too large.
    refused(&["reconstruct", &grown, "--mesh", mesh, "-o", &out], 1, "grown.ma");
    let words = ["--mesh", mesh, "-o", &out, "--tolerance", "1"];
    let (code, object) = json(&[&["reconstruct", &grown][..], &words].concat());
    assert!(
        code == 0 && object["warnings"].to_string().contains("check surface and units"),
        "{object}"
    );

    // No tolerance is coarse enough for spheres in other units, and each is refused in these words.
    let units = write("units.ma", "1 0 0\nv 0 0 0 1000\n");
    for tolerance in ["0.001", "0.02", "1"] {
        let words = ["--mesh", mesh, "-o", &out, "--tolerance", tolerance];
        let no_advice = "no tolerance works; check the units of the medial mesh";
        refused(&[&["reconstruct", &units][..], &words].concat(), 1, no_advice);
        let words = ["render", mesh, &units, "--show", "error", "--tolerance", tolerance];
        refused(&[&words[..], &["-o", &at("x.png")]].concat(), 2, no_advice);
    }
    // Advice is enough for the next request.
    for name in [&ball, &specks, &grown] {
        let words = ["reconstruct", name, "--mesh", mesh, "-o", &out, "--tolerance"];
        let mut tolerance = if name == &specks { "1" } else { "1e-7" }.to_owned();
        for _ in 0..2 {
            let (code, _, stderr) = run(&[&words[..], &[&*tolerance]].concat());
            let Some((_, advice)) = stderr.split_once("give a tolerance of ") else {
                assert_eq!(code, 0, "{stderr}");
                break;
            };
            tolerance = advice.split_whitespace().next().expect("a number").to_owned();
        }
        assert_eq!(run(&[&words[..], &[&*tolerance]].concat()).0, 0, "{name}: {tolerance}");
    }

    // A ring with a hole that is much narrower than the tolerance.
    let ring: String = (0..6)
        .map(|k| (f64::from(k) * std::f64::consts::TAU / 6.0).sin_cos())
        .map(|(y, x)| format!("v {x} {y} 0 0.85\n"))
        .chain((0..6).map(|k| format!("e {k} {}\n", (k + 1) % 6)))
        .collect();
    let ring = write("ring.ma", &format!("6 6 0\n{ring}"));
    let (code, object) = json(&["reconstruct", &ring, "-o", &out, "--tolerance", "0.05"]);
    assert_eq!((code, &object["union_betti"]), (0, &serde_json::json!([1, 1, 0])), "{object}");
    assert_eq!(object["betti"], serde_json::json!([1, 0, 0]), "{object}");
    assert!(object["warnings"].to_string().contains("give a smaller tolerance"), "{object}");

    // Lone spheres, one of them a point, are accepted.
    let lone = write("lone.ma", "3 0 0\nv 0 0 0 1\nv 5 0 0 1\nv 9 0 0 0\n");
    let (code, object) = json(&["reconstruct", &lone, "-o", &out]);
    assert_eq!((code, &object["components"], &object["lost"]), (0, &2.into(), &1.into()));
    assert!(object["warnings"][0].as_str().is_some_and(|w| w.contains("1 sphere")), "{object}");
}
