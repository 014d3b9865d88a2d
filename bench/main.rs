//! The command `medial`.

use std::process::ExitCode;

fn main() -> ExitCode {
    medial_bench::cli::main()
}
