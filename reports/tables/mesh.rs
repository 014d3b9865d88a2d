//! The table of one mesh: every method at every level, failures included.

use std::collections::BTreeMap;

use medial::metrics::Evaluation;
use medial_run::text::{betti, grouped, printable};

use crate::comparison::{Comparison, Entry, level_label, reached};
use crate::metric::{COMPARED, HAUSDORFF, Metric};
use crate::summary::pick;
use crate::tables::{Cell, Table};

/// The values that the bold numbers equal, by level and key of one of [`COMPARED`].
pub(crate) struct Best(BTreeMap<(usize, &'static str), f64>);

impl Best {
    /// The best values of one mesh, for each level at which at least two results compare.
    pub(crate) fn of_mesh(comparison: &Comparison<'_>, mesh: usize) -> Self {
        let mut values: BTreeMap<_, Vec<f64>> = BTreeMap::new();
        for entry in comparison.of_mesh(mesh).filter(|entry| entry.comparable()) {
            for metric in COMPARED {
                let here = values.entry((entry.level, metric.key)).or_default();
                here.extend(metric.of(entry.record));
            }
        }
        // A single result is no best.
        values.retain(|_, values| values.len() > 1);
        let best = values.into_iter().filter_map(|((level, key), values)| {
            let metric = COMPARED.into_iter().find(|metric| metric.key == key)?;
            Some(((level, key), values.into_iter().reduce(|a, b| pick(metric, a, b))?))
        });
        Self(best.collect())
    }

    /// Whether a value of an entry is the best of its level, as far as it is written.
    pub(crate) fn is_best(&self, entry: &Entry<'_>, metric: &Metric, value: f64) -> bool {
        let best = self.0.get(&(entry.level, metric.key));
        // Two numbers that read the same are equally good.
        entry.comparable() && best.is_some_and(|&best| metric.format(best) == metric.format(value))
    }
}

/// Whether the Betti numbers are the solid's: `yes`, `no`, or a dash where one is unknown.
pub(crate) fn topology_word(entry: &Entry<'_>) -> &'static str {
    let evaluation = entry.record.evaluate.as_ref();
    match evaluation.and_then(Evaluation::has_right_topology) {
        Some(true) => "yes",
        Some(false) => "no",
        None => "–",
    }
}

/// The reason for a missing result, or a remark: the last column.
pub(crate) fn remark(entry: &Entry<'_>) -> String {
    let record = entry.record;
    if !record.status.is_ok() {
        return match &record.reason {
            Some(reason) => format!("{}: {}", record.status, printable(reason)),
            None => record.status.to_string(),
        };
    }
    if record.evaluate.is_none() {
        return "not evaluated".to_owned();
    }
    if let (medial_run::level::Target::Spheres(_), false) =
        (record.simplify.level, entry.comparable())
    {
        return "another number of spheres: not compared".to_owned();
    }
    String::new()
}

/// The table of one mesh. `how` has the command line and version that made it.
pub(crate) fn mesh_table(comparison: &Comparison<'_>, mesh: usize, how: &str) -> Table {
    let best = Best::of_mesh(comparison, mesh);
    let entries: Vec<Entry<'_>> = comparison.of_mesh(mesh).copied().collect();
    let mut rows = Table::of(&entries)
        .number("requested", |entry| level_label(entry.record.simplify.level))
        .text("method", |entry| comparison.series[entry.series].as_str())
        .number("spheres", |entry| reached(entry.record).map(|count| grouped(count as u64)));
    for metric in comparison.columns() {
        rows = rows.number(metric.heading(), |entry| match metric.of(entry.record) {
            Some(value) => {
                Cell { text: metric.format(value), best: best.is_best(entry, metric, value) }
            }
            None => Cell::from(None),
        });
    }
    let has_seeds = entries.iter().any(|entry| comparison.range(entry, &HAUSDORFF).is_some());
    if has_seeds {
        rows = rows.text("Hausdorff over seeds", |entry| {
            let range = comparison.range(entry, &HAUSDORFF);
            range.map(|ends| ends.map(|end| HAUSDORFF.format(end)).join(" to "))
        });
    }
    rows = rows.text("Betti", |entry| {
        let evaluation = entry.record.evaluate.as_ref();
        evaluation.map(|evaluation| betti(Some(evaluation.betti)))
    });
    rows = rows.text("right topology", topology_word);
    rows = rows.text("remark", remark);
    let mut notes = vec![how.to_owned()];
    if let Some(initial) = entries.iter().find_map(|entry| entry.record.initial) {
        notes.push(format!(
            "Initial medial mesh: {} spheres, {} edges, {} faces; Betti numbers {}; of the solid: {}.",
            grouped(initial.spheres),
            grouped(initial.edges),
            grouped(initial.faces),
            betti(initial.betti),
            betti(initial.expected_betti),
        ));
    }
    notes.push(UNITS.to_owned());
    notes.extend(comparison.seeds_note());
    notes.extend(comparison.edition_note());
    Table {
        caption: format!("{}: every method at every level", comparison.meshes[mesh]),
        notes,
        grouped: true,
        ..rows.table
    }
}

/// Units and the meaning of bold, under every table of one mesh.
const UNITS: &str = "Lengths in % of the bounding-box diagonal of the input; seconds of wall clock, \
    shared substrates included. Arrows point in the better direction. Bold: best at this number of spheres, \
    among results that reached it to within 2 %.";
