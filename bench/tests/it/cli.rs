//! The command as its users meet it: what it prints, what it writes, how it ends.

use std::fs;

use crate::command::{json, run, text_path, words};

/// Seconds and sizes that differ from run to run become `#`.
fn without_timings(text: &str) -> String {
    let words = text.split(' ').map(|word| {
        let number = word.trim_end_matches(['s', ',']);
        if number.contains('.') && number.parse::<f64>().is_ok() { "#" } else { word }
    });
    words.collect::<Vec<_>>().join(" ")
}

#[test]
fn help_names_every_verb() {
    let (code, stdout, _) = run(&["--help"]);
    assert_eq!(code, 0);
    insta::assert_snapshot!(stdout);
}

#[test]
fn methods_and_their_parameters() {
    insta::assert_snapshot!("methods", run(&["methods"]).1);
    insta::assert_snapshot!("methods_qmat", run(&["methods", "qmat"]).1);
    insta::assert_snapshot!("methods_pmat", run(&["methods", "pmat"]).1);
    insta::assert_snapshot!("methods_hem", run(&["methods", "hem"]).1);
    insta::assert_snapshot!("methods_angle", run(&["methods", "angle"]).1);
    let (code, _, stderr) = run(&["methods", "nothing"]);
    assert_eq!(code, 2);
    insta::assert_snapshot!("methods_unknown", stderr);
}

#[test]
fn datasets_are_listed() {
    // Whatever the user of this machine has fetched.
    let cache = tempfile::tempdir().expect("a folder");
    let mut command = crate::command::medial(&["datasets", "list"]);
    let output = command.env("MEDIAL_CACHE", cache.path()).output().expect("the command starts");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let (shapes, published) = text.split_once("\n\n").expect("two lists");
    insta::assert_snapshot!(shapes);
    let public = published.lines().next().expect("a line");
    assert!(public.starts_with("public: 0 of ") && public.contains("fetch public"), "{public}");
}

#[test]
fn info_on_a_built_in_shape() {
    let (code, stdout, _) = run(&["info", "builtin:torus"]);
    assert_eq!(code, 0);
    insta::assert_snapshot!(stdout);
    let (_, object) = json(&["info", "builtin:torus"]);
    for key in "vertices faces components genus closed manifold oriented self_intersecting degenerate_faces diagonal repairs"
        .split(' ') {
        assert!(!object[key].is_null(), "{key} is missing in {object}");
    }
}

#[test]
fn info_describes_a_mesh_that_it_refuses() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("open.off");
    fs::write(&path, "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n")
        .expect("written");
    let (code, object) = json(&["info", text_path(&path)]);
    assert_eq!(code, 1);
    assert_eq!(object["closed"], false);
    assert_eq!(object["boundary_edges"], 3);
    assert!(
        object["reason"].as_str().is_some_and(|reason| reason.contains("open.off")),
        "{object}"
    );
}

#[test]
fn threads_change_no_byte() {
    let dir = tempfile::tempdir().expect("a folder");
    for method in ["qmat", "pmat", "hem", "sat-pairwise", "angle", "lambda"] {
        let written = ["1", "2"].map(|threads| {
            let path = dir.path().join(format!("{method}-{threads}.ma"));
            let (code, ..) = run(&words(&format!(
                "simplify builtin:blob --method {} --spheres 100 --threads {} -o {}",
                method,
                threads,
                text_path(&path)
            )));
            assert_eq!(code, 0);
            fs::read(path).expect("written")
        });
        assert_eq!(written[0], written[1], "{method}");
    }
}

#[test]
fn wrong_words_end_in_usage() {
    let cases: [&[&str]; 8] = [
        &["compare", "builtin:nothing", "--methods", "nothing"],
        &["compare", "--spheres", "0"],
        &["compare", "--set", "qmat.k"],
        &["simplify", "builtin:box", "--method", "qmat", "--spheres", "5", "--set", "no=1"],
        &["simplify", "builtin:box", "--method", "angle", "--level", "999"],
        &["axis", "builtin:box", "--sampling", "red:5"],
        &["axis", "builtin:box:x"],
        &["info", "builtin:box", "--threads", "0"],
    ];
    for arguments in cases {
        let (code, _, stderr) = run(arguments);
        assert_eq!(code, 2, "{arguments:?}: {stderr}");
    }
    let (code, _, stderr) = run(&["simplify", "no-such-file.off", "--method", "qmat"]);
    assert_eq!(code, 1);
    assert!(stderr.contains("no-such-file.off"), "{stderr}");
}

#[test]
fn printed_results() {
    let (_, stdout, _) =
        run(&["simplify", "builtin:capsule", "--method", "qmat", "--spheres", "20"]);
    insta::assert_snapshot!("simplify", without_timings(&stdout));
    let (_, stdout, _) = run(&["axis", "builtin:capsule"]);
    insta::assert_snapshot!("axis", without_timings(&stdout));
}

#[test]
fn absurd_requests_are_refused_at_once() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = |name: &str| text_path(&dir.path().join(name)).to_owned();
    let (ball, huge, nowhere) = (at("ball.ma"), at("huge.ma"), at("no/such/folder/x.ma"));
    fs::write(&ball, "1 0 0\nv 0 0 0 1\n").expect("written");
    fs::write(&huge, "1 0 0\nv 0 0 0 1e200\n").expect("written");
    let mesh = "builtin:sphere:8";
    let cases: [(&[&str], i32, &str); 9] = [
        (&["info", mesh, "--threads", "100000"], 2, "1024"),
        (&["evaluate", mesh, &ball, "--samples", "99999999999"], 2, "10000000"),
        (&["evaluate", mesh, &ball, "--certify", "1e-9"], 2, "1e-6"),
        (&["evaluate", mesh, &huge], 1, "huge.ma: sphere 0"),
        (&["simplify", mesh, "-m", "qmat", "-o", &nowhere], 1, "there is no folder"),
        (&["simplify", mesh, "-m", "qmat", "-o", "x.xyz"], 1, "\"xyz\" is not one of"),
        (&["simplify", mesh, "-m", "qmat", "--max-error", "inf"], 2, "inf"),
        (&["simplify", mesh, "-m", "qmat", "--set", "k=x"], 2, "k = \"x\""),
        (&["simplify", "builtin:nothing", "-m", "qmat"], 2, "`nothing`"),
    ];
    for (arguments, expected, part) in cases {
        let (code, _, stderr) = run(arguments);
        assert!(code == expected && stderr.contains(part), "{arguments:?}: {code}, {stderr}");
    }
}
