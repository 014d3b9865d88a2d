//! The command with hostile files and arguments.

use std::fs;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::command::{Folder, cubes_off, ended, number};

#[test]
fn deleted_elements_change_no_byte_of_an_evaluation() {
    let at = Folder::new();
    at.done("axis builtin:box -o plain.ma");
    let text = at.text("plain.ma");
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
    at.write("flagged.ma", text);
    let [of_plain, of_flagged] = ["plain.ma", "flagged.ma"]
        .map(|axis| at.run(&format!("evaluate builtin:box {axis} --samples 500 --json")));
    assert_eq!((of_plain.0, of_flagged.0), (0, 0));
    assert_eq!(of_plain.1, of_flagged.1);
    assert!(of_flagged.2.contains("1 sphere was dropped: marked as deleted"), "{}", of_flagged.2);
    assert!(of_flagged.2.contains("1 edge was dropped: on a deleted sphere"), "{}", of_flagged.2);
}

#[cfg(target_os = "linux")]
#[test]
fn an_output_that_cannot_be_written_is_a_failure() {
    for line in
        ["methods", "methods --json", "completions bash", "info builtin:sphere:8 --json", "--help"]
    {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("a full device");
        let output = Folder::new().command(line).stdout(full).output().expect("it starts");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{line}: {stderr}");
        assert!(stderr.starts_with("medial: standard output: "), "{line}: {stderr}");
    }
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_failure() {
    let at = Folder::new();
    for line in ["methods", "completions bash"] {
        let mut command = at.command(line);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the command starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0), "{line}");
    }
}

#[cfg(unix)]
#[test]
fn a_signal_leaves_no_temporary_behind() {
    let at = Folder::new();
    let names = || {
        let entries = fs::read_dir(at.at("")).expect("a folder");
        entries.map(|entry| entry.expect("an entry").file_name()).collect::<Vec<_>>()
    };
    let mut make = at.command("datasets make sphere --resolution 1000 -o sphere.off");
    let mut child = make.spawn().expect("the command starts");
    while names().is_empty() && child.try_wait().expect("its state").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(interrupted.expect("kill starts").success(), "the file was written before the signal");
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert_eq!(names().len(), 0, "{:?}", names());
}

#[test]
fn a_result_without_a_file_is_refused_before_it_is_computed() {
    let at = Folder::new();
    let simplify = "simplify builtin:sphere:8 -m qmat --spheres 5";
    at.refused(simplify, 2, "write the result with -o sphere-8-qmat.ma");
    assert_eq!(at.json(simplify).0, 0);
}

#[test]
fn lists_of_defaults_are_shown_with_commas() {
    for option in ["-h", "--help"] {
        let help = Folder::new().done(&format!("compare {option}"));
        assert!(help.contains("[default: 200,100,50"));
    }
}

#[cfg(unix)]
#[test]
fn names_reach_neither_a_terminal_nor_a_spreadsheet_as_commands() {
    let at = Folder::new();
    let (formula, escape) = ("=cmd|' !A0.off", "a\u{1b}[2Jb.off");
    at.done("datasets make box -o box.off");
    [formula, escape].iter().for_each(|name| at.write(name, at.text("box.off")));
    let mut compare =
        at.command("compare --methods qmat --spheres 20 --samples 200 --counts-only --out out");
    let (code, stdout, stderr) = ended(compare.args([formula, escape]).output().expect("starts"));
    assert_eq!(code, 0, "{stderr}");
    let table = at.text("out/results.csv");
    assert!(table.contains("\n'=cmd|' !A0,"), "{table}");
    let of_info = at.done(&format!("info {escape}"));
    at.write(escape, "OFF\n");
    let (_, _, of_error) = at.run(&format!("info {escape}"));
    for text in [stdout, stderr, table, of_info, of_error] {
        assert!(!text.contains('\u{1b}'), "{text:?}");
    }
}

#[test]
fn the_surface_is_named_where_it_is_at_fault() {
    let at = Folder::new();
    at.done("datasets make sphere -o s.off");
    let text = at.text("s.off");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[2] = "1e8 0 0".into();
    at.write("far.off", lines.join("\n"));
    at.write("axis.ma", "1 0 0\nv 0 0 0 0.5\n");
    // A mesh that `info` accepts is evaluated, and a refused mesh is named.
    let accepted = at.run("info far.off").0;
    let (code, _, stderr) = at.run("evaluate far.off axis.ma --samples 100");
    assert_eq!(code, accepted, "{stderr}");
    assert!(code == 0 || stderr.contains("far.off"), "{stderr}");
}

