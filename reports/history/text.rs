//! What was found as Markdown, for terminals and comments, and as JSON, for programs.

use serde_json::{Value, json};

use super::{Change, Difference, Findings, FoundStep, Shared};
use crate::tables::escape_markdown;
use crate::text::{counted, significant};

/// More lines than this of one kind are counted, not told: the page and the JSON have them.
const TOLD: usize = 40;

impl Findings<'_> {
    /// The history as Markdown: the verdict on the newest night first.
    pub fn to_markdown(&self) -> String {
        let mut text = format!("# {}\n\n{}", self.title(), self.verdict_markdown());
        if !self.shared.is_empty() {
            text.push_str("\n## Nights at which most series moved alike\n\n");
            list(&mut text, self.shared.iter().map(|event| self.told_shared(event)));
        }
        text.push_str("\n## Steps, the newest first\n\n");
        match self.steps.iter().any(|step| !step.shared) {
            false => text.push_str("None.\n"),
            true => text.push_str(&self.step_table()),
        }
        text.push_str("\n## Results that changed, the newest first\n\n");
        match self.changes.is_empty() {
            true => text.push_str("None.\n"),
            false => list(&mut text, self.changed_nights().into_iter()),
        }
        text
    }

    /// The history as JSON. Nights are told by date and commit.
    pub fn to_json(&self) -> Value {
        let (steps, changes) = self.regressions();
        let regressions = steps.len() + changes.len();
        let night = |index: usize| json!({ "date": self.nights[index].date, "commit": self.nights[index].commit });
        let range = |before: usize, after: usize| json!({ "last_before": night(before), "first_after": night(after) });
        let name = |track: usize| self.tracks[track].name;
        let groups = self.groups.iter().map(|group| {
            let ends = group.nights.first().zip(group.nights.last());
            json!({
                "machine": group.machine,
                "conditions": group.conditions,
                "nights": group.nights.len(),
                "first": ends.map(|(first, _)| night(*first)),
                "last": ends.map(|(_, last)| night(*last)),
            })
        });
        let steps = self.steps.iter().map(|found| {
            let step = found.step;
            json!({
                "mesh": name(found.track).mesh, "row": name(found.track).row,
                "level": name(found.track).level, "quantity": found.quantity.name(),
                "ratio": step.ratio, "low": step.low, "high": step.high,
                "night": night(found.night), "commits": range(found.before, found.night),
                "worse": found.is_worse(), "shared": found.shared, "news": found.news,
            })
        });
        let changes = self.changes.iter().map(|change| {
            let differences = change.differences.iter().map(|d| {
                json!({ "what": d.what, "from": d.from, "to": d.to, "ratio": d.ratio, "worse": d.worse })
            });
            json!({
                "mesh": name(change.track).mesh, "row": name(change.track).row,
                "level": name(change.track).level, "night": night(change.night),
                "commits": range(change.before, change.night), "worse": change.is_worse(),
                "differences": differences.collect::<Vec<_>>(),
            })
        });
        let shared = self.shared.iter().map(|event| {
            json!({
                "night": night(event.night), "commits": range(event.before, event.night),
                "ratio": event.ratio, "moved": event.moved, "of": event.of,
            })
        });
        json!({
            "nights": self.nights.len(),
            "newest": self.nights.len().checked_sub(1).map(night),
            "series": self.tracks.len(),
            "regressions": regressions,
            "groups": groups.collect::<Vec<_>>(),
            "shared": shared.collect::<Vec<_>>(),
            "steps": steps.collect::<Vec<_>>(),
            "changes": changes.collect::<Vec<_>>(),
        })
    }

    /// How much there is.
    pub(super) fn title(&self) -> String {
        format!(
            "History: {}, {}",
            counted(self.nights.len(), "night", "nights"),
            counted(self.tracks.len(), "series", "series")
        )
    }

    /// What the newest night brought, in one sentence, and the list of what is worse.
    pub(super) fn verdict(&self) -> (String, Vec<String>) {
        let Some(newest) = self.nights.last() else {
            return ("There is no night yet.".to_owned(), Vec::new());
        };
        let (steps, changes) = self.regressions();
        let night = format!("The newest night, {} ({})", newest.date, short(&newest.commit));
        if steps.is_empty() && changes.is_empty() {
            return (format!("{night}, began nothing for the worse."), Vec::new());
        }
        let mut lines: Vec<String> = steps
            .iter()
            .map(|step| {
                let name = self.tracks[step.track].name;
                let (night, range) = self.night_and_range(step.before, step.night);
                let size = size_text(step);
                format!("{name}: {} {size} since {night}, {range}", step.quantity.name())
            })
            .collect();
        lines.extend(changes.iter().map(|change| self.told_change(change)));
        let things = counted(lines.len(), "thing", "things");
        (format!("{night}, brought {things} for the worse:"), lines)
    }

    fn verdict_markdown(&self) -> String {
        let (sentence, lines) = self.verdict();
        let mut text = format!("{sentence}\n");
        for (group, index) in self.groups.iter().zip(0..).filter(|_| self.groups.len() > 1) {
            text.push_str(if index == 0 { "\n" } else { "" });
            let nights = counted(group.nights.len(), "night", "nights");
            let line = format!("{nights} on {}; {}", group.machine, group.conditions);
            text.push_str(&format!("- {}\n", escape_markdown(&line)));
        }
        if self.groups.len() > 1 {
            text.push_str("\nNights of different machines or conditions are not compared.\n");
        }
        if !lines.is_empty() {
            text.push('\n');
            list(&mut text, lines.into_iter());
        }
        text
    }

    fn step_table(&self) -> String {
        let mut text = String::from(
            "| night | commits | series | what | size | between |\n|---|---|---|---|---:|---|\n",
        );
        let own: Vec<&FoundStep> = self.steps.iter().filter(|step| !step.shared).collect();
        for step in own.iter().take(TOLD) {
            let cells = self.step_cells(step).map(|cell| escape_markdown(&cell));
            text.push_str(&format!("| {} |\n", cells.join(" | ")));
        }
        if own.len() > TOLD {
            text.push_str(&format!("\nand {} more\n", own.len() - TOLD));
        }
        text
    }

    /// Night, commits, series, quantity, size, interval of a step.
    pub(super) fn step_cells(&self, found: &FoundStep) -> [String; 6] {
        let (night, range) = self.night_and_range(found.before, found.night);
        let interval = format!("{} and {}", percent(found.step.low), percent(found.step.high));
        let name = self.tracks[found.track].name.to_string();
        [night, range, name, found.quantity.name().to_owned(), percent(found.step.ratio), interval]
    }

    pub(super) fn night_and_range(&self, before: usize, night: usize) -> (String, String) {
        let [from, to] = [before, night].map(|index| short(&self.nights[index].commit));
        (self.nights[night].date.clone(), format!("{from}..{to}"))
    }

    pub(super) fn told_shared(&self, event: &Shared) -> String {
        let (night, range) = self.night_and_range(event.before, event.night);
        format!(
            "{night}, {range}: {} of {} series moved alike, by {} (median): the machine, or what all methods share \
             (compiler, allocator), not one method",
            event.moved,
            event.of,
            percent(event.ratio)
        )
    }

    /// What changed in a series, the worst first.
    pub(super) fn told_change(&self, change: &Change) -> String {
        let (night, range) = self.night_and_range(change.before, change.night);
        let mut told: Vec<&Difference> = change.differences.iter().collect();
        told.sort_by_key(|difference| !difference.worse);
        let told: Vec<String> = told.into_iter().map(difference_text).collect();
        format!("{}: {} since {night}, {range}", self.tracks[change.track].name, told.join(", "))
    }

    /// A line for each night with changes: what changed in how many series, and the largest rise of an error.
    pub(super) fn changed_nights(&self) -> Vec<String> {
        let by_night = self.changes.chunk_by(|a, b| a.night == b.night);
        by_night.map(|changes| self.changed_night(changes)).collect()
    }

    fn changed_night(&self, changes: &[Change]) -> String {
        let first = &changes[0];
        let (night, range) = self.night_and_range(first.before, first.night);
        let all = || changes.iter().flat_map(|c| c.differences.iter().map(move |d| (c, d)));
        let of = |what: &str, worse: bool| {
            all().filter(|(_, d)| d.what == what && d.worse == worse).count()
        };
        let parts = [
            (of("status", true), "lost or off count"),
            (of("status", false), "of another status"),
            (of("topology", true), "lost the topology"),
            (of("topology", false), "of another topology"),
            (of("hausdorff", true), "with a larger error"),
            (of("hausdorff", false), "with a smaller error, or nearly the same"),
            (of("spheres", false), "of another count"),
            (of("result", false), "with another result"),
        ];
        let parts = parts.iter().filter(|(number, _)| *number > 0);
        let parts: Vec<String> = parts.map(|(number, words)| format!("{number} {words}")).collect();
        let ratio = |(_, d): &(&Change, &Difference)| d.ratio.filter(|_| d.what == "hausdorff");
        let rise = all().filter(|pair| ratio(pair).is_some_and(|ratio| ratio > 1.0));
        let rise = rise.max_by(|a, b| ratio(a).unwrap_or(1.0).total_cmp(&ratio(b).unwrap_or(1.0)));
        let most = rise.map_or(String::new(), |(change, difference)| {
            let name = self.tracks[change.track].name;
            format!("; largest rise: {name}, {}", difference_text(difference))
        });
        let series = counted(changes.len(), "series", "series");
        format!("{night}, {range}: {series} changed: {}{most}", parts.join(", "))
    }
}

