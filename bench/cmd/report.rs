//! `medial report DIR [DIR ...] [--out DIR]`: rebuilds tables, plots and page from the records of a store, or of
//! several stores that it merges.

use std::collections::{BTreeSet, HashMap};
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use clap::Args;
use medial_reports::{
    Header, Record, RunNote, read_header, read_records, write_records, write_report,
};
use serde_json::json;

use super::pictures;
use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line};
use crate::provenance::Provenance;
use crate::store::{RESULTS, Store};
use crate::study::registry::Registry;
use crate::study::source::Source;
use crate::study::{Here, Study};

/// Name of the file with the last requested study.
pub const STUDY: &str = "study.toml";

/// Arguments of `report`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Stores: folders with `results.jsonl`.
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    /// Store that the others are merged into; needed for several.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the verb.
///
/// # Errors
/// When the folder has no readable records, another process adds to it, or the report cannot be
/// written.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let (dir, notes) = match (&arguments.dirs[..], &arguments.out) {
        ([dir], None) => (dir, Vec::new()),
        (_, None) => {
            return Err(Failure::usage("several stores: name the merged one by --out DIR"));
        }
        (dirs, Some(out)) => (out, merge(dirs, out, registry)?),
    };
    // While records are being added, no page would match them.
    let held = dir.is_dir().then(|| Store::open(dir, RESULTS, "medial report")).transpose()?;
    let Rebuilt { records, files, mut warnings, undrawn } = rebuild(dir, registry)?;
    warnings.extend(undrawn);
    warnings.extend(notes);
    drop(held);
    if global.json {
        print_json(&json!({ "records": records.len(), "files": files }), &warnings);
    } else {
        for warning in &warnings {
            print_line(&format!("warning: {warning}"));
        }
        let page = dir.join("index.html");
        print_line(&format!("{} records; page: {}", records.len(), page.display()));
    }
    Ok(Exit::Done)
}

