//! `medial report DIR [DIR ...] [--out DIR]`: rebuilds tables, plots and page from the records of a store, or of
//! several stores that it merges.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;
use medial::read_regular;
use medial_reports::{Header, read_header};
use medial_run::journal::write_records;
use medial_run::record::Record;
use serde_json::json;

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::files;
use crate::output::print_result;
use crate::own_metric::{self, OwnMetric, printed};
use crate::rebuild::{Rebuilt, STUDY, measure_own, rebuild, records, write_study};
use crate::store::{PAGE, RESULTS, Store, artifact_path, claim, entries_of};
use crate::study::Study;
use crate::study::registry::Registry;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Stores: folders with `results.jsonl`.
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    /// Merge the stores into this folder; required for several stores.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write a static site into this folder instead, and leave the store unchanged: the page, and a page for each method
    /// and mesh.
    #[arg(long, value_name = "DIR")]
    site: Option<PathBuf>,
    /// Measure a number of your own on each saved result: `facets (mm), higher=python3 facets.py`. The program gets the files of
    /// the surface and of the medial mesh, and prints the number.
    #[arg(long, value_name = "METRIC=PROGRAM", value_parser = metric, conflicts_with = "site")]
    metric: Vec<(OwnMetric, String)>,
}

fn metric(text: &str) -> Result<(OwnMetric, String), &'static str> {
    let (metric, command) = text.split_once('=').ok_or("expected METRIC=PROGRAM")?;
    Ok((metric.parse()?, command.to_owned()))
}

/// Runs the verb. Fails when the folder has no readable records, another process adds to it, or the report cannot be
/// written.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let (dir, notes) = match (&arguments.dirs[..], &arguments.out) {
        ([dir], None) => (dir, Vec::new()),
        (_, None) => {
            return Err(Failure::usage(
                "several folders: name the one to merge them into with --out DIR",
            ));
        }
        (dirs, Some(out)) => (out, merge(dirs, out)?),
    };
    let mut unmeasured = Vec::new();
    for (metric, command) in &arguments.metric {
        let value = printed(command).map_err(Failure::input)?;
        unmeasured.extend(measure_own(dir, metric, value)?);
    }
    // The site of a store leaves the store unchanged, which may be read-only.
    let is_read = arguments.site.is_some() && arguments.out.is_none();
    // While another process adds records, a page would be outdated at once.
    let held = (dir.is_dir() && !is_read).then(|| Store::open(dir, "medial report"));
    let held = held.transpose()?;
    if is_read {
        // The pages would show the file behind a link.
        claim(dir, true, &entries_of(dir))?;
    }
    let mut rebuilt = if is_read { None } else { Some(rebuild(dir, None, registry)?) };
    if let Some(site) = &arguments.site {
        // Somebody else's index.html must not be replaced.
        let is_empty = fs::read_dir(site).map_or(true, |mut files| files.next().is_none());
        if !is_empty && !site.join("results.csv.gz").exists() {
            return Err(Failure::at(site, "neither empty nor a site of medial; name a new folder"));
        }
        let of_site = rebuild(dir, Some(site), registry)?;
        rebuilt.get_or_insert(of_site);
    }
    let Rebuilt { records, files, mut warnings, undrawn } = rebuilt.expect("one of the two");
    let is_complete = unmeasured.is_empty();
    warnings.extend(undrawn.into_iter().chain(unmeasured));
    if held.as_ref().is_some_and(|store| store.was_cut) {
        warnings
            .push(format!("{RESULTS}: removed an incomplete last line; its item has no record"));
    }
    warnings.extend(notes);
    drop(held);
    // The last record of a key counts; those of older builds have none.
    let keys: HashSet<&str> = records.iter().map(|record| &*record.key).collect();
    let without = records.iter().filter(|record| record.key.is_empty()).count();
    let count = keys.len() + without.saturating_sub(1);
    let object = json!({ "records": count, "files": files });
    let folder = arguments.site.as_ref().filter(|_| is_read).unwrap_or(dir);
    let text = format!("{count} records; page: {}", folder.join(PAGE).display());
    let exit = print_result(global, &object, &text, &warnings);
    Ok(if is_complete { exit } else { Exit::SomeFailed })
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
    let store = Store::open(out, "medial report")?;
    for (record, dir, _) in merged.iter().filter(|(_, dir, _)| dir.as_path() != out) {
        let Some(artifact) = record.artifact.as_deref() else { continue };
        // Names contain the key: the same name in two stores is the same result.
        let [from, to] = [dir.as_path(), out].map(|store| artifact_path(store, artifact));
        let (Some(from), Some(to)) = (from.filter(|path| path.is_file()), to) else {
            let dir = dir.display();
            notes.push(format!("{dir}: {artifact}: missing or not inside the folder; not merged"));
            continue;
        };
        let bytes = read_regular(&from).map_err(|error| Failure::at(&from, error))?;
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
    write_records(&out.join(RESULTS), &records)?;
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
    let stores: Vec<&Path> = dirs.iter().map(PathBuf::as_path).collect();
    own_metric::merge(&stores, out)?;
    drop(store);
    Ok(notes)
}

/// Whether two records of one key hold the same result and the same measures.
fn is_same(a: &Record, b: &Record) -> bool {
    (a.status, &a.result_hash, &a.evaluate, &a.mesh_hash)
        == (b.status, &b.result_hash, &b.evaluate, &b.mesh_hash)
}
