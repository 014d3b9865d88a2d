//! Taking a stranger's archive apart.
//!
//! Nothing in it is believed. Only plain files with the few names that an archive has are unpacked, into a fresh folder,
//! under names of our own; sizes are limited before anything is read; links, folders, devices, extended headers
//! and anything else end it.

use std::collections::{BTreeMap, HashSet};
use std::fs::{self, File};
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use medial_reports::{Record, read_records};
use sha2::{Digest, Sha256};
use tar::{Archive, Entry, EntryType};

use super::{FORMAT, MANIFEST, Manifest, ParcelError, RECORDS, STUDY, axis_name, is_key};
use crate::run::hex;

/// The most bytes of all files together, unpacked.
const MOST_BYTES: u64 = 8 << 30;

/// The most bytes of one file: records and medial meshes are read as a whole.
const MOST_BYTES_OF_ONE: u64 = 1 << 30;

/// An archive, unpacked and found whole.
#[derive(Debug)]
pub struct Opened {
    /// SHA-256 of the archive: its name.
    pub hash: String,
    /// Version of the program that packed it.
    pub version: String,
    /// Its records, one for each key.
    pub records: Vec<Record>,
    /// The text of the study.
    pub study: Option<String>,
    /// The folder that it was unpacked to.
    folder: PathBuf,
}

impl Opened {
    /// Where the medial mesh of a record is, if it has one.
    pub fn axis(&self, record: &Record) -> Option<PathBuf> {
        record.artifact.as_ref().map(|_| self.folder.join(axis_name(&record.key)))
    }
}

/// Unpacks an archive into an empty folder, and checks that its files are those that its manifest tells.
///
/// # Errors
/// When it cannot be read, or anything in it is not as in an archive that [`pack`](super::pack()) made.
pub fn open(archive: &Path, folder: &Path) -> Result<Opened, ParcelError> {
    let refused = |why: String| ParcelError::Refused { archive: archive.to_owned(), why };
    let failed = |source| ParcelError::Io { path: archive.to_owned(), source };
    let hash = hash_of(archive).map_err(failed)?;
    fs::create_dir_all(folder.join("axes"))
        .map_err(|source| ParcelError::Io { path: folder.to_owned(), source })?;
    let file = File::open(archive).map_err(failed)?;
    let unpacked = unpack(file, folder).map_err(|problem| match problem {
        Problem::Refused(why) => refused(why),
        Problem::Io(error) => refused(format!("it cannot be unpacked: {error}")),
    })?;
    let manifest =
        fs::read(folder.join(MANIFEST)).map_err(|_| refused("it has no manifest".into()))?;
    let manifest: Manifest = serde_json::from_slice(&manifest)
        .map_err(|error| refused(format!("its manifest cannot be read: {error}")))?;
    if manifest.format != FORMAT {
        let format: String = manifest.format.chars().take(40).collect();
        return Err(refused(format!("its format is {format:?}, not {FORMAT:?}")));
    }
    if let Some(name) = differing(&manifest.files, &unpacked) {
        return Err(refused(format!("{name} is not as its manifest tells")));
    }
    let records = records(folder, &unpacked).map_err(refused)?;
    let study = fs::read_to_string(folder.join(STUDY)).ok();
    Ok(Opened { hash, version: manifest.version, records, study, folder: folder.to_owned() })
}

/// Why an archive is not unpacked.
enum Problem {
    Refused(String),
    Io(io::Error),
}

