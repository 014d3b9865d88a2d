//! The overview: which method, how many spheres, what error.

use std::collections::BTreeMap;

use crate::metric::{
    BELOW_30, EPSILON, HAUSDORFF, MEAN_ERROR, MIN_ANGLE, Metric, SPIKES, TOTAL_SECONDS,
};
use crate::page::{Page, html, reference};
use crate::record::Status;
use crate::summary::{CountSummary, SeriesSummary, best, headlines};
use crate::tables::Table;
use crate::text::{counted, escape_html, grouped};

/// The means that the matrix can show, in the order of its buttons.
static SHOWN: [&Metric; 7] =
    [&HAUSDORFF, &EPSILON, &MEAN_ERROR, &MIN_ANGLE, &BELOW_30, &SPIKES, &TOTAL_SECONDS];

/// A longer table is folded.
const MANY_ROWS: usize = 48;

/// A table of method against method with more rows is folded.
const MANY_METHODS: usize = 14;

/// Headlines, the matrix of means, the fewest spheres for an error, failures, and plots.
pub(crate) fn section(page: &Page<'_>) -> String {
    let mut html = String::from("<section id=\"overview\">\n<h2>Overview</h2>\n");
    let compared: Vec<&CountSummary> =
        page.summaries.iter().filter(|summary| !summary.rows.is_empty()).collect();
    let lines: Vec<String> = headlines(page.comparison, page.summaries)
        .iter()
        .map(|line| format!("<li>{}</li>", escape_html(line)))
        .collect();
    let mut purposes = page.purposes.iter();
    if let Some(table) = purposes.next() {
        html.push_str(&titled(table, false));
    }
    html.push_str(&way_to_pictures(page));
    html.push_str(&homes(page));
    if !lines.is_empty() {
        html.push_str(&format!("<ul class=\"headlines\">{}</ul>\n", lines.concat()));
    }
    let is_shown = |table: &&Table| !table.rows.is_empty();
    // The most telling table, where it was asked for, comes before the means.
    let (first, rest) = page.summary_tables.split_at(usize::from(page.has_equal_error));
    for table in first.iter().filter(is_shown) {
        html.push_str(&titled(table, table.rows.len() > MANY_ROWS));
    }
    if !compared.is_empty() {
        html.push_str(&matrices(page, &compared));
    }
    for table in purposes {
        html.push_str(&titled(table, table.rows.len() > MANY_METHODS));
    }
    html.push_str(&failures(page));
    for table in rest.iter().filter(is_shown) {
        html.push_str(&titled(table, table.rows.len() > MANY_ROWS));
    }
    if let Some(table) = page.scaling {
        html.push_str(&titled(table, table.rows.len() > MANY_ROWS));
    }
    if !page.overview_plots.is_empty() {
        html.push_str("<h3>Plots over all meshes</h3>\n");
        html.push_str(&html::plots(page.overview_plots));
    }
    if !page.native_plots.is_empty() {
        html.push_str("<details><summary>Plots of each method on its own axis</summary>\n");
        html.push_str(&html::plots(page.native_plots));
        html.push_str("</details>\n");
    }
    html.push_str("</section>\n");
    html
}

/// What each method is for, as far as the methods say it.
fn homes(page: &Page<'_>) -> String {
    let notes = reference::ran(page.header, page.comparison).filter(|note| !note.home.is_empty());
    let items: Vec<String> = notes
        .map(|note| {
            let (id, home) = (escape_html(&note.id), escape_html(&note.home));
            format!("<dt>{id}</dt><dd>{home}</dd>\n")
        })
        .collect();
    if items.is_empty() {
        return String::new();
    }
    format!(
        "<details><summary>What each method is for</summary>\n<dl>\n{}</dl>\n</details>\n",
        items.concat()
    )
}

/// Where the first picture is: it stands below all tables.
fn way_to_pictures(page: &Page<'_>) -> String {
    let Some(first) = page.meshes.iter().find(|mesh| mesh.picture.is_some()) else {
        return String::new();
    };
    let way = format!(
        "<p>What the results look like: <a href=\"#mesh-{}\">pictures and 3D views</a> of each mesh.</p>\n",
        escape_html(&first.stem)
    );
    // Linked or held by the page: the second copy of a held one is small beside all.
    let picture = first.picture.as_ref().map_or(String::new(), |(address, words)| {
        let words = escape_html(words);
        format!(
            "<figure class=\"strip\"><a href=\"#mesh-{}\"><img src=\"{address}\" alt=\"{words}\"></a></figure>\n",
            escape_html(&first.stem)
        )
    });
    way + &picture
}

