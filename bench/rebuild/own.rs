//! Measuring a metric of the user on the saved results of a store.

use std::collections::BTreeMap;
use std::path::Path;

use medial::complex;
use medial_run::input::Input;
use medial_run::record::Record;

use super::{STUDY, inputs, records};
use crate::exit::Failure;
use crate::own_metric::{OwnMetric, Saved, key, read, write};
use crate::store::{Store, artifact_path};
use crate::study::Study;

/// Measures all saved results of a store that have no value of a metric yet. The report shows them when it is rebuilt.
/// Returns a remark for each result without a finite number.
///
/// # Errors
/// When the store cannot be read or written.
pub fn measure_own(
    dir: &Path,
    metric: &OwnMetric,
    mut value: impl FnMut(&Saved<'_>) -> Result<f64, String>,
) -> Result<Vec<String>, Failure> {
    let _held = Store::open(dir, "medial report")?;
    let (records, _) = records(dir)?;
    let study = Study::read(&dir.join(STUDY))?;
    let inputs = inputs(&study.sources().unwrap_or_default());
    let mut all = read(dir)?;
    let own = all.entry(metric.name.clone()).or_default();
    (own.unit, own.better) = (metric.unit.clone(), metric.better);
    let mut remarks = Vec::new();
    for record in &records {
        let Some((key, artifact)) = key(record).zip(record.artifact.as_ref()) else {
            continue; // without a result, or not saved
        };
        if own.values.contains_key(&key) {
            continue; // also equal results of two methods
        }
        match of_record(dir, record, artifact, &inputs, &mut value) {
            Ok(number) => drop(own.values.insert(key, number)),
            Err(why) => remarks.push(format!("{}, {artifact}: {why}", metric.name)),
        }
    }
    write(dir, &all)?;
    Ok(remarks)
}

fn of_record(
    dir: &Path,
    record: &Record,
    artifact: &str,
    inputs: &BTreeMap<String, Input>,
    value: &mut impl FnMut(&Saved<'_>) -> Result<f64, String>,
) -> Result<f64, String> {
    let hash = record.mesh_hash.as_deref().unwrap_or_default();
    let input = inputs.get(hash).ok_or("the measured surface is missing or has changed")?;
    let path = artifact_path(dir, artifact).ok_or("not inside the folder")?;
    let axis = complex::read(&path).map_err(|error| error.to_string())?.mesh;
    let saved = Saved { name: &record.mesh, hash, surface: &input.mesh, axis: &axis, path: &path };
    let number = value(&saved)?;
    if number.is_finite() { Ok(number) } else { Err(format!("the value is {number}")) }
}
