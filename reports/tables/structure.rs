//! The table of structure: what each method's results have of a medial axis, at each number of spheres.

use crate::comparison::{Comparison, Entry};
use crate::metric::{Metric, STRUCTURE, median};
use crate::summary::pick;
use crate::tables::{Cell, Table};
use crate::text::grouped;

/// Medians over the meshes on which a method reached a count, of the metrics of structure; `None` where nothing was
/// measured. `how` has the command line and version that made it.
pub(crate) fn structure_table(comparison: &Comparison<'_>, how: &str) -> Option<Table> {
    let mut items: Vec<(usize, usize, Vec<&Entry<'_>>)> = vec![];
    for (level, count) in comparison.counts() {
        for series in 0..comparison.series.len() {
            let mut entries = comparison.at(series, level);
            entries.retain(|entry| {
                let evaluation = entry.record.evaluate.as_ref();
                entry.comparable() && evaluation.is_some_and(|e| e.structure.is_some())
            });
            if !entries.is_empty() {
                items.push((count, series, entries));
            }
        }
    }
    let value = |metric: &Metric, entries: &[&Entry<'_>]| {
        median(&entries.iter().filter_map(|entry| metric.of(entry.record)).collect::<Vec<_>>())
    };
    let mut rows = Table::of(&items)
        .number("requested", |(count, ..)| grouped(*count as u64))
        .text("method", |(_, series, _)| comparison.series[*series].as_str());
    for metric in STRUCTURE {
        rows = rows.number(metric.heading(), |(count, _, entries)| {
            let Some(own) = value(metric, entries) else { return Cell::optional(None) };
            let others = items.iter().filter(|(other, ..)| other == count);
            let best = others.filter_map(|(.., entries)| value(metric, entries));
            let best = best.reduce(|a, b| pick(metric, a, b));
            let text = metric.format(own);
            Cell { best: best.is_some_and(|best| metric.format(best) == text), text }
        });
    }
    let table = rows.number("meshes", |(.., entries)| entries.len().to_string()).table;
    let note = "Medians over the meshes on which a method reached the number of spheres. Sheets are matched where the \
                true axis is known. METHODOLOGY.md defines the columns."
        .to_owned();
    (!table.rows.is_empty()).then(|| Table {
        caption: "Structure: sheets, seams, sharp edges".to_owned(),
        notes: vec![how.to_owned(), note],
        grouped: true,
        ..table
    })
}
