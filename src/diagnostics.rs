//! Counts and warnings of a result.

use serde::{Deserialize, Serialize};

/// Counts and warnings of a result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Diagnostics {
    /// Named counts, such as `rejected_by_link_condition`, in the order of the algorithm.
    pub counts: Vec<(String, u64)>,
    /// Sentences for the user, such as the reason why the requested count was not reached.
    pub warnings: Vec<String>,
}

impl Diagnostics {
    /// Adds a named count.
    pub fn count(&mut self, name: &str, value: usize) {
        self.counts.push((name.to_owned(), value as u64));
    }

    /// Adds a warning.
    pub fn warn(&mut self, warning: impl Into<String>) {
        self.warnings.push(warning.into());
    }
}
