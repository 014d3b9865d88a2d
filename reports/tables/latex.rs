//! Tables as LaTeX, to be taken in by `\input`: no package is needed. Where booktabs is loaded its
//! rules are used, where graphicx is loaded a table that is wider than the text is shrunk to it.

use crate::tables::{Row, Table};
use crate::text::printable;

/// Rules in the manner of booktabs for documents that do not load it.
const RULES: &str = "\\providecommand{\\toprule}{\\hline}\n\
                     \\providecommand{\\midrule}{\\hline}\n\
                     \\providecommand{\\bottomrule}{\\hline}\n";

/// The table in box 0, no wider than the text where that can be.
const FITTED: &str = "\\ifdim\\wd0>\\linewidth\n\
                      \\ifdefined\\resizebox\\resizebox{\\linewidth}{!}{\\usebox0}\\else\\usebox0\\fi\n\
                      \\else\\usebox0\\fi\n";

/// A `table` environment with caption, tabular and notes.
pub(crate) fn to_latex(table: &Table, label: &str) -> String {
    let mut text = String::new();
    for note in &table.notes {
        text.push_str(&format!("% {}\n", printable(note)));
    }
    text.push_str(RULES);
    text.push_str("\\begin{table}\n\\centering\n\\scriptsize\n\\setlength{\\tabcolsep}{3pt}\n");
    text.push_str(&format!("\\caption{{{}}}\n\\label{{tab:{label}}}\n", escape(&table.caption)));
    let alignment: String = (0..table.columns.len()).map(|column| align(table, column)).collect();
    text.push_str("\\sbox0{%\n");
    text.push_str(&format!("\\begin{{tabular}}{{{alignment}}}\n\\toprule\n"));
    let titles: Vec<String> = table.columns.iter().map(|column| escape(&column.title)).collect();
    text.push_str(&line(&titles));
    for (index, row) in table.rows.iter().enumerate() {
        if index == 0 || row.starts_group {
            text.push_str("\\midrule\n");
        }
        text.push_str(&line(&cells(row)));
    }
    text.push_str("\\bottomrule\n\\end{tabular}}%\n");
    text.push_str(FITTED);
    for note in &table.notes {
        text.push_str(&format!("\\par\\smallskip\\parbox{{\\linewidth}}{{{}}}\n", escape(note)));
    }
    text.push_str("\\end{table}\n");
    text
}

/// How a column is set: a text that would be wider than a third of a line wraps.
fn align(table: &Table, column: usize) -> String {
    const LONG: usize = 40;
    let texts = table.rows.iter().filter_map(|row| row.cells.get(column));
    let longest = texts.map(|cell| cell.text.chars().count()).max().unwrap_or(0);
    match table.columns[column].number {
        true => "r".to_owned(),
        false if longest > LONG => "p{0.3\\linewidth}".to_owned(),
        false => "l".to_owned(),
    }
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

/// Escapes LaTeX's own characters. European letters are passed on, which every LaTeX since 2018 reads
/// as UTF-8; what pdfLaTeX would stop at is spelled by its number, such as `U+65E5`.
pub(crate) fn escape(text: &str) -> String {
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
            '÷' => escaped.push_str("$\\div$"),
            '×' => escaped.push_str("$\\times$"),
            '±' => escaped.push_str("$\\pm$"),
            '·' => escaped.push_str("$\\cdot$"),
            '≤' => escaped.push_str("$\\le$"),
            '≥' => escaped.push_str("$\\ge$"),
            'λ' => escaped.push_str("$\\lambda$"),
            'θ' => escaped.push_str("$\\theta$"),
            'α' => escaped.push_str("$\\alpha$"),
            '\u{2018}' => escaped.push('`'),
            '\u{2019}' => escaped.push('\''),
            '\u{201c}' => escaped.push_str("``"),
            '\u{201d}' => escaped.push_str("''"),
            c if c.is_ascii() || ('\u{c0}'..='\u{17e}').contains(&c) => escaped.push(c),
            c => escaped.push_str(&format!("U+{:04X}", u32::from(c))),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::{Cell, Column};

    #[test]
    fn what_pdflatex_cannot_set_is_spelled() {
        assert_eq!(escape("÷ ≤ λ é"), "$\\div$ $\\le$ $\\lambda$ é");
        assert_eq!(escape("日_%"), "U+65E5\\_\\%");
    }

    #[test]
    fn long_texts_wrap_and_wide_tables_are_shrunk() {
        let cells = vec![Cell::new("x".repeat(60)), Cell::new("short"), Cell::new("1")];
        let table = Table {
            caption: "A caption".to_owned(),
            notes: vec![],
            columns: vec![Column::text("a"), Column::text("b"), Column::number("c")],
            rows: vec![Row { cells, starts_group: false }],
        };
        let latex = to_latex(&table, "label");
        assert!(latex.contains("\\begin{tabular}{p{0.3\\linewidth}lr}"), "{latex}");
        assert!(latex.contains("\\ifdefined\\resizebox"), "{latex}");
        let count = |c: char| latex.chars().filter(|&other| other == c).count();
        assert_eq!(count('{'), count('}'), "{latex}");
    }
}
