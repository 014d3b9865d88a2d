//! `medial submit DIR --engine slurm`: what is missing of a planned folder becomes jobs of a batch engine.
//!
//! 1. What every missing item will need: `Earlier::need`, from records of an earlier run or from the limits.
//! 2. Items of like needs become a class, a class an array of tasks: `classes`.
//! 3. A script and a list of items for each class, and one script that collects: `script`.
//! 4. The engine gets them: `slurm`.
//!
//! Each submission has a folder of its own, `slurm/NUMBER`, with everything that it ran by.

mod classes;
mod estimate;
mod script;
mod slurm;

use std::collections::HashSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use medial::write_atomically;
use serde_json::json;

use self::classes::{Class, classes};
use self::estimate::{Earlier, Need};
use self::script::Submission;
use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::host::Host;
use crate::output::{counted, print_json, print_line, print_raw};
use crate::run::{Planned, Provenance, not_done, shell_line};

/// The engines that there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Engine {
    /// Slurm: job arrays.
    Slurm,
}

/// Arguments of `submit`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The planned folder, which all nodes must see under this path.
    dir: PathBuf,
    /// The batch engine.
    #[arg(long, value_enum)]
    engine: Engine,
    /// At most so many tasks of each array run at the same time [default: as many as there is room for].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    throttle: Option<u32>,
    /// A folder of earlier results: ask for the time and memory that the same methods took there, with a margin
    /// [default: the limits of the study].
    #[arg(long, value_name = "STORE")]
    like: Option<PathBuf>,
    /// A task runs several items one after another, for about so long.
    #[arg(long, value_name = "MINUTES", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..))]
    task_minutes: u32,
    /// Put another option into each script, such as `--option=--partition=long`; can be given several times.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    option: Vec<String>,
    /// Submit although jobs of an earlier submission are in the queue.
    #[arg(long)]
    anyway: bool,
    /// Print the scripts; write and submit nothing.
    #[arg(long)]
    dry_run: bool,
}

/// Runs the verb.
///
/// # Errors
/// When the folder was planned by another build, jobs for it are in the queue still, the records of an earlier run cannot
/// be read, or the engine refuses.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let dir = fs::canonicalize(&arguments.dir)
        .map_err(|error| Failure::input(format!("{}: {error}", arguments.dir.display())))?;
    let planned = Planned::open(&dir)?;
    let here = Provenance::here();
    planned.check_build(&here)?;
    let number = next_number(&dir);
    if !arguments.dry_run && !arguments.anyway {
        refuse_queued(&dir, number)?;
    }
    let needs = needs(&planned, arguments.like.as_deref(), &submitted(&dir, number)?)?;
    let classes = classes(&needs, f64::from(arguments.task_minutes) * 60.0);
    let submission = Submission {
        dir: &dir,
        number,
        program: format!("slurm/medial-{}", &here.binary_hash[..12]),
        throttle: arguments.throttle,
        options: &arguments.option,
        classes: &classes,
    };
    if arguments.dry_run {
        print_scripts(&submission, global);
        return Ok(Exit::Done);
    }
    if classes.is_empty() {
        tell(&submission, &[], global);
        return Ok(Exit::Done);
    }
    write(&submission)
        .map_err(|(path, error)| Failure::input(format!("{}: {error}", path.display())))?;
    let jobs = slurm::submit(&submission)?;
    tell(&submission, &jobs, global);
    Ok(Exit::Done)
}

/// What the missing items need. Those that were submitted before and are missing still may have been ended for too little
/// time or memory: they get all that the study allows.
fn needs(
    planned: &Planned,
    like: Option<&Path>,
    submitted: &HashSet<usize>,
) -> Result<Vec<Need>, Failure> {
    let mut earlier = match like {
        Some(store) => Earlier::read(store)?,
        None => Earlier::default(),
    };
    let mut needs = Vec::new();
    for numbered in not_done(planned) {
        let (number, item) = numbered?;
        needs.push(match submitted.contains(&number) {
            true => Need::at_most(number, &item),
            false => earlier.need(number, &item, planned.dir()),
        });
    }
    Ok(needs)
}

/// The folder of a submission, from the planned one on.
fn folder(number: usize) -> PathBuf {
    PathBuf::from(format!("slurm/{number:03}"))
}

fn next_number(dir: &Path) -> usize {
    (0..).find(|&number| !dir.join(folder(number)).exists()).unwrap_or(0)
}

