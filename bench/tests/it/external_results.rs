//! Results of other programs in `medial compare`: folders with claims, surfaces, files that change.

use std::fs;

use medial_run::input::{Input, Source};
use serde_json::{Value, json};

use crate::command::{done, folder, records, run, words};

/// A folder `theirs` of medial meshes of the built-in capsule: each a number of spheres and a name.
fn theirs(at: &impl Fn(&str) -> String, meshes: &[(&str, &str)]) -> String {
    fs::create_dir(at("theirs")).expect("a folder");
    for (count, name) in meshes {
        let file = at(&format!("theirs/{name}.ma"));
        done(&["simplify", "builtin:capsule", "-m", "qmat", "--spheres", count, "-o", &file]);
    }
    at("theirs")
}

/// The records of external results among those of `medial compare --given theirs=GIVEN`.
fn compared_with(given: &str, out: &str) -> Vec<Value> {
    let given = format!("theirs={given}");
    let words = ["compare", "builtin:capsule", "--methods", "qmat", "--counts-only"];
    done(&[&words[..], &["--samples", "500", "--given", &given, "--out", out]].concat());
    records(out).into_iter().filter(|record| record["status"] == "external").collect()
}

#[test]
fn only_title_citation_and_seconds_of_a_folder_are_claims() {
    let at = folder();
    theirs(&at, &[("20", "capsule-20"), ("30", "capsule-30")]);
    let claims =
        "title = \"Their method\"\ncitation = \"Them, 2026\"\nseconds = { capsule-20 = 1.5 }\n";
    fs::write(at("theirs/method.toml"), claims).expect("written");
    fs::write(at("theirs/notes.txt"), "of no mesh of the study").expect("written");
    let theirs = compared_with(&at("theirs"), &at("report"));
    assert_eq!(theirs.len(), 2);
    for record in theirs {
        let simplify = &record["simplify"];
        let params = &simplify["params"];
        assert_eq!(
            [&simplify["variant"], &params["title"], &params["citation"]],
            [&json!("theirs"), &json!("Their method"), &json!("Them, 2026")]
        );
        let claimed = (simplify["spheres"] == 20).then_some(1.5);
        assert_eq!(params["claimed_seconds"], json!(claimed), "{record}");
        assert_eq!(simplify["own_seconds"]["simplify"], json!(claimed), "{record}");
        assert!(simplify["seconds"].is_null(), "claims are no measurement: {record}");
        let hausdorff = record["evaluate"]["hausdorff"].as_f64().expect("measured");
        assert!(hausdorff > 0.0 && hausdorff < 0.1, "{hausdorff}");
    }
}

/// A decimated surface is the baseline that any medial mesh should beat.
#[test]
fn surfaces_are_external_results() {
    let at = folder();
    for name in ["capsule.off", "capsule.ply"] {
        done(&["datasets", "make", "capsule", "-o", &at(name)]);
        let theirs = compared_with(&at(name), &at(&format!("{name}-report")));
        let [record] = theirs.as_slice() else { panic!("{theirs:?}") };
        // The surface itself: the distance of its envelope is 0 but for rounding.
        let hausdorff = record["evaluate"]["hausdorff"].as_f64().expect("measured");
        assert!(hausdorff < 1e-9, "{name}: {hausdorff}");
        let warnings = record["simplify"]["warnings"].to_string();
        assert!(warnings.contains("spheres of radius 0"), "{warnings}");
    }
}

#[test]
fn the_hash_of_an_input_is_that_of_the_parsed_bytes() {
    let at = folder();
    let file = at("tetrahedron.off");
    let text = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
    let source = Source::File(file.clone().into());
    fs::write(&file, text).expect("written");
    let first = Input::load(&source).expect("a solid");
    assert_eq!(first.hash, medial_run::hash::hex_digest(text.as_bytes()));
    fs::write(&file, text.replace("0 0 1\n", "0 0 2\n")).expect("written");
    let second = Input::load(&source).expect("a solid");
    assert_ne!(first.hash, second.hash);
    assert_eq!((first.mesh.vertices[3].z, second.mesh.vertices[3].z), (1.0, 2.0));
}

/// The message of `compare --given theirs=GIVEN`, which is refused.
fn refused(given: &str, out: &str) -> String {
    let given = format!("theirs={given}");
    let words =
        ["compare", "builtin:capsule", "--methods", "qmat", "--given", &given, "--out", out];
    let (code, _, message) = run(&words);
    assert_eq!(code, 2, "{message}");
    message
}

