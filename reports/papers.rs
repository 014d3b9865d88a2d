//! What a paper takes from a report: BibTeX of the methods, and a text on how the results were
//! made.
//!
//! The text says only what the records and the header hold, and names what they do not.

mod bibtex;
mod citation;
mod facts;
mod prose;

use crate::comparison::Comparison;
use crate::header::Header;
use crate::papers::bibtex::Bibliography;

/// Names of the files, below the folder of the report.
pub(crate) const BIBTEX: &str = "tables/methods.bib";
pub(crate) const TEXT: &str = "tables/methods.txt";
pub(crate) const LATEX: &str = "tables/methods.tex";

/// What stands ready to be copied; each is the whole content of its file.
pub(crate) struct Papers {
    /// BibTeX of the methods that were run, and of the program.
    pub(crate) bibtex: String,
    /// How the results were made, as plain text with the keys of the citations.
    pub(crate) text: String,
    /// The same as LaTeX.
    pub(crate) latex: String,
}

/// From the header and the records that count; `None` where there is no record.
pub(crate) fn papers(header: &Header, comparison: &Comparison<'_>) -> Option<Papers> {
    if comparison.entries.is_empty() {
        return None;
    }
    let facts = facts::Facts::of(comparison);
    let bibliography = Bibliography::of(header, comparison, &facts);
    let prose = prose::Prose::of(header, comparison, &facts, &bibliography);
    Some(Papers {
        bibtex: bibliography.to_bibtex(),
        text: prose.to_text(),
        latex: prose.to_latex(),
    })
}
