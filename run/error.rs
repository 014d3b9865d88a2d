//! The error of reading and writing files.

use std::fmt::Display;
use std::path::Path;

/// A file and its problem, or the problem of what was to be written, in one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FileError(pub String);

impl FileError {
    /// The problem of the file at `path`.
    pub fn at(path: impl AsRef<Path>, problem: impl Display) -> Self {
        Self(format!("{}: {problem}", path.as_ref().display()))
    }
}