#[test]
fn a_forged_folder_is_refused_or_measured() {
    let at = folder();
    let good = theirs(&at, &[("20", "capsule-20")]) + "/capsule-20.ma";
    let mesh = fs::read_to_string(&good).expect("read");
    let long = "x".repeat(200_000);
    let claims = [
        ("hausdorff = 0.0", "unknown field `hausdorff`"),
        ("[evaluate]\nhausdorff = 0.0", "unknown field `evaluate`"),
        ("seconds = { capsule-20 = -1.0 }", "expected a number from 0"),
        ("seconds = { capsule-20 = nan }", "expected a number from 0"),
        ("seconds = { brakcet-40 = 1.5 }", "seconds of \"brakcet-40\": no file"),
        ("bibtex = \"@preamble{x}\"", "expected one entry"),
        ("bibtex = \"@String {x = {y}}\"", "expected one entry"),
        ("bibtex = \"@comment{x}\"", "expected one entry"),
        ("bibtex = \"@preamble(x{}\"", "expected one entry"),
        ("bibtex = \"@misc{x, title = {a}\"", "balanced braces"),
        ("bibtex = \"\\\\input{/etc/passwd}\"", "balanced braces"),
        ("bibtex = \"@misc{a, title = {x}} @misc{b, title = {y}}\"", "expected one entry"),
        ("bibtex = \"@misc{a}, year = {2027}}\"", "expected one entry"),
        ("root:x:0:0:root:/root:/bin/bash", "line 1: "),
        (&format!("{} = 1", "k".repeat(50_000)), "unknown field"),
        (&format!("seconds = {{ \"{}\" = -1.0 }}", "k".repeat(50_000)), "expected a number from 0"),
        (&format!("title = \"{long}\""), "too large"),
    ];
    for (text, reason) in claims {
        fs::write(at("theirs/method.toml"), text).expect("written");
        let message = refused(&at("theirs"), &at("report"));
        assert!(message.contains("method.toml") && message.contains(reason), "{text}: {message}");
        assert!(message.len() < 1_000 && message.trim_end().lines().count() == 1, "{message}");
        assert!(!message.contains("root:x"), "{message}");
    }
    fs::remove_file(at("theirs/method.toml")).expect("removed");

    // Ten gigabytes that take no room on the disk.
    let huge = fs::File::create(at("theirs/capsule-30.ma")).expect("created");
    huge.set_len(10_000_000_000).expect("a sparse file");
    let message = refused(&at("theirs"), &at("report"));
    assert!(message.contains("capsule-30.ma: too large"), "{message}");
    fs::remove_file(at("theirs/capsule-30.ma")).expect("removed");

    fs::rename(&good, at("theirs/elephant-20.ma")).expect("renamed");
    let message = refused(&at("theirs"), &at("report"));
    assert!(message.contains("no file MESH.ma or MESH-COUNT.ma"), "{message}");

    // A count in the name is no claim, nor is text that looks like markup.
    fs::write(at("theirs/capsule-500.ma"), mesh).expect("written");
    let title = "title = \"<script>alert(1)</script>\"\nauthors = \"\u{202e}x\"\n";
    fs::write(at("theirs/method.toml"), title).expect("written");
    let theirs = compared_with(&at("theirs"), &at("report"));
    assert_eq!(theirs[0]["simplify"]["spheres"], 20);
    let page = fs::read_to_string(at("report/index.html")).expect("a page");
    assert!(!page.contains("<script>alert(1)") && !page.contains('\u{202e}'));
}

/// A file of the reader must not show in an error or a report.
#[cfg(unix)]
#[test]
fn links_that_lead_out_of_a_folder_are_refused() {
    use std::os::unix::fs::symlink;
    let at = folder();
    let good = theirs(&at, &[("20", "capsule-20")]) + "/capsule-20.ma";
    fs::write(at("secret"), "password = 1\n").expect("written");
    fs::copy(&good, at("outside.ma")).expect("copied");
    for (link, target) in [
        ("method.toml", at("secret")),
        ("method.toml", "../secret".to_owned()),
        ("method.toml", at("missing")),
        ("capsule-30.ma", at("secret")),
        ("capsule-30.csv", at("outside.ma")),
        ("capsule-30.ma", "/dev/zero".to_owned()),
    ] {
        let path = at(&format!("theirs/{link}"));
        symlink(target, &path).expect("a link");
        let message = refused(&at("theirs"), &at("report"));
        assert!(message.contains(&format!("{link}: a link that leads out")), "{message}");
        assert!(!message.contains("password"), "{message}");
        fs::remove_file(path).expect("removed");
    }
    // A link of the user to the folder, and one in it.
    fs::rename(&good, at("theirs/20.ma")).expect("renamed");
    symlink("20.ma", &good).expect("a link");
    symlink(at("theirs"), at("link")).expect("a link");
    assert_eq!(compared_with(&at("link"), &at("report")).len(), 1);
}

