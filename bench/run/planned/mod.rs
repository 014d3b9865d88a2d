//! A planned folder: the items of a study as files, so that any number of processes on any number of hosts can run
//! them on one shared folder.
//!
//! | in the folder | what |
//! |---|---|
//! | `plan.json` | how many items there are, and for each block of them where it begins and its hash |
//! | `items.jsonl` | the items, one a line; paths in them start at the folder |
//! | `meshes/HASH.EXTENSION` | the inputs, each once, by the hash of its content |
//! | `study.toml` | the study, with these meshes |
//! | `done/GROUP/NUMBER-KEY.jsonl` | the records of an item that was run |
//! | `axes/` | the results, as in a store |
//!
//! One file of items rather than a file for each: a million of files burden a shared file system, and a line is found
//! as fast, since `plan.json` says where its block begins. Nothing is locked: an item that was run is a file of its own,
//! written under another name and renamed when it is complete. Of two processes that run one item at the same time the
//! later one replaces the records of the earlier one by its own, which are as good.
//!
//! | files | step |
//! |---|---|
//! | `write` | a study becomes a folder |
//! | `done` | an item that was run, and whether it was |
//! | `gather` | what was run becomes a store |

mod done;
mod gather;
mod write;

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Item, Provenance, hex_digest};

pub use done::{done_file, keep_done, read_done};
pub use gather::{GatherError, Gathered, gather, not_done};
pub use write::{Division, check_travels, write_plan};

/// Name of the file that makes a folder a planned one.
pub const PLAN: &str = "plan.json";
/// Name of the list of items.
pub const ITEMS: &str = "items.jsonl";
/// Name of the folder of the inputs.
pub const MESHES: &str = "meshes";

/// Items of a block: one is read and checked as a whole to find an item.
const BLOCK: usize = 256;
/// The format of a planned folder.
const FORMAT: u32 = 1;

/// What `plan.json` holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// The format of the folder.
    format: u32,
    /// The command that planned it: that of all records, since every process has another one.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// SHA-256 of the program that planned it and must run it.
    pub binary: String,
    /// Number of items.
    pub items: usize,
    /// Number of their levels together: a record for each.
    pub levels: usize,
    /// The blocks of `items.jsonl`.
    blocks: Vec<Block>,
}

/// Some lines of `items.jsonl` that follow each other.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Block {
    /// Byte at which it begins.
    offset: u64,
    /// Bytes of it.
    bytes: u64,
    /// SHA-256 of it.
    sha256: String,
}

/// A planned folder that was opened.
#[derive(Clone, Debug)]
pub struct Planned {
    dir: PathBuf,
    /// What `plan.json` says.
    pub plan: Plan,
}

/// What is wrong with a planned folder.
#[derive(Debug, thiserror::Error)]
pub enum PlannedError {
    /// It has no `plan.json`.
    #[error("{}: there is no {PLAN} in it; `medial plan STUDY -o DIR` makes such a folder", .0.display())]
    NotPlanned(PathBuf),
    /// Something else was planned into it.
    #[error(
        "{}: another study, or the same by another build or with other options, was planned into this folder; take \
         another one",
        .0.display()
    )]
    Another(PathBuf),
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file does not hold what it should.
    #[error("{}{}: {message}", path.display(), line_words(*line))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The line, from 1; 0 where it is not one line.
        line: usize,
        /// What is wrong, and what to do.
        message: String,
    },
    /// There is no such item.
    #[error("item {number}: this plan has the items 0 to {}", items.saturating_sub(1))]
    NoSuchItem {
        /// What was asked.
        number: usize,
        /// How many there are.
        items: usize,
    },
    /// Another build planned it.
    #[error(
        "{}: planned by another build of this program ({}, this is {}): run it with that one, or plan it again into \
         another folder",
        dir.display(), short(planned), short(here)
    )]
    Foreign {
        /// The folder.
        dir: PathBuf,
        /// SHA-256 of the program that planned.
        planned: String,
        /// SHA-256 of this program.
        here: String,
    },
    /// An input is not what was planned.
    #[error("{}: {message}; copy the planned folder again as a whole", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// A study that cannot be planned.
    #[error("{0}")]
    Study(String),
}

fn line_words(line: usize) -> String {
    if line == 0 { String::new() } else { format!(": line {line}") }
}

/// A hash as people are shown it.
fn short(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}

/// An error of the file system with the path that it is about.
fn io_error(path: &Path) -> impl FnOnce(io::Error) -> PlannedError {
    let path = path.to_owned();
    move |source| PlannedError::Io { path, source }
}

