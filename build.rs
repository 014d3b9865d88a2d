//! Exports a hash of the sources of this crate, a part of the version of every method: results of older
//! sources are not reused.

use std::env;
use std::path::PathBuf;

use medial_source_hash::{digest, rerun_on, sources};

fn main() {
    rerun_on(&["src", "build.rs"], "Cargo.lock");
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));
    // The kernel is a separate crate with its own hash.
    let files = sources(&root.join("src"), &["geometry"]);
    println!("cargo::rustc-env=SOURCE_HASH={}", digest(&root, &files));
}
