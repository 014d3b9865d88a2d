//! Tables: one description, written as Markdown, as LaTeX, and as JSON for the page. `csv` writes
//! every number of every record.

mod csv;
mod mesh;
mod topics;

use medial_run::text::{counted, escape_html, printable};
use serde::{Serialize, Serializer};
use serde_json::json;

pub(crate) use self::csv::{flatten, to_csv};
pub(crate) use self::mesh::{Best, mesh_table, remark, topology_word};
pub(crate) use self::topics::topic_tables;

/// A table before it takes a format.
#[derive(Clone, Default, Serialize)]
pub(crate) struct Table {
    /// One sentence above the table.
    pub(crate) caption: String,
    /// Units, definitions, and the meaning of bold. The first one is the command that made it.
    pub(crate) notes: Vec<String>,
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: Vec<Vec<Cell>>,
    /// Whether rows with the same first cell are a group, with a rule above it.
    pub(crate) grouped: bool,
}

impl Table {
    /// A table with a row for each item, and no column yet.
    pub(crate) fn of<T>(items: &[T]) -> Rows<'_, T> {
        let rows = items.iter().map(|_| vec![]).collect();
        Rows { items, table: Self { rows, ..Self::default() } }
    }

    /// A table of the first changes, with the number of all, which are in the JSON.
    pub(crate) fn of_changes<'i, T>(
        caption: &str,
        changes: &'i [T],
        columns: impl FnOnce(Rows<'i, T>) -> Rows<'i, T>,
    ) -> Self {
        const MOST: usize = 40;
        let left = changes.len().saturating_sub(MOST);
        let notes = (left > 0).then(|| format!("{left} more are in the JSON."));
        let rows = columns(Table::of(&changes[..changes.len() - left]));
        let caption = format!("{caption}: {}", counted(changes.len(), "change", "changes"));
        Self { caption, notes: Vec::from_iter(notes), ..rows.table }
    }

    /// The table without rows whose numbers are all unknown, but for that of the first column, and without columns of
    /// which no cell is known.
    pub(crate) fn known(mut self) -> Self {
        let numbers: Vec<bool> = self.columns.iter().map(|column| column.number).collect();
        self.rows.retain(|row| {
            let mut cells = row.iter().zip(&numbers).skip(1).filter(|(_, is_number)| **is_number);
            cells.any(|(cell, _)| cell.text != UNKNOWN)
        });
        let rows = &self.rows;
        let unknown: Vec<String> = (self.columns.iter().enumerate())
            .filter(|(k, _)| rows.iter().all(|row| row[*k].text == UNKNOWN))
            .map(|(_, column)| column.title.clone())
            .collect();
        self.without(&unknown.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// The table of one mesh, without counts of meshes and remarks on medians.
    pub(crate) fn of_one_mesh(mut self) -> Self {
        self.notes.truncate(1); // the command
        for (k, column) in self.columns.iter().enumerate() {
            if column.title.starts_with("topology") {
                let words = [("1 of 1", "yes"), ("0 of 1", "no")];
                for cell in self.rows.iter_mut().map(|row| &mut row[k]) {
                    let word = words.iter().find(|(share, _)| *share == cell.text);
                    *cell = word.map_or(cell.clone(), |(_, word)| (*word).into());
                }
            }
        }
        self.without(&["means over", "meshes", "valid on", "on", "failed"])
    }

    /// The table without some columns, by their titles.
    pub(crate) fn without(mut self, titles: &[&str]) -> Self {
        // From the right, so that places to the left stay valid.
        for column in (0..self.columns.len()).rev() {
            if titles.contains(&self.columns[column].title.as_str()) {
                self.columns.remove(column);
                self.rows.iter_mut().for_each(|row| drop(row.remove(column)));
            }
        }
        self
    }
}

/// A table that columns are added to, each with the cell that it has in the row of an item.
pub(crate) struct Rows<'i, T> {
    items: &'i [T],
    pub(crate) table: Table,
}

impl<T> Rows<'_, T> {
    /// Adds a column of texts.
    pub(crate) fn text<C: Into<Cell>>(
        mut self,
        title: impl Into<String>,
        cell: impl Fn(&T) -> C,
    ) -> Self {
        self.table.columns.push(Column { title: title.into(), number: false });
        for (row, item) in self.table.rows.iter_mut().zip(self.items) {
            row.push(cell(item).into());
        }
        self
    }

    /// Adds a column of numbers.
    pub(crate) fn number<C: Into<Cell>>(
        self,
        title: impl Into<String>,
        cell: impl Fn(&T) -> C,
    ) -> Self {
        let mut rows = self.text(title, cell);
        rows.table.columns.iter_mut().next_back().expect("just added").number = true;
        rows
    }
}

/// The head of a column.
#[derive(Clone, Serialize)]
pub(crate) struct Column {
    pub(crate) title: String,
    /// Numbers are set flush right.
    pub(crate) number: bool,
}

impl Column {
    pub(crate) fn text(title: impl Into<String>) -> Self {
        Self { title: title.into(), number: false }
    }
}

