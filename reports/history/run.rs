//! The file of one run: the measurements of one build in one study on one machine.
//!
//! A run is `DATE-COMMIT.json` in the folder of the history. It is written once. A damaged file is reported, left out,
//! and never replaced.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

use jiff::Timestamp;
use jiff::fmt::temporal::Pieces;
use jiff::tz::Offset;
use medial::{parser_message, quoted, read_regular_text};
use medial_run::error::FileError;
use medial_run::journal::replace_file;
use medial_run::record::{Machine, Record, Stages, Status};
use medial_run::text::printable;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::comparison::row_name;
use crate::diff::results::{Facts, expected_betti, gates, settings};
use crate::metric::median;

/// The measurements of one build in one study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Date of the commit, ISO 8601: in UTC without an offset, and at midnight without a time. Runs are sorted by it.
    pub date: String,
    /// Hash of the commit.
    pub commit: String,
    /// Version of the program.
    pub version: String,
    /// Where it ran.
    pub machine: String,
    /// Settings of the results except mesh, method and level: sampling, samples, seeds, threads.
    pub conditions: String,
    /// The measured items, sorted by mesh, method and level.
    pub series: Vec<Point>,
}

/// One item of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Name of the mesh.
    pub mesh: String,
    /// First digits of the hash of its content; empty for a run that ended before it was read.
    #[serde(default)]
    pub mesh_hash: String,
    /// The method with its parameters, or its name.
    pub method: String,
    /// The requested level.
    pub level: String,
    /// Status of the item.
    pub status: Status,
    /// CPU seconds of the method without shared substrates, median over the repetitions. For the initial medial mesh,
    /// whose work the substrates are, with them.
    pub seconds: Option<f64>,
    /// The values whose changes have a direction, and the result's hash, by key.
    #[serde(default)]
    pub gates: Facts,
    /// Betti numbers of the solid.
    #[serde(default)]
    pub expected_betti: Value,
}

impl Run {
    /// The run of some records. Of several records of one item the last one counts, of several builds the one that
    /// ran last.
    ///
    /// # Errors
    /// When there is no record, the records are of several machines or studies, or commit or date are malformed.
    pub fn of_records(records: &[Record], commit: &str, date: &str) -> Result<Self, FileError> {
        let invalid = |message: String| Err(FileError(message));
        if !(8..=64).contains(&commit.len()) || !commit.bytes().all(|b| b.is_ascii_hexdigit()) {
            return invalid(format!("--commit {commit}: expected 8 to 64 hexadecimal digits"));
        }
        if instant(date).is_none() {
            return invalid(format!("--date {date}: expected YYYY-MM-DD or YYYY-MM-DDTHH:MM:SSZ"));
        }
        let Some(last) = records.last() else { return invalid("no record".to_owned()) };
        let mut run = Self {
            date: date.to_owned(),
            commit: commit.to_ascii_lowercase(),
            version: printable(&last.version), // shown on a page
            machine: machine(&last.machine),
            conditions: conditions(last),
            series: vec![],
        };
        let mut hashes = BTreeMap::new();
        let mut series = BTreeMap::new();
        for record in records.iter().filter(|record| record.binary_hash == last.binary_hash) {
            let point = Point::of(record);
            if machine(&record.machine) != run.machine || conditions(record) != run.conditions {
                let item = format!("{}, {}", point.mesh, point.method);
                return invalid(format!(
                    "{item}: machine, samples, seeds or threads differ from the last record's"
                ));
            }
            if !point.mesh_hash.is_empty() {
                hashes.insert(point.mesh.clone(), point.mesh_hash.clone());
            }
            let key = (point.mesh.clone(), point.method.clone(), point.level.clone());
            series.insert(key, point);
        }
        for point in series.values_mut().filter(|point| point.mesh_hash.is_empty()) {
            // Otherwise a first time-out would begin another history.
            point.mesh_hash = hashes.get(&point.mesh).cloned().unwrap_or_default();
        }
        run.series = series.into_values().collect(); // sorted, so that equal runs are equal files
        Ok(run)
    }

    fn file_name(&self) -> String {
        format!("{:.10}-{:.8}.json", self.date, self.commit)
    }

