//! The methods that were run, and the program, as BibTeX.

use std::collections::BTreeMap;

use crate::comparison::Comparison;
use crate::header::{Header, MethodNote};
use crate::papers::citation::{Citation, parse, pieces};
use crate::papers::facts::Facts;
use crate::tables::escape_latex;

/// Key of the program's own entry.
const PROGRAM: &str = "medial";

/// Entries and the keys to cite them by.
pub(crate) struct Bibliography {
    entries: Vec<Entry>,
    /// Of each method that was run: its keys, none where no citation is known.
    keys: BTreeMap<String, Vec<String>>,
    /// Key of the program.
    pub(crate) program: String,
}

/// One entry; the fields hold BibTeX already.
struct Entry {
    kind: &'static str,
    key: String,
    fields: Vec<(&'static str, String)>,
}

impl Bibliography {
    /// Of the methods with a record, in the order of the header, and the program last.
    pub(crate) fn of(header: &Header, comparison: &Comparison<'_>, facts: &Facts) -> Self {
        let mut all = Self { entries: vec![], keys: BTreeMap::new(), program: String::new() };
        let ran = |note: &&MethodNote| comparison.methods.contains(&note.id.as_str());
        for note in header.methods.iter().filter(ran) {
            let mut keys = Vec::new();
            for (index, piece) in pieces(&note.citation).into_iter().enumerate() {
                let key = match index {
                    0 => all.free_key(&note.id),
                    _ => all.free_key(&format!("{}-{}", note.id, index + 1)),
                };
                all.entries.push(Entry::of(key.clone(), note, piece));
                keys.push(key);
            }
            all.keys.insert(note.id.clone(), keys);
        }
        all.program = all.free_key(PROGRAM);
        all.entries.push(Entry::of_program(all.program.clone(), facts));
        all
    }

    /// The keys of a method; none where no citation is known.
    pub(crate) fn keys(&self, method: &str) -> &[String] {
        self.keys.get(method).map_or(&[], Vec::as_slice)
    }

    /// The content of a `.bib` file.
    pub(crate) fn to_bibtex(&self) -> String {
        let entries: Vec<String> = self.entries.iter().map(Entry::to_bibtex).collect();
        entries.join("\n")
    }

    /// A key that is not taken, made of characters that every BibTeX reads.
    fn free_key(&self, wanted: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' };
        let wanted: String = wanted.chars().map(plain).collect();
        let wanted = if wanted.is_empty() { "method".to_owned() } else { wanted };
        // BibTeX takes keys that differ in case alone for one.
        let is_taken =
            |key: &str| self.entries.iter().any(|entry| entry.key.eq_ignore_ascii_case(key));
        let numbered = (2..).map(|number| format!("{wanted}-{number}"));
        let mut keys = std::iter::once(wanted.clone()).chain(numbered);
        keys.find(|key| !is_taken(key)).unwrap_or(wanted)
    }
}

impl Entry {
    /// The entry of one citation of a method.
    fn of(key: String, note: &MethodNote, piece: &str) -> Self {
        match parse(piece) {
            Some(citation) => Self::of_citation(key, &citation),
            None => Self {
                kind: "misc",
                fields: vec![
                    ("key", escape(&note.id)),
                    ("title", whole(&note.title)),
                    ("note", escape(piece)),
                ],
                key,
            },
        }
    }

    fn of_citation(key: String, citation: &Citation) -> Self {
        let authors: Vec<String> = citation.authors.iter().map(|name| escape(name)).collect();
        let mut fields = vec![("author", authors.join(" and ")), ("title", whole(&citation.title))];
        let kind = match &citation.venue {
            None => "misc",
            Some(venue) if is_journal(venue, citation) => {
                fields.push(("journal", escape(venue)));
                "article"
            }
            Some(venue) => {
                fields.push(("booktitle", escape(venue)));
                "inproceedings"
            }
        };
        fields.push(("year", citation.year.clone()));
        let more = [("volume", &citation.volume), ("number", &citation.number)];
        fields.extend(more.into_iter().filter_map(|(name, value)| Some((name, value.clone()?))));
        // As it is: the packages that show it want it so, and it holds plain characters alone.
        fields.extend(citation.doi.clone().map(|doi| ("doi", doi)));
        Self { kind, key, fields }
    }

    /// The program without a year: two reports of the same records are the same.
    fn of_program(key: String, facts: &Facts) -> Self {
        let mut fields = vec![
            ("key", "medial".to_owned()),
            ("title", whole("medial: simplification of the 3D medial axis transform")),
        ];
        let what = [facts.versions("Version", "Versions"), facts.builds("build", "builds")];
        let what: Vec<String> = what.into_iter().flatten().collect();
        if !what.is_empty() {
            fields.push(("note", escape(&what.join(", "))));
        }
        fields.push(("url", env!("CARGO_PKG_REPOSITORY").to_owned()));
        Self { kind: "misc", key, fields }
    }

    fn to_bibtex(&self) -> String {
        let fields: Vec<String> =
            self.fields.iter().map(|(name, value)| format!("  {name} = {{{value}}}")).collect();
        format!("@{}{{{},\n{}\n}}\n", self.kind, self.key, fields.join(",\n"))
    }
}

/// Whether a venue is a journal: it has volumes, or says so.
fn is_journal(venue: &str, citation: &Citation) -> bool {
    let words = ["Journal", "Transactions", "Letters"];
    citation.volume.is_some() || words.iter().any(|word| venue.contains(word))
}

/// A title in braces of its own, so that no style changes its capitals.
fn whole(title: &str) -> String {
    format!("{{{}}}", escape(title))
}

/// LaTeX in which braces are balanced, as BibTeX counts the escaped ones too.
fn escape(text: &str) -> String {
    escape_latex(text).replace("\\{", "\\textbraceleft{}").replace("\\}", "\\textbraceright{}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn note(citation: &str) -> MethodNote {
        MethodNote {
            id: "mine".to_owned(),
            title: "Mine & {yours".to_owned(),
            citation: citation.to_owned(),
            ..MethodNote::default()
        }
    }

    #[test]
    fn an_entry_has_the_fields_that_stand_there() {
        let text = "Pan Li, Bin Wang 2015. Q-MAT. ACM Transactions on Graphics 35(1). \
                    https://doi.org/10.1145/2753755";
        let entry = Entry::of("qmat".to_owned(), &note(text), text).to_bibtex();
        let expected = "@article{qmat,\n  author = {Pan Li and Bin Wang},\n  title = {{Q-MAT}},\n  \
                        journal = {ACM Transactions on Graphics},\n  year = {2015},\n  volume = {35},\n  \
                        number = {1},\n  doi = {10.1145/2753755}\n}\n";
        assert_eq!(entry, expected);
        let text = "A B 2006. Title. 3DPVT. doi:10.1109/3DPVT.2006.117";
        let entry = Entry::of("aof".to_owned(), &note(text), text).to_bibtex();
        assert!(entry.starts_with("@inproceedings{aof,") && entry.contains("booktitle = {3DPVT}"));
    }

    #[test]
    fn what_cannot_be_read_is_a_note_with_balanced_braces() {
        let text = "Told by {a friend\\ & 100 %_#~^$";
        let entry = Entry::of("mine".to_owned(), &note(text), text).to_bibtex();
        assert!(entry.starts_with("@misc{mine,\n  key = {mine},\n"), "{entry}");
        assert!(entry.contains("note = {Told by \\textbraceleft{}a friend"), "{entry}");
        let count = |brace: char| entry.chars().filter(|&c| c == brace).count();
        assert_eq!(count('{'), count('}'), "{entry}");
    }
}
