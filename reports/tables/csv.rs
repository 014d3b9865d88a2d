//! Every number of every record, flattened: the columns of `results.csv` and of the page.
//!
//! Column names are the JSON keys, joined by `_` where an object lies inside another; the names of
//! the parts that every record has are left out. Lengths are fractions of the bounding-box diagonal.
//! An empty field means not measured.

use std::collections::{BTreeMap, BTreeSet};

use medial_run::level::Target;
use medial_run::record::Record;
use medial_run::text::printable;
use serde_json::{Value, json};

use crate::comparison::{Comparison, Entry};
use crate::metric::{FROZEN_SECONDS, METRICS, Value as Place};

/// Columns that every table has, before those of [`METRICS`] and after them. Further ones follow by
/// name.
const FIRST: &str = "mesh dataset mesh_hash row method params seed level asked status reason comparable \
    reached native_level spheres edges faces peak_bytes threads seconds_substrate seconds_prepare \
    seconds_simplify seconds_total cpu_seconds_substrate cpu_seconds_prepare cpu_seconds_simplify \
    cpu_seconds_total";
const LAST: &str = "diagonal evaluation_seed evaluate_seconds betti_0 betti_1 betti_2 euler \
    expected_betti_0 expected_betti_1 expected_betti_2 initial_spheres initial_edges initial_faces \
    initial_betti_0 initial_betti_1 initial_betti_2 diagnostics warnings repetitions seeds artifact \
    cpu cores os memory version binary_hash command";

/// Beginnings of paths that are no part of a column's name, and their replacement. The first one
/// that fits counts.
const NAMES: [(&str, &str); 11] = [
    ("evaluate/seed", "evaluation_seed"), // `seed` is the method's
    ("evaluate/quality/", ""),
    ("evaluate/counts/", ""),
    ("evaluate/spikes/", ""),
    ("evaluate/axis/in_space/", "axis_"),
    ("evaluate/", ""),
    ("simplify/substrates/", "substrate_"),
    ("simplify/", ""),
    ("item/machine/", ""),
    ("item/own/", "metric_"), // no name of a user's is that of another column
    ("item/", ""),
];

/// Parts that other columns hold, or one column as JSON because their keys are names.
const SKIPPED: [&str; 11] = [
    "simplify/status",
    "simplify/version", // that of the record
    "simplify/level",
    "simplify/warnings",
    "simplify/params",
    "simplify/diagnostics",
    "evaluate/warnings",
    "evaluate/counts/spheres", // those of `simplify`
    "evaluate/counts/edges",
    "evaluate/counts/faces",
    "item/seeds",
];

/// The values of a record by path, such as `evaluate/quality/below_30`. Nulls, empty texts, lists and
/// objects are left out. The fields of the record itself are below `item`.
pub(crate) fn flatten(record: &Record) -> Vec<(String, Value)> {
    let mut values = Vec::new();
    if let Ok(Value::Object(all)) = serde_json::to_value(record) {
        for (key, value) in all {
            let is_part = matches!(key.as_str(), "simplify" | "evaluate" | "initial");
            descend(if is_part { key } else { format!("item/{key}") }, value, &mut values);
        }
    }
    // Those of an edition are `frozen_seconds_total`.
    if !record.ran_alone() || record.edition.is_some() {
        let timed = ["simplify/seconds", "simplify/cpu_seconds", "simplify/substrates"];
        values.retain(|(path, _)| !timed.iter().any(|part| path.starts_with(part)));
        values.retain(|(path, _)| path != "item/repetitions");
    }
    values
}

fn descend(path: String, value: Value, values: &mut Vec<(String, Value)>) {
    match value {
        Value::Null => {}
        Value::String(text) if text.is_empty() => {}
        Value::Array(list) if list.is_empty() => {}
        Value::Object(map) => {
            for (key, value) in map {
                descend(format!("{path}/{key}"), value, values);
            }
        }
        value => values.push((path, value)), // lists stay whole
    }
}

