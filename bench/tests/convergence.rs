//! `medial convergence` on coarse surfaces, and the noises of `medial datasets make`.

use std::fs;

use serde_json::Value;

mod command;
use command::{json, run, text_path};

fn fit<'a>(object: &'a Value, [shape, noise, set, measure]: [&str; 4]) -> &'a Value {
    let fits = object["fits"].as_array().expect("fits");
    let is = |fit: &&Value| {
        fit["shape"] == shape
            && fit["noise"] == noise
            && fit["set"] == set
            && fit["measure"] == measure
    };
    fits.iter().find(is).unwrap_or_else(|| panic!("no {shape} {noise} {set} {measure}"))
}

fn order(object: &Value, key: [&str; 4]) -> f64 {
    let order = &fit(object, key)["order"]["order"];
    order.as_f64().unwrap_or_else(|| panic!("{key:?}: {}", fit(object, key)))
}

#[test]
fn poles_converge_and_voronoi_vertices_do_not() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = text_path(dir.path());
    let shapes = ["sphere", "torus", "capsule", "ellipsoid"];
    let options =
        ["--levels", "3", "--noise", "none,dropped", "--samples", "2000", "--quiet", "--out", out];
    let (code, object) = json(&[&["convergence"], &shapes[..], &options[..]].concat());
    assert_eq!(code, 0);

    // By symmetry no pole of these leaves the axis.
    for shape in ["sphere", "capsule", "ellipsoid"] {
        assert_eq!(fit(&object, [shape, "none", "poles", "to_axis_max"])["exact"], true, "{shape}");
    }
    assert!(order(&object, ["torus", "none", "poles", "to_axis_max"]) > 1.5);
    assert!(order(&object, ["ellipsoid", "dropped", "poles", "to_axis_max"]) > 1.4);
    for noise in ["none", "dropped"] {
        for shape in ["torus", "capsule", "ellipsoid"] {
            let found = order(&object, [shape, noise, "poles", "with_radius_mean"]);
            assert!((1.6..2.4).contains(&found), "{shape} {noise}: {found}");
        }
    }
    for shape in ["torus", "capsule", "ellipsoid"] {
        let found = order(&object, [shape, "dropped", "voronoi", "to_axis_max"]);
        assert!(found < 0.5, "{shape}: {found}");
        // The axis is near the Voronoi vertices all the same.
        let back = fit(&object, [shape, "dropped", "voronoi", "from_axis_max"]);
        assert!(back["exact"] == true || back["order"]["order"].as_f64() > Some(1.5), "{back}");
    }
    let records = object["records"].as_array().expect("records");
    assert_eq!(records.len(), 4 * 2 * 3 * 3);
    for name in ["md", "csv", "json"] {
        let text =
            fs::read_to_string(dir.path().join(format!("convergence.{name}"))).expect("written");
        assert!(text.contains("ellipsoid"), "{name}");
    }
    for noise in ["none", "dropped"] {
        let svg = fs::read_to_string(dir.path().join(format!("convergence-{noise}.svg")));
        assert!(svg.expect("written").contains("no noise") == (noise == "none"));
    }
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let cases: [(&[&str], &str); 6] = [
        (&["blob"], "not known"),
        (&["cube"], "`cube`"),
        (&["torus", "--levels", "2"], "--levels 2"),
        (&["torus", "--noise", "loud"], "loud"),
        (&["torus", "--filter", "nothing"], "nothing"),
        (&["torus", "--dropped", "2"], "--dropped 2"),
    ];
    for (arguments, part) in cases {
        let (code, _, stderr) = run(&[&["convergence"], arguments].concat());
        assert!(code == 2 && stderr.contains(part), "{arguments:?}: {code}, {stderr}");
    }
}

#[test]
fn shapes_are_made_with_noise_of_each_kind() {
    let dir = tempfile::tempdir().expect("a folder");
    let made = |kind: &str, noise: &str| {
        let path = dir.path().join(format!("{kind}.off"));
        let path = text_path(&path).to_owned();
        let make =
            ["datasets", "make", "torus", "--noise", noise, "--noise-kind", kind, "-o", &path];
        let (code, object) = json(&make);
        assert_eq!((code, &object["noise_kind"]), (0, &Value::from(kind)));
        let (code, info) = json(&["info", &path]);
        assert_eq!((code, &info["self_intersecting"]), (0, &Value::from(false)), "{kind}");
        info["vertices"].as_u64().expect("a count")
    };
    let all = made("isotropic", "0.001");
    assert_eq!(made("normal", "0.001"), all);
    assert_eq!(made("dropped", "0.25"), all - (0.25 * all as f64).round() as u64);
    let path = dir.path().join("x.off");
    for (kind, noise) in [("loud", "0.1"), ("normal", "-1"), ("dropped", "1")] {
        let noise = format!("--noise={noise}");
        let make =
            ["datasets", "make", "torus", &noise, "--noise-kind", kind, "-o", text_path(&path)];
        assert_eq!(run(&make).0, 2, "{kind}");
    }
    assert!(!path.exists());
}
