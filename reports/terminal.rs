//! A comparison in a few lines of plain text, for the terminal.

use std::fmt::Write as _;

use crate::answers::{BoundSummary, by_bound};
use crate::comparison::Comparison;
use crate::metric::{HAUSDORFF, MEAN_ERROR, TOTAL_SECONDS};
use crate::record::Record;
use crate::summary::{CountSummary, SeriesSummary, by_count, native_curves};
use crate::text::printable;

/// The columns behind the name of the method: title and width.
const COLUMNS: [(&str, usize); 8] = [
    ("Hausdorff %", 12),
    ("over", 8),
    ("mean %", 9),
    ("topology", 9),
    ("seconds", 9),
    ("reached", 9),
    ("off count", 10),
    ("failed", 7),
];

/// Means over the meshes for each number of spheres, one line for each method. Empty without
/// results at a number of spheres.
pub fn summary_text(records: &[Record]) -> String {
    let comparison = Comparison::new(records);
    let widest = comparison.series.iter().map(|label| label.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    write_start(&mut text, &comparison);
    for bound in by_bound(&comparison) {
        write_bound(&mut text, &bound, &comparison, widest.max(8));
    }
    for count in by_count(&comparison) {
        write_count(&mut text, &count, &comparison, widest.max(8));
    }
    text
}

/// What all methods start from, where it was measured: errors and topology that are not theirs.
fn write_start(text: &mut String, comparison: &Comparison<'_>) {
    let mut curves = native_curves(comparison).into_iter();
    let Some(start) = curves.find(|curve| comparison.methods[curve.series] == "initial") else {
        return;
    };
    if let Some(point) = start.points.first() {
        let (right, known) = point.topology;
        let _ = writeln!(
            text,
            "initial medial mesh: Hausdorff {} %, mean {} %, topology right on {right} of {known}\n",
            HAUSDORFF.format_mean(point.hausdorff),
            MEAN_ERROR.format_mean(point.mean)
        );
    }
}

fn write_bound(text: &mut String, bound: &BoundSummary, comparison: &Comparison<'_>, width: usize) {
    let _ = writeln!(text, "at most {} % Hausdorff error, fewest spheres", bound.percent);
    let _ = writeln!(text, "  {:<width$}{:>12}{:>10}", "method", "median", "kept on");
    for row in &bound.rows {
        let label = printable(&comparison.series[row.series]);
        let median = row.spheres.map_or_else(|| "-".to_owned(), |spheres| spheres.to_string());
        let kept = format!("{}/{}", row.met, row.asked);
        let _ = writeln!(text, "  {label:<width$}{median:>12}{kept:>10}");
    }
    text.push('\n');
}

fn write_count(
    text: &mut String,
    summary: &CountSummary,
    comparison: &Comparison<'_>,
    width: usize,
) {
    let meshes = if summary.meshes == 1 { "mesh" } else { "meshes" };
    let _ = writeln!(
        text,
        "{} spheres, {} {meshes}; each method's means over its own set of them",
        summary.count, summary.meshes
    );
    let _ = write!(text, "  {:<width$}", "method");
    for (title, width) in COLUMNS {
        let _ = write!(text, "{title:>width$}");
    }
    text.push('\n');
    for row in &summary.rows {
        write_row(text, row, &comparison.series[row.series], width);
    }
    text.push('\n');
}

fn write_row(text: &mut String, row: &SeriesSummary, label: &str, width: usize) {
    let [hausdorff, mean, seconds] = [&HAUSDORFF, &MEAN_ERROR, &TOTAL_SECONDS].map(|metric| {
        row.mean(metric).map_or_else(|| "-".to_owned(), |value| metric.format_mean(value))
    });
    let (right, known) = row.topology;
    let cells = [
        hausdorff,
        format!("{}/{}", row.over, row.asked),
        mean,
        format!("{right}/{known}"),
        seconds,
        format!("{}/{}", row.reached, row.asked),
        row.missed.to_string(),
        row.failed.to_string(),
    ];
    let _ = write!(text, "  {:<width$}", printable(label));
    for (cell, (_, width)) in cells.iter().zip(COLUMNS) {
        let _ = write!(text, "{cell:>width$}");
    }
    text.push('\n');
}