/// A table with its caption and its notes but the first, which the page's head already tells.
fn titled(table: &Table, folded: bool) -> String {
    let caption = escape_html(&table.caption);
    let notes: Vec<String> = table
        .notes
        .iter()
        .skip(1)
        .map(|note| format!("<p class=\"note\">{}</p>\n", escape_html(note)))
        .collect();
    let body = format!("{}{}", html::table(table), notes.concat());
    if folded {
        format!("<details><summary>{caption}: all columns</summary>\n{body}</details>\n")
    } else {
        format!("<h3>{caption}</h3>\n{body}")
    }
}

/// One matrix of methods by sphere counts for each metric; buttons choose which one is seen.
fn matrices(page: &Page<'_>, summaries: &[&CountSummary]) -> String {
    let mut html = String::from("<div class=\"chooser\">\n");
    for (index, metric) in SHOWN.iter().enumerate() {
        let checked = if index == 0 { " checked" } else { "" };
        html.push_str(&format!(
            "<input type=\"radio\" name=\"metric\" id=\"metric-{index}\"{checked}>\
             <label for=\"metric-{index}\">{}</label>\n",
            escape_html(metric.title)
        ));
    }
    for metric in SHOWN {
        html.push_str(&matrix(page, summaries, metric));
    }
    html.push_str(
        "<p class=\"note\">Each method is averaged over one set of meshes of its own for all \
         counts. In parentheses, with their number: means over fewer meshes than all, which do not \
         read beside the others; the ratios in the table of all columns do. The darker, the \
         better among means over all meshes; bold: the best. A dash: the count was reached on too \
         few meshes, see the failures and the remarks.</p>\n</div>\n",
    );
    html
}

fn matrix(page: &Page<'_>, summaries: &[&CountSummary], metric: &Metric) -> String {
    let mut html = format!(
        "<div class=\"choice\"><h3>{}, {} mean</h3>\n<div class=\"scroll\"><table class=\"matrix\">\n\
         <thead><tr><th scope=\"col\">method</th>",
        escape_html(&metric.heading()),
        metric.mean.word()
    );
    for summary in summaries {
        html.push_str(&format!(
            "<th scope=\"col\" class=\"num\">{} <small>spheres, {}</small></th>",
            grouped(summary.count as u64),
            counted(summary.meshes, "mesh", "meshes")
        ));
    }
    html.push_str("<th scope=\"col\">topology right</th><th scope=\"col\">not as asked</th></tr></thead>\n<tbody>\n");
    let at_counts =
        |series: usize| summaries.iter().any(|s| s.rows.iter().any(|row| row.series == series));
    let series = page.comparison.series.iter().enumerate();
    for (series, label) in series.filter(|&(series, _)| at_counts(series)) {
        html.push_str(&format!("<tr><th scope=\"row\">{}</th>", html::series(series, label)));
        let rows =
            || summaries.iter().filter_map(|s| s.rows.iter().find(|row| row.series == series));
        for summary in summaries {
            html.push_str(&matrix_cell(summary, series, metric));
        }
        let (right, known) =
            rows().fold((0, 0), |sum, row| (sum.0 + row.topology.0, sum.1 + row.topology.1));
        let sum = |of: fn(&SeriesSummary) -> usize| rows().map(of).sum::<usize>();
        let kinds = [
            (sum(|row| row.failed), "failed"),
            (sum(|row| row.missed), "off count"),
            (sum(|row| row.unsupported), "unsupported"),
        ];
        let kinds = kinds.iter().filter(|(number, _)| *number > 0);
        let kinds: Vec<String> = kinds.map(|(number, kind)| format!("{number} {kind}")).collect();
        let trouble = match kinds.is_empty() {
            true => "none".to_owned(),
            false => format!("{} of {}", kinds.join(", "), sum(|row| row.asked)),
        };
        let topology = if known > 0 { format!("{right} of {known}") } else { "–".to_owned() };
        html.push_str(&format!("<td>{topology}</td><td>{trouble}</td></tr>\n"));
    }
    html.push_str("</tbody>\n</table></div></div>\n");
    html
}

