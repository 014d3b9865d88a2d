//! `medial doctor`: what this machine lacks for oracles and baselines.

use std::path::Path;
use std::process::Command;

use clap::Args;
use serde_json::json;

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line};
use crate::run::Provenance;

/// Arguments of `doctor`.
#[derive(Debug, Args)]
pub struct Arguments {}

/// A thing that a check outside the program needs.
struct Need {
    name: &'static str,
    used_for: &'static str,
    how: &'static str,
    present: bool,
}

/// Runs the verb. The program itself needs nothing of what is listed.
///
/// # Errors
/// Never; the signature is that of every verb.
pub fn run(_arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let needs = needs();
    let provenance = Provenance::here();
    if global.json {
        let rows: Vec<_> = needs
            .iter()
            .map(|n| json!({ "name": n.name, "present": n.present, "for": n.used_for, "how": n.how }))
            .collect();
        let object = json!({
            "machine": provenance.machine, "binary_hash": provenance.binary_hash, "needs": rows,
        });
        print_json(&object, &[]);
        return Ok(Exit::Done);
    }
    let machine = &provenance.machine;
    print_line(&format!("{}, {} threads, {}", machine.cpu, machine.cores, machine.os));
    print_line("The program needs nothing else. Oracles and baselines would use:");
    for need in &needs {
        let state = if need.present { "found  " } else { "missing" };
        print_line(&format!("  {state}  {:<20} {}", need.name, need.used_for));
        if !need.present {
            print_line(&format!("           {:<20} {}", "", need.how));
        }
    }
    Ok(Exit::Done)
}

fn needs() -> Vec<Need> {
    let python = |module: &str| {
        let check = format!("import {module}");
        let output = Command::new("python3").args(["-c", &check]).output();
        output.is_ok_and(|output| output.status.success())
    };
    let runs = |program: &str| Command::new(program).arg("--version").output().is_ok();
    vec![
        Need {
            name: "C++ compiler",
            used_for: "building the CGAL oracle",
            how: "apt-get install g++",
            present: runs("c++"),
        },
        Need {
            name: "CGAL",
            used_for: "oracle for triangulations and closest points",
            how: "apt-get install libcgal-dev",
            present: Path::new("/usr/include/CGAL/version.h").exists(),
        },
        Need {
            name: "Open3D",
            used_for: "oracle for distances to the surface",
            how: "pip install open3d",
            present: python("open3d"),
        },
        Need {
            name: "fast-simplification",
            used_for: "baseline: surface decimation",
            how: "pip install fast-simplification",
            present: python("fast_simplification"),
        },
    ]
}
