//! The crates depend on each other in one direction: `medial-geometry` <- `medial` <- `methods`, `datasets`
//! <- `run` <- `reports` <- `bench` <- `python`. Inside a crate files do not use each other in a circle.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::circles::{Module, circles, uses};

#[test]
fn crates_depend_in_one_direction() {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo metadata runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    let allowed: BTreeMap<&str, &[&str]> = BTreeMap::from([
        ("medial-source-hash", &[][..]),
        ("medial-test-support", &[]),
        ("medial-geometry", &["medial-source-hash"]),
        ("medial", &["medial-geometry", "medial-source-hash"]),
        ("medial-methods", &["medial", "medial-source-hash"]),
        ("medial-datasets", &["medial"]),
        ("medial-run", &["medial", "medial-datasets"]),
        ("medial-reports", &["medial", "medial-run"]),
        (
            "medial-bench",
            &["medial", "medial-methods", "medial-datasets", "medial-run", "medial-reports"],
        ),
        ("medial-fuzz", &["medial", "medial-geometry", "medial-run", "medial-bench"]),
        ("medial-oracles", &["medial", "medial-methods", "medial-datasets"]),
        (
            "medial-python",
            &["medial", "medial-methods", "medial-run", "medial-reports", "medial-bench"],
        ),
        ("medial-largest", &["medial", "medial-methods", "medial-bench"]),
    ]);
    assert_eq!(packages.len(), allowed.len(), "every crate has a place in the order");
    for package in packages {
        let name = package["name"].as_str().expect("a name");
        let allowed = allowed.get(name).unwrap_or_else(|| panic!("{name} has no place"));
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let other = dependency["name"].as_str().expect("a name");
            // The library's and the methods' own tests may use the built-in shapes.
            let helps_tests = ["medial-datasets", "medial-test-support"].contains(&other);
            let in_tests = dependency["kind"] == "dev" && helps_tests;
            if other.starts_with("medial") && !in_tests {
                assert!(allowed.contains(&other), "{name} must not depend on {other}");
            }
        }
    }
}

#[test]
fn methods_do_not_see_each_other() {
    let ids = "angle aof cover coverage_axis dey_zhao hem lambda pmat qmat sat sat_pairwise tam_heidrich tight vmas";
    let ids: Vec<&str> = ids.split(' ').collect();
    let mut modules = uses(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../methods"));
    modules.retain(|module, _| module.first().is_some_and(|owner| ids.contains(&owner.as_str())));
    assert!(modules.len() >= ids.len(), "the sources were found");
    for (module, used) in modules {
        let is_other = |id: &String| *id != module[0] && ids.contains(&id.as_str());
        let other = used.iter().find(|used| used.first().is_some_and(is_other));
        assert_eq!(other, None, "{module:?}");
    }
}

/// The modules of a crate from below: each may use those of earlier layers and its own.
type Layers<'a> = &'a [&'a [&'a str]];

/// Inside `medial`. The geometry kernel is a separate crate, below all of them.
const MEDIAL: Layers<'_> = &[
    &["atomic", "input", "colour", "diagnostics", "heap", "range_queue", "sum"],
    &["surface"],
    &["complex"],
    &["metrics"],
    &["shape"],
    &["simplifier"],
];

/// Inside `medial-bench`.
const BENCH: Layers<'_> = &[
    &["exit", "host", "process_tree"],
    &["progress", "provenance"],
    &["plugin"],
    &["check"],
    &["study"],
    &["store"],
    &["exec"],
    &["args", "interrupt"],
    &["output"],
    &["files"],
    &["rebuild"],
    &["cmd"],
    &["cli"],
];

#[test]
fn modules_use_only_those_below_them() {
    let bench = Path::new(env!("CARGO_MANIFEST_DIR"));
    hold(&bench.join("../src"), MEDIAL);
    hold(bench, BENCH);
}

fn hold(root: &Path, layers: Layers<'_>) {
    let layer_of = |module: &str| layers.iter().position(|layer| layer.contains(&module));
    let modules = uses(root);
    assert!(modules.len() > 10, "the sources were found");
    for (module, used) in modules {
        // The root has re-exports.
        let Some(top) = module.first() else { continue };
        let layer = layer_of(top).unwrap_or_else(|| panic!("the module {top} has no layer"));
        for other in used.iter().filter(|other| !other.is_empty()) {
            let is_below = layer_of(&other[0]).is_some_and(|other| other <= layer);
            assert!(is_below, "{module:?} uses {other:?}, which is not below `{top}`");
        }
    }
}

#[test]
fn files_do_not_use_each_other_in_a_circle() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for folder in [
        "src/geometry",
        "src",
        "methods",
        "datasets",
        "run",
        "reports",
        "bench",
        "python/src",
        "fuzz",
    ] {
        let found = circles(&root.join(folder));
        assert!(found.is_empty(), "{folder}: these files use each other in a circle: {found:?}");
    }
}

#[test]
fn verbs_never_call_verbs() {
    let mut modules = uses(Path::new(env!("CARGO_MANIFEST_DIR")));
    modules.retain(|module, _| module.len() > 1 && module[0] == "cmd");
    assert!(modules.len() > 10, "the sources were found");
    for (module, used) in modules {
        let is_other = |other: &&Module| other[..] != ["cmd"] && other.starts_with(&module[..1]);
        let other = used.iter().filter(is_other).find(|other| other[1] != module[1]);
        assert_eq!(other, None, "{module:?}");
    }
}
