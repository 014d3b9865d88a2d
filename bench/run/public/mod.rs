//! Published meshes and the user's own, by name: fetched from packages, kept in a folder of caches, verified by their
//! hashes.
//!
//! | file | does |
//! |---|---|
//! | `library` | the folder: which mesh is there, which is missing, what a word of `--dataset` stands for |
//! | `add` | from a user's file into the folder |
//!
//! `scripts/fetch_meshes.py` fills the folder from packages. A file is known by the hash of its content alone.

mod add;
mod library;

use std::io;
use std::path::{Path, PathBuf};

pub use add::{Added, added};
pub use library::{Library, State};

/// What is wrong with published meshes.
#[derive(Debug, thiserror::Error)]
pub enum PublicError {
    /// There is no folder for caches.
    #[error("there is no folder for caches here: set MEDIAL_CACHE to one")]
    NoFolder,
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The catalogue that `MEDIAL_CATALOGUE` names is none.
    #[error("{}: {message}", path.display())]
    Catalogue {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// Nothing has this name.
    #[error(
        "no set, package or mesh is called `{word}`{meant}; `medial datasets list` names them all"
    )]
    Unknown {
        /// What was asked.
        word: String,
        /// What may have been meant.
        meant: String,
    },
    /// Meshes are not in the folder.
    #[error("{word}: {} not here: {how}", absent(names))]
    Missing {
        /// What was asked.
        word: String,
        /// The meshes that are missing.
        names: Vec<String>,
        /// The command that gets them.
        how: String,
    },
    /// A file cannot be kept under this name.
    #[error("{name}: {why}")]
    Name {
        /// The name.
        name: String,
        /// What is wrong, and what to do.
        why: String,
    },
    /// A user's file is no surface.
    #[error(transparent)]
    Surface(#[from] medial::surface::SurfaceError),
}

/// The most names of a list that are told.
const MOST_NAMES: usize = 5;

fn absent(names: &[String]) -> String {
    let more = names.len().saturating_sub(MOST_NAMES);
    let told = names[..names.len() - more].join(", ");
    match (names.len(), more) {
        (1, _) => format!("{told} is"),
        (_, 0) => format!("{told} are"),
        (_, more) => format!("{told} and {more} more are"),
    }
}

/// An error of the file system with the path that it is about.
fn io_error(path: &Path) -> impl FnOnce(io::Error) -> PublicError {
    let path = path.to_owned();
    move |source| PublicError::Io { path, source }
}
