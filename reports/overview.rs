//! All methods at one number of spheres, a line each: the end of a comparison, and the one table of the page.

use std::collections::BTreeMap;

use medial_run::record::Record;
use medial_run::text::{aligned, counted, grouped, printable, shortened};

use crate::answers::{equal_error_table, usual_level};
use crate::comparison::{Comparison, reached, row_name};
use crate::header::MethodNote;
use crate::metric::{
    CLAIMED_SECONDS, FROZEN_SECONDS, HAUSDORFF, MEAN_ERROR, Mean, Metric, TIME_SPREAD,
    TOTAL_SECONDS,
};
use crate::summary::{CountSummary, SeriesSummary, by_count};
use crate::tables::{Cell, Table};

/// Longest line of the terminal, in characters.
const WIDTH: usize = 100;

/// Longest name of a method there, in characters, and the same with the mark of an edition.
const NAMES: [usize; 2] = [22, 40];

/// The methods with a mean at the requested count nearest to 100, the least error first. Those without one are named in
/// the last note with the reason. `None` where no method has one.
pub(crate) fn overview_table(
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
    methods: &[MethodNote],
) -> Option<Table> {
    let (level, count) = usual_level(comparison)?;
    let summary = summaries.iter().find(|summary| summary.count == count)?;
    let mut rows: Vec<&SeriesSummary> = vec![];
    let mut missing: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for row in &summary.rows {
        if row.mean(&HAUSDORFF).is_some() {
            rows.push(row);
        } else {
            let why: Vec<String> = row.without.keys().map(ToString::to_string).collect();
            missing.entry(why.join(", ")).or_default().push(&comparison.series[row.series]);
        }
    }
    let error = |row: &SeriesSummary| row.mean(&HAUSDORFF).unwrap_or(f64::INFINITY);
    rows.sort_by(|a, b| error(a).total_cmp(&error(b))); // equal ones stay in order
    let mean = |row: &SeriesSummary, metric: &Metric| {
        let text = row.mean(metric).map(|mean| metric.format_mean(mean));
        // Means over fewer meshes do not compare with the others.
        let is_over_all = row.over == summary.meshes;
        text.map(|t| if is_over_all { t } else { format!("({t})") })
    };
    let table = Table::of(&rows)
        .text("method", |row| comparison.series[row.series].as_str())
        .number("spheres", |row| {
            let own = comparison.at(row.series, level).into_iter().filter(|e| e.comparable());
            let counts = own.filter_map(|entry| Some(reached(entry.record)? as f64));
            let mean = Mean::Arithmetic.of(&counts.collect::<Vec<_>>());
            mean.map(|mean| grouped(mean.round() as u64))
        })
        .number("Hausdorff %", |row| mean(row, &HAUSDORFF))
        .number("mean %", |row| mean(row, &MEAN_ERROR))
        .text("topology", |row| Cell::share(row.topology))
        .number("means over", |row| Cell::share((row.over, row.requested)))
        .number("seconds", |row| mean(row, &TOTAL_SECONDS))
        .number("spread %", |row| mean(row, &TIME_SPREAD))
        .number("frozen s", |row| mean(row, &FROZEN_SECONDS))
        .number("claimed s", |row| mean(row, &CLAIMED_SECONDS))
        .text("best suited for", |row| {
            let note = methods.iter().find(|note| note.id == comparison.methods[row.series]);
            note.and_then(MethodNote::briefly).unwrap_or_default()
        })
        .table;
    let is_one = comparison.meshes.len() == 1;
    let over = if is_one { "" } else { ", geometric means" };
    let right = "topology: results with the Betti numbers of the solid";
    let mut notes = vec![format!("Errors in % of the diagonal{over}; {right}.")];
    if rows.iter().any(|row| row.over < summary.meshes) {
        notes.push("In parentheses: means over fewer meshes, which do not compare.".to_owned());
    }
    let edition = comparison.edition_note();
    let has = |metric: &Metric| comparison.columns().iter().any(|column| column.key == metric.key);
    let times =
        [("spread %", TIME_SPREAD), ("frozen s", FROZEN_SECONDS), ("claimed s", CLAIMED_SECONDS)];
    let missing_times = times.iter().filter(|(_, metric)| !has(metric)).map(|(title, _)| *title);
    let table = table.without(&missing_times.collect::<Vec<_>>());
    if has(&TIME_SPREAD) {
        notes.push(
            "Spread: the longest minus the shortest time over the repetitions, in % of the median."
                .to_owned(),
        );
    }
    let missing: Vec<String> =
        missing.iter().map(|(why, names)| format!("{} ({why})", names.join(", "))).collect();
    if !missing.is_empty() {
        notes.push(format!("No result at this count: {}.", missing.join("; ")));
    }
    notes.extend(comparison.seeds_note());
    notes.extend(edition);
    let table = if is_one { table.of_one_mesh() } else { table };
    let meshes = counted(comparison.meshes.len(), "mesh", "meshes");
    let caption = format!("{}, {meshes}", counted(count, "sphere", "spheres"));
    (!table.rows.is_empty()).then_some(Table { caption, notes, ..table })
}

