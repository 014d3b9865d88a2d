//! Items that were run: a file of records for each.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use medial::write_atomically;
use medial_reports::Record;

use super::{PlannedError, io_error};
use crate::run::{Item, hex_digest};

/// Name of the folder of the items that were run.
const DONE: &str = "done";
/// Items of one folder of it: larger folders are slow on shared file systems.
const GROUP: usize = 1000;

/// Where the records of an item lie, from the planned folder on. The name holds a hash of what decides the records,
/// so that those of another plan are not taken for its own.
pub fn done_file(number: usize, item: &Item) -> PathBuf {
    let key = hex_digest(item.keys().join("\n").as_bytes());
    let name = format!("{number:06}-{}.jsonl", &key[..12]);
    group_folder(number).join(name)
}

/// The folder of an item and of those beside it.
pub(super) fn group_folder(number: usize) -> PathBuf {
    Path::new(DONE).join(format!("{:03}", number / GROUP))
}

/// Keeps the records of an item as a whole or not at all.
///
/// # Errors
/// When they cannot be written.
pub fn keep_done(path: &Path, records: &[&Record]) -> Result<(), PlannedError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(io_error(folder))?;
    }
    let written = write_atomically(path, |out| {
        for record in records {
            serde_json::to_writer(&mut *out, record)?;
            out.write_all(b"\n")?;
        }
        Ok(())
    });
    written.map_err(io_error(path))
}

/// The records of an item that was run, in the order of its levels; `None` where it was not.
///
/// # Errors
/// When the file cannot be read, or holds something else: the item can be run again then, which replaces it.
pub fn read_done(path: &Path, item: &Item) -> Result<Option<Vec<Record>>, PlannedError> {
    let bytes = match fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        bytes => bytes.map_err(io_error(path))?,
    };
    let damaged = |line, message| PlannedError::Damaged { path: path.to_owned(), line, message };
    let lines = bytes.split(|&byte| byte == b'\n').filter(|line| !line.is_empty());
    let (mut records, keys) = (Vec::new(), item.keys());
    for (index, line) in lines.enumerate() {
        let record: Record = serde_json::from_slice(line)
            .map_err(|error| damaged(index + 1, format!("not a record: {error}")))?;
        if keys.get(index) != Some(&record.key) {
            return Err(damaged(index + 1, "a record of another item".into()));
        }
        records.push(record);
    }
    if records.len() < keys.len() {
        let message = format!("{} records where the item has {} levels", records.len(), keys.len());
        return Err(damaged(0, message));
    }
    Ok(Some(records))
}
