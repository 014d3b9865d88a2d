//! The folder of results: records that accumulate.
//!
//! `results.jsonl` is append-only: one line for each level of each item, with a key that identifies the
//! run. One process at a time adds to a store; its lock ends with the process, even if that is killed.

use std::collections::HashMap;
use std::fs::{DirEntry, File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Component, Path, PathBuf};
use std::{fs, io};

use medial::{read_regular, read_regular_text};
use medial_run::item::Item;
pub use medial_run::journal::RESULTS;
use medial_run::journal::{Journal, parse_records};
use medial_run::level::Target;
use medial_run::record::{Record, Status};

use crate::exit::Failure;

/// Name of the folder of the results as `.ma`.
pub const AXES: &str = "axes";
/// Name of the page of a report.
pub const PAGE: &str = "index.html";
/// Name of the file that names the process that holds a store.
const LOCK: &str = ".lock";
/// The text of this file begins with this.
const HOLDER: &str = "process ";
/// Names in the folder itself that are written or removed.
const FILES: [&str; 6] = [LOCK, RESULTS, PAGE, "header.json", "study.toml", "results.csv"];
/// Names of the folders in it that belong to this program.
const FOLDERS: [&str; 5] = [AXES, "pictures", "plots", "tables", "views"];

/// A folder of results that this process may add to.
pub struct Store {
    /// The folder.
    pub dir: PathBuf,
    /// Held as long as the store is open.
    _lock: File,
    journal: Journal,
    /// The last record of each key.
    known: HashMap<String, Record>,
    /// Number of records that this process has added.
    pub added: usize,
    /// Remarks about the folder as it was found.
    pub remarks: Vec<String>,
    /// Whether an incomplete last line was removed.
    pub was_cut: bool,
}

impl Store {
    /// Opens or makes a folder of results.
    ///
    /// Removes temporary files of an interrupted process, and with a remark an incomplete last line. Fails when it is
    /// not a folder, has other files or a link where results are written, is not writable, or another process holds it.
    pub fn open(dir: &Path, command: &str) -> Result<Self, Failure> {
        let entries = entries_of(dir);
        claim(dir, is_store(dir), &entries)?;
        fs::create_dir_all(dir).map_err(io_error(dir))?;
        // Before anything is repaired: another process may be in the middle of a line.
        let lock = lock(dir, command)?;
        let path = dir.join(RESULTS);
        let (known, remarks, was_cut) = read_known(&path).map_err(io_error(&path))?;
        // Temporary files of an ended process. The lock is held, so none is in use.
        for entry in entries.iter().filter(|entry| is_temporary(entry)) {
            let _ = fs::remove_file(entry.path());
        }
        let journal = Journal::open(&path)?;
        Ok(Self { dir: dir.to_owned(), _lock: lock, journal, known, added: 0, remarks, was_cut })
    }

    /// Removes all records, the results that they name and the page. Other files in the folder belong to the user and
    /// stay; the next report replaces its own tables and plots.
    pub fn clear(&mut self) -> Result<(), Failure> {
        let artifacts = self.known.values().filter_map(|record| record.artifact.as_deref());
        for path in artifacts.filter_map(|artifact| artifact_path(&self.dir, artifact)) {
            // A remaining file without a record does not count as a result.
            let _ = fs::remove_file(&path);
            // Succeeds for a folder that is empty now.
            let _ = path.parent().map(fs::remove_dir);
        }
        for name in FILES.iter().filter(|&&name| name != LOCK) {
            remove(&self.dir.join(name))?;
        }
        // The journal is gone: a stale state would skip what has to be run.
        self.known.clear();
        self.journal = Journal::open(self.dir.join(RESULTS))?;
        Ok(())
    }

    /// Removes the page, which another report replaces.
    pub fn remove_page(&self) -> Result<(), Failure> {
        remove(&self.dir.join(PAGE))
    }

