//! Exports a hash of the sources of each method: `MODULE=HASH;...`, and that of shared sources. An edit
//! of one method changes the version of that method alone.

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use medial_source_hash::{digest, rerun_on, sources};

#[allow(dead_code, reason = "a test includes this file")]
#[allow(clippy::print_stdout, reason = "this is how a build script talks to cargo")]
fn main() {
    rerun_on(&["."], "../Cargo.lock");
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));
    let hashes: Vec<String> =
        hashes(&root).iter().map(|(module, hash)| format!("{module}={hash}")).collect();
    println!("cargo::rustc-env=SOURCE_HASHES={}", hashes.join(";"));
    // Other compilers, targets and dependencies can round the same sources differently.
    let compiler = env::var_os("RUSTC").expect("set by cargo");
    let compiler = Command::new(compiler).arg("--version").output().expect("the compiler runs");
    let compiler = String::from_utf8_lossy(&compiler.stdout).trim().to_owned();
    let [target, level] = ["TARGET", "OPT_LEVEL"].map(|name| env::var(name).unwrap_or_default());
    // A package has no lock file: that of the build is unknown there.
    let lock = root.join("../Cargo.lock");
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
