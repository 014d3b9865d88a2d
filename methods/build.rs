//! Exports a hash of the sources of each method: `MODULE=HASH;...`, and that of what they share. An edit
//! of one method changes the version of that method alone.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use sha2::{Digest, Sha256};

#[allow(dead_code, reason = "a test includes this file")]
#[allow(clippy::print_stdout, reason = "this is how a build script talks to cargo")]
fn main() {
    println!("cargo::rerun-if-changed=.");
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));
    let hashes: Vec<String> =
        hashes(&root).iter().map(|(module, hash)| format!("{module}={hash}")).collect();
    println!("cargo::rustc-env=SOURCE_HASHES={}", hashes.join(";"));
    // The same sources in another build can round otherwise.
    let compiler = env::var_os("RUSTC").expect("set by cargo");
    let compiler = Command::new(compiler).arg("--version").output().expect("the compiler runs");
    let compiler = String::from_utf8_lossy(&compiler.stdout).trim().to_owned();
    let setting = |name: &str| env::var(name).unwrap_or_default();
    let (target, level) = (setting("TARGET"), setting("OPT_LEVEL"));
    // A package has no lock file of its own: the one of the build is not known there.
    let lock = root.join("../Cargo.lock");
    println!("cargo::rerun-if-changed=../Cargo.lock");
    let lock = if lock.exists() { digest(&root, &[lock]) } else { String::new() };
    println!("cargo::rustc-env=BUILD={compiler} {target} {level} {lock}");
}

/// The hash of each method's module by its name, and that of the rest under `shared`. The list of
/// methods, `lib.rs`, is in none: how a method is presented changes no result.
pub fn hashes(root: &Path) -> BTreeMap<String, String> {
    let list = fs::read_to_string(root.join("lib.rs")).expect("the list of methods");
    let modules: Vec<&str> =
        list.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    let mut files: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for file in sources(root, &["tests", "benches", "examples", "build.rs", "lib.rs"]) {
        let first = file.strip_prefix(root).ok().and_then(|path| path.iter().next());
        let first = first.unwrap_or_default().to_string_lossy();
        let module = first.trim_end_matches(".rs");
        let owner = if modules.contains(&module) { module } else { "shared" };
        files.entry(owner.to_owned()).or_default().push(file);
    }
    files.into_iter().map(|(module, files)| (module, digest(root, &files))).collect()
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
