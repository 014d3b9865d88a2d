//! Two builds of the program run the same items in turn, so that a loaded machine slows both alike.
//!
//! Each repetition has a worker of its own on either side: where a process happens to lie in memory changes its speed
//! by more than many a regression, and would be taken for one if it were drawn only once. Within a repetition the two
//! sides follow each other item by item, and the side that begins changes from repetition to repetition.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use medial_reports::Record;

use super::plan::{PlanError, finished};
use super::store::{Failures, Store};
use super::supervise::{Supervisor, merge};
use super::{Item, Progress, Provenance, hex_digest};

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
/// As [`run_items`](super::run_items).
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
    let lacks = |item: &&Item| {
        contenders.iter().any(|contender| {
            let own = contender.build.own(item);
            !contender.store.missing(&own, Failures::Kept).is_empty()
        })
    };
    items.iter().filter(lacks).cloned().collect()
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
