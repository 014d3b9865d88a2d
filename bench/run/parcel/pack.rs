//! Packing a folder of results.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use medial::write_atomically;
use medial_reports::{Record, read_records};
use tar::{Builder, EntryType, Header};

use super::{FORMAT, MANIFEST, Manifest, ParcelError, RECORDS, STUDY, axis_name, is_key};
use crate::run::{Provenance, RESULTS, hex_digest};

/// What was packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packed {
    /// Records.
    pub records: usize,
    /// Medial meshes.
    pub axes: usize,
}

/// Packs the records of a folder that count, with the medial meshes that they name.
///
/// # Errors
/// When there is no record, one has no key or names a file that is not in the folder, or a file cannot be read or
/// written.
pub fn pack(dir: &Path, archive: &Path, provenance: &Provenance) -> Result<Packed, ParcelError> {
    let records = counted(dir)?;
    let mut files: Vec<(String, Content)> = Vec::new();
    let mut lines = String::new();
    for record in &records {
        let line = serde_json::to_string(record).map_err(|error| wrong(record, error))?;
        lines.push_str(&line);
        lines.push('\n');
    }
    files.push((RECORDS.to_owned(), Content::Text(lines.into_bytes())));
    if let Ok(text) = fs::read(dir.join("study.toml")) {
        files.push((STUDY.to_owned(), Content::Text(text)));
    }
    for record in &records {
        if let Some(artifact) = &record.artifact {
            let path = inside(dir, artifact).ok_or_else(|| wrong(record, outside(artifact)))?;
            files.push((axis_name(&record.key), Content::File(path)));
        }
    }
    let axes = files.iter().filter(|(_, content)| matches!(content, Content::File(_))).count();
    write(archive, &files, provenance)?;
    Ok(Packed { records: records.len(), axes })
}

/// A file of the archive: its bytes, or where they are.
enum Content {
    Text(Vec<u8>),
    File(PathBuf),
}

impl Content {
    fn bytes(&self) -> Result<Vec<u8>, ParcelError> {
        match self {
            Self::Text(bytes) => Ok(bytes.clone()),
            Self::File(path) => {
                fs::read(path).map_err(|source| ParcelError::Io { path: path.clone(), source })
            }
        }
    }
}

/// The last record of each key, by key.
fn counted(dir: &Path) -> Result<Vec<Record>, ParcelError> {
    let journaled = read_records(&dir.join(RESULTS))?;
    let mut by_key = BTreeMap::new();
    for record in journaled.records {
        if !is_key(&record.key) {
            return Err(wrong(
                &record,
                "it has no key: it was made by an older build; run it again",
            ));
        }
        by_key.insert(record.key.clone(), record);
    }
    if by_key.is_empty() {
        return Err(ParcelError::Empty(dir.to_owned()));
    }
    Ok(by_key.into_values().collect())
}

fn wrong(record: &Record, why: impl ToString) -> ParcelError {
    let (mesh, method) = (record.mesh.clone(), record.simplify.method.clone());
    ParcelError::Record { mesh, method, why: why.to_string() }
}

fn outside(artifact: &str) -> String {
    format!("its medial mesh {artifact} is not a file in the folder")
}

/// A file in a folder, unless its name leads out of it.
fn inside(dir: &Path, name: &str) -> Option<PathBuf> {
    let is_plain = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
    Some(dir.join(name)).filter(|path| is_plain && path.is_file())
}

fn write(
    archive: &Path,
    files: &[(String, Content)],
    provenance: &Provenance,
) -> Result<(), ParcelError> {
    let mut hashes = BTreeMap::new();
    for (name, content) in files {
        hashes.insert(name.clone(), hex_digest(&content.bytes()?));
    }
    let manifest = Manifest {
        format: FORMAT.to_owned(),
        version: provenance.version.clone(),
        machine: provenance.machine.clone(),
        files: hashes,
    };
    let manifest = serde_json::to_vec_pretty(&manifest).map_err(io::Error::from);
    let failed = |source| ParcelError::Io { path: archive.to_owned(), source };
    let manifest = manifest.map_err(failed)?;
    write_atomically(archive, |out| {
        // No time and no name of a file: the same folder gives the same bytes.
        let mut tar = Builder::new(GzEncoder::new(out, Compression::default()));
        add(&mut tar, MANIFEST, &manifest)?;
        for (name, content) in files {
            add(&mut tar, name, &content.bytes().map_err(io::Error::other)?)?;
        }
        tar.into_inner()?.finish()?.flush()
    })
    .map_err(failed)
}

fn add(tar: &mut Builder<impl Write>, name: &str, bytes: &[u8]) -> io::Result<()> {
    let mut header = Header::new_ustar();
    header.set_entry_type(EntryType::Regular);
    header.set_mode(0o644);
    header.set_size(bytes.len() as u64);
    tar.append_data(&mut header, name, bytes)
}
