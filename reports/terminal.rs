//! A comparison in a few lines of plain text, for the terminal.

use crate::answers::by_bound;
use crate::comparison::Comparison;
use crate::metric::{HAUSDORFF, MEAN_ERROR, TOTAL_SECONDS};
use crate::record::Record;
use crate::summary::{by_count, native_curves};
use crate::text::{counted, printable};

/// Means over the meshes for each number of spheres, one line for each method. Empty without
/// results at a number of spheres.
pub fn summary_text(records: &[Record]) -> String {
    let comparison = Comparison::new(records);
    let mut text = start(&comparison);
    for bound in by_bound(&comparison) {
        let title = format!("at most {} % Hausdorff error, fewest spheres", bound.percent);
        let rows = bound.rows.iter().map(|row| {
            let median = row.spheres.map_or_else(|| "-".to_owned(), |spheres| spheres.to_string());
            (row.series, vec![median, format!("{}/{}", row.met, row.asked)])
        });
        text += &block(&comparison, &title, &[("median", 12), ("kept on", 10)], rows.collect());
    }
    for summary in by_count(&comparison) {
        // Without the separators of `counted`, so that the line is found by its number.
        let title = format!(
            "{} spheres, {}; each method's means over its own set of them",
            summary.count,
            counted(summary.meshes, "mesh", "meshes")
        );
        let columns = [
            ("Hausdorff %", 12),
            ("over", 8),
            ("mean %", 9),
            ("topology", 9),
            ("seconds", 9),
            ("reached", 9),
            ("off count", 10),
            ("failed", 7),
        ];
        let rows = summary.rows.iter().map(|row| {
            let mean = |metric| {
                row.mean(metric).map_or_else(|| "-".to_owned(), |mean| metric.format_mean(mean))
            };
            let cells = vec![
                mean(&HAUSDORFF),
                format!("{}/{}", row.over, row.asked),
                mean(&MEAN_ERROR),
                format!("{}/{}", row.topology.0, row.topology.1),
                mean(&TOTAL_SECONDS),
                format!("{}/{}", row.reached, row.asked),
                row.missed.to_string(),
                row.failed.to_string(),
            ];
            (row.series, cells)
        });
        text += &block(&comparison, &title, &columns, rows.collect());
    }
    text
}

/// The errors and the topology of the medial mesh that all methods start from, where it was measured: they are not theirs.
fn start(comparison: &Comparison<'_>) -> String {
    let mut curves = native_curves(comparison).into_iter();
    let start = curves.find(|curve| comparison.methods[curve.series] == "initial");
    let point = start.and_then(|curve| curve.points.into_iter().next());
    point.map_or_else(String::new, |point| {
        let (hausdorff, mean) =
            (HAUSDORFF.format_mean(point.hausdorff), MEAN_ERROR.format_mean(point.mean));
        let (right, known) = point.topology; // methods inherit what is wrong here
        format!(
            "initial medial mesh: Hausdorff {hausdorff} %, mean {mean} %, topology right on {right} of {known}\n\n"
        )
    })
}

/// A title, the heads of the columns with their widths, and a line for each series.
fn block(
    comparison: &Comparison<'_>,
    title: &str,
    columns: &[(&str, usize)],
    rows: Vec<(usize, Vec<String>)>,
) -> String {
    let names = comparison.series.iter().map(|label| label.chars().count());
    let widest = names.max().unwrap_or(0).max(8);
    let line = |name: &str, cells: Vec<String>| -> String {
        let cells = cells.iter().zip(columns).map(|(cell, (_, width))| format!("{cell:>width$}"));
        format!("  {name:<widest$}{}\n", cells.collect::<String>())
    };
    let head = columns.iter().map(|(title, _)| (*title).to_owned()).collect();
    let mut text = format!("{title}\n{}", line("method", head));
    for (series, cells) in rows {
        text += &line(&printable(&comparison.series[series]), cells);
    }
    text + "\n"
}
