//! Lists of items: what a store lacks is run and every record kept, by one program or by two builds that take turns,
//! so that a loaded machine slows both alike.
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
use crate::progress::{Progress, Verbosity};
use crate::provenance::{Provenance, hex_digest};
use crate::store::{Store, StoreError};
use crate::study::item::{Item, MethodSpec};

/// The items with the levels that are missing in a store, and the number of levels that are there.
pub fn missing(items: &[Item], store: &Store, retry_failed: bool) -> (Vec<Item>, usize) {
    let mut found = 0;
    let mut left = Vec::new();
    for item in items {
        let levels = store.missing(item, retry_failed);
        found += item.levels.len() - levels.len();
        if !levels.is_empty() {
            left.push(Item { levels, ..item.clone() });
        }
    }
    (left, found)
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
    // Defaults are the methods' own and need no probe.
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

/// Runs items on each side and keeps their records there, as soon as each item is done. With repetitions, the
/// items of one scene take turns, so that a slow minute of the machine does not affect one method
/// alone; then their records are kept after the last turn.
///
/// # Errors
/// When the user interrupts, no worker can be started, or records cannot be kept.
pub fn run_items(
    items: &[Item],
    sides: &mut [Contender<'_>],
    verbosity: Verbosity,
) -> Result<(), RunError> {
    let turns = items.iter().map(|item| item.repeat.max(1)).sum();
    let mut progress = Progress::new(verbosity, turns);
    // A worker keeps the substrates of one scene only.
    for scene in items.chunk_by(|a, b| a.scene == b.scene) {
        let mut waiting: Vec<(&Item, Vec<Vec<Record>>)> = Vec::new();
        for (place, item) in scene.iter().enumerate() {
            progress.at(&format!("{}: {}", item.scene.mesh, item.method.label()));
            let mut kept = vec![vec![]; sides.len()];
            for side in order(place, sides.len()) {
                kept[side] = sides[side].supervisor.run(&sides[side].own(item))?;
                failures(&kept[side]).iter().for_each(|remark| progress.remark(remark));
            }
            progress.done();
            match item.repeat {
                0 | 1 => keep(sides, kept)?,
                _ => waiting.push((item, kept)),
            }
        }
        let turns = waiting.iter().map(|(item, _)| item.repeat).max().unwrap_or(1);
        for turn in 2..=turns {
            if sides.len() > 1 {
                sides.iter_mut().for_each(|side| side.supervisor.renew());
            }
            for (place, (item, kept)) in waiting.iter_mut().enumerate() {
                let (mesh, method) = (&item.scene.mesh, item.method.label());
                progress.at(&format!("{mesh}: {method}, repetition {turn} of {}", item.repeat));
                for side in order(place + turn, sides.len()) {
                    let has_result = kept[side].iter().any(|r| r.status.has_result());
                    if turn <= item.repeat && has_result {
                        let again = sides[side].supervisor.again(&sides[side].own(item))?;
                        merge(&mut kept[side], turn, again);
                    }
                }
                progress.done();
            }
        }
        for (_, kept) in waiting {
            keep(sides, kept)?;
        }
    }
    Ok(())
}

/// The sides in the order of a turn.
// Each begins as often as the others: the second one finds files in the cache of the system.
fn order(turn: usize, sides: usize) -> impl Iterator<Item = usize> {
    (0..sides).map(move |side| (side + turn) % sides)
}

/// Keeps the records of each side, with their seconds replaced by those of the median repetition.
fn keep(sides: &mut [Contender<'_>], kept: Vec<Vec<Record>>) -> Result<(), StoreError> {
    for (side, mut records) in sides.iter_mut().zip(kept) {
        for record in &mut records {
            if let Some(seconds) = median(&record.repetitions, |r| r.seconds) {
                record.simplify.seconds = Some(seconds);
                record.simplify.cpu_seconds = median(&record.repetitions, |r| r.cpu_seconds);
            }
        }
        side.store.keep(&records)?;
    }
    Ok(())
}

/// One remark for each failure, or a single one if all levels failed for the same reason.
fn failures(records: &[Record]) -> Vec<String> {
    let failed: Vec<&Record> = records.iter().filter(|r| r.status.is_failure()).collect();
    // A refused mesh fails at every level for one reason: one line is enough.
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

impl Build {
    /// The build in a file.
    ///
    /// # Errors
    /// In words, when it cannot be read or started, or is another program.
    pub fn of(program: &Path) -> Result<Self, String> {
        let failed = |error: io::Error| format!("{}: {error}", program.display());
        // A worker is started from any folder.
        let program = fs::canonicalize(program).map_err(failed)?;
        let bytes = fs::read(&program).map_err(failed)?;
        // Before any item: the worker of another program would fail at each of them.
        let said = Command::new(&program).arg("--version").output().map_err(failed)?;
        let answer = String::from_utf8_lossy(&said.stdout).trim().to_owned();
        let Some(version) = answer.strip_prefix("medial ") else {
            let (answer, program): (String, _) =
                (answer.chars().take(40).collect(), program.display());
            return Err(format!(
                "{program}: no build of this program: `--version` gave {answer:?}"
            ));
        };
        let provenance = Provenance {
            binary_hash: hex_digest(&bytes),
            version: version.to_owned(),
            ..Provenance::here()
        };
        Ok(Self { program, provenance })
    }
}

/// A side of a run: a program with its workers and its store.
pub struct Contender<'a> {
    /// The build, where it is another program than the running one.
    pub build: Option<Build>,
    /// Its supervisor, whose workers are of this build.
    pub supervisor: Supervisor<'a>,
    /// Where its records are kept.
    pub store: Store,
}

impl Contender<'_> {
    /// An item as this side has to run it.
    pub fn own(&self, item: &Item) -> Item {
        let Some(build) = &self.build else { return item.clone() };
        // Two builds are compared as such: the version of a method is not known of another program.
        let binary = build.provenance.binary_hash.clone();
        Item { version: binary.clone(), binary, ..item.clone() }
    }
}
