//! `medial diff`: exit codes, and two builds that take turns.

use std::fs;
use std::path::Path;

use crate::common::{code, run, stderr};
use serde_json::Value;

const MEDIAL: &str = env!("CARGO_BIN_EXE_medial");

fn medial(arguments: &[&str]) -> (i32, String) {
    let output = run(MEDIAL, arguments);
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    (code(&output), if text.is_empty() { stderr(&output) } else { text })
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Changes the Hausdorff error of the last record of a folder.
fn worsen(folder: &Path, factor: f64) {
    let path = folder.join("results.jsonl");
    let lines = fs::read_to_string(&path).unwrap();
    let mut lines: Vec<Value> =
        lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let error = &mut lines.last_mut().unwrap()["evaluate"]["hausdorff"];
    *error = (error.as_f64().unwrap() * factor).into();
    let lines: Vec<String> = lines.iter().map(Value::to_string).collect();
    fs::write(&path, lines.join("\n") + "\n").unwrap();
}

#[test]
fn two_folders_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let [old, new] = ["old", "new"].map(|name| folder.path().join(name));
    let common = ["--methods", "pmat,angle", "--spheres", "30", "--counts-only", "-q", "--out"];
    for out in [&old, &new] {
        run(MEDIAL, &[&["compare", "builtin:torus:24"], &common[..], &[text(out)]].concat());
    }
    let (code, said) = medial(&["diff", text(&old), text(&new)]);
    assert_eq!(code, 0, "{said}");
    assert!(said.starts_with("# No regression") && said.contains("2 results"), "{said}");

    worsen(&new, 1.01);
    let (code, said) = medial(&["diff", text(&old), text(&new), "--json"]);
    let object: Value = serde_json::from_str(&said).unwrap();
    assert_eq!((code, object["changes"][0]["what"].as_str()), (4, Some("evaluate.hausdorff")));
    let (code, said) = medial(&["diff", text(&old), text(&new), "--error", "0.02"]);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("Changed otherwise: 1 change"), "{said}");
    let (code, said) = medial(&["diff", text(&new), text(&old)]);
    assert_eq!(code, 0);
    assert!(said.contains("1 improvement"), "{said}");

    let (code, said) = medial(&["diff", text(&old), text(&folder.path().join("none"))]);
    assert!(code == 1 && said.contains("none"), "{code} {said}");
    let (code, said) = medial(&["diff", text(&old), text(&new), "--error", "-1"]);
    assert!(code == 2, "{code} {said}");
}

#[test]
fn two_builds_take_turns() {
    let folder = tempfile::tempdir().unwrap();
    let (study, out) = (folder.path().join("study.toml"), folder.path().join("out"));
    let asked = "meshes = [\"builtin:torus:24\"]\nspheres = [30]\ncounts_only = true\n[[method]]\nid = \"pmat\"\n";
    fs::write(&study, asked).unwrap();
    let (study, out_text) = (text(&study), text(&out));
    let [run, builds] = [["diff", "--run"], [MEDIAL, MEDIAL]];
    let options = ["--study", study, "--out", out_text, "--repeat", "5", "-q"];
    let arguments = [&run[..], &builds, &options].concat();
    let (code, first) = medial(&arguments);
    // The machine may be so busy that one is slower: exact quantities are equal all the same.
    assert!(code == 0 || code == 4, "{first}");
    let told: Value = serde_json::from_slice(&fs::read(out.join("diff.json")).unwrap()).unwrap();
    assert_eq!(
        (told["compared"].as_u64(), told["changes"].as_array().unwrap().len()),
        (Some(1), 0)
    );
    for side in ["old", "new"] {
        let lines = fs::read_to_string(out.join(side).join("results.jsonl")).unwrap();
        let record: Value = serde_json::from_str(lines.trim()).unwrap();
        assert_eq!(record["repetitions"].as_array().unwrap().len(), 5);
    }
    // All is there: nothing is run again.
    assert_eq!(medial(&arguments), (code, first));

    let mut foreign = arguments.clone();
    foreign[2] = "/bin/echo";
    let (code, said) = medial(&foreign);
    assert!(code == 1 && said.contains("no build of this program"), "{code} {said}");
}