/// Merges stores into `out`: records with their medial meshes, the study, the notes of the runs. Of
/// records of the same key the first counts if they are equal but for seconds, else the one of the
/// store that was written last. Returns a remark for each such difference.
fn merge(dirs: &[PathBuf], out: &Path, registry: &Registry) -> Result<Vec<String>, Failure> {
    let failed =
        |path: &Path, error: io::Error| Failure::input(format!("{}: {error}", path.display()));
    let mut stores = Vec::new();
    // What stands in `out` already takes part like another store.
    let earlier = out.join(RESULTS).exists().then(|| out.to_owned());
    for dir in earlier.iter().chain(dirs) {
        let (records, mut bad) = records(dir)?;
        let written = fs::metadata(dir.join(RESULTS)).and_then(|file| file.modified());
        let written = written.map_err(|error| failed(dir, error))?;
        bad.iter_mut().for_each(|line| *line = format!("{}: {line}", dir.display()));
        stores.push((dir, written, records, bad));
    }
    let mut notes = Vec::new();
    let mut merged: Vec<(Record, &PathBuf, SystemTime)> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    for (dir, written, records, bad) in stores {
        notes.extend(bad);
        for record in records {
            // Records of older builds have no key and cannot be told apart.
            let known = places.get(&record.key).copied().filter(|_| !record.key.is_empty());
            let Some(place) = known else {
                places.insert(record.key.clone(), merged.len());
                merged.push((record, dir, written));
                continue;
            };
            let (other, other_dir, other_written) = &merged[place];
            // Within one store the last record of a key counts.
            let replaces = match dir == *other_dir {
                true => true,
                false if is_same(other, &record) => false,
                false => {
                    let newer = written > *other_written;
                    let taken = if newer { dir } else { *other_dir };
                    notes.push(format!(
                        "{}, {}, {}: {} and {} differ; the newer one, of {}, is taken",
                        record.mesh,
                        record.simplify.variant.as_ref().unwrap_or(&record.simplify.method),
                        record.simplify.level,
                        other_dir.display(),
                        dir.display(),
                        taken.display()
                    ));
                    newer
                }
            };
            if replaces {
                merged[place] = (record, dir, written);
            }
        }
    }
    let store = Store::open(out, RESULTS, "medial report")?;
    for (record, dir, _) in merged.iter().filter(|(_, dir, _)| dir.as_path() != out) {
        let Some(artifact) = record.artifact.as_deref().filter(|path| is_inside(path)) else {
            continue;
        };
        let (from, to) = (dir.join(artifact), out.join(artifact));
        let bytes = fs::read(&from).map_err(|error| failed(&from, error))?;
        fs::create_dir_all(to.parent().unwrap_or(out)).map_err(|error| failed(&to, error))?;
        medial::write_atomically(&to, |file| file.write_all(&bytes))
            .map_err(|error| failed(&to, error))?;
    }
    // The first store's study stands for all; relative paths in it start at the folder it names.
    let studies: Vec<(&PathBuf, Study)> = (earlier.iter().chain(dirs))
        .filter_map(|dir| {
            let mut study = Study::read(&dir.join(STUDY)).ok()?;
            // A study that names no folder reads as one of the folder that holds it.
            study.folder = study
                .folder
                .take()
                .filter(|own| Some(own) != std::path::absolute(dir).ok().as_ref());
            Some((dir, study))
        })
        .collect();
    if let Some((first, study)) = studies.first() {
        for (dir, _) in studies.iter().filter(|(_, other)| other != study) {
            let (dir, first) = (dir.display(), first.display());
            notes.push(format!("{dir}: its study differs; that of {first} is kept"));
        }
        write_study(out, study)?;
    }
    let order = studies.first().and_then(|(_, study)| order_of(study, registry));
    let order = order.unwrap_or_default();
    let mut records: Vec<Record> = merged.into_iter().map(|(record, ..)| record).collect();
    // Tables follow the order of the records: that of the study, as if one process had run it all.
    records.sort_by_key(|record| order.get(&row_of(record)).copied().unwrap_or(usize::MAX));
    write_records(&out.join(RESULTS), &records).map_err(Failure::input)?;
    let mut header = Header::default();
    for dir in earlier.iter().chain(dirs) {
        let Ok(Header { runs, methods, .. }) = read_header(dir) else { continue };
        header.runs.extend(runs);
        for note in methods {
            if !header.methods.iter().any(|known| known.id == note.id) {
                header.methods.push(note);
            }
        }
    }
    let path = out.join("header.json");
    let text = serde_json::to_vec(&header).map_err(Failure::input)?;
    medial::write_atomically(&path, |file| file.write_all(&text))
        .map_err(|error| failed(&path, error))?;
    drop(store);
    Ok(notes)
}

/// Whether two records of one key hold the same result and the same measures.
fn is_same(a: &Record, b: &Record) -> bool {
    (a.status, &a.result_hash, &a.evaluate, &a.mesh_hash)
        == (b.status, &b.result_hash, &b.evaluate, &b.mesh_hash)
}

/// Whether a path of a record stays in its store.
fn is_inside(path: &str) -> bool {
    Path::new(path).components().all(|part| matches!(part, Component::Normal(_)))
}

/// What tells the place of a record in its study: mesh, method with parameters, level.
fn row_of(record: &Record) -> String {
    let Record { mesh, simplify, .. } = record;
    json!([mesh, simplify.method, simplify.variant, simplify.params, simplify.level]).to_string()
}

