//! Results of other programs in `medial compare`: folders with claims, surfaces, files that change.

use std::fs;

use medial_run::input::{Input, Source};
use serde_json::{Value, json};

use crate::command::{Folder, number};

/// A folder with one of medial meshes of the built-in capsule, `theirs`: each a number of spheres and a name.
fn theirs(meshes: &[(usize, &str)]) -> Folder {
    let at = Folder::new();
    fs::create_dir(at.at("theirs")).expect("a folder");
    for (count, name) in meshes {
        at.done(&format!("simplify builtin:capsule -m qmat --spheres {count} -o theirs/{name}.ma"));
    }
    at
}

/// A comparison with results of this name.
fn compare(given: &str) -> String {
    format!(
        "compare builtin:capsule --methods qmat --counts-only --samples 500 --given theirs={given} --out report"
    )
}

/// The records of external results among those of a comparison.
fn compared_with(at: &Folder, given: &str) -> Vec<Value> {
    at.done(&compare(given));
    at.records("report").into_iter().filter(|record| record["status"] == "external").collect()
}

#[test]
fn only_title_citation_and_seconds_of_a_folder_are_claims() {
    let at = theirs(&[(20, "capsule-20"), (30, "capsule-30")]);
    let claims =
        "title = \"Their method\"\ncitation = \"Them, 2026\"\nseconds = { capsule-20 = 1.5 }\n";
    at.write("theirs/method.toml", claims);
    at.write("theirs/notes.txt", "of no mesh of the study");
    let theirs = compared_with(&at, "theirs");
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
        let hausdorff = number(&record["evaluate"]["hausdorff"]);
        assert!(hausdorff > 0.0 && hausdorff < 0.1, "{hausdorff}");
    }
}

/// A decimated surface is the baseline that any medial mesh should beat.
#[test]
fn surfaces_are_external_results() {
    for name in ["capsule.off", "capsule.ply"] {
        let at = Folder::new();
        at.done(&format!("datasets make capsule -o {name}"));
        let theirs = compared_with(&at, name);
        let [record] = theirs.as_slice() else { panic!("{theirs:?}") };
        // The surface itself: the distance of its envelope is 0 but for rounding.
        let hausdorff = number(&record["evaluate"]["hausdorff"]);
        assert!(hausdorff < 1e-9, "{name}: {hausdorff}");
        let warnings = record["simplify"]["warnings"].to_string();
        assert!(warnings.contains("spheres of radius 0"), "{warnings}");
    }
}

#[test]
fn the_hash_of_an_input_is_that_of_the_parsed_bytes() {
    let at = Folder::new();
    let text = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
    let source = Source::File(at.at("tetrahedron.off"));
    at.write("tetrahedron.off", text);
    let first = Input::load(&source).expect("a solid");
    assert_eq!(first.hash, medial_run::hash::hex_digest(text.as_bytes()));
    at.write("tetrahedron.off", text.replace("0 0 1\n", "0 0 2\n"));
    let second = Input::load(&source).expect("a solid");
    assert_ne!(first.hash, second.hash);
    assert_eq!((first.mesh.vertices[3].z, second.mesh.vertices[3].z), (1.0, 2.0));
}

/// The message of a comparison with `theirs`, which is refused.
fn refused(at: &Folder) -> String {
    let (code, _, message) = at.run(&compare("theirs"));
    assert_eq!(code, 2, "{message}");
    message
}

#[test]
fn a_forged_folder_is_refused_or_measured() {
    let at = theirs(&[(20, "capsule-20")]);
    let mesh = at.text("theirs/capsule-20.ma");
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
        at.write("theirs/method.toml", text);
        let message = refused(&at);
        assert!(message.contains("method.toml") && message.contains(reason), "{text}: {message}");
        assert!(message.len() < 1_000 && message.trim_end().lines().count() == 1, "{message}");
        assert!(!message.contains("root:x"), "{message}");
    }
    fs::remove_file(at.at("theirs/method.toml")).expect("removed");

    // Ten gigabytes that take no room on the disk.
    let huge = at.at("theirs/capsule-30.ma");
    let file = fs::File::create(&huge).expect("created");
    file.set_len(10_000_000_000).expect("a sparse file");
    let message = refused(&at);
    assert!(message.contains("capsule-30.ma: too large"), "{message}");
    fs::remove_file(huge).expect("removed");

    let [good, other] = ["theirs/capsule-20.ma", "theirs/elephant-20.ma"].map(|name| at.at(name));
    fs::rename(good, other).expect("renamed");
    let message = refused(&at);
    assert!(message.contains("no file MESH.ma or MESH-COUNT.ma"), "{message}");

    // A count in the name is no claim, nor is text that looks like markup.
    at.write("theirs/capsule-500.ma", mesh);
    let title = "title = \"<script>alert(1)</script>\"\nauthors = \"\u{202e}x\"\n";
    at.write("theirs/method.toml", title);
    let theirs = compared_with(&at, "theirs");
    assert_eq!(theirs[0]["simplify"]["spheres"], 20);
    let page = at.text("report/index.html");
    assert!(!page.contains("<script>alert(1)") && !page.contains('\u{202e}'));
}