    /// The levels of an item to run: levels without a record or without their medial mesh, levels that a limit ended or
    /// a budget skipped if it is larger now, and failed or skipped levels with `retry_failed`.
    pub fn missing(&self, item: &Item, retry_failed: bool) -> Vec<Target> {
        (item.levels.iter().zip(item.keys()))
            .filter(|(_, key)| {
                let known = self.known.get(key);
                known.is_none_or(|record| {
                    self.lacks_mesh(record, item) || is_incomplete(record, item, retry_failed)
                })
            })
            .map(|(&level, _)| level)
            .collect()
    }

    /// Whether a medial mesh that has to be on disk is missing there.
    fn lacks_mesh(&self, record: &Record, item: &Item) -> bool {
        let is_there = |name| artifact_path(&self.dir, name).is_some_and(|path| path.is_file());
        match (&record.artifact, record.simplify.spheres) {
            (Some(name), _) => !is_there(name),
            (None, Some(n)) => item.keeps(record.simplify.level, n),
            (None, None) => false,
        }
    }

    pub fn append(&mut self, records: &[Record]) -> Result<(), Failure> {
        self.added += records.len();
        Ok(self.journal.append(records)?)
    }
}

/// Whether the level of a record has to be run again.
fn is_incomplete(record: &Record, item: &Item, retry_failed: bool) -> bool {
    let limits = &record.conditions;
    match record.status {
        // A finished result is the same under any limit; an interrupted one may finish under a larger limit.
        Status::TimedOut if item.limits.seconds > limits.seconds_limit => true,
        Status::OutOfMemory if item.limits.bytes > limits.bytes_limit => true,
        Status::Skipped if item.limits.budget.is_none_or(|budget| Some(budget) > limits.budget) => {
            true
        }
        status if status.is_failure() || status == Status::Skipped => retry_failed,
        // A file is not timed.
        Status::External => false,
        status => status.has_result() && record.repetitions.len() < item.repeat,
    }
}

/// Whether a folder has a list of records, or the lock of a run that ended before its first one.
pub fn is_store(dir: &Path) -> bool {
    let lock = dir.join(LOCK);
    let holder = read_regular_text(lock);
    // Another process creates it, and then writes into it.
    let is_new = |text: &str| text.is_empty() && listed(dir).count() == 1;
    let is_ours = holder.is_ok_and(|text| text.starts_with(HOLDER) || is_new(&text));
    is_ours || dir.join(RESULTS).exists()
}

/// Refuses a folder with other files, and a folder with a link or a device among its `entries`, which this program
/// reads, writes or removes. The folder itself may be a link.
pub fn claim(dir: &Path, is_ours: bool, entries: &[DirEntry]) -> Result<(), Failure> {
    if dir.exists() && !dir.is_dir() {
        return Err(Failure::at(dir, "not a folder"));
    }
    // Requests to workers are JSON, which has no other text.
    if dir.to_str().is_none() {
        return Err(Failure::at(dir, "the name is not UTF-8; choose another by --out"));
    }
    if !is_ours && listed(dir).next().is_some() {
        let why = "neither empty nor a folder of results; choose another by --out";
        return Err(Failure::at(dir, why));
    }
    for entry in entries {
        let kind = entry.file_type().map_err(io_error(&entry.path()))?;
        if !kind.is_file() && !kind.is_dir() {
            let why =
                "not a regular file, in a folder of results; remove it, or choose another folder";
            return Err(Failure::at(&entry.path(), why));
        }
    }
    Ok(())
}

/// The entries of a folder; none where it cannot be listed.
pub fn listed(dir: impl AsRef<Path>) -> impl Iterator<Item = DirEntry> {
    fs::read_dir(dir).into_iter().flatten().flatten()
}

