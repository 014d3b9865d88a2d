//! Pieces of HTML that several sections use.

use serde_json::Value;

use crate::plots::{Plot, style};
use crate::tables::Table;
use crate::text::{escape_html, printable};

/// A table in a box that scrolls sideways where the page is narrow. Remarks may wrap.
pub(crate) fn table(table: &Table) -> String {
    let class = |number: bool| if number { " class=\"num\"" } else { "" };
    let mut html = String::from("<div class=\"scroll\"><table>\n<thead><tr>");
    for column in &table.columns {
        let title = escape_html(&column.title);
        html.push_str(&format!("<th scope=\"col\"{}>{title}</th>", class(column.number)));
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        html.push_str(if row.starts_group { "<tr class=\"group\">" } else { "<tr>" });
        for (cell, column) in row.cells.iter().zip(&table.columns) {
            let text = escape_html(&cell.text);
            let text = if cell.best { format!("<strong>{text}</strong>") } else { text };
            html.push_str(&format!("<td{}>{text}</td>", class(column.number)));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody>\n</table></div>\n");
    html
}

/// Plots side by side, as far as the page is wide.
pub(crate) fn plots<'a>(plots: impl IntoIterator<Item = &'a Plot>) -> String {
    let mut plots = plots.into_iter().peekable();
    if plots.peek().is_none() {
        return String::new();
    }
    let mut html = String::from("<div class=\"plots\">\n");
    for plot in plots {
        let label = format!(
            "<svg class=\"plot\" role=\"img\" aria-label=\"{}\" ",
            escape_html(&plot.title)
        );
        html.push_str(&format!(
            "<figure>{}{}</figure>\n",
            plot.svg.replacen("<svg ", &label, 1).trim_end(),
            points(plot)
        ));
    }
    html.push_str("</div>\n");
    html
}

/// The points of a plot for the script.
fn points(plot: &Plot) -> String {
    if plot.points.is_null() {
        return String::new();
    }
    format!("<script type=\"application/json\">{}</script>", json(&plot.points))
}

/// JSON that may stand in an element `script`: no text can end the element or begin a comment,
/// and no direction mark reorders what is shown.
pub(crate) fn json(value: &Value) -> String {
    printable(&value.to_string().replace('<', "\\u003c"))
}

/// The colour of a series in the plots, as a dot before its name.
pub(crate) fn series(index: usize, label: &str) -> String {
    let (colour, _) = style(index);
    format!(
        "<span class=\"dot\" style=\"background:#{:02X}{:02X}{:02X}\"></span>{}",
        colour.0,
        colour.1,
        colour.2,
        escape_html(label)
    )
}

/// A link to a file in the folder of the page: percent-encoded and escaped. `None` for what does
/// not stay inside that folder, such as `javascript:` or `../`.
pub(crate) fn local_link(path: &str) -> Option<String> {
    let inside = !path.is_empty()
        && !path.starts_with('/')
        && !path.contains('\\')
        && path.split('/').all(|part| !part.is_empty() && part != ".." && part != ".");
    if !inside {
        return None;
    }
    let mut link = String::from("./");
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"-_./~".contains(&byte) {
            link.push(char::from(byte));
        } else {
            link.push_str(&format!("%{byte:02X}"));
        }
    }
    Some(link)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_stay_inside() {
        assert_eq!(local_link("meshes/a b#1.ma").unwrap(), "./meshes/a%20b%231.ma");
        assert_eq!(local_link("javascript:alert(1)").unwrap(), "./javascript%3Aalert%281%29");
        for outside in ["", "/etc/passwd", "../x", "a/../../x", "a//b", "..\\x"] {
            assert_eq!(local_link(outside), None, "{outside}");
        }
    }
}
