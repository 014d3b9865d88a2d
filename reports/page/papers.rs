//! What a paper takes over: a text on the methods, its LaTeX, BibTeX, and where plots and tables stand.

use crate::page::{Page, html};
use crate::papers::{BIBTEX, LATEX, TEXT};
use crate::plots::FONTS;
use crate::text::escape_html;

/// The section; empty where there is no record.
pub(crate) fn section(page: &Page<'_>) -> String {
    let Some(papers) = page.papers else { return String::new() };
    format!(
        "<section id=\"papers\">\n<h2>For papers</h2>\n\
         <p>All plots stand as SVG in <code>plots/</code>, lettered in {FONTS}; all tables as LaTeX in \
         <code>tables/</code>, to be taken in by <code>\\input</code>. They need no package; with \
         <code>booktabs</code> their rules are finer, with <code>graphicx</code> those that are wider than \
         the text are shrunk to it. A plot as PDF: \
         <code>rsvg-convert -f pdf -o x.pdf plots/x.svg</code> (librsvg).</p>\n{}{}{}</section>\n",
        block("Methods, as text", TEXT, &papers.text),
        block("Methods, as LaTeX", LATEX, &papers.latex),
        block("BibTeX of the methods and the program", BIBTEX, &papers.bibtex),
    )
}

/// One text with a button that copies it.
fn block(title: &str, file: &str, text: &str) -> String {
    // Line by line: the lines of a preformatted text are part of it.
    let lines: Vec<String> = text.lines().map(escape_html).collect();
    format!(
        "<div class=\"paste\">\n<h3>{}</h3>\n<p><button type=\"button\" hidden>Copy</button> \
         <a href=\"{}\">{file}</a> <output></output></p>\n<pre tabindex=\"0\">{}\n</pre>\n</div>\n",
        escape_html(title),
        html::local_link(file).unwrap_or_default(),
        lines.join("\n")
    )
}
