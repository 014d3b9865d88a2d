//! Every column of every record as CSV: raw values in the units of the JSON, one row per item.
//!
//! Column names are the JSON keys, joined by `_` where an object lies inside another. Lengths are
//! fractions of the bounding-box diagonal. An empty field stands for what was not measured.

use std::collections::BTreeSet;

use crate::Target;

use crate::comparison::{Comparison, Entry};
use crate::metric::{METRICS, Metric, Value};
use crate::record::{Record, Stages};
use crate::text::printable;

/// A CSV with a header line. The command that made each row stands in the row.
pub(crate) fn to_csv(comparison: &Comparison<'_>) -> Result<Vec<u8>, csv::Error> {
    let columns = columns(comparison);
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(columns.iter().map(|column| column.name.as_str()))?;
    for entry in &comparison.entries {
        writer.write_record(columns.iter().map(|column| inert((column.value)(entry))))?;
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}

/// Text that a spreadsheet shows and does not run: a quote goes before what would begin a formula.
/// Numbers may begin so and stay as they are.
fn inert(cell: String) -> String {
    let formula = cell.starts_with(['=', '+', '-', '@', '\t', '\r']);
    let cell = printable(&cell);
    if formula && cell.parse::<f64>().is_err() { format!("'{cell}") } else { cell }
}

/// A column: its name and how to fill it.
struct Column {
    name: String,
    value: Box<dyn Fn(&Entry<'_>) -> String>,
}

fn column(name: impl Into<String>, value: impl Fn(&Record) -> Option<String> + 'static) -> Column {
    Column {
        name: name.into(),
        value: Box::new(move |entry| value(entry.record).unwrap_or_default()),
    }
}

/// Shortest text that reads back as the same number.
fn number(value: f64) -> String {
    value.to_string()
}

fn columns(comparison: &Comparison<'_>) -> Vec<Column> {
    let mut columns = identity();
    columns.extend(sizes());
    columns.extend(stages("seconds", |record| record.simplify.seconds));
    columns.extend(stages("cpu_seconds", |record| record.simplify.cpu_seconds));
    columns.extend(substrates(comparison));
    columns.extend(METRICS.iter().filter_map(measured));
    columns.extend(spikes(comparison));
    columns.extend(topology());
    columns.extend(provenance());
    columns
}

fn identity() -> Vec<Column> {
    vec![
        column("mesh", |r| Some(r.mesh.clone())),
        column("dataset", |r| r.dataset.clone()),
        column("mesh_hash", |r| r.mesh_hash.clone()),
        column("method", |r| Some(r.simplify.method.clone())),
        column("params", |r| serde_json::to_string(&r.simplify.params).ok()),
        column("seed", |r| Some(r.simplify.seed.to_string())),
        column("level", |r| {
            Some(
                match r.simplify.level {
                    Target::Published => "published",
                    Target::Spheres(_) => "spheres",
                    Target::Native(_) => "native",
                    Target::MaxError(_) => "max_error",
                }
                .to_owned(),
            )
        }),
        column("asked", |r| match r.simplify.level {
            Target::Published => None,
            Target::Spheres(count) => Some(count.to_string()),
            Target::Native(value) | Target::MaxError(value) => Some(number(value)),
        }),
        column("status", |r| Some(r.status.key().to_owned())),
        column("reason", |r| r.reason.clone()),
        Column {
            name: "comparable".to_owned(),
            value: Box::new(|entry| entry.comparable().to_string()),
        },
    ]
}

fn sizes() -> Vec<Column> {
    let count = |value: Option<usize>| value.map(|value| value.to_string());
    vec![
        column("reached", move |r| count(r.simplify.reached)),
        column("native_level", |r| r.simplify.native_level.map(number)),
        column("spheres", move |r| count(r.simplify.spheres)),
        column("edges", move |r| count(r.simplify.edges)),
        column("faces", move |r| count(r.simplify.faces)),
        column("peak_bytes", |r| r.simplify.peak_bytes.map(|bytes| bytes.to_string())),
        column("threads", move |r| count(r.simplify.threads)),
    ]
}

fn stages(prefix: &str, of: fn(&Record) -> Option<Stages>) -> Vec<Column> {
    let stage = |name: &str, value: fn(&Stages) -> f64| {
        column(format!("{prefix}_{name}"), move |r| of(r).as_ref().map(value).map(number))
    };
    vec![
        stage("substrate", |s| s.substrate),
        stage("prepare", |s| s.prepare),
        stage("simplify", |s| s.simplify),
        stage("total", |s| s.total),
    ]
}

fn substrates(comparison: &Comparison<'_>) -> Vec<Column> {
    let names: BTreeSet<&String> = comparison
        .entries
        .iter()
        .flat_map(|entry| entry.record.simplify.substrates.keys())
        .collect();
    let substrate = |name: &String| {
        let key = name.clone();
        column(format!("substrate_{name}"), move |r| {
            r.simplify.substrates.get(&key).copied().map(number)
        })
    };
    names.into_iter().map(substrate).collect()
}

/// The column of a metric of the evaluation; those of the record itself have columns above.
fn measured(metric: &'static Metric) -> Option<Column> {
    let Value::Evaluation(value) = metric.value else { return None };
    Some(column(metric.key, move |r| value(r.evaluate.as_ref()?).map(number)))
}

/// The spike measures at every threshold on the stability ratio.
fn spikes(comparison: &Comparison<'_>) -> Vec<Column> {
    let mut thresholds: Vec<f64> = comparison
        .entries
        .iter()
        .filter_map(|entry| entry.record.evaluate.as_ref())
        .flat_map(|evaluation| evaluation.spikes.by_ratio.iter().map(|ratio| ratio.threshold))
        .collect();
    thresholds.sort_by(f64::total_cmp);
    thresholds.dedup();
    thresholds.into_iter().flat_map(spikes_at).collect()
}

/// The measures for one threshold on the stability ratio.
fn spikes_at(threshold: f64) -> Vec<Column> {
    macro_rules! ratio {
        ($($key:ident),*) => {
            vec![$(column(format!("{}_{threshold}", stringify!($key)), move |r| {
                let by_ratio = &r.evaluate.as_ref()?.spikes.by_ratio;
                let ratio = by_ratio.iter().find(|ratio| ratio.threshold == threshold)?;
                Some(ratio.$key.to_string())
            })),*]
        };
    }
    ratio!(edge_share, length_share, spikes, dangling_edges)
}

fn topology() -> Vec<Column> {
    let betti = |name: &str, of: fn(&Record) -> Option<[u64; 3]>| -> Vec<Column> {
        (0..3)
            .map(|index| {
                column(format!("{name}_{index}"), move |r| Some(of(r)?[index].to_string()))
            })
            .collect()
    };
    let mut columns = betti("betti", |r| Some(r.evaluate.as_ref()?.betti));
    columns.push(column("euler", |r| Some(r.evaluate.as_ref()?.euler.to_string())));
    columns.extend(betti("expected_betti", |r| r.evaluate.as_ref()?.expected_betti));
    columns.push(column("initial_spheres", |r| Some(r.initial?.spheres.to_string())));
    columns.push(column("initial_edges", |r| Some(r.initial?.edges.to_string())));
    columns.push(column("initial_faces", |r| Some(r.initial?.faces.to_string())));
    columns.extend(betti("initial_betti", |r| r.initial?.betti));
    columns
}

fn provenance() -> Vec<Column> {
    vec![
        column("diagonal", |r| Some(number(r.evaluate.as_ref()?.diagonal))),
        column("evaluation_seed", |r| Some(r.evaluate.as_ref()?.seed.to_string())),
        column("evaluate_seconds", |r| r.evaluate_seconds.map(number)),
        column("diagnostics", |r| serde_json::to_string(&r.simplify.diagnostics).ok()),
        column("warnings", |r| Some(warnings(r).join("; "))),
        column("repetitions", |r| serde_json::to_string(&r.repetitions).ok()),
        column("seeds", |r| serde_json::to_string(&r.seeds).ok()),
        column("artifact", |r| r.artifact.clone()),
        column("cpu", |r| Some(r.machine.cpu.clone())),
        column("cores", |r| Some(r.machine.cores.to_string())),
        column("os", |r| Some(r.machine.os.clone())),
        column("memory", |r| Some(r.machine.memory.to_string())),
        column("version", |r| Some(r.version.clone())),
        column("binary_hash", |r| Some(r.binary_hash.clone())),
        column("command", |r| Some(r.command.clone())),
    ]
}

/// Warnings of the method and of the evaluation, in that order.
pub(crate) fn warnings(record: &Record) -> Vec<&str> {
    let evaluation = record.evaluate.iter().flat_map(|evaluation| &evaluation.warnings);
    record.simplify.warnings.iter().chain(evaluation).map(String::as_str).collect()
}

#[cfg(test)]
mod tests {
    use super::inert;

    #[test]
    fn formulas_and_controls_are_inert_and_numbers_stay() {
        for (cell, shown) in [
            ("=cmd|' !A0", "'=cmd|' !A0"),
            ("+1+1", "'+1+1"),
            ("-2+3", "'-2+3"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("\t=1", "' =1"),
            ("\r=1", "' =1"),
            ("a\u{1b}[2Jb", "a\u{fffd}[2Jb"),
            ("-0.5", "-0.5"),
            ("+3e-7", "+3e-7"),
            ("bear", "bear"),
        ] {
            assert_eq!(inert(cell.to_owned()), shown);
        }
    }
}
