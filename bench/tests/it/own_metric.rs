//! `medial report --metric`: numbers that a program of the user prints.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;

use crate::command::Folder;

/// A comparison, and a program that prints the number of spheres and faces of a medial mesh.
fn compared() -> Folder {
    let at = Folder::new();
    at.done(
        "compare builtin:capsule --methods qmat,pmat --spheres 30,20 --counts-only --samples 500 --out 1",
    );
    at.write("faces", "#!/bin/sh\nhead -n 1 \"$1\" >&2\nawk 'NR == 1 { print $1 + $3 }' \"$2\"\n");
    fs::set_permissions(at.at("faces"), fs::Permissions::from_mode(0o755)).expect("executable");
    at
}

/// The values of a column of `results.csv` by the file of the result; none where the column is missing.
fn column(at: &Folder, store: &str, name: &str) -> BTreeMap<String, String> {
    let text = at.text(format!("{store}/results.csv"));
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let headers = reader.headers().expect("a header").clone();
    let place = |name: &str| headers.iter().position(|header| header == name);
    let Some(values) = place(name) else { return BTreeMap::new() };
    let artifacts = place("artifact").expect("a column");
    let rows = reader.records().map(|row| row.expect("a row"));
    rows.map(|row| (row[artifacts].to_owned(), row[values].to_owned())).collect()
}

#[test]
fn a_number_of_a_program_is_a_column_and_a_criterion() {
    let at = compared();
    let records = at.text("1/results.jsonl");
    at.done("report 1 --metric faces,higher=./faces");
    let faces = column(&at, "1", "metric_faces");
    assert_eq!(faces.len(), 4);
    for (artifact, value) in &faces {
        let text = at.text(format!("1/{artifact}"));
        let head = text.lines().next().expect("a head").split(' ');
        let counts: Vec<f64> = head.map(|count| count.parse().expect("a count")).collect();
        assert_eq!(value.parse(), Ok(counts[0] + counts[2]));
    }
    assert!(at.text("1/tables/mesh-capsule.md").contains("faces ↑"));
    assert!(at.text("1/tables/overview-purpose.md").contains("highest faces at 30 spheres"));
    assert_eq!(at.text("1/results.jsonl"), records, "records stay as they were measured");

    // Each result is measured once: the program is no longer needed. Merged stores keep the numbers.
    fs::remove_file(at.at("faces")).expect("removed");
    let (_, object) = at.json("report 1 --metric faces,higher=./faces --out 2");
    assert_eq!(object["warnings"].as_array().map(Vec::len), Some(0), "{object}");
    assert_eq!(column(&at, "2", "metric_faces"), faces);
    at.done("compare builtin:capsule --methods qmat,pmat --spheres 30,20 --counts-only --samples 500 --out 1 --fresh");
    assert_eq!(column(&at, "1", "metric_faces"), faces, "equal results have equal numbers");
}

#[test]
fn a_program_without_a_number_is_named() {
    let at = compared();
    for (program, words) in [
        ("false", "false: exit status: 1"),
        ("echo", "expected a number"),
        ("./none", "./none: No such"),
    ] {
        let (code, object) = at.json(&format!("report 1 --metric mine={program}"));
        let warnings = object["warnings"].as_array().expect("warnings");
        assert_eq!((code, warnings.len()), (3, 4), "{object}");
        assert!(
            warnings.iter().all(|warning| warning.as_str().is_some_and(|w| w.contains(words))),
            "{object}"
        );
        assert!(column(&at, "1", "metric_mine").is_empty());
    }
    at.refused("report 1 --metric mine", 2, "expected METRIC=PROGRAM");
    at.refused("report 1 --metric mine,best=true", 2, "expected `lower`, `higher` or `neither`");
    at.write("1/metrics.json", "{\"mine\": {\"values\": {\"0\": \"high\"}}}");
    at.refused("report 1", 1, "metrics.json");
}

/// The same file as result on two meshes of one name is measured with the surface of each.
#[test]
fn a_number_belongs_to_a_mesh_and_a_result() {
    let at = Folder::new();
    at.write("ball.ma", "1 0 0\nv 0 0 0 0.5\n");
    at.write("size", "#!/bin/sh\nwc -l < \"$1\"\n");
    fs::set_permissions(at.at("size"), fs::Permissions::from_mode(0o755)).expect("executable");
    for resolution in [8, 12] {
        fs::create_dir(at.at(resolution.to_string())).expect("a folder");
        at.done(&format!(
            "datasets make sphere --resolution {resolution} -o {resolution}/mesh.off"
        ));
        at.done(&format!(
            "compare {resolution}/mesh.off --given theirs=ball.ma --methods qmat --spheres 20 --counts-only \
             --samples 500 --out store-{resolution}"
        ));
    }
    at.done("report store-8 --metric size=./size");
    at.done("report store-12 --metric size=./size");
    let sizes = ["store-8", "store-12"].map(|store| {
        let all = column(&at, store, "metric_size");
        all.into_values().next().expect("a number")
    });
    at.done("report store-8 store-12 --out both");
    let merged: std::collections::BTreeSet<String> =
        column(&at, "both", "metric_size").into_values().collect();
    assert!(sizes[0] != sizes[1] && merged == sizes.into_iter().collect(), "{merged:?}");
}