/// The end of a comparison as plain text, at most 100 characters wide: the table of all methods at the requested count
/// nearest to 100, and that of the error bounds where there are any.
pub fn summary_text(records: &[Record]) -> String {
    let comparison = Comparison::new(records);
    let mut text = String::new();
    if let Some(table) = overview_table(&comparison, &by_count(&comparison), &[]) {
        // Sentences do not fit a line, and the names and seconds of an edition take the room of another column.
        let is_mixed = comparison.edition_note().is_some();
        let table = table.without(&["best suited for"]);
        let table = if is_mixed { table.without(&["means over"]) } else { table };
        text += &format!("{}\n{}", table.caption, plain(&table));
        table.notes.iter().for_each(|note| text += &wrapped(note));
    }
    if let Some(table) = equal_error_table(&comparison, "") {
        let table = table.without(&["on", "stored numbers ↓", "failed"]); // wider than a line
        text += &format!("\n{}\n{}", table.caption, plain(&table));
    }
    text
}

/// The rows below the heads of their columns; the last column has the room that the others leave.
fn plain(table: &Table) -> String {
    let last = table.columns.len() - 1;
    // Without a text at the end, names have its room.
    let name = NAMES[usize::from(table.columns[last].number)];
    let heads: Vec<Cell> = table.columns.iter().map(|c| Cell::from(c.title.as_str())).collect();
    let mut lines: Vec<Vec<String>> = vec![];
    for cells in [&heads].into_iter().chain(&table.rows) {
        let limit = |k: usize| if k < last { name } else { WIDTH };
        let texts = cells.iter().enumerate();
        lines.push(texts.map(|(k, cell)| shortened(&printable(&cell.text), limit(k))).collect());
    }
    let widest = |k: usize| lines.iter().map(|line| line[k].chars().count()).max().unwrap_or(0);
    let room = WIDTH.saturating_sub((0..last).map(|k| widest(k) + 2).sum());
    lines.iter_mut().for_each(|line| line[last] = shortened(&line[last], room));
    aligned(&lines, |k| table.columns[k].number)
}

/// A sentence in lines that fit; all but the first are indented.
fn wrapped(text: &str) -> String {
    let (mut lines, mut used) = (String::new(), 0);
    for word in printable(text).split_inclusive(' ') {
        let length = word.chars().count();
        if used + length > WIDTH {
            lines = lines.trim_end().to_owned() + "\n  ";
            used = 2;
        }
        lines.push_str(word);
        used += length;
    }
    lines + "\n"
}

/// Why levels have no result: a line for all levels of a method on a mesh that have the same reason.
pub fn reasons(records: &[Record]) -> Vec<String> {
    let mut missing: Vec<&Record> = records.iter().collect();
    missing.retain(|record| !record.status.has_result());
    let is_alike = |a: &&Record, b: &&Record| {
        (&a.mesh, row_name(a), a.status, &a.reason) == (&b.mesh, row_name(b), b.status, &b.reason)
    };
    let line = |alike: &[&Record]| {
        let Record { mesh, simplify, status, reason, .. } = alike[0];
        let levels = match alike.len() {
            1 => simplify.level.to_string(),
            several => format!("{several} levels"),
        };
        let reason = reason.as_deref().unwrap_or("no reason");
        let status = status.to_string();
        // Some reasons begin with the status themselves.
        let begin = if reason.starts_with(&status) { String::new() } else { status + ": " };
        format!("{mesh}, {}, {levels}: {begin}{reason}", row_name(alike[0]))
    };
    missing.chunk_by(is_alike).map(line).collect()
}
