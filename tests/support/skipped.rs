//! The last executable of `cargo test --workspace`: the number of skipped tests as one line.

#[allow(clippy::print_stdout, reason = "the last line of the tests")]
fn main() {
    let list = medial_test_support::list();
    let skipped = std::fs::read_to_string(&list).unwrap_or_default();
    match medial_test_support::summary(&skipped, medial_test_support::run()) {
        Some(summary) => println!("{summary}"),
        None => println!("skipped: no test"),
    }
    // The list of `.ci/run` stays.
    if std::env::var_os("MEDIAL_SKIPPED").is_none() {
        let _ = std::fs::remove_file(list);
    }
}
