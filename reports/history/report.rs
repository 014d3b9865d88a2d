//! The findings as Markdown for terminals, and as a page.

use super::{Change, Findings, NOISY, Track, measured};
use crate::tables::{Cell, Column, Row, Table, to_html, to_markdown};
use crate::text::{counted, escape_html, significant};

/// More rows of one kind are counted, not listed: the JSON has them all.
const MOST_ROWS: usize = 40;

/// What the page adds to the style of the report.
const STYLE: &str = "td svg { display: block; } path { fill: none; stroke: var(--link); } \
    path.worse { stroke: var(--bad); } .worse { color: var(--bad); font-weight: 600; }";

impl Findings<'_> {
    /// The findings as Markdown: first what the newest run brought for the worse.
    pub fn to_markdown(&self) -> String {
        let mut text = format!("# {}\n\n{}\n", self.title(), self.verdict());
        for line in self.settings() {
            text.push_str(&format!("- {line}\n"));
        }
        for table in self.tables() {
            text.push_str(&format!("\n{}", to_markdown(&table)));
        }
        text
    }

    /// The findings as a page without a script. `remarks`, such as damaged files, stand above them.
    pub fn to_html(&self, remarks: &[String]) -> String {
        let style = include_str!("../page/page.css");
        let class = if self.regressions > 0 { "worse" } else { "notice" };
        let mut html = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>{style}{STYLE}</style>\n</head>\n<body>\n\
             <header><h1>{title}</h1></header>\n<main>\n<p class=\"{class}\">{verdict}</p>\n",
            title = escape_html(&self.title()),
            verdict = escape_html(&self.verdict()),
        );
        for line in remarks.iter().chain(&self.settings()) {
            html.push_str(&format!("<p class=\"notice\">{}</p>\n", escape_html(line)));
        }
        for table in self.tables() {
            let notes = table.notes.iter().map(|note| format!("<p>{}</p>\n", escape_html(note)));
            let notes = notes.collect::<String>();
            html.push_str(&format!("<h2>{}</h2>\n{notes}", escape_html(&table.caption)));
            html.push_str(&to_html(&table));
        }
        html.push_str(
            "<h2>All series</h2>\n<p>Each line shows the runs of a series on one machine from left to right, on a \
             logarithmic scale of its own. Vertical marks are change points.</p>\n\
             <div class=\"scroll\"><table>\n<thead><tr><th>Series</th><th class=\"num\">Runs</th>\
             <th class=\"num\">CPU seconds</th><th></th><th class=\"num\">Memory (MB)</th><th></th>\
             <th class=\"num\">Hausdorff (%)</th></tr></thead>\n<tbody>\n",
        );
        for index in 0..self.tracks.len() {
            html.push_str(&self.series_row(index));
        }
        html + "</tbody>\n</table></div>\n</main>\n</body>\n</html>\n"
    }

    fn title(&self) -> String {
        let series = counted(self.tracks.len(), "series", "series");
        format!("History: {}, {series}", counted(self.runs.len(), "run", "runs"))
    }

    /// What the newest run brought, in one sentence.
    fn verdict(&self) -> String {
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
        settings.dedup();
        let line = |[machine, conditions]: [&str; 2]| {
            format!("{machine}; {conditions}: compared with itself alone")
        };
        if settings.len() > 1 { settings.into_iter().map(line).collect() } else { vec![] }
    }

    fn tables(&self) -> Vec<Table> {
        let all = || self.change_points.iter().chain(&self.changes);
        let kinds: [(&str, Vec<&Change>); 3] = [
            ("Regressions of the newest run", self.news().collect()),
            ("Change points of seconds and memory", self.change_points.iter().collect()),
            ("Results that changed", all().filter(|c| is_exact(c)).collect()),
        ];
        kinds.into_iter().filter(|(_, changes)| !changes.is_empty()).map(table).collect()
    }

    fn series_row(&self, index: usize) -> String {
        let track = &self.tracks[index];
        let Some((_, last)) = track.points.last() else { return String::new() };
        let lost = if last.status.is_ok() { String::new() } else { format!(" ({})", last.status) };
        let mut row = format!(
            "<tr><th scope=\"row\">{}{lost}</th><td class=\"num\">{}</td>",
            escape_html(&track.name()),
            track.points.len()
        );
        for (what, of) in NOISY {
            let unit = if what == "bytes" { 1e-6 } else { 1.0 };
            let now = of(last).map_or("–".to_owned(), |value| significant(unit * value, 3));
            let marks: Vec<usize> = (self.change_points.iter())
                .filter(|change| change.track == index && change.what == what)
                .map(|change| change.run)
                .collect();
            let line = sparkline(track, of, &marks);
            row.push_str(&format!("<td class=\"num\">{now}</td><td>{line}</td>"));
        }
        let error = last.hausdorff.map_or("–".to_owned(), |e| significant(100.0 * e, 3));
        row + &format!("<td class=\"num\">{error}</td></tr>\n")
    }
}

