//! `index.html`: one page that holds everything and opens without a network.
//!
//! Rust writes data, the static files of this folder draw them. The page holds two documents: the
//! small one is plain JSON with everything but the records; the large one, with a column for each
//! number of the records and the plots of each mesh, is gzip in Base64. Libraries are packed alike.

mod records;

use std::io::Write;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use medial_run::record::Machine;
use medial_run::text::{betti, counted, escape_html, grouped, printable};
use serde::Serialize;
use serde_json::{Value, json};

use crate::comparison::{Comparison, level_label};
use crate::header::{Header, RunNote, method_pages};
use crate::metric::{BELOW_30, COMPARED, EPSILON, Metric, SPHERES_ONLY};
use crate::plots::{Figure, styles, symbol};
use crate::render::Layout;
use crate::tables::Table;

/// The content of the page.
pub(crate) struct Page<'a> {
    pub(crate) header: &'a Header,
    pub(crate) comparison: &'a Comparison<'a>,
    /// Which method for which purpose.
    pub(crate) answers: Option<Table>,
    /// All methods at one number of spheres.
    pub(crate) overview: Option<Table>,
    /// Folded sections of tables: id, title, tables.
    pub(crate) sections: Vec<(&'static str, &'static str, Vec<Table>)>,
    /// Figures over all meshes.
    pub(crate) figures: &'a [Figure],
    /// In the order of the meshes.
    pub(crate) meshes: &'a [MeshPart],
    /// Of the methods that ran and of the program.
    pub(crate) bibtex: &'a str,
}

/// The page's section of one mesh.
pub(crate) struct MeshPart {
    /// Name of its files.
    pub(crate) stem: String,
    pub(crate) figures: Vec<Figure>,
    pub(crate) picture: Option<MeshPicture>,
    pub(crate) view: Option<MeshView>,
}

/// The picture of a mesh's results. The page shows its panels one by one.
#[derive(Serialize)]
pub(crate) struct MeshPicture {
    pub(crate) address: String,
    pub(crate) layout: Layout,
    pub(crate) captions: Vec<String>,
}

/// A 3D view of a mesh's results.
pub(crate) struct MeshView {
    pub(crate) name: String,
    /// Its file, relative to the page.
    pub(crate) file: String,
    /// Its text, where the page itself holds it.
    pub(crate) text: Option<String>,
}

/// Bytes as gzip; equal bytes give equal ones.
pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    // Writing to a vector never fails.
    let packed = encoder.write_all(bytes).and_then(|()| encoder.finish());
    packed.unwrap_or_default()
}

/// Bytes as gzip in Base64.
pub(crate) fn pack(bytes: &[u8]) -> String {
    BASE64_STANDARD.encode(gzip(bytes))
}

/// An element with a packed text, which a browser skips until the script reads it.
fn packed(id: &str, text: &str) -> String {
    let text = pack(text.as_bytes());
    format!("<script type=\"text/plain\" id=\"{id}\">{text}</script>\n")
}

/// JSON for an element `script`: no text can end the element or begin a comment, and no direction mark reorders the
/// display.
fn embedded(value: &Value) -> String {
    printable(&value.to_string().replace('<', "\\u003c"))
}

/// The template with its parts.
fn filled(title: &str, report: &Value, library: String, script: String) -> String {
    // In their order: a value may look like another's place.
    let parts = [
        ("{title}", escape_html(title)),
        ("{style}", include_str!("page.css").to_owned()),
        ("{title}", escape_html(title)),
        ("{report}", embedded(report)),
        ("{packed}", library),
        ("{script}", script),
    ];
    let mut rest = include_str!("page.html");
    let mut html = String::new();
    for (place, text) in parts {
        let (before, after) = rest.split_once(place).expect("the template has each place");
        html.push_str(before);
        html.push_str(&text);
        rest = after; // values are never searched
    }
    html + rest
}

fn libraries_3d() -> String {
    packed("three", include_str!("vendor/three.module.min.js"))
        + &packed("controls", include_str!("vendor/OrbitControls.js"))
}

/// The element of a 3D view with its packed text.
fn view_element(name: &str, text: &str) -> String {
    let name = escape_html(name);
    format!("<script type=\"text/plain\" class=\"view\" id=\"view-{name}\">{text}</script>\n")
}

/// A page of one packed 3D view with all its results side by side.
pub(crate) fn page_of_view(title: &str, text: &str) -> String {
    let library = libraries_3d() + &view_element("all", text);
    let show = "document.querySelector(\"main\").append(viewOf({ name: \"all\", all: true }));\n";
    let script = [include_str!("page.js"), include_str!("view3d.js"), show].concat();
    filled(title, &json!({}), library, script)
}

