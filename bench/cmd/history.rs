//! `medial history DIR`: the change points of many runs.

use std::path::PathBuf;

use clap::Args;
use medial_reports::history::{Findings, Run, read_runs};
use medial_run::journal::read_records;
use serde_json::{json, to_value};

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::output::{note, print_json, print_markdown};
use crate::store::RESULTS;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Folder of the history: one file for each run.
    folder: PathBuf,
    /// Add the results of `medial compare` in STORE as a run.
    #[arg(long, value_name = "STORE", requires_all = ["commit", "date"])]
    add: Option<PathBuf>,
    /// Set the hash of the measured commit.
    #[arg(long, value_name = "HASH", requires = "add")]
    commit: Option<String>,
    /// Set the date of the commit, as printed by `git show -s --format=%cI`.
    #[arg(long, value_name = "DATE", requires = "add")]
    date: Option<String>,
}

/// Runs the verb. Fails when the results or the history cannot be read, or the run cannot be added.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let folder = &arguments.folder;
    let (added, mut warnings) = add(arguments)?;
    let (runs, damaged) = read_runs(folder)?;
    warnings.extend(damaged.iter().map(|error| format!("skipped: {error}")));
    if runs.is_empty() {
        let why = warnings.first().map_or("no runs; add one by --add".to_owned(), Clone::clone);
        let message = format!("{}: {why}", folder.display());
        return Err(Failure { code: Exit::NothingMeasured, message });
    }
    let findings = Findings::of(&runs);
    if global.json {
        let mut object = to_value(&findings).map_err(Failure::input)?;
        object["added"] = json!(added);
        print_json(&object, &warnings);
    } else {
        warnings.iter().for_each(|warning| note(global, &format!("warning: {warning}")));
        print_markdown(&findings.to_markdown());
    }
    Ok(if findings.regressions == 0 { Exit::Done } else { Exit::Regression })
}

/// Adds the run of `--add`: its file, unless the history had it, and warnings.
fn add(arguments: &Arguments) -> Result<(Option<PathBuf>, Vec<String>), Failure> {
    let Arguments { folder, add: Some(store), commit: Some(commit), date: Some(date), .. } =
        arguments
    else {
        return Ok((None, vec![]));
    };
    let path = store.join(RESULTS);
    let journaled = read_records(&path)?;
    let warnings = journaled.bad_lines.iter().map(|line| format!("{}: {line}", path.display()));
    let run = Run::of_records(&journaled.records, commit, date)
        .map_err(|error| Failure::input(format!("{}: {error}", store.display())))?;
    let (file, is_new) = run.add_to(folder)?;
    Ok((is_new.then_some(file), warnings.collect()))
}
