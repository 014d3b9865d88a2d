//! `medial run-item ITEM.json`: one item, and its records, one a line. `medial run-item DIR --number N`: an item of a
//! planned folder, into that folder.
//!
//! With `--out` the records are kept in a folder of results, and those that are there already are
//! printed without running anything: calling it again does no harm.

mod planned;

use std::fs;
use std::path::PathBuf;

use clap::Args;
use medial_reports::{Record, read_records};

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::output::{note, print_raw};
use crate::run::{
    AXES, Failures, Item, Kept, PlanError, Progress, Provenance, RESULTS, Registry, RunError,
    Store, Supervisor, missing, run_items,
};

/// Arguments of `run-item`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The item, as JSON, or a planned folder.
    item: PathBuf,
    /// Folder of results, for the records and the medial meshes.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Items of the planned folder, by their numbers from 0: `7`, `7,9`, `0-99`. What was run before is not run again.
    #[arg(long, value_name = "N", value_delimiter = ',', conflicts_with = "out")]
    number: Vec<planned::Numbers>,
}

/// Runs the verb.
///
/// # Errors
/// When the item cannot be read, was planned by another build, or the records cannot be kept.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    if !arguments.number.is_empty() {
        return planned::run(&arguments.item, &arguments.number, global, registry);
    }
    let failed = |error: String| Failure::input(format!("{}: {error}", arguments.item.display()));
    if arguments.item.is_dir() {
        let message = "a folder; say which items of it, as in --number 0".to_owned();
        return Err(Failure::usage(format!("{}: {message}", arguments.item.display())));
    }
    let text = fs::read_to_string(&arguments.item).map_err(|error| failed(error.to_string()))?;
    let item: Item = serde_json::from_str(&text).map_err(|error| failed(error.to_string()))?;
    let provenance = Provenance::here();
    if item.binary != provenance.binary_hash {
        return Err(failed(format!(
            "the item was planned by another build of this program ({}, this is {}): plan it again",
            short(&item.binary),
            short(&provenance.binary_hash)
        )));
    }
    let axes = arguments.out.as_ref().map(|out| out.join(AXES));
    let interrupted = interrupt::listen();
    let mut supervisor = Supervisor::new(registry.files(), &provenance, axes, interrupted);
    let mut store = match &arguments.out {
        Some(out) => Some(Store::open(out, RESULTS, &provenance.command)?),
        None => None,
    };
    let left = match &store {
        Some(store) => missing(std::slice::from_ref(&item), store, Failures::Kept).0,
        None => vec![item.clone()],
    };
    let mut progress = Progress::new(global.progress(), left.len());
    let mut records: Vec<Record> = Vec::new();
    let ended = run_items(&left, &mut supervisor, &mut progress, &mut |_, kept: &[Kept]| {
        records.extend(kept.iter().map(|kept| kept.record.clone()));
        match &mut store {
            Some(store) => store.keep(&kept.iter().map(|kept| &kept.record).collect::<Vec<_>>()),
            None => Ok(()),
        }
    });
    drop(progress);
    match ended {
        Err(PlanError::Run(RunError::Interrupted)) => {
            note(global, "interrupted");
            return Ok(Exit::Interrupted);
        }
        ended => ended?,
    }
    if let Some(out) = &arguments.out {
        records = read_records(&out.join(RESULTS)).map_err(Failure::input)?.records;
    }
    print_records(&item, &records)
}

/// Prints the last record of each level, in the order of the levels.
fn print_records(item: &Item, records: &[Record]) -> Result<Exit, Failure> {
    let mut exit = Exit::Done;
    for key in item.keys() {
        let Some(record) = records.iter().rev().find(|record| record.key == key) else { continue };
        let line = serde_json::to_string(record).map_err(Failure::input)?;
        print_raw(&format!("{line}\n"));
        if !record.status.is_ok() {
            exit = Exit::SomeFailed;
        }
    }
    Ok(exit)
}

fn short(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}
