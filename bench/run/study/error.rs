//! What is wrong with a study.

use std::path::PathBuf;

use crate::run::public::PublicError;
use crate::run::{InputError, RegistryError, did_you_mean};

/// What is wrong with a study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The file cannot be read, or is no study.
    #[error("{}: {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the line.
        message: String,
    },
    /// A value makes no sense.
    #[error("{0}")]
    Value(String),
    /// No such method.
    #[error("{}", no_such_method(id, known))]
    Method {
        /// What was asked.
        id: String,
        /// What there is.
        known: Vec<String>,
    },
    /// An input is wrong.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A set is unknown, or not here.
    #[error(transparent)]
    Library(#[from] PublicError),
    /// A plug-in file is wrong.
    #[error(transparent)]
    Registry(#[from] RegistryError),
}

/// The message for an id that no method has, naming those that exist.
pub fn no_such_method(id: &str, known: &[String]) -> String {
    let meant = did_you_mean(id, known.iter().map(String::as_str));
    format!("no method is called `{id}`{meant}; there are: {}", known.join(", "))
}
