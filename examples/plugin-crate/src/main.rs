//! The command `medial` with one method more: `cargo run -- compare --methods largest-rust,qmat`.

mod largest;

fn main() -> std::process::ExitCode {
    let mut methods = medial_methods::registry();
    methods.push(Box::new(largest::method()));
    medial_bench::main_with(methods)
}
