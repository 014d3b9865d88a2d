//! The supervisor: gives items to a worker, watches time and memory, and records every kind of end of
//! a worker, so that one broken method never stops the rest.
//!
//! | file | side |
//! |---|---|
//! | `mod`, `worker` | supervisor: requests, limits, ends |
//! | `protocol` | messages between both |
//! | `serve` | worker |
//! | `queue` | lists of items, and two builds in turn |

pub mod protocol;
pub mod queue;
pub mod serve;
mod worker;

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitStatus;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use medial_run::item::{Item, Limits};
use medial_run::level::Target;
use medial_run::outcome::failure_record;
use medial_run::record::{Provenance, Record, Repetition, Status};
use medial_run::scene::SceneSpec;
use medial_run::timed::Fault;

use crate::check::Outcome;
use crate::exec::protocol::{CheckItem, Event, PROTOCOL, Request};
use crate::exec::worker::{Worker, WorkerOptions};
use crate::exit::{Exit, Failure};
use crate::plugin::last_line;
use crate::process_tree::ending_signal;

/// Runs items one after another, in a worker that it replaces when an item has broken it.
pub struct Supervisor<'a> {
    /// The program of the workers; `None` for the running one.
    pub program: Option<PathBuf>,
    plugins: Vec<PathBuf>,
    provenance: Provenance,
    axes: Option<PathBuf>,
    /// Set when the user interrupts the run.
    interrupted: &'a AtomicBool,
    worker: Option<Worker>,
    /// The last input that a worker loaded, with its SHA-256.
    input: Option<(SceneSpec, String)>,
    /// An input that ended its worker.
    // Its other items are not tried: they would end the next worker at the same place.
    lost: Option<(SceneSpec, Fault)>,
}

/// The times of a repetition of a level, and a hash of its result.
type Repeated = (Target, Result<(Repetition, String), Fault>);

/// How an attempt at some levels ended.
enum Attempt {
    /// The worker finished the request.
    Finished,
    Refused(String),
    /// The worker is gone.
    Ended(Stage, Fault),
}

impl<'a> Supervisor<'a> {
    /// A supervisor whose workers load the same plug-in files. Results are saved below `axes`.
    pub fn new(
        plugins: &[PathBuf],
        provenance: &Provenance,
        axes: Option<PathBuf>,
        interrupted: &'a AtomicBool,
    ) -> Self {
        Self {
            program: None,
            plugins: plugins.to_vec(),
            provenance: provenance.clone(),
            axes,
            interrupted,
            worker: None,
            input: None,
            lost: None,
        }
    }

    /// An item with the version of these workers.
    pub fn own(&self, item: &Item) -> Item {
        if self.program.is_none() {
            return item.clone();
        }
        // Two builds are compared as a whole: the method versions of another program are unknown.
        let binary = self.provenance.binary_hash.clone();
        Item { version: binary.clone(), binary, ..item.clone() }
    }

    /// Ends the worker: the next item gets a new process.
    pub fn renew(&mut self) {
        self.worker = None;
    }

    /// Runs an item: a record for each level, in the order of the levels.
    ///
    /// When a worker ends, the records that it reported stay. Levels that it finished but did not report run again. The
    /// level that ended it gets the reason, and later levels are skipped. Fails when the user interrupts, or no worker
    /// can be started.
    pub fn run(&mut self, item: &Item) -> Result<Vec<Record>, Failure> {
        let (item, mut records): (_, Vec<Record>) = (&self.own(item), Vec::new());
        // A stack: groups that are split off run before later ones, from fine to coarse.
        let mut groups = vec![item.levels.clone()];
        while let Some(levels) = groups.pop() {
            let part = Item { levels, ..item.clone() };
            let (attempt, reported) = self.attempt(&part)?;
            let mut missing = part.levels.clone();
            // Records that were reported before the end of the worker count.
            missing.retain(|level| reported.iter().all(|record| record.simplify.level != *level));
            records.extend(reported);
            let mut fail = |levels: &[Target], fault: &Fault| {
                records.extend(levels.iter().map(|&level| self.failed(item, level, fault)));
            };
            match attempt {
                Attempt::Finished => {
                    let reason = "the worker reported no result of this level".to_owned();
                    fail(&missing, &Fault { status: Status::Failed, reason });
                }
                Attempt::Refused(reason) => {
                    fail(&missing, &Fault { status: Status::Refused, reason });
                }
                Attempt::Ended(Stage::Simplifying(reached), fault) => {
                    let at = part.levels[reached];
                    let reason = format!("not run: the method ended its process at {at}");
                    let not_run = Fault { reason, ..fault.clone() };
                    let mut before = Vec::new();
                    for level in &missing {
                        match part.levels.iter().position(|other| other == level) {
                            Some(place) if place < reached => before.push(*level),
                            Some(place) if place == reached => fail(&[*level], &fault),
                            _ => fail(&[*level], &not_run),
                        }
                    }
                    if !before.is_empty() {
                        groups.push(before);
                    }
                }
                Attempt::Ended(Stage::Measuring, _) if missing.len() > 1 => {
                    // Run one by one, to find the result that cannot be measured.
                    groups.extend(missing.iter().rev().map(|&level| vec![level]));
                }
                Attempt::Ended(stage, fault) => {
                    fail(&missing, &fault);
                    // The scene ended the worker, not the method: every other method on it would end there, too.
                    if stage == Stage::Loading {
                        self.lost = Some((item.scene.clone(), fault));
                    }
                }
            }
        }
        // Levels that ran again come last.
        records.sort_by_key(|record| item.levels.iter().position(|&l| l == record.simplify.level));
        Ok(records)
    }

