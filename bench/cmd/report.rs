//! `medial report DIR [DIR ...] [--out DIR]`: rebuilds tables, plots and page from the records of a store, or of
//! several stores that it merges.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;
use medial_reports::{Header, Record, read_header, write_records};
use serde_json::json;

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::files;
use crate::output::{print_json, print_line};
use crate::rebuild::{Rebuilt, STUDY, rebuild, records, write_study};
use crate::store::{PAGE, RESULTS, Store, artifact_path};
use crate::study::Study;
use crate::study::registry::Registry;

/// Arguments of `report`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Stores: folders with `results.jsonl`.
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    /// Merge the stores into this folder; required for several stores.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the verb.
///
/// # Errors
/// When the folder has no readable records, another process adds to it, or the report cannot be written.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let (dir, notes) = match (&arguments.dirs[..], &arguments.out) {
        ([dir], None) => (dir, Vec::new()),
        (_, None) => {
            return Err(Failure::usage(
                "several stores: no folder for the merged one; give --out DIR",
            ));
        }
        (dirs, Some(out)) => (out, merge(dirs, out)?),
    };
    // While another process adds records, a page would be outdated at once.
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
        let page = dir.join(PAGE);
        print_line(&format!("{} records; page: {}", records.len(), page.display()));
    }
    Ok(Exit::Done)
}

/// Merges stores into `out`: records with their medial meshes, the study, the notes of the runs. Of
/// records with the same key, the first counts if they differ only in seconds, else the one of the
/// newest store. Returns a remark for each such difference.
fn merge(dirs: &[PathBuf], out: &Path) -> Result<Vec<String>, Failure> {
    let mut stores = Vec::new();
    // Records in `out` take part like another store.
    let earlier = out.join(RESULTS).exists().then(|| out.to_owned());
    for dir in earlier.iter().chain(dirs) {
        let (records, mut bad) = records(dir)?;
        let written = fs::metadata(dir.join(RESULTS)).and_then(|file| file.modified());
        let written = written.map_err(|error| Failure::at(dir, error))?;
        // With several stores a line number alone is ambiguous.
        bad.iter_mut().for_each(|line| *line = format!("{}: {line}", dir.display()));
        stores.push((dir, written, records, bad));
    }
    let mut notes = Vec::new();
    let mut merged: Vec<(Record, &PathBuf, SystemTime)> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    for (dir, written, records, bad) in stores {
        notes.extend(bad);
        for record in records {
            // Records of older builds have no key and cannot be matched.
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
                        "{}, {}, {}: {} and {} differ; took the newer record, of {}",
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
    // After all stores were read: a wrong folder must not leave an empty store.
    let store = Store::open(out, RESULTS, "medial report")?;
    for (record, dir, _) in merged.iter().filter(|(_, dir, _)| dir.as_path() != out) {
        let Some(artifact) = record.artifact.as_deref() else { continue };
        // Names contain the key: the same name in two stores is the same result.
        let [from, to] = [dir.as_path(), out].map(|store| artifact_path(store, artifact));
        let (Some(from), Some(to)) = (from.filter(|path| path.is_file()), to) else {
            let dir = dir.display();
            notes.push(format!("{dir}: {artifact}: missing or not inside the folder; not merged"));
            continue;
        };
        let bytes = fs::read(&from).map_err(|error| Failure::at(&from, error))?;
        fs::create_dir_all(to.parent().unwrap_or(out)).map_err(|error| Failure::at(&to, error))?;
        files::write(&to, &bytes)?;
    }
    // The merged store gets the first study; its relative paths start at the folder that it names.
    let studies: Vec<(&PathBuf, Study)> = (earlier.iter().chain(dirs))
        .filter_map(|dir| {
            let mut study = Study::read(&dir.join(STUDY)).ok()?;
            // A study without a folder is read with the folder of its file.
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
            notes.push(format!("{dir}: another study; took that of {first}"));
        }
        write_study(out, study)?;
    }
    let records: Vec<Record> = merged.into_iter().map(|(record, ..)| record).collect();
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
    let text = serde_json::to_vec(&header).map_err(Failure::input)?;
    files::write(&out.join("header.json"), &text)?;
    drop(store);
    Ok(notes)
}

/// Whether two records of one key hold the same result and the same measures.
fn is_same(a: &Record, b: &Record) -> bool {
    (a.status, &a.result_hash, &a.evaluate, &a.mesh_hash)
        == (b.status, &b.result_hash, &b.evaluate, &b.mesh_hash)
}
