//! Hashes of source files for the versions of methods: a dependency of build scripts.

use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// Reruns the build script when a source or the lock file of the workspace changes.
#[allow(clippy::print_stdout, reason = "build scripts write to cargo this way")]
pub fn rerun_on(sources: &[&str], lock: &str) {
    for path in sources.iter().chain([&lock]) {
        println!("cargo::rerun-if-changed={path}");
    }
}

/// SHA-256 over the relative paths and the contents of files, in the order of the paths.
pub fn digest(root: &Path, files: &[PathBuf]) -> String {
    let mut hasher = Sha256::new();
    for file in files {
        let name = file.strip_prefix(root).unwrap_or(file).to_string_lossy().replace('\\', "/");
        let bytes = fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        hasher.update(name.as_bytes());
        hasher.update((bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    }
    hasher.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}

/// The Rust files below a folder, without those below `without` and files of tests, sorted.
pub fn sources(folder: &Path, without: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && !without.contains(&name.as_str()) {
            found.extend(sources(&path, &[]));
        } else if path.extension().is_some_and(|extension| extension == "rs")
            && !without.contains(&name.as_str())
            && name != "tests.rs"
        {
            found.push(path);
        }
    }
    found.sort();
    found
}
