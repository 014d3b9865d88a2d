//! The measuring time of each benchmark.

use std::time::Duration;

use criterion::Criterion;

/// The configuration of all benchmarks: two seconds for each, more for slow ones, which take the least number of samples.
pub fn criterion() -> Criterion {
    Criterion::default()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1700))
        .sample_size(10)
        // With few samples, more resamples add no information.
        .nresamples(10_000)
}
