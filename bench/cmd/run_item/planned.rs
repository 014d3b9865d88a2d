//! Items of a planned folder: what was run before is left as it is, everything else is run and kept beside it.

use std::path::Path;
use std::str::FromStr;

use medial_reports::Record;
use serde_json::json;

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::output::{counted, note, print_json, print_line};
use crate::run::{
    AXES, Item, Kept, PlanError, Planned, Progress, Provenance, Registry, RunError, Supervisor,
    done_file, keep_done, read_done, run_items,
};

/// The numbers of items: one, or all from one to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Numbers {
    first: usize,
    last: usize,
}

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        let number = |text: &str| {
            text.parse::<usize>().map_err(|_| format!("`{text}` is no number of an item"))
        };
        let (first, last) = (number(first)?, number(last)?);
        if last < first {
            return Err(format!("`{text}`: the last item comes before the first"));
        }
        Ok(Self { first, last })
    }
}

/// An item that is to be run, and the file of its records.
struct Waiting {
    item: Item,
    file: std::path::PathBuf,
}

/// Runs those of the items that were not run yet, one after another in one worker. That a method failed is a result as
/// any other here: the exit code tells whether the records are there.
///
/// # Errors
/// When the folder was planned by another build or is damaged, a mesh is missing, or the records cannot be kept. Items
/// that are done by then are kept.
pub fn run(
    dir: &Path,
    numbers: &[Numbers],
    global: &Global,
    registry: &Registry,
) -> Result<Exit, Failure> {
    let planned = Planned::open(dir)?;
    let here = Provenance::here();
    planned.check_build(&here)?;
    let (waiting, found) = waiting(&planned, numbers, global)?;
    let provenance = Provenance { command: planned.plan.command.clone(), ..here };
    let interrupted = interrupt::listen();
    let mut supervisor =
        Supervisor::new(registry.files(), &provenance, Some(dir.join(AXES)), interrupted);
    let mut progress = Progress::new(global.progress(), waiting.len());
    let mut run = 0;
    for Waiting { item, file } in waiting {
        // As late as possible: another process may have run it in the meantime.
        if read_done(&dir.join(&file), &item).is_ok_and(|records| records.is_some()) {
            progress.done();
            continue;
        }
        let item = planned.resolved(item)?;
        let mut kept: Vec<Record> = Vec::new();
        let ended = run_items(
            std::slice::from_ref(&item),
            &mut supervisor,
            &mut progress,
            &mut |_, records: &[Kept]| {
                kept.extend(records.iter().map(|kept| kept.record.clone()));
                Ok(())
            },
        );
        match ended {
            Err(PlanError::Run(RunError::Interrupted)) => {
                note(global, "interrupted; the items that were done are kept");
                return Ok(Exit::Interrupted);
            }
            ended => ended?,
        }
        keep_done(&dir.join(&file), &kept.iter().collect::<Vec<_>>())?;
        run += 1;
    }
    drop(progress);
    match global.json {
        true => print_json(&json!({ "out": dir, "run": run, "found": found }), &[]),
        false => print_line(&format!(
            "{} run now, {found} found; {}",
            counted(run, "item"),
            dir.display()
        )),
    }
    Ok(Exit::Done)
}

/// The items that have no records, and how many have. All numbers are looked up before anything is run.
fn waiting(
    planned: &Planned,
    numbers: &[Numbers],
    global: &Global,
) -> Result<(Vec<Waiting>, usize), Failure> {
    let (mut waiting, mut found) = (Vec::new(), 0);
    for number in numbers.iter().flat_map(|numbers| numbers.first..=numbers.last) {
        let item = planned.item(number)?;
        let file = done_file(number, &item);
        match read_done(&planned.dir().join(&file), &item) {
            Ok(Some(_)) => found += 1,
            Ok(None) => waiting.push(Waiting { item, file }),
            Err(error) => {
                note(global, &format!("{error}; the item is run again"));
                waiting.push(Waiting { item, file });
            }
        }
    }
    Ok((waiting, found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_one_or_a_range() {
        assert_eq!("7".parse(), Ok(Numbers { first: 7, last: 7 }));
        assert_eq!("3-9".parse(), Ok(Numbers { first: 3, last: 9 }));
        for wrong in ["", "x", "9-3", "-3", "3-"] {
            assert!(wrong.parse::<Numbers>().is_err(), "{wrong}");
        }
    }
}
