//! The crates depend on each other in one direction: `medial` <- `methods`, `datasets`, `reports` <- `bench`.

use std::collections::BTreeMap;
use std::process::Command;

use serde_json::Value;

#[test]
fn crates_depend_in_one_direction() {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo metadata runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let mut allowed: BTreeMap<&str, &[&str]> = BTreeMap::new();
    allowed.insert("medial", &[]);
    allowed.insert("medial-methods", &["medial"]);
    allowed.insert("medial-datasets", &["medial"]);
    allowed.insert("medial-reports", &["medial"]);
    allowed
        .insert("medial-bench", &["medial", "medial-methods", "medial-datasets", "medial-reports"]);
    let packages = metadata["packages"].as_array().expect("packages");
    assert_eq!(packages.len(), allowed.len(), "every crate has a place in the order");
    for package in packages {
        let name = package["name"].as_str().expect("a name");
        let allowed = allowed.get(name).unwrap_or_else(|| panic!("{name} has no place"));
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let other = dependency["name"].as_str().expect("a name");
            // The library's and the methods' own tests may use the built-in shapes.
            let in_tests = dependency["kind"] == "dev" && other == "medial-datasets";
            if other.starts_with("medial") && !in_tests {
                assert!(allowed.contains(&other), "{name} must not depend on {other}");
            }
        }
    }
}

#[test]
fn methods_do_not_see_each_other() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../methods");
    let ids = [
        "angle",
        "aof",
        "dey_zhao",
        "hem",
        "lambda",
        "pmat",
        "qmat",
        "sat",
        "sat_pairwise",
        "tam_heidrich",
    ];
    let mut folders = vec![std::path::PathBuf::from(root)];
    let mut read = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("the folder of the methods") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let relative = path.strip_prefix(root).expect("below the root");
            let owner = relative.components().next().expect("a name").as_os_str().to_string_lossy();
            let owner = owner.trim_end_matches(".rs").to_owned();
            if !ids.contains(&owner.as_str()) || path.extension().is_none_or(|e| e != "rs") {
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("source text");
            read += 1;
            for other in ids.iter().filter(|&&id| id != owner) {
                let uses = format!("crate::{other}");
                assert!(!text.contains(&uses), "{} uses {uses}", path.display());
            }
        }
    }
    assert!(read >= ids.len(), "the sources were found");
}
