//! Medial meshes as others publish them: in other units, without radii, with headers that lie, and many at once.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use medial::Vec3;
use medial::complex::{self, MedialMesh};
use serde_json::Value;

mod command;
use command::{run, text_path};

const BOX: &str = "builtin:box:24";

/// The initial medial mesh of a box, as a file and as it is.
fn axis(folder: &Path) -> (std::path::PathBuf, MedialMesh) {
    let path = folder.join("box.ma");
    assert_eq!(run(&["axis", BOX, "-o", text_path(&path)]).0, 0);
    let mesh = complex::read(&path).expect("a medial mesh").mesh;
    (path, mesh)
}

fn evaluated(axis: &Path, more: &[&str]) -> (Value, String) {
    let arguments = ["evaluate", BOX, text_path(axis), "--samples", "500", "--json"];
    let (code, stdout, stderr) = run(&[&arguments[..], more].concat());
    assert_eq!(code, 0, "{stderr}");
    (serde_json::from_str(&stdout).expect("JSON"), stderr)
}

#[test]
fn other_units_are_found_and_said_and_never_taken_unasked() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, mesh) = axis(folder.path());
    // The box is 3 long; as MATFP writes it, it is 10 long and begins at the origin.
    let lower = Vec3::new(-1.5, -1.0, -0.5);
    let scaled = mesh.transformed(10.0 / 3.0, |p| (p - lower) * (10.0 / 3.0));
    let other = folder.path().join("other.ma");
    complex::write(&other, &scaled).expect("written");
    let (plain, _) = evaluated(&path, &[]);
    let (unfitted, _) = evaluated(&other, &[]);
    let warnings = unfitted["warnings"].to_string();
    assert!(warnings.contains("`--fit similarity` takes those"), "{warnings}");
    assert!(unfitted["hausdorff"].as_f64() > Some(1.0), "{unfitted}");
    for fit in ["similarity", "auto"] {
        let (fitted, stderr) = evaluated(&other, &["--fit", fit]);
        assert!(stderr.contains("out of a cube from 0 to 10"), "{stderr}");
        assert_eq!(fitted["fit"]["source"], "to_ten");
        for key in ["hausdorff", "mean", "volume_error"] {
            let numbers = [&plain, &fitted].map(|of| of[key].as_f64().expect("a number"));
            assert!((numbers[0] - numbers[1]).abs() < 1e-9, "{key}: {numbers:?}");
        }
    }
    assert_eq!(evaluated(&path, &["--fit", "auto"]).0, plain);
}

#[test]
fn radii_are_taken_from_the_surface_where_a_file_has_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, mesh) = axis(folder.path());
    let mut text = format!("3 {}\n", mesh.spheres.len());
    for sphere in &mesh.spheres {
        let c = sphere.centre;
        writeln!(text, "{} {} {}", c.x, c.y, c.z).expect("a string");
    }
    let points = folder.path().join("points.sph");
    fs::write(&points, text).expect("written");
    let (code, _, stderr) = run(&["evaluate", BOX, text_path(&points)]);
    assert!(code == 1 && stderr.contains("`--radii surface` takes"), "{stderr}");
    let (told, stderr) = evaluated(&points, &["--radii", "surface"]);
    assert!(stderr.contains("every radius is the distance of its centre"), "{stderr}");
    assert_eq!(told["counts"]["spheres"], mesh.spheres.len());
    // The balls are inside, and touch: what is left is between them.
    assert!(told["hausdorff"].as_f64() < Some(0.2), "{told}");
    assert!(told["protrusion"].as_f64() < Some(1e-9), "{told}");
    // A surface is no set of centres.
    let surface = folder.path().join("surface.ma");
    fs::write(&surface, "4 0 0\nv 1.5 1 .5 0\nv -1.5 1 .5 0\nv 1.5 -1 .5 0\nv 0 0 .5 0\n")
        .expect("written");
    let (code, _, stderr) = run(&["evaluate", BOX, text_path(&surface), "--radii", "surface"]);
    assert!(code == 1 && stderr.contains("every point is on the surface"), "{stderr}");
}

#[test]
fn many_files_are_verified_in_one_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let (path, _) = axis(folder.path());
    assert_eq!(
        run(&["datasets", "make", "box", "--resolution", "24", "-o", text_path(&at("box.off"))]).0,
        0
    );
    fs::copy(&path, at("box_again.ma")).expect("copied");
    fs::write(at("lie.ma"), "3 0 0\nv 0 0 0 1\nv 1 0 0 1\n").expect("written");
    let verify = |more: &[&str]| {
        let arguments = ["verify", text_path(folder.path()), "--samples", "300"];
        run(&[&arguments[..], more].concat())
    };
    let (code, stdout, stderr) = verify(&["--json"]);
    assert_eq!(code, 3, "{stderr}");
    let told: Value = serde_json::from_str(&stdout).expect("JSON");
    let files = told["files"].as_array().expect("a list");
    assert_eq!(files.len(), 3, "the surface is none of them");
    assert_eq!(files[0]["evaluation"]["hausdorff"], files[1]["evaluation"]["hausdorff"]);
    assert!(files[1]["wrong"].to_string().contains("the same bytes as"), "{}", files[1]);
    assert!(files[2]["refused"].to_string().contains("announces 3 spheres"), "{}", files[2]);
    assert!(files[2]["mesh"].is_null());
    // Leniently, it is read, and said what it is.
    let table = at("table.md");
    let (code, stdout, _) = verify(&["--lenient", "-o", text_path(&table)]);
    assert_eq!((code, &*stdout), (0, ""));
    let table = fs::read_to_string(table).expect("written");
    assert!(table.starts_with("| file") && table.contains("taken as they are"), "{table}");
}
