//! What explains the numbers: warnings, methods, definitions, files.

use std::collections::BTreeMap;

use crate::comparison::{Comparison, level_label};
use crate::header::{Header, MethodNote};
use crate::metric::COMPARED;
use crate::page::{Page, html};
use crate::tables::warnings as warnings_of;
use crate::text::{counted, escape_html};

/// Every warning once, with the results that it came with.
pub(crate) fn warnings(page: &Page<'_>) -> String {
    let mut groups: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    let mut order = Vec::new();
    for entry in &page.comparison.entries {
        for warning in warnings_of(entry.record) {
            let at = format!(
                "{} on {} ({})",
                page.comparison.series[entry.series],
                page.comparison.meshes[entry.mesh],
                level_label(entry.record.simplify.level)
            );
            let places = groups.entry(warning).or_default();
            if places.is_empty() {
                order.push(warning);
            }
            places.push(at);
        }
    }
    if order.is_empty() {
        return String::new();
    }
    let mut html = String::from("<section id=\"warnings\">\n<h2>Warnings</h2>\n<ul>\n");
    for warning in order {
        let places = &groups[warning];
        html.push_str(&format!(
            "<li>{} <small>{}{}</small></li>\n",
            escape_html(warning),
            escape_html(&places.iter().take(4).cloned().collect::<Vec<_>>().join(", ")),
            if places.len() > 4 {
                format!(" and {} more", places.len() - 4)
            } else {
                String::new()
            }
        ));
    }
    html.push_str("</ul>\n</section>\n");
    html
}

/// The notes of the methods that were run.
pub(crate) fn ran<'a>(
    header: &'a Header,
    comparison: &'a Comparison<'_>,
) -> impl Iterator<Item = &'a MethodNote> {
    header.methods.iter().filter(|note| comparison.methods.contains(&note.id.as_str()))
}

/// Names and citations of the methods that were run, as far as the runner passed them in.
pub(crate) fn methods(header: &Header, comparison: &Comparison<'_>) -> String {
    let items: Vec<String> = ran(header, comparison)
        .map(|note| {
            let home = match note.home.as_str() {
                "" => String::new(),
                home => format!(" At home: {}", escape_html(home)),
            };
            format!(
                "<dt>{}: {}</dt><dd>{}{home} Published level: {}. <cite>{}</cite></dd>\n",
                escape_html(&note.id),
                escape_html(&note.title),
                escape_html(&note.summary),
                escape_html(note.published.trim_end_matches('.')),
                escape_html(&note.citation)
            )
        })
        .collect();
    if items.is_empty() {
        return String::new();
    }
    format!(
        "<section id=\"methods\">\n<h2>Methods</h2>\n<dl>\n{}</dl>\n</section>\n",
        items.concat()
    )
}

/// What each column means.
pub(crate) fn definitions() -> String {
    let mut html = String::from("<section id=\"definitions\">\n<h2>Definitions</h2>\n<dl>\n");
    let others = [
        (
            "asked, spheres",
            "The number of spheres that was asked for, and that of the result. Results compare at \
             equal numbers, reached to within 2 %.",
        ),
        (
            "%",
            "Lengths are percentages of the diagonal of the input's bounding box; results.jsonl \
             and results.csv hold them as fractions.",
        ),
    ];
    for (term, text) in others {
        html.push_str(&format!("<dt>{term}</dt><dd>{text}</dd>\n"));
    }
    for metric in COMPARED {
        html.push_str(&format!(
            "<dt>{}</dt><dd>{} Means over meshes are {}.</dd>\n",
            escape_html(&metric.heading()),
            escape_html(metric.definition),
            metric.mean.word()
        ));
    }
    let others = [
        (
            "substrate, prepare, simplify",
            "The stages of the time: what methods share (samples, Delaunay triangulation, inside \
             test, initial medial mesh) counts for each method that uses it, whoever built it \
             first; then the method's work for all levels; then its work for this level.",
        ),
        (
            "Betti",
            "Betti numbers over Z2 of the medial mesh: components, independent loops, enclosed \
             bubbles. A medial axis has those of its solid: components, total genus, cavities.",
        ),
        (
            "status",
            "ok; unsupported: the method does not do this, an answer rather than a failure; \
             refused: the input was not accepted; failed, panicked, timed out, out of memory: the \
             run ended so; invalid output: what came out is no medial mesh.",
        ),
    ];
    for (term, text) in others {
        html.push_str(&format!("<dt>{term}</dt><dd>{text}</dd>\n"));
    }
    html.push_str("</dl>\n</section>\n");
    html
}

/// The files beside the page.
pub(crate) fn files(page: &Page<'_>) -> String {
    let plots =
        page.overview_plots.len() + page.meshes.iter().map(|m| m.plots.len()).sum::<usize>();
    let link = |path: &str| {
        format!(
            "<a href=\"{}\">{}</a>",
            html::local_link(path).unwrap_or_default(),
            escape_html(path)
        )
    };
    format!(
        "<section id=\"files\">\n<h2>Files</h2>\n<ul>\n\
         <li>{}: the records, one JSON object on each line</li>\n\
         <li>{}: every number of every record, one row for each</li>\n\
         <li>{}, {}: means over meshes; <code>tables/mesh-…</code> for each of {}</li>\n\
         <li><code>plots/</code>: {} as SVG</li>\n</ul>\n</section>\n",
        link("results.jsonl"),
        link("results.csv"),
        link("tables/summary.md"),
        link("tables/summary.tex"),
        counted(page.meshes.len(), "mesh", "meshes"),
        counted(plots, "figure", "figures")
    )
}
