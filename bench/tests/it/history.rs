//! `medial history`: runs, change points and exit codes.

use crate::command::Folder;

const COMMIT: &str = "0123456789abcdef0123456789abcdef01234567";

#[test]
fn a_run_is_added_once_and_a_regression_ends_in_code_4() {
    let at = Folder::new();
    at.done("compare builtin:torus:16 --methods qmat,angle --spheres 100 --samples 500 --counts-only --out store");

    let add = |commit| format!("history history --add store --date 2026-11-23 --commit {commit}");
    let (code, object) = at.json(&add(COMMIT));
    let file = object["added"].as_str().unwrap_or_else(|| panic!("{object}")).to_owned();
    assert_eq!((code, &object["regressions"]), (0, &0.into()));
    assert!(at.json(&add(COMMIT)).1["added"].is_null(), "a run is added once");
    at.refused(&add("HEAD"), 1, "--commit HEAD");
    // A run needs its commit.
    at.refused("history history --add store", 2, "--commit");
    assert!(at.done("history history").starts_with("# First run, nothing to compare"));

    let text = at.text(&file);
    let worse = text
        .replace(COMMIT, &COMMIT.replace('0', "f"))
        .replace("2026-11-23", "2026-11-24")
        .replacen("\"evaluate.betti\":[1,1,0]", "\"evaluate.betti\":[1,2,0]", 1);
    assert!(worse.contains("[1,2,0]"), "{worse}");
    at.write("history/2026-11-24-f1234567.json", worse);
    // A damaged file is reported, and the others are read.
    at.write("history/2026-11-25-00000000.json", "nothing");
    let (code, object) = at.json("history history");
    assert_eq!((code, &object["regressions"]), (4, &1.into()), "{object}");
    assert_eq!(object["changes"][0]["last_before"]["commit"], COMMIT);
    assert!(object["warnings"].to_string().contains("2026-11-25-00000000.json"), "{object}");
}

#[test]
fn an_empty_history_ends_in_code_5() {
    let at = Folder::new();
    at.refused("history .", 5, "no run");
    at.refused("history none", 1, "none");
}
