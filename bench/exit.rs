//! The exit codes of the verbs, and the error of all modules: a code and a message.

use std::fmt::Display;
use std::path::Path;
use std::process::ExitCode;

use medial_run::error::{FileError, InputError};

/// Exit codes of the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All was done.
    Done = 0,
    /// The user's input is wrong.
    Input = 1,
    /// The command line is wrong.
    Usage = 2,
    /// Some runs failed; the rest are reported.
    SomeFailed = 3,
    /// Something became worse.
    Regression = 4,
    /// Nothing was measured.
    NothingMeasured = 5,
    /// A broken invariant: a bug of this program.
    Bug = 70,
    /// The user interrupted: what shells give for a program ended from the keyboard.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// A verb that could not do its work.
#[derive(Debug)]
pub struct Failure {
    /// The exit code.
    pub code: Exit,
    /// `INPUT: PROBLEM; ADVICE`, one line in lower case without a full stop.
    pub message: String,
}

impl Failure {
    /// The user's input is wrong.
    pub fn input(message: impl ToString) -> Self {
        // Rust adds the number of an error of the system to its words.
        let mut message = message.to_string();
        while let Some(start) = message.find(" (os error ") {
            let end = message[start..].find(')').map_or(message.len(), |end| start + end + 1);
            message.replace_range(start..end, "");
        }
        Self { code: Exit::Input, message }
    }

    /// The command line is wrong.
    pub fn usage(message: impl ToString) -> Self {
        Self { code: Exit::Usage, message: message.to_string() }
    }

    /// A broken invariant, with the message of its panic.
    pub fn bug(message: impl Display) -> Self {
        let advice = "this is a bug of medial, please report it with the input";
        Self { code: Exit::Bug, message: format!("{message}; {advice}") }
    }

    /// The file or folder at `path` is wrong.
    pub fn at(path: &Path, message: impl Display) -> Self {
        Self::input(format!("{}: {message}", path.display()))
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        Self::input(error)
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        // Names are words of the command line.
        if error.is_option { Self::usage(error) } else { Self::input(error) }
    }
}
