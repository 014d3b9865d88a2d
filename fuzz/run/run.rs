//! Drives the target that `MEDIAL_FUZZ_TARGET` names: `scripts/fuzz` builds and calls this.

#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use medial_fuzz::{TARGETS, Target, target};

static TARGET: LazyLock<Target> = LazyLock::new(|| {
    let name = std::env::var("MEDIAL_FUZZ_TARGET").unwrap_or_default();
    target(&name).unwrap_or_else(|| {
        let known: Vec<_> = TARGETS.iter().map(|(name, _)| *name).collect();
        panic!("MEDIAL_FUZZ_TARGET={name:?} is none of {}", known.join(", "))
    })
});

fuzz_target!(|bytes: &[u8]| TARGET(bytes));
