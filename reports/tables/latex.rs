//! Tables as LaTeX, to be taken in by `\input`: no package is needed, booktabs is used where it
//! is loaded.

use crate::tables::{Row, Table};
use crate::text::printable;

/// Rules in the manner of booktabs for documents that do not load it.
const RULES: &str = "\\providecommand{\\toprule}{\\hline}\n\
                     \\providecommand{\\midrule}{\\hline}\n\
                     \\providecommand{\\bottomrule}{\\hline}\n";

/// A `table` environment with caption, tabular and notes.
pub(crate) fn to_latex(table: &Table, label: &str) -> String {
    let mut text = String::new();
    for note in &table.notes {
        text.push_str(&format!("% {}\n", printable(note)));
    }
    text.push_str(RULES);
    text.push_str("\\begin{table}\n\\centering\n\\scriptsize\n\\setlength{\\tabcolsep}{3pt}\n");
    text.push_str(&format!("\\caption{{{}}}\n\\label{{tab:{label}}}\n", escape(&table.caption)));
    let alignment: String =
        table.columns.iter().map(|column| if column.number { 'r' } else { 'l' }).collect();
    text.push_str(&format!("\\begin{{tabular}}{{{alignment}}}\n\\toprule\n"));
    let titles: Vec<String> = table.columns.iter().map(|column| escape(&column.title)).collect();
    text.push_str(&line(&titles));
    for (index, row) in table.rows.iter().enumerate() {
        if index == 0 || row.starts_group {
            text.push_str("\\midrule\n");
        }
        text.push_str(&line(&cells(row)));
    }
    text.push_str("\\bottomrule\n\\end{tabular}\n");
    for note in &table.notes {
        text.push_str(&format!("\\par\\smallskip\\parbox{{\\linewidth}}{{{}}}\n", escape(note)));
    }
    text.push_str("\\end{table}\n");
    text
}

fn cells(row: &Row) -> Vec<String> {
    row.cells
        .iter()
        .map(|cell| {
            let text = escape(&cell.text);
            if cell.best { format!("\\textbf{{{text}}}") } else { text }
        })
        .collect()
}

fn line(cells: &[String]) -> String {
    format!("{} \\\\\n", cells.join(" & "))
}

/// Escapes LaTeX's own characters. Letters beyond ASCII are passed on: every LaTeX since 2018
/// reads UTF-8.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in printable(text).chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => {
                escaped.push('\\');
                escaped.push(c);
            }
            '\\' => escaped.push_str("\\textbackslash{}"),
            '~' => escaped.push_str("\\textasciitilde{}"),
            '^' => escaped.push_str("\\textasciicircum{}"),
            '<' => escaped.push_str("\\textless{}"),
            '>' => escaped.push_str("\\textgreater{}"),
            '|' => escaped.push_str("\\textbar{}"),
            '"' => escaped.push_str("{\\ttfamily\\char34}"),
            '[' => escaped.push_str("{[}"),
            ']' => escaped.push_str("{]}"),
            '↓' => escaped.push_str("$\\downarrow$"),
            '↑' => escaped.push_str("$\\uparrow$"),
            'ε' => escaped.push_str("$\\varepsilon$"),
            '°' => escaped.push_str("$^\\circ$"),
            '–' => escaped.push_str("--"),
            '…' => escaped.push_str("\\ldots{}"),
            c => escaped.push(c),
        }
    }
    escaped
}
