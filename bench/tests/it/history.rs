//! `medial history` as its users meet it.

use std::fs;

use crate::command::{json, run, text_path};

const COMMIT: &str = "0123456789abcdef0123456789abcdef01234567";

#[test]
fn a_run_is_added_once_and_a_regression_ends_in_code_4() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = |name: &str| text_path(&dir.path().join(name)).to_owned();
    let (store, history, page) = (path("store"), path("history"), path("page.html"));
    let compare = ["compare", "builtin:torus:16", "--methods", "qmat,angle", "--spheres", "100"];
    let more = ["--samples", "500", "--counts-only", "--out", &store];
    assert_eq!(run(&[&compare[..], &more].concat()).0, 0);

    let add = ["history", &history, "--add", &store, "--date", "2026-11-23", "--commit"];
    let with = |commit| [&add[..], &[commit]].concat();
    let (code, object) = json(&with(COMMIT));
    let file = object["added"].as_str().unwrap_or_else(|| panic!("{object}")).to_owned();
    assert_eq!((code, &object["regressions"]), (0, &0.into()));
    assert!(json(&with(COMMIT)).1["added"].is_null(), "a run is added once");
    let (code, _, stderr) = run(&with("HEAD"));
    assert!(code == 1 && stderr.contains("--commit HEAD"), "{stderr}");
    assert_eq!(run(&["history", &history, "--add", &store]).0, 2, "a run needs its commit");

    let (code, stdout, stderr) = run(&["history", &history, "-o", &page]);
    assert!(code == 0 && stdout.contains("no regression"), "{stdout}{stderr}");
    assert!(fs::read_to_string(&page).expect("a page").contains("</html>"));

    let text = fs::read_to_string(&file).expect("a run");
    let worse = text
        .replace(COMMIT, &COMMIT.replace('0', "f"))
        .replace("2026-11-23", "2026-11-24")
        .replacen("\"topology\":true", "\"topology\":false", 1);
    assert!(worse.contains("\"topology\":false"), "{worse}");
    fs::write(dir.path().join("history/2026-11-24-f1234567.json"), worse).expect("written");
    // A damaged file is reported, and the others are read.
    fs::write(dir.path().join("history/2026-11-25-00000000.json"), "nothing").expect("written");
    let (code, object) = json(&["history", &history]);
    assert_eq!((code, &object["regressions"]), (4, &1.into()), "{object}");
    assert_eq!(object["changes"][0]["last_before"]["commit"], COMMIT);
    assert!(object["warnings"].to_string().contains("2026-11-25-00000000.json"), "{object}");
}

#[test]
fn an_empty_history_ends_in_code_5() {
    let dir = tempfile::tempdir().expect("a folder");
    let (code, _, stderr) = run(&["history", text_path(dir.path())]);
    assert!(code == 5 && stderr.contains("no run"), "{stderr}");
    assert_eq!(run(&["history", text_path(&dir.path().join("none"))]).0, 1);
}
