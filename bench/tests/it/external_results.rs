//! Results of other programs in `medial compare`: folders with claims, surfaces, files that change.

use std::fs;

use medial_bench::study::source::{Input, Source};
use serde_json::{Value, json};

use crate::command::{done, folder, records};

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
    fs::create_dir(at("theirs")).expect("a folder");
    for count in ["20", "30"] {
        let file = at(&format!("theirs/capsule-{count}.ma"));
        done(&["simplify", "builtin:capsule", "-m", "qmat", "--spheres", count, "-o", &file]);
    }
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
    assert_eq!(first.hash, medial_bench::provenance::hex_digest(text.as_bytes()));
    fs::write(&file, text.replace("0 0 1\n", "0 0 2\n")).expect("written");
    let second = Input::load(&source).expect("a solid");
    assert_ne!(first.hash, second.hash);
    assert_eq!((first.mesh.vertices[3].z, second.mesh.vertices[3].z), (1.0, 2.0));
}
