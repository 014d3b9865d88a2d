//! Editions: frozen results next to new ones.

use std::fs;
use std::path::Path;

use medial::metrics::{DEFINITIONS, JudgeOptions};
use medial_bench::study::edition::{Description, Edition};
use medial_reports::editions::EDITIONS;
use medial_run::hash::hex_digest;
use medial_run::input::{Input, Source};
use medial_run::journal::{read_records, write_records};
use serde_json::{Value, json};

use crate::command::Folder;

/// The line of a method in a printed table, as words.
fn row<'o>(stdout: &'o str, method: &str) -> Option<Vec<&'o str>> {
    stdout.lines().find_map(|line| Some(line.strip_prefix(method)?.split_whitespace().collect()))
}

#[test]
fn frozen_rows_are_matched_by_content_and_not_run() {
    let at = Folder::new();
    at.done("datasets make capsule -o a.off");
    fs::copy(at.at("a.off"), at.at("b.off")).expect("copied");
    let study = "--spheres 50,20 --samples 500 --counts-only --out";
    at.done(&format!("compare a.off builtin:sphere --methods qmat,angle {study} test.1"));

    let own = format!("compare b.off builtin:box --methods qmat,qmat:k=0 {study} own");
    let stdout = at.done(&format!("{own} --against ./test.1"));
    let records = at.records("own");
    assert!(records.len() == 8 && records.iter().all(|r| r["simplify"]["method"] == "qmat"));
    // Its seconds are in the last column alone; equal results of `qmat` have one row.
    let angle = row(&stdout, "angle (test.1)").expect("a row");
    assert!(angle[4] == "–" && angle[5].parse::<f64>().is_ok(), "{stdout}");
    assert!(row(&stdout, "qmat k=0").is_some() && row(&stdout, "qmat (test.1)").is_none());
    for note in ["1 mesh is not in edition test.1", ": box;", "has 1 of the 2 meshes"] {
        assert!(stdout.contains(note), "{note}: {stdout}");
    }
    let csv = at.text("own/results.csv");
    assert!(csv.contains("frozen_seconds_total") && !csv.contains("\nbox,"), "{csv}");
    assert!(at.text("own/tables/mesh-b.md").contains("angle (test.1)"));
    assert!(!at.text("own/plots/mesh-b-time.svg").contains("angle"));
    // The study of the store has the edition, so a rebuilt report is the same.
    let page = at.text("own/index.html");
    at.done("report own");
    assert!(page.contains("frozen results of edition test.1") && page == at.text("own/index.html"));
    let (_, object) = at.json(&own);
    assert!(object["run"] == 0 && !at.text("own/index.html").contains("(test.1)"), "{object}");
}

#[test]
fn rows_of_other_versions_are_marked() {
    let at = Folder::new();
    let line = "compare builtin:capsule --spheres 20 --samples 500 --counts-only";
    at.done(&format!("{line} --methods qmat,pmat,angle,lambda --out test.1"));
    // `qmat` with another error and `angle` are of other versions; `pmat` is of another one with the same result.
    let results = at.at("test.1/results.jsonl");
    let mut records = read_records(&results).expect("records").records;
    for record in &mut records {
        if record.simplify.method != "lambda" {
            record.method_version = "0".repeat(64);
        }
        if record.simplify.method == "qmat" {
            record.result_hash = Some("0".repeat(64));
            record.evaluate.as_mut().expect("measured").distances.hausdorff /= 2.0;
        }
    }
    write_records(&results, &records).expect("written");

    let stdout = at.done(&format!("{line} --methods qmat,pmat --against ./test.1 --out own"));
    let [page, table] = ["own/index.html", "own/tables/mesh-capsule.md"].map(|name| at.text(name));
    let note = "qmat: 1 of 1 results differ from those of edition test.1. Hausdorff error here ÷ there: 2.00";
    for text in [&stdout, &page, &table] {
        for (row, is_there) in [
            ("qmat (test.1, other version)", true),
            ("angle (test.1, other version)", true),
            ("lambda (test.1)", true),
            ("pmat (test.1", false), // one row of equal results
        ] {
            assert_eq!(text.contains(row), is_there, "{row}: {text}");
        }
        let text = text.replace("\n  ", " ");
        assert!(text.contains("sources or compiler of the method have changed"), "{text}");
    }
    assert!(stdout.contains(note) && page.contains(note), "{stdout}");
}

