//! `medial render` and `medial view`: written files and refused options.

use std::fs;
use std::path::Path;

use crate::command::{done, folder, json, refused};

/// Width and height in the header of a PNG file.
fn size_of(path: &str) -> [u32; 2] {
    let bytes = fs::read(path).expect("a file");
    assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"), "{path}");
    [16, 20].map(|k| u32::from_be_bytes(bytes[k..k + 4].try_into().expect("four bytes")))
}

#[test]
fn every_kind_of_picture_is_written() {
    let at = folder();
    let (mesh, coarse, fine) = ("builtin:torus", at("coarse.ma"), at("fine.ma"));
    for (spheres, path) in [("20", &coarse), ("80", &fine)] {
        done(&["simplify", mesh, "-m", "qmat", "--spheres", spheres, "-o", path]);
    }
    let out = at("x.png");
    let cases: [(&[&str], [u32; 2]); 7] = [
        (&[], [160, 120]),
        (&["--camera", "top", "--up", "z", "--zoom", "1.5"], [160, 120]),
        (&[&coarse], [160, 120]),
        (
            &[&coarse, "--color", "plain", "--camera", "-1,0,0.5", "--background", "transparent"],
            [160, 120],
        ),
        (&[&coarse, "--show", "reconstruction", "--tolerance", "0.03"], [160, 120]),
        (&[&coarse, "--show", "error", "--tolerance", "0.03", "--max-error", "0.02"], [160, 120]),
        (&[&coarse, &fine, "--show", "error", "--tolerance", "0.03"], [412, 280]),
    ];
    for (words, size) in cases {
        let (code, object) =
            json(&[&["render", mesh], words, &["-o", &out, "--size", "160x120"]].concat());
        assert_eq!(code, 0, "{words:?}: {object}");
        assert_eq!(size_of(&out), size, "{words:?}");
        assert_eq!((&object["width"], &object["height"]), (&size[0].into(), &size[1].into()));
        fs::remove_file(&out).expect("the picture");
    }
}

/// A result has one error: that of `evaluate`, not that of the drawn vertices.
#[test]
fn the_error_of_a_picture_is_that_of_evaluate() {
    let at = folder();
    let (mesh, axis, out) = ("builtin:torus", at("axis.ma"), at("x.png"));
    done(&["simplify", mesh, "-m", "qmat", "--spheres", "20", "-o", &axis]);
    let words = ["--show", "error", "--tolerance", "0.03", "--size", "160x120", "-o", &out];
    let arguments = [&["render", mesh, &axis], &words[..]].concat();
    let (_, drawn) = json(&arguments);
    let (_, evaluated) = json(&["evaluate", mesh, &axis]);
    assert_eq!(drawn["errors"][0]["hausdorff"], evaluated["hausdorff"]);
    let percent = 100.0 * evaluated["hausdorff"].as_f64().expect("a number");
    assert!(done(&arguments).contains(&format!("Hausdorff {percent:.3} %")), "{percent}");
}

#[test]
fn wrong_words_are_named_and_nothing_is_written() {
    let at = folder();
    let (out, axis, points) = (at("x.png"), at("ball.ma"), at("points.ma"));
    fs::write(&axis, "1 0 0\nv 0 0 0 0.9\n").expect("written");
    fs::write(&points, "2 1 0\nv 0 0 0 0\nv 0.5 0 0 0\ne 0 1\n").expect("written");
    let cases: [(&[&str], i32, &str); 18] = [
        (&["--size", "800"], 2, "--size <WxH>': expected WIDTHxHEIGHT"),
        (&["--size", "8x8"], 2, "--size: a picture of 8 by 8"),
        (&["--size", "90000x10"], 2, "--size: a picture of 90000 by 10"),
        (&["--camera", "somewhere"], 2, "--camera <VIEW>': expected one of front"),
        (&["--camera", "0,90"], 2, "between -90 and 90"),
        (&["--camera", "0,0,0"], 2, "--camera: the camera looks from 0,0,0"),
        (&["--camera", "0,1,0", "--up", "y"], 2, "--up: 0,1,0"),
        (&["--up", "w"], 2, "--up <DIRECTION>': expected x"),
        (&["--zoom", "0"], 2, "--zoom: a zoom of 0"),
        (&["--zoom", "nan"], 2, "--zoom: a zoom of NaN"),
        (&["--background", "mauve"], 2, "or #rrggbb"),
        (&["--max-error", "0"], 2, "a number above 0 and at most 1"),
        (&["--tolerance", "2"], 2, "a number above 0 and at most 1"),
        (&["--show", "error"], 2, "--show error: no medial mesh; name one"),
        (&[&axis, &axis, "--show", "reconstruction"], 2, "--show reconstruction"),
        (
            &[&axis, "--show", "error", "--tolerance", "1e-7"],
            2,
            "ball.ma: tolerance 1.000e-7 is too fine",
        ),
        (&["no-such.ma"], 1, "no-such.ma"),
        (&[&points, "--show", "error"], 1, "points.ma: all spheres have radius zero"),
    ];
    for (words, expected, part) in cases {
        refused(&[&["render", "builtin:sphere:8", "-o", &out], words].concat(), expected, part);
        assert!(!Path::new(&out).exists(), "{words:?} wrote a file");
    }
    for (name, part) in [("x.jpg", "expected one of .png"), ("no/x.png", "does not exist")] {
        refused(&["render", "builtin:sphere:8", "-o", &at(name)], 1, part);
    }
}

#[test]
fn a_view_is_one_page_without_other_files() {
    let at = folder();
    let (mesh, axis, page) = ("builtin:torus", at("torus.ma"), at("view.html"));
    done(&["simplify", mesh, "-m", "qmat", "--spheres", "20", "-o", &axis]);
    let mut sizes = vec![];
    for words in [&["--mesh", mesh][..], &[]] {
        let (code, object) = json(&[&["view", &axis, &axis, "-o", &page], words].concat());
        assert_eq!((code, &object["medial_meshes"]), (0, &2.into()), "{object}");
        let text = fs::read_to_string(&page).expect("a page");
        // Three.js names the site of a shader's source in a comment, packed.
        assert!(!text.contains(" src=") && !text.contains("href="), "it loads something");
        sizes.push(text.len());
    }
    assert!(sizes[1] < sizes[0] && sizes[0] < 3_000_000, "{sizes:?}");
    fs::write(at("empty.ma"), "0 0 0\n").expect("written");
    refused(&["view", &at("empty.ma"), "-o", &page], 1, "no sphere");
    refused(&["view", &axis, "-o", &at("view.png")], 1, "expected one of .html");
}
