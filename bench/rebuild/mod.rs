//! The report of a store, built from its files: records, study, and the header of the earlier report.

use std::collections::{BTreeSet, HashMap};
use std::fs;
use std::path::{Path, PathBuf};

use jiff::tz::TimeZone;
use medial_reports::{Header, MethodNote, RunNote, read_header, write_report, write_site};
use medial_run::item::{GIVEN, Item};
use medial_run::journal::read_records;
use medial_run::record::{Provenance, Record, Status};
use serde_json::json;

use crate::exit::{Exit, Failure};
use crate::files;
use crate::own_metric::attach;
use crate::provenance::provenance;
use crate::store::{PAGE, RESULTS};
use crate::study::Study;
use crate::study::edition::Edition;
use crate::study::registry::Registry;

mod own;
mod pictures;

pub use own::measure_own;
use pictures::inputs;

/// The records of some items, in the order of the items.
pub fn of_items(records: Vec<Record>, items: &[Item]) -> Vec<Record> {
    // The last record of a key counts.
    let mut by_key: HashMap<String, Record> =
        records.into_iter().map(|record| (record.key.clone(), record)).collect();
    items.iter().flat_map(Item::keys).filter_map(|key| by_key.remove(&key)).collect()
}

/// Name of the file with the last requested study.
pub const STUDY: &str = "study.toml";

/// A report that was rebuilt or is up to date.
pub struct Rebuilt {
    pub records: Vec<Record>,
    pub files: Vec<PathBuf>,
    /// Lines without a record.
    pub warnings: Vec<String>,
    /// Meshes without pictures, with the reasons.
    pub undrawn: Vec<String>,
}

/// Rebuilds the report of a store from its files, in its folder, or as a static site in another one while the store stays
/// unchanged. Fails when the store has no readable record, or the report cannot be written.
pub fn rebuild(dir: &Path, site: Option<&Path>, registry: &Registry) -> Result<Rebuilt, Failure> {
    let (records, warnings) = records(dir)?;
    if records.is_empty() {
        let message = match warnings.first() {
            None => format!("{}: no record in {RESULTS}", dir.display()),
            Some(first) => format!("{}: no readable record in {RESULTS}; {first}", dir.display()),
        };
        return Err(Failure { code: Exit::NothingMeasured, message });
    }
    let header = header(dir, &records, registry, &warnings);
    // If meshes or plug-ins of the study are missing, the records stay in their order.
    let items = Study::read(&dir.join(STUDY)).and_then(|it| it.items(registry, &provenance()));
    let items = items.unwrap_or_default();
    write([dir, site.unwrap_or(dir)], (records, warnings), (&items, registry), header)
}

/// Writes the report of a run of `compare`, whose items give the order of the tables. A page that is there is that of all
/// records, and stays byte for byte. Fails when the records cannot be read, or the report cannot be written.
pub fn report_of_run(
    dir: &Path,
    items: &[Item],
    registry: &Registry,
    provenance: &Provenance,
) -> Result<Rebuilt, Failure> {
    let (records, warnings) = records(dir)?;
    if dir.join(PAGE).exists() {
        return Ok(Rebuilt { records, files: vec![], warnings, undrawn: vec![] });
    }
    let mut header = header(dir, &records, registry, &warnings);
    let Provenance { command, binary_hash, .. } = provenance;
    let mut runs = header.runs.iter_mut();
    if let Some(run) = runs.find(|r| (&r.command, &r.binary_hash) == (command, binary_hash)) {
        // The store keeps the date of the first run of a command.
        let now = jiff::Timestamp::now().to_zoned(TimeZone::UTC);
        run.date.get_or_insert_with(|| now.date().to_string());
    }
    write([dir; 2], (records, warnings), (items, registry), header)
}

/// Writes the report of a store into a folder: that of the store, or another one for a site.
fn write(
    [dir, to]: [&Path; 2],
    (mut records, warnings): (Vec<Record>, Vec<String>),
    (items, registry): (&[Item], &Registry),
    mut header: Header,
) -> Result<Rebuilt, Failure> {
    // Tables follow the order of the records: that of the study, not that of the runs.
    attach(dir, &mut records)?;
    let order = positions(items);
    records.sort_by_key(|record| order.get(&row_of(record)).copied().unwrap_or(usize::MAX));
    let study = Study::read(&dir.join(STUDY)).ok();
    let mixed = study.as_ref().and_then(|study| match Edition::of(study) {
        Ok(edition) => Some(edition?.beside(study, &records, registry)),
        // The own results do not depend on it.
        Err(error) => {
            header.notes.push(error.message);
            None
        }
    });
    header.notes.extend(mixed.iter().flat_map(|mixed| mixed.notes.clone()));
    let shown = mixed.map_or_else(|| records.clone(), |mixed| mixed.records);
    // Pictures of inputs that can no longer be read stay unchanged.
    let sources = study.and_then(|study| study.sources().ok()).unwrap_or_default();
    let undrawn = pictures::draw([dir, to], &shown, &sources);
    let files = match dir == to {
        true => write_report(dir, &shown, &header)?,
        false => write_site(to, dir, &shown, &header)?,
    };
    Ok(Rebuilt { records, files, warnings, undrawn })
}