/// A file of the reader must not show in an error or a report.
#[cfg(unix)]
#[test]
fn links_that_lead_out_of_a_folder_are_refused() {
    use std::os::unix::fs::symlink;
    let at = theirs(&[(20, "capsule-20")]);
    let good = at.at("theirs/capsule-20.ma");
    at.write("secret", "password = 1\n");
    fs::copy(&good, at.at("outside.ma")).expect("copied");
    for (link, target) in [
        ("method.toml", at.at("secret")),
        ("method.toml", "../secret".into()),
        ("method.toml", at.at("missing")),
        ("capsule-30.ma", at.at("secret")),
        ("capsule-30.csv", at.at("outside.ma")),
        ("capsule-30.ma", "/dev/zero".into()),
    ] {
        let path = at.at("theirs").join(link);
        symlink(target, &path).expect("a link");
        let message = refused(&at);
        assert!(message.contains(&format!("{link}: a link that leads out")), "{message}");
        assert!(!message.contains("password"), "{message}");
        fs::remove_file(path).expect("removed");
    }
    // A link of the user to the folder, and one in it.
    fs::rename(&good, at.at("theirs/20.ma")).expect("renamed");
    symlink("20.ma", &good).expect("a link");
    symlink(at.at("theirs"), at.at("link")).expect("a link");
    assert_eq!(compared_with(&at, "link").len(), 1);
}

#[test]
fn files_of_a_folder_are_read_or_named() {
    let at = theirs(&[(20, "capsule-20")]);
    for (name, spheres) in [("capsule-4.csv", 4), ("capsule-5.sph", 5)] {
        let rows: Vec<String> =
            (0..spheres).map(|k| format!("{} 0 0 0.2", 0.1 * f64::from(k))).collect();
        let text = match name.ends_with("csv") {
            true => format!("x,y,z,r\n{}\n", rows.join("\n").replace(' ', ",")),
            false => format!("{spheres}\n{}\n", rows.join("\n")),
        };
        at.write(format!("theirs/{name}"), text);
    }
    for name in ["README.md", "elephant-20.ma", "capsule-x.ma", "capsule-20.vtp"] {
        at.write(format!("theirs/{name}"), "");
    }
    let (code, _, message) = at.run(&compare("theirs"));
    let listed = "(README.md, capsule-20.vtp, capsule-x.ma, elephant-20.ma)";
    assert!(code == 0 && message.contains(listed), "{code} {message}");
    assert_eq!(compared_with(&at, "theirs").len(), 3);
}

#[test]
fn a_count_in_the_name_within_2_percent_is_the_requested_one() {
    let at = theirs(&[(99, "capsule-100"), (50, "capsule-60")]);
    let theirs = compared_with(&at, "theirs");
    let counts = theirs.iter().map(|record| {
        let simplify = &record["simplify"];
        [&simplify["level"]["spheres"], &simplify["spheres"]].map(|n| n.as_u64().expect("a count"))
    });
    assert_eq!(counts.collect::<Vec<_>>(), [[100, 99], [50, 50]]);
}

#[test]
fn a_site_has_a_page_for_each_method_mesh_and_external_result() {
    let at = theirs(&[(20, "capsule-20")]);
    let claims = "title = \"Their <method>\"\nbibtex = \"@misc{them, title = {Theirs}}\"\nmachine = \"a laptop\"\n";
    at.write("theirs/method.toml", claims);
    compared_with(&at, "theirs");
    let files = || -> Vec<_> {
        let entries = fs::read_dir(at.at("report")).expect("a folder").flatten();
        let written = |entry: &fs::DirEntry| entry.metadata().and_then(|data| data.modified());
        let mut all: Vec<_> =
            entries.map(|entry| (entry.file_name(), written(&entry).expect("a time"))).collect();
        all.sort();
        all
    };
    // The store may be read-only: no lock, no new page.
    fs::remove_file(at.at("report/.lock")).expect("removed");
    let before = files();
    at.done("report report --site site");
    assert_eq!(files(), before);
    for page in ["index.html", "method-qmat.html", "mesh-capsule.html"] {
        assert!(at.has(format!("site/{page}")), "{page}");
    }
    let theirs = at.text("site/method-theirs.html");
    assert!(
        theirs.contains("Their &lt;method&gt;")
            && theirs.contains("@misc{them")
            && theirs.contains("a laptop"),
        "{theirs}"
    );
    let bibtex = at.text("report/tables/methods.bib");
    assert!(bibtex.contains("@misc{them") && bibtex.contains("medial"), "{bibtex}");
    // Again into the same folder, but not over files of somebody else, such as a store.
    at.done("report report --site site");
    at.refused("report report --site report", 1, "");
}

#[test]
fn seeds_are_results_of_one_row() {
    let at = Folder::new();
    at.done(
        "compare builtin:torus builtin:capsule --methods coverage-axis,qmat --spheres 12 --counts-only --seeds 3 \
         --out report",
    );
    let records = at.records("report");
    let of = |method: &str| {
        let all = records.iter().filter(|record| record["simplify"]["method"] == method);
        all.map(|record| record["simplify"]["seed"].as_u64().expect("a seed")).collect::<Vec<_>>()
    };
    assert_eq!(of("coverage-axis"), [0, 1, 2, 0, 1, 2]);
    assert_eq!(of("qmat"), [0, 0], "it depends on no seed");
    let table = at.text("report/tables/mesh-capsule.md");
    assert_eq!(table.matches("| coverage-axis |").count(), 1, "{table}");
    assert!(
        table.contains("Hausdorff over seeds") && table.contains("With 3 seeds: coverage-axis"),
        "{table}"
    );
}