    /// Stores the run in the folder of a history, which is created where it is missing: its file, and whether it is
    /// new. The same content again is no error.
    ///
    /// # Errors
    /// When the folder cannot be written, or has another run of this date and commit.
    pub fn add_to(&self, folder: &Path) -> Result<(PathBuf, bool), FileError> {
        let path = folder.join(self.file_name());
        let failed = |error: io::Error| FileError::at(&path, error);
        let text = serde_json::to_string(self).map_err(|error| failed(error.into()))? + "\n";
        match read_regular_text(&path) {
            Ok(old) if old == text => return Ok((path, false)),
            Ok(_) => {
                let message =
                    "this run is already stored with other content; remove the file to replace it";
                return Err(FileError::at(&path, message));
            }
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(error)),
            Err(_) => {}
        }
        replace_file(&path, text.as_bytes()).map_err(failed)?;
        Ok((path, true))
    }

    fn read(path: &Path) -> Result<Self, FileError> {
        let text = read_regular_text(path).map_err(|error| FileError::at(path, error))?;
        let run: Self = serde_json::from_str(&text)
            .map_err(|error| FileError::at(path, parser_message(&error.to_string())))?;
        if instant(&run.date).is_none() {
            return Err(FileError::at(path, format!("unknown date {}", quoted(&run.date))));
        }
        match path.file_name().is_some_and(|name| *name == *run.file_name()) {
            true => Ok(run),
            false => Err(FileError::at(path, "date and commit do not match the file name")),
        }
    }
}

/// The runs of a folder, the oldest first, and the files that are damaged.
///
/// # Errors
/// When the folder cannot be listed.
pub fn read_runs(folder: &Path) -> Result<(Vec<Run>, Vec<FileError>), FileError> {
    let entries = fs::read_dir(folder).and_then(|entries| entries.collect::<io::Result<Vec<_>>>());
    let entries = entries.map_err(|error| FileError::at(folder, error))?;
    let mut paths: Vec<PathBuf> = entries.iter().map(fs::DirEntry::path).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    paths.sort();
    let (mut runs, mut damaged) = (vec![], vec![]);
    for path in paths {
        Run::read(&path).map_or_else(|error| damaged.push(error), |run| runs.push(run));
    }
    // Stable: runs of one date keep the order of their files.
    runs.sort_by_cached_key(|run| instant(&run.date));
    Ok((runs, damaged))
}

/// The instant of a date that begins with `YYYY-MM-DD`, which is part of a file name; `None` for an impossible one.
fn instant(date: &str) -> Option<Timestamp> {
    let parts = Pieces::parse(date).ok()?;
    let is_plain =
        parts.time_zone_annotation().is_none() && date.starts_with(&parts.date().to_string());
    let offset = parts.to_numeric_offset().unwrap_or(Offset::UTC);
    let local = parts.date().to_datetime(parts.time().unwrap_or_default());
    offset.to_timestamp(local).ok().filter(|_| is_plain)
}

impl Point {
    fn of(record: &Record) -> Self {
        let method = record.simplify.method.as_str();
        let repetitions = record.repetitions.iter().map(|r| own_seconds(method, &r.cpu_seconds));
        let seconds = median(&repetitions.collect::<Vec<f64>>())
            .or(record.simplify.cpu_seconds.map(|stages| own_seconds(method, &stages)));
        Self {
            mesh: printable(&record.mesh),
            mesh_hash: format!("{:.12}", record.mesh_hash.as_deref().unwrap_or_default()),
            method: printable(&row_name(record)),
            level: record.simplify.level.to_string(), // stable across versions
            status: record.status,
            seconds: seconds
                .filter(|_| record.status.has_result() && record.ran_alone())
                .and_then(|s| rounded(s, 4)),
            gates: gates(record).into_iter().map(|(key, value)| (key, shortened(value))).collect(),
            expected_betti: expected_betti(record),
        }
    }
}

/// Seconds of a method itself. The substrates are the work of the initial medial mesh.
fn own_seconds(method: &str, stages: &Stages) -> f64 {
    if method == "initial" { stages.total } else { stages.prepare + stages.simplify }
}

/// A finite number with `digits` significant digits: more would only make the files large.
fn rounded(value: f64, digits: usize) -> Option<f64> {
    format!("{:.*e}", digits - 1, value).parse().ok().filter(|value: &f64| value.is_finite())
}

/// Six significant digits of an error, twelve of a hash: more would only make the files large.
fn shortened(value: Value) -> Value {
    match value {
        Value::String(text) if text.len() == 64 => format!("{text:.12}").into(),
        value if value.is_f64() => value.as_f64().and_then(|number| rounded(number, 6)).into(),
        value => value,
    }
}

/// The machine, its memory to the gigabyte: the kernel's own share differs from boot to boot.
fn machine(machine: &Machine) -> String {
    let gigabytes = (machine.memory as f64 / f64::from(1 << 30)).round();
    let Machine { cpu, cores, os, .. } = machine;
    printable(&format!("{cpu}, {cores} cores, {gigabytes} GB, {os}"))
}

fn conditions(record: &Record) -> String {
    let seeds: Vec<String> = record.seeds.iter().map(|(of, seed)| format!("{of} {seed}")).collect();
    let [sampling, dual, samples, threads] =
        settings(record).map(|(name, value)| format!("{name} {value}"));
    let seeds = format!("seeds {}", seeds.join(", "));
    printable(&[sampling, dual, samples, seeds, threads].join("; "))
}