impl Page<'_> {
    /// The page as HTML.
    pub(crate) fn to_html(&self) -> String {
        let title = match self.header.title.as_str() {
            "" => "Simplification of the medial axis: comparison",
            title => title,
        };
        let mut library = packed("bulk", &embedded(&self.bulk()));
        library.push_str(&packed("d3", include_str!("vendor/d3.min.js")));
        library.push_str(&packed("plot", include_str!("vendor/plot.umd.min.js")));
        let views: Vec<&MeshView> =
            self.meshes.iter().filter_map(|mesh| mesh.view.as_ref()).collect();
        if !views.is_empty() {
            library.push_str(&libraries_3d());
        }
        for view in views {
            let Some(text) = &view.text else { continue }; // read from its file when opened
            library.push_str(&view_element(&view.name, text));
        }
        let script = [
            include_str!("page.js"),
            include_str!("table.js"),
            include_str!("plots.js"),
            include_str!("view3d.js"),
            "start();\n", // after all parts are defined
        ];
        filled(title, &self.report(), library, script.concat())
    }

    /// The large document: the records as columns, and the plots of each mesh.
    fn bulk(&self) -> Value {
        let count = self.comparison.entries.len();
        // More rows than that are in the CSV alone.
        let is_shown = count > 0 && count <= records::MOST;
        let figures = self.meshes.iter().map(|mesh| figures(&mesh.figures));
        json!({
            "rows": if is_shown { count } else { 0 },
            "columns": if is_shown { records::all_columns(self.comparison, self.header.is_site) } else { Default::default() },
            "figures": figures.collect::<Vec<_>>(),
        })
    }

    /// The small document.
    fn report(&self) -> Value {
        let (header, comparison) = (self.header, self.comparison);
        let is_one = comparison.meshes.len() == 1;
        let styles = styles(header, comparison);
        let series = comparison.series.iter().zip(styles).map(|(name, style)| {
            let (colour, symbol, hollow) = symbol(style);
            json!({"name": name, "colour": colour, "symbol": symbol, "hollow": hollow})
        });
        let metrics = comparison.columns().into_iter().map(|metric| {
            // Hidden at first, so that the table fits a screen.
            let rare = [&EPSILON, &SPHERES_ONLY, &BELOW_30].iter().any(|rare| rare.key == metric.key);
            json!({"key": metric.key, "title": metric.heading(), "digits": metric.digits, "shown": !rare})
        });
        let mut sections: Vec<Value> = Vec::new();
        for (id, title, tables) in &self.sections {
            let tables: Vec<Table> = tables.iter().map(without_command).collect();
            sections.push(json!({"id": id, "title": title, "tables": tables}));
        }
        let pages = if header.is_site { method_pages(header, comparison) } else { vec![] };
        let methods = header
            .methods
            .iter()
            .filter(|note| comparison.methods.contains(&note.id.as_str()))
            .map(|note| {
                let page = pages.iter().find(|(other, _)| other.id == note.id);
                json!({
                    "id": note.id, "title": note.title, "summary": note.summary, "home": note.home,
                    "published": note.published.trim_end_matches('.'), "citation": note.citation,
                    "page": page.map(|(_, file)| format!("./{file}")),
                })
            });
        let runs = &header.runs;
        let command = runs.last().map(|run| &run.command).filter(|command| !command.is_empty());
        let pictured = self.meshes.iter().position(|m| m.picture.is_some() || m.view.is_some());
        json!({
            "lead": self.lead(),
            "facts": self.facts(),
            "command": command,
            "earlier": runs.split_last().map_or(&[][..], |(_, earlier)| earlier).iter().map(earlier).collect::<Vec<_>>(),
            "study": header.study,
            "site": header.is_site,
            "alert": self.alert(),
            "notices": (comparison.edition_note().into_iter())
                .chain(comparison.seeds_note())
                .chain(header.notes.iter().cloned())
                .chain(comparison.cautions())
                .collect::<Vec<_>>(),
            "series": series.collect::<Vec<_>>(),
            "levels": comparison.levels.iter().map(|&level| level_label(level)).collect::<Vec<_>>(),
            "metrics": metrics.collect::<Vec<_>>(),
            "meshes": (0..self.meshes.len()).map(|mesh| self.mesh(mesh)).collect::<Vec<_>>(),
            "answers": self.answers.as_ref().map(without_command),
            "overview": self.overview,
            "leading": pictured,
            "figures": if is_one { vec![] } else { figures(self.figures) },
            "sections": sections,
            "methods": methods.collect::<Vec<_>>(),
            "definitions": definitions(),
            "papers": (!comparison.entries.is_empty()).then_some(self.bibtex),
            "too_many": (comparison.entries.len() > records::MOST).then(|| format!(
                "{} results are too many for a table on a page. results.csv holds every number, and \
                 each mesh has a table in tables/.",
                grouped(comparison.entries.len() as u64)
            )),
        })
    }

    /// What the page compares, and which of the methods are of this project.
    fn lead(&self) -> String {
        let notes = self
            .header
            .methods
            .iter()
            .filter(|note| self.comparison.methods.contains(&note.id.as_str()));
        let own = notes.filter(|note| note.citation.starts_with("This project"));
        let own: Vec<&str> = own.map(|note| note.id.as_str()).collect();
        let lead = "Each method simplifies the medial axis of a solid to a number of spheres. Errors are distances between \
                    the solid and the shape that the result describes.";
        match own.len() {
            0 => lead.to_owned(),
            _ => format!("{lead} Methods of this project, not published: {}.", own.join(", ")),
        }
    }

    /// Counts of methods, meshes, levels and results, date, version and machine.
    fn facts(&self) -> Vec<String> {
        let comparison = self.comparison;
        let mut facts = vec![format!(
            "{} on {} at {}",
            counted(comparison.series.len(), "method", "methods"),
            counted(comparison.meshes.len(), "mesh", "meshes"),
            counted(comparison.levels.len(), "level", "levels"),
        )];
        let runs = &comparison.entries;
        let missed = runs.iter().filter(|entry| !entry.record.status.is_ok()).count();
        let runs = counted(runs.len(), "run", "runs");
        let fact =
            format!("{} of {runs} did not give the requested result", grouped(missed as u64));
        facts.extend((missed > 0).then_some(fact));
        let run = self.header.runs.last();
        facts.extend(run.and_then(|run| run.date.clone()));
        facts.extend(
            run.filter(|run| !run.version.is_empty()).map(|run| format!("medial {}", run.version)),
        );
        // A header may name no machine; each record does.
        let recorded = comparison.entries.first().map(|entry| &entry.record.machine);
        let machine = run.and_then(|run| run.machine.as_ref()).or(recorded);
        facts.extend(machine.map(Machine::to_string).filter(|text| !text.is_empty()));
        facts
    }

    /// The reason for a page without a number.
    fn alert(&self) -> Option<String> {
        let runs = self.comparison.entries.len();
        (self.comparison.measured() == 0).then(|| match runs {
            0 => "Nothing was measured: there is no record.".to_owned(),
            runs => format!(
                "Nothing was measured: none of the {} led to a result that was evaluated.",
                counted(runs, "run", "runs")
            ),
        })
    }

    fn mesh(&self, index: usize) -> Value {
        let (comparison, part) = (self.comparison, &self.meshes[index]);
        let entries = || comparison.of_mesh(index);
        let missing = entries().filter(|entry| !entry.record.status.has_result()).count();
        let mut brief = counted(entries().count(), "run", "runs");
        if missing > 0 {
            brief.push_str(&format!(", {missing} without a result"));
        }
        let initial = entries().find_map(|entry| entry.record.initial);
        let initial = initial.map_or(vec![], |initial| {
            let [spheres, edges, faces] =
                [initial.spheres, initial.edges, initial.faces].map(grouped);
            let wrong = initial.betti.zip(initial.expected_betti).filter(|(a, b)| a != b).is_some();
            let mut facts = vec![
                json!([
                    "initial medial mesh",
                    format!("{spheres} spheres, {edges} edges, {faces} faces")
                ]),
                json!(["its Betti numbers", betti(initial.betti)]),
                json!(["Betti numbers of the solid", betti(initial.expected_betti)]),
            ];
            if wrong {
                let remark = "wrong before any simplification: methods that start here inherit it";
                facts.push(json!(["topology", remark, true]));
            }
            facts
        });
        let view = part.view.as_ref();
        json!({
            "name": comparison.meshes[index],
            "stem": part.stem,
            "brief": brief,
            "measured": entries().any(|entry| entry.measured()),
            "picture": part.picture,
            "view": view.map(|view| json!({"name": view.name, "file": format!("./{}", view.file)})),
            "initial": initial,
        })
    }
}

