//! Files for ParaView and Blender, through VTK and trimesh: `scripts/readers.sh`, if its environment exists.

use std::path::Path;
use std::process::Command;

use crate::command::{MEDIAL, done, folder, json, refused};

/// The Python that `scripts/readers.sh` sets up, or that of `$READERS_PYTHON`.
fn python() -> Option<String> {
    let made = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/readers/python/bin/python");
    let python = std::env::var("READERS_PYTHON").unwrap_or_else(|_| made.to_owned());
    let output = Command::new(&python).args(["-c", "import vtk, trimesh"]).output();
    output.is_ok_and(|done| done.status.success()).then_some(python)
}

#[test]
fn vtk_and_trimesh_agree() {
    let Some(python) = python() else {
        medial_test_support::skip("no Python with vtk and trimesh (scripts/readers.sh makes one)");
        return;
    };
    let at = folder();
    let output = Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../scripts/readers.sh"))
        .env("READERS_PYTHON", python)
        .env("MEDIAL", MEDIAL)
        .env("CARGO_TARGET_DIR", at("target"))
        .output()
        .expect("the script starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("same: ") && !text.contains("DIFFERENT"), "{text}");
}

/// The test above compares the content through VTK and trimesh. This one writes every option, and reads neither format.
#[test]
fn viewer_formats_are_written_and_never_read() {
    let at = folder();
    let ma = at("x.ma");
    done(&["axis", "builtin:box:8", "-o", &ma]);
    for (to, options) in [
        ("a.vtp", &["--color", "stability"][..]),
        ("b.vtp", &["--color", "error", "--mesh", "builtin:box:8"]),
        ("c.glb", &["--colour", "error", "--mesh", "builtin:box:8", "--spheres"]),
        ("d.glb", &[]),
    ] {
        done(&[&["convert", &ma, &at(to)], options].concat());
        refused(&["convert", &at(to), &at("back.ma")], 2, to);
        assert!(!Path::new(&at("back.ma")).exists());
    }
    let (_, object) = json(&["convert", &ma, &at("e.glb")]);
    let warning = "rounded coordinates and radii to single precision, by at most";
    assert!(object["warnings"].to_string().contains(warning), "{object}");
    // The same note of each verb that writes the format.
    for (to, warning) in [("f.glb", warning), ("f.obj", "left out the radii")] {
        let file = at(to);
        let simplify = ["simplify", "builtin:box:8", "-m", "qmat", "--spheres", "8", "-o", &file];
        for words in [&simplify[..], &["axis", "builtin:box:8", "-o", &file]] {
            let (_, object) = json(words);
            assert!(object["warnings"].to_string().contains(warning), "{object}");
        }
    }
}

#[test]
fn spheres_of_a_link_are_written_read_and_measured() {
    let at = folder();
    let (yaml, two) = (at("link.yaml"), at("two.json"));
    let simplify = ["simplify", "builtin:box:8", "-m", "qmat", "--spheres", "8", "-o", &yaml];
    let (_, object) = json(&simplify);
    assert!(object["warnings"].to_string().contains(".yaml holds spheres alone"), "{object}");
    done(&["convert", &yaml, &at("link.urdf")]);
    let (code, object) = json(&["evaluate", "builtin:box:8", &at("link.urdf")]);
    assert_eq!((code, object.to_string().contains("uncovered")), (0, true), "{object}");
    done(&["render", "builtin:box:8", &yaml, "-o", &at("link.png")]);
    let list = r#"[{"center": [0, 0, 0], "radius": 1}]"#;
    std::fs::write(&two, format!("{{\"arm\": {list}, \"hand\": {list}}}")).expect("written");
    refused(
        &["convert", &two, &at("x.csv")],
        1,
        "2 links (1 arm, 2 hand); select one by --block K",
    );
    done(&["convert", &two, &at("x.csv"), "--block", "2"]);
    refused(&["convert", "builtin:box:8", &at("x.csv")], 2, "--method cover --spheres 32 -o ");
}

#[test]
fn an_output_that_the_command_reads_is_refused() {
    let at = folder();
    let [surface, axis] = ["s.obj", "a.ma"].map(&at);
    done(&["datasets", "make", "box", "-o", &surface]);
    let before = std::fs::read(&surface).expect("written");
    let other = "reads or writes this file already";
    refused(&["simplify", &surface, "-m", "qmat", "--spheres", "8", "-o", &surface], 2, other);
    let crust = ["reconstruct", "--method", "power-crust", "--mesh", &surface, "-o", &surface];
    refused(&crust, 2, other);
    refused(&["repair", &surface, "-o", &surface], 2, other);
    done(&["simplify", &surface, "-m", "qmat", "--spheres", "8", "-o", &axis]);
    let again =
        ["simplify", &surface, "-m", "qmat", "--spheres", "6", "--initial", &axis, "-o", &axis];
    refused(&again, 2, other);
    refused(&["convert", &axis, &axis], 2, other);
    assert_eq!(std::fs::read(&surface).expect("still there"), before);
}

/// A sphere of radius 0.6 in the middle of the box, whose faces are 0.5 away, and one of 0.4.
#[test]
fn errors_are_radii_less_depths() {
    let at = folder();
    std::fs::write(at("x.ma"), "2 0 0\nv 0 0 0 0.6\nv 0.5 0 0 0.4\n").expect("written");
    let error = ["--color", "error", "--mesh", "builtin:box"];
    done(&[&["convert", &at("x.ma"), &at("x.glb")], &error[..]].concat());
    let bytes = std::fs::read(at("x.glb")).expect("a file");
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("4 bytes"));
    let length = word(12) as usize;
    let scene: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).expect("JSON");
    let mesh = &scene["meshes"][0];
    let [low, high] = ["colour_low", "colour_high"].map(|key| mesh["extras"][key].as_f64());
    assert!((high.expect("an end") - 0.1).abs() < 1e-12 && low == high.map(|high| -high));
    let accessor = mesh["primitives"][0]["attributes"]["_ERROR"].as_u64().expect("an accessor");
    let view = scene["accessors"][accessor as usize]["bufferView"].as_u64().expect("a view");
    let from = scene["bufferViews"][view as usize]["byteOffset"].as_u64().expect("a place");
    let values = [0, 4].map(|k| f32::from_bits(word(28 + length + from as usize + k)));
    assert!((values[0] - 0.1).abs() < 1e-6 && (values[1] + 0.1).abs() < 1e-6, "{values:?}");
}