/// The mark of an empty cell.
const UNKNOWN: &str = "–";

/// One cell.
#[derive(Clone, Default)]
pub(crate) struct Cell {
    pub(crate) text: String,
    /// The best of its group.
    pub(crate) best: bool,
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self { text, best: false }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl From<Option<String>> for Cell {
    /// A dash where there is nothing.
    fn from(text: Option<String>) -> Self {
        text.unwrap_or_else(|| UNKNOWN.to_owned()).into()
    }
}

impl Cell {
    /// `3 of 4`; a dash of none.
    pub(crate) fn share((part, all): (usize, usize)) -> Self {
        (all > 0).then(|| format!("{part} of {all}")).into()
    }
}

impl Serialize for Cell {
    /// Most cells are plain: a text alone keeps the page small.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let text = printable(&self.text);
        if self.best { json!({ "best": text }) } else { json!(text) }.serialize(serializer)
    }
}

/// A heading, the table and its notes as HTML. `link` has the address of a text in a cell, where there is one.
pub(crate) fn to_html(table: &Table, link: &dyn Fn(&str) -> Option<String>) -> String {
    let class = |k: usize| if table.columns[k].number { " class=\"num\"" } else { "" };
    let heads = table.columns.iter().enumerate();
    let heads =
        heads.map(|(k, column)| format!("<th{}>{}</th>", class(k), escape_html(&column.title)));
    let mut text =
        format!("<h2>{}</h2>\n<div class=\"scroll\"><table>\n", escape_html(&table.caption));
    text += &format!("<thead><tr>{}</tr></thead>\n<tbody>\n", heads.collect::<String>());
    for row in &table.rows {
        let cells = row.iter().enumerate().map(|(k, cell)| {
            let mut inner = escape_html(&cell.text);
            if let Some(address) = link(&cell.text) {
                inner = format!("<a href=\"{}\">{inner}</a>", escape_html(&address));
            }
            let inner = if cell.best { format!("<strong>{inner}</strong>") } else { inner };
            format!("<td{}>{inner}</td>", class(k))
        });
        text += &format!("<tr>{}</tr>\n", cells.collect::<String>());
    }
    text += "</tbody></table></div>\n";
    let notes = table.notes.iter().filter(|note| !note.is_empty());
    text + &notes
        .map(|note| format!("<p class=\"note\">{}</p>\n", escape_html(note)))
        .collect::<String>()
}

/// A heading, the notes, and a pipe table.
pub(crate) fn to_markdown(table: &Table) -> String {
    let mut text = format!("## {}\n\n", escape(&table.caption));
    for note in &table.notes {
        text.push_str(&format!("{}\n\n", escape(note)));
    }
    let titles = table.columns.iter().map(|column| escape(&column.title));
    text.push_str(&markdown_line(titles));
    let rules = table.columns.iter().map(|column| if column.number { "---:" } else { "---" });
    text.push_str(&markdown_line(rules.map(str::to_owned)));
    for row in &table.rows {
        text.push_str(&markdown_line(row.iter().map(|cell| {
            let text = escape(&cell.text);
            if cell.best { format!("**{text}**") } else { text }
        })));
    }
    text
}

fn markdown_line(cells: impl Iterator<Item = String>) -> String {
    format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
}

/// Escapes the markup of Markdown and of the HTML inside it.
pub(crate) fn escape(text: &str) -> String {
    let text = printable(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let is_markup = |c| "|\\`*_[]#~$".contains(c);
    text.chars().flat_map(|c| is_markup(c).then_some('\\').into_iter().chain([c])).collect()
}

/// Markdown of this program as a terminal shows it: without escapes and emphasis.
pub fn without_markup(markdown: &str) -> String {
    let mut text = String::new();
    let mut letters = markdown.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' => text.extend(letters.next()),
            '*' => {} // an own one is escaped
            letter => text.push(letter),
        }
    }
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
}

/// Rules in the manner of booktabs for documents that do not load it.
const RULES: &str = "\\providecommand{\\toprule}{\\hline}\n\
                     \\providecommand{\\midrule}{\\hline}\n\
                     \\providecommand{\\bottomrule}{\\hline}\n";

/// The table in box 0, no wider than the text where graphicx can shrink it.
const FITTED: &str = "\\ifdim\\wd0>\\linewidth\n\
                      \\ifdefined\\resizebox\\resizebox{\\linewidth}{!}{\\usebox0}\\else\\usebox0\\fi\n\
                      \\else\\usebox0\\fi\n";

