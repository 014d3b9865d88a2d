//! What a report shows beside the comparison itself, each from a file of its own in the folder:
//! baselines, stability under noise, and the second opinions of other programs.
//!
//! A file that is missing is no error: its part is left out. So they survive a rebuilt report, and a
//! comparison needs none of the programs that made them.

mod baseline;
mod oracles;
mod stability;

use std::fs;
use std::io::{self, Write as _};
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::comparison::Comparison;
use crate::error::ReportError;
use crate::plots::Plot;
use crate::summary::CountSummary;
use crate::tables::Table;

pub use baseline::Baseline;
pub use stability::{AxisShift, NoiseRecord};

/// File of the [`Baseline`]s in the folder of a report, one JSON object on each line.
pub const BASELINES: &str = "baselines.jsonl";
/// File of the [`NoiseRecord`]s, one JSON object on each line.
pub const STABILITY: &str = "stability.jsonl";
/// File with the table of the oracles: `{"made": "...", "rows": [{"metric", "oracle", "input", "result",
/// "agrees"}]}`.
pub const ORACLES: &str = "oracles.json";

/// A section of the page.
pub(crate) struct Extra {
    /// Name of its files and its place on the page.
    pub(crate) stem: &'static str,
    pub(crate) title: &'static str,
    /// What it is, in a paragraph.
    pub(crate) text: String,
    pub(crate) tables: Vec<Table>,
    pub(crate) plots: Vec<Plot>,
    /// Figures that belong to one mesh of the comparison.
    pub(crate) mesh_plots: Vec<(usize, Plot)>,
}

/// The sections for which there is a file in the folder.
pub(crate) fn extras(
    dir: &Path,
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
) -> Result<Vec<Extra>, ReportError> {
    let mut extras = Vec::new();
    extras.extend(baseline::section(dir, comparison, summaries)?);
    extras.extend(stability::section(dir)?);
    extras.extend(oracles::section(dir)?);
    Ok(extras)
}

/// How a file was made: under each of its tables.
fn made_by(version: &str, command: &str) -> String {
    format!("Made by medial {version}, with: {command}")
}

/// Reads the lines of a file; none where there is no file.
///
/// # Errors
/// When the file cannot be read or a line is not what it should be.
pub fn read_lines<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, ReportError> {
    let failed = |source| ReportError::Io { path: path.to_owned(), source };
    let text = match fs::read_to_string(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        text => text.map_err(failed)?,
    };
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    lines
        .map(|(index, line)| {
            serde_json::from_str(line).map_err(|error| {
                let message = format!("line {}: {error}", index + 1);
                failed(io::Error::new(io::ErrorKind::InvalidData, message))
            })
        })
        .collect()
}

/// Replaces a file by one with a JSON object on each line.
///
/// # Errors
/// When the file cannot be written.
pub fn write_lines<T: Serialize>(path: &Path, lines: &[T]) -> Result<(), ReportError> {
    let failed = |source| ReportError::Io { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    for line in lines {
        serde_json::to_writer(&mut bytes, line).map_err(|error| failed(error.into()))?;
        bytes.write_all(b"\n").map_err(failed)?;
    }
    crate::journal::replace_file(path, &bytes).map_err(failed)
}
