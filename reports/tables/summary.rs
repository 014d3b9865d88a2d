//! The summary: means over meshes, one table for each number of spheres and one for error bounds.

use crate::comparison::Comparison;
use crate::metric::COMPARED;
use crate::summary::{
    CountSummary, ERROR_BOUNDS, Fewest, SeriesSummary, best, curve_level, fewest_spheres, reference,
};
use crate::tables::{Cell, Column, Row, Table};
use crate::text::{counted, grouped, significant};

/// One table for all sphere counts, and one with the fewest spheres for each error bound.
pub(crate) fn summary_tables(
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
    how: &str,
) -> Vec<Table> {
    vec![means_table(comparison, summaries, how), bounds_table(comparison, summaries, how)]
}

fn means_table(comparison: &Comparison<'_>, summaries: &[CountSummary], how: &str) -> Table {
    let mut columns =
        vec![Column::number("spheres"), Column::text("method"), Column::text("means over")];
    let yardstick = reference(comparison).map(|series| comparison.series[series].as_str());
    columns.extend([
        Column::number(format!("Hausdorff ÷ {}", yardstick.unwrap_or("reference"))),
        Column::text("on"),
    ]);
    columns.extend(COMPARED.iter().map(|metric| Column::number(metric.heading())));
    columns.extend(["substrate (s)", "prepare (s)", "simplify (s)"].map(Column::number));
    columns.extend([Column::text("topology right"), Column::text("without a result")]);
    let mut rows = Vec::new();
    for summary in summaries {
        for (index, row) in summary.rows.iter().enumerate() {
            rows.push(Row { cells: cells(comparison, summary, row), starts_group: index == 0 });
        }
    }
    Table {
        caption: "Means over meshes at equal numbers of spheres".to_owned(),
        notes: vec![
            how.to_owned(),
            "Geometric means of errors and total time, arithmetic means of angles, shares, spikes \
             and stages. Each method is averaged over one set of meshes of its own for all counts: \
             those on which it reached every count that it reached on enough of them. Means over \
             all meshes read beside each other; in parentheses are those over fewer, with their number \
             where some of the set have no such value, as an angle where there is no triangle. Across \
             different sets, compare the ratio: the geometric mean of the Hausdorff errors in \
             relation to the named method's, on the meshes where both reached the count."
                .to_owned(),
            "Lengths in % of the bounding-box diagonal; seconds of wall clock. Arrows: which way \
             is better. Bold: best of the means over all meshes."
                .to_owned(),
        ],
        columns,
        rows,
    }
}

fn cells(comparison: &Comparison<'_>, summary: &CountSummary, row: &SeriesSummary) -> Vec<Cell> {
    let is_whole = summary.is_whole(row);
    let framed = |text: String| if is_whole { text } else { format!("({text})") };
    let mut cells = vec![
        Cell::new(grouped(summary.count as u64)),
        Cell::new(comparison.series[row.series].as_str()),
        Cell::new(format!("{} of {}", row.over, row.asked)),
        Cell::optional(row.ratio.map(|ratio| significant(ratio.value, 3))),
        Cell::optional(row.ratio.map(|ratio| counted(ratio.meshes, "mesh", "meshes"))),
    ];
    cells.extend(COMPARED.iter().map(|metric| {
        let Some(mean) = row.mean(metric) else { return Cell::optional(None) };
        let (text, over) = (metric.format_mean(mean), row.over(metric));
        let is_whole = summary.is_whole_of(row, metric);
        let best =
            is_whole && best(summary, metric).is_some_and(|best| metric.format_mean(best) == text);
        let text = match is_whole {
            true => text,
            false if over == row.over => format!("({text})"),
            false => format!("({text}; {over})"),
        };
        Cell { text, best }
    }));
    match row.stages {
        Some(stages) => {
            cells.extend(stages.map(|seconds| Cell::new(framed(significant(seconds, 3)))));
        }
        None => cells.extend([(); 3].map(|()| Cell::optional(None))),
    }
    let (right, known) = row.topology;
    cells.push(Cell::optional((known > 0).then(|| format!("{right} of {known}"))));
    cells.push(Cell::new(without_result(row)));
    cells
}

/// What became of the meshes that are in no mean.
pub(crate) fn without_result(row: &SeriesSummary) -> String {
    let parts =
        [(row.failed, "failed"), (row.unsupported, "unsupported"), (row.missed, "other count")];
    let parts: Vec<String> = parts
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    if parts.is_empty() { "none".to_owned() } else { parts.join(", ") }
}

/// The fewest spheres for each error bound.
pub(crate) fn bounds_table(
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
    how: &str,
) -> Table {
    let mut columns = vec![Column::text("method")];
    columns.extend(ERROR_BOUNDS.map(|bound| Column::number(format!("up to {bound} % ↓"))));
    columns.push(Column::number("level of the curve (%) ↓"));
    let rows = (0..comparison.series.len()).map(|series| {
        let mut cells = vec![Cell::new(comparison.series[series].as_str())];
        cells.extend(
            ERROR_BOUNDS
                .map(|bound| Cell::new(fewest_text(&fewest_spheres(comparison, series, bound)))),
        );
        let level = curve_level(summaries, series);
        cells.push(Cell::optional(level.map(|level| significant(level, 3))));
        Row { cells, starts_group: false }
    });
    Table {
        caption: "Fewest spheres for a Hausdorff error bound, among the levels that were run"
            .to_owned(),
        notes: vec![
            how.to_owned(),
            "Median over the meshes of the fewest spheres with a Hausdorff error within the bound, \
             in % of the bounding-box diagonal; in parentheses the meshes that stayed within it at \
             some level. Where less than half did there is no median."
                .to_owned(),
            "Level of the curve: the area under the curve of mean Hausdorff error against spheres, \
             both as logarithms, told as the constant error with the same area; over the counts \
             that were run, where the method has a mean at all of them."
                .to_owned(),
        ],
        rows: rows.collect(),
        columns,
    }
}

/// The median, and on how many meshes the bound was met.
pub(crate) fn fewest_text(fewest: &Fewest) -> String {
    let meshes = counted(fewest.of, "mesh", "meshes");
    match fewest.median {
        Some(median) => format!("{} ({} of {meshes})", grouped(median as u64), fewest.meshes),
        None => format!("– ({} of {meshes})", fewest.meshes),
    }
}