/// The items of the earlier submissions.
fn submitted(dir: &Path, next: usize) -> Result<HashSet<usize>, Failure> {
    let mut items = HashSet::new();
    for number in 0..next {
        let path = dir.join(folder(number)).join(script::SUBMITTED);
        let text = match fs::read_to_string(&path) {
            // The submission did not get so far.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            text => text.map_err(|error| Failure::input(format!("{}: {error}", path.display())))?,
        };
        items.extend(text.split_whitespace().filter_map(|word| word.parse::<usize>().ok()));
    }
    Ok(items)
}

/// A second submission beside the first would run items twice, which does no harm but wastes the machines.
fn refuse_queued(dir: &Path, next: usize) -> Result<(), Failure> {
    let queued = slurm::queued(dir, next)?;
    let Some(job) = queued.first() else { return Ok(()) };
    Err(Failure::input(format!(
        "{}: job {job} of an earlier submission is in the queue; wait for it, end it with `scancel {job}`, or add --anyway",
        dir.display()
    )))
}

/// Writes everything that the jobs run by. The program is copied, since one that is built anew in the meantime would be
/// refused by every task from then on.
fn write(submission: &Submission<'_>) -> Result<(), (PathBuf, io::Error)> {
    let dir = submission.dir;
    let logs = dir.join(folder(submission.number)).join(script::LOGS);
    fs::create_dir_all(&logs).map_err(|error| (logs, error))?;
    let program = dir.join(&submission.program);
    copy_program(&program).map_err(|error| (program, error))?;
    for (file, text) in submission.files() {
        let path = dir.join(&file);
        write_atomically(&path, |out| out.write_all(text.as_bytes()))
            .map_err(|error| (path, error))?;
    }
    Ok(())
}

fn copy_program(to: &Path) -> io::Result<()> {
    if to.exists() {
        return Ok(());
    }
    let host = Host::here()?;
    let (bytes, like) = match host.is_foreign() {
        false => (fs::read(&host.code)?, &host.code),
        // An interpreter with its packages cannot be copied: jobs start it where it is.
        true => (starter(host).into_bytes(), &host.program),
    };
    write_atomically(to, |out| out.write_all(&bytes))?;
    fs::set_permissions(to, fs::metadata(like)?.permissions())
}

/// A script that starts the command as it was started here.
fn starter(host: &Host) -> String {
    let words =
        std::iter::once(host.program.as_os_str()).chain(host.arguments.iter().map(AsRef::as_ref));
    let words: Vec<String> = words.map(|word| word.to_string_lossy().into_owned()).collect();
    format!("#!/bin/sh\nexec {} \"$@\"\n", shell_line(&words))
}

fn print_scripts(submission: &Submission<'_>, global: &Global) {
    let files = submission.files();
    if global.json {
        let files: serde_json::Map<_, _> =
            files.into_iter().map(|(file, text)| (file, text.into())).collect();
        print_json(&json!({ "files": files, "items": submission.items() }), &[]);
        return;
    }
    for (file, text) in files {
        print_raw(&format!("### {file}\n{text}\n"));
    }
    print_line(&format!("### {}", sentence(submission)));
}

fn sentence(submission: &Submission<'_>) -> String {
    let items = submission.items();
    if items == 0 {
        return format!("nothing is missing; medial collect {}", submission.dir.display());
    }
    let tasks: usize = submission.classes.iter().map(|class| class.tasks.len()).sum();
    let arrays = counted(submission.classes.len() as u64, "array");
    let (items, tasks) = (counted(items as u64, "item"), counted(tasks as u64, "task"));
    format!("{items} as {tasks} in {arrays}")
}

fn tell(submission: &Submission<'_>, jobs: &[String], global: &Global) {
    if global.json {
        let class = |class: &Class| {
            json!({
                "items": class.items(), "tasks": class.tasks.len(), "minutes": class.minutes,
                "megabytes": class.megabytes, "threads": class.threads,
            })
        };
        let classes: Vec<_> = submission.classes.iter().map(class).collect();
        let object = json!({
            "folder": submission.dir.join(folder(submission.number)),
            "items": submission.items(), "classes": classes, "jobs": jobs,
        });
        print_json(&object, &[]);
        return;
    }
    match jobs.split_last() {
        None => print_line(&sentence(submission)),
        Some((collect, arrays)) => print_line(&format!(
            "{}: jobs {}; job {collect} collects when they have ended; scripts and logs: {}",
            sentence(submission),
            arrays.join(", "),
            submission.dir.join(folder(submission.number)).display()
        )),
    }
}
