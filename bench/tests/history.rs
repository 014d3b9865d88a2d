//! `medial history` as its users meet it.

use std::fs;

mod command;
use command::{json, run, text_path};

const COMMIT: &str = "0123456789abcdef0123456789abcdef01234567";

#[test]
fn a_night_is_added_once_and_shown() {
    let dir = tempfile::tempdir().expect("a folder");
    let (store, history) = (dir.path().join("store"), dir.path().join("history"));
    let page = dir.path().join("page.html");
    let (store, history) = (text_path(&store), text_path(&history));
    let (code, ..) = run(&[
        "compare",
        "builtin:torus:16",
        "--methods",
        "qmat,angle",
        "--spheres",
        "100",
        "--samples",
        "500",
        "--counts-only",
        "--out",
        store,
    ]);
    assert_eq!(code, 0);
    let add = ["history", "add", store, "--to", history, "--date", "2026-11-23", "--commit"];
    let with = |commit| [&add[..], &[commit]].concat();
    let (code, object) = json(&with(COMMIT));
    assert_eq!((code, &object["new"], &object["series"]), (0, &true.into(), &2.into()), "{object}");
    let file = fs::read_to_string(object["file"].as_str().expect("a path")).expect("a file");
    assert!(file.contains("torus-16\tqmat\t100 spheres\tok\t"), "{file}");
    let (code, object) = json(&with(COMMIT));
    assert_eq!((code, &object["new"]), (0, &false.into()));
    let (code, _, stderr) = run(&with("HEAD"));
    assert_eq!(code, 1);
    assert!(stderr.contains("hexadecimal"), "{stderr}");

    let (code, stdout, stderr) = run(&["history", "show", history, "-o", text_path(&page)]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("began nothing for the worse"), "{stdout}");
    assert!(fs::read_to_string(&page).expect("a page").contains("</html>"));

    // A topology that is lost is told on its night, with the commits, and ends in code 4.
    let worse = file
        .replace(COMMIT, &COMMIT.replace('0', "f"))
        .replace("2026-11-23", "2026-11-24")
        .replacen("\tright\t", "\twrong\t", 1);
    assert!(worse.contains("\twrong\t"));
    fs::write(dir.path().join("history/2026-11-24-f1234567.tsv"), worse).expect("written");
    let (code, object) = json(&["history", "show", history]);
    assert_eq!(code, 4, "{object}");
    assert_eq!(object["regressions"], 1);
    assert_eq!(object["changes"][0]["commits"]["last_before"]["commit"], COMMIT);

    // A damaged file is named, and the rest shown.
    fs::write(dir.path().join("history/2026-11-25-00000000.tsv"), "nothing").expect("written");
    let (code, stdout, stderr) = run(&["history", "show", history]);
    assert_eq!(code, 4, "{stdout}");
    assert!(stderr.contains("2026-11-25-00000000.tsv: line 1"), "{stderr}");
}

#[test]
fn an_empty_history_is_said_to_be_one() {
    let dir = tempfile::tempdir().expect("a folder");
    let (code, _, stderr) = run(&["history", "show", text_path(dir.path())]);
    assert_eq!(code, 5);
    assert!(stderr.contains("no night"), "{stderr}");
    let (code, ..) = run(&["history", "show", text_path(&dir.path().join("none"))]);
    assert_eq!(code, 1);
}