/// The page's head shows the command once for all tables: it is the first note of each.
fn without_command(table: &Table) -> Table {
    let mut table = table.clone();
    table.notes.drain(..table.notes.len().min(1));
    table
}

fn figures(figures: &[Figure]) -> Vec<Value> {
    figures.iter().map(Figure::to_json).collect()
}

fn earlier(run: &RunNote) -> String {
    let date = run.date.as_deref().unwrap_or("no date");
    format!("{date}, medial {} (build {:.8}): {}", run.version, run.binary_hash, run.command)
}

/// The meaning of each metric. The page knows those of its other words.
fn definitions() -> Vec<[String; 2]> {
    let definition = |metric: &Metric| {
        let means = metric.mean.word();
        [metric.heading(), format!("{} Means over meshes are {means}.", metric.definition)]
    };
    COMPARED.map(definition).into()
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::GzDecoder;

    use super::*;

    #[test]
    fn packing_is_reversible_and_deterministic() {
        let text = "</script><b>\u{e9}".repeat(100);
        let element = packed("rows", &text);
        assert_eq!(element, packed("rows", &text));
        assert!(element.len() < text.len(), "{element}");
        let inside = element.split_once('>').unwrap().1.strip_suffix("</script>\n").unwrap();
        let bytes = BASE64_STANDARD.decode(inside).unwrap();
        let mut back = String::new();
        GzDecoder::new(bytes.as_slice()).read_to_string(&mut back).unwrap();
        assert_eq!(back, text);
    }

    #[test]
    fn text_cannot_close_its_script_element() {
        let text = embedded(&json!({"reason": "</script><!--\u{202e}\n"}));
        assert!(!text.contains(['<', '\u{202e}', '\n']), "{text}");
        let back: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(back["reason"], "</script><!--\u{fffd}\n");
    }
}
