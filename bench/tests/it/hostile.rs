//! The command against files and arguments as they come from elsewhere.

use std::fs;
use std::path::Path;

use crate::command::{run, text_path, words};

#[test]
fn deleted_elements_change_no_byte_of_an_evaluation() {
    let dir = tempfile::tempdir().expect("a folder");
    let (plain, flagged) = (dir.path().join("plain.ma"), dir.path().join("flagged.ma"));
    assert_eq!(run(&["axis", "builtin:box", "-o", text_path(&plain)]).0, 0);
    let text = fs::read_to_string(&plain).expect("read");
    // As MATFP writes it, with a deleted sphere far outside at the end.
    let mut lines = text.lines();
    let counts: Vec<usize> =
        lines.next().expect("a header").split(' ').map(|n| n.parse().expect("a count")).collect();
    let mut spheres = String::new();
    let mut simplices = String::new();
    for line in lines {
        match line.as_bytes()[0] {
            b'v' => spheres += &format!("{line} 2 0\n"),
            b'e' => simplices += &format!("{line} 1\n"),
            _ => simplices += &format!("{line}\n"),
        }
    }
    let (all, edges, faces) = (counts[0] + 1, counts[1] + 1, counts[2]);
    let text = format!(
        "{all} {edges} {faces}\n{spheres}v 50 50 50 3 2 1\n{simplices}e 0 {} 0\n",
        counts[0]
    );
    fs::write(&flagged, text).expect("written");
    let evaluate = |axis: &Path| {
        run(&["evaluate", "builtin:box", text_path(axis), "--samples", "500", "--json"])
    };
    let (of_plain, of_flagged) = (evaluate(&plain), evaluate(&flagged));
    assert_eq!((of_plain.0, of_flagged.0), (0, 0));
    assert_eq!(of_plain.1, of_flagged.1);
    assert!(of_flagged.2.contains("1 sphere was dropped: marked as deleted"), "{}", of_flagged.2);
    assert!(of_flagged.2.contains("1 edge was dropped: on a deleted sphere"), "{}", of_flagged.2);
}

