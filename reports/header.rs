//! What stands above the results: what was run, when and where.

use medial::simplifier::MethodInfo;
use serde::{Deserialize, Serialize};

use crate::record::Machine;

/// The head of a report. Nothing in it is found out here: the runner passes it in, so that the
/// same records and the same header give the same bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Title of the page.
    pub title: String,
    /// The command line that made the records.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// When the comparison was run, as it is to be shown.
    #[serde(default)]
    pub date: Option<String>,
    /// Where it was run; taken from the records where absent.
    #[serde(default)]
    pub machine: Option<Machine>,
    /// The methods that were run, for their names and citations.
    #[serde(default)]
    pub methods: Vec<MethodNote>,
    /// Remarks on the whole run, such as lines of the results that could not be read.
    #[serde(default)]
    pub notes: Vec<String>,
}

/// What the page says of a method.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MethodNote {
    /// Id of the method.
    pub id: String,
    /// Full name.
    pub title: String,
    /// Authors, year, title, venue, DOI.
    pub citation: String,
    /// One sentence on what the method does.
    pub summary: String,
    /// What the published level means.
    pub published: String,
}

impl From<&MethodInfo> for MethodNote {
    fn from(info: &MethodInfo) -> Self {
        Self {
            id: info.id.to_owned(),
            title: info.title.to_owned(),
            citation: info.citation.to_owned(),
            summary: info.summary.to_owned(),
            published: info.published.to_owned(),
        }
    }
}

impl Header {
    /// How the files were made: a sentence that stands in each of them.
    pub(crate) fn how(&self) -> String {
        let version =
            if self.version.is_empty() { String::new() } else { format!(" {}", self.version) };
        let date = self.date.as_ref().map_or(String::new(), |date| format!(", {date}"));
        if self.command.is_empty() {
            format!("Made by medial{version}{date}.")
        } else {
            format!("Made by medial{version}{date}, with: {}", self.command)
        }
    }
}
