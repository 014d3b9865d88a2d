//! Measuring submitted medial meshes again.
//!
//! Seconds cannot be repeated here, they stay as submitted. Everything that follows from the medial mesh and the surface
//! can: for every record the counts, and for a share of them all errors and the topology, by the judge and the
//! seed of the record.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use medial::complex::MedialMesh;
use medial::geometry::hash::splitmix;
use medial::metrics::{Evaluation, Judge, JudgeOptions};
use medial::shape::{Shape, ShapeOptions};
use medial_reports::Record;
use serde_json::Value;

use super::Opened;
use crate::run::{Input, InputError, Source, Study, VOLUME_DEPTH, reach};

/// What a result may differ from what this machine measures, as a fraction: the medial mesh went through a file in
/// another unit and back.
const ROUNDING: f64 = 1e-6;

/// The same, where another version of the program measured it.
const OTHER_VERSION: f64 = 0.02;

/// Errors below this share of the diagonal are rounding.
const NEGLIGIBLE: f64 = 1e-9;

/// What spikes and triangles beyond a threshold may differ.
const COUNTS: f64 = 0.01;

/// Surfaces by the hash that records have.
#[derive(Debug, Default)]
pub struct Surfaces(BTreeMap<String, Source>);

impl Surfaces {
    /// The built-in shapes that the records of an archive are of, at the resolutions of its study, and files.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub fn new(opened: &Opened, files: &[PathBuf]) -> Result<Self, InputError> {
        let study = opened.study.as_deref().and_then(|text| toml::from_str::<Study>(text).ok());
        let named = study.map_or_else(Vec::new, |study| study.meshes);
        // A path in a stranger's study is none of ours.
        let is_name = |path: &&PathBuf| Source::is_name(path);
        let shapes = named.iter().filter(is_name).filter_map(|path| Source::parse(path).ok());
        let meshes: HashSet<&str> = opened.records.iter().map(|r| r.mesh.as_str()).collect();
        // Only what has results is made, however long the study is.
        let has_results = |shape: &Source| {
            meshes.contains(&*shape.name()) || meshes.contains(&*shape.to_string())
        };
        let mut surfaces = BTreeMap::new();
        // Meshes of the library go by the names of the records, as far as they are here.
        let in_library = opened.records.iter().filter(|r| r.dataset.is_some()).map(|r| &r.mesh);
        let in_library: BTreeSet<PathBuf> =
            in_library.map(|mesh| PathBuf::from(format!("dataset:{mesh}"))).collect();
        let kept = in_library.iter().filter_map(|name| Source::parse(name).ok());
        for shape in shapes.chain(Source::built_ins()).chain(kept).filter(has_results) {
            if let Ok(input) = Input::load(&shape) {
                surfaces.insert(input.hash, shape);
            }
        }
        for file in files {
            let file = Source::File(file.clone());
            surfaces.insert(Input::load(&file)?.hash, file);
        }
        Ok(Self(surfaces))
    }
}

/// What came of measuring again.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rejudged {
    /// Keys of the records that were measured again, and found right.
    pub right: BTreeSet<String>,
    /// What was found wrong.
    pub wrong: Vec<String>,
    /// Meshes whose surface is not here, and the number of their records.
    pub unknown: BTreeMap<String, usize>,
}

/// Measures a share of the results again: all of them at 1. Which ones follows from the archive's own hash, so
/// that nobody can choose.
pub fn rejudge(opened: &Opened, surfaces: &Surfaces, share: f64) -> Rejudged {
    let mut rejudged = Rejudged::default();
    let mut by_surface: BTreeMap<&str, Vec<(&Record, MedialMesh)>> = BTreeMap::new();
    for record in &opened.records {
        let mesh = match loaded(opened, record) {
            Ok(Some(mesh)) => mesh,
            Ok(None) => continue,
            Err(why) => {
                rejudged.wrong.push(format!("{}: {why}", name(record)));
                continue;
            }
        };
        if is_drawn(&opened.hash, &record.key, share) {
            let surface = record.mesh_hash.as_deref().unwrap_or_default();
            by_surface.entry(surface).or_default().push((record, mesh));
        }
    }
    for (hash, records) in by_surface {
        match surfaces.0.get(hash).map(Input::load) {
            Some(Ok(input)) => of_surface(&input, &records, &opened.version, &mut rejudged),
            _ => {
                for (record, _) in records {
                    *rejudged.unknown.entry(record.mesh.clone()).or_default() += 1;
                }
            }
        }
    }
    rejudged
}

fn name(record: &Record) -> String {
    format!("{}, {}, {}", record.mesh, record.simplify.method, record.simplify.level)
}

/// Whether a record is among those that are measured again.
fn is_drawn(archive: &str, key: &str, share: f64) -> bool {
    let bytes = archive.bytes().chain(key.bytes());
    let drawn = bytes.fold(0, |hash, byte| splitmix(hash ^ u64::from(byte)));
    // 53 bits: every one is exact, and at a share of 1 all are below it.
    ((drawn >> 11) as f64 / (1_u64 << 53) as f64) < share
}

/// The medial mesh of a record, if it has one, with the counts that the record tells.
fn loaded(opened: &Opened, record: &Record) -> Result<Option<MedialMesh>, String> {
    let Some(path) = opened.axis(record) else {
        // A measured result without its medial mesh can be anything.
        return Ok(None);
    };
    if !record.status.has_result() {
        return Err(format!("it has a medial mesh, and the status {}", record.status));
    }
    let mesh = read(&path)?;
    let found = [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()];
    let simplify = &record.simplify;
    let told = [simplify.spheres, simplify.edges, simplify.faces];
    let differs = found.iter().zip(told).any(|(found, told)| told != Some(*found));
    if differs {
        let told = told.map(|count| count.map_or("none".to_owned(), |count| count.to_string()));
        return Err(format!(
            "its medial mesh has {found:?} spheres, edges and faces, its record tells {}",
            told.join(", ")
        ));
    }
    Ok(Some(mesh))
}

