//! Why a report could not be written.

use std::io;
use std::path::PathBuf;

use crate::plots::PlotError;

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file could not be made from the records.
    #[error("{what} could not be made: {message}")]
    Content {
        /// The file.
        what: &'static str,
        /// What went wrong.
        message: String,
    },
}

impl ReportError {
    pub(crate) fn csv(error: &csv::Error) -> Self {
        Self::Content { what: "results.csv", message: error.to_string() }
    }

    pub(crate) fn header(error: &serde_json::Error) -> Self {
        Self::Content { what: "header.json", message: error.to_string() }
    }
}

impl From<PlotError> for ReportError {
    fn from(error: PlotError) -> Self {
        Self::Content { what: "a plot", message: error.to_string() }
    }
}