fn size_text(found: &FoundStep) -> String {
    let step = found.step;
    format!("{} (between {} and {})", percent(step.ratio), percent(step.low), percent(step.high))
}

fn difference_text(difference: &Difference) -> String {
    let Difference { what, from, to, ratio, .. } = difference;
    let share = ratio.map_or(String::new(), |ratio| format!(" ({})", percent(ratio)));
    format!("{what} {from} → {to}{share}")
}

/// A ratio as a change in percent: `+10.3 %`.
pub(super) fn percent(ratio: f64) -> String {
    let percent = 100.0 * (ratio - 1.0);
    match percent.abs() {
        // Six digits of errors tell so small a change, which is none in one decimal.
        size if size < 0.05 => format!("{}{} %", sign(percent), significant(size, 2)),
        size => format!("{}{size:.1} %", sign(percent)),
    }
}

fn sign(number: f64) -> &'static str {
    if number < 0.0 { "\u{2212}" } else { "+" }
}

/// The first digits of a commit, as people write it.
pub(super) fn short(commit: &str) -> &str {
    commit.get(..8).unwrap_or(commit)
}

/// Lines as a list, the first ones.
fn list(text: &mut String, lines: impl ExactSizeIterator<Item = String>) {
    let more = lines.len().saturating_sub(TOLD);
    for line in lines.take(TOLD) {
        text.push_str(&format!("- {}\n", escape_markdown(&line)));
    }
    if more > 0 {
        text.push_str(&format!("- and {more} more\n"));
    }
}
