//! The crates depend on each other in one direction: `medial-geometry` <- `medial` <- `methods`, `datasets`
//! <- `run` <- `reports` <- `bench` <- `python`. Inside a crate files do not use each other in a circle.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::circles::circles;

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
    let mut files = sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../methods"));
    files.retain(|(owner, _)| ids.contains(&owner.as_str()));
    assert!(files.len() >= ids.len(), "the sources were found");
    for (owner, path) in files {
        let used = used_modules(&fs::read_to_string(&path).expect("source text"));
        let other = used.iter().find(|used| **used != owner && ids.contains(&used.as_str()));
        assert_eq!(other, None, "{}", path.display());
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
    let mut read = 0;
    for (module, path) in sources(root) {
        let Some(layer) = layer_of(&module) else {
            panic!("{}: the module {module} has no layer", path.display());
        };
        read += 1;
        for used in used_modules(&fs::read_to_string(&path).expect("source text")) {
            let Some(other) = layer_of(&used) else { continue };
            assert!(
                other <= layer,
                "{} uses `{used}`, which is not below `{module}`",
                path.display()
            );
        }
    }
    assert!(read > 10, "the sources were found");
}

/// The source files of a crate and the top-level module that each belongs to.
fn sources(root: &Path) -> Vec<(String, PathBuf)> {
    let mut found = Vec::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of sources") {
            let path = entry.expect("an entry").path();
            let relative = path.strip_prefix(root).expect("below the root");
            let first = relative.components().next().expect("a name").as_os_str().to_string_lossy();
            // Separate crates, also the kernel.
            if ["geometry", "tests", "benches", "examples", "lib.rs", "main.rs"].contains(&&*first)
            {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push((first.trim_end_matches(".rs").to_owned(), path));
            }
        }
    }
    found
}

/// The modules that code names as `crate::MODULE`, or in the braces of `use crate::{...}`; comments may name any.
fn used_modules(text: &str) -> Vec<String> {
    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    let code = code.collect::<Vec<_>>().join("\n");
    let word = |text: &str| -> String {
        text.chars().take_while(|&c| c.is_alphanumeric() || c == '_').collect()
    };
    let mut used = Vec::new();
    for (place, _) in code.match_indices("crate::") {
        let after = &code[place + "crate::".len()..];
        match after.strip_prefix('{') {
            Some(list) => {
                let end = list.find('}').unwrap_or(list.len());
                used.extend(list[..end].split(',').map(|name| word(name.trim())));
            }
            None => used.push(word(after)),
        }
    }
    used
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
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("cmd");
    let mut read = 0;
    for (verb, path) in sources(&root) {
        read += 1;
        let text = fs::read_to_string(&path).expect("source text");
        let paths = text.split("crate::cmd::").skip(1).chain(text.split(" super::").skip(1));
        for used in paths {
            let used: String =
                used.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            // Tests import everything of their own verb by `super::*`.
            assert!(used == verb || used.is_empty(), "{} uses the verb {used}", path.display());
        }
    }
    assert!(read > 10, "the sources were found");
}
