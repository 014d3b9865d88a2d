//! A run of a list of items: the missing levels are run, and every record is kept.

use medial_reports::{Record, Status};

use super::record::median;
use super::store::{Failures, Store, StoreError};
use super::supervise::{RunError, Supervisor, merge};
use super::{Item, MethodSpec, Progress};

/// The counts of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Levels that were run now.
    pub run: usize,
    /// Levels whose records were there already.
    pub found: usize,
}

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// No worker, or the user wants no more.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A record cannot be kept.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Takes the records of an item as soon as they are complete.
pub type Keep<'a> = dyn FnMut(&Item, &[Record]) -> Result<(), StoreError> + 'a;

/// The items with the levels that are missing in a store, and what was found there.
pub fn missing(items: &[Item], store: &Store, failures: Failures) -> (Vec<Item>, Tally) {
    let mut tally = Tally::default();
    let mut left = Vec::new();
    for item in items {
        let levels = store.missing(item, failures);
        tally.found += item.levels.len() - levels.len();
        if !levels.is_empty() {
            left.push(Item { levels, ..item.clone() });
        }
    }
    (left, tally)
}

/// Why a method does not take its parameters, found before anything is run, by preparing on the smallest of shapes.
///
/// # Errors
/// When the user interrupts, or no worker can be started.
pub fn refused_params(
    items: &[Item],
    supervisor: &mut Supervisor<'_>,
) -> Result<Option<String>, RunError> {
    let mut seen: Vec<&MethodSpec> = Vec::new();
    for item in items.iter().filter(|item| !item.method.params.0.is_empty()) {
        if !seen.contains(&&item.method) {
            seen.push(&item.method);
            if let Some(why) = supervisor.refused_params(item)? {
                return Ok(Some(format!("{}: {why}", item.method.id)));
            }
        }
    }
    Ok(None)
}

/// Runs items and passes their records to `keep`, as soon as each item is done. With repetitions, the
/// items of one scene take turns, so that a slow minute of the machine does not affect one method
/// alone; then their records are kept after the last turn.
///
/// # Errors
/// When the user interrupts, no worker can be started, or `keep` fails.
pub fn run_items(
    items: &[Item],
    supervisor: &mut Supervisor<'_>,
    progress: &mut Progress,
    keep: &mut Keep<'_>,
) -> Result<(), PlanError> {
    for scene in items.chunk_by(|a, b| a.scene == b.scene) {
        let mut waiting: Vec<(&Item, Vec<Record>)> = Vec::new();
        for item in scene {
            progress.at(&format!("{}: {}", item.scene.mesh, item.method.label()));
            let kept = supervisor.run(item)?;
            failures(&kept.iter().collect::<Vec<_>>())
                .iter()
                .for_each(|remark| progress.remark(remark));
            if item.repeat <= 1 {
                keep(item, &finished(kept))?;
            } else {
                waiting.push((item, kept));
            }
            progress.done();
        }
        let turns = waiting.iter().map(|(item, _)| item.repeat).max().unwrap_or(1);
        for turn in 2..=turns {
            for (item, kept) in &mut waiting {
                if turn <= item.repeat && kept.iter().any(|r| r.status.has_result()) {
                    progress.at(&format!(
                        "{}: {}, repetition {turn} of {}",
                        item.scene.mesh,
                        item.method.label(),
                        item.repeat
                    ));
                    let again = supervisor.again(item)?;
                    merge(kept, turn, again);
                }
            }
        }
        for (item, kept) in waiting {
            keep(item, &finished(kept))?;
        }
    }
    Ok(())
}

/// The records, with their seconds replaced by those of the median repetition.
pub(super) fn finished(mut kept: Vec<Record>) -> Vec<Record> {
    for record in &mut kept {
        if let Some(seconds) = median(&record.repetitions, |r| r.seconds) {
            record.simplify.seconds = Some(seconds);
            record.simplify.cpu_seconds = median(&record.repetitions, |r| r.cpu_seconds);
        }
    }
    kept
}

/// One remark for each failure, or a single one if all levels failed for the same reason.
fn failures(records: &[&Record]) -> Vec<String> {
    let failed: Vec<&&Record> = records.iter().filter(|r| r.status.is_failure()).collect();
    let alike = failed.len() == records.len()
        && failed.iter().all(|r| r.status == failed[0].status && r.reason == failed[0].reason);
    let remark = |record: &&&Record| {
        let Record { mesh, simplify, status, reason, .. } = record;
        let reason = reason.as_deref().unwrap_or("no reason");
        let level = match records.len() {
            2.. if alike => "all levels".to_owned(),
            _ => simplify.level.to_string(),
        };
        let method = simplify.variant.as_ref().unwrap_or(&simplify.method);
        // Some reasons begin with the status themselves.
        let status = status.to_string();
        let status =
            if reason.starts_with(&status) { String::new() } else { format!("{status}: ") };
        format!("{mesh}, {method}, {level}: {status}{reason}")
    };
    failed.iter().take(if alike { 1 } else { failed.len() }).map(remark).collect()
}

/// How many records have a status.
pub fn count(records: &[Record], status: Status) -> usize {
    records.iter().filter(|record| record.status == status).count()
}