    /// Times all levels of an item that have a result once more.
    pub fn again(
        &mut self,
        item: &Item,
        first: &[Record],
    ) -> Result<Result<Vec<Repeated>, Fault>, Failure> {
        let mut item = item.clone();
        // The first run has decided which levels fit the budget.
        item.limits.budget = None;
        item.levels.retain(|&level| {
            first.iter().any(|record| record.simplify.level == level && record.status.has_result())
        });
        let request = Request::Again { item };
        let mut repeated = Vec::new();
        let attempt = self.converse(&request, &mut |event| {
            if let Event::Repeated(level, outcome) = event {
                repeated.push((level, outcome));
            }
        })?;
        Ok(match attempt {
            Attempt::Finished => Ok(repeated),
            Attempt::Refused(reason) => Err(Fault { status: Status::Refused, reason }),
            Attempt::Ended(_, fault) => Err(fault),
        })
    }

    /// The reason for which a method rejects its parameters, found by preparing it on a very small shape.
    pub fn refused_params(&mut self, item: &Item) -> Result<Option<String>, Failure> {
        let request = Request::Probe { item: item.clone() };
        let mut refused = None;
        // A method that ends its worker does not reject its parameters.
        self.converse(&request, &mut |event| {
            if let Event::WrongParameter(why) = event {
                refused = Some(why);
            }
        })?;
        Ok(refused)
    }

    /// Runs one case of the conformance corpus on a method. A method that ends its worker fails.
    pub fn check(&mut self, item: &CheckItem) -> Result<Outcome, Failure> {
        let request = Request::Check(item.clone());
        let (mut outcome, mut at) = (None, String::new());
        let attempt = self.converse(&request, &mut |event| match event {
            Event::Doing(what) => at = what,
            Event::Checked(end) => outcome = Some(end),
            _ => {}
        })?;
        let outcome = match attempt {
            Attempt::Ended(_, fault) => Outcome::Failed(format!("{} (at: {at})", fault.reason)),
            Attempt::Refused(why) => Outcome::Failed(why),
            Attempt::Finished => {
                outcome.unwrap_or_else(|| Outcome::Failed("the worker reported no outcome".into()))
            }
        };
        // A method that went wrong may have left locks and caches in any state.
        if matches!(outcome, Outcome::Failed(_)) {
            self.worker = None;
        }
        Ok(outcome)
    }

    fn failed(&self, item: &Item, level: Target, fault: &Fault) -> Record {
        let mut record = failure_record(item, level, fault, &self.provenance);
        // The hash of the bytes that the worker has read, if any: the planned hash may be older.
        let ready = self.input.as_ref().filter(|(scene, _)| *scene == item.scene);
        record.mesh_hash = ready.map(|(_, hash)| hash.clone()).or(record.mesh_hash);
        record
    }

    fn attempt(&mut self, item: &Item) -> Result<(Attempt, Vec<Record>), Failure> {
        if let Some((scene, fault)) = &self.lost
            && *scene == item.scene
        {
            return Ok((Attempt::Ended(Stage::Preparing, fault.clone()), vec![]));
        }
        let (axes, provenance) = (self.axes.clone(), Box::new(self.provenance.clone()));
        let request = Request::Run { item: item.clone(), axes, provenance };
        let mut reported = Vec::new();
        let attempt = self.converse(&request, &mut |event| {
            if let Event::Record(record) = event {
                reported.push(*record);
            }
        })?;
        // A method that panicked may have left locks and caches in any state.
        if reported.iter().any(|record| record.status == Status::Panicked) {
            self.worker = None;
        }
        Ok((attempt, reported))
    }