#[test]
fn unsupported_options_are_refused_before_a_file_is_written() {
    let at = folder();
    let ma = at("x.ma");
    done(&["axis", "builtin:box:8", "-o", &ma]);
    for (to, options, expected) in [
        ("x.ply", &["--color", "error"][..], "--color: "),
        ("x.vtp", &["--spheres"], "--spheres: "),
        ("x.glb", &["--color", "error"], "no surface; give --mesh MESH"),
        ("x.glb", &["--mesh", "builtin:box"], "--mesh requires --color error"),
    ] {
        refused(&[&["convert", &ma, &at(to)], options].concat(), 2, expected);
        assert!(!Path::new(&at(to)).exists());
    }
    let surface = at("s.off");
    done(&["datasets", "make", "sphere", "--resolution", "8", "-o", &surface]);
    for (to, options) in [("y.glb", &[][..]), ("y.vtp", &[]), ("y.off", &["--spheres"])] {
        refused(&[&["convert", &surface, &at(to)], options].concat(), 2, "");
    }
}

/// A pipe or device may never end.
#[cfg(unix)]
#[test]
fn inputs_that_are_no_files_are_refused() {
    let at = folder();
    for extension in ["ma", "ply", "obj", "off", "csv", "json", "yaml", "urdf", "txt"] {
        let [pipe, device] = ["pipe", "zero"].map(|name| at(&format!("{name}.{extension}")));
        assert!(Command::new("mkfifo").arg(&pipe).status().expect("runs").success());
        std::os::unix::fs::symlink("/dev/zero", &device).expect("a link");
        for path in [&pipe, &device] {
            let why = "not a regular file";
            refused(&["convert", path, &at("x.ma")], 1, why);
            refused(&["convert", path, &at("x.ply")], 1, why);
            refused(&["evaluate", "builtin:box:8", path], 1, why);
            if extension != "off" {
                refused(&["view", path, "-o", &at("x.html")], 1, why);
                refused(&["reconstruct", path, "-o", &at("x.off")], 1, why);
            }
        }
    }
}
