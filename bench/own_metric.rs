//! Metrics of the user: numbers of the results of a store, which its report shows like those of the program.
//!
//! The file `metrics.json` next to the records has them by the hashes of a mesh and a result. They are measured after the run, on the
//! saved medial meshes, and each result once.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::str::FromStr;
use std::{fs, io};

use medial::complex::MedialMesh;
use medial::read_regular;
use medial::surface::{self, TriMesh};
use medial_run::record::{Better, OwnValue, Record};
use serde::{Deserialize, Serialize};

use crate::exit::Failure;
use crate::files;

/// Name of the file.
const METRICS: &str = "metrics.json";

/// Name, unit and better direction of a metric.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnMetric {
    /// Name of its column.
    pub name: String,
    /// Unit in the head of the column; may be empty.
    pub unit: String,
    /// Better direction.
    pub better: Better,
}

impl FromStr for OwnMetric {
    type Err = &'static str;

    /// `NAME`, `NAME (UNIT)`, and either with `, higher` or `, neither` at its end; less is better otherwise.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (text, better) = match text.rsplit_once(',').map(|(rest, word)| (rest, word.trim())) {
            Some((rest, "lower")) => (rest, Better::Lower),
            Some((rest, "higher")) => (rest, Better::Higher),
            Some((rest, "neither")) => (rest, Better::Neither),
            Some(_) => return Err("expected `lower`, `higher` or `neither` after the comma"),
            None => (text, Better::Lower),
        };
        let split = text.trim().strip_suffix(')').and_then(|text| text.rsplit_once('('));
        let (name, unit) = split.unwrap_or((text, ""));
        let [name, unit] = [name, unit].map(|text| text.trim().to_owned());
        let is_plain = |letter: char| letter.is_alphanumeric() || " -_".contains(letter);
        if name.is_empty() || !name.chars().all(is_plain) {
            return Err("expected a name of letters, digits, spaces, `-` and `_`");
        }
        Ok(Self { name, unit, better })
    }
}

/// A saved result that is measured, with everything in the unit of the mesh.
pub struct Saved<'a> {
    /// Name of the mesh.
    pub name: &'a str,
    /// Hash of its contents: several meshes can have one name.
    pub hash: &'a str,
    /// The surface.
    pub surface: &'a TriMesh,
    /// The result.
    pub axis: &'a MedialMesh,
    /// Its file.
    pub path: &'a Path,
}

/// The numbers of one metric, as the file has them.
#[derive(Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Numbers {
    pub(crate) unit: String,
    pub(crate) better: Better,
    /// By [`key`].
    pub(crate) values: BTreeMap<String, f64>,
}

/// The key of a record's number: the same result can belong to two meshes. `None` without a result.
pub(crate) fn key(record: &Record) -> Option<String> {
    Some(format!("{} {}", record.mesh_hash.as_ref()?, record.result_hash.as_ref()?))
}

/// Adds the numbers of other stores to those of a store.
pub(crate) fn merge(from: &[&Path], to: &Path) -> Result<(), Failure> {
    let mut all = read(to)?;
    for dir in from {
        for (name, numbers) in read(dir)? {
            let own = all.entry(name).or_default();
            (own.unit, own.better) = (numbers.unit, numbers.better);
            own.values.extend(numbers.values);
        }
    }
    write(to, &all)
}

/// Writes the file; none without a number.
pub(crate) fn write(dir: &Path, all: &BTreeMap<String, Numbers>) -> Result<(), Failure> {
    let known: BTreeMap<_, _> = all.iter().filter(|(_, own)| !own.values.is_empty()).collect();
    if known.is_empty() {
        return Ok(());
    }
    let text = serde_json::to_vec_pretty(&known).map_err(Failure::input)?;
    files::write(&dir.join(METRICS), &text)
}

/// A metric whose values a program prints: its words, then the file of the surface and that of the medial mesh.
///
/// # Errors
/// When there is no folder for the file of the surface.
pub fn printed(command: &str) -> io::Result<impl FnMut(&Saved<'_>) -> Result<f64, String>> {
    let words: Vec<String> = command.split_whitespace().map(str::to_owned).collect();
    let scratch = tempfile::tempdir()?;
    let mut written: Option<String> = None; // the mesh in the folder
    Ok(move |saved: &Saved<'_>| {
        let surface = scratch.path().join("surface.off");
        if written.as_deref() != Some(saved.hash) {
            surface::write(&surface, saved.surface).map_err(|error| error.to_string())?;
            written = Some(saved.hash.to_owned());
        }
        let (program, words) = words.split_first().ok_or("no program")?;
        let ended = Command::new(program).args(words).arg(&surface).arg(saved.path).output();
        let ended = ended.map_err(|error| format!("{program}: {error}"))?;
        let printed = String::from_utf8_lossy(&ended.stdout);
        if !ended.status.success() {
            let errors = String::from_utf8_lossy(&ended.stderr);
            let last = errors.lines().last().unwrap_or_default();
            return Err(format!("{program}: {} ({last})", ended.status).replace(" ()", ""));
        }
        let last = printed.lines().last().unwrap_or_default().trim();
        last.parse().map_err(|_| format!("{program}: printed `{last}`, expected a number"))
    })
}

/// The numbers of a store by the name of the metric.
pub(crate) fn read(dir: &Path) -> Result<BTreeMap<String, Numbers>, Failure> {
    let path = dir.join(METRICS);
    if !fs::exists(&path).unwrap_or(false) {
        return Ok(BTreeMap::new());
    }
    let bytes = read_regular(&path).map_err(|error| Failure::at(&path, error))?;
    serde_json::from_slice(&bytes).map_err(|error| Failure::at(&path, error))
}

/// Adds the values of a store's file to its records.
pub(crate) fn attach(dir: &Path, records: &mut [Record]) -> Result<(), Failure> {
    for (name, Numbers { unit, better, values }) in read(dir)? {
        for record in records.iter_mut() {
            let Some(&value) = key(record).and_then(|key| values.get(&key)) else {
                continue;
            };
            let value = OwnValue { value, unit: unit.clone(), better };
            record.own.insert(name.clone(), value);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metric_is_read_from_its_words() {
        let of = |text: &str| text.parse::<OwnMetric>().map(|m| (m.name, m.unit, m.better));
        let found = |name: &str, unit: &str, better| Ok((name.into(), unit.into(), better));
        assert_eq!(of("facets"), found("facets", "", Better::Lower));
        assert_eq!(of("mean edge (mm), higher"), found("mean edge", "mm", Better::Higher));
        assert!(of("").is_err() && of("a/b").is_err() && of("a, best").is_err());
    }
}
