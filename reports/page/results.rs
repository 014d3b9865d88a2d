//! The table of all results: sortable, filterable, failures as rows.
//!
//! Only the first rows stand in the document: a table of ten thousand takes seconds to lay out.

use serde_json::{Value, json};

use crate::comparison::{Entry, level_label, reached};
use crate::metric::{BELOW_30, COMPARED, EPSILON, SPHERES_ONLY};
use crate::page::packed::packed;
use crate::page::{Page, details, html};
use crate::tables::{Best, remark, topology_verdict, warnings};
use crate::text::{betti, escape_html, grouped, megabytes};

/// The section with its filters and its table.
pub(crate) fn section(page: &Page<'_>) -> String {
    let comparison = page.comparison;
    let mut html = String::from("<section id=\"results\">\n<h2>Results</h2>\n");
    if comparison.entries.len() > MOST {
        html.push_str(&format!(
            "<p>{} results are too many for a table on a page: <code>results.csv</code> holds every number that was \
             recorded, and each mesh has a table of its own below.</p>\n</section>\n",
            grouped(comparison.entries.len() as u64)
        ));
        return html;
    }
    let levels: Vec<String> = comparison.levels.iter().map(|&level| level_label(level)).collect();
    let statuses: Vec<String> =
        comparison.statuses().iter().map(|(status, _)| status.to_string()).collect();
    html.push_str("<form class=\"filters\" hidden>\n");
    html.push_str(&choice("mesh", &comparison.meshes));
    html.push_str(&choice("method", &comparison.series));
    html.push_str(&choice("asked", &levels));
    html.push_str(&choice("status", &statuses));
    html.push_str("<label>text <input type=\"search\" name=\"text\"></label>\n");
    html.push_str(&column_chooser());
    html.push_str("<button type=\"reset\">reset</button> <output></output>\n</form>\n");
    html.push_str(
        "<div class=\"scroll tall\" tabindex=\"0\"><table class=\"sortable\">\n<thead><tr>",
    );
    html.push_str(&heads());
    html.push_str("</tr></thead>\n<tbody>\n");
    let mut rows = rows(page);
    let rest = rows.split_off(rows.len().min(INLINE));
    rows.iter().for_each(|row| html.push_str(&row.html));
    html.push_str("</tbody>\n</table></div>\n");
    if !rest.is_empty() {
        html.push_str(&packed_rows(&rest));
        html.push_str(&format!(
            "<noscript><p class=\"note\">These are the first {} of {} rows: <code>results.csv</code> \
             holds all.</p></noscript>\n",
            rows.len(),
            grouped(comparison.entries.len() as u64)
        ));
    }
    html.push_str(
        "<p class=\"note\">Lengths in % of the bounding-box diagonal of the input; seconds of wall \
         clock, shared substrates included. Arrows: which way is better. Bold: best for this mesh \
         at this number of spheres, among results that reached it to within 2 %. \
         <code>results.csv</code> holds every number that was recorded.</p>\n</section>\n",
    );
    html.push_str(&details::block(comparison));
    html
}

/// Of more results the page has no table: it would take a browser's memory and minutes.
const MOST: usize = 20_000;

/// Rows that stand in the document; the script takes further ones from a block of their own.
const INLINE: usize = 250;

/// The rows of all entries, in their order.
fn rows(page: &Page<'_>) -> Vec<Row> {
    let comparison = page.comparison;
    let mut best = None;
    let row = |entry: &Entry<'_>| {
        let best = match &mut best {
            Some((mesh, best)) if *mesh == entry.mesh => best,
            slot => &mut slot.insert((entry.mesh, Best::of_mesh(comparison, entry.mesh))).1,
        };
        row(page, entry, best)
    };
    comparison.entries.iter().map(row).collect()
}

/// Rows for the script: what filters ask for, what columns sort by, and the element.
fn packed_rows(rows: &[Row]) -> String {
    let rows: Vec<Value> =
        rows.iter().map(|row| json!([row.facets, row.values, row.html])).collect();
    packed(Some("rows"), &Value::Array(rows).to_string())
}

/// A row of the table.
struct Row {
    html: String,
    /// Mesh, method, level, status, as the filters have them.
    facets: [String; 4],
    /// For each column what it sorts by: a number, none, or a text.
    values: Vec<Value>,
}

impl Row {
    /// Adds a cell with the number that it sorts by; without one it sorts last.
    fn number(&mut self, value: Option<f64>, text: &str) {
        let sort = value.map_or(String::new(), |value| format!(" data-v=\"{value}\""));
        self.html.push_str(&format!("<td class=\"num\"{sort}>{text}</td>"));
        self.values.push(json!(value));
    }

    /// Adds a cell that sorts by a text.
    fn text(&mut self, class: &str, value: &str, html: &str) {
        self.html.push_str(&format!("<td{class}>{html}</td>"));
        self.values.push(value.into());
    }
}

/// A drop-down list for one column.
fn choice(name: &str, values: &[String]) -> String {
    let mut html = format!("<label>{name} <select name=\"{name}\"><option value=\"\">all</option>");
    for value in values {
        html.push_str(&format!("<option>{}</option>", escape_html(value)));
    }
    html.push_str("</select></label>\n");
    html
}

/// A column of the table.
struct Head {
    /// Name in the address of the page.
    key: &'static str,
    title: String,
    number: bool,
    shown: Shown,
}

