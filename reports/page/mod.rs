//! `index.html`: one page that holds everything and opens without a network.
//!
//! Plots are inline SVG, the style sheet and the script are our own. Without the script the page
//! still shows everything but what stands in it compressed: rows and meshes beyond the first ones,
//! which the files beside it hold as well. The script sorts, filters, opens details, and answers
//! questions about points of the plots.

mod details;
mod html;
mod meshes;
mod overview;
pub(crate) mod packed;
mod reference;
mod results;

pub(crate) use self::html::table as html_table;

use crate::comparison::Comparison;
use crate::header::{Header, RunNote};
use crate::plots::Plot;
use crate::record::Machine;
use crate::summary::CountSummary;
use crate::tables::Table;
use crate::text::{counted, escape_html};

/// Everything that the page is made of.
pub(crate) struct Page<'a> {
    pub(crate) header: &'a Header,
    pub(crate) comparison: &'a Comparison<'a>,
    pub(crate) summaries: &'a [CountSummary],
    /// Which method for which purpose, and method against method.
    pub(crate) purposes: &'a [Table],
    /// How time and memory grow with the input.
    pub(crate) scaling: Option<&'a Table>,
    pub(crate) overview_plots: &'a [Plot],
    /// One for each method with a scalar of its own.
    pub(crate) native_plots: &'a [Plot],
    /// In the order of the meshes.
    pub(crate) meshes: &'a [MeshPart],
    pub(crate) summary_tables: &'a [Table],
    /// Whether the first of them is that of equal errors.
    pub(crate) has_equal_error: bool,
}

/// What the page shows of one mesh.
pub(crate) struct MeshPart {
    /// Name of its files.
    pub(crate) stem: String,
    pub(crate) table: Table,
    pub(crate) plots: Vec<Plot>,
    /// The address of a picture of its results, and what it shows.
    pub(crate) picture: Option<(String, String)>,
    pub(crate) view: Option<MeshView>,
}

/// A 3D view of a mesh's results.
pub(crate) struct MeshView {
    pub(crate) name: String,
    /// Its file, relative to the page.
    pub(crate) file: String,
    /// Its text, where the page itself holds it.
    pub(crate) text: Option<String>,
}

