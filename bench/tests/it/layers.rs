//! What may use what: crates, methods, modules, files. `scripts/layers.py` has the rules.

use std::process::Command;

#[test]
fn uses_keep_to_their_layers() {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../scripts/layers.py");
    let Ok(output) = Command::new("python3").args([script, "--test"]).output() else {
        medial_test_support::skip("no Python");
        return;
    };
    let printed = [output.stdout, output.stderr].concat();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&printed));
}
