//! `medial collect DIR`: what was run of a planned folder becomes a folder of results, with its report. An archive that
//! somebody else packed is taken in likewise.

mod submitted;

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::args::Global;
use crate::cmd::report;
use crate::exit::{Exit, Failure};
use crate::output::{counted, note, print_json, print_line};
use crate::run::{Gathered, Planned, Provenance, RESULTS, Registry, Store, Study, gather};

/// Arguments of `collect`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The planned folder, or an archive that `medial submit-results` made.
    dir: PathBuf,
    /// Folder of the results; what it has already stays [default: the planned folder itself].
    #[arg(long, value_name = "STORE")]
    out: Option<PathBuf>,
    /// Leave out tables, plots and page; `medial report` makes them.
    #[arg(long)]
    no_report: bool,
    /// Of an archive: the share of its medial meshes that is measured again.
    #[arg(long, value_name = "SHARE", default_value_t = 1.0)]
    rejudge: f64,
    /// Of an archive: surfaces for that, beside the built-in shapes.
    #[arg(long, value_name = "FILES", num_args = 1..)]
    meshes: Vec<PathBuf>,
}

/// Runs the verb. It can be run as often as wanted, also while items are still run.
///
/// # Errors
/// When the folder is none of a plan or was changed, or the results cannot be written.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    if arguments.dir.is_file() {
        return submitted::run(arguments, global, registry);
    }
    let planned = Planned::open(&arguments.dir)?;
    let out = arguments.out.as_ref().unwrap_or(&arguments.dir);
    // The command of the plan made the records, not this one.
    let provenance = Provenance { command: planned.plan.command.clone(), ..Provenance::here() };
    let mut store = Store::open(out, RESULTS, "medial collect")?;
    store.remarks.iter().for_each(|remark| note(global, remark));
    let gathered = gather(&planned, &mut store)?;
    if gathered.added > 0 && *out != arguments.dir {
        let study = Study::read(&arguments.dir.join(report::STUDY))?;
        report::write_study(out, &study, None)?;
    }
    let page = out.join("index.html");
    let any = gathered.added > 0 || gathered.complete > 0;
    // A page of the same records stands: adding one had removed it.
    if !arguments.no_report && any && !page.exists() {
        let rebuilt = report::refresh(out, registry, &provenance, gathered.added)?;
        rebuilt.undrawn.iter().for_each(|why| note(global, why));
    }
    let page = page.exists().then_some(page);
    drop(store);
    tell(&planned, &gathered, out, page.as_deref(), global);
    Ok(if gathered.missing == 0 { Exit::Done } else { Exit::SomeFailed })
}

fn tell(planned: &Planned, gathered: &Gathered, out: &Path, page: Option<&Path>, global: &Global) {
    let Gathered { added, complete, missing, first_missing, damaged } = gathered;
    if global.json {
        let object = json!({
            "out": out, "items": planned.plan.items, "complete": complete, "added": added,
            "missing": missing, "first_missing": first_missing, "page": page,
        });
        print_json(&object, damaged);
        return;
    }
    damaged.iter().for_each(|what| print_line(&format!("warning: {what}")));
    let records = counted(*added as u64, "record");
    let place = page.map_or_else(String::new, |page| format!("; page: {}", page.display()));
    print_line(&format!(
        "{complete} of {} items are done, {records} added to {}{place}",
        planned.plan.items,
        out.join(RESULTS).display()
    ));
    if *missing > 0 {
        let numbers: Vec<String> = first_missing.iter().map(usize::to_string).collect();
        let more = if *missing > numbers.len() { ", ..." } else { "" };
        let missing = counted(*missing as u64, "item");
        print_line(&format!("missing: {missing}, of number {}{more}", numbers.join(", ")));
    }
}
