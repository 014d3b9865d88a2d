//! Sections from files of their own: the baseline, stability under noise, oracles.

use crate::page::{Page, html};
use crate::text::escape_html;

/// Tables of up to so many rows stand open.
const OPEN_ROWS: usize = 24;

/// All sections that there are.
pub(crate) fn sections(page: &Page<'_>) -> String {
    let mut html = String::new();
    for extra in page.extras {
        html.push_str(&format!(
            "<section id=\"{}\">\n<h2>{}</h2>\n<p>{}</p>\n",
            extra.stem,
            escape_html(extra.title),
            escape_html(&extra.text)
        ));
        html.push_str(&html::plots(&extra.plots));
        for table in &extra.tables {
            let open = if table.rows.len() <= OPEN_ROWS { " open" } else { "" };
            html.push_str(&format!(
                "<details{open}><summary>{}</summary>\n{}",
                escape_html(&table.caption),
                html::table(table)
            ));
            for note in table.notes.iter().filter(|note| !note.is_empty()) {
                html.push_str(&format!("<p class=\"note\">{}</p>\n", escape_html(note)));
            }
            html.push_str("</details>\n");
        }
        html.push_str(&format!(
            "<p class=\"note\">As <a href=\"./tables/{0}.md\">Markdown</a> and \
             <a href=\"./tables/{0}.tex\">LaTeX</a>.</p>\n</section>\n",
            extra.stem
        ));
    }
    html
}
