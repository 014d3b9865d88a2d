//! The second opinions: what other programs say of the same numbers.

use std::fs;
use std::io;
use std::path::Path;

use serde::Deserialize;

use super::{Extra, ORACLES};
use crate::error::ReportError;
use crate::tables::{Cell, Column, Row, Table};

#[derive(Deserialize)]
struct Oracles {
    /// How and when the file was made.
    #[serde(default)]
    made: String,
    rows: Vec<Opinion>,
}

/// One metric against one other program or route.
#[derive(Deserialize)]
struct Opinion {
    metric: String,
    oracle: String,
    input: String,
    /// What came out, with figures.
    result: String,
    /// `yes`, `no` or `skipped`.
    agrees: String,
}

/// The section; `None` where the oracles were never run.
pub(super) fn section(dir: &Path) -> Result<Option<Extra>, ReportError> {
    let path = dir.join(ORACLES);
    let bytes = match fs::read(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        bytes => bytes.map_err(|source| ReportError::Io { path: path.clone(), source })?,
    };
    let oracles: Oracles = serde_json::from_slice(&bytes)
        .map_err(|error| ReportError::Io { path: path.clone(), source: error.into() })?;
    let disagreeing = oracles.rows.iter().filter(|row| row.agrees == "no").count();
    let skipped = oracles.rows.iter().filter(|row| row.agrees == "skipped").count();
    let row = |row: Opinion| Row {
        cells: [row.metric, row.oracle, row.input, row.result, row.agrees].map(Cell::new).into(),
        starts_group: false,
    };
    let count = oracles.rows.len();
    let columns = ["metric", "second opinion", "input", "result", "agrees"];
    let table = Table {
        caption: "Metrics and what other programs say of the same numbers".to_owned(),
        notes: vec![oracles.made],
        columns: columns.map(Column::text).into(),
        rows: oracles.rows.into_iter().map(row).collect(),
    };
    let text = format!(
        "Every metric has an independent second opinion: another program, or another route to the \
         same number in the test suite. {count} comparisons, {disagreeing} of them in disagreement, \
         {skipped} skipped."
    );
    Ok(Some(Extra {
        stem: "oracles",
        title: "Oracles",
        text,
        tables: vec![table],
        plots: vec![],
        mesh_plots: vec![],
    }))
}
