//! A static site: the page of a report, with a page for each method and each mesh.
//!
//! The further pages have no script. Everything is in one folder, with relative links, so it opens from disk and from any
//! static host.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use medial_run::error::FileError;
use medial_run::record::Record;
use medial_run::text::{escape_html, file_stems, grouped};

use crate::comparison::{Comparison, Entry, reached};
use crate::header::{Header, MethodNote, method_pages};
use crate::metric::{CLAIMED_SECONDS, HAUSDORFF, MEAN_ERROR, MIN_ANGLE, Metric, TOTAL_SECONDS};
use crate::pictures::{PictureStrip, strips};
use crate::render::Layout;
use crate::tables::{Table, mesh_table, to_html, topology_word};
use crate::write::{Files, write_report};

/// Writes the site of some records into a folder: the report without medial meshes, and further pages. Pictures and 3D views
/// are copied from the report in `store`. Returns the files.
///
/// # Errors
/// As [`write_report`].
pub fn write_site(
    dir: &Path,
    store: &Path,
    records: &[Record],
    header: &Header,
) -> Result<Vec<PathBuf>, FileError> {
    let comparison = Comparison::new(records);
    let pictures = strips(&comparison);
    let mut files = Files { dir, written: vec![] };
    for file in pictures.values().flat_map(|strip| [strip.file.clone(), strip.view_file()]) {
        // A mesh without pictures has none here either.
        if let Ok(bytes) = fs::read(store.join(&file)) {
            files.write(&file, &bytes)?;
        }
    }
    let header = Header { is_site: true, ..header.clone() };
    let report = write_report(dir, records, &header)?;

    let site = Site {
        comparison: &comparison,
        header: &header,
        stems: file_stems(comparison.meshes.iter().map(String::as_str)),
        pictures: pictures
            .into_iter()
            .filter(|(_, strip)| dir.join(&strip.file).is_file())
            .collect(),
        written: report.iter().filter_map(|path| path.strip_prefix(dir).ok()).collect(),
    };
    for (note, page) in method_pages(&header, &comparison) {
        files.write(&page, site.method_page(note).as_bytes())?;
    }
    for (mesh, stem) in site.stems.iter().enumerate() {
        files.write(&mesh_file(stem), site.mesh_page(mesh).as_bytes())?;
    }
    Ok([report, files.written].concat())
}

const SUBMISSIONS: &str =
    "https://github.com/medial-rs/medial/blob/main/docs/external.md#handing-in-results";

fn mesh_file(stem: &str) -> String {
    format!("mesh-{stem}.html")
}

struct Site<'a> {
    comparison: &'a Comparison<'a>,
    header: &'a Header,
    /// Names of the files of each mesh.
    stems: Vec<String>,
    /// The pictures that are in the folder, by mesh.
    pictures: BTreeMap<usize, PictureStrip>,
    /// The files of the report, relative to the folder.
    written: Vec<&'a Path>,
}