/// Whether a column is seen; without the script all are.
#[derive(PartialEq)]
enum Shown {
    Always,
    AtFirst,
    OnRequest,
}

fn columns() -> Vec<Head> {
    use Shown::{Always, AtFirst, OnRequest};
    let head =
        |key, title: &str, number, shown| Head { key, title: title.to_owned(), number, shown };
    let mut heads = vec![
        head("mesh", "mesh", false, Always),
        head("asked", "asked", true, Always),
        head("method", "method", false, Always),
        head("status", "status", false, AtFirst),
        head("spheres", "spheres", true, AtFirst),
        head("edges", "edges", true, OnRequest),
        head("faces", "faces", true, OnRequest),
    ];
    heads.extend(COMPARED.iter().map(|metric| {
        let rare = [&EPSILON, &SPHERES_ONLY, &BELOW_30].iter().any(|rare| rare.key == metric.key);
        head(metric.key, &metric.heading(), true, if rare { OnRequest } else { AtFirst })
    }));
    heads.extend([
        head("memory", "memory (MB) ↓", true, AtFirst),
        head("betti", "Betti", false, AtFirst),
        head("topology", "as solid", false, AtFirst),
        head("remark", "remark", false, AtFirst),
    ]);
    heads
}

/// Check boxes for the columns that may be left out.
fn column_chooser() -> String {
    let mut html = String::from("<details class=\"columns\"><summary>columns</summary><div>\n");
    for head in columns().iter().filter(|head| head.shown != Shown::Always) {
        html.push_str(&format!(
            "<label><input type=\"checkbox\" name=\"column\" value=\"{}\"{}> {}</label>\n",
            head.key,
            if head.shown == Shown::AtFirst { " checked" } else { "" },
            escape_html(&head.title)
        ));
    }
    html.push_str("</div></details>\n");
    html
}

fn heads() -> String {
    let cell = |head: &Head| {
        let class = if head.number { " class=\"num\"" } else { "" };
        let title = escape_html(&head.title);
        format!("<th scope=\"col\" data-key=\"{}\"{class}>{title}</th>", head.key)
    };
    columns().iter().map(cell).collect()
}

fn row(page: &Page<'_>, entry: &Entry<'_>, best: &Best) -> Row {
    let comparison = page.comparison;
    let record = entry.record;
    let simplify = &record.simplify;
    let (mesh, series) = (&comparison.meshes[entry.mesh], &comparison.series[entry.series]);
    let (level, status) = (level_label(simplify.level), record.status.to_string());
    let html = format!(
        "<tr data-mesh=\"{mesh}\" data-method=\"{}\" data-asked=\"{}\" data-status=\"{status}\">\
         <th scope=\"row\"><a href=\"#mesh-{}\">{mesh}</a></th>",
        escape_html(series),
        escape_html(&level),
        escape_html(&page.meshes[entry.mesh].stem),
        mesh = escape_html(mesh),
    );
    let facets = [mesh.clone(), series.clone(), level.clone(), status.clone()];
    let mut row = Row { html, facets, values: vec![mesh.as_str().into()] };
    let asked = match simplify.level {
        crate::Target::Spheres(count) => Some(count as f64),
        _ => None,
    };
    row.number(asked, &escape_html(&level));
    row.text("", series, &html::series(entry.series, series));
    let label = format!("<span class=\"status {}\">{status}</span>", record.status.key());
    row.text("", &status, &label);
    for count in [reached(record), simplify.edges, simplify.faces] {
        let text = count.map_or("–".to_owned(), |count| grouped(count as u64));
        row.number(count.map(|count| count as f64), &text);
    }
    for metric in COMPARED {
        let value = metric.of(record);
        let text = match value {
            Some(value) if best.is_best(entry, metric, value) => {
                format!("<strong>{}</strong>", metric.format(value))
            }
            Some(value) => metric.format(value),
            None => "–".to_owned(),
        };
        row.number(value, &text);
    }
    let memory = simplify.peak_bytes.map_or("–".to_owned(), megabytes);
    row.number(simplify.peak_bytes.map(|bytes| bytes as f64), &memory);
    let numbers = record.evaluate.as_ref().map_or("–".to_owned(), |e| betti(e.betti));
    row.text("", &numbers, &numbers);
    let verdict = topology_verdict(entry);
    row.text("", verdict, verdict);
    row.text(" class=\"wrap\"", &remark(entry), &remarks(entry));
    row.html.push_str("</tr>\n");
    row
}

/// The way to the medial mesh, the number of warnings, and the remark, of which the first lines are in sight.
fn remarks(entry: &Entry<'_>) -> String {
    let mut parts = Vec::new();
    if let Some(artifact) = entry.record.artifact.as_deref().and_then(html::local_link) {
        parts.push(format!("<a href=\"{artifact}\">.ma</a>"));
    }
    let warnings = warnings(entry.record);
    if !warnings.is_empty() {
        parts.push(format!(
            "<span title=\"{}\">{}</span>",
            escape_html(&warnings.join("\n")),
            crate::text::counted(warnings.len(), "warning", "warnings")
        ));
    }
    let remark = escape_html(&remark(entry));
    let brief = match remark.is_empty() {
        true => String::new(),
        false => format!("<div class=\"brief\" title=\"{remark}\">{remark}</div>"),
    };
    parts.join(", ") + &brief
}
