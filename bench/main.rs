//! The command `medial`.

use std::process::ExitCode;

fn main() -> ExitCode {
    let methods = medial_methods::registry().into_iter().chain(medial_methods::on_request());
    medial_bench::main_with(methods.collect())
}
