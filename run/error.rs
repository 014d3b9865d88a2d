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
    /// Whether its name or an option is wrong, rather than its content.
    pub is_option: bool,
    /// One line.
    pub message: String,
}

impl InputError {
    /// A name or an option is wrong.
    pub fn option(message: impl ToString) -> Self {
        Self { is_option: true, message: message.to_string() }
    }

    /// The content is wrong.
    pub fn input(message: impl ToString) -> Self {
        Self { is_option: false, message: message.to_string() }
    }

    pub(crate) fn file(path: &Path, problem: impl Display) -> Self {
        Self::input(FileError::at(path, problem))
    }
}

impl From<SurfaceError> for InputError {
    fn from(error: SurfaceError) -> Self {
        Self::input(error)
    }
}

impl FileError {
    /// The problem of the file at `path`.
    pub fn at(path: impl AsRef<Path>, problem: impl Display) -> Self {
        Self(format!("{}: {problem}", path.as_ref().display()))
    }
}
