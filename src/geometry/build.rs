//! Exports a hash of the sources of this crate, a part of the version of every method.

use std::env;
use std::path::PathBuf;

use medial_source_hash::{digest, rerun_on, sources};

fn main() {
    rerun_on(&["."], "../../Cargo.lock");
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));
    let without = ["tests", "benches", "examples", "build.rs"];
    let files = sources(&root, &without);
    println!("cargo::rustc-env=SOURCE_HASH={}", digest(&root, &files));
}