impl Page<'_> {
    /// The page as HTML.
    pub(crate) fn to_html(&self) -> String {
        let title = self.title();
        let mut html = String::new();
        html.push_str("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
        html.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
        html.push_str("<meta name=\"color-scheme\" content=\"light dark\">\n");
        html.push_str(&format!("<title>{}</title>\n", escape_html(title)));
        html.push_str(&format!(
            "<style>\n{}</style>\n</head>\n<body>\n",
            include_str!("style.css")
        ));
        html.push_str(&self.head(title));
        html.push_str("<main>\n");
        html.push_str(&self.notices());
        if self.comparison.measured() > 0 {
            html.push_str(&overview::section(self));
        }
        if !self.comparison.entries.is_empty() {
            html.push_str(&results::section(self));
            html.push_str(&meshes::section(self));
        }
        html.push_str(&reference::warnings(self));
        html.push_str(&reference::methods(self.header, self.comparison));
        html.push_str(reference::definitions().as_str());
        html.push_str(&reference::files(self));
        html.push_str("</main>\n");
        if self.meshes.iter().any(|mesh| mesh.view.is_some()) {
            html.push_str(&packed::packed(
                Some("three"),
                include_str!("vendor/three.module.min.js"),
            ));
        }
        html.push_str(&format!(
            "<script>\n\"use strict\";\n{}{}{}{}{}</script>\n</body>\n</html>\n",
            include_str!("packed.js"),
            include_str!("table.js"),
            include_str!("plots.js"),
            include_str!("view3d.js"),
            include_str!("script.js")
        ));
        html
    }

    fn title(&self) -> &str {
        match self.header.title.as_str() {
            "" => "Simplification of the medial axis: comparison",
            title => title,
        }
    }

    /// Title, what was run, and the way to the sections.
    fn head(&self, title: &str) -> String {
        let comparison = self.comparison;
        let mut facts = vec![format!(
            "{} on {} at {}",
            counted(comparison.series.len(), "method", "methods"),
            counted(comparison.meshes.len(), "mesh", "meshes"),
            counted(comparison.levels.len(), "level", "levels"),
        )];
        let run = self.header.runs.last();
        facts.extend(run.and_then(|run| run.date.clone()));
        facts.extend(
            run.filter(|run| !run.version.is_empty()).map(|run| format!("medial {}", run.version)),
        );
        let recorded = || comparison.entries.first().map(|entry| &entry.record.machine);
        let machine = run.and_then(|run| run.machine.as_ref()).or_else(recorded);
        let machine = machine.map(Machine::to_string);
        facts.extend(machine.filter(|text| !text.is_empty()));
        let facts: Vec<String> =
            facts.iter().map(|fact| format!("<li>{}</li>", escape_html(fact))).collect();
        let mut html = format!("<header>\n<h1>{}</h1>\n", escape_html(title));
        html.push_str(&format!("<ul class=\"facts\">{}</ul>\n", facts.concat()));
        html.push_str(&self.how());
        html.push_str("<nav>");
        if comparison.measured() > 0 {
            html.push_str("<a href=\"#overview\">Overview</a>");
        }
        if !comparison.entries.is_empty() {
            html.push_str(
                "<a href=\"#results\">Results</a><a href=\"#meshes\">Meshes, pictures</a>",
            );
        }
        html.push_str("<a href=\"#definitions\">Definitions</a>");
        html.push_str("<a href=\"#files\">Files</a></nav>\n");
        html.push_str("</header>\n");
        html
    }

    /// The commands that made the records, the last one in sight, and the study.
    fn how(&self) -> String {
        let mut html = String::new();
        let runs = &self.header.runs;
        if let Some(run) = runs.last().filter(|run| !run.command.is_empty()) {
            let command = escape_html(&run.command);
            html.push_str(&format!("<pre class=\"command\"><code>{command}</code></pre>\n"));
        }
        if let [earlier @ .., _] = runs.as_slice()
            && !earlier.is_empty()
        {
            let line = |run: &RunNote| {
                let date = run.date.as_deref().unwrap_or("no date");
                let build: String = run.binary_hash.chars().take(8).collect();
                let what =
                    format!("{date}, medial {} (build {build}): {}", run.version, run.command);
                format!("<li><code>{}</code></li>", escape_html(&what))
            };
            let lines: String = earlier.iter().map(line).collect();
            html.push_str(&format!(
                "<details><summary>{} that added records</summary><ul>{lines}</ul></details>\n",
                counted(earlier.len(), "earlier run", "earlier runs")
            ));
        }
        if let Some(study) = &self.header.study {
            let study = study.lines().map(escape_html).collect::<Vec<_>>().join("\n");
            html.push_str(&format!(
                "<details><summary>The study that was asked last</summary>\
                 <pre class=\"command\"><code>{study}</code></pre></details>\n"
            ));
        }
        html
    }

    /// What must be read first: that nothing was measured, failures, cautions.
    fn notices(&self) -> String {
        let mut html = String::new();
        let comparison = self.comparison;
        if comparison.measured() == 0 {
            let why = if comparison.entries.is_empty() {
                "There is no record.".to_owned()
            } else {
                format!(
                    "None of the {} led to a result that was evaluated; the reasons stand below.",
                    counted(comparison.entries.len(), "run", "runs")
                )
            };
            html.push_str(&format!(
                "<p class=\"notice bad\" role=\"alert\"><strong>Nothing was measured.</strong> {}</p>\n",
                escape_html(&why)
            ));
        }
        let cautions = self.header.notes.iter().cloned().chain(comparison.cautions());
        let cautions: Vec<String> =
            cautions.map(|note| format!("<li>{}</li>", escape_html(&note))).collect();
        if !cautions.is_empty() {
            html.push_str(&format!("<ul class=\"notice\">{}</ul>\n", cautions.concat()));
        }
        html
    }
}
