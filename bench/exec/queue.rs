//! Lists of items: runs the items that a store lacks and records them, with one program or with two builds that
//! alternate, so that a loaded machine slows both alike.
//!
//! With two builds, each repetition starts new workers: the memory layout of a process changes its speed by more than
//! many a regression. Within a repetition the two sides follow each other item by item, and the side that begins
//! changes from repetition to repetition.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::{fs, io, iter, thread};

use medial_reports::reasons;
use medial_run::hash::hex_digest;
use medial_run::item::{Item, MethodSpec};
use medial_run::outcome::median;
use medial_run::record::{Provenance, Record, Status};

use crate::exec::{Supervisor, merge};
use crate::exit::Failure;
use crate::progress::Progress;
use crate::provenance::provenance;
use crate::store::Store;

/// The items with the levels that a store lacks, and the number of levels that it has.
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

/// The reason for which a method rejects its parameters, found before any run by preparing on a very small shape. Fails
/// when the user interrupts, or no worker can be started.
pub fn refused_params(
    items: &[Item],
    supervisor: &mut Supervisor<'_>,
) -> Result<Option<String>, Failure> {
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

/// Runs items on each side and records each item as soon as it is done. With repetitions, the items of one scene
/// alternate, so that a slow minute of the machine does not affect one method only. Their records are written after
/// the last repetition.
///
/// As many items run at the same time as each side has supervisors. With one supervisor nothing else runs while an item
/// is timed. Fails when the user interrupts, no worker can be started, or records cannot be written.
pub fn run_items(
    items: &[Item],
    sides: &mut [Contender<'_>],
    is_quiet: bool,
) -> Result<(), Failure> {
    let (mut lanes, mut stores): (Vec<Lane<'_, '_>>, _) = (Vec::new(), Vec::new());
    for Contender { supervisors, store } in sides {
        stores.push(store);
        lanes.resize_with(supervisors.len(), Vec::new);
        lanes.iter_mut().zip(supervisors).for_each(|(lane, supervisor)| lane.push(supervisor));
    }
    let takes_turns = |a: &Item, b: &Item| a.scene == b.scene && a.repeat > 1 && b.repeat > 1;
    let turns = items.iter().flat_map(|item| iter::repeat_n(seconds(item), item.repeat.max(1)));
    let desk = Mutex::new(Desk {
        jobs: lanes.len(),
        batches: items.chunk_by(takes_turns).enumerate().collect(),
        stores,
        progress: Progress::new(is_quiet, turns.collect()),
    });
    thread::scope(|scope| {
        let lanes: Vec<_> =
            lanes.iter_mut().map(|lane| scope.spawn(|| work(lane, &desk))).collect();
        let ended = lanes.into_iter().map(|lane| lane.join().expect("a lane does not panic"));
        // Waits for all lanes and returns the first error.
        ended.collect::<Vec<_>>().into_iter().collect()
    })
}

/// The cost of a turn of an item against others, for the estimate of the remaining time.
fn seconds(item: &Item) -> f64 {
    medial_methods::usual_seconds(&item.method.id).unwrap_or(UNKNOWN)
}

/// The cost of a method from elsewhere.
const UNKNOWN: f64 = 3.0;

/// One supervisor of each side.
type Lane<'s, 'a> = Vec<&'s mut Supervisor<'a>>;

/// The state that the lanes share.
struct Desk<'d> {
    jobs: usize,
    /// Items that take turns, with the number of the batch.
    batches: VecDeque<(usize, &'d [Item])>,
    stores: Vec<&'d mut Store>,
    progress: Progress,
}

fn lock<'m, 'd>(desk: &'m Mutex<Desk<'d>>) -> MutexGuard<'m, Desk<'d>> {
    desk.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs batches until there are none.
fn work(lane: &mut Lane<'_, '_>, desk: &Mutex<Desk<'_>>) -> Result<(), Failure> {
    loop {
        let Some((number, batch)) = lock(desk).batches.pop_front() else { return Ok(()) };
        let ended = run_batch(number, batch, lane, desk);
        let mut desk = lock(desk);
        if let Err(error) = ended.and_then(|records| desk.record(records)) {
            // The other lanes end after their present items.
            desk.batches.clear();
            return Err(error);
        }
    }
}

/// Runs the items of a batch with their repetitions on each side, and returns the records by item and side.
fn run_batch(
    number: usize,
    batch: &[Item],
    lane: &mut Lane<'_, '_>,
    desk: &Mutex<Desk<'_>>,
) -> Result<Vec<Vec<Vec<Record>>>, Failure> {
    let mut all = vec![vec![vec![]; lane.len()]; batch.len()];
    for turn in 1..=batch[0].repeat.max(1) {
        if turn > 1 && lane.len() > 1 {
            lane.iter_mut().for_each(|supervisor| supervisor.renew());
        }
        for (place, (item, by_side)) in batch.iter().zip(&mut all).enumerate() {
            lock(desk).progress.at(&item.scene.mesh, item.method.label(), [turn, item.repeat]);
            // Each side begins equally often: the second one profits from the file cache of the system.
            let first = number + place + turn;
            let sides = lane.len();
            for side in (0..sides).map(|side| (side + first) % sides) {
                let records = &mut by_side[side];
                if turn == 1 {
                    *records = lane[side].run(item)?;
                    reasons(records).iter().for_each(|it| lock(desk).progress.remark(it));
                } else if records.iter().any(|record| record.status.has_result()) {
                    let again = lane[side].again(item, records)?;
                    merge(records, turn, again);
                }
            }
            lock(desk).progress.done(seconds(item));
        }
    }
    Ok(all)
}

impl Desk<'_> {
    /// Records a batch with the seconds of the median repetition.
    fn record(&mut self, all: Vec<Vec<Vec<Record>>>) -> Result<(), Failure> {
        for sides in all {
            for (store, mut records) in self.stores.iter_mut().zip(sides) {
                for record in &mut records {
                    if let Some(seconds) = median(&record.repetitions, |r| r.seconds) {
                        record.simplify.seconds = Some(seconds);
                        record.simplify.cpu_seconds =
                            median(&record.repetitions, |r| r.cpu_seconds);
                    }
                    record.conditions.jobs = self.jobs;
                }
                store.append(&records)?;
            }
        }
        Ok(())
    }
}

/// How many records have a status.
pub fn count(records: &[Record], status: Status) -> usize {
    records.iter().filter(|record| record.status == status).count()
}

/// A build of the program.
#[derive(Clone, Debug)]
pub struct Build {
    pub program: PathBuf,
    /// The origin of its records.
    pub provenance: Provenance,
}

impl Build {
    /// The build in a file. Fails when it cannot be read or started, or is another program.
    pub fn of(program: &Path) -> Result<Self, String> {
        let failed = |error: io::Error| format!("{}: {error}", program.display());
        // A worker is started from any folder.
        let program = fs::canonicalize(program).map_err(failed)?;
        let bytes = fs::read(&program).map_err(failed)?;
        // Before any item: the worker of another program would fail at each of them.
        let output = Command::new(&program).arg("--version").output().map_err(failed)?;
        let output = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        let Some(version) = output.strip_prefix("medial ") else {
            let (found, program) = (format!("{output:.40}"), program.display());
            return Err(format!(
                "{program}: not a build of medial (`--version` printed {found:?})"
            ));
        };
        let provenance = Provenance {
            binary_hash: hex_digest(&bytes),
            version: version.to_owned(),
            ..provenance()
        };
        Ok(Self { program, provenance })
    }
}

/// A side of a run: a program with its workers and its store.
pub struct Contender<'a> {
    /// Its supervisors, all of one build: the number of items that run at the same time.
    pub supervisors: Vec<Supervisor<'a>>,
    pub store: Store,
}
