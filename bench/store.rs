//! The folder of results: records that accumulate.
//!
//! `results.jsonl` is append-only: one line for each level of each item, with a key that identifies
//! what was run. One process at a time adds to a store; its lock ends with the process, however that
//! ends.

use std::collections::HashMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Read, Seek, Write};
use std::path::{Component, Path, PathBuf};
use std::{fs, io};

use medial_reports::{Journal, JournalError, Record, Status, Target, read_records};
use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::study::item::Item;

/// Name of the append-only list of records of a comparison.
pub const RESULTS: &str = "results.jsonl";
/// Name of the folder of the results as `.ma`.
pub const AXES: &str = "axes";
/// Name of the page of a report.
pub const PAGE: &str = "index.html";
/// Name of the file that names the process that holds a store.
const LOCK: &str = ".lock";

/// A folder of results that this process may add to.
pub struct Store {
    dir: PathBuf,
    /// Held as long as the store is open.
    _lock: File,
    journal: Journal,
    known: HashMap<String, Known>,
    /// Number of records that this process has added.
    pub added: usize,
    /// Remarks about the folder as it was found.
    pub remarks: Vec<String>,
}

/// The facts of a record that decide whether its level has to be run again.
#[derive(Deserialize)]
struct Known {
    #[serde(default)]
    key: String,
    status: Status,
    #[serde(default)]
    repetitions: Vec<IgnoredAny>,
    conditions: Option<KnownLimits>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(default)]
struct KnownLimits {
    seconds_limit: f64,
    bytes_limit: u64,
}

/// Why a folder cannot be used as a store.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file or folder is wrong, in use, or the file system refused.
    #[error("{}: {why}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong, and what to do.
        why: String,
    },
    /// A record cannot be written.
    #[error(transparent)]
    Journal(#[from] JournalError),
}

fn wrong(path: &Path, why: impl ToString) -> StoreError {
    StoreError::File { path: path.to_owned(), why: why.to_string() }
}

impl Store {
    /// Opens or makes a folder of results, for `journal`, one of its lists of records.
    ///
    /// The remains of an interrupted process are removed, with a remark: temporary files, and an
    /// incomplete last line.
    ///
    /// # Errors
    /// When it is no folder, is not writable, or another process holds it.
    pub fn open(dir: &Path, journal: &str, command: &str) -> Result<Self, StoreError> {
        if dir.exists() && !dir.is_dir() {
            return Err(wrong(dir, "not a folder"));
        }
        fs::create_dir_all(dir).map_err(io_error(dir))?;
        // A lock or a study is left by a run that ended before its first record.
        let is_store = [LOCK, journal, "study.toml"].iter().any(|name| dir.join(name).exists());
        if !is_store && fs::read_dir(dir).map_err(io_error(dir))?.next().is_some() {
            let why = "neither empty nor a folder of results; take another with --out";
            return Err(wrong(dir, why));
        }
        // Before anything is repaired: another process may be in the middle of a line.
        let lock = lock(dir, command)?;
        let path = dir.join(journal);
        let (known, was_torn) = read_known(&path).map_err(io_error(&path))?;
        let mut remarks = Vec::new();
        if was_torn {
            remarks.push(format!(
                "{}: its last line was incomplete, the trace of a process that was ended while it \
                 wrote; it was removed, and its item is run again",
                path.display()
            ));
        }
        remove_temporaries(dir);
        let journal = Journal::open(&path)?;
        Ok(Self { dir: dir.to_owned(), _lock: lock, journal, known, added: 0, remarks })
    }

    /// The folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Removes all records, the results that they name and the page. Other files in the folder belong
    /// to the user and stay; the next report replaces its own tables and plots.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn clear(&mut self, journal: &str) -> Result<(), StoreError> {
        remove_artifacts(&self.dir, &self.dir.join(journal));
        for name in [PAGE, journal, "header.json", "study.toml", "results.csv"] {
            remove(&self.dir.join(name))?;
        }
        // The journal is gone: a stale state would skip what has to be run.
        self.known.clear();
        self.journal = Journal::open(self.dir.join(journal))?;
        Ok(())
    }

    /// The levels of an item that have to be run: levels without a record, levels that were ended by a
    /// limit that is larger now, and failed levels if these are to be retried.
    pub fn missing(&self, item: &Item, retry_failed: bool) -> Vec<Target> {
        (item.levels.iter().zip(item.keys()))
            .filter(|(_, key)| {
                let known = self.known.get(key);
                known.is_none_or(|known| known.is_incomplete(item, retry_failed))
            })
            .map(|(&level, _)| level)
            .collect()
    }

    /// Adds records.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn keep(&mut self, records: &[Record]) -> Result<(), StoreError> {
        // Before the first line: a page next to more records than it shows would be wrong, however the run ends.
        remove(&self.dir.join(PAGE))?;
        self.added += records.len();
        Ok(self.journal.append_lines(records)?)
    }
}

