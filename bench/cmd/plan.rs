//! `medial plan STUDY -o DIR`: the items of a study as files, for many processes on any number of hosts.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::output::{counted, print_json, print_line};
use crate::run::{
    Division, Failures, Here, Item, Provenance, RESULTS, Registry, Store, Study, Supervisor,
    check_travels, missing, refused_params, shell_line, write_plan,
};

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The study, as TOML.
    study: PathBuf,
    /// Folder for the items, their meshes and, later, what was run.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// An item for each level rather than one for each method on each mesh: more and smaller pieces of work, each of
    /// which prepares its mesh anew.
    #[arg(long)]
    split: bool,
    /// Leave out what a folder of results has already.
    #[arg(long, value_name = "STORE")]
    without: Option<PathBuf>,
    /// With `--without`: plan again what failed there.
    #[arg(long, requires = "without")]
    retry_failed: bool,
}

/// Runs the verb.
///
/// # Errors
/// When the study is wrong, an input does not exist, another plan lies in the folder, or it cannot be written.
pub fn run(
    arguments: &Arguments,
    global: &Global,
    registry: &mut Registry,
) -> Result<Exit, Failure> {
    let mut study = Study::read(&arguments.study)?;
    study.threads = global.threads.or(study.threads);
    study.plugins.extend(global.plugins.iter().cloned());
    check_travels(&study)?;
    let provenance = Provenance::here();
    let mut items = study.items(registry, &Here::of(&provenance))?;
    if let Some(dir) = &arguments.without {
        items = not_in(dir, &items, arguments.retry_failed.into(), &provenance)?;
    }
    let mut supervisor = Supervisor::new(registry.files(), &provenance, None, interrupt::listen());
    if let Some(why) = refused_params(&items, &mut supervisor)? {
        return Err(Failure::usage(why));
    }
    drop(supervisor);
    let division = if arguments.split { Division::ByLevel } else { Division::ByMethod };
    let planned = write_plan(&arguments.output, &study, &items, division, &provenance)?;
    let meshes: BTreeSet<&str> = items.iter().map(|item| item.scene.mesh.as_str()).collect();
    let threads = items.first().map_or(1, |item| item.threads);
    let line = parallel_line(&arguments.output, planned.plan.items, threads);
    if global.json {
        let object = json!({
            "out": arguments.output, "items": planned.plan.items, "levels": planned.plan.levels,
            "meshes": meshes.len(), "parallel": line,
        });
        print_json(&object, &[]);
    } else {
        print_line(&summary(&arguments.output, planned.plan.items, planned.plan.levels, &line));
    }
    Ok(Exit::Done)
}

/// What of the items a store has not.
fn not_in(
    dir: &Path,
    items: &[Item],
    failures: Failures,
    provenance: &Provenance,
) -> Result<Vec<Item>, Failure> {
    if !dir.join(RESULTS).is_file() {
        return Err(Failure::input(format!("{}: there is no {RESULTS} in it", dir.display())));
    }
    let store = Store::open(dir, RESULTS, &provenance.command)?;
    Ok(missing(items, &store, failures).0)
}

fn summary(dir: &Path, items: usize, levels: usize, line: &str) -> String {
    let dir = dir.display();
    if items == 0 {
        return format!("{dir}: nothing to run");
    }
    let items = counted(items as u64, "item");
    let levels = counted(levels as u64, "level");
    format!(
        "{items} with {levels} in {dir}; on one machine: {line} && medial collect {dir}; on a cluster: medial submit \
         {dir} --engine slurm"
    )
}

/// The line for GNU parallel that runs all items on this machine.
fn parallel_line(dir: &Path, items: usize, threads: usize) -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = (cores / threads.max(1)).max(1);
    let folder = shell_line(&[dir.display().to_string()]);
    format!(
        "seq 0 {} | parallel -j{jobs} medial run-item {folder} --quiet --number {{}}",
        items.saturating_sub(1)
    )
}
