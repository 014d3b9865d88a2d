//! The reason for which a report could not be written.

use std::fmt::Display;
use std::io;
use std::path::PathBuf;

/// The reason for which a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// Reading or writing failed.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's message.
        source: io::Error,
    },
    /// A file could not be made from the records.
    #[error("{what}: cannot be made ({message})")]
    Content {
        /// The file.
        what: &'static str,
        /// The cause.
        message: String,
    },
}

impl ReportError {
    pub(crate) fn content(what: &'static str, error: impl Display) -> Self {
        Self::Content { what, message: error.to_string() }
    }
}
