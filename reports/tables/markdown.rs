//! Tables as Markdown.

use crate::tables::{Row, Table};
use crate::text::printable;

/// A heading, the notes, and a pipe table.
pub(crate) fn to_markdown(table: &Table) -> String {
    let mut text = format!("## {}\n\n", escape(&table.caption));
    for note in &table.notes {
        text.push_str(&escape(note));
        text.push_str("\n\n");
    }
    let titles: Vec<String> = table.columns.iter().map(|column| escape(&column.title)).collect();
    text.push_str(&line(&titles));
    let rules: Vec<String> = table
        .columns
        .iter()
        .map(|column| if column.number { "---:" } else { "---" }.to_owned())
        .collect();
    text.push_str(&line(&rules));
    for row in &table.rows {
        text.push_str(&line(&cells(row)));
    }
    text
}

fn cells(row: &Row) -> Vec<String> {
    row.cells
        .iter()
        .map(|cell| {
            let text = escape(&cell.text);
            if cell.best { format!("**{text}**") } else { text }
        })
        .collect()
}

fn line(cells: &[String]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

/// Escapes what Markdown or the HTML inside it would take for markup.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in printable(text).chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '|' | '\\' | '`' | '*' | '_' | '[' | ']' | '#' | '~' | '$' => {
                escaped.push('\\');
                escaped.push(c);
            }
            c => escaped.push(c),
        }
    }
    escaped
}