#[cfg(target_os = "linux")]
#[test]
fn an_output_that_cannot_be_written_is_a_failure() {
    for arguments in [
        &["methods"][..],
        &["methods", "--json"],
        &["completions", "bash"],
        &["info", "builtin:sphere:8", "--json"],
        &["--help"],
    ] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("a full device");
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_medial"))
            .args(arguments)
            .stdout(full)
            .output()
            .expect("the command starts");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(stderr.starts_with("medial: standard output: "), "{arguments:?}: {stderr}");
    }
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_failure() {
    for arguments in [&["methods"][..], &["completions", "bash"]] {
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_medial"))
            .args(arguments)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .expect("the command starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0), "{arguments:?}");
    }
}

#[cfg(unix)]
#[test]
fn a_signal_leaves_no_temporary_behind() {
    let dir = tempfile::tempdir().expect("a folder");
    let names = || {
        let entries = fs::read_dir(dir.path()).expect("a folder");
        entries.map(|entry| entry.expect("an entry").file_name()).collect::<Vec<_>>()
    };
    let target = dir.path().join("sphere.off");
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_medial"))
        .args(["datasets", "make", "sphere", "--resolution", "1000", "-o", text_path(&target)])
        .spawn()
        .expect("the command starts");
    while names().is_empty() && child.try_wait().expect("its state").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let interrupted = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .expect("kill starts");
    assert!(interrupted.success(), "the file was written before the signal");
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert_eq!(names().len(), 0, "{:?}", names());
}

#[test]
fn slips_are_refused_with_what_was_meant() {
    let sphere = "builtin:sphere:8";
    for (arguments, expected) in [
        (&["simplify", sphere, "-m", "qmat", "--max-error", "5"][..], "write 0.05 for 5 %"),
        (&["simplify", sphere, "-m", "qmat", "--max-error", "1"], "write 0.01 for 1 %"),
        (&["simplify", sphere, "-m", "hem", "--level", "inf"], "inf is not a distance"),
        (&["simplify", sphere, "-m", "qmta"], "did you mean `qmat`?"),
        (&["methods", "dey-zhoa"], "did you mean `dey-zhao`?"),
        (&["info", "builtin:shpere"], "did you mean `sphere`?"),
        (&["datasets", "make", "shpere", "-o", "x.off"], "did you mean `sphere`?"),
        (&["info", "builtin:sphere:2000"], "about 4.2e6 vertices"),
        (&["simplfy", sphere], "'simplify'"),
    ] {
        let (code, _, stderr) = run(arguments);
        assert_eq!(code, 2, "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}

#[test]
fn a_result_that_is_not_kept_is_told() {
    let simplify = ["simplify", "builtin:sphere:8", "-m", "qmat", "--spheres", "5"];
    assert!(run(&simplify).2.contains("the result was not written; -o FILE.ma keeps it"));
    for quiet in ["--quiet", "--json"] {
        assert_eq!(run(&[&simplify[..], &[quiet]].concat()).2, "");
    }
}

#[test]
fn lists_of_defaults_are_shown_with_commas() {
    for option in ["-h", "--help"] {
        let (_, stdout, _) = run(&["compare", option]);
        assert!(stdout.contains("[default: 1000,500,200,100]"), "{stdout}");
    }
}

#[cfg(unix)]
#[test]
fn names_reach_neither_a_terminal_nor_a_spreadsheet_as_commands() {
    let dir = tempfile::tempdir().expect("a folder");
    let off = dir.path().join("box.off");
    assert_eq!(run(&["datasets", "make", "box", "-o", text_path(&off)]).0, 0);
    let formula = dir.path().join("=cmd|' !A0.off");
    fs::copy(&off, &formula).expect("copied");
    let escape = dir.path().join("a\u{1b}[2Jb.off");
    fs::copy(&off, &escape).expect("copied");
    let out = dir.path().join("out");
    // The names have spaces: they are no part of a line that is split.
    let meshes = ["compare", text_path(&formula), text_path(&escape)];
    let options = words("--methods qmat --spheres 20 --samples 200 --out");
    let (code, stdout, stderr) = run(&[&meshes[..], &options, &[text_path(&out)]].concat());
    assert_eq!(code, 0, "{stderr}");
    let table = fs::read_to_string(out.join("results.csv")).expect("a table");
    assert!(table.contains("\n'=cmd|' !A0,"), "{table}");
    let (_, of_info, _) = run(&["info", text_path(&escape)]);
    fs::write(&escape, "OFF\n").expect("written");
    let (_, _, of_error) = run(&["info", text_path(&escape)]);
    for text in [stdout, stderr, table, of_info, of_error] {
        assert!(!text.contains('\u{1b}'), "{text:?}");
    }
}

#[test]
fn the_surface_is_named_where_it_is_at_fault() {
    let dir = tempfile::tempdir().expect("a folder");
    let (off, far, axis) =
        (dir.path().join("s.off"), dir.path().join("far.off"), dir.path().join("axis.ma"));
    assert_eq!(run(&["datasets", "make", "sphere", "-o", text_path(&off)]).0, 0);
    let text = fs::read_to_string(&off).expect("read");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[2] = "1e8 0 0".into();
    fs::write(&far, lines.join("\n")).expect("written");
    fs::write(&axis, "1 0 0\nv 0 0 0 0.5\n").expect("written");
    // What the other verbs take is evaluated, and what is refused is refused by name.
    let taken = run(&["info", text_path(&far)]).0;
    let (code, _, stderr) =
        run(&["evaluate", text_path(&far), text_path(&axis), "--samples", "99"]);
    assert_eq!(code, taken, "{stderr}");
    assert!(code == 0 || stderr.contains("far.off"), "{stderr}");
}

#[test]
fn a_surface_with_a_hole_and_a_stray_part_is_repaired() {
    let dir = tempfile::tempdir().expect("a folder");
    let (whole, open, mended) =
        (dir.path().join("whole.off"), dir.path().join("open.off"), dir.path().join("mended.off"));
    assert_eq!(run(&["datasets", "make", "pair", "-o", text_path(&whole)]).0, 0);
    let text = fs::read_to_string(&whole).expect("read");
    let mut lines: Vec<String> = text.trim_end().lines().map(str::to_owned).collect();
    lines.pop();
    let faces = lines[1].split(' ').nth(1).expect("a count").parse::<usize>().expect("a count");
    lines[1] = lines[1].replace(&format!(" {faces} "), &format!(" {} ", faces - 1));
    fs::write(&open, lines.join("\n")).expect("written");
    let (code, _, stderr) = run(&["info", text_path(&open)]);
    assert!(code == 1 && stderr.contains("`medial repair --fill-holes`"), "{stderr}");
    let repair = |more: &[&str]| {
        let named = ["repair", text_path(&open), "-o", text_path(&mended), "--json"];
        run(&[&named[..], more].concat())
    };
    assert_eq!(repair(&[]).0, 1);
    assert!(!mended.exists());
    let (code, stdout, stderr) = repair(&["--fill-holes"]);
    assert_eq!(code, 0, "{stderr}");
    let object: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(object["faces"], faces);
    let filled = serde_json::json!({ "repair": "filled_hole", "edges": 3, "triangles": 1 });
    assert_eq!(object["repairs"][0], filled, "{object}");
    assert_eq!(run(&["info", text_path(&mended)]).0, 0);
    let (code, stdout, _) = repair(&["--fill-holes", "--components", "largest"]);
    assert_eq!(code, 0);
    assert!(stdout.contains("\"components\":1,"), "{stdout}");
}
