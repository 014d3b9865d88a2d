//! Lists of items: what a store lacks is run and every record kept; and two builds that take turns, so that a
//! loaded machine slows both alike.
//!
//! Each repetition of two builds has a worker of its own on either side: where a process happens to lie in memory
//! changes its speed by more than many a regression. Within a repetition the two sides follow each other item by
//! item, and the side that begins changes from repetition to repetition.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{fs, io};

use medial_reports::{Record, Status};

use crate::exec::{RunError, Supervisor, merge};
use crate::measure::median;
use crate::progress::Progress;
use crate::provenance::{Provenance, hex_digest};
use crate::store::{Failures, Store, StoreError};
use crate::study::item::{Item, MethodSpec};

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
pub(crate) fn finished(mut kept: Vec<Record>) -> Vec<Record> {
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
    let shown = if alike { 1 } else { failed.len() };
    let mut remarks = Vec::new();
    for record in failed.into_iter().take(shown) {
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
        remarks.push(format!("{mesh}, {method}, {level}: {status}{reason}"));
    }
    remarks
}

/// How many records have a status.
pub fn count(records: &[Record], status: Status) -> usize {
    records.iter().filter(|record| record.status == status).count()
}

/// A build of the program.
#[derive(Clone, Debug)]
pub struct Build {
    /// The program file.
    pub program: PathBuf,
    /// The origin of its records.
    pub provenance: Provenance,
}

/// Why a file is no build.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// It cannot be read.
    #[error("{}: {source}", program.display())]
    Read {
        /// The file.
        program: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// It does not answer as this program does.
    #[error("{}: no build of this program: `--version` gave {answer:?}", program.display())]
    Foreign {
        /// The file.
        program: PathBuf,
        /// The beginning of what it said.
        answer: String,
    },
}

impl Build {
    /// The build in a file.
    ///
    /// # Errors
    /// When it cannot be read or started, or is another program.
    pub fn of(program: &Path) -> Result<Self, BuildError> {
        let failed = |source| BuildError::Read { program: program.to_owned(), source };
        // A worker is started from any folder.
        let program = fs::canonicalize(program).map_err(failed)?;
        let bytes = fs::read(&program).map_err(failed)?;
        let said = Command::new(&program).arg("--version").output().map_err(failed)?;
        let answer = String::from_utf8_lossy(&said.stdout).trim().to_owned();
        let Some(version) = answer.strip_prefix("medial ") else {
            let answer = answer.chars().take(40).collect();
            return Err(BuildError::Foreign { program, answer });
        };
        let provenance = Provenance {
            binary_hash: hex_digest(&bytes),
            version: version.to_owned(),
            ..Provenance::here()
        };
        Ok(Self { program, provenance })
    }

    /// An item as this build has to run it.
    pub fn own(&self, item: &Item) -> Item {
        // Two builds are compared as such: the version of a method is not known of another program.
        let binary = self.provenance.binary_hash.clone();
        Item { version: binary.clone(), binary, ..item.clone() }
    }
}

/// A build with its store and what gives it items.
pub struct Contender<'a> {
    /// The build.
    pub build: Build,
    /// Its supervisor, whose workers are of this build.
    pub supervisor: Supervisor<'a>,
    /// Where its records are kept.
    pub store: Store,
}

/// An item that is under way on both sides.
type Running<'i> = (&'i Item, [Vec<Record>; 2]);

/// Runs on both sides what either lacks, mesh by mesh, all repetitions in turn, and keeps the records.
///
/// # Errors
/// As [`run_items`].
pub fn run_alternately(
    items: &[Item],
    contenders: &mut [Contender<'_>; 2],
    progress: &mut Progress,
) -> Result<(), PlanError> {
    for scene in items.chunk_by(|a, b| a.scene == b.scene) {
        let mut running: Vec<Running<'_>> = Vec::new();
        for item in scene {
            progress.at(&format!("{}: {}", item.scene.mesh, item.method.label()));
            let mut kept = [vec![], vec![]];
            for side in order(running.len()) {
                let Contender { build, supervisor, .. } = &mut contenders[side];
                kept[side] = supervisor.run(&build.own(item))?;
            }
            running.push((item, kept));
            progress.done();
        }
        let turns = scene.iter().map(|item| item.repeat).max().unwrap_or(1);
        for turn in 2..=turns {
            repeat(&mut running, turn, contenders, progress)?;
        }
        for (_, kept) in running {
            for (kept, contender) in kept.into_iter().zip(contenders.iter_mut()) {
                contender.store.keep(&finished(kept))?;
            }
        }
    }
    Ok(())
}

/// The items that either side lacks in its store.
pub fn missing_in_either(items: &[Item], contenders: &[Contender<'_>; 2]) -> Vec<Item> {
    let mut lacking = items.to_vec();
    lacking.retain(|item| {
        contenders.iter().any(|contender| {
            let own = contender.build.own(item);
            !contender.store.missing(&own, Failures::Kept).is_empty()
        })
    });
    lacking
}

/// One more repetition of all items of a mesh.
fn repeat(
    running: &mut [Running<'_>],
    turn: usize,
    contenders: &mut [Contender<'_>; 2],
    progress: &mut Progress,
) -> Result<(), PlanError> {
    contenders.iter_mut().for_each(|contender| contender.supervisor.renew());
    for (place, (item, kept)) in running.iter_mut().enumerate() {
        let (scene, method) = (&item.scene.mesh, item.method.label());
        progress.at(&format!("{scene}: {method}, repetition {turn} of {}", item.repeat));
        for side in order(place + turn) {
            let has_result = kept[side].iter().any(|r| r.status.has_result());
            if turn <= item.repeat && has_result {
                let Contender { build, supervisor, .. } = &mut contenders[side];
                let again = supervisor.again(&build.own(item))?;
                merge(&mut kept[side], turn, again);
            }
        }
        progress.done();
    }
    Ok(())
}

/// Which side begins.
fn order(turn: usize) -> [usize; 2] {
    if turn.is_multiple_of(2) { [0, 1] } else { [1, 0] }
}
