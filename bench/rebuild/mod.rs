//! The report of a store, made of the store's files: records, study, and the header of the earlier report.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use jiff::tz::TimeZone;
use medial_reports::{
    Header, MethodNote, Record, RunNote, read_header, read_records, write_report,
};

use crate::exit::{Exit, Failure};
use crate::files;
use crate::provenance::Provenance;
use crate::store::{PAGE, RESULTS};
use crate::study::Study;
use crate::study::registry::Registry;

mod pictures;

/// Name of the file with the last requested study.
pub const STUDY: &str = "study.toml";

/// A report that was rebuilt, or found as it should be.
pub struct Rebuilt {
    /// The records.
    pub records: Vec<Record>,
    /// The files that were written.
    pub files: Vec<PathBuf>,
    /// Lines that hold no record.
    pub warnings: Vec<String>,
    /// Meshes whose results have no picture, and why.
    pub undrawn: Vec<String>,
}

/// Rebuilds the report of a folder from its files.
///
/// # Errors
/// When the folder has no readable record, or the report cannot be written.
pub fn rebuild(dir: &Path, registry: &Registry) -> Result<Rebuilt, Failure> {
    let (records, warnings) = records(dir)?;
    if records.is_empty() {
        let message = match warnings.first() {
            None => format!("{}: no record in {RESULTS}", dir.display()),
            Some(first) => format!("{}: no readable record in {RESULTS}; {first}", dir.display()),
        };
        return Err(Failure { code: Exit::NothingMeasured, message });
    }
    let header = header(dir, &records, registry, &warnings);
    write(dir, records, warnings, &header)
}

/// After a run of `compare`: notes the run where it has `added` records, and rebuilds the report where
/// that is needed. Without anything new the page stays as it is.
///
/// # Errors
/// When the records cannot be read, or the report cannot be written.
pub fn refresh(
    dir: &Path,
    registry: &Registry,
    provenance: &Provenance,
    added: usize,
) -> Result<Rebuilt, Failure> {
    let (records, warnings) = records(dir)?;
    // Byte for byte the same page: a repeated command changes no file.
    if added == 0 && dir.join(PAGE).exists() {
        return Ok(Rebuilt { records, files: vec![], warnings, undrawn: vec![] });
    }
    let mut header = header(dir, &records, registry, &warnings);
    for run in &mut header.runs {
        if run.command == provenance.command && run.binary_hash == provenance.binary_hash {
            // The store keeps the date of the first run of a command.
            let now = jiff::Timestamp::now().to_zoned(TimeZone::UTC);
            run.date.get_or_insert_with(|| now.date().to_string());
            break;
        }
    }
    write(dir, records, warnings, &header)
}

fn write(
    dir: &Path,
    records: Vec<Record>,
    warnings: Vec<String>,
    header: &Header,
) -> Result<Rebuilt, Failure> {
    // An input of the last study that cannot be read any more leaves its pictures as they are.
    let study = Study::read(&dir.join(STUDY)).ok();
    let sources = study.and_then(|study| study.sources().ok()).unwrap_or_default();
    let undrawn = pictures::draw(dir, &records, &sources);
    let files = write_report(dir, &records, header).map_err(Failure::input)?;
    Ok(Rebuilt { records, files, warnings, undrawn })
}

/// Writes the requested study next to its results.
///
/// # Errors
/// When it cannot be written.
pub fn write_study(dir: &Path, study: &Study) -> Result<(), Failure> {
    files::write(&dir.join(STUDY), study.to_text()?.as_bytes())
}

/// The records of a store or of a file, and the lines that hold none.
///
/// # Errors
/// When the file cannot be read.
pub fn records(path: &Path) -> Result<(Vec<Record>, Vec<String>), Failure> {
    let file = if path.is_dir() { path.join(RESULTS) } else { path.to_owned() };
    let journaled = read_records(&file).map_err(Failure::input)?;
    let warnings = journaled.bad_lines.iter().map(ToString::to_string).collect();
    Ok((journaled.records, warnings))
}

/// The header of the earlier report, brought up to date, or one from the records alone.
fn header(dir: &Path, records: &[Record], registry: &Registry, warnings: &[String]) -> Header {
    let earlier = read_header(dir).unwrap_or_default();
    let mut header = Header {
        title: "Medial axis simplification: a comparison".into(),
        runs: earlier.runs,
        methods: earlier.methods,
        study: fs::read_to_string(dir.join(STUDY)).ok(),
        notes: warnings.to_vec(),
        running: None,
    };
    for record in records {
        if !header
            .runs
            .iter()
            .any(|known| known.command == record.command && known.binary_hash == record.binary_hash)
        {
            // Records can come from other machines and from runs that were interrupted before their report.
            header.runs.push(RunNote {
                command: record.command.clone(),
                version: record.version.clone(),
                binary_hash: record.binary_hash.clone(),
                date: None,
                machine: Some(record.machine.clone()),
            });
        }
    }
    // Methods of this program are described as they are now, also those without a record, which the page names; those
    // of plug-ins that are not named this time stay as they were.
    let ids: BTreeSet<&str> = records.iter().map(|r| r.simplify.method.as_str()).collect();
    // A merged or cleared store can name methods that have no record any more.
    header.methods.retain(|method| ids.contains(method.id.as_str()));
    let recorded = ids.into_iter().filter_map(|id| registry.entry(id));
    for entry in registry.entries().iter().chain(recorded) {
        let note = MethodNote::new(entry.method().info(), entry.presentation());
        match header.methods.iter_mut().find(|known| known.id == entry.id()) {
            Some(known) => *known = note,
            None => header.methods.push(note),
        }
    }
    // In the order of the tables.
    header.methods.sort_by_key(|method| {
        let place = registry.entries().iter().position(|entry| entry.id() == method.id);
        place.unwrap_or(usize::MAX)
    });
    header
}
