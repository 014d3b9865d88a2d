//! `medial diff`: exit codes, and two builds that run alternately.

use serde_json::{Value, json};

use crate::command::{Folder, MEDIAL, number};

#[test]
fn two_folders_are_compared() {
    let at = Folder::new();
    let line = "compare builtin:torus:24 --methods pmat,angle --spheres 30 --counts-only -q --out";
    for out in ["old", "new"] {
        at.done(&format!("{line} {out}"));
    }
    let printed = at.done("diff old new");
    assert!(printed.starts_with("# No regression") && printed.contains("2 results"), "{printed}");

    // The error of the last result rises by 1 %.
    let mut lines = at.records("new");
    let error = &mut lines.last_mut().expect("a record")["evaluate"]["hausdorff"];
    *error = (number(error) * 1.01).into();
    let lines: Vec<String> = lines.iter().map(Value::to_string).collect();
    at.write("new/results.jsonl", lines.join("\n") + "\n");
    let (code, object) = at.json("diff old new");
    assert_eq!((code, object["changes"][0]["what"].as_str()), (4, Some("evaluate.hausdorff")));
    let printed = at.done("diff new old");
    assert!(printed.contains("1 improvement"), "{printed}");
    at.refused("diff old no-such-folder", 1, "no-such-folder");
}

#[test]
fn two_builds_take_turns() {
    let at = Folder::new();
    let text = "meshes = [\"builtin:torus:24\"]\nspheres = [30]\ncounts_only = true\n[[method]]\nid = \"pmat\"\n";
    at.write("study.toml", text);
    let diff = |old: &str, new: &str, out: &str| {
        format!("diff --run {old} {new} --study study.toml --out {out} --repeat 5 -q")
    };
    let line = diff(MEDIAL, MEDIAL, "out");
    let first = at.run(&line);
    // On a busy machine one build may be slower, but exact quantities are equal.
    assert!(first.0 == 0 || first.0 == 4, "{first:?}");
    let found: Value = serde_json::from_str(&at.text("out/diff.json")).expect("JSON");
    assert_eq!([&found["compared"], &found["changes"]], [&json!(1), &json!([])]);
    for side in ["out/old", "out/new"] {
        assert_eq!(at.records(side)[0]["repetitions"].as_array().map(Vec::len), Some(5));
    }
    // All results exist: nothing runs again.
    assert_eq!(at.run(&line), first);
    let why = "echo: not a build of medial (`--version` printed \"";
    at.refused(&diff("/bin/echo", MEDIAL, "out"), 1, why);
    // Programs with the name of the command that are no workers, or those of another protocol.
    for (k, (script, found)) in [
        ("exit 0", "the process ended with exit code 0"),
        ("printf '\\n\\036\"Measuring\"\\n'; read line", "no protocol"),
        ("printf '\\n\\036{\"Ready\":0}\\n'; read line", "protocol 0"),
    ]
    .into_iter()
    .enumerate()
    {
        let program = at.at(format!("foreign-{k}"));
        let text =
            format!("#!/bin/sh\n[ \"$1\" = --version ] && echo medial 0.1.0 && exit\n{script}\n");
        at.write(&program, text);
        #[cfg(unix)]
        std::fs::set_permissions(&program, std::os::unix::fs::PermissionsExt::from_mode(0o755))
            .expect("permitted");
        let why = format!("foreign-{k}: not a worker of this build (found {found}, expected");
        at.refused(&diff(MEDIAL, &program.to_string_lossy(), &format!("out-{k}")), 1, &why);
    }
    at.refused(&diff(MEDIAL, MEDIAL, "."), 1, "neither empty nor a folder of results");
}
