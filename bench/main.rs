//! The command `medial`.

use std::process::ExitCode;

fn main() -> ExitCode {
    medial_bench::main_with(medial_methods::registry())
}
