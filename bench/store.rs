//! The folder of results: records that accumulate.
//!
//! `results.jsonl` is append-only: one line for each level of each item, with a key that identifies
//! what was run. One process at a time adds to a store; its lock ends with the process, however that
//! ends.

use std::collections::HashMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};
use std::{fs, io};

use medial_reports::{Journal, JournalError, Status, Target, read_records};
use serde::{Deserialize, Serialize};

use crate::study::item::Item;

/// Name of the append-only list of records of a comparison.
pub const RESULTS: &str = "results.jsonl";
/// Name of the folder of the results as `.ma`.
pub const AXES: &str = "axes";
/// Name of the file that names the process that holds a store.
const LOCK: &str = ".lock";

/// A folder of results that this process may add to.
pub struct Store {
    dir: PathBuf,
    /// Held as long as the store is open.
    _lock: File,
    journal: Journal,
    known: HashMap<String, Known>,
    /// Whether the page of an earlier state of the records was removed.
    page_withdrawn: bool,
    /// Remarks about the folder as it was found.
    pub remarks: Vec<String>,
}

/// The facts that decide whether a level has to be run again.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Known {
    status: Status,
    repetitions: usize,
    seconds_limit: f64,
    bytes_limit: u64,
}

/// The fields of a record that a store needs.
#[derive(Deserialize)]
struct Stub {
    #[serde(default)]
    key: String,
    status: Status,
    #[serde(default)]
    repetitions: Vec<serde::de::IgnoredAny>,
    #[serde(default)]
    conditions: Option<StubConditions>,
}

#[derive(Deserialize)]
struct StubConditions {
    #[serde(default)]
    seconds_limit: f64,
    #[serde(default)]
    bytes_limit: u64,
}

/// Why a folder cannot be used as a store.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It is a file.
    #[error("{}: not a folder", .0.display())]
    NotAFolder(PathBuf),
    /// It holds something else than results.
    #[error("{}: neither empty nor a folder of results; take another with --out", .0.display())]
    NotAStore(PathBuf),
    /// Another process adds to it.
    #[error(
        "{}: {holder} is adding results to this folder; wait for it, or take another with --out",
        dir.display()
    )]
    Held {
        /// The folder.
        dir: PathBuf,
        /// Who holds it, as it says itself.
        holder: String,
    },
    /// A record cannot be written.
    #[error(transparent)]
    Journal(#[from] JournalError),
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
            return Err(StoreError::NotAFolder(dir.to_owned()));
        }
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |source| StoreError::Io { path, source }
        };
        fs::create_dir_all(dir).map_err(failed(dir))?;
        let is_store = [LOCK, journal, "study.toml"].iter().any(|name| dir.join(name).exists());
        if !is_store && fs::read_dir(dir).map_err(failed(dir))?.next().is_some() {
            return Err(StoreError::NotAStore(dir.to_owned()));
        }
        let lock = lock(dir, command)?;
        let path = dir.join(journal);
        let mut remarks = Vec::new();
        if cut_torn_line(&path).map_err(failed(&path))? {
            remarks.push(format!(
                "{}: its last line was incomplete, the trace of a process that was ended while it \
                 wrote; it was removed, and its item is run again",
                path.display()
            ));
        }
        remove_temporaries(dir);
        let known = read_known(&path).map_err(failed(&path))?;
        let journal = Journal::open(&path)?;
        Ok(Self {
            dir: dir.to_owned(),
            _lock: lock,
            journal,
            known,
            page_withdrawn: false,
            remarks,
        })
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
        self.withdraw_page()?;
        remove_artifacts(&self.dir, &self.dir.join(journal));
        for name in [journal, "header.json", "study.toml", "results.csv"] {
            let path = self.dir.join(name);
            remove(&path).map_err(|source| StoreError::Io { path, source })?;
        }
        self.known.clear();
        self.journal = Journal::open(self.dir.join(journal))?;
        Ok(())
    }

    /// Whether there is a record with a key.
    pub fn has(&self, key: &str) -> bool {
        self.known.contains_key(key)
    }

    /// The levels of an item that have to be run: levels without a record, levels that were ended by a
    /// limit that is larger now, and failed levels if failures are to be retried.
    pub fn missing(&self, item: &Item, failures: Failures) -> Vec<Target> {
        (item.levels.iter().zip(item.keys()))
            .filter(|(_, key)| {
                let known = self.known.get(key);
                known.is_none_or(|known| known.is_incomplete(item, failures))
            })
            .map(|(&level, _)| level)
            .collect()
    }

    /// Adds lines: records, or what holds a record with what belongs beside it.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn keep(&mut self, lines: &[impl Serialize]) -> Result<(), StoreError> {
        // Before the first line: a page next to more records than it shows would be wrong, however the run ends.
        self.withdraw_page()?;
        Ok(self.journal.append_lines(lines)?)
    }

    /// Removes the page, which no longer matches the records.
    fn withdraw_page(&mut self) -> Result<(), StoreError> {
        if !self.page_withdrawn {
            let path = self.dir.join("index.html");
            remove(&path).map_err(|source| StoreError::Io { path, source })?;
            self.page_withdrawn = true;
        }
        Ok(())
    }
}

