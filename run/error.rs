//! The errors of inputs and of files.

use std::fmt::Display;
use std::path::Path;

use medial::surface::SurfaceError;

/// A file and its problem, or a record without a JSON form and the reason, in one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FileError(pub String);

/// The reason for which an input cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct InputError {
    /// Whether its name is wrong, rather than its file.
    pub is_name: bool,
    /// One line.
    pub message: String,
}

impl InputError {
    pub(crate) fn name(message: impl ToString) -> Self {
        Self { is_name: true, message: message.to_string() }
    }

    pub(crate) fn file(path: &Path, problem: impl Display) -> Self {
        Self { is_name: false, message: FileError::at(path, problem).0 }
    }
}

impl From<SurfaceError> for InputError {
    fn from(error: SurfaceError) -> Self {
        Self { is_name: false, message: error.to_string() }
    }
}

impl FileError {
    /// The problem of the file at `path`.
    pub fn at(path: impl AsRef<Path>, problem: impl Display) -> Self {
        Self(format!("{}: {problem}", path.as_ref().display()))
    }
}
