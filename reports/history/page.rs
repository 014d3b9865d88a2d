//! What was found as a page: one file, without a script, that opens without a network.

use super::sparkline::{Mark, sparkline};
use super::text::{percent, short};
use super::{Figures, Findings, Quantity};
use crate::text::{counted, escape_html, grouped, significant};

/// The look of the sparklines; the rest is that of the report.
const STYLE: &str = "
td.spark { padding: .1rem .4rem; }
svg.spark { display: block; }
svg.spark path { fill: none; }
svg.spark .line { stroke: var(--link); stroke-width: 1.3; }
svg.spark .up { stroke: var(--bad); stroke-width: 2; }
svg.spark .shared { stroke: var(--dim); stroke-dasharray: 1 3; }
svg.spark .down { stroke: rgb(var(--good)); stroke-width: 2; stroke-dasharray: 3 2; }
.worse { color: var(--bad); font-weight: 600; }
.series td, .series th { vertical-align: middle; }
.series thead th { position: static; }
ul.changes { padding-left: 1.2rem; max-width: 75rem; }
ul.changes li { margin: .25rem 0; overflow-wrap: anywhere; }
@media print { .scroll { contain: none; } }
";

/// More steps than this stay folded away.
const OPEN: usize = 30;

impl Findings<'_> {
    /// The history as a page. `remarks` are what its reader must know, such as files that are damaged.
    pub fn to_html(&self, remarks: &[String]) -> String {
        let title = self.title();
        let style = include_str!("../page/style.css");
        let mut html =
            String::from("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
        html.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
        html.push_str("<meta name=\"color-scheme\" content=\"light dark\">\n");
        html.push_str(&format!("<title>{}</title>\n", escape_html(&title)));
        html.push_str(&format!("<style>\n{style}{STYLE}</style>\n</head>\n<body>\n"));
        html.push_str(&self.head(&title));
        html.push_str("<main>\n");
        for remark in remarks {
            html.push_str(&format!("<p class=\"notice\">{}</p>\n", escape_html(remark)));
        }
        html.push_str(&self.verdict_html());
        html.push_str(&self.steps_html());
        html.push_str(&self.changes_html());
        html.push_str(&self.series_html());
        html.push_str(&self.groups_html());
        html.push_str("</main>\n</body>\n</html>\n");
        html
    }

    fn head(&self, title: &str) -> String {
        let ends = self.nights.first().zip(self.nights.last());
        let mut facts: Vec<String> = Vec::new();
        if let Some((first, last)) = ends {
            facts.push(format!("{} to {}", first.date, last.date));
            facts.push(format!("newest commit {}", short(&last.commit)));
            facts.push(format!("medial {}", last.version));
            facts.push(last.machine.clone());
        }
        let facts = facts.iter().map(|fact| format!("<li>{}</li>", escape_html(fact)));
        format!(
            "<header>\n<h1>{}</h1>\n<ul class=\"facts\">{}</ul>\n<nav aria-label=\"Sections\">\
             <a href=\"#steps\">Steps</a> <a href=\"#changes\">Results that changed</a> \
             <a href=\"#series\">All series</a> <a href=\"#groups\">Machines and conditions</a></nav>\n</header>\n",
            escape_html(title),
            facts.collect::<String>()
        )
    }

    fn verdict_html(&self) -> String {
        let (sentence, lines) = self.verdict();
        if lines.is_empty() {
            return format!("<p class=\"notice\">{}</p>\n", escape_html(&sentence));
        }
        let items = lines.iter().map(|line| format!("<li>{}</li>\n", escape_html(line)));
        format!(
            "<p class=\"worse\">{}</p>\n<ul class=\"changes\">\n{}</ul>\n",
            escape_html(&sentence),
            items.collect::<String>()
        )
    }

    fn steps_html(&self) -> String {
        let mut html =
            String::from("<h2 id=\"steps\">Steps of seconds and memory, the newest first</h2>\n");
        if !self.shared.is_empty() {
            let told = self.shared.iter().map(|event| escape_html(&self.told_shared(event)));
            let told: String = told.map(|event| format!("<li>{event}</li>\n")).collect();
            html.push_str(&format!("<ul class=\"notice\">\n{told}</ul>\n"));
        }
        let rows: Vec<String> = self.steps.iter().filter(|step| !step.shared).map(|step| {
            let class = if step.is_worse() { "num worse" } else { "num" };
            let [night, range, name, what, size, interval] =
                self.step_cells(step).map(|cell| escape_html(&cell));
            format!(
                "<tr><td>{night}</td><td><code>{range}</code></td><td>{name}</td><td>{what}</td>\
                 <td class=\"{class}\">{size}</td><td class=\"num\">{interval}</td></tr>\n"
            )
        }).collect();
        let head = "<tr><th scope=\"col\">Night</th><th scope=\"col\">Commits</th><th scope=\"col\">Series</th>\
                    <th scope=\"col\">What</th><th scope=\"col\" class=\"num\">Size</th>\
                    <th scope=\"col\" class=\"num\">Between (95 %)</th></tr>";
        html.push_str(&folded(&rows, head, "No series stepped."));
        html
    }

    fn changes_html(&self) -> String {
        let mut html =
            String::from("<h2 id=\"changes\">Results that changed, the newest first</h2>\n");
        if self.changes.is_empty() {
            return html + "<p>None: every series gave the same result in all its nights.</p>\n";
        }
        html.push_str("<ul class=\"changes\">\n");
        for night in self.changed_nights() {
            html.push_str(&format!("<li>{}</li>\n", escape_html(&night)));
        }
        html.push_str("</ul>\n");
        let worse: Vec<_> = self.changes.iter().filter(|change| change.is_worse()).collect();
        if !worse.is_empty() {
            html.push_str(&format!(
                "<details><summary>{} for the worse, one by one</summary>\n<ul class=\"changes\">\n",
                counted(worse.len(), "change", "changes")
            ));
            for change in worse {
                html.push_str(&format!("<li>{}</li>\n", escape_html(&self.told_change(change))));
            }
            html.push_str("</ul>\n</details>\n");
        }
        html
    }

    fn series_html(&self) -> String {
        let mut html = String::from(
            "<h2 id=\"series\">All series, the worst first</h2>\n<p>Each line has the nights of one series on one machine \
             from left to right, on a logarithmic scale of its own; the solid mark is a step up, the dotted one a step that most series made, the dashed one a step \
             down. Worst is what lost most beside its own best.</p>\n<div class=\"scroll\"><table class=\"series\">\n\
             <thead><tr><th scope=\"col\">Series</th><th scope=\"col\" class=\"num\">Nights</th>\
             <th scope=\"col\" class=\"num\">CPU seconds</th><th scope=\"col\">over the nights</th>\
             <th scope=\"col\" class=\"num\">Memory</th><th scope=\"col\">over the nights</th>\
             <th scope=\"col\" class=\"num\">Hausdorff</th><th scope=\"col\">over the nights</th></tr></thead>\n<tbody>\n",
        );
        for track in self.worst_first() {
            html.push_str(&self.row(track));
        }
        html + "</tbody>\n</table></div>\n"
    }

    fn row(&self, index: usize) -> String {
        let track = &self.tracks[index];
        let Some(&(night, last)) = track.nights.last() else { return String::new() };
        let group = match self.groups.len() {
            0 | 1 => String::new(),
            _ => format!(" <small>group {}</small>", track.group + 1),
        };
        let old =
            night + 1 < self.nights.len() && self.groups[track.group].nights.last() != Some(&night);
        let seen = match old {
            true => format!(" <small>until {}</small>", self.nights[night].date),
            false => String::new(),
        };
        let status = match last.status.has_result() {
            true => String::new(),
            false => format!(" <span class=\"status\">{}</span>", last.status),
        };
        let topology = match self.lost(index) && last.topology == Some(false) {
            true => " <span class=\"status\">topology lost</span>",
            false => "",
        };
        let mut html = format!(
            "<tr><th scope=\"row\">{}{group}{seen}{status}{topology}</th><td class=\"num\">{}</td>",
            escape_html(&track.name.to_string()),
            track.nights.len()
        );
        let seconds = last.seconds.map(|seconds| significant(seconds, 3));
        let memory = last.bytes.map(|bytes| format!("{} MB", significant(bytes as f64 / 1e6, 3)));
        for (quantity, now) in Quantity::ALL.into_iter().zip([seconds, memory]) {
            let noisy = |figures: &Figures| quantity.of(figures);
            let steps = self.steps_of(index, quantity);
            let marks = steps.iter().map(|step| (step.night, step.step.ratio, step.shared));
            html.push_str(&self.cells(index, &noisy, now, &marks.collect::<Vec<_>>()));
        }
        let error = last.hausdorff.map(|error| format!("{} %", significant(100.0 * error, 3)));
        let changes = self.changes.iter().filter(|change| change.track == index);
        let marks = changes.filter_map(|change| {
            let ratio = change.differences.iter().find(|d| d.what == "hausdorff")?.ratio?;
            Some((change.night, ratio, false))
        });
        html.push_str(&self.cells(index, &|f| f.hausdorff, error, &marks.collect::<Vec<_>>()));
        html + "</tr>\n"
    }

    /// A figure as it is now, and its line with marks: night, ratio, whether most series did the same.
    fn cells(
        &self,
        index: usize,
        of: &dyn Fn(&Figures) -> Option<f64>,
        now: Option<String>,
        marks: &[(usize, f64, bool)],
    ) -> String {
        let known: Vec<(usize, f64)> = self.tracks[index]
            .nights
            .iter()
            .filter_map(|&(night, figures)| Some((night, of(figures)?)))
            .collect();
        let values: Vec<f64> = known.iter().map(|(_, value)| *value).collect();
        let placed: Vec<Mark> = marks
            .iter()
            .filter_map(|&(night, ratio, shared)| {
                let at = known.iter().position(|(other, _)| *other == night)?;
                Some(Mark { at, up: ratio > 1.0, shared })
            })
            .collect();
        let told = marks
            .iter()
            .map(|&(night, ratio, _)| format!("{} {}", self.nights[night].date, percent(ratio)));
        let title = match marks.len() {
            0 => "no step".to_owned(),
            _ => told.collect::<Vec<_>>().join("; "),
        };
        let now = escape_html(&now.unwrap_or_else(|| "none".to_owned()));
        let line =
            if values.is_empty() { String::new() } else { sparkline(&values, &placed, &title) };
        format!("<td class=\"num\">{now}</td><td class=\"spark\">{line}</td>")
    }

    fn groups_html(&self) -> String {
        let mut html = String::from(
            "<h2 id=\"groups\">Machines and conditions</h2>\n<p>Nights of different machines or conditions, and of \
             different contents of a mesh, are never compared.</p>\n<div class=\"scroll\"><table>\n<thead><tr>\
             <th scope=\"col\">Group</th><th scope=\"col\">Machine</th><th scope=\"col\">Conditions</th>\
             <th scope=\"col\" class=\"num\">Nights</th><th scope=\"col\">From</th><th scope=\"col\">To</th></tr></thead>\n<tbody>\n",
        );
        for (index, group) in self.groups.iter().enumerate() {
            let date = |night: Option<&usize>| night.map_or("", |&night| &self.nights[night].date);
            html.push_str(&format!(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"num\">{}</td><td>{}</td><td>{}</td></tr>\n",
                index + 1,
                escape_html(&group.machine),
                escape_html(&group.conditions),
                grouped(group.nights.len() as u64),
                date(group.nights.first()),
                date(group.nights.last())
            ));
        }
        html + "</tbody>\n</table></div>\n"
    }
}

/// Rows as a table, the later ones folded away.
fn folded(rows: &[String], head: &str, none: &str) -> String {
    if rows.is_empty() {
        return format!("<p>{none}</p>\n");
    }
    let table = |rows: &[String]| {
        let rows = rows.concat();
        format!(
            "<div class=\"scroll\"><table>\n<thead>{head}</thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n"
        )
    };
    let (open, rest) = rows.split_at(rows.len().min(OPEN));
    let mut html = table(open);
    if !rest.is_empty() {
        let summary = counted(rest.len(), "earlier step", "earlier steps");
        html.push_str(&format!(
            "<details><summary>{summary}</summary>\n{}</details>\n",
            table(rest)
        ));
    }
    html
}