fn read(path: &Path) -> Result<MedialMesh, String> {
    let loaded = medial::complex::read(path).map_err(|error| {
        // The name of a temporary file helps nobody.
        error.to_string().replace(&format!("{}: ", path.display()), "its medial mesh: ")
    })?;
    Ok(loaded.mesh)
}

/// Measures results on one surface.
fn of_surface(
    input: &Input,
    records: &[(&Record, MedialMesh)],
    version: &str,
    rejudged: &mut Rejudged,
) {
    let shape = match input.shape(ShapeOptions::default()) {
        Ok(shape) => shape,
        Err(error) => {
            rejudged.wrong.push(format!("{}: {error}", input.name));
            return;
        }
    };
    let tolerance = if version == env!("CARGO_PKG_VERSION") { ROUNDING } else { OTHER_VERSION };
    let mut judges: Vec<(JudgeOptions, Judge)> = Vec::new();
    for (record, mesh) in records {
        let measured = judge_for(record, &shape, input, &mut judges)
            .and_then(|judge| evaluated(judge, &shape, mesh));
        let compared = match (&record.evaluate, measured) {
            (Some(told), Ok(found)) => difference(told, &found, tolerance),
            (Some(_), Err(why)) => Some(why),
            (None, _) => Some("its result was never measured".to_owned()),
        };
        match compared {
            None => {
                rejudged.right.insert(record.key.clone());
            }
            Some(why) => rejudged.wrong.push(format!("{}: {why}", name(record))),
        }
    }
}

/// The judge with the options of a record.
fn judge_for<'j>(
    record: &Record,
    shape: &Shape,
    input: &Input,
    judges: &'j mut Vec<(JudgeOptions, Judge)>,
) -> Result<&'j Judge, String> {
    let conditions = record.conditions.as_ref().ok_or("it does not tell how it was measured")?;
    let seed = record.seeds.get("evaluation").copied().unwrap_or_default();
    // A stranger's number of samples is no order: so many need gigabytes.
    if conditions.samples > 10_000_000 {
        return Err(format!("it asks for {} samples", conditions.samples));
    }
    let options =
        JudgeOptions { samples: conditions.samples.max(1), volume_depth: VOLUME_DEPTH, seed };
    let place = judges.iter().position(|(known, _)| *known == options);
    let place = match place {
        Some(place) => place,
        None => {
            let judge = shape.judge(input.axis.as_ref(), options);
            judges.push((options, judge.map_err(|error| error.to_string())?));
            judges.len() - 1
        }
    };
    Ok(&judges[place].1)
}

fn evaluated(judge: &Judge, shape: &Shape, mesh: &MedialMesh) -> Result<Evaluation, String> {
    reach(mesh, shape)?;
    let to_normal = shape.normalisation();
    let normal = mesh.transformed(1.0 / to_normal.diagonal, |p| to_normal.forward(p));
    judge.evaluate(&normal).map_err(|error| error.to_string())
}

/// The first number that is not as measured here.
fn difference(told: &Evaluation, found: &Evaluation, tolerance: f64) -> Option<String> {
    // An interval is not computed again, but has to hold what was found.
    let upper = told.certified.as_ref().map(|certified| certified.upper);
    let hausdorff = found.distances.hausdorff;
    if let Some(upper) = upper.filter(|upper| *upper < hausdorff * (1.0 - tolerance)) {
        return Some(format!("certified to be at most {upper}, measured here {hausdorff}"));
    }
    let plain = |evaluation: &Evaluation| {
        let bare =
            Evaluation { certified: None, axis: None, warnings: vec![], ..evaluation.clone() };
        serde_json::to_value(bare).unwrap_or_default()
    };
    differing("", &plain(told), &plain(found), tolerance)
}

/// The first place where two values differ, with both.
fn differing(key: &str, told: &Value, found: &Value, tolerance: f64) -> Option<String> {
    let below = |part: &str| if key.is_empty() { part.to_owned() } else { format!("{key}.{part}") };
    let differs = match (told, found) {
        (Value::Object(a), Value::Object(b)) => {
            let mut keys = a.keys().chain(b.keys());
            return keys.find_map(|k| {
                let [a, b] = [a, b].map(|map| map.get(k).unwrap_or(&Value::Null));
                differing(&below(k), a, b, tolerance)
            });
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let mut pairs = a.iter().zip(b).enumerate();
            return pairs
                .find_map(|(k, (a, b))| differing(&below(&k.to_string()), a, b, tolerance));
        }
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap_or(f64::NAN), b.as_f64().unwrap_or(f64::NAN));
            // A count or a share flips where rounding moves one element over its threshold.
            let is_count = key.starts_with("spikes") || key.starts_with("quality");
            let tolerance = if is_count { tolerance.max(COUNTS) } else { tolerance };
            let least = if is_count && told.is_u64() { 1.0 } else { NEGLIGIBLE };
            let off = (a - b).abs();
            off.is_nan() || off > (tolerance * b.abs()).max(least)
        }
        (a, b) => a != b,
    };
    differs.then(|| format!("{key} {told}, measured here {found}"))
}
