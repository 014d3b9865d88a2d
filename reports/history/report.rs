//! The findings as Markdown.

use medial_run::text::{counted, significant};

use super::{DatedChange, Findings};
use crate::diff::Meaning;
use crate::diff::text::shown;
use crate::tables::{Cell, Table, escape, to_markdown};

impl Findings<'_> {
    /// The findings as Markdown: regressions of the newest run first.
    pub fn to_markdown(&self) -> String {
        let mut text = format!("# {}\n\n{}\n", escape(&self.title()), escape(&self.summary()));
        for line in self.settings() {
            text.push_str(&format!("- {}\n", escape(&line)));
        }
        for table in self.tables() {
            text.push_str(&format!("\n{}", to_markdown(&table)));
        }
        text
    }

    /// The regressions of the newest run.
    fn title(&self) -> String {
        match (&self.headline, self.compared) {
            (Some(headline), _) => headline.clone(),
            (None, 0) if self.runs.len() == 1 => "First run, nothing to compare".to_owned(),
            (None, 0) => {
                "Nothing to compare: no earlier run of this machine and these settings".to_owned()
            }
            (None, _) => "No regression".to_owned(),
        }
    }

    fn summary(&self) -> String {
        let Some(newest) = self.runs.last() else { return "No run yet.".to_owned() };
        format!(
            "Newest run, {} ({:.8}): {} among {} with an earlier run. The history has {} of {}.",
            newest.date,
            newest.commit,
            counted(self.regressions, "regression", "regressions"),
            counted(self.compared, "result", "results"),
            counted(self.runs.len(), "run", "runs"),
            counted(self.tracks.len(), "series", "series"),
        )
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
        let kinds: [(&str, Vec<&DatedChange>); 3] = [
            ("Regressions of the newest run", self.news().collect()),
            ("Change points of seconds", self.change_points.iter().collect()),
            ("Results that changed", self.changes.iter().collect()),
        ];
        kinds.into_iter().filter(|(_, changes)| !changes.is_empty()).map(table).collect()
    }
}

fn table((caption, changes): (&str, Vec<&DatedChange>)) -> Table {
    Table::of_changes(caption, &changes, |rows| {
        rows.text("run", |dated| dated.first_after.date.clone())
            .text("commits", |dated| {
                format!("{:.8}..{:.8}", dated.last_before.commit, dated.first_after.commit)
            })
            .text("series", |dated| {
                let item = &dated.change.item;
                format!("{} · {} · {}", item.mesh, item.method, item.level)
            })
            .text("what", |dated| dated.change.what.clone())
            .text("change", |dated| [&dated.change.old, &dated.change.new].map(shown).join(" → "))
            .text("size", |dated| dated.change.relative.map_or(String::new(), percent))
            .text("", |dated| match (dated.shared, dated.change.meaning) {
                (true, _) => Cell::from("most series: the machine or the compiler"),
                (false, Meaning::Regression) => Cell { best: true, ..Cell::from("worse") },
                (false, _) => Cell::from(""),
            })
    })
}

/// A share as a change in percent: `+10.3 %`.
fn percent(share: f64) -> String {
    let sign = if share < 0.0 { '−' } else { '+' };
    let size = 100.0 * share.abs();
    // Errors of six digits change by less than a decimal shows.
    let digits = if size < 0.05 { significant(size, 2) } else { format!("{size:.1}") };
    format!("{sign}{digits} %")
}
