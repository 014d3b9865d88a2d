//! Missing meshes and programs of tests, with notices.
//!
//! Meshes that cannot be redistributed are in `$MEDIAL_MESHES`, by default in `shared/meshes` next to the
//! repository. Where they are missing, tests of claims about any real mesh take those of `tests/meshes`. Others are
//! skipped, with a notice on standard error and in a list, which the last executable of `cargo test` counts and `.ci/run`
//! prints. With `MEDIAL_REQUIRE_MESHES=1` a missing mesh is a failure.

use std::collections::{BTreeSet, HashMap};
use std::fs;
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

/// All shared surfaces, by name; those of [`free_meshes`] where they are missing.
///
/// # Panics
/// If they are missing and required.
pub fn surfaces() -> Vec<PathBuf> {
    let folder = match folder().join("MANIFEST.csv").exists() || is_required() {
        true => meshes().unwrap_or_default(),
        false => free_meshes(),
    };
    let entries = std::fs::read_dir(folder).expect("a folder").flatten();
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

/// The rows of a table with quoted fields, by column name.
///
/// # Panics
/// If the file cannot be read.
pub fn table(path: &Path) -> Vec<HashMap<String, String>> {
    let text = fs::read_to_string(path).expect("a table");
    let mut lines = text.lines().map(|line| {
        let mut fields = vec![String::new()];
        let mut quoted = false;
        for c in line.chars() {
            match c {
                '"' => quoted = !quoted,
                ',' if !quoted => fields.push(String::new()),
                c => fields.last_mut().expect("at least one").push(c),
            }
        }
        fields
    });
    let names = lines.next().expect("a header");
    lines.map(|fields| names.iter().cloned().zip(fields).collect()).collect()
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
    let file = OpenOptions::new().create(true).append(true).open(list());
    let written = file.and_then(|mut file| writeln!(file, "{} {test}: {why}", run()));
    written.expect("the list of skipped tests can be written");
}

/// The list of skipped tests: `$MEDIAL_SKIPPED`, or a file next to the executables.
pub fn list() -> PathBuf {
    let default = || std::env::current_exe().unwrap_or_default().with_file_name("skipped-tests");
    std::env::var_os("MEDIAL_SKIPPED").map_or_else(default, PathBuf::from)
}

/// The number of the process that started this executable, which all executables of one `cargo test` share.
pub fn run() -> u32 {
    #[cfg(unix)]
    return std::os::unix::process::parent_id();
    #[cfg(not(unix))]
    0
}

/// The counts of tests that one run skipped, with their variable; `None` without any.
pub fn summary(list: &str, run: u32) -> Option<String> {
    let run = format!("{run} ");
    let skipped: BTreeSet<&str> = list.lines().filter_map(|line| line.strip_prefix(&run)).collect();
    let names = |lines: &mut dyn Iterator<Item = &&str>| {
        let names: BTreeSet<&str> = lines.filter_map(|line| line.split(": ").next()).collect();
        names.len()
    };
    let all = names(&mut skipped.iter());
    let of_meshes = names(&mut skipped.iter().filter(|line| line.contains("MEDIAL_MESHES")));
    let tests = if all == 1 { "test" } else { "tests" };
    (all > 0).then(|| {
        format!(
            "skipped in whole or in part: {all} {tests}, {of_meshes} of them without the meshes of papers (set MEDIAL_MESHES \
             to their folder), others without a program"
        )
    })
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

#[cfg(test)]
mod tests {
    use super::summary;

    #[test]
    fn skipped_tests_of_one_run_are_counted_once() {
        let list = "7 a::b: bear.off is missing (MEDIAL_MESHES)\n7 a::b: ant.off is missing (MEDIAL_MESHES)\n\
                    7 c: no chromium\n8 d: no chromium\n";
        let seven = summary(list, 7).expect("two");
        assert!(
            seven.starts_with("skipped in whole or in part: 2 tests, 1 of them without the meshes"),
            "{seven}"
        );
        assert!(seven.contains("MEDIAL_MESHES"));
        assert!(summary(list, 8).expect("one").contains("1 test, 0 of them"));
        assert_eq!(summary(list, 9), None);
    }
}