    /// Sends a request to a worker and handles its events until it finishes or ends.
    fn converse(
        &mut self,
        request: &Request,
        each: &mut dyn FnMut(Event),
    ) -> Result<Attempt, Failure> {
        let (item, (_, limits)) = (request.item(), request.terms());
        let mut worker = self.worker_for(request)?;
        let mut stage = Stage::Loading;
        let (mut refused, mut memory_refused) = (None, false);
        if worker.send(request).is_err() {
            // It ended while it was idle: try a new one.
            drop(worker);
            worker = self.worker_for(request)?;
            match worker.send(request) {
                // It ended at once: its status says why, when its output ends.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {}
                sent => sent.map_err(not_started)?,
            }
        }
        let (mut since, mut looked) = (Instant::now(), Instant::now());
        loop {
            if self.interrupted.load(Ordering::Relaxed) {
                worker.end();
                return Err(Failure { code: Exit::Interrupted, message: "interrupted".to_owned() });
            }
            // Also between events: a worker that sends events without end must not escape the limit.
            if since.elapsed() > limits.time() {
                worker.end();
                return Ok(Attempt::Ended(stage, timed_out(stage, &limits)));
            }
            // The memory limit of the worker does not cover the programs that it started.
            if looked.elapsed() >= LOOK_AGAIN {
                looked = Instant::now();
                if worker.tree.resident_bytes() > limits.bytes {
                    worker.end();
                    return Ok(Attempt::Ended(stage, out_of_memory(stage, &limits)));
                }
            }
            match worker.events.recv_timeout(LOOK_AGAIN) {
                Ok(Event::Ready(PROTOCOL)) => worker.is_ready = true,
                Ok(event) if !worker.is_ready => {
                    let found = match event {
                        Event::Ready(other) => format!("protocol {other}"),
                        _ => "no protocol".to_owned(),
                    };
                    worker.end();
                    return Err(self.foreign(found));
                }
                Ok(event) => match event {
                    Event::Finished => {
                        self.worker = Some(worker);
                        return Ok(refused.map_or(Attempt::Finished, Attempt::Refused));
                    }
                    Event::Refused(why) => refused = Some(why),
                    Event::OutOfMemory => memory_refused = true,
                    Event::Preparing(hash) => {
                        self.input = item.map(|item| (item.scene.clone(), hash));
                        (stage, since) = (Stage::Preparing, Instant::now());
                    }
                    // Method and evaluation have the time limit each.
                    Event::Measuring => (stage, since) = (Stage::Measuring, Instant::now()),
                    Event::Simplifying(level) => {
                        let mut levels = item.iter().flat_map(|item| &item.levels);
                        let place = levels.position(|&requested| requested == level);
                        stage = Stage::Simplifying(place.unwrap_or(0));
                        // A search is many runs: each bound has the whole time limit.
                        if matches!(level, Target::MaxError(_)) {
                            since = Instant::now();
                        }
                    }
                    event => {
                        if matches!(event, Event::Doing(_)) {
                            stage = Stage::Checking;
                        }
                        each(event);
                    }
                },
                Err(RecvTimeoutError::Disconnected) => {
                    let is_foreign = !worker.is_ready && self.program.is_some();
                    let (status, stderr) = worker.collect();
                    if is_foreign {
                        let end = status.map_or_else(|| "no end".to_owned(), describe_end);
                        return Err(self.foreign(end));
                    }
                    // A refused allocation that the worker survived did not end it.
                    let memory_refused = memory_refused && !status.is_some_and(|s| s.success());
                    let fault = ended(stage, status, &stderr, memory_refused, &limits);
                    return Ok(Attempt::Ended(stage, fault));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// The error of a program that does not serve as a worker.
    fn foreign(&self, found: String) -> Failure {
        // The running program as its own worker is of this build.
        let program = self.program.as_deref().unwrap_or(Path::new("medial"));
        let why = format!(
            "(found {found}, expected protocol {PROTOCOL}); name a build of medial of the same protocol"
        );
        Failure::at(program, format!("not a worker of this build {why}"))
    }

    /// The options of the worker of a request.
    fn options(&self, request: &Request) -> WorkerOptions {
        let (threads, limits) = request.terms();
        let (program, plugins) = (self.program.clone(), self.plugins.clone());
        WorkerOptions { program, threads, bytes: limits.bytes, plugins }
    }

    /// The present worker if it fits the request, else a new one.
    fn worker_for(&mut self, request: &Request) -> Result<Worker, Failure> {
        // The size of the pool and the limit of memory cannot be changed in a running process.
        let options = self.options(request);
        match self.worker.take() {
            Some(worker) if worker.options == options => Ok(worker),
            _ => Worker::start(options).map_err(not_started),
        }
    }
}

/// No worker, no result: not the fault of an input.
fn not_started(error: io::Error) -> Failure {
    let message = format!("worker process: cannot be started ({error})");
    Failure { code: Exit::NothingMeasured, message }
}

/// Adds a repetition to the records of an item. A fault of a repetition becomes the status of the
/// record: a method that sometimes breaks is broken.
pub fn merge(records: &mut [Record], repetition: usize, again: Result<Vec<Repeated>, Fault>) {
    for record in records {
        let level = record.simplify.level;
        let again = match &again {
            Ok(all) => {
                all.iter().find(|(other, _)| *other == level).map(|(_, outcome)| outcome.clone())
            }
            Err(fault) => Some(Err(fault.clone())),
        };
        match again {
            Some(Ok((laps, hash))) => {
                record.repetitions.push(laps);
                if record.result_hash.as_ref().is_some_and(|first| *first != hash) {
                    let warning = "a repetition returned a different medial mesh: the method is not deterministic";
                    if !record.simplify.warnings.iter().any(|known| known == warning) {
                        record.simplify.warnings.push(warning.to_owned());
                    }
                }
            }
            // A first run that failed keeps its reason.
            Some(Err(fault)) if record.status.has_result() => {
                record.status = fault.status;
                record.simplify.status = fault.status;
                record.reason = Some(format!("repetition {repetition}: {}", fault.reason));
            }
            _ => {}
        }
    }
}

/// The stage that a worker had reached when it ended.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Loading,
    Preparing,
    /// The method simplifies to the level at this position.
    Simplifying(usize),
    Measuring,
    Checking,
}

impl Stage {
    fn words(self) -> &'static str {
        match self {
            Self::Loading => "while loading the input",
            Self::Preparing => "during preparation",
            Self::Simplifying(_) => "during simplification",
            Self::Measuring => "during evaluation",
            Self::Checking => "during the case",
        }
    }
}

/// The limit of time was reached.
fn timed_out(stage: Stage, limits: &Limits) -> Fault {
    let seconds = limits.seconds;
    let stage = stage.words();
    let reason = format!("timed out after {seconds} s {stage}; rerun with a larger --timeout");
    Fault { status: Status::TimedOut, reason }
}

/// The limit of memory was reached.
fn out_of_memory(stage: Stage, limits: &Limits) -> Fault {
    let megabytes = limits.bytes / 1_000_000;
    let stage = stage.words();
    let reason = format!("used more than {megabytes} MB {stage}; rerun with a larger --memory");
    Fault { status: Status::OutOfMemory, reason }
}

/// The fault of a worker that ended by itself: from its exit status and the end of its standard error,
/// or from its own event that memory was refused.
fn ended(
    stage: Stage,
    status: Option<ExitStatus>,
    stderr: &str,
    memory_refused: bool,
    limits: &Limits,
) -> Fault {
    // Without memory, the last message of a program is often unrelated.
    if memory_refused {
        return out_of_memory(stage, limits);
    }
    // Rust prints this and aborts: by its signal alone it would look like any other abort.
    if stderr.contains("has overflowed its stack") {
        let reason =
            format!("stack overflow {}; check the method for endless recursion", stage.words());
        return Fault { status: Status::Panicked, reason };
    }
    let message = last_line(stderr).map_or_else(String::new, |line| format!(": {line}"));
    let end = match status {
        None => "the process vanished".to_owned(),
        Some(status) => describe_end(status),
    };
    Fault { status: Status::Panicked, reason: format!("{end} {}{message}", stage.words()) }
}

fn describe_end(status: ExitStatus) -> String {
    if let Some(signal) = ending_signal(status) {
        return format!("the process was ended by {signal}");
    }
    match status.code() {
        Some(code) => format!("the process ended with exit code {code}"),
        None => "the process ended".to_owned(),
    }
}

/// The interval at which a supervisor checks time and memory.
const LOOK_AGAIN: Duration = Duration::from_millis(50);