impl From<io::Error> for Problem {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Unpacks the files, and gives the SHA-256 of each but the manifest.
fn unpack(file: File, folder: &Path) -> Result<BTreeMap<String, String>, Problem> {
    // Headers count as well: millions of empty files must end, too.
    let limited = GzDecoder::new(BufReader::new(file)).take(MOST_BYTES);
    let mut archive = Archive::new(limited);
    let mut hashes = BTreeMap::new();
    let mut left = MOST_BYTES;
    // Raw: an extended header could ask for any amount of memory, and give any name.
    for (place, entry) in archive.entries()?.raw(true).enumerate() {
        let mut entry = entry?;
        let (name, size) = checked(&entry)?;
        if (place == 0) != (name == MANIFEST) {
            return Err(Problem::Refused(format!(
                "its first file is not the manifest, but {name}"
            )));
        }
        let most = left.min(MOST_BYTES_OF_ONE);
        if size > most {
            let why = format!("{name} would have {size} bytes, more than {most} are not taken");
            return Err(Problem::Refused(why));
        }
        left -= size;
        let hash = store(&mut entry, &folder.join(&name), size)?;
        if name != MANIFEST && hashes.insert(name.clone(), hash).is_some() {
            return Err(Problem::Refused(format!("{name} is in it twice")));
        }
    }
    Ok(hashes)
}

/// The name of an entry, where it is one of those that an archive has, and its size.
fn checked(entry: &Entry<'_, impl Read>) -> Result<(String, u64), Problem> {
    let header = entry.header();
    let path = entry.path_bytes();
    let shown: String = String::from_utf8_lossy(&path).escape_debug().take(120).collect();
    if header.entry_type() != EntryType::Regular {
        let why = format!("`{shown}` is no plain file ({:?})", header.entry_type());
        return Err(Problem::Refused(why));
    }
    let name = String::from_utf8(path.into_owned()).unwrap_or_default();
    let axis = name.strip_prefix("axes/").and_then(|rest| rest.strip_suffix(".ma"));
    let is_known = [MANIFEST, RECORDS, STUDY].contains(&name.as_str()) || axis.is_some_and(is_key);
    if !is_known {
        return Err(Problem::Refused(format!("`{shown}` is no file of such an archive")));
    }
    Ok((name, header.size()?))
}

/// Writes an entry to a file, and gives its SHA-256.
fn store(entry: &mut impl Read, path: &Path, size: u64) -> io::Result<String> {
    let mut file = File::create_new(path)?;
    let mut hasher = Sha256::new();
    let mut block = vec![0; 1 << 16];
    let mut written = 0;
    loop {
        let read = entry.read(&mut block)?;
        if read == 0 {
            break;
        }
        hasher.update(&block[..read]);
        file.write_all(&block[..read])?;
        written += read as u64;
    }
    if written != size {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(hex(&hasher.finalize()))
}

/// A file that is told and not there, or there and not told, or another.
fn differing(told: &BTreeMap<String, String>, found: &BTreeMap<String, String>) -> Option<String> {
    let mut names = told.keys().chain(found.keys());
    names.find(|&name| told.get(name) != found.get(name)).cloned()
}

/// The records: each with a key of its own, each medial mesh with its record.
fn records(folder: &Path, files: &BTreeMap<String, String>) -> Result<Vec<Record>, String> {
    let journaled = read_records(&folder.join(RECORDS)).map_err(|error| error.to_string())?;
    if let Some(bad) = journaled.bad_lines.first() {
        return Err(format!("its records: {bad}"));
    }
    let mut keys = HashSet::new();
    for record in &journaled.records {
        if !is_key(&record.key) || !keys.insert(&record.key) {
            return Err(format!("the key {:.80?} is no key, or in it twice", record.key));
        }
        if record.artifact.is_some() && !files.contains_key(&axis_name(&record.key)) {
            return Err(format!("the medial mesh of record {} is missing", record.key));
        }
    }
    let with_axis: HashSet<String> = (journaled.records.iter())
        .filter(|record| record.artifact.is_some())
        .map(|record| axis_name(&record.key))
        .collect();
    let stray = files.keys().find(|name| name.starts_with("axes/") && !with_axis.contains(*name));
    match stray {
        Some(name) => Err(format!("{name} belongs to no record")),
        None => Ok(journaled.records),
    }
}

fn hash_of(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut hasher = Sha256::new();
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block)? {
            0 => return Ok(hex(&hasher.finalize())),
            read => hasher.update(&block[..read]),
        }
    }
}