#[test]
fn files_of_a_folder_are_read_or_named() {
    let at = folder();
    theirs(&at, &[("20", "capsule-20")]);
    for (name, spheres) in [("capsule-4.csv", 4), ("capsule-5.sph", 5)] {
        let rows: Vec<String> =
            (0..spheres).map(|k| format!("{} 0 0 0.2", 0.1 * f64::from(k))).collect();
        let text = match name.ends_with("csv") {
            true => format!("x,y,z,r\n{}\n", rows.join("\n").replace(' ', ",")),
            false => format!("{spheres}\n{}\n", rows.join("\n")),
        };
        fs::write(at(&format!("theirs/{name}")), text).expect("written");
    }
    for name in ["README.md", "elephant-20.ma", "capsule-x.ma", "capsule-20.vtp"] {
        fs::write(at(&format!("theirs/{name}")), "").expect("written");
    }
    let given = format!("theirs={}", at("theirs"));
    let words =
        ["compare", "builtin:capsule", "--methods", "qmat", "--counts-only", "--samples", "500"];
    let (code, _, message) =
        run(&[&words[..], &["--given", &given, "--out", &at("report")]].concat());
    let listed = "(README.md, capsule-20.vtp, capsule-x.ma, elephant-20.ma)";
    assert!(code == 0 && message.contains(listed), "{code} {message}");
    let theirs = records(at("report")).into_iter().filter(|record| record["status"] == "external");
    assert_eq!(theirs.count(), 3);
}

#[test]
fn a_count_in_the_name_within_2_percent_is_the_requested_one() {
    let at = folder();
    theirs(&at, &[("99", "capsule-100"), ("50", "capsule-60")]);
    let theirs = compared_with(&at("theirs"), &at("report"));
    let counts = theirs.iter().map(|record| {
        let simplify = &record["simplify"];
        [&simplify["level"]["spheres"], &simplify["spheres"]].map(|n| n.as_u64().expect("a count"))
    });
    assert_eq!(counts.collect::<Vec<_>>(), [[100, 99], [50, 50]]);
}

#[test]
fn a_site_has_a_page_for_each_method_mesh_and_external_result() {
    let at = folder();
    theirs(&at, &[("20", "capsule-20")]);
    let claims = "title = \"Their <method>\"\nbibtex = \"@misc{them, title = {Theirs}}\"\nmachine = \"a laptop\"\n";
    fs::write(at("theirs/method.toml"), claims).expect("written");
    compared_with(&at("theirs"), &at("report"));
    let files = || -> Vec<_> {
        let entries = fs::read_dir(at("report")).expect("a folder").flatten();
        let written = |entry: &fs::DirEntry| entry.metadata().and_then(|data| data.modified());
        let mut all: Vec<_> =
            entries.map(|entry| (entry.file_name(), written(&entry).expect("a time"))).collect();
        all.sort();
        all
    };
    // The store may be read-only: no lock, no new page.
    fs::remove_file(at("report/.lock")).expect("removed");
    let before = files();
    done(&["report", &at("report"), "--site", &at("site")]);
    assert_eq!(files(), before);
    for page in ["index.html", "method-qmat.html", "mesh-capsule.html"] {
        assert!(fs::exists(at(&format!("site/{page}"))).expect("a folder"), "{page}");
    }
    let theirs = fs::read_to_string(at("site/method-theirs.html")).expect("a page");
    assert!(
        theirs.contains("Their &lt;method&gt;")
            && theirs.contains("@misc{them")
            && theirs.contains("a laptop"),
        "{theirs}"
    );
    let bibtex = fs::read_to_string(at("report/tables/methods.bib")).expect("a file");
    assert!(bibtex.contains("@misc{them") && bibtex.contains("medial"), "{bibtex}");
    // Again into the same folder, but not over files of somebody else, such as a store.
    done(&["report", &at("report"), "--site", &at("site")]);
    assert_eq!(run(&["report", &at("report"), "--site", &at("report")]).0, 1);
}

#[test]
fn seeds_are_results_of_one_row() {
    let at = folder();
    let line = "compare builtin:torus builtin:capsule --methods coverage-axis,qmat --spheres 12 --counts-only \
                --seeds 3 --out";
    done(&[&words(line)[..], &[&at("report")]].concat());
    let of = |method: &str| {
        let all =
            records(at("report")).into_iter().filter(move |r| r["simplify"]["method"] == method);
        all.map(|record| record["simplify"]["seed"].as_u64().expect("a seed")).collect::<Vec<_>>()
    };
    assert_eq!(of("coverage-axis"), [0, 1, 2, 0, 1, 2]);
    assert_eq!(of("qmat"), [0, 0], "it depends on no seed");
    let table = fs::read_to_string(at("report/tables/mesh-capsule.md")).expect("a table");
    assert_eq!(table.matches("| coverage-axis |").count(), 1, "{table}");
    assert!(
        table.contains("Hausdorff over seeds") && table.contains("With 3 seeds: coverage-axis"),
        "{table}"
    );
}