/// The place of each row of a study; `None` where its meshes or plug-ins are not at hand.
fn order_of(study: &Study, registry: &Registry) -> Option<HashMap<String, usize>> {
    let items = study.items(registry, &Here::of(&Provenance::here())).ok()?;
    let rows = items.iter().flat_map(|item| {
        let method = &item.method;
        item.levels.iter().map(move |level| {
            json!([item.scene.mesh, method.id, method.name, method.params, level]).to_string()
        })
    });
    Some(rows.enumerate().map(|(place, row)| (row, place)).collect())
}

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
/// As [`run`].
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
    let undrawn = pictures::draw(dir, &records, &sources(dir));
    let files = write_report(dir, &records, &header).map_err(Failure::input)?;
    Ok(Rebuilt { records, files, warnings, undrawn })
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
    if added == 0 && dir.join("index.html").exists() {
        return Ok(Rebuilt { records, files: vec![], warnings, undrawn: vec![] });
    }
    let mut header = header(dir, &records, registry, &warnings);
    let this = |run: &&mut RunNote| {
        run.command == provenance.command && run.binary_hash == provenance.binary_hash
    };
    if let Some(run) = header.runs.iter_mut().find(this) {
        run.date = run.date.take().or_else(|| Some(today()));
    }
    let undrawn = pictures::draw(dir, &records, &sources(dir));
    let files = write_report(dir, &records, &header).map_err(Failure::input)?;
    Ok(Rebuilt { records, files, warnings, undrawn })
}

/// The inputs of the study that was asked last; none where it cannot be read any more.
fn sources(dir: &Path) -> Vec<Source> {
    let study = Study::read(&dir.join(STUDY)).ok();
    study.and_then(|study| study.sources().ok()).unwrap_or_default()
}

/// Writes the requested study next to its results.
///
/// # Errors
/// When it cannot be written.
pub fn write_study(dir: &Path, study: &Study) -> Result<(), Failure> {
    let path = dir.join(STUDY);
    let text = study.to_text()?;
    medial::write_atomically(&path, |out| out.write_all(text.as_bytes()))
        .map_err(|error| Failure::input(format!("{}: {error}", path.display())))
}

fn records(dir: &Path) -> Result<(Vec<Record>, Vec<String>), Failure> {
    let journaled = read_records(&dir.join(RESULTS)).map_err(Failure::input)?;
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
        study: std::fs::read_to_string(dir.join(STUDY)).ok(),
        notes: warnings.to_vec(),
    };
    for run in runs_of(records) {
        let same =
            |known: &RunNote| known.command == run.command && known.binary_hash == run.binary_hash;
        if !header.runs.iter().any(same) {
            header.runs.push(run);
        }
    }
    // Methods of this program are described as they are now; those of plug-ins that are not named
    // this time stay as they were.
    let ids = records.iter().map(|record| record.simplify.method.as_str());
    let ids: BTreeSet<&str> = ids.collect();
    for entry in ids.into_iter().filter_map(|id| registry.entry(id)) {
        let note = medial_reports::MethodNote::new(entry.method().info(), entry.presentation());
        match header.methods.iter_mut().find(|known| known.id == entry.id()) {
            Some(known) => *known = note,
            None => header.methods.push(note),
        }
    }
    let ran = |id: &str| records.iter().any(|record| record.simplify.method == id);
    header.methods.retain(|method| ran(&method.id));
    // In the order of the tables.
    let place = |id: &str| registry.entries().iter().position(|entry| entry.id() == id);
    header.methods.sort_by_key(|method| place(&method.id).map_or((1, 0), |place| (0, place)));
    header
}

/// The runs that the records themselves tell of.
fn runs_of(records: &[Record]) -> Vec<RunNote> {
    let mut runs: Vec<RunNote> = Vec::new();
    for record in records {
        let run = RunNote {
            command: record.command.clone(),
            version: record.version.clone(),
            binary_hash: record.binary_hash.clone(),
            date: None,
            machine: Some(record.machine.clone()),
        };
        if !runs.contains(&run) {
            runs.push(run);
        }
    }
    runs
}

/// Today's date in UTC, as `YYYY-MM-DD`.
pub fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let (year, month, day) = civil_date((seconds / 86_400) as i64);
    format!("{year:04}-{month:02}-{day:02}")
}

/// Year, month and day of a day number counted from 1970-01-01 in the Gregorian calendar: years
/// are counted from March, so that the leap day is a year's last.
fn civil_date(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    (year, month, day)
}

#[cfg(test)]
mod tests {
    use super::civil_date;

    #[test]
    fn dates() {
        assert_eq!(civil_date(0), (1970, 1, 1));
        assert_eq!(civil_date(11_016), (2000, 2, 29));
        assert_eq!(civil_date(20_778), (2026, 11, 21));
    }
}
