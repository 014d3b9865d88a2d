//! Fuzzing targets: every reader and the kernels, each as a function of bytes that must neither panic nor hang, and
//! that checks the guarantees of the code under it.
//!
//! `scripts/fuzz TARGET SECONDS` drives a target by coverage (libFuzzer, with the stable compiler). The inputs that it
//! found worth keeping are in `corpus/TARGET`, those that once failed in `found/TARGET`; `cargo test` runs all of
//! them.

#![forbid(unsafe_code)]

mod formats;
mod kernels;

/// A function of bytes.
pub type Target = fn(&[u8]);

/// All targets, by name.
pub const TARGETS: [(&str, Target); 16] = [
    ("off", formats::off),
    ("obj", formats::obj),
    ("ply", formats::ply),
    ("stl", formats::stl),
    ("ma", formats::ma),
    ("ma_lenient", formats::ma_lenient),
    ("ma_points", formats::ma_points),
    ("medial_ply", formats::medial_ply),
    ("medial_obj", formats::medial_obj),
    ("spheres", formats::spheres),
    ("study", formats::study),
    ("plugins", formats::plugins),
    ("records", formats::records),
    ("triangulation", kernels::triangulation),
    ("dual_complex", kernels::dual_complex),
    ("collapse", kernels::collapse),
];

/// The target of a name.
pub fn target(name: &str) -> Option<Target> {
    TARGETS.iter().find(|(known, _)| *known == name).map(|(_, target)| *target)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    /// Every kept input of every target; a target without any is a mistake.
    #[test]
    fn kept_inputs_pass() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        for (name, target) in TARGETS {
            let mut inputs = 0;
            for folder in ["corpus", "found"] {
                let Ok(entries) = fs::read_dir(root.join(folder).join(name)) else { continue };
                for entry in entries {
                    let bytes = fs::read(entry.expect("an entry").path()).expect("a file");
                    target(&bytes);
                    inputs += 1;
                }
            }
            assert!(inputs > 0, "no input is kept for {name}");
        }
    }
}
