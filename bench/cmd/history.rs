//! `medial history add` and `medial history show`: the results of many nights, and what they tell.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use medial_reports::history::{Findings, History, HistoryError, Night};
use medial_reports::{BadLine, read_records};
use serde_json::json;

use super::report::today;
use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::files;
use crate::output::{note, print_json, print_line};
use crate::run::RESULTS;

/// Arguments of `history`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Add the results of one commit to a history: one small text file for each night.
    Add(Add),
    /// Say which series stepped at which night and commits, and which results changed.
    Show(Show),
}

#[derive(Debug, Args)]
struct Add {
    /// Folder of results of `medial compare`.
    store: PathBuf,
    /// Folder of the history; made where it is missing.
    #[arg(long, value_name = "FOLDER")]
    to: PathBuf,
    /// Hash of the commit that was measured.
    #[arg(long, value_name = "HASH")]
    commit: String,
    /// Date of the night [default: today in UTC].
    #[arg(long, value_name = "YYYY-MM-DD")]
    date: Option<String>,
}

#[derive(Debug, Args)]
struct Show {
    /// Folder of the history.
    folder: PathBuf,
    /// Write a page, too.
    #[arg(long, short, value_name = "PAGE.html")]
    output: Option<PathBuf>,
    /// Least size of a step of seconds or memory, as a share.
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    least_step: f64,
}

/// Runs the verb.
///
/// # Errors
/// When the results or the history cannot be read, the night cannot be kept, or the page cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    match &arguments.verb {
        Verb::Add(arguments) => add(arguments, global),
        Verb::Show(arguments) => show(arguments, global),
    }
}

fn add(arguments: &Add, global: &Global) -> Result<Exit, Failure> {
    let Add { store, to, commit, date } = arguments;
    let journaled = read_records(&store.join(RESULTS)).map_err(Failure::input)?;
    let named = |line: &BadLine| format!("{}: {line}", store.join(RESULTS).display());
    let warnings: Vec<String> = journaled.bad_lines.iter().map(named).collect();
    let date = date.clone().unwrap_or_else(today);
    let night = Night::of_records(&journaled.records, commit, &date).map_err(|error| {
        let message = match &error {
            // These say what is wrong in the store, and do not name it.
            HistoryError::Empty | HistoryError::Mixed { .. } => {
                format!("{}: {error}", store.display())
            }
            _ => error.to_string(),
        };
        Failure::input(message)
    })?;
    let series = night.series.len();
    let (path, new) = History::add(to, night).map_err(Failure::input)?;
    if global.json {
        print_json(&json!({ "file": path, "series": series, "new": new }), &warnings);
        return Ok(Exit::Done);
    }
    warnings.iter().for_each(|warning| note(global, &format!("warning: {warning}")));
    let what = if new { "added" } else { "there already, with the same content" };
    print_line(&format!("{}: {series} series, {what}", path.display()));
    Ok(Exit::Done)
}

fn show(arguments: &Show, global: &Global) -> Result<Exit, Failure> {
    let Show { folder, output, least_step } = arguments;
    if !(*least_step > 0.0 && least_step.is_finite()) {
        return Err(Failure::usage(format!(
            "--least-step {least_step}: a positive share is meant"
        )));
    }
    if let Some(page) = output {
        files::check_folder(page)?;
    }
    let history = History::read(folder).map_err(Failure::input)?;
    let damaged: Vec<String> = history.damaged.iter().map(ToString::to_string).collect();
    if history.nights.is_empty() {
        let why = damaged.first().map_or("no night in it".to_owned(), Clone::clone);
        let message = format!("{}: {why}", folder.display());
        return Err(Failure { code: Exit::NothingMeasured, message });
    }
    let findings = Findings::of(&history, *least_step);
    if let Some(page) = output {
        write_page(page, &findings, &damaged)?;
    }
    if global.json {
        print_json(&findings.to_json(), &damaged);
    } else {
        damaged.iter().for_each(|file| note(global, &format!("warning: left out: {file}")));
        print_line(findings.to_markdown().trim_end());
    }
    let (steps, changes) = findings.regressions();
    Ok(if steps.is_empty() && changes.is_empty() { Exit::Done } else { Exit::Regression })
}

fn write_page(page: &Path, findings: &Findings<'_>, damaged: &[String]) -> Result<(), Failure> {
    let remarks: Vec<String> = damaged.iter().map(|file| format!("Left out: {file}")).collect();
    let html = findings.to_html(&remarks);
    medial::write_atomically(page, |out| out.write_all(html.as_bytes()))
        .map_err(|error| Failure::input(format!("{}: {error}", page.display())))
}