/// A `table` environment for `\input`: it needs no package, and looks better with booktabs and
/// graphicx.
pub(crate) fn to_latex(table: &Table, label: &str) -> String {
    let mut text = String::new();
    for note in &table.notes {
        text.push_str(&format!("% {}\n", printable(note)));
    }
    text.push_str(RULES); // harmless in a document that has booktabs
    text.push_str("\\begin{table}\n\\centering\n\\scriptsize\n\\setlength{\\tabcolsep}{3pt}\n");
    let caption = escape_latex(&table.caption);
    text.push_str(&format!("\\caption{{{caption}}}\n\\label{{tab:{label}}}\n\\sbox0{{%\n"));
    let alignment: String = (0..table.columns.len()).map(|column| align(table, column)).collect();
    text.push_str(&format!("\\begin{{tabular}}{{{alignment}}}\n\\toprule\n"));
    let titles: Vec<String> = table.columns.iter().map(|c| escape_latex(&c.title)).collect();
    text.push_str(&format!("{} \\\\\n", titles.join(" & ")));
    let mut group = None;
    for row in &table.rows {
        // The first rule separates the head, whether or not there are groups.
        if group.is_none_or(|group: &str| table.grouped && group != row[0].text) {
            text.push_str("\\midrule\n");
        }
        group = Some(&row[0].text); // rows come sorted by it
        let cells = row.iter().map(|cell| {
            let text = escape_latex(&cell.text);
            if cell.best { format!("\\textbf{{{text}}}") } else { text }
        });
        text.push_str(&format!("{} \\\\\n", cells.collect::<Vec<_>>().join(" & ")));
    }
    text.push_str("\\bottomrule\n\\end{tabular}}%\n");
    text.push_str(FITTED);
    for note in &table.notes {
        let note = escape_latex(note);
        text.push_str(&format!("\\par\\smallskip\\parbox{{\\linewidth}}{{{note}}}\n"));
    }
    text.push_str("\\end{table}\n");
    text
}

/// The alignment of a column: a text that would be wider than a third of a line wraps.
fn align(table: &Table, column: usize) -> &'static str {
    const LONG: usize = 40;
    let mut texts = table.rows.iter().filter_map(|row| row.get(column));
    match table.columns[column].number {
        true => "r",
        false if texts.any(|cell| cell.text.chars().count() > LONG) => "p{0.3\\linewidth}",
        false => "l",
    }
}

/// Characters that LaTeX spells.
const SPELLED: [(char, &str); 28] = [
    ('\\', "\\textbackslash{}"),
    ('~', "\\textasciitilde{}"),
    ('^', "\\textasciicircum{}"),
    ('<', "\\textless{}"),
    ('>', "\\textgreater{}"),
    ('|', "\\textbar{}"),
    ('"', "{\\ttfamily\\char34}"),
    ('[', "{[}"),
    (']', "{]}"),
    ('↓', "$\\downarrow$"),
    ('↑', "$\\uparrow$"),
    ('ε', "$\\varepsilon$"),
    ('°', "$^\\circ$"),
    ('–', "--"),
    ('…', "\\ldots{}"),
    ('÷', "$\\div$"),
    ('×', "$\\times$"),
    ('†', "$\\dagger$"),
    ('±', "$\\pm$"),
    ('·', "$\\cdot$"),
    ('≤', "$\\le$"),
    ('≥', "$\\ge$"),
    ('λ', "$\\lambda$"),
    ('θ', "$\\theta$"),
    ('α', "$\\alpha$"),
    ('\u{2019}', "'"),
    ('\u{201c}', "``"),
    ('\u{201d}', "''"),
];

/// Escapes LaTeX's own characters. European letters are passed on, which every LaTeX since 2018 reads
/// as UTF-8. A character at which pdfLaTeX would stop is spelled by its number, such as `U+65E5`.
pub(crate) fn escape_latex(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in printable(text).chars() {
        match SPELLED.iter().find(|(spelled, _)| *spelled == c) {
            Some((_, spelling)) => escaped.push_str(spelling),
            None if "&%$#_{}".contains(c) => escaped.extend(['\\', c]),
            None if c.is_ascii() || ('\u{c0}'..='\u{17e}').contains(&c) => escaped.push(c),
            None => escaped.push_str(&format!("U+{:04X}", u32::from(c))),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn latex_spells_characters_that_pdflatex_cannot_set() {
        assert_eq!(escape_latex("÷ ≤ λ é"), "$\\div$ $\\le$ $\\lambda$ é");
        assert_eq!(escape_latex("日_%"), "U+65E5\\_\\%");
    }

    #[test]
    fn markup_is_left_out_on_a_terminal() {
        for text in ["x86_64", "a*b\\c [d] <e> & |f| #1 ~ $ `g`", "&lt;"] {
            assert_eq!(without_markup(&escape(text)), text);
        }
        assert_eq!(without_markup("# x86\\_64 is **worse**"), "# x86_64 is worse");
    }

    #[test]
    fn long_texts_wrap_and_wide_tables_are_shrunk() {
        let rows = Table::of(&[60, 60]).text("a", |&n| "x".repeat(n)).text("b", |_| "short");
        let table = rows.number("c", |_| "1").table;
        let latex = to_latex(&table, "label");
        assert!(latex.contains("\\begin{tabular}{p{0.3\\linewidth}lr}"), "{latex}");
        assert!(latex.contains("\\ifdefined\\resizebox"), "{latex}");
        let count = |c: char| latex.chars().filter(|&other| other == c).count();
        assert_eq!(count('{'), count('}'), "{latex}");
        assert_eq!(table.without(&["b", "z"]).rows[0].len(), 2);
    }
}
