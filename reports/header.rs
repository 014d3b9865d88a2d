//! The head of a report: the runs, their dates, their machines, the methods.

use medial::simplifier::{MethodInfo, ParamInfo, Presentation};
use medial_run::record::Machine;
use medial_run::text::file_stems;
use serde::{Deserialize, Serialize};

use crate::comparison::Comparison;

/// The head of a report. The runner passes in everything, so that equal records and headers give equal bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Title of the page.
    pub title: String,
    /// The runs that made the records, in their order.
    #[serde(default)]
    pub runs: Vec<RunNote>,
    /// The methods that can run or have records, for their names and citations.
    #[serde(default)]
    pub methods: Vec<MethodNote>,
    /// The study of the last run, as a file.
    #[serde(default)]
    pub study: Option<String>,
    /// Remarks on all of it, such as lines of the results that could not be read.
    #[serde(default)]
    pub notes: Vec<String>,
    /// Whether the page is part of a [site](crate::write_site).
    #[serde(skip)]
    pub is_site: bool,
}

/// One run of the program that added records.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunNote {
    /// The command line.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// SHA-256 of the program.
    #[serde(default)]
    pub binary_hash: String,
    /// Date of the run, as displayed.
    #[serde(default)]
    pub date: Option<String>,
    /// The machine.
    #[serde(default)]
    pub machine: Option<Machine>,
}

/// A method as the page describes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MethodNote {
    /// Id of the method.
    pub id: String,
    /// Full name.
    pub title: String,
    /// Authors, year, title, venue, DOI.
    pub citation: String,
    /// The same source as BibTeX; empty where there is no publication.
    #[serde(default)]
    pub bibtex: String,
    /// One sentence on what the method does.
    pub summary: String,
    /// One sentence on what the method is best suited for; may be empty.
    #[serde(default)]
    pub home: String,
    /// Meaning of the published level.
    pub published: String,
    /// Name and unit of the method's own level, where it has one.
    #[serde(default)]
    pub native: Option<String>,
    /// Its parameters.
    #[serde(default)]
    pub params: Vec<ParamInfo>,
}

impl MethodNote {
    /// The note of a method and its presentation.
    pub fn new(info: &MethodInfo, presentation: &Presentation) -> Self {
        Self {
            id: info.id.to_string(),
            title: info.title.to_string(),
            citation: info.citation.to_string(),
            bibtex: info.bibtex.to_string(),
            summary: info.summary.to_string(),
            home: presentation.best_for.to_string(),
            published: info.published.to_string(),
            native: info.native.as_ref().map(|native| format!("{} ({})", native.name, native.unit)),
            params: info.params.clone(),
        }
    }

    /// The first clause on what the method is best suited for.
    pub(crate) fn briefly(&self) -> Option<String> {
        let clause = self.home.split([',', ';', ':', '.']).next()?;
        let mut letters = clause.chars();
        Some(letters.next()?.to_lowercase().chain(letters).collect())
    }
}

impl Header {
    /// Name and unit of a method's own level, as the runner passed them in.
    pub(crate) fn native_axis(&self, method: &str) -> Option<&str> {
        self.methods.iter().find(|note| note.id == method)?.native.as_deref()
    }

    /// BibTeX of the methods with these ids and of the program, each entry once.
    pub(crate) fn bibtex(&self, methods: &[&str]) -> String {
        let mut entries: Vec<String> = Vec::new();
        for note in self.methods.iter().filter(|note| methods.contains(&note.id.as_str())) {
            // Several methods share a publication, and BibTeX rejects a repeated key.
            let entry = note.bibtex.trim();
            let key = |entry: &str| entry.split(',').next().unwrap_or_default().to_owned();
            if !entry.is_empty() && !entries.iter().any(|known| key(known) == key(entry)) {
                entries.push(entry.to_owned()); // in the order of the methods
            }
        }
        let last = self.runs.last();
        let version = last.map_or("", |run| &run.version);
        let date = last.and_then(|run| run.date.as_deref()).unwrap_or_default();
        let year = date.get(..4).map_or(String::new(), |year| format!("\n  year = {{{year}}},"));
        entries.push(format!(
            "@misc{{medial,\n  title = {{medial: a reference harness for simplifying the 3D medial \
             axis transform}},\n  author = {{{{The medial developers}}}},{year}\n  url = \
             {{https://github.com/medial-rs/medial}},\n  note = {{Version {version}}}\n}}"
        ));
        entries.join("\n\n") + "\n"
    }

    /// One sentence with version, date and command, for every file.
    pub(crate) fn how(&self) -> String {
        let Some(run) = self.runs.last() else { return "Made by medial.".to_owned() };
        let version = Some(format!(" {}", run.version)).filter(|_| !run.version.is_empty());
        let several = self.runs.len() > 1;
        let earlier = several.then(|| format!(" in {} runs, the last one", self.runs.len()));
        let date = run.date.as_ref().map(|date| format!(", {date}"));
        let command = Some(format!(", with: {}", run.command)).filter(|_| !run.command.is_empty());
        let end = command.unwrap_or_else(|| ".".to_owned());
        let parts = [version, earlier, date].map(Option::unwrap_or_default).concat();
        format!("Made by medial{parts}{end}")
    }
}

/// The methods with records and a description, and the file of the page of each.
pub(crate) fn method_pages<'h>(
    header: &'h Header,
    comparison: &Comparison<'_>,
) -> Vec<(&'h MethodNote, String)> {
    let mut notes: Vec<&MethodNote> = header.methods.iter().collect();
    notes.retain(|note| comparison.methods.contains(&note.id.as_str()));
    let stems = file_stems(notes.iter().map(|note| note.id.as_str()));
    let files = stems.into_iter().map(|stem| format!("method-{stem}.html"));
    notes.into_iter().zip(files).collect()
}