/// A CSV with a header line. Each row has the command that made it.
pub(crate) fn to_csv(comparison: &Comparison<'_>) -> Result<Vec<u8>, csv::Error> {
    let with_seeds = comparison.entries.iter().flat_map(|entry| {
        comparison.records_of(entry).iter().map(|&record| Entry { record, ..*entry })
    });
    let rows: Vec<BTreeMap<String, String>> =
        with_seeds.map(|entry| row(comparison, &entry)).collect();
    let evaluated = METRICS.iter().filter(|metric| matches!(metric.value, Place::Evaluation(_)));
    let mut columns: Vec<&str> = FIRST
        .split_whitespace()
        .chain(evaluated.map(|metric| metric.key))
        .chain(LAST.split_whitespace())
        .collect();
    let found: BTreeSet<&str> = rows.iter().flatten().map(|(name, _)| name.as_str()).collect();
    let further: Vec<&str> = found.into_iter().filter(|name| !columns.contains(name)).collect();
    columns.extend(further); // such as substrates, whose names vary
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&columns)?; // also without a row
    for row in &rows {
        writer
            .write_record(columns.iter().map(|&name| row.get(name).map_or("", String::as_str)))?;
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}

/// The cells of a row by the names of their columns.
fn row(comparison: &Comparison<'_>, entry: &Entry<'_>) -> BTreeMap<String, String> {
    let record = entry.record;
    let simplify = &record.simplify;
    let (level, requested) = match simplify.level {
        Target::Published => ("published", String::new()),
        Target::Spheres(count) => ("spheres", count.to_string()),
        Target::Native(value) => ("native", value.to_string()),
        Target::MaxError(value) => ("max_error", value.to_string()),
    };
    let mut row: BTreeMap<String, String> = [
        ("row", comparison.series[entry.series].clone()),
        ("level", level.to_owned()),
        ("asked", requested),
        ("comparable", entry.comparable().to_string()),
        ("params", json!(simplify.params).to_string()),
        ("diagnostics", json!(simplify.diagnostics).to_string()),
        ("seeds", json!(record.seeds).to_string()),
        ("warnings", record.warnings().join("; ")),
    ]
    .map(|(name, text)| (name.to_owned(), inert(text)))
    .into();
    for (path, value) in flatten(record) {
        let is_skipped = SKIPPED.iter().any(|skipped| {
            path.strip_prefix(skipped).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        });
        if is_skipped {
            continue;
        }
        let renamed =
            NAMES.iter().find_map(|(start, name)| Some((name, path.strip_prefix(start)?)));
        let (start, rest) = renamed.unwrap_or((&"", &path));
        add(format!("{start}{}", rest.replace('/', "_")), &value, &mut row);
    }
    if let Some(seconds) = record.frozen_seconds() {
        row.insert(FROZEN_SECONDS.key.to_owned(), seconds.total.to_string());
    }
    // Some are computed from others.
    for metric in METRICS {
        if let (Place::Evaluation(value), Some(evaluation)) = (metric.value, &record.evaluate)
            && let Some(value) = value(evaluation)
        {
            row.insert(metric.key.to_owned(), value.to_string());
        }
    }
    row
}

/// Adds the cell of a value, or the cells of a list: of Betti numbers by index, of spikes by
/// threshold.
fn add(name: String, value: &Value, row: &mut BTreeMap<String, String>) {
    let text = match value {
        Value::String(text) => text.clone(),
        // Shortest text that reads back as the same number, without an exponent.
        Value::Number(number) if number.is_f64() => number.as_f64().unwrap_or(f64::NAN).to_string(),
        Value::Array(list) if name.ends_with("betti") => {
            for (index, number) in list.iter().enumerate() {
                row.insert(format!("{name}_{index}"), number.to_string());
            }
            return;
        }
        Value::Array(list) if name == "by_ratio" => {
            for (key, value) in list.iter().filter_map(Value::as_object).flat_map(|ratio| {
                let threshold = ratio.get("threshold").cloned().unwrap_or_default();
                let values = ratio.iter().filter(|(key, _)| *key != "threshold");
                values.map(move |(key, value)| (format!("{key}_{threshold}"), value))
            }) {
                add(key, value, row);
            }
            return;
        }
        value => value.to_string(),
    };
    row.insert(name, inert(text));
}

/// Text that a spreadsheet shows and does not run: a quote goes before the first character of a formula.
/// Numbers may begin so and stay as they are.
fn inert(cell: String) -> String {
    let formula = cell.starts_with(['=', '+', '-', '@', '\t', '\r']);
    let cell = printable(&cell);
    if formula && cell.parse::<f64>().is_err() { format!("'{cell}") } else { cell }
}