#[test]
fn editions_that_do_not_compare_are_refused_before_any_run() {
    let at = Folder::new();
    at.done("compare builtin:capsule --methods pmat --spheres 20 --samples 500 --counts-only -q --out test.1");
    let refused = |line: &str, edition: &str, code: i32, message: &str| {
        let line = format!("compare {line} --against {edition} --methods pmat --spheres 20");
        at.refused(&format!("{line} --out own"), code, message);
        assert!(!at.has("own"), "nothing is written");
    };
    let samples = "--samples 10000: edition test.1 was measured with 500";
    refused("builtin:capsule", "./test.1", 2, samples);
    let seeded = "builtin:capsule --samples 500 --seed 1";
    refused(seeded, "./test.1", 2, "--seed 1: edition test.1");
    refused("builtin:box --samples 500", "./test.1", 2, "no mesh of this comparison");
    refused("builtin:capsule", "2027.11", 2, "did you mean `2027.1`?");
    at.write("test.1/results.jsonl", "");
    refused("builtin:capsule --samples 500", "./test.1", 1, "test.1: no record");
}

#[test]
fn stored_results_have_the_numbers_of_their_edition() {
    for embedded in EDITIONS {
        let folder =
            format!("{}/../reports/editions/{}", env!("CARGO_MANIFEST_DIR"), embedded.name);
        assert!(embedded.records.len() < 4 << 20, "{} bytes", embedded.records.len());
        let edition = Edition::open(Path::new(embedded.name)).expect("an edition");
        let hash = format!("sha256 = \"{}\"", hex_digest(embedded.records));
        assert!(embedded.description.contains(&hash), "the records have changed");
        assert!(edition.description.metrics <= DEFINITIONS);
        if edition.description.metrics < DEFINITIONS {
            continue;
        }
        let mut kept = edition.records.clone();
        kept.retain(|record| record.artifact.is_some());
        assert!(kept.len() >= 5, "{} results", kept.len());
        for record in kept {
            let mesh = edition.description.mesh.iter().find(|mesh| mesh.name == record.mesh);
            let source = Source::parse(Path::new(&mesh.expect("its mesh").source));
            let input = Input::load(&source.expect("a source")).expect("a mesh");
            let shape = input.shape(Default::default()).expect("a shape");
            let Description { samples, volume_depth, seed, .. } = edition.description;
            let options = JudgeOptions { samples, volume_depth, seed };
            let judge = shape.judge(input.axis.as_ref(), options).expect("a judge");
            let path = Path::new(&folder).join(record.artifact.as_deref().unwrap_or_default());
            let axis = medial::complex::read(&path).expect("a medial mesh").mesh;
            let to_normal = shape.normalisation();
            let axis = axis.to_normal(to_normal);
            let evaluation = judge.evaluate(&axis).expect("an evaluation");
            let mut moved = vec![];
            compare("", &json!(record.evaluate), &json!(evaluation), &mut moved);
            assert!(
                moved.is_empty(),
                "{}: {moved:?}; increase medial::metrics::DEFINITIONS and freeze a new edition",
                path.display()
            );
        }
    }
}

/// Lists the numbers of two evaluations that differ by more than 1e-9.
fn compare(path: &str, old: &Value, new: &Value, moved: &mut Vec<String>) {
    match (old, new) {
        // Added later, or certified in the edition alone.
        (Value::Null, _) | (_, Value::Null) => {}
        (Value::Object(old), Value::Object(new)) => {
            for (key, old) in old {
                compare(&format!("{path}/{key}"), old, &new[key], moved);
            }
        }
        (Value::Array(old), Value::Array(new)) => {
            for (k, old) in old.iter().enumerate() {
                compare(&format!("{path}/{k}"), old, &new[k], moved);
            }
        }
        (Value::Number(a), Value::Number(b)) => {
            let [a, b] = [a, b].map(|number| number.as_f64().unwrap_or(f64::NAN));
            if (a - b).abs() > 1e-9 {
                moved.push(format!("{path}: {a}, {b}"));
            }
        }
        _ => {}
    }
}