#[test]
fn a_surface_with_a_hole_and_a_second_part_is_repaired() {
    let at = Folder::new();
    at.done("datasets make pair -o whole.off");
    let text = at.text("whole.off");
    let mut lines: Vec<String> = text.trim_end().lines().map(str::to_owned).collect();
    lines.pop();
    let faces = lines[1].split(' ').nth(1).expect("a count").parse::<usize>().expect("a count");
    lines[1] = lines[1].replace(&format!(" {faces} "), &format!(" {} ", faces - 1));
    at.write("open.off", lines.join("\n"));
    at.refused("info open.off", 1, "`medial repair FILE --fill-holes -o OUT`");
    let repair = |more: &str| at.json(&format!("repair open.off -o repaired.off {more}"));
    assert_eq!(repair("").0, 1);
    assert!(!at.has("repaired.off"));
    let (code, object) = repair("--fill-holes");
    assert_eq!((code, &object["faces"]), (0, &faces.into()), "{object}");
    let filled = serde_json::json!({ "repair": "filled_hole", "edges": 3, "triangles": 1 });
    assert_eq!(object["repairs"][0], filled, "{object}");
    at.done("info repaired.off");
    let (code, object) = repair("--fill-holes --components largest");
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
    let at = Folder::new();
    let wrap = |more: &str| at.json(&format!("repair unfit.off -o wrapped.off --wrap {more}"));
    for (text, components) in UNFIT.iter().zip([1, 8, 1]) {
        at.write("unfit.off", text);
        assert_eq!(at.run("info unfit.off").0, 1, "{text}");
        let (code, object) = wrap("");
        assert_eq!((code, &object["components"]), (0, &components.into()), "{object}");
        let repair = object["repairs"].as_array().and_then(|all| all.last()).expect("a repair");
        assert_eq!(repair["repair"], "wrapped", "{object}");
        let [alpha, offset, farthest] =
            ["alpha", "offset", "farthest"].map(|key| number(&repair[key]));
        assert!((alpha / offset - 30.0).abs() < 1e-9 && farthest >= 0.98 * offset, "{object}");
        let (code, found) = at.json("info wrapped.off");
        assert_eq!((code, &found["self_intersecting"]), (0, &false.into()), "{found}");
    }
    let (code, object) = wrap("0.1 --components largest");
    let fewer = object["vertices"].as_u64().expect("a count");
    assert_eq!(code, 0, "{object}");
    let (_, object) = wrap("0.05");
    assert!(object["vertices"].as_u64() > Some(2 * fewer), "{object}");
}

#[test]
fn a_wrap_without_a_radius_or_with_wrong_input_is_refused() {
    let at = Folder::new();
    let positive = "expected a positive number";
    for (text, options, code, why) in [
        (UNFIT[0], "--wrap=0", 2, positive),
        (UNFIT[0], "--wrap=-0.1", 2, positive),
        (UNFIT[0], "--wrap=nan", 2, positive),
        (UNFIT[0], "--wrap=inf", 2, positive),
        (UNFIT[0], "--wrap --fill-holes", 2, "cannot be used with"),
        (UNFIT[0], "--wrap=1e-12", 1, "the offset is too small"),
        (&UNFIT[0].replace("1 1 0", "1 nan 0"), "--wrap", 1, "not finite"),
        ("OFF\n0 0 0\n", "--wrap", 1, "no vertex and no face found"),
        ("OFF\n1 0 0\n1 2 3\n", "--wrap", 1, "the bounding box has the diagonal 0.0"),
    ] {
        at.write("unfit.off", text);
        at.refused(&format!("repair unfit.off -o wrapped.off {options}"), code, why);
        assert!(!at.has("wrapped.off"));
    }
}

/// The artifact of a record may name any file of the machine: a report neither shows nor copies it.
#[cfg(unix)]
#[test]
fn artifacts_that_lead_out_of_a_store_are_not_followed() {
    let at = Folder::new();
    let results = "store/results.jsonl";
    at.done("compare builtin:sphere:8 --methods qmat --spheres 20 --counts-only --out store");
    let mut record = at.records("store").remove(0);
    let inside = record["artifact"].as_str().expect("a medial mesh");
    let outside = at.at("outside.ma");
    fs::copy(at.at("store").join(inside), &outside).expect("copied");
    let absolute = outside.to_str().expect("UTF-8");
    for artifact in ["../outside.ma", "axes/../../outside.ma", absolute, "study.toml"] {
        record["artifact"] = artifact.into();
        at.write(results, format!("{record}\n"));
        let (code, object) = at.json("report store");
        let warnings = object["warnings"].to_string();
        assert_eq!(code, 0, "{object}");
        assert!(warnings.contains(&format!("{artifact}: not inside the folder")), "{warnings}");
        for folder in ["store/pictures", "store/views"] {
            let files = fs::read_dir(at.at(folder)).map_or(0, Iterator::count);
            assert_eq!(files, 0, "{artifact}: {folder}");
        }
        at.done("report store --out merged");
        assert!(!at.has("merged/axes"), "{artifact} was copied");
        fs::remove_dir_all(at.at("merged")).expect("a store");
    }
    record["artifact"] = "axes/link.ma".into();
    at.write(results, format!("{record}\n"));
    std::os::unix::fs::symlink(outside, at.at("store/axes/link.ma")).expect("a link");
    at.refused("report store", 1, "link.ma");
    at.refused("report store --site site", 1, "link.ma: not a regular file");
    at.done("report store --out merged");
    assert!(!at.has("merged/axes"), "the link was followed");
}

#[test]
fn bodies_that_overlap_are_one_solid_in_every_verb_or_refused_as_they_are() {
    let at = Folder::new();
    at.write("two.off", cubes_off(&[([0.0; 3], 2.0), ([1.0; 3], 2.0)]));
    let is_named = |object: &Value| {
        let warnings = object["warnings"].as_array().expect("a list");
        warnings.iter().any(|warning| warning.as_str().is_some_and(|text| text.contains("overlap")))
    };
    let (axis, simplify) =
        ("axis two.off -o one.ma", "simplify two.off --method qmat --spheres 40 -o one.ma");
    for line in [axis, simplify, "evaluate two.off one.ma --samples 500"] {
        let (code, object) = at.json(line);
        assert!(code == 0 && is_named(&object), "{object}");
    }
    at.done("repair two.off -o one.off");
    let (_, info) = at.json("info one.off");
    assert_eq!((&info["components"], &info["self_intersecting"]), (&1.into(), &false.into()));
    // 8 + 8 - 1.
    assert!((number(&info["volume"]) - 15.0).abs() < 1e-9, "{info}");
    for line in [axis, simplify, "compare two.off --methods qmat --spheres 40 --out out"] {
        at.refused(&format!("{line} --as-is"), 1, "faces cross");
    }
    at.done("axis one.off -o one.ma --as-is");
}
