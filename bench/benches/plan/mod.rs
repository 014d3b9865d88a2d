//! The measuring time of each benchmark, and the estimate of the total time before a run.

use std::env;
use std::io::Write;
use std::process::Command;
use std::time::Duration;

use criterion::Criterion;

/// Duration of the warm-up.
const WARM_UP: Duration = Duration::from_millis(300);
/// Measuring time. Slow benchmarks take longer for the least number of samples.
const MEASURED: Duration = Duration::from_millis(1700);
/// Samples of each benchmark.
const SAMPLES: usize = 10;
/// Resamples of the statistics: with few samples, more of them add no information.
const RESAMPLES: usize = 10_000;

/// The configuration of all benchmarks.
pub fn criterion() -> Criterion {
    Criterion::default()
        .warm_up_time(WARM_UP)
        .measurement_time(MEASURED)
        .sample_size(SAMPLES)
        .nresamples(RESAMPLES)
}

/// Prints the estimated time, and runs the groups of a program.
pub fn run(slow: &[(&str, f64)], groups: fn()) {
    announce(slow);
    groups();
    Criterion::default().configure_from_args().final_summary();
}

/// Prints the number of benchmarks that the command line selects, and their estimated time. `slow` has the additional
/// seconds of slow benchmarks by parts of their names.
fn announce(slow: &[(&str, f64)]) {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let has = |word: &str| arguments.iter().any(|argument| argument == word);
    // `cargo test --benches` and `--list` measure nothing.
    if !has("--bench") || ["--list", "--test", "--help"].iter().any(|word| has(word)) {
        return;
    }
    // Counted by the program itself, so that it holds for any filter and any registered benchmark.
    let Ok(program) = env::current_exe() else { return };
    let Ok(listed) = Command::new(program).args(&arguments).arg("--list").output() else { return };
    let listed = String::from_utf8_lossy(&listed.stdout);
    let names: Vec<&str> =
        listed.lines().filter_map(|line| line.strip_suffix(": benchmark")).collect();
    // No benchmark of this program matches the filter.
    if names.is_empty() {
        return;
    }
    let each = (WARM_UP + MEASURED).as_secs_f64();
    let longer = |name: &&str| -> f64 {
        slow.iter().find(|(part, _)| name.contains(part)).map_or(0.0, |(_, seconds)| *seconds)
    };
    // An empty sum is -0 and prints as such.
    let more = names.iter().map(longer).sum::<f64>() + 0.0;
    let seconds = names.len() as f64 * each + more;
    let quick = if has("--quick") { "; with --quick much less" } else { "" };
    let _ = writeln!(
        std::io::stderr(),
        "{} benchmarks of {each} s each, and {more:.0} s for slow ones: about {:.1} minutes{quick}",
        names.len(),
        seconds / 60.0
    );
}