impl Planned {
    /// Opens a planned folder.
    ///
    /// # Errors
    /// When it is none, or its `plan.json` cannot be read.
    pub fn open(dir: &Path) -> Result<Self, PlannedError> {
        let path = dir.join(PLAN);
        let text = match fs::read_to_string(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Err(PlannedError::NotPlanned(dir.to_owned()));
            }
            text => text.map_err(io_error(&path))?,
        };
        let damaged = |message| PlannedError::Damaged { path: path.clone(), line: 0, message };
        let plan: Plan = serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
        if plan.format != FORMAT || plan.blocks.len() != plan.items.div_ceil(BLOCK) {
            let message =
                format!("format {} or its blocks are not as this program writes them", plan.format);
            return Err(damaged(message));
        }
        Ok(Self { dir: dir.to_owned(), plan })
    }

    /// The folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Refuses another build than the one that planned: its records would have other keys.
    ///
    /// # Errors
    /// [`PlannedError::Foreign`].
    pub fn check_build(&self, here: &Provenance) -> Result<(), PlannedError> {
        if self.plan.binary == here.binary_hash {
            return Ok(());
        }
        let (planned, here) = (self.plan.binary.clone(), here.binary_hash.clone());
        Err(PlannedError::Foreign { dir: self.dir.clone(), planned, here })
    }

    /// An item, with paths as they stand in the file.
    ///
    /// # Errors
    /// When there is none of this number, or its line or one beside it is not as it was planned.
    pub fn item(&self, number: usize) -> Result<Item, PlannedError> {
        if number >= self.plan.items {
            return Err(PlannedError::NoSuchItem { number, items: self.plan.items });
        }
        let bytes = self.bytes_of(number / BLOCK)?;
        let line = bytes.split(|&byte| byte == b'\n').nth(number % BLOCK);
        self.parsed(number, line.unwrap_or_default())
    }

    /// All items with their numbers, block by block, so that a million of them need little memory.
    pub fn items(&self) -> impl Iterator<Item = Result<(usize, Item), PlannedError>> {
        let numbered = |block: usize| -> Vec<Result<(usize, Item), PlannedError>> {
            let bytes = match self.bytes_of(block) {
                Ok(bytes) => bytes,
                Err(error) => return vec![Err(error)],
            };
            let first = block * BLOCK;
            let count = (self.plan.items - first).min(BLOCK);
            let lines = bytes.split(|&byte| byte == b'\n').take(count);
            let items = lines.enumerate().map(|(place, line)| {
                let number = first + place;
                Ok((number, self.parsed(number, line)?))
            });
            items.collect()
        };
        (0..self.plan.blocks.len()).flat_map(numbered)
    }

    /// The bytes of a block, which must be those that were planned. A line that is no item is named rather than the
    /// block that holds it.
    fn bytes_of(&self, block: usize) -> Result<Vec<u8>, PlannedError> {
        let path = self.dir.join(ITEMS);
        let Block { offset, bytes: length, sha256 } = &self.plan.blocks[block];
        let mut file = File::open(&path).map_err(io_error(&path))?;
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(*offset)).map_err(io_error(&path))?;
        file.take(*length).read_to_end(&mut bytes).map_err(io_error(&path))?;
        if hex_digest(&bytes) == *sha256 {
            return Ok(bytes);
        }
        let first = block * BLOCK;
        let count = (self.plan.items - first).min(BLOCK);
        for (place, line) in bytes.split(|&byte| byte == b'\n').take(count).enumerate() {
            self.parsed(first + place, line)?;
        }
        let message = format!(
            "the lines to {} are not those that were planned; copy the planned folder again as a whole",
            first + count
        );
        Err(PlannedError::Damaged { path, line: first + 1, message })
    }

    fn parsed(&self, number: usize, line: &[u8]) -> Result<Item, PlannedError> {
        serde_json::from_slice(line).map_err(|error| PlannedError::Damaged {
            path: self.dir.join(ITEMS),
            line: number + 1,
            message: format!("not an item: {error}; copy the planned folder again as a whole"),
        })
    }

    /// The item with its input where it lies here. An input that is missing or another one is an error rather than a
    /// record: the folder is at fault, not the mesh.
    ///
    /// # Errors
    /// [`PlannedError::Mesh`].
    pub fn resolved(&self, mut item: Item) -> Result<Item, PlannedError> {
        let Some(relative) = item.scene.source.path() else { return Ok(item) };
        let path = self.dir.join(relative);
        let wrong = |message: String| PlannedError::Mesh { path: path.clone(), message };
        let bytes = fs::read(&path).map_err(|error| wrong(error.to_string()))?;
        let hash = hex_digest(&bytes);
        if item.scene.hash.as_ref().is_some_and(|planned| *planned != hash) {
            return Err(wrong(format!("not the mesh that was planned (SHA-256 {hash})")));
        }
        item.scene.source = item.scene.source.moved(path);
        Ok(item)
    }
}
