//! Tables of further metrics of each method's results at each number of spheres: structure and cover.

use medial_run::text::grouped;

use crate::comparison::{Comparison, Entry};
use crate::metric::{Better, COVER, Metric, STRUCTURE, median};
use crate::summary::pick;
use crate::tables::{Cell, Table};

/// A set of metrics with a table.
struct Topic {
    caption: &'static str,
    metrics: &'static [&'static Metric],
    note: &'static str,
}

const STRUCTURE_TABLE: Topic = Topic {
    caption: "Structure: sheets, seams, sharp edges",
    metrics: &STRUCTURE,
    note: "Sheets are matched where the true axis is known.",
};

const COVER_TABLE: Topic = Topic {
    caption: "Cover: one-sided errors of spheres",
    metrics: &COVER,
    note: "Of results without edges, of all results with --spheres-alone or --certify. Both distances are upper ends of \
           certified intervals, so 0 is a proof: the spheres enclose the solid (uncovered) or stay within it (overshoot).",
};

/// The tables of structure and cover, without those of which nothing was measured. `how` has the command line and version
/// that made it.
pub(crate) fn topic_tables(comparison: &Comparison<'_>, how: &str) -> [Option<Table>; 2] {
    [STRUCTURE_TABLE, COVER_TABLE].map(|topic| topic.table(comparison, how))
}

impl Topic {
    /// Medians over the meshes on which a method reached a count.
    fn table(&self, comparison: &Comparison<'_>, how: &str) -> Option<Table> {
        let mut items: Vec<(usize, usize, Vec<&Entry<'_>>)> = vec![];
        for (level, count) in comparison.counts() {
            for series in 0..comparison.series.len() {
                let mut entries = comparison.at(series, level);
                // Sizes are known of every result.
                let ranked = || self.metrics.iter().filter(|m| m.better != Better::Neither);
                let is_measured =
                    |entry: &Entry<'_>| ranked().any(|m| m.of(entry.record).is_some());
                entries.retain(|entry| entry.comparable() && is_measured(entry));
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
        for &metric in self.metrics {
            rows = rows.number(metric.heading(), |(count, _, entries)| {
                let Some(own) = value(metric, entries) else { return Cell::from(None) };
                let others = items.iter().filter(|(other, ..)| other == count);
                let best = others.filter_map(|(.., entries)| value(metric, entries));
                let best = best.reduce(|a, b| pick(metric, a, b));
                let text = metric.format(own);
                let is_best = best.is_some_and(|best| metric.format(best) == text);
                Cell { best: is_best && metric.better != Better::Neither, text }
            });
        }
        let table = rows.number("meshes", |(.., entries)| entries.len().to_string()).table;
        let note = format!(
            "Medians over the meshes on which a method reached the number of spheres. {} METHODOLOGY.md defines the columns.",
            self.note
        );
        (!table.rows.is_empty()).then(|| Table {
            caption: self.caption.to_owned(),
            notes: vec![how.to_owned(), note],
            grouped: true,
            ..table
        })
    }
}