fn is_exact(change: &Change) -> bool {
    NOISY.iter().all(|(what, _)| *what != change.what)
}

fn table((caption, changes): (&str, Vec<&Change>)) -> Table {
    let row = |change: &&Change| {
        let text = |value: &serde_json::Value| match value.as_str() {
            Some(text) => text.to_owned(),
            None => value.as_f64().map_or("–".to_owned(), |number| significant(number, 4)),
        };
        let size = change.ratio.map_or(String::new(), percent);
        let meaning = match (change.shared, change.worse) {
            (true, _) => "most series: the machine or the compiler",
            (false, true) => "worse",
            (false, false) => "",
        };
        let commits = [&change.last_before, &change.first_after].map(|run| short(&run.commit));
        let cells = [
            change.first_after.date.clone(),
            commits.join(".."),
            change.series.clone(),
            change.what.to_owned(),
            format!("{} → {}", text(&change.from), text(&change.to)),
            size,
        ];
        let mut cells: Vec<Cell> = cells.into_iter().map(Cell::new).collect();
        cells.push(Cell { best: change.worse && !change.shared, ..Cell::new(meaning) });
        Row { cells, starts_group: false }
    };
    let left = changes.len().saturating_sub(MOST_ROWS);
    Table {
        caption: format!("{caption}: {}", changes.len()),
        notes: if left > 0 { vec![format!("{left} more are in the JSON.")] } else { vec![] },
        columns: ["run", "commits", "series", "what", "change", "size", ""]
            .map(Column::text)
            .into(),
        rows: changes.iter().take(MOST_ROWS).map(row).collect(),
    }
}

/// The values of a track as a small line; one unit of the drawing is a pixel.
fn sparkline(track: &Track<'_>, of: fn(&super::Point) -> Option<f64>, marks: &[usize]) -> String {
    const SIZE: [f64; 2] = [190.0, 36.0];
    /// A range below 10 % is drawn as 10 %: noise of a thousandth must not look like mountains.
    const LEAST_RANGE: f64 = 0.1;
    let values: Vec<(usize, f64)> =
        measured(track, of).into_iter().map(|(run, value)| (run, value.ln())).collect();
    let Some(&(first, _)) = values.first() else { return String::new() };
    let mut sorted: Vec<f64> = values.iter().map(|(_, value)| *value).collect();
    sorted.sort_by(f64::total_cmp);
    // The 98 % in the middle: one outlier must not flatten all others. It is cut off.
    let [low, high] =
        [sorted.len() / 100, sorted.len() - 1 - sorted.len() / 100].map(|k| sorted[k]);
    let (low, range) = (low.min(0.5 * (low + high - LEAST_RANGE)), (high - low).max(LEAST_RANGE));
    let last = values[values.len() - 1].0.max(first + 1);
    let x = |run: usize| (SIZE[0] - 2.0) * (run - first) as f64 / (last - first) as f64 + 1.0;
    let y = |value: f64| 2.0 + (SIZE[1] - 4.0) * (1.0 - ((value - low) / range).clamp(0.0, 1.0));
    let points: Vec<String> =
        values.iter().map(|&(run, value)| format!("{:.0} {:.0}", x(run), y(value))).collect();
    let marks = marks.iter().map(|&run| format!("M{:.0} 0V{}", x(run), SIZE[1]));
    format!(
        "<svg width=\"{}\" height=\"{}\" aria-hidden=\"true\"><path class=\"worse\" d=\"{}\"/>\
         <path d=\"M{}\"/></svg>",
        SIZE[0],
        SIZE[1],
        marks.collect::<String>(),
        points.join("L")
    )
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
