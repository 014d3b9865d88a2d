//! Equal error: how many spheres, stored numbers and seconds each method needs for the same
//! Hausdorff error. The levels were searched for, not read off counts.

use crate::Target;

use crate::comparison::{Comparison, Entry, reached};
use crate::metric::{Mean, TOTAL_SECONDS};
use crate::record::Status;
use crate::summary::{Ratio, reference, topology};
use crate::tables::{Cell, Column, Row, Table};
use crate::text::{counted, grouped, significant};

/// All methods at one error bound.
pub(crate) struct BoundSummary {
    /// The bound, in % of the diagonal.
    pub(crate) percent: f64,
    pub(crate) rows: Vec<BoundRow>,
}

/// One method at one error bound.
pub(crate) struct BoundRow {
    pub(crate) series: usize,
    /// Meshes that the method was asked for, and those on which some level keeps the bound.
    pub(crate) asked: usize,
    pub(crate) met: usize,
    /// Meshes on which there is no answer, for another reason than that no level keeps the bound.
    pub(crate) failed: usize,
    /// Median over the meshes, where one without an answer counts as infinitely many; `None` where
    /// the median mesh has none.
    pub(crate) spheres: Option<f64>,
    numbers: Option<f64>,
    seconds: Option<f64>,
    /// Spheres in relation to the reference's.
    ratio: Option<Ratio>,
    topology: (usize, usize),
}

/// Summaries for every bound that was searched for, from loose to tight.
pub(crate) fn by_bound(comparison: &Comparison<'_>) -> Vec<BoundSummary> {
    let reference = reference(comparison);
    let bounds = comparison.levels.iter().enumerate().filter_map(|(index, level)| match level {
        Target::MaxError(bound) => Some((index, *bound)),
        _ => None,
    });
    let at_bound = |(level, bound): (usize, f64)| {
        let of_series = |series: usize| -> Vec<&Entry<'_>> {
            let here = |entry: &&Entry<'_>| entry.level == level && entry.series == series;
            comparison.entries.iter().filter(here).collect()
        };
        let yardstick = reference.map(of_series).unwrap_or_default();
        let rows = (0..comparison.series.len()).map(|series| (series, of_series(series)));
        let rows = rows.filter(|(_, entries)| !entries.is_empty());
        let rows = rows.map(|(series, entries)| row(series, &entries, &yardstick)).collect();
        BoundSummary { percent: (bound * 1e12).round() / 1e10, rows }
    };
    bounds.map(at_bound).collect()
}

fn row(series: usize, entries: &[&Entry<'_>], yardstick: &[&Entry<'_>]) -> BoundRow {
    let met: Vec<&Entry<'_>> = entries.iter().copied().filter(|entry| entry.measured()).collect();
    let missed = entries.iter().filter(|e| e.record.status == Status::BoundMissed).count();
    let median = |of: &dyn Fn(&Entry<'_>) -> Option<f64>| {
        let mut values: Vec<f64> = met.iter().filter_map(|entry| of(entry)).collect();
        values.resize(entries.len(), f64::INFINITY);
        values.sort_by(f64::total_cmp);
        // The upper median: at least half of the meshes need no more.
        values.get(values.len() / 2).copied().filter(|value| value.is_finite())
    };
    let spheres = |entry: &Entry<'_>| reached(entry.record).map(|spheres| spheres as f64);
    let ratios = met.iter().filter_map(|entry| {
        let other = yardstick.iter().find(|o| o.mesh == entry.mesh && o.measured())?;
        Some(spheres(entry)? / spheres(other)?)
    });
    let ratios: Vec<f64> = ratios.collect();
    BoundRow {
        series,
        asked: entries.len(),
        met: met.len(),
        failed: entries.len() - met.len() - missed,
        spheres: median(&spheres),
        numbers: median(&|e| Some(e.record.evaluate.as_ref()?.counts.numbers() as f64)),
        seconds: median(&|entry| TOTAL_SECONDS.of(entry.record)),
        ratio: Mean::Geometric { floor: f64::MIN_POSITIVE }
            .of(&ratios)
            .map(|value| Ratio { value, meshes: ratios.len() }),
        topology: topology(&met),
    }
}

/// The table of all bounds; `None` where nothing was searched for.
pub(crate) fn equal_error_table(
    comparison: &Comparison<'_>,
    bounds: &[BoundSummary],
    how: &str,
) -> Option<Table> {
    let yardstick = reference(comparison).map(|series| comparison.series[series].as_str());
    let mut rows = Vec::new();
    for bound in bounds {
        let mut sorted: Vec<&BoundRow> = bound.rows.iter().collect();
        let order = |row: &BoundRow| row.spheres.unwrap_or(f64::INFINITY);
        sorted.sort_by(|a, b| order(a).total_cmp(&order(b)).then(b.met.cmp(&a.met)));
        for (index, row) in sorted.into_iter().enumerate() {
            rows.push(Row { cells: cells(comparison, bound, row), starts_group: index == 0 });
        }
    }
    (!rows.is_empty()).then(|| Table {
        caption: "Equal error: the fewest spheres within a Hausdorff error".to_owned(),
        notes: vec![
            how.to_owned(),
            "Searched for on each mesh among counts and the method's own levels; fewer spheres at \
             the same error are better. Medians over all meshes, where one on which no level keeps \
             the error counts as infinitely many; a dash: so on half of them. The ratio is the \
             geometric mean of the numbers of spheres in relation to the named method's, on the \
             meshes where both keep the error. Stored numbers: floats of the medial mesh. Seconds \
             are those of the level found, without the search."
                .to_owned(),
        ],
        columns: vec![
            Column::number("error (%)"),
            Column::text("method"),
            Column::text("kept on"),
            Column::number("spheres ↓"),
            Column::number(format!("÷ {}", yardstick.unwrap_or("reference"))),
            Column::text("on"),
            Column::number("stored numbers ↓"),
            Column::number("total (s) ↓"),
            Column::text("topology right"),
            Column::text("failed"),
        ],
        rows,
    })
}

fn cells(comparison: &Comparison<'_>, bound: &BoundSummary, row: &BoundRow) -> Vec<Cell> {
    let whole = |value: Option<f64>| Cell::optional(value.map(|v| grouped(v.round() as u64)));
    let (right, known) = row.topology;
    vec![
        Cell::new(bound.percent.to_string()),
        Cell::new(comparison.series[row.series].as_str()),
        Cell::new(format!("{} of {}", row.met, row.asked)),
        whole(row.spheres),
        Cell::optional(row.ratio.map(|ratio| significant(ratio.value, 3))),
        Cell::optional(row.ratio.map(|ratio| counted(ratio.meshes, "mesh", "meshes"))),
        whole(row.numbers),
        Cell::optional(row.seconds.map(|seconds| significant(seconds, 3))),
        Cell::optional((known > 0).then(|| format!("{right} of {known}"))),
        Cell::new(if row.failed > 0 { row.failed.to_string() } else { "none".to_owned() }),
    ]
}