/// The fields that decide the position of a record in its study: mesh, method with parameters, level.
fn row_of(record: &Record) -> String {
    let Record { mesh, simplify, .. } = record;
    json!([mesh, simplify.method, simplify.variant, simplify.params, simplify.level]).to_string()
}

/// The position of each row of a study.
fn positions(items: &[Item]) -> HashMap<String, usize> {
    let rows = items.iter().flat_map(|item| {
        let method = &item.method;
        item.levels.iter().map(move |level| {
            json!([item.scene.mesh, method.id, method.name, method.params, level]).to_string()
        })
    });
    rows.enumerate().map(|(place, row)| (row, place)).collect()
}

/// Writes the requested study next to its results.
pub fn write_study(dir: &Path, study: &Study) -> Result<(), Failure> {
    files::write(&dir.join(STUDY), study.to_text()?.as_bytes())
}

/// The records of a store or of a file, and warnings about lines without a record. Fails when the file cannot be read.
pub fn records(path: &Path) -> Result<(Vec<Record>, Vec<String>), Failure> {
    let file = if path.is_dir() { path.join(RESULTS) } else { path.to_owned() };
    let journaled = read_records(&file)?;
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
        is_site: false,
    };
    for record in records {
        let Record { command, version, binary_hash, machine, .. } = record.clone();
        let run = RunNote { command, version, binary_hash, date: None, machine: Some(machine) };
        let is_run = |r: &RunNote| (&r.command, &r.binary_hash) == (&run.command, &run.binary_hash);
        // Records can come from other machines and from runs that were interrupted before their report.
        if !header.runs.iter().any(is_run) {
            header.runs.push(run);
        }
    }
    // Methods of this program get their present descriptions, also those that only an edition has run.
    // Plug-ins that are not loaded this time keep their earlier descriptions.
    let ids: BTreeSet<&str> = records.iter().map(|r| r.simplify.method.as_str()).collect();
    // A merged or cleared store can list methods without records.
    header.methods.retain(|method| ids.contains(method.id.as_str()) && method.id != GIVEN);
    // External results have notes of their own.
    let ids = ids.into_iter().filter(|&id| id != GIVEN);
    let recorded = ids.filter_map(|id| registry.entry(id));
    for entry in registry.entries.iter().chain(recorded) {
        let note = MethodNote::new(entry.method().info(), &entry.presentation);
        match header.methods.iter_mut().find(|known| known.id == entry.id()) {
            Some(known) => *known = note,
            None => header.methods.push(note),
        }
    }
    for record in records.iter().filter(|record| record.status == Status::External) {
        let note = external_note(record);
        header.methods.retain(|known| known.id != note.id);
        header.methods.push(note);
    }
    // In the order of the tables.
    header.methods.sort_by_key(|method| {
        let place = registry.entries.iter().position(|entry| entry.id() == method.id);
        place.unwrap_or(usize::MAX)
    });
    header
}

/// The note of external results: what their folder claims about the method.
fn external_note(record: &Record) -> MethodNote {
    let params = &record.simplify.params.0;
    let claim = |key: &str| params.get(key).and_then(|value| value.as_str()).unwrap_or_default();
    let citation = ["authors", "citation"].map(claim).into_iter().filter(|text| !text.is_empty());
    let citation: Vec<&str> = citation.collect();
    let mut summary = "External results, measured here.".to_owned();
    for (words, key) in [("As claimed, run by", "run"), ("Claimed seconds are of", "machine")] {
        let text = claim(key);
        if !text.is_empty() {
            summary += &format!(" {words}: {text}.");
        }
    }
    let id = record.simplify.variant.clone().unwrap_or_default();
    let title = match claim("title") {
        "" => "a file of another program".to_owned(),
        title => title.to_owned(),
    };
    let (citation, bibtex) = (citation.join(". "), claim("bibtex").to_owned());
    MethodNote { id, title, citation, bibtex, summary, ..MethodNote::default() }
}
