//! Reading and writing `results.jsonl`: one record per line, append-only.
//!
//! A line is written by one call and synchronised before the next item starts, so that a crash
//! costs at most the line being written. Such a torn line is left where it is, reported on
//! reading, and never joined with the line after it.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use medial::{check_regular, parser_message, read_regular, write_atomically};

use crate::error::FileError;
use crate::record::Record;

/// Name of the append-only list of records of a comparison, in its folder.
pub const RESULTS: &str = "results.jsonl";

/// An open `results.jsonl` that records are added to.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
}

impl Journal {
    /// Opens or creates the file for appending. Where the last line is torn, closes it with a
    /// line break, so that it spoils no record but itself.
    ///
    /// # Errors
    /// When the file cannot be opened, read or written.
    pub fn open(path: impl Into<PathBuf>) -> Result<Self, FileError> {
        let path = path.into();
        match open_for_lines(&path) {
            Ok(file) => Ok(Self { file, path }),
            Err(error) => Err(FileError::at(&path, error)),
        }
    }

    /// Adds records in one piece, and waits until they are on the disk.
    ///
    /// # Errors
    /// When a record holds a number that JSON cannot carry (not finite), without writing anything, or when writing fails.
    pub fn append(&mut self, records: &[Record]) -> Result<(), FileError> {
        let lines: String = records.iter().map(to_line).collect::<Result<_, _>>()?;
        // One call, so that lines of two processes do not mix.
        self.file
            .write_all(lines.as_bytes())
            .and_then(|()| self.file.sync_data())
            .map_err(|error| FileError::at(&self.path, error))
    }
}

fn open_for_lines(path: &Path) -> io::Result<File> {
    check_regular(path)?;
    let mut file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
    if file.metadata()?.len() > 0 {
        let mut last = [0];
        file.seek(SeekFrom::End(-1))?;
        file.read_exact(&mut last)?;
        // Without the break the next record would be joined with a torn one, and both be lost.
        if last != *b"\n" {
            file.write_all(b"\n")?;
        }
    }
    Ok(file)
}

/// The content of a `results.jsonl`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Journaled {
    /// The records, in the order of the file.
    pub records: Vec<Record>,
    /// Lines that are no record.
    pub bad_lines: Vec<BadLine>,
}

/// A line that is no record.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {}", match torn {
    true => "torn by an interrupted write; run its item again".to_owned(),
    false => format!("not a record: {message}"),
})]
pub struct BadLine {
    /// Number of the line, from 1.
    pub line: usize,
    /// Whether the line stops in the middle of a record, left by an interrupted write.
    pub torn: bool,
    /// The parser's message.
    pub message: String,
}

/// Reads every record of a `results.jsonl`. Other lines are returned as [`BadLine`]s, empty lines are skipped.
///
/// # Errors
/// When the file cannot be read.
pub fn read_records(path: &Path) -> Result<Journaled, FileError> {
    let bytes = read_regular(path).map_err(|error| FileError::at(path, error))?;
    Ok(parse_records(&bytes))
}

/// [`read_records`] of bytes.
pub fn parse_records(bytes: &[u8]) -> Journaled {
    let mut journaled = Journaled::default();
    for (index, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        if line.trim_ascii().is_empty() {
            continue;
        }
        match serde_json::from_slice::<Record>(line) {
            Ok(record) => journaled.records.push(record),
            Err(error) => journaled.bad_lines.push(BadLine {
                line: index + 1,
                torn: error.is_eof(),
                message: parser_message(&error.to_string()),
            }),
        }
    }
    journaled
}

/// Writes a whole `results.jsonl` under a temporary name and renames it.
///
/// # Errors
/// As [`Journal::append`].
pub fn write_records(path: &Path, records: &[Record]) -> Result<(), FileError> {
    let text = records.iter().map(to_line).collect::<Result<String, _>>()?;
    replace_file(path, text.as_bytes()).map_err(|error| FileError::at(path, error))
}

/// Replaces a file as a whole: a reader sees the old bytes or the new ones, never a part.
pub fn replace_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    write_atomically(path, |out| out.write_all(bytes))
}

/// One line with its line break. JSON has no infinity and no NaN and serde writes `null` for
/// them, which no reader accepts: such a record is rejected here.
pub fn to_line(record: &Record) -> Result<String, FileError> {
    let written = serde_json::to_string(record).and_then(|line| {
        let back: Record = serde_json::from_str(&line)?;
        Ok((line, back == *record))
    });
    let message = match written {
        Ok((line, true)) => return Ok(line + "\n"), // reads back bit for bit
        Ok((_, false)) => "a number is not finite".to_owned(),
        Err(error) => error.to_string(),
    };
    let (mesh, method) = (&record.mesh, &record.simplify.method);
    Err(FileError(format!("{method} on {mesh}: the record has no JSON form ({message})")))
}
