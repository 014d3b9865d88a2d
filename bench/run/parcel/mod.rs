//! Results on their way from one machine to another: one archive with records, medial meshes, study and checksums.
//!
//! | file | does |
//! |---|---|
//! | `pack` | makes an archive of a folder of results |
//! | `open` | takes a stranger's archive apart, and refuses what could do harm |
//! | `rejudge` | measures its medial meshes again, with the judge of this machine |
//!
//! The archive is a gzipped tar of regular files: `manifest.json` first, then `results.jsonl`, `study.toml` where there
//! is one, and `axes/KEY.ma`, one for each record that has a medial mesh, in the unit of its input. The same folder gives
//! the same bytes.

mod open;
mod pack;
mod rejudge;

use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;

use medial_reports::{JournalError, Machine};
use serde::{Deserialize, Serialize};

pub use open::{Opened, open};
pub use pack::{Packed, pack};
pub use rejudge::{Rejudged, Surfaces, rejudge};

/// The name of the format, and its version.
const FORMAT: &str = "medial results 1";

/// Names of the files in an archive.
const MANIFEST: &str = "manifest.json";
const RECORDS: &str = "results.jsonl";
const STUDY: &str = "study.toml";

/// The first file of an archive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    format: String,
    /// Version of the program that packed it.
    version: String,
    /// Where it was packed.
    machine: Machine,
    /// SHA-256 of every other file, by name.
    files: BTreeMap<String, String>,
}

/// Where a record's medial mesh is in an archive.
fn axis_name(key: &str) -> String {
    format!("axes/{key}.ma")
}

/// Whether a text can be a record's key: a hash in hexadecimal, so that it is a harmless name.
fn is_key(key: &str) -> bool {
    key.len() == 64 && key.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// Why results cannot be packed or taken in.
#[derive(Debug, thiserror::Error)]
pub enum ParcelError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Records cannot be read.
    #[error(transparent)]
    Records(#[from] JournalError),
    /// There is nothing to pack.
    #[error("{}: no record to pack", .0.display())]
    Empty(PathBuf),
    /// A record of a folder has no usable key, or names a medial mesh that is not there.
    #[error("{mesh}, {method}: {why}")]
    Record {
        /// Name of its mesh.
        mesh: String,
        /// Its method.
        method: String,
        /// What is wrong.
        why: String,
    },
    /// The archive is refused.
    #[error("{}: refused: {why}", archive.display())]
    Refused {
        /// The archive.
        archive: PathBuf,
        /// What is wrong.
        why: String,
    },
}
