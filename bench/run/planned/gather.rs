//! What was run becomes a store.

use std::collections::HashSet;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use medial::write_atomically;
use medial_reports::Record;

use super::done::{done_file, group_folder, read_done};
use super::{Planned, PlannedError, io_error};
use crate::run::{Failures, Item, Store, StoreError};

/// Missing items that are named; of a larger number the first ones tell enough.
const NAMED: usize = 10;
/// Records that are added in one piece: each piece waits for the disk.
const PIECE: usize = 1000;
/// What is appended to the name of a file of records that cannot be read, so that its item counts as not run.
const DAMAGED: &str = ".damaged";

/// What was found in a planned folder.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Gathered {
    /// Records that were added now.
    pub added: usize,
    /// Items whose records are all in the store.
    pub complete: usize,
    /// Items that are missing.
    pub missing: usize,
    /// The first ones of them.
    pub first_missing: Vec<usize>,
    /// What was wrong with files that were passed over.
    pub damaged: Vec<String>,
}

/// Why records cannot be gathered.
#[derive(Debug, thiserror::Error)]
pub enum GatherError {
    /// The planned folder is at fault.
    #[error(transparent)]
    Planned(#[from] PlannedError),
    /// The store is at fault.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Adds to a store what was run and is not in it yet, in the order of the items, with the results that the records
/// name. Called again it adds nothing. A file of records that cannot be read is put aside, and its item counts as
/// missing.
///
/// # Errors
/// When the items are not as planned, a result cannot be copied or a record not be kept.
pub fn gather(planned: &Planned, store: &mut Store) -> Result<Gathered, GatherError> {
    let mut gathered = Gathered::default();
    let mut waiting: Vec<Record> = Vec::new();
    let mut group = Group::default();
    for numbered in planned.items() {
        let (number, item) = numbered?;
        let file = done_file(number, &item);
        if !group.has(planned.dir(), number, &file)? {
            match store.missing(&item, Failures::Kept).is_empty() {
                true => gathered.complete += 1,
                false => gathered.miss(number),
            }
            continue;
        }
        // Only a failure is replaced by what a later run says, so nothing else is read again.
        if store.missing(&item, Failures::Retried).is_empty() {
            gathered.complete += 1;
            continue;
        }
        let path = planned.dir().join(&file);
        match read_done(&path, &item) {
            Ok(Some(records)) => {
                waiting.extend(records.into_iter().filter(|record| store.wants(&item, record)));
                gathered.complete += 1;
            }
            Ok(None) => gathered.miss(number),
            Err(error) => {
                gathered.damaged.push(set_aside(&path, &error)?);
                gathered.miss(number);
            }
        }
        if waiting.len() >= PIECE {
            gathered.added += take(planned.dir(), store, &mut waiting)?;
        }
    }
    gathered.added += take(planned.dir(), store, &mut waiting)?;
    Ok(gathered)
}

/// The items that have no file of records, with their numbers.
pub fn not_done(planned: &Planned) -> impl Iterator<Item = Result<(usize, Item), PlannedError>> {
    let mut group = Group::default();
    planned.items().filter_map(move |numbered| {
        let done = numbered
            .as_ref()
            .map(|(number, item)| group.has(planned.dir(), *number, &done_file(*number, item)));
        match done {
            Ok(Ok(true)) => None,
            Ok(Err(error)) => Some(Err(error)),
            _ => Some(numbered),
        }
    })
}

impl Gathered {
    fn miss(&mut self, number: usize) {
        self.missing += 1;
        if self.first_missing.len() < NAMED {
            self.first_missing.push(number);
        }
    }
}

/// The names in one folder of items that were run: a listing costs less than to ask for each name.
#[derive(Default)]
struct Group {
    folder: PathBuf,
    names: HashSet<PathBuf>,
}

impl Group {
    /// Whether an item has a file of records.
    fn has(&mut self, dir: &Path, number: usize, file: &Path) -> Result<bool, PlannedError> {
        let folder = group_folder(number);
        if self.folder != folder {
            self.names = match fs::read_dir(dir.join(&folder)) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => HashSet::new(),
                entries => {
                    let names = entries.map_err(io_error(&dir.join(&folder)))?.flatten();
                    names.map(|entry| folder.join(entry.file_name())).collect()
                }
            };
            self.folder = folder;
        }
        Ok(self.names.contains(file))
    }
}

fn set_aside(path: &Path, error: &PlannedError) -> Result<String, PlannedError> {
    let mut aside = path.as_os_str().to_owned();
    aside.push(DAMAGED);
    fs::rename(path, &aside).map_err(io_error(path))?;
    Ok(format!("{error}; it was renamed to *{DAMAGED}, and its item is to be run again"))
}

/// Results first: a record in the store must not name a file that is not there.
fn take(from: &Path, store: &mut Store, records: &mut Vec<Record>) -> Result<usize, GatherError> {
    // Two rows of a study may ask the same level of a method; one record is enough.
    let mut seen = HashSet::new();
    records.retain(|record| seen.insert(record.key.clone()));
    let to = store.dir().to_owned();
    if !same_folder(from, &to) {
        for artifact in records.iter().filter_map(|record| record.artifact.as_deref()) {
            copy_result(from, &to, Path::new(artifact))?;
        }
    }
    store.take(records)?;
    let added = records.len();
    records.clear();
    Ok(added)
}

fn same_folder(a: &Path, b: &Path) -> bool {
    match (fs::canonicalize(a), fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}

fn copy_result(from: &Path, to: &Path, artifact: &Path) -> Result<(), PlannedError> {
    let inside = artifact.components().all(|part| matches!(part, Component::Normal(_)));
    let target = to.join(artifact);
    if !inside || target.exists() {
        return Ok(());
    }
    if let Some(folder) = target.parent() {
        fs::create_dir_all(folder).map_err(io_error(folder))?;
    }
    let source = from.join(artifact);
    let bytes = fs::read(&source).map_err(io_error(&source))?;
    write_atomically(&target, |out| out.write_all(&bytes)).map_err(io_error(&target))
}
