//! `medial diff OLD NEW`: regressions from one set of results to another.
//!
//! With `--run` the two are builds of this program, which first run a study alternately.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use clap::Args;
use medial_reports::diff::{Diff, Meaning};
use medial_run::item::Item;
use medial_run::record::Record;

use crate::args::Global;
use crate::exec::Supervisor;
use crate::exec::queue::{Build, Contender, run_items};
use crate::exit::{Exit, Failure};
use crate::files;
use crate::interrupt;
use crate::output::{note, print_error, print_json, print_markdown};
use crate::provenance::provenance;
use crate::rebuild::records;
use crate::store::{AXES, RESULTS, Store, claim, is_store, listed};
use crate::study::Study;
use crate::study::registry::Registry;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Older results (a folder or its `results.jsonl`), or the older program with `--run`.
    old: PathBuf,
    /// Newer results, or the newer program.
    new: PathBuf,
    /// Run a study with two builds of this program alternately.
    #[arg(long, requires = "study")]
    run: bool,
    /// Read the study from this TOML file.
    #[arg(long, value_name = "FILE", requires = "run")]
    study: Option<PathBuf>,
    /// Write both results and the difference to this folder, and skip items that it already has.
    #[arg(long, value_name = "DIR", default_value = "medial-diff", requires = "run")]
    out: PathBuf,
    /// Time each item N times.
    #[arg(long, value_name = "N", default_value_t = 10, requires = "run")]
    repeat: usize,
}

/// Runs the verb. Fails when the records of a side cannot be read, or with `--run` a program is not a build of this
/// one, the study is wrong, or results cannot be written.
pub fn run(
    arguments: &Arguments,
    global: &Global,
    registry: &mut Registry,
) -> Result<Exit, Failure> {
    let [old, new] = match arguments.run {
        true => match alternate(arguments, global, registry)? {
            Some(sides) => sides,
            None => return Ok(Exit::Interrupted),
        },
        false => [some_records(&arguments.old, global)?, some_records(&arguments.new, global)?],
    };
    let names = [&arguments.old, &arguments.new].map(|path| path.display().to_string());
    let diff = Diff::new(names, &old, &new, arguments.run);
    let markdown = diff.to_markdown();
    // Without `--run` both folders belong to the user: nothing is written there.
    if arguments.run {
        let json = serde_json::to_string_pretty(&diff).map_err(Failure::input)?;
        files::write(&arguments.out.join("diff.md"), markdown.as_bytes())?;
        files::write(&arguments.out.join("diff.json"), json.as_bytes())?;
    }
    if global.json {
        print_json(&diff, &[]);
    } else {
        print_markdown(&markdown);
    }
    Ok(match diff.count(Meaning::Regression) {
        _ if diff.compared == 0 => Exit::NothingMeasured,
        0 => Exit::Done,
        _ => Exit::Regression,
    })
}

/// The records of a folder or of a file, at least one.
fn some_records(path: &Path, global: &Global) -> Result<Vec<Record>, Failure> {
    let (records, bad_lines) = records(path)?;
    let file = if path.is_dir() { path.join(RESULTS) } else { path.to_owned() };
    if let Some(bad) = bad_lines.first() {
        let count = bad_lines.len();
        note(global, &format!("{}: {count} unreadable lines; {bad}", file.display()));
    }
    if records.is_empty() {
        return Err(Failure::input(format!("{}: no record", file.display())));
    }
    Ok(records)
}

/// Runs the study with both builds. Returns the records of both, or `None` after an interrupt.
fn alternate(
    arguments: &Arguments,
    global: &Global,
    registry: &mut Registry,
) -> Result<Option<[Vec<Record>; 2]>, Failure> {
    let path = arguments.study.as_ref().expect("required by --run");
    let mut study = Study::read(path)?;
    // Single runs differ by more than typical regressions.
    study.repeat = arguments.repeat;
    // The CPU seconds of several threads that wait for each other vary too much.
    study.threads = global.threads.or(study.threads).or(Some(1));
    // The levels that a budget skips depend on the machine's load: only the time limit applies.
    study.budget = study.timeout;
    for file in &study.plugins {
        registry.add_plugins(&study.resolved(file)).map_err(Failure::usage)?;
    }
    registry.remarks.iter().for_each(|remark| note(global, remark));
    let here = provenance();
    let items = study.items(registry, &here)?;
    let folders = ["old", "new"].map(|side| arguments.out.join(side));
    let entries: Vec<_> = listed(&arguments.out).collect();
    claim(&arguments.out, is_store(&folders[0]), &entries)?;
    // Before the process listens for interrupts: another program may never end.
    let builds = [&arguments.old, &arguments.new].map(|program| Build::of(program));
    let interrupted = interrupt::listen();
    let mut sides = Vec::new();
    for (build, folder) in builds.into_iter().zip(folders) {
        let build = build.map_err(Failure::input)?;
        let store = Store::open(&folder, &here.command)?;
        store.remarks.iter().for_each(|remark| note(global, remark));
        let axes = Some(folder.join(AXES));
        let mut supervisor = Supervisor::new(&registry.files, &build.provenance, axes, interrupted);
        supervisor.program = Some(build.program);
        sides.push(Contender { supervisors: vec![supervisor], store });
    }
    let mut left = items.clone();
    // Both sides again where one lacks a level: seconds compare only within one session.
    left.retain(|item| {
        sides
            .iter()
            .any(|side| !side.store.missing(&side.supervisors[0].own(item), false).is_empty())
    });
    let ended = run_items(&left, &mut sides, global.quiet);
    if interrupt::stop_listening() {
        print_error(
            "interrupted: recorded the finished results; run the same command again to resume",
        );
        return Ok(None);
    }
    ended?;
    let [old, new] = [&sides[0], &sides[1]].map(|side| requested_records(side, &items, global));
    Ok(Some([old?, new?]))
}

/// The records of one side.
// The folder may also have records of other studies and builds.
fn requested_records(
    contender: &Contender<'_>,
    items: &[Item],
    global: &Global,
) -> Result<Vec<Record>, Failure> {
    let keys = items.iter().flat_map(|item| contender.supervisors[0].own(item).keys());
    let keys: HashSet<String> = keys.collect();
    let mut records = some_records(&contender.store.dir, global)?;
    records.retain(|record| keys.contains(&record.key));
    Ok(records)
}
