//! What may use what: crates, methods, modules, files. `scripts/layers.py` has the rules.

use std::process::Command;

/// A plug-in crate shares compiled crates only with equal settings.
#[test]
fn the_example_has_the_profile_of_the_workspace() {
    let example = include_str!("../../../examples/plugin-crate/.cargo/config.toml");
    let profile = &example[example.find("[profile.release]").unwrap()..];
    assert!(include_str!("../../../Cargo.toml").contains(profile), "{profile}");
}

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
