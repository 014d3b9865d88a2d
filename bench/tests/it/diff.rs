//! `medial diff`: exit codes, and two builds that run alternately.

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
    let printed = done(&["diff", &old, &new]);
    assert!(printed.starts_with("# No regression") && printed.contains("2 results"), "{printed}");

    worsen(&new, 1.01);
    let (code, object) = json(&["diff", &old, &new]);
    assert_eq!((code, object["changes"][0]["what"].as_str()), (4, Some("evaluate.hausdorff")));
    let printed = done(&["diff", &old, &new, "--error", "0.02"]);
    assert!(printed.contains("Changed otherwise: 1 change"), "{printed}");
    let printed = done(&["diff", &new, &old]);
    assert!(printed.contains("1 improvement"), "{printed}");
    refused(&["diff", &old, "no-such-folder"], 1, "no-such-folder");
    refused(&["diff", &old, &new, "--error", "nan"], 2, "--error");
}

#[test]
fn two_builds_take_turns() {
    let at = folder();
    let (study, out) = (at("study.toml"), at("out"));
    let text = "meshes = [\"builtin:torus:24\"]\nspheres = [30]\ncounts_only = true\n[[method]]\nid = \"pmat\"\n";
    fs::write(&study, text).unwrap();
    let options = ["--study", &study, "--out", &out, "--repeat", "5", "-q"];
    let arguments = [&["diff", "--run", MEDIAL, MEDIAL], &options[..]].concat();
    let first = run(&arguments);
    // On a busy machine one build may be slower, but exact quantities are equal.
    assert!(first.0 == 0 || first.0 == 4, "{first:?}");
    let diff: Value = serde_json::from_slice(&fs::read(at("out/diff.json")).unwrap()).unwrap();
    assert_eq!(
        (diff["compared"].as_u64(), diff["changes"].as_array().unwrap().len()),
        (Some(1), 0)
    );
    for side in ["out/old", "out/new"] {
        assert_eq!(records(at(side))[0]["repetitions"].as_array().unwrap().len(), 5);
    }
    // All results exist: nothing runs again.
    assert_eq!(run(&arguments), first);
    let foreign = [&["diff", "--run", "/bin/echo", MEDIAL], &options[..]].concat();
    refused(&foreign, 1, "echo: not a build of medial (`--version` printed \"");
    // Programs with the name of the command that are no workers, or those of another protocol.
    for (k, (script, found)) in [
        ("exit 0", "the process ended with exit code 0"),
        ("printf '\\n\\036\"Measuring\"\\n'; read line", "no protocol"),
        ("printf '\\n\\036{\"Ready\":0}\\n'; read line", "protocol 0"),
    ]
    .into_iter()
    .enumerate()
    {
        let (program, out) = (at(&format!("foreign-{k}")), at(&format!("out-{k}")));
        let text =
            format!("#!/bin/sh\n[ \"$1\" = --version ] && echo medial 0.1.0 && exit\n{script}\n");
        fs::write(&program, text).unwrap();
        #[cfg(unix)]
        fs::set_permissions(&program, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
        let foreign = ["diff", "--run", MEDIAL, &program, "--study", &study, "--out", &out, "-q"];
        let expected = format!("foreign-{k}: not a worker of this build (found {found}, expected");
        refused(&foreign, 1, &expected);
    }
    let here = ["diff", "--run", MEDIAL, MEDIAL, "--study", &study, "--out", &at(".")];
    refused(&here, 1, "neither empty nor a folder of results");
}
