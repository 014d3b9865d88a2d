//! The supervisor: gives items to a worker, watches time and memory, and turns every way in which a
//! worker can end into records, so that one broken method never stops the rest.
//!
//! | file | side |
//! |---|---|
//! | `mod`, `worker` | the supervisor's: requests, limits, ends |
//! | `protocol` | the messages between both |
//! | `serve` | the worker's |
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

use medial_reports::{Record, Repetition, Status, Target};

use crate::check::Outcome;
use crate::exec::protocol::{CheckItem, Event, Request};
use crate::exec::worker::{Worker, WorkerOptions};
use crate::measure::answer::Fault;
use crate::measure::failure_record;
use crate::process_tree::signal_name;
use crate::provenance::Provenance;
use crate::store::StoreError;
use crate::study::item::{Item, Limits, SceneSpec};

/// Why items are not run, or no more of them.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The user interrupted the run.
    #[error("interrupted")]
    Interrupted,
    /// A worker cannot be started.
    #[error("a worker process cannot be started: {0}")]
    Start(io::Error),
    /// A record cannot be kept.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Runs items one after another, in a worker that it replaces when an item has broken it.
pub struct Supervisor<'a> {
    /// The program whose workers are used, where it is not the running one.
    program: Option<PathBuf>,
    plugins: Vec<PathBuf>,
    provenance: Provenance,
    /// Folder for results as `.ma`.
    axes: Option<PathBuf>,
    /// Set when the user interrupts the run.
    interrupted: &'a AtomicBool,
    worker: Option<Worker>,
    /// SHA-256 of the input that was ready last.
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
    /// The input is refused.
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

    /// An item as these workers have to run it.
    pub fn own(&self, item: &Item) -> Item {
        if self.program.is_none() {
            return item.clone();
        }
        // Two builds are compared as such: the version of a method is not known of another program.
        let binary = self.provenance.binary_hash.clone();
        Item { version: binary.clone(), binary, ..item.clone() }
    }

    /// The same with workers of another build of the program.
    pub fn of_program(self, program: &Path) -> Self {
        Self { program: Some(program.to_owned()), ..self }
    }

    /// Lets the worker go: the next item gets a new process.
    pub fn renew(&mut self) {
        self.worker = None;
    }

    /// Runs an item: a record for each level, in the order of the levels.
    ///
    /// When a worker ends, its reported records are kept. Levels that it had finished but not reported
    /// are run again, the level that ended it gets the reason, and the later ones are not tried.
    ///
    /// # Errors
    /// When the user interrupts, or no worker can be started.
    pub fn run(&mut self, item: &Item) -> Result<Vec<Record>, RunError> {
        let (item, mut kept): (_, Vec<Record>) = (&self.own(item), Vec::new());
        // A stack: groups that are split off run before later ones, from fine to coarse.
        let mut groups = vec![item.levels.clone()];
        while let Some(levels) = groups.pop() {
            let part = Item { levels, ..item.clone() };
            let (attempt, told) = self.attempt(&part)?;
            let mut missing = part.levels.clone();
            // What was reported before the end of the worker counts.
            missing.retain(|level| told.iter().all(|kept| kept.simplify.level != *level));
            kept.extend(told);
            let mut fail = |levels: &[Target], fault: &Fault| {
                kept.extend(levels.iter().map(|&level| self.failed(item, level, fault)));
            };
            match attempt {
                Attempt::Finished => {
                    let reason = "the worker told nothing of this level".to_owned();
                    fail(&missing, &Fault { status: Status::Failed, reason });
                }
                Attempt::Refused(reason) => {
                    fail(&missing, &Fault { status: Status::Refused, reason });
                }
                Attempt::Ended(Stage::Asked(answered), fault) => {
                    let at = part.levels[answered];
                    let reason = format!("not run: the method ended its worker at {at}");
                    let not_run = Fault { reason, ..fault.clone() };
                    let mut before = Vec::new();
                    for level in &missing {
                        match part.levels.iter().position(|other| other == level) {
                            Some(place) if place < answered => before.push(*level),
                            Some(place) if place == answered => fail(&[*level], &fault),
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
        // Levels that were run again have come last.
        kept.sort_by_key(|kept| item.levels.iter().position(|&l| l == kept.simplify.level));
        Ok(kept)
    }

    /// Times all levels of an item that have a result once more.
    ///
    /// # Errors
    /// As [`Supervisor::run`].
    pub fn again(
        &mut self,
        item: &Item,
        first: &[Record],
    ) -> Result<Result<Vec<Repeated>, Fault>, RunError> {
        let mut item = item.clone();
        // Whether a level is begun is decided once.
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

    /// Why a method does not take its parameters, found by preparing it on the smallest of shapes.
    ///
    /// # Errors
    /// As [`Supervisor::run`].
    pub fn refused_params(&mut self, item: &Item) -> Result<Option<String>, RunError> {
        let request = Request::Probe { item: item.clone() };
        let mut refused = None;
        // A method that ends its worker says nothing of its parameters.
        self.converse(&request, &mut |event| {
            if let Event::WrongParameter(why) = event {
                refused = Some(why);
            }
        })?;
        Ok(refused)
    }

    /// Puts a method to one case of the conformance corpus. One that ends its worker has failed.
    ///
    /// # Errors
    /// As [`Supervisor::run`].
    pub fn check(&mut self, item: &CheckItem) -> Result<Outcome, RunError> {
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
            Attempt::Finished => outcome
                .unwrap_or_else(|| Outcome::Failed("the worker told nothing of this case".into())),
        };
        // A method that went wrong may have left locks and caches in any state.
        if matches!(outcome, Outcome::Failed(_)) {
            self.worker = None;
        }
        Ok(outcome)
    }

    fn failed(&self, item: &Item, level: Target, fault: &Fault) -> Record {
        let mut record = failure_record(item, level, fault, &self.provenance);
        // The hash of the bytes that the worker read, where it came that far: the planned one may be older.
        let ready = self.input.as_ref().filter(|(scene, _)| *scene == item.scene);
        record.mesh_hash = ready.map(|(_, hash)| hash.clone()).or(record.mesh_hash);
        record
    }

    fn attempt(&mut self, item: &Item) -> Result<(Attempt, Vec<Record>), RunError> {
        if let Some((scene, fault)) = &self.lost
            && *scene == item.scene
        {
            return Ok((Attempt::Ended(Stage::Preparing, fault.clone()), vec![]));
        }
        let (axes, provenance) = (self.axes.clone(), Box::new(self.provenance.clone()));
        let request = Request::Run { item: item.clone(), axes, provenance };
        let mut told = Vec::new();
        let attempt = self.converse(&request, &mut |event| {
            if let Event::Record(kept) = event {
                told.push(*kept);
            }
        })?;
        // A method that panicked may have left locks and caches in any state.
        if told.iter().any(|kept| kept.status == Status::Panicked) {
            self.worker = None;
        }
        Ok((attempt, told))
    }

    /// Puts a request to a worker and listens until it has finished or is gone.
    fn converse(
        &mut self,
        request: &Request,
        each: &mut dyn FnMut(Event),
    ) -> Result<Attempt, RunError> {
        let (item, (_, limits)) = (request.item(), request.terms());
        let mut worker = self.worker_for(request)?;
        let mut stage = Stage::Loading;
        let (mut refused, mut memory_refused) = (None, false);
        if worker.ask(request).is_err() {
            // Gone while it was idle: once more with a new one.
            drop(worker);
            worker = self.worker_for(request)?;
            worker.ask(request).map_err(RunError::Start)?;
        }
        let mut since = Instant::now();
        loop {
            if self.interrupted.load(Ordering::Relaxed) {
                worker.end();
                return Err(RunError::Interrupted);
            }
            // Also between events: a worker that sends events without end must not escape the limit.
            if since.elapsed() > limits.time() {
                worker.end();
                return Ok(Attempt::Ended(stage, timed_out(stage, &limits)));
            }
            match worker.listen(LOOK_AGAIN) {
                Ok(event) => match event {
                    Event::Finished => {
                        self.worker = Some(worker);
                        return Ok(refused.map_or(Attempt::Finished, Attempt::Refused));
                    }
                    Event::Refused(why) => refused = Some(why),
                    Event::Loading => {}
                    Event::OutOfMemory => memory_refused = true,
                    Event::Preparing(hash) => {
                        self.input = item.map(|item| (item.scene.clone(), hash));
                        (stage, since) = (Stage::Preparing, Instant::now());
                    }
                    // The limit is the method's; measuring has as much again.
                    Event::Measuring => (stage, since) = (Stage::Measuring, Instant::now()),
                    Event::Asked(level) => {
                        let mut levels = item.iter().flat_map(|item| &item.levels);
                        let place = levels.position(|&asked| asked == level);
                        stage = Stage::Asked(place.unwrap_or(0));
                        // A search is many runs: each bound has the time limit for itself.
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
                    let (status, last_words) = worker.collect();
                    // A refused allocation that the worker survived did not end it.
                    let memory_refused = memory_refused && !status.is_some_and(|s| s.success());
                    let fault = ended(stage, status, &last_words, memory_refused, &limits);
                    return Ok(Attempt::Ended(stage, fault));
                }
                // Programs that the worker started are outside of its own limit.
                Err(RecvTimeoutError::Timeout) if worker.resident_bytes() > limits.bytes => {
                    worker.end();
                    return Ok(Attempt::Ended(stage, out_of_memory(stage, &limits)));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// The worker that is there, where it fits the request, or a new one.
    fn worker_for(&mut self, request: &Request) -> Result<Worker, RunError> {
        let (threads, limits) = request.terms();
        // The size of the pool and the limit of memory cannot be changed in a running process.
        let options = WorkerOptions {
            program: self.program.clone(),
            threads,
            bytes: limits.bytes,
            plugins: self.plugins.clone(),
        };
        match self.worker.take() {
            Some(worker) if worker.options == options => Ok(worker),
            _ => Worker::start(options).map_err(RunError::Start),
        }
    }
}

/// Adds a repetition to the records of an item. One that ended otherwise than the first makes the
/// record say so: a method that sometimes breaks is broken.
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
                    let warning =
                        "a repetition gave another medial mesh: the method is not deterministic";
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
    /// The method was asked for its levels; this many had been answered.
    Asked(usize),
    Measuring,
    Checking,
}

impl Stage {
    fn words(self) -> &'static str {
        match self {
            Self::Loading => "while the input was read and prepared",
            Self::Preparing => "while the method prepared",
            Self::Asked(_) => "while the method simplified",
            Self::Measuring => "while the results were measured",
            Self::Checking => "while the case ran",
        }
    }
}

/// The limit of time was reached.
fn timed_out(stage: Stage, limits: &Limits) -> Fault {
    let seconds = limits.seconds;
    let reason = format!(
        "ended after {seconds} s {}; --timeout gives it longer, and the same command tries again then",
        stage.words()
    );
    Fault { status: Status::TimedOut, reason }
}

/// The limit of memory was reached.
fn out_of_memory(stage: Stage, limits: &Limits) -> Fault {
    let megabytes = limits.bytes / 1_000_000;
    let reason = format!(
        "it needed more than {megabytes} MB {}; --memory gives it more, and the same command tries \
         again then",
        stage.words()
    );
    Fault { status: Status::OutOfMemory, reason }
}

/// The worker ended by itself: the fault by its exit status and its last words, or by its own signal
/// that memory was refused.
fn ended(
    stage: Stage,
    status: Option<ExitStatus>,
    last_words: &str,
    memory_refused: bool,
    limits: &Limits,
) -> Fault {
    // The last words of a program that gets no memory are often about something else.
    if memory_refused {
        return out_of_memory(stage, limits);
    }
    // Rust prints this and aborts: by its signal alone it would look like any other abort.
    if last_words.contains("has overflowed its stack") {
        let reason =
            format!("its stack overflowed {}: is there a recursion without end?", stage.words());
        return Fault { status: Status::Panicked, reason };
    }
    let said =
        last_line(last_words).map_or_else(String::new, |line| format!("; last words: {line}"));
    let how = match status {
        None => "its process vanished".to_owned(),
        Some(status) => how_it_ended(status),
    };
    Fault { status: Status::Panicked, reason: format!("{how} {}{said}", stage.words()) }
}

fn how_it_ended(status: ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return format!("its process was ended by {}", signal_name(signal));
    }
    match status.code() {
        Some(code) => format!("its process ended itself with exit code {code}"),
        None => "its process ended".to_owned(),
    }
}

fn last_line(text: &str) -> Option<String> {
    let line = text.lines().rev().map(str::trim).find(|line| !line.is_empty())?;
    // It becomes part of a table cell.
    Some(line.chars().filter(|c| !c.is_control()).take(200).collect())
}

/// The interval at which a supervisor checks time and memory.
const LOOK_AGAIN: Duration = Duration::from_millis(50);
