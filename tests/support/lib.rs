//! Missing meshes and programs of tests, with notices.
//!
//! Meshes that cannot be redistributed are in `$MEDIAL_MESHES`, by default in `shared/meshes` next to the
//! repository. Where they are missing, tests of claims about any real mesh take those of `tests/meshes`. Others are
//! skipped, with a notice on standard error and in the list `$MEDIAL_SKIPPED`, which `.ci/run` prints. With `MEDIAL_REQUIRE_MESHES=1` a missing mesh is a failure.

use std::collections::HashMap;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of shared meshes, `None` with a notice where it is missing.
///
/// # Panics
/// If it is missing and required.
pub fn meshes() -> Option<PathBuf> {
    let folder = folder();
    if folder.join("MANIFEST.csv").exists() {
        return Some(folder);
    }
    missing(&folder);
    None
}

/// The folder of the meshes of this repository: `body.off`, `figure.off`, `part.off` and their `MANIFEST.csv`.
pub fn free_meshes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../meshes")
}

/// A shared mesh, `None` with a notice where it is missing.
///
/// # Panics
/// If it is missing and required.
pub fn mesh(name: &str) -> Option<PathBuf> {
    let path = folder().join(name);
    if path.exists() {
        return Some(path);
    }
    missing(&path);
    None
}

/// The surfaces of [`free_meshes`], and all shared ones where they are there.
///
/// # Panics
/// If those are missing and required.
pub fn surfaces() -> Vec<PathBuf> {
    let is_there = folder().join("MANIFEST.csv").exists() || is_required();
    let shared = is_there.then(|| meshes().unwrap_or_default());
    let folders = shared.into_iter().chain([free_meshes()]);
    let entries = folders.flat_map(|folder| std::fs::read_dir(folder).expect("a folder").flatten());
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "off" || e == "obj"));
    files.sort_unstable();
    files
}

/// The folder of shared medial meshes, next to that of the surfaces; `None` with a notice where it is missing.
///
/// # Panics
/// If it is missing and required.
pub fn medial_meshes() -> Option<PathBuf> {
    let folder = folder().with_file_name("ma");
    if folder.join("MANIFEST.csv").exists() {
        return Some(folder);
    }
    missing(&folder);
    None
}

/// The rows of a CSV, by column name.
///
/// # Panics
/// If the file cannot be read.
pub fn table(path: &Path) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).expect("a table");
    reader.deserialize().map(|row| row.expect("a row")).collect()
}

/// Whether there is a Python with NumPy; a notice where there is none.
pub fn has_numpy() -> bool {
    let answer = Command::new("python3").args(["-c", "import numpy"]).output();
    let has_numpy = answer.is_ok_and(|output| output.status.success());
    if !has_numpy {
        skip("no python3 with numpy");
    }
    has_numpy
}

/// Reports that the running test, or a part of it, is skipped, and why.
#[allow(clippy::print_stderr, reason = "the notice of a skipped test")]
pub fn skip(why: &str) {
    // The harness names the thread of each test after it.
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    eprintln!("skipped: {test}: {why}");
    let Some(list) = std::env::var_os("MEDIAL_SKIPPED") else { return };
    let file = OpenOptions::new().create(true).append(true).open(list);
    let written = file.and_then(|mut file| writeln!(file, "{test}: {why}"));
    written.expect("the list of skipped tests can be written");
}

fn folder() -> PathBuf {
    let default = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/meshes");
    std::env::var_os("MEDIAL_MESHES").map_or_else(default, PathBuf::from)
}

fn is_required() -> bool {
    std::env::var_os("MEDIAL_REQUIRE_MESHES").is_some_and(|value| value == "1")
}

fn missing(path: &Path) {
    assert!(!is_required(), "{} is missing, and MEDIAL_REQUIRE_MESHES=1", path.display());
    skip(&format!("{} is missing (MEDIAL_MESHES)", path.display()));
}