/// How levels that failed before are treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failures {
    /// Their records stand.
    Kept,
    /// They are run again.
    Retried,
}

impl From<bool> for Failures {
    /// From the option `--retry-failed`.
    fn from(retry: bool) -> Self {
        if retry { Self::Retried } else { Self::Kept }
    }
}

impl Known {
    fn is_incomplete(&self, item: &Item, failures: Failures) -> bool {
        match self.status {
            Status::TimedOut if item.limits.seconds > self.seconds_limit => true,
            Status::OutOfMemory if item.limits.bytes > self.bytes_limit => true,
            status if status.is_failure() => failures == Failures::Retried,
            // A file is not timed.
            Status::External => false,
            status => status.has_result() && self.repetitions < item.repeat,
        }
    }
}

/// Takes the lock and writes down who holds it.
fn lock(dir: &Path, command: &str) -> Result<File, StoreError> {
    let path = dir.join(LOCK);
    let failed = |source| StoreError::Io { path: path.clone(), source };
    let mut options = OpenOptions::new();
    let mut file =
        options.read(true).write(true).create(true).truncate(false).open(&path).map_err(failed)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            let mut holder = String::new();
            let _ = file.read_to_string(&mut holder);
            let holder = match holder.trim() {
                "" => "another process".to_owned(),
                holder => holder.to_owned(),
            };
            return Err(StoreError::Held { dir: dir.to_owned(), holder });
        }
        // Some file systems have no locks; two runs into one folder go unnoticed there.
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
        Err(TryLockError::Error(error)) => return Err(failed(error)),
    }
    let holder = format!("process {} (`{command}`)", std::process::id());
    file.set_len(0).map_err(failed)?;
    file.rewind().map_err(failed)?;
    file.write_all(holder.as_bytes()).map_err(failed)?;
    Ok(file)
}

/// Cuts off an incomplete last line; returns whether there was one.
fn cut_torn_line(path: &Path) -> io::Result<bool> {
    let mut file = match OpenOptions::new().read(true).append(true).open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        file => file?,
    };
    let (whole, torn) = last_line(&mut file)?;
    if torn.is_empty() {
        return Ok(false);
    }
    // A complete record that only lacks its line break is kept.
    if serde_json::from_slice::<serde::de::IgnoredAny>(&torn).is_ok() {
        file.write_all(b"\n")?;
        return Ok(false);
    }
    file.set_len(whole)?;
    Ok(true)
}

/// What stands behind the last line break, and where it begins. Read from the end: of millions of records nobody wants
/// to wait for the first.
fn last_line(file: &mut File) -> io::Result<(u64, Vec<u8>)> {
    const STEP: u64 = 1 << 16;
    let length = file.metadata()?.len();
    let (mut begin, mut tail) = (length, Vec::new());
    while begin > 0 {
        let from = begin.saturating_sub(STEP);
        let mut piece = vec![0; (begin - from) as usize];
        file.seek(SeekFrom::Start(from))?;
        file.read_exact(&mut piece)?;
        piece.extend(tail);
        (begin, tail) = (from, piece);
        if let Some(end) = tail.iter().rposition(|&byte| byte == b'\n') {
            return Ok((begin + end as u64 + 1, tail.split_off(end + 1)));
        }
    }
    Ok((0, tail))
}

/// The state of each key, from its last line.
fn read_known(path: &Path) -> io::Result<HashMap<String, Known>> {
    let mut file = match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(HashMap::new()),
        file => BufReader::new(file?),
    };
    let mut known = HashMap::new();
    let mut line = Vec::new();
    // Line by line: millions of records need not fit into memory for their states.
    while file.read_until(b'\n', &mut line)? > 0 {
        if let Some(stub) = stub(line.trim_ascii_end()) {
            let limits = stub.conditions;
            let (seconds_limit, bytes_limit) =
                limits.map_or((0.0, 0), |limits| (limits.seconds_limit, limits.bytes_limit));
            let repetitions = stub.repetitions.len();
            known.insert(
                stub.key,
                Known { status: stub.status, repetitions, seconds_limit, bytes_limit },
            );
        }
        line.clear();
    }
    Ok(known)
}

fn stub(line: &[u8]) -> Option<Stub> {
    let stub = serde_json::from_slice::<Stub>(line).ok();
    stub.filter(|stub| !stub.key.is_empty())
}

/// Removes the medial meshes that records name. A file that cannot be removed stays: without a record
/// it does not count as a result.
fn remove_artifacts(dir: &Path, journal: &Path) {
    let Ok(journaled) = read_records(journal) else { return };
    for artifact in journaled.records.iter().filter_map(|record| record.artifact.as_deref()) {
        let inside = Path::new(artifact).components().all(|c| matches!(c, Component::Normal(_)));
        if inside && artifact.ends_with(".ma") {
            let path = dir.join(artifact);
            let _ = fs::remove_file(&path);
            // Succeeds for a folder that is empty now.
            let _ = path.parent().map(fs::remove_dir);
        }
    }
}

/// Removes temporary files that this program left behind, only in the folders that it writes to. The
/// lock is held, so none is in use.
fn remove_temporaries(dir: &Path) {
    let mut folders = vec![dir.to_owned(), dir.join("tables"), dir.join("plots")];
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

fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}
