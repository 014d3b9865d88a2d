//! `medial diff`: exit codes, and two builds that take turns.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::command::{MEDIAL, done, folder, json, records, refused, run};

/// Changes the Hausdorff error of the last record of a folder.
fn worsen(folder: &str, factor: f64) {
    let mut lines = records(folder);
    let error = &mut lines.last_mut().unwrap()["evaluate"]["hausdorff"];
    *error = (error.as_f64().unwrap() * factor).into();
    let lines: Vec<String> = lines.iter().map(Value::to_string).collect();
    let path = Path::new(folder).join("results.jsonl");
    fs::write(path, lines.join("\n") + "\n").unwrap();
}

#[test]
fn two_folders_are_compared() {
    let at = folder();
    let [old, new] = ["old", "new"].map(&at);
    let common = ["--methods", "pmat,angle", "--spheres", "30", "--counts-only", "-q", "--out"];
    for out in [&old, &new] {
        done(&[&["compare", "builtin:torus:24"], &common[..], &[out]].concat());
    }
    let said = done(&["diff", &old, &new]);
    assert!(said.starts_with("# No regression") && said.contains("2 results"), "{said}");

    worsen(&new, 1.01);
    let (code, object) = json(&["diff", &old, &new]);
    assert_eq!((code, object["changes"][0]["what"].as_str()), (4, Some("evaluate.hausdorff")));
    let said = done(&["diff", &old, &new, "--error", "0.02"]);
    assert!(said.contains("Changed otherwise: 1 change"), "{said}");
    let said = done(&["diff", &new, &old]);
    assert!(said.contains("1 improvement"), "{said}");
    refused(&["diff", &old, "no-such-folder"], 1, "no-such-folder");
    refused(&["diff", &old, &new, "--error", "nan"], 2, "--error");
}

#[test]
fn two_builds_take_turns() {
    let at = folder();
    let (study, out) = (at("study.toml"), at("out"));
    let asked = "meshes = [\"builtin:torus:24\"]\nspheres = [30]\ncounts_only = true\n[[method]]\nid = \"pmat\"\n";
    fs::write(&study, asked).unwrap();
    let options = ["--study", &study, "--out", &out, "--repeat", "5", "-q"];
    let arguments = [&["diff", "--run", MEDIAL, MEDIAL], &options[..]].concat();
    let first = run(&arguments);
    // The machine may be so busy that one is slower: exact quantities are equal all the same.
    assert!(first.0 == 0 || first.0 == 4, "{first:?}");
    let told: Value = serde_json::from_slice(&fs::read(at("out/diff.json")).unwrap()).unwrap();
    assert_eq!(
        (told["compared"].as_u64(), told["changes"].as_array().unwrap().len()),
        (Some(1), 0)
    );
    for side in ["out/old", "out/new"] {
        assert_eq!(records(at(side))[0]["repetitions"].as_array().unwrap().len(), 5);
    }
    // All is there: nothing is run again.
    assert_eq!(run(&arguments), first);
    let foreign = [&["diff", "--run", "/bin/echo", MEDIAL], &options[..]].concat();
    refused(&foreign, 1, "no build of this program");
    let here = ["diff", "--run", MEDIAL, MEDIAL, "--study", &study, "--out", &at(".")];
    refused(&here, 1, "neither empty nor a folder of results");
}