impl Known {
    fn is_incomplete(&self, item: &Item, retry_failed: bool) -> bool {
        let limits = self.conditions.unwrap_or_default();
        match self.status {
            // A result that came in time is the same under any limit; one that did not may come under a larger one.
            Status::TimedOut if item.limits.seconds > limits.seconds_limit => true,
            Status::OutOfMemory if item.limits.bytes > limits.bytes_limit => true,
            status if status.is_failure() => retry_failed,
            // A file is not timed.
            Status::External => false,
            status => status.has_result() && self.repetitions.len() < item.repeat,
        }
    }
}

/// Takes the lock and writes down who holds it.
fn lock(dir: &Path, command: &str) -> Result<File, StoreError> {
    let path = dir.join(LOCK);
    let mut options = OpenOptions::new();
    let file = options.read(true).write(true).create(true).truncate(false).open(&path);
    let mut file = file.map_err(io_error(&path))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            // Written by the other process after it took the lock: it may be empty for a moment.
            let mut holder = String::new();
            let _ = file.read_to_string(&mut holder);
            let holder = match holder.trim() {
                "" => "another process".to_owned(),
                holder => holder.to_owned(),
            };
            let why = "is adding results to this folder; wait for it, or take another with --out";
            return Err(wrong(dir, format!("{holder} {why}")));
        }
        // Some file systems have no locks; two runs into one folder go unnoticed there.
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
        Err(TryLockError::Error(error)) => return Err(io_error(&path)(error)),
    }
    // For the message alone: the lock itself is the system's, and ends with the process.
    let holder = format!("process {} (`{command}`)", std::process::id());
    let written = file
        .set_len(0)
        .and_then(|()| file.rewind())
        .and_then(|()| file.write_all(holder.as_bytes()));
    written.map_err(io_error(&path))?;
    Ok(file)
}

/// The state of each key, from its last line, and whether the last line was incomplete. It is cut off then.
fn read_known(path: &Path) -> io::Result<(HashMap<String, Known>, bool)> {
    let file = match OpenOptions::new().read(true).append(true).open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Default::default()),
        file => file?,
    };
    let (mut known, mut line, mut whole) = (HashMap::new(), Vec::new(), 0);
    let mut lines = BufReader::new(&file);
    // Line by line: millions of records need not fit into memory for their states.
    while lines.read_until(b'\n', &mut line)? > 0 {
        if !line.ends_with(b"\n") {
            if serde_json::from_slice::<IgnoredAny>(&line).is_err() {
                file.set_len(whole)?;
                return Ok((known, true));
            }
            // A complete record that only lacks its line break is kept.
            (&file).write_all(b"\n")?;
        }
        whole += line.len() as u64;
        if let Ok(record) = serde_json::from_slice::<Known>(&line)
            && !record.key.is_empty()
        {
            // Lines are only added: the last one of a key replaces the earlier.
            known.insert(record.key.clone(), record);
        }
        line.clear();
    }
    Ok((known, false))
}

/// Whether a path of a record stays in its store.
pub fn is_inside(path: &str) -> bool {
    Path::new(path).components().all(|part| matches!(part, Component::Normal(_)))
}

/// Removes the medial meshes that records name.
// A file that cannot be removed stays: without a record it does not count as a result.
fn remove_artifacts(dir: &Path, journal: &Path) {
    let Ok(journaled) = read_records(journal) else { return };
    for artifact in journaled.records.iter().filter_map(|record| record.artifact.as_deref()) {
        // A journal from elsewhere must not name files outside of its folder for removal.
        if is_inside(artifact) && artifact.ends_with(".ma") {
            let path = dir.join(artifact);
            let _ = fs::remove_file(&path);
            // Succeeds for a folder that is empty now.
            let _ = path.parent().map(fs::remove_dir);
        }
    }
}

/// Removes temporary files that this program left behind, only in the folders that it writes to.
// The lock is held, so none is in use.
fn remove_temporaries(dir: &Path) {
    let mut folders = vec![dir.to_owned(), dir.join("tables"), dir.join("plots")];
    // Never the folder's other contents: these belong to the user.
    folders.push(dir.join(AXES));
    let meshes = fs::read_dir(dir.join(AXES)).into_iter().flatten().flatten();
    folders.extend(meshes.map(|entry| entry.path()).filter(|path| path.is_dir()));
    let entries = folders.iter().flat_map(fs::read_dir).flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(".medial-") && name.ends_with(".tmp") {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn remove(path: &Path) -> Result<(), StoreError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other.map_err(io_error(path)),
    }
}

/// An error of the file system with the path that it is about.
fn io_error(path: &Path) -> impl Fn(io::Error) -> StoreError {
    let path = path.to_owned();
    move |error| wrong(&path, error)
}
