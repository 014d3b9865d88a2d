//! Files for ParaView and Blender, through VTK and trimesh: `scripts/readers.sh`, if its environment exists.

use std::process::Command;

use crate::command::{Folder, MEDIAL};

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
    let at = Folder::new();
    let output = Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../scripts/readers.sh"))
        .env("READERS_PYTHON", python)
        .env("MEDIAL", MEDIAL)
        .env("CARGO_TARGET_DIR", at.at("target"))
        .output()
        .expect("the script starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("same: ") && !text.contains("DIFFERENT"), "{text}");
}

/// The test above compares the content through VTK and trimesh. This one writes every option, and reads neither format.
#[test]
fn viewer_formats_are_written_and_never_read() {
    let at = Folder::new();
    at.done("axis builtin:box:8 -o x.ma");
    for (to, options) in [
        ("a.vtp", "--color stability"),
        ("b.vtp", "--color error --mesh builtin:box:8"),
        ("c.glb", "--colour error --mesh builtin:box:8 --spheres"),
        ("d.glb", ""),
    ] {
        at.done(&format!("convert x.ma {to} {options}"));
        at.refused(&format!("convert {to} back.ma"), 1, to);
        assert!(!at.has("back.ma"));
    }
    // The same note of each verb that writes the format.
    let rounded = "rounded coordinates and radii to single precision, by at most";
    for (to, warning) in [("e.glb", rounded), ("f.obj", "left out the radii")] {
        for verb in [
            "convert x.ma",
            "axis builtin:box:8 -o",
            "simplify builtin:box:8 -m qmat --spheres 8 -o",
        ] {
            let (_, object) = at.json(&format!("{verb} {to}"));
            assert!(object["warnings"].to_string().contains(warning), "{object}");
        }
    }
}

#[test]
fn spheres_of_a_link_are_written_read_and_measured() {
    let at = Folder::new();
    let (_, object) = at.json("simplify builtin:box:8 -m qmat --spheres 8 -o link.yaml");
    assert!(object["warnings"].to_string().contains(".yaml holds spheres alone"), "{object}");
    at.done("convert link.yaml link.urdf");
    let (code, object) = at.json("evaluate builtin:box:8 link.urdf");
    assert_eq!((code, object.to_string().contains("uncovered")), (0, true), "{object}");
    at.done("render builtin:box:8 link.yaml -o link.png");
    let list = r#"[{"center": [0, 0, 0], "radius": 1}]"#;
    at.write("two.json", format!("{{\"arm\": {list}, \"hand\": {list}}}"));
    let why = "2 links (1 arm, 2 hand); select one by --block K";
    at.refused("convert two.json x.csv", 1, why);
    at.done("convert two.json x.csv --block 2");
    at.refused("convert builtin:box:8 x.csv", 2, "--method cover --spheres 32 -o ");
}

#[test]
fn an_output_that_the_command_reads_is_refused() {
    let at = Folder::new();
    at.done("datasets make box -o s.obj");
    let before = at.text("s.obj");
    at.done("simplify s.obj -m qmat --spheres 8 -o a.ma");
    for line in [
        "simplify s.obj -m qmat --spheres 8 -o s.obj",
        "reconstruct --method power-crust --mesh s.obj -o s.obj",
        "repair s.obj -o s.obj",
        "simplify s.obj -m qmat --spheres 6 --initial a.ma -o a.ma",
        "convert a.ma a.ma",
    ] {
        at.refused(line, 2, "reads or writes this file already");
    }
    assert_eq!(at.text("s.obj"), before);
}

/// A sphere of radius 0.6 in the middle of the box, whose faces are 0.5 away, and one of 0.4.
#[test]
fn errors_are_radii_less_depths() {
    let at = Folder::new();
    at.write("x.ma", "2 0 0\nv 0 0 0 0.6\nv 0.5 0 0 0.4\n");
    at.done("convert x.ma x.glb --color error --mesh builtin:box");
    let bytes = std::fs::read(at.at("x.glb")).expect("a file");
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
    let at = Folder::new();
    at.done("axis builtin:box:8 -o x.ma");
    at.done("datasets make sphere --resolution 8 -o s.off");
    for (words, expected) in [
        ("x.ma x.ply --color error", "--color: "),
        ("x.ma x.vtp --spheres", "--spheres: "),
        ("x.ma x.glb --color error", "no surface; give --mesh MESH"),
        ("x.ma x.glb --mesh builtin:box", "--mesh requires --color error"),
        ("s.off x.glb", ""),
        ("s.off x.vtp", ""),
        ("s.off x.off --spheres", ""),
    ] {
        at.refused(&format!("convert {words}"), 2, expected);
        assert!(["x.ply", "x.vtp", "x.glb", "x.off"].iter().all(|name| !at.has(name)), "{words}");
    }
}

/// A pipe or device may never end.
#[cfg(unix)]
#[test]
fn inputs_that_are_no_files_are_refused() {
    let at = Folder::new();
    for extension in ["ma", "ply", "obj", "off", "csv", "json", "yaml", "urdf", "txt"] {
        let [pipe, device] = ["pipe", "zero"].map(|name| format!("{name}.{extension}"));
        assert!(Command::new("mkfifo").arg(at.at(&pipe)).status().expect("runs").success());
        std::os::unix::fs::symlink("/dev/zero", at.at(&device)).expect("a link");
        for file in [&pipe, &device] {
            let mut lines = vec![
                format!("convert {file} x.ma"),
                format!("convert {file} x.ply"),
                format!("evaluate builtin:box:8 {file}"),
            ];
            if extension != "off" {
                lines.push(format!("view {file} -o x.html"));
                lines.push(format!("reconstruct {file} -o x.off"));
            }
            lines.iter().for_each(|line| at.refused(line, 1, "not a regular file"));
        }
    }
}
