//! Why a night cannot be kept, or a history cannot be read.

use std::io;
use std::path::PathBuf;

/// Why a night cannot be kept, or a history cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum HistoryError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file of a night is not as it was written.
    #[error("{}: line {line}: {message}; take the file back from the repository, or remove it", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong there.
        message: String,
    },
    /// The night is there already, with other results.
    #[error(
        "{}: this night is in the history already, with other content; a night is measured once: remove the file \
         first if it is to be replaced",
        .0.display()
    )]
    Taken(PathBuf),
    /// The commit is no hash.
    #[error("commit {0:?}: 8 to 64 hexadecimal digits are a commit's hash (git rev-parse HEAD)")]
    Commit(String),
    /// The date is none.
    #[error("date {0:?}: a date is YYYY-MM-DD")]
    Date(String),
    /// The records are of more than one machine, or of more than one study.
    #[error(
        "{mesh}, {row}: {what} differs from that of the other records: a night is one study on one machine"
    )]
    Mixed {
        /// Mesh of the record.
        mesh: String,
        /// Its row.
        row: String,
        /// What differs.
        what: &'static str,
    },
    /// There is nothing to keep.
    #[error("no record: a night needs the results of one run of `medial compare`")]
    Empty,
}