/// The entries of a store that belong to this program, by their names or by their folders. All other entries belong to
/// the user. Folders come before their contents.
pub fn entries_of(dir: &Path) -> Vec<DirEntry> {
    let is_named = |entry: &DirEntry| {
        let name = entry.file_name();
        FILES.iter().chain(&FOLDERS).any(|own| *own == name) || is_temporary(entry)
    };
    let mut entries: Vec<DirEntry> = listed(dir).filter(is_named).collect();
    entries.extend(FOLDERS.iter().flat_map(|folder| listed(dir.join(folder))));
    let meshes = listed(dir.join(AXES)).filter(|mesh| mesh.file_type().is_ok_and(|t| t.is_dir()));
    entries.extend(meshes.flat_map(|mesh| listed(mesh.path())));
    entries
}

/// Whether it is a temporary file of an interrupted write.
fn is_temporary(entry: &DirEntry) -> bool {
    let name = entry.file_name();
    let name = name.to_string_lossy();
    name.starts_with(".medial-") && name.ends_with(".tmp")
}

/// Takes the lock and writes the process id and the command into it.
fn lock(dir: &Path, command: &str) -> Result<File, Failure> {
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
            let holder = if holder.is_empty() { "another process" } else { &holder };
            let why = "is adding results to this folder; wait for it, or choose another by --out";
            return Err(Failure::at(dir, format!("{holder} {why}")));
        }
        // Some file systems have no locks; two runs into one folder go unnoticed there.
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
        Err(TryLockError::Error(error)) => return Err(io_error(&path)(error)),
    }
    // For the message alone: the lock itself is the system's, and ends with the process.
    let holder = format!("{HOLDER}{} (`{command}`)", std::process::id());
    let written = file
        .set_len(0)
        .and_then(|()| file.rewind())
        .and_then(|()| file.write_all(holder.as_bytes()));
    written.map_err(io_error(&path))?;
    Ok(file)
}

/// The last record of each key, and remarks on lines without a record: an incomplete last line is removed, others stay
/// and do not count.
fn read_known(path: &Path) -> io::Result<(HashMap<String, Record>, Vec<String>, bool)> {
    let bytes = match read_regular(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Default::default()),
        bytes => bytes?,
    };
    let (name, mut remarks) = (path.display(), Vec::new());
    let whole = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    let is_torn = parse_records(&bytes[whole..]).bad_lines.iter().any(|line| line.torn);
    if is_torn {
        OpenOptions::new().write(true).open(path)?.set_len(whole as u64)?;
        remarks.push(format!(
            "{name}: removed an incomplete last line left by an interrupted run; its item runs again"
        ));
    }
    let journaled = parse_records(if is_torn { &bytes[..whole] } else { &bytes });
    if let Some(first) = journaled.bad_lines.first() {
        let count = journaled.bad_lines.len();
        let all = count + journaled.records.len();
        remarks.push(format!(
            "{name}: {count} of {all} lines have no record; their items run again; {first}"
        ));
    }
    // Lines are only added: the last one of a key replaces the earlier.
    let known = journaled.records.into_iter().map(|record| (record.key.clone(), record));
    Ok((known.collect(), remarks, is_torn))
}

/// The medial mesh of a record in the folder of its results; `None` for another file, and where the path leads out of
/// that folder, by `..` or by a symbolic link in it. Records come from elsewhere and may name any file.
pub fn artifact_path(dir: &Path, artifact: &str) -> Option<PathBuf> {
    let named = Path::new(artifact);
    if !named.starts_with(AXES) || named.extension().is_none_or(|end| end != "ma") {
        return None;
    }
    let mut file = dir.to_owned(); // links of the folder itself are the user's
    for part in named.components() {
        let Component::Normal(part) = part else { return None };
        file.push(part);
        if file.is_symlink() {
            return None;
        }
    }
    Some(file)
}

fn remove(path: &Path) -> Result<(), Failure> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other.map_err(io_error(path)),
    }
}

/// Adds the path to an error of the file system.
fn io_error(path: &Path) -> impl Fn(io::Error) -> Failure {
    let path = path.to_owned();
    move |error| Failure::at(&path, error)
}
