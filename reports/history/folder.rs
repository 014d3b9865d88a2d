//! The folder of a history: one file for each night, only ever added.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::{HistoryError, Night};
use crate::journal::replace_file;

/// The nights of a folder, the oldest first.
#[derive(Debug, Default)]
pub struct History {
    /// By date; of one date in the order in which they were added.
    pub nights: Vec<Night>,
    /// Files that are no night, each with its name: they are left out.
    pub damaged: Vec<HistoryError>,
}

impl History {
    /// Reads all nights of a folder. Files that do not end in `.tsv` are none of its own.
    ///
    /// # Errors
    /// When the folder or a file cannot be read. Damaged files are no error: see [`Self::damaged`].
    pub fn read(folder: &Path) -> Result<Self, HistoryError> {
        let mut history = Self::default();
        for path in files(folder)? {
            let bytes = fs::read(&path).map_err(|source| io_error(&path, source))?;
            match Night::parse(&String::from_utf8_lossy(&bytes), &path) {
                Ok(night) => history.nights.push(night),
                Err(error) => history.damaged.push(error),
            }
        }
        history
            .nights
            .sort_by(|a, b| (&a.date, a.turn, &a.commit).cmp(&(&b.date, b.turn, &b.commit)));
        Ok(history)
    }

    /// Adds a night to a folder, which is made where it is missing. Returns its file, and whether it is new: the same
    /// night may be added again.
    ///
    /// # Errors
    /// [`HistoryError::Taken`] where another content stands in its place; when the folder cannot be read or
    /// written.
    pub fn add(folder: &Path, mut night: Night) -> Result<(PathBuf, bool), HistoryError> {
        let path = folder.join(night.file_name());
        match fs::read_to_string(&path) {
            Ok(text) => {
                let same = Night::parse(&text, &path)?.same_as(&night);
                return if same { Ok((path, false)) } else { Err(HistoryError::Taken(path)) };
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(io_error(&path, error)),
        }
        let others = if folder.exists() { Self::read(folder)?.nights } else { Vec::new() };
        let turns = others.iter().filter(|other| other.date == night.date).map(|other| other.turn);
        night.turn = turns.max().unwrap_or(0) + 1;
        replace_file(&path, night.to_text().as_bytes())
            .map_err(|source| io_error(&path, source))?;
        Ok((path, true))
    }
}

fn io_error(path: &Path, source: io::Error) -> HistoryError {
    HistoryError::Io { path: path.to_owned(), source }
}

/// The files of the nights, by name.
fn files(folder: &Path) -> Result<Vec<PathBuf>, HistoryError> {
    let failed = |source| io_error(folder, source);
    let entries: Vec<_> = fs::read_dir(folder).map_err(failed)?.collect();
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.map_err(failed)?.path();
        if path.extension() == Some(OsStr::new("tsv")) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