fn matrix_cell(summary: &CountSummary, series: usize, metric: &Metric) -> String {
    let row = summary.rows.iter().find(|row| row.series == series);
    let Some((row, mean)) = row.and_then(|row| Some((row, row.mean(metric)?))) else {
        return "<td class=\"num\">–</td>".to_owned();
    };
    let text = metric.format_mean(mean);
    if !summary.is_whole_of(row, metric) {
        return format!("<td class=\"num\">({text}; <small>{}</small>)</td>", row.over(metric));
    }
    let shade = (100.0 * goodness(summary, metric, mean)).round();
    let text = match best(summary, metric) {
        Some(best) if metric.format_mean(best) == text => format!("<strong>{text}</strong>"),
        _ => text,
    };
    format!("<td class=\"num heat\" style=\"--heat:{shade}%\">{text}</td>")
}

/// 1 for the best mean of the column, 0 for the worst, on the metric's own scale.
fn goodness(summary: &CountSummary, metric: &Metric, mean: f64) -> f64 {
    let lay = |value: f64| match metric.mean {
        crate::metric::Mean::Geometric { floor } => value.max(floor).ln(),
        crate::metric::Mean::Arithmetic => value,
    };
    let compared = summary.rows.iter().filter(|row| summary.is_whole_of(row, metric));
    let laid: Vec<f64> = compared.filter_map(|row| row.mean(metric)).map(lay).collect();
    let low = laid.iter().copied().fold(f64::INFINITY, f64::min);
    let high = laid.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if high <= low {
        return 0.0;
    }
    let share = (lay(mean) - low) / (high - low);
    if metric.better.prefers(0.0, 1.0) { 1.0 - share } else { share }
}

/// Runs without the result that was asked, gathered by method, status and reason.
fn failures(page: &Page<'_>) -> String {
    let mut groups: BTreeMap<(usize, Status, &str), Vec<String>> = BTreeMap::new();
    for entry in &page.comparison.entries {
        let record = entry.record;
        if !record.status.is_ok() {
            let reason = match record.status {
                // Each such reason has its own number.
                Status::OtherCount => "another number of spheres than asked: not compared",
                Status::BoundMissed => {
                    "no level that was tried keeps the error; the results name the lowest"
                }
                _ => record.reason.as_deref().unwrap_or("no reason was given"),
            };
            let level = crate::comparison::level_label(record.simplify.level);
            groups
                .entry((entry.series, record.status, reason))
                .or_default()
                .push(format!("{} ({level})", page.comparison.meshes[entry.mesh]));
        }
    }
    if groups.is_empty() {
        return String::new();
    }
    let runs = groups.values().map(Vec::len).sum();
    let mut html = format!(
        "<details class=\"failures\"{}><summary>{} without the result that was asked, of {}</summary>\n\
         <div class=\"scroll\"><table>\n<thead><tr><th>method</th><th>status</th><th>reason</th>\
         <th class=\"num\">runs</th><th>meshes (spheres asked)</th></tr></thead>\n<tbody>\n",
        if groups.len() > MANY_ROWS / 4 { "" } else { " open" },
        counted(runs, "run", "runs"),
        page.comparison.entries.len()
    );
    for ((series, status, reason), items) in &groups {
        html.push_str(&format!(
            "<tr><td>{}</td><td><span class=\"status {}\">{status}</span></td>\
             <td class=\"wrap\">{}</td><td class=\"num\">{}</td><td class=\"wrap\">{}</td></tr>\n",
            html::series(*series, &page.comparison.series[*series]),
            status.key(),
            escape_html(reason),
            items.len(),
            escape_html(&abridged(items))
        ));
    }
    html.push_str("</tbody>\n</table></div></details>\n");
    html
}

/// The first few of a list; the rows of the results hold them all.
fn abridged(items: &[String]) -> String {
    const SHOWN: usize = 6;
    let mut text = items.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", ");
    if items.len() > SHOWN {
        text.push_str(&format!(" and {} more", items.len() - SHOWN));
    }
    text
}
