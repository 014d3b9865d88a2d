//! The findings as Markdown.

use serde_json::Value;

use super::{Change, Findings};
use crate::tables::{Cell, Table, left_out, to_markdown};
use crate::text::{counted, significant};

/// More rows of one kind are counted, not listed: the JSON has them all.
const MOST_ROWS: usize = 40;

impl Findings<'_> {
    /// The findings as Markdown: regressions of the newest run first.
    pub fn to_markdown(&self) -> String {
        let mut text = format!("# {}\n\n{}\n", self.title(), self.summary());
        for line in self.settings() {
            text.push_str(&format!("- {line}\n"));
        }
        for table in self.tables() {
            text.push_str(&format!("\n{}", to_markdown(&table)));
        }
        text
    }

    fn title(&self) -> String {
        let series = counted(self.tracks.len(), "series", "series");
        format!("History: {}, {series}", counted(self.runs.len(), "run", "runs"))
    }

    /// The findings of the newest run, in one sentence.
    fn summary(&self) -> String {
        let Some(newest) = self.runs.last() else { return "No run yet.".to_owned() };
        let run = format!("Newest run, {} ({})", newest.date, short(&newest.commit));
        match self.regressions {
            0 => format!("{run}: no regression."),
            count => format!("{run}: {}.", counted(count, "regression", "regressions")),
        }
    }

    /// Machines and conditions, where there are several.
    fn settings(&self) -> Vec<String> {
        let mut settings: Vec<_> = self.tracks.iter().map(|track| track.setting).collect();
        settings.sort_unstable();
        settings.dedup(); // one machine needs no mention
        if settings.len() == 1 {
            return vec![];
        }
        let lines = settings.iter().map(|[machine, conditions]| {
            format!("{machine}; {conditions}: compared only with its own runs")
        });
        lines.collect()
    }

    fn tables(&self) -> Vec<Table> {
        let kinds: [(&str, Vec<&Change>); 3] = [
            ("Regressions of the newest run", self.news().collect()),
            ("Change points of seconds and memory", self.change_points.iter().collect()),
            ("Results that changed", self.changes.iter().collect()),
        ];
        kinds.into_iter().filter(|(_, changes)| !changes.is_empty()).map(table).collect()
    }
}

fn table((caption, changes): (&str, Vec<&Change>)) -> Table {
    let shown = |value: &Value| match value.as_str() {
        Some(text) => text.to_owned(),
        None => value.as_f64().map_or("–".to_owned(), |number| significant(number, 4)),
    };
    let rows = Table::of(&changes[..changes.len().min(MOST_ROWS)])
        .text("run", |change| change.first_after.date.clone())
        .text("commits", |change| {
            let commits = [&change.last_before, &change.first_after];
            commits.map(|run| short(&run.commit)).join("..")
        })
        .text("series", |change| change.series.clone())
        .text("what", |change| change.what)
        .text("change", move |change| format!("{} → {}", shown(&change.from), shown(&change.to)))
        .text("size", |change| change.ratio.map_or(String::new(), percent))
        .text("", |change| match (change.shared, change.worse) {
            (true, _) => Cell::from("most series: the machine or the compiler"),
            (false, true) => Cell { best: true, ..Cell::from("worse") },
            (false, false) => Cell::from(""),
        });
    Table {
        caption: format!("{caption}: {}", changes.len()),
        notes: left_out(changes.len(), MOST_ROWS),
        ..rows.table
    }
}

/// A ratio as a change in percent: `+10.3 %`.
fn percent(ratio: f64) -> String {
    let sign = if ratio < 1.0 { '−' } else { '+' };
    let size = 100.0 * (ratio - 1.0).abs();
    // Errors of six digits change by less than a decimal shows.
    let digits = if size < 0.05 { significant(size, 2) } else { format!("{size:.1}") };
    format!("{sign}{digits} %")
}

/// The first digits of a commit.
fn short(commit: &str) -> &str {
    commit.get(..8).unwrap_or(commit)
}
