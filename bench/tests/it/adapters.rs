//! The adapters of `examples/adapters`, with scripts in place of the programs: they use other units, write an incomplete
//! file first, and continue to run after the end of their work.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use medial::complex;
use medial_test_support::skip;

use crate::command::{Folder, number};

const ADAPTERS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/adapters/adapters.toml");

/// A comparison of adapters, into `report`.
fn compare(at: &Folder, line: &str) -> Command {
    let options = "--counts-only --samples 500 --quiet --out report";
    at.command(&format!("compare builtin:capsule --plugins {ADAPTERS} {options} {line}"))
}

fn program(path: &Path, text: &str) {
    fs::write(path, format!("#!/bin/sh\n{text}\n")).expect("written");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("permitted");
}

/// A medial mesh of the built-in capsule with 20 spheres, ten times as large and elsewhere.
fn normalised(at: &Folder) -> std::path::PathBuf {
    at.done("simplify builtin:capsule -m qmat --spheres 20 -o axis.ma");
    let file = at.at("axis.ma");
    let axis = complex::read(&file).expect("a medial mesh").mesh;
    let moved = axis.transformed(10.0, |p| 10.0 * p + medial::Vec3::new(5.0, -3.0, 70.0));
    complex::write(&file, &moved).expect("written");
    file
}

#[test]
fn results_of_programs_that_do_not_end_are_read_and_fitted() {
    if Command::new("python3").arg("--version").output().is_err() {
        skip("no python3");
        return;
    }
    let at = Folder::new();
    let axis = normalised(&at);
    let axis = axis.display();
    let [tetrahedra, mattopo, matstruct, prepare, matfp] =
        ["ftetwild", "mattopo", "matstruct", "matfp_pre", "matfp"].map(|name| at.at(name));
    program(&tetrahedra, "cp \"$2\" \"$4\"");
    let then_waits = "sleep 600";
    program(
        &mattopo,
        &format!(
            "test \"$2 $3\" = '20 non_cad' || exit 3\nhead -4 {axis} > ../out/mat/mat.ma\nsleep 1\n\
             cp {axis} ../out/mat/mat.ma\n{then_waits}"
        ),
    );
    program(
        &matstruct,
        &format!("test \"$5 $6 $7\" = '-o -p 30' || exit 3\ncp {axis} \"$4\"/mat.ma"),
    );
    program(&prepare, "cp \"$1\" ../input/mesh/mesh_surface.geogram");
    program(&matfp, &format!("test \"$2\" = --ds=0.1 || exit 3\ncp {axis} mat.ma\n{then_waits}"));
    let begun = Instant::now();
    let line = "--methods mattopo,matstruct,matfp --levels matstruct=30 --published --spheres 20";
    let done = compare(&at, line)
        .envs([("FTETWILD", &tetrahedra), ("MATTOPO", &mattopo), ("MATSTRUCT", &matstruct)])
        .envs([("MATFP_PRE", &prepare), ("MATFP", &matfp)])
        .output()
        .expect("it runs");
    assert!(begun.elapsed() < Duration::from_secs(300), "the programs are ended");
    let records = at.records("report");
    let expected = [("mattopo", "spheres"), ("matstruct", "native"), ("matfp", "published")];
    for (method, level) in expected {
        let of_level = |record: &&serde_json::Value| {
            let found = &record["simplify"]["level"];
            record["simplify"]["method"] == method && (found == level || !found[level].is_null())
        };
        let record = records.iter().find(of_level).unwrap_or_else(|| panic!("{method}"));
        let stderr = String::from_utf8_lossy(&done.stderr);
        assert_eq!(
            (&record["status"], &record["simplify"]["spheres"]),
            (&"ok".into(), &20.into()),
            "{record} {stderr}"
        );
        let warnings = record["simplify"]["warnings"].to_string();
        // The axis has 20 spheres: its scale is known to about 1 %.
        let scale = warnings.split("fitted: lengths times ").nth(1);
        let scale = scale.and_then(|text| text.split(',').next()?.parse::<f64>().ok());
        assert!(scale.is_some_and(|scale| (10.0 * scale - 1.0).abs() < 0.01), "{warnings}");
        assert!(number(&record["evaluate"]["hausdorff"]) < 0.05, "{record}");
    }
}

#[test]
fn a_missing_program_is_named() {
    let at = Folder::new();
    let done = compare(&at, "--methods mattopo --spheres 20").env_remove("MATTOPO").output();
    assert_eq!(done.expect("it runs").status.code(), Some(5), "nothing measured");
    if Command::new("python3").arg("--version").output().is_ok() {
        let record = &at.records("report")[0];
        assert_eq!(record["status"], "unsupported", "{record}");
        assert!(record["reason"].as_str().expect("a reason").contains("MATTOPO"), "{record}");
    }
}
