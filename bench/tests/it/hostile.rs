//! The command with hostile files and arguments.

use std::fs;
#[cfg(unix)]
use std::path::Path;
use std::process::{Command, Stdio};

#[cfg(unix)]
use serde_json::Value;

use crate::command::{MEDIAL, done, folder, json, refused, run};

#[test]
fn deleted_elements_change_no_byte_of_an_evaluation() {
    let at = folder();
    let (plain, flagged) = (at("plain.ma"), at("flagged.ma"));
    done(&["axis", "builtin:box", "-o", &plain]);
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
    let evaluate = |axis| run(&["evaluate", "builtin:box", axis, "--samples", "500", "--json"]);
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
        let output = Command::new(MEDIAL).args(arguments).stdout(full).output();
        let output = output.expect("the command starts");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(stderr.starts_with("medial: standard output: "), "{arguments:?}: {stderr}");
    }
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_failure() {
    for arguments in [&["methods"][..], &["completions", "bash"]] {
        let mut command = Command::new(MEDIAL);
        command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the command starts");
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
    let mut child = Command::new(MEDIAL)
        .args(["datasets", "make", "sphere", "--resolution", "1000", "-o"])
        .arg(dir.path().join("sphere.off"))
        .spawn()
        .expect("the command starts");
    while names().is_empty() && child.try_wait().expect("its state").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(interrupted.expect("kill starts").success(), "the file was written before the signal");
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert_eq!(names().len(), 0, "{:?}", names());
}

#[test]
fn typing_errors_are_refused_with_a_suggestion() {
    let sphere = "builtin:sphere:8";
    for (arguments, expected) in [
        (&["simplify", sphere, "-m", "qmat", "--max-error", "5"][..], "write 0.05 for 5 %"),
        (&["simplify", sphere, "-m", "qmat", "--max-error", "1"], "write 0.01 for 1 %"),
        (
            &["simplify", sphere, "-m", "hem", "--level", "inf", "-o", "x.ma"],
            "inf is not a distance",
        ),
        (&["simplify", sphere, "-m", "qmta"], "did you mean `qmat`?"),
        (&["simplify", sphere, "--level", "60"], "no method: name one with --method ID"),
        (&["simplify", sphere], "request --spheres N or --max-error E"),
        (&["methods", "dey-zhoa"], "did you mean `dey-zhao`?"),
        (&["info", "builtin:shpere"], "did you mean `sphere`?"),
        (&["datasets", "make", "shpere", "-o", "x.off"], "did you mean `sphere`?"),
        (&["info", "builtin:sphere:2000"], "about 4.2e6 vertices"),
        (&["simplfy", sphere], "'simplify'"),
    ] {
        refused(arguments, 2, expected);
    }
}

#[test]
fn a_result_without_a_file_is_refused_before_it_is_computed() {
    let simplify = ["simplify", "builtin:sphere:8", "-m", "qmat", "--spheres", "5"];
    refused(&simplify, 2, "write the result with -o sphere-8-qmat.ma");
    assert_eq!(run(&[&simplify[..], &["--json"]].concat()).0, 0);
}

#[test]
fn lists_of_defaults_are_shown_with_commas() {
    for option in ["-h", "--help"] {
        assert!(done(&["compare", option]).contains("[default: 200,100,50"));
    }
}

#[cfg(unix)]
#[test]
fn names_reach_neither_a_terminal_nor_a_spreadsheet_as_commands() {
    let at = folder();
    let (formula, escape, out) = (at("=cmd|' !A0.off"), at("a\u{1b}[2Jb.off"), at("out"));
    done(&["datasets", "make", "box", "-o", &formula]);
    fs::copy(&formula, &escape).expect("copied");
    let options = ["--methods", "qmat", "--spheres", "20", "--samples", "200", "--out"];
    let words = [&["compare", &formula, &escape], &options[..], &[&out]].concat();
    let (code, stdout, stderr) = run(&words);
    assert_eq!(code, 0, "{stderr}");
    let table = fs::read_to_string(at("out/results.csv")).expect("a table");
    assert!(table.contains("\n'=cmd|' !A0,"), "{table}");
    let of_info = done(&["info", &escape]);
    fs::write(&escape, "OFF\n").expect("written");
    let (_, _, of_error) = run(&["info", &escape]);
    for text in [stdout, stderr, table, of_info, of_error] {
        assert!(!text.contains('\u{1b}'), "{text:?}");
    }
}

#[test]
fn the_surface_is_named_where_it_is_at_fault() {
    let at = folder();
    let (off, far, axis) = (at("s.off"), at("far.off"), at("axis.ma"));
    done(&["datasets", "make", "sphere", "-o", &off]);
    let text = fs::read_to_string(&off).expect("read");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[2] = "1e8 0 0".into();
    fs::write(&far, lines.join("\n")).expect("written");
    fs::write(&axis, "1 0 0\nv 0 0 0 0.5\n").expect("written");
    // A mesh that `info` accepts is evaluated, and a refused mesh is named.
    let accepted = run(&["info", &far]).0;
    let (code, _, stderr) = run(&["evaluate", &far, &axis, "--samples", "100"]);
    assert_eq!(code, accepted, "{stderr}");
    assert!(code == 0 || stderr.contains("far.off"), "{stderr}");
}

#[test]
fn a_surface_with_a_hole_and_a_second_part_is_repaired() {
    let at = folder();
    let (whole, open, repaired) = (at("whole.off"), at("open.off"), at("repaired.off"));
    done(&["datasets", "make", "pair", "-o", &whole]);
    let text = fs::read_to_string(&whole).expect("read");
    let mut lines: Vec<String> = text.trim_end().lines().map(str::to_owned).collect();
    lines.pop();
    let faces = lines[1].split(' ').nth(1).expect("a count").parse::<usize>().expect("a count");
    lines[1] = lines[1].replace(&format!(" {faces} "), &format!(" {} ", faces - 1));
    fs::write(&open, lines.join("\n")).expect("written");
    refused(&["info", &open], 1, "`medial repair --fill-holes`");
    let repair = |more: &[&str]| json(&[&["repair", &open, "-o", &repaired], more].concat());
    assert_eq!(repair(&[]).0, 1);
    assert!(!fs::exists(&repaired).expect("a folder"));
    let (code, object) = repair(&["--fill-holes"]);
    assert_eq!((code, &object["faces"]), (0, &faces.into()), "{object}");
    let filled = serde_json::json!({ "repair": "filled_hole", "edges": 3, "triangles": 1 });
    assert_eq!(object["repairs"][0], filled, "{object}");
    done(&["info", &repaired]);
    let (code, object) = repair(&["--fill-holes", "--components", "largest"]);
    assert_eq!((code, &object["components"]), (0, &1.into()), "{object}");
}

/// An open strip of two triangles, the corners of a box without faces, and three triangles at one edge.
const UNFIT: [&str; 3] = [
    "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 1\n3 0 1 2\n3 0 2 3\n",
    "OFF\n8 0 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n",
    "OFF\n5 3 0\n0 0 0\n0 0 1\n1 0 0\n0 1 0\n-1 -1 0\n3 0 1 2\n3 0 1 3\n3 0 1 4\n",
];

#[test]
fn surfaces_and_points_that_bound_no_solid_are_wrapped() {
    let at = folder();
    let (unfit, wrapped) = (at("unfit.off"), at("wrapped.off"));
    for (text, components) in UNFIT.iter().zip([1, 8, 1]) {
        fs::write(&unfit, text).expect("written");
        assert_eq!(run(&["info", &unfit]).0, 1, "{text}");
        let (code, object) = json(&["repair", &unfit, "--wrap", "-o", &wrapped]);
        assert_eq!((code, &object["components"]), (0, &components.into()), "{object}");
        let repair = object["repairs"].as_array().and_then(|all| all.last()).expect("a repair");
        assert_eq!(repair["repair"], "wrapped", "{object}");
        let [alpha, offset, farthest] =
            ["alpha", "offset", "farthest"].map(|key| repair[key].as_f64().expect("a length"));
        assert!((alpha / offset - 30.0).abs() < 1e-9 && farthest >= 0.98 * offset, "{object}");
        let (code, found) = json(&["info", &wrapped]);
        assert_eq!((code, &found["self_intersecting"]), (0, &false.into()), "{found}");
    }
    let (code, object) =
        json(&["repair", &unfit, "--wrap", "0.1", "--components", "largest", "-o", &wrapped]);
    let fewer = object["vertices"].as_u64().expect("a count");
    assert_eq!(code, 0, "{object}");
    let (_, object) = json(&["repair", &unfit, "--wrap", "0.05", "-o", &wrapped]);
    assert!(object["vertices"].as_u64() > Some(2 * fewer), "{object}");
}

#[test]
fn a_wrap_without_a_radius_or_with_wrong_input_is_refused() {
    let at = folder();
    let (unfit, wrapped) = (at("unfit.off"), at("wrapped.off"));
    fs::write(&unfit, UNFIT[0]).expect("written");
    for alpha in ["0", "-0.1", "nan", "inf"] {
        let words = ["repair", &unfit, "-o", &wrapped, &format!("--wrap={alpha}")];
        refused(&words, 2, "--wrap must be a positive fraction");
    }
    refused(
        &["repair", &unfit, "-o", &wrapped, "--wrap", "--fill-holes"],
        2,
        "cannot be used with",
    );
    let words = ["repair", &unfit, "-o", &wrapped, "--wrap"];
    refused(&[&words[..4], &["--wrap=1e-12"]].concat(), 1, "the offset is too small");
    fs::write(&unfit, UNFIT[0].replace("1 1 0", "1 nan 0")).expect("written");
    refused(&words, 1, "not finite");
    fs::write(&unfit, "OFF\n0 0 0\n").expect("written");
    refused(&words, 1, "no face among 0 vertices");
    fs::write(&unfit, "OFF\n1 0 0\n1 2 3\n").expect("written");
    refused(&words, 1, "the bounding box has the diagonal 0.0");
    assert!(!fs::exists(&wrapped).expect("a folder"));
}

/// The artifact of a record may name any file of the machine: a report neither shows nor copies it.
#[cfg(unix)]
#[test]
fn artifacts_that_lead_out_of_a_store_are_not_followed() {
    let at = folder();
    let (store, merged, results) = (at("store"), at("merged"), at("store/results.jsonl"));
    let words = ["compare", "builtin:sphere:8", "--methods", "qmat", "--spheres", "20"];
    done(&[&words[..], &["--counts-only", "--out", &store]].concat());
    let text = fs::read_to_string(&results).expect("results");
    let mut record: Value =
        serde_json::from_str(text.lines().next().expect("a line")).expect("JSON");
    let inside = record["artifact"].as_str().expect("a medial mesh").to_owned();
    fs::copy(at(&format!("store/{inside}")), at("outside.ma")).expect("copied");
    for artifact in ["../outside.ma", "axes/../../outside.ma", &at("outside.ma"), "study.toml"] {
        record["artifact"] = artifact.into();
        fs::write(&results, format!("{record}\n")).expect("written");
        let (code, object) = json(&["report", &store]);
        let warnings = object["warnings"].to_string();
        assert_eq!(code, 0, "{object}");
        assert!(warnings.contains(&format!("{artifact}: not inside the folder")), "{warnings}");
        for folder in ["store/pictures", "store/views"] {
            let files = fs::read_dir(at(folder)).map_or(0, Iterator::count);
            assert_eq!(files, 0, "{artifact}: {folder}");
        }
        done(&["report", &store, "--out", &merged]);
        assert!(!Path::new(&merged).join("axes").exists(), "{artifact} was copied");
        fs::remove_dir_all(&merged).expect("a store");
    }
    record["artifact"] = "axes/link.ma".into();
    fs::write(&results, format!("{record}\n")).expect("written");
    std::os::unix::fs::symlink(at("outside.ma"), at("store/axes/link.ma")).expect("a link");
    refused(&["report", &store], 1, "link.ma");
    refused(&["report", &store, "--site", &at("site")], 1, "link.ma: not a regular file");
    done(&["report", &store, "--out", &merged]);
    assert!(!Path::new(&merged).join("axes").exists(), "the link was followed");
}

/// Two boxes of 2 x 2 x 2 that overlap in a corner, as OFF.
fn overlapping_boxes() -> String {
    let mut vertices = String::new();
    let mut faces = String::new();
    for (first, low) in [(0, 0.0), (8, 1.0)] {
        for k in 0..8 {
            let at = |bit: u32| low + 2.0 * f64::from(k >> bit & 1);
            vertices += &format!("{} {} {}\n", at(0), at(1), at(2));
        }
        let sides =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        for [a, b, c, d] in sides.map(|side| side.map(|v| v + first)) {
            faces += &format!("3 {a} {b} {c}\n3 {a} {c} {d}\n");
        }
    }
    format!("OFF\n16 24 0\n{vertices}{faces}")
}

#[test]
fn bodies_that_overlap_are_one_solid_in_every_verb_or_refused_as_they_are() {
    let at = folder();
    let (mesh, solid, axis, out) = (at("two.off"), at("one.off"), at("one.ma"), at("out"));
    fs::write(&mesh, overlapping_boxes()).expect("written");
    let is_named = |object: &Value| {
        let warnings = object["warnings"].as_array().expect("a list");
        warnings.iter().any(|warning| warning.as_str().is_some_and(|text| text.contains("overlap")))
    };
    for words in [
        &["axis", &mesh, "-o", &axis][..],
        &["simplify", &mesh, "--method", "qmat", "--spheres", "40", "-o", &axis],
        &["evaluate", &mesh, &axis, "--samples", "500"],
    ] {
        let (code, object) = json(words);
        assert!(code == 0 && is_named(&object), "{object}");
    }
    done(&["repair", &mesh, "-o", &solid]);
    let (_, info) = json(&["info", &solid]);
    assert_eq!((&info["components"], &info["self_intersecting"]), (&1.into(), &false.into()));
    // 8 + 8 - 1.
    assert!((info["volume"].as_f64().expect("closed") - 15.0).abs() < 1e-9, "{info}");
    let as_is = |words: &[&str]| refused(&[words, &["--as-is"]].concat(), 1, "faces cross");
    as_is(&["axis", &mesh, "-o", &axis]);
    as_is(&["simplify", &mesh, "--method", "qmat", "--spheres", "40", "-o", &axis]);
    as_is(&["compare", &mesh, "--methods", "qmat", "--spheres", "40", "--out", &out]);
    done(&["axis", &solid, "-o", &axis, "--as-is"]);
}
