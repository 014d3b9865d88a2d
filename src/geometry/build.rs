//! Exports a hash of the sources of this crate, a part of the version of every method.

use std::path::{Path, PathBuf};
use std::{env, fs};

use sha2::{Digest, Sha256};

fn main() {
    println!("cargo::rerun-if-changed=.");
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));
    let files = sources(&root, &["tests", "benches", "examples", "build.rs"]);
    println!("cargo::rustc-env=SOURCE_HASH={}", digest(&root, &files));
}

/// SHA-256 over the relative paths and the contents of files, in the order of the paths.
fn digest(root: &Path, files: &[PathBuf]) -> String {
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

/// The Rust files below a folder, without those below `without`, sorted.
fn sources(folder: &Path, without: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && !without.contains(&name.as_str()) {
            found.extend(sources(&path, &[]));
        } else if path.extension().is_some_and(|extension| extension == "rs")
            && !without.contains(&name.as_str())
        {
            found.push(path);
        }
    }
    found.sort();
    found
}
