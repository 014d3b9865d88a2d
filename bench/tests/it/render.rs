//! `medial render` and `medial view`: written files and refused options.

use std::fs;
use std::path::Path;

use crate::command::{Folder, number};

/// Width and height in the header of a PNG file.
fn size_of(path: &Path) -> [u32; 2] {
    let bytes = fs::read(path).expect("a file");
    assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"), "{}", path.display());
    [16, 20].map(|k| u32::from_be_bytes(bytes[k..k + 4].try_into().expect("four bytes")))
}

#[test]
fn every_kind_of_picture_is_written() {
    let at = Folder::new();
    for (spheres, path) in [(20, "coarse.ma"), (80, "fine.ma")] {
        at.done(&format!("simplify builtin:torus -m qmat --spheres {spheres} -o {path}"));
    }
    for (words, size) in [
        ("", [160, 120]),
        ("--camera top --up z", [160, 120]),
        ("coarse.ma", [160, 120]),
        ("coarse.ma --color plain --camera -1,0,0.5 --background transparent", [160, 120]),
        ("coarse.ma --show reconstruction --tolerance 0.03", [160, 120]),
        ("coarse.ma --show error --tolerance 0.03 --max-error 0.02", [160, 120]),
        ("coarse.ma fine.ma --show error --tolerance 0.03", [448, 280]),
    ] {
        let line = format!("render builtin:torus {words} -o x.png --size 160x120");
        let (code, object) = at.json(&line);
        assert_eq!(code, 0, "{words}: {object}");
        assert_eq!(size_of(&at.at("x.png")), size, "{words}");
        assert_eq!((&object["width"], &object["height"]), (&size[0].into(), &size[1].into()));
        fs::remove_file(at.at("x.png")).expect("the picture");
    }
}

/// A result has one error: that of `evaluate`, not that of the drawn vertices.
#[test]
fn the_error_of_a_picture_is_that_of_evaluate() {
    let at = Folder::new();
    at.done("simplify builtin:torus -m qmat --spheres 20 -o axis.ma");
    let line = "render builtin:torus axis.ma --show error --tolerance 0.03 --size 160x120 -o x.png";
    let (_, drawn) = at.json(line);
    let (_, evaluated) = at.json("evaluate builtin:torus axis.ma");
    assert_eq!(drawn["errors"][0]["hausdorff"], evaluated["hausdorff"]);
    let percent = 100.0 * number(&evaluated["hausdorff"]);
    assert!(at.done(line).contains(&format!("Hausdorff {percent:.3} %")), "{percent}");
}

#[test]
fn wrong_words_are_named_and_nothing_is_written() {
    let at = Folder::new();
    at.write("ball.ma", "1 0 0\nv 0 0 0 0.9\n");
    at.write("points.ma", "2 1 0\nv 0 0 0 0\nv 0.5 0 0 0\ne 0 1\n");
    for (words, expected, part) in [
        ("--size 800", 2, "--size <WxH>': expected WIDTHxHEIGHT"),
        ("--size=-1x5", 2, "expected WIDTHxHEIGHT"),
        ("--size 800x600x2", 2, "expected WIDTHxHEIGHT"),
        ("--size 8x8", 2, "--size: a picture of 8 by 8"),
        ("--size 90000x10", 2, "--size: a picture of 90000 by 10"),
        ("--camera somewhere", 2, "--camera <VIEW>': expected one of front"),
        ("--camera 0,90", 2, "between -90 and 90"),
        ("--camera 0,0,0", 2, "--camera: the camera looks from 0,0,0"),
        ("--camera 0,1,0 --up y", 2, "--up: 0,1,0"),
        ("--up w", 2, "--up <DIRECTION>': expected x"),
        ("--background mauve", 2, "or #rrggbb"),
        ("--max-error 0", 2, "a number above 0 and at most 1"),
        ("--tolerance 2", 2, "a number above 0 and at most 1"),
        ("--show error", 2, "--show error: no medial mesh; name one"),
        ("ball.ma ball.ma --show reconstruction", 2, "--show reconstruction"),
        ("ball.ma --show error --tolerance 1e-7", 2, "ball.ma: tolerance 1.000e-7 is too fine"),
        ("no-such.ma", 1, "no-such.ma"),
        ("points.ma --show error", 1, "points.ma: all spheres have radius zero"),
    ] {
        at.refused(&format!("render builtin:sphere:8 -o x.png {words}"), expected, part);
        assert!(!at.has("x.png"), "{words} wrote a file");
    }
    for (name, part) in [("x.jpg", "expected one of .png"), ("no/x.png", "does not exist")] {
        at.refused(&format!("render builtin:sphere:8 -o {name}"), 1, part);
    }
}

#[test]
fn a_view_is_one_page_without_other_files() {
    let at = Folder::new();
    at.done("simplify builtin:torus -m qmat --spheres 20 -o torus.ma");
    let mut sizes = vec![];
    for words in ["--mesh builtin:torus", ""] {
        let (code, object) = at.json(&format!("view torus.ma torus.ma -o view.html {words}"));
        assert_eq!((code, &object["medial_meshes"]), (0, &2.into()), "{object}");
        let text = at.text("view.html");
        // Three.js names the site of a shader's source in a comment, packed.
        assert!(!text.contains(" src=") && !text.contains("href="), "it loads something");
        sizes.push(text.len());
    }
    assert!(sizes[1] < sizes[0] && sizes[0] < 3_000_000, "{sizes:?}");
    at.write("empty.ma", "0 0 0\n");
    at.refused("view empty.ma -o view.html", 1, "no sphere");
    at.refused("view torus.ma -o view.png", 1, "expected one of .html");
}
