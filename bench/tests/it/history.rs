//! `medial history`: runs, change points and exit codes.

use std::fs;

use crate::command::{done, folder, json, refused};

const COMMIT: &str = "0123456789abcdef0123456789abcdef01234567";

#[test]
fn a_run_is_added_once_and_a_regression_ends_in_code_4() {
    let at = folder();
    let (store, history) = (at("store"), at("history"));
    let compare = ["compare", "builtin:torus:16", "--methods", "qmat,angle", "--spheres", "100"];
    let more = ["--samples", "500", "--counts-only", "--out", &store];
    done(&[&compare[..], &more].concat());

    let add = ["history", &history, "--add", &store, "--date", "2026-11-23", "--commit"];
    let with = |commit| [&add[..], &[commit]].concat();
    let (code, object) = json(&with(COMMIT));
    let file = object["added"].as_str().unwrap_or_else(|| panic!("{object}")).to_owned();
    assert_eq!((code, &object["regressions"]), (0, &0.into()));
    assert!(json(&with(COMMIT)).1["added"].is_null(), "a run is added once");
    refused(&with("HEAD"), 1, "--commit HEAD");
    // A run needs its commit.
    refused(&["history", &history, "--add", &store], 2, "--commit");
    assert!(done(&["history", &history]).starts_with("# First run, nothing to compare"));

    let text = fs::read_to_string(&file).expect("a run");
    let worse = text
        .replace(COMMIT, &COMMIT.replace('0', "f"))
        .replace("2026-11-23", "2026-11-24")
        .replacen("\"evaluate.betti\":[1,1,0]", "\"evaluate.betti\":[1,2,0]", 1);
    assert!(worse.contains("[1,2,0]"), "{worse}");
    fs::write(at("history/2026-11-24-f1234567.json"), worse).expect("written");
    // A damaged file is reported, and the others are read.
    fs::write(at("history/2026-11-25-00000000.json"), "nothing").expect("written");
    let (code, object) = json(&["history", &history]);
    assert_eq!((code, &object["regressions"]), (4, &1.into()), "{object}");
    assert_eq!(object["changes"][0]["last_before"]["commit"], COMMIT);
    assert!(object["warnings"].to_string().contains("2026-11-25-00000000.json"), "{object}");
}

#[test]
fn an_empty_history_ends_in_code_5() {
    let at = folder();
    refused(&["history", &at(".")], 5, "no run");
    refused(&["history", &at("none")], 1, "none");
}