impl Site<'_> {
    /// The page that describes a mesh or a method, by the text of a cell.
    fn link(&self, text: &str) -> Option<String> {
        let comparison = self.comparison;
        if let Some(mesh) = comparison.meshes.iter().position(|mesh| mesh == text) {
            return Some(mesh_file(&self.stems[mesh]));
        }
        let series = comparison.series.iter().position(|series| series == text)?;
        let pages = method_pages(self.header, comparison).into_iter();
        pages.filter(|(note, _)| note.id == comparison.methods[series]).map(|(_, page)| page).next()
    }

    fn page(&self, title: &str, body: &str) -> String {
        let heading = if self.header.title.is_empty() { "all results" } else { &self.header.title };
        let [title, heading, runs] = [title, heading, &self.header.how()].map(escape_html);
        let style = include_str!("page/page.css");
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
             content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
             <title>{title}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n<nav>\
             <a href=\"index.html\">{heading}</a> <a href=\"{SUBMISSIONS}\">Hand in results</a></nav>\n</header>\n\
             <main>\n{body}</main>\n<p class=\"note\">{runs}</p>\n</body>\n</html>\n"
        )
    }

    fn method_page(&self, note: &MethodNote) -> String {
        let comparison = self.comparison;
        let mut body = String::new();
        let texts = [
            note.summary.clone(),
            note.home.clone(),
            note.native
                .as_ref()
                .map_or_else(String::new, |native| format!("Native level: {native}.")),
        ];
        for text in texts.iter().filter(|text| !text.is_empty()) {
            body += &format!("<p>{}</p>\n", escape_html(text));
        }
        let link = |text: &str| self.link(text);
        for series in (0..comparison.series.len()).filter(|&s| comparison.methods[s] == note.id) {
            if comparison.series[series] != note.id {
                body += &format!("<h2>{}</h2>\n", escape_html(&comparison.series[series]));
            }
            body += &to_html(&self.results(series), &link);
            body += &self.panels(series);
        }
        body += &self.plots("overview");
        if !note.params.is_empty() {
            let rows = Table::of(&note.params)
                .text("parameter", |param| param.name.to_string())
                .text("default", |param| param.default.clone())
                .text("unit or values", |param| param.unit.to_string())
                .text("meaning", |param| param.help.to_string());
            let table = Table { caption: "Parameters".to_owned(), ..rows.table };
            body += &to_html(&table, &|_| None);
        }
        if !note.citation.is_empty() {
            body += &format!("<h2>Source</h2>\n<p>{}</p>\n", escape_html(&note.citation));
        }
        if !note.bibtex.is_empty() {
            body += &format!(
                "<pre class=\"command\"><code>{}</code></pre>\n",
                escape_html(note.bibtex.trim())
            );
        }
        self.page(&format!("{}: {}", note.id, note.title), &body)
    }

    /// The results of a series at requested counts, with their ranks on each mesh.
    fn results(&self, series: usize) -> Table {
        let comparison = self.comparison;
        let entries = comparison
            .entries
            .iter()
            .filter(|entry| entry.series == series && !comparison.levels[entry.level].is_native());
        let entries: Vec<&Entry<'_>> = entries.collect();
        let rank = |entry: &Entry<'_>| {
            let here =
                comparison.of_mesh(entry.mesh).filter(|e| e.level == entry.level && e.comparable());
            let errors: Vec<f64> = here.filter_map(|e| HAUSDORFF.of(e.record)).collect();
            let own = HAUSDORFF.of(entry.record).filter(|_| entry.comparable())?;
            let better = errors.iter().filter(|&&error| error < own).count();
            Some(format!("{} of {}", better + 1, errors.len()))
        };
        let mut rows = Table::of(&entries)
            .text("mesh", |entry| comparison.meshes[entry.mesh].as_str())
            .number("requested", |entry| entry.record.simplify.level.to_string())
            .number("spheres", |entry| reached(entry.record).map(|n| grouped(n as u64)))
            .text("rank by Hausdorff", |entry| rank(entry));
        let metrics = [&HAUSDORFF, &MEAN_ERROR, &MIN_ANGLE, &TOTAL_SECONDS, &CLAIMED_SECONDS];
        let has_any = |metric: &&&Metric| entries.iter().any(|e| metric.of(e.record).is_some());
        for metric in metrics.iter().filter(has_any) {
            rows = rows.number(metric.heading(), |entry| {
                metric.of(entry.record).map(|value| metric.format(value))
            });
        }
        let rows = rows.text("right topology", |entry| topology_word(entry));
        Table { caption: "Results at requested numbers of spheres".to_owned(), ..rows.table }
    }

    /// The medial mesh and the errors of a series on each mesh that has a picture of them.
    fn panels(&self, series: usize) -> String {
        let mut panels = String::new();
        for (mesh, strip) in &self.pictures {
            let own = |artifact: &String| {
                let mut entries = self.comparison.of_mesh(*mesh).filter(|e| e.series == series);
                entries.any(|entry| entry.record.artifact.as_ref() == Some(artifact))
            };
            let Some(place) = strip.panels.iter().position(|(artifact, _)| own(artifact)) else {
                continue; // no result at the count of the pictures
            };
            let Layout { whole: [width, height], panel: [across, down], axes, errors, .. } =
                strip.layout();
            panels += "<figure class=\"panel\">\n";
            for [x, y] in [axes[place], errors[place]] {
                panels += &format!(
                    "<svg viewBox=\"{x} {y} {across} {down}\" role=\"img\"><image href=\"{}\" \
                     width=\"{width}\" height=\"{height}\"/></svg>\n",
                    strip.file
                );
            }
            let mesh = escape_html(&self.comparison.meshes[*mesh]);
            let caption = escape_html(&strip.panels[place].1);
            panels += &format!("<figcaption>{mesh}, {caption}</figcaption>\n</figure>\n");
        }
        if panels.is_empty() {
            return panels;
        }
        format!(
            "<div class=\"panels\">\n{panels}</div>\n<p class=\"note\">Above the medial mesh; below it the surface: red \
             where the reconstruction reaches beyond it, blue where it falls short.</p>\n"
        )
    }

    /// The leading plots that the report has of a mesh or of the means.
    fn plots(&self, stem: &str) -> String {
        let kinds = ["hausdorff", "time"];
        let files = kinds.map(|kind| (kind, format!("plots/{stem}-{kind}.svg")));
        let here = files.iter().filter(|(_, file)| self.written.contains(&Path::new(file)));
        here.map(|(kind, file)| {
            format!("<img src=\"{file}\" alt=\"{kind}\" style=\"max-width:min(100%,44rem)\">\n")
        })
        .collect()
    }

    fn mesh_page(&self, mesh: usize) -> String {
        let (name, stem) = (&self.comparison.meshes[mesh], &self.stems[mesh]);
        let mut body = String::new();
        if let Some(PictureStrip { file, .. }) = self.pictures.get(&mesh) {
            let words = "medial meshes and errors of all methods, the least Hausdorff error first";
            body += &format!(
                "<p><img src=\"{file}\" alt=\"{}: {words}\" style=\"max-width:100%\"></p>\n",
                escape_html(name)
            );
        }
        body += &format!(
            "<p><a href=\"index.html#mesh-{stem}\">3D view and interactive plots</a></p>\n"
        );
        body += &self.plots(&format!("mesh-{stem}"));
        let mut table = mesh_table(self.comparison, mesh, "");
        table.caption = "Every method at every level".to_owned();
        body += &to_html(&table, &|text| self.link(text));
        self.page(name, &body)
    }
}
