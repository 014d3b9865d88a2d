//! Long calls.
//!
//! The work runs in a thread of its own without the interpreter's lock. The thread that called waits for it, and looks
//! every [`PATIENCE`] whether Ctrl-C was pressed and what progress there is; so both arrive in the middle of steps
//! that know nothing of them. When it is interrupted the call ends at once. The work is told to stop and ends at its
//! next step; until then it goes on in the background, and its result is dropped.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use medial::simplifier::{Progress, RunContext};
use pyo3::prelude::*;

use crate::error::{Failure, Kind};

/// How long Ctrl-C and progress may wait.
const PATIENCE: Duration = Duration::from_millis(40);

/// As that of the main thread of a program: recursion is never deep, but inputs are anything.
const STACK_BYTES: usize = 8 << 20;

/// More threads than this serve nobody.
const MOST_THREADS: usize = 1024;

/// What the work tells the thread that waits.
#[derive(Clone, Default)]
pub struct Monitor {
    now: Arc<Mutex<Now>>,
}

#[derive(Default)]
struct Now {
    stage: &'static str,
    steps: Option<Progress>,
    is_new: bool,
}

impl Monitor {
    /// Names what is being done from now on.
    pub fn at(&self, stage: &'static str) {
        *self.locked() = Now { stage, steps: None, is_new: true };
    }

    fn steps(&self, steps: Progress) {
        let mut now = self.locked();
        (now.steps, now.is_new) = (Some(steps), true);
    }

    /// The stage and the share of it that is done, if there is news.
    fn news(&self) -> Option<(&'static str, Option<f64>)> {
        let mut now = self.locked();
        if !std::mem::take(&mut now.is_new) {
            return None;
        }
        // Some stages do not know how many steps there will be.
        let known = now.steps.filter(|steps| steps.total > 0 && steps.total < usize::MAX);
        Some((now.stage, known.map(|steps| (steps.done as f64 / steps.total as f64).min(1.0))))
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How a long call is made: of the tuple that `medial_axis/_calls.py` has checked.
pub struct Call {
    /// Seed of every random choice.
    pub seed: u64,
    /// Threads of a pool of its own; all processors together with other calls unless given.
    pub threads: Option<usize>,
    /// Called with a stage and the share of it that is done.
    pub progress: Option<Py<PyAny>>,
}

impl<'a, 'py> FromPyObject<'a, 'py> for Call {
    type Error = PyErr;

    fn extract(tuple: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let (seed, threads, progress) = tuple.extract()?;
        Ok(Self { seed, threads, progress })
    }
}

/// Does some work; see the head of this file.
///
/// # Errors
/// Those of the work; what a progress function raises; `KeyboardInterrupt`.
pub fn long<T: Send + 'static>(
    py: Python<'_>,
    call: &Call,
    work: impl FnOnce(&RunContext, &Monitor) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let pool = call.threads.map(pool).transpose()?;
    let monitor = Monitor::default();
    let (told, steps) = (monitor.clone(), monitor.clone());
    let run = RunContext::with_seed(call.seed).on_progress(move |progress| steps.steps(progress));
    let cancel = run.cancel_flag();
    let (sender, mut receiver) = mpsc::sync_channel(1);
    let all = move || {
        let guarded = || catch_unwind(AssertUnwindSafe(|| work(&run, &told)));
        let outcome = match pool {
            Some(pool) => pool.install(guarded),
            None => guarded(),
        };
        // Nobody listens after an interrupt.
        let _ = sender.send(outcome.unwrap_or_else(|panic| Err(of_panic(panic.as_ref()))));
    };
    thread::Builder::new().name("medial".to_owned()).stack_size(STACK_BYTES).spawn(all).map_err(
        |error| Failure::new(Kind::Failed, format!("no thread can be started: {error}")),
    )?;
    // Whatever ends this call early ends the work.
    let given_up = |error: PyErr| {
        cancel.store(true, Ordering::Relaxed);
        error
    };
    loop {
        // Handed over and back, since a receiver is of one thread at a time.
        let (given_back, received) = py.detach(move || {
            let received = receiver.recv_timeout(PATIENCE);
            (receiver, received)
        });
        receiver = given_back;
        match received {
            Ok(outcome) => return Ok(outcome?),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Failure::new(Kind::Internal, "the work ended without a result").into());
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        py.check_signals().map_err(given_up)?;
        if let (Some(progress), Some(news)) = (&call.progress, monitor.news()) {
            progress.call1(py, news).map_err(given_up)?;
        }
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, Failure> {
    if !(1..=MOST_THREADS).contains(&threads) {
        let message = format!("threads = {threads}: ask for 1 to {MOST_THREADS}");
        return Err(Failure::parameter(message));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| Failure::new(Kind::Failed, format!("threads = {threads}: {error}")))
}

fn of_panic(panic: &(dyn std::any::Any + Send)) -> Failure {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    Failure::of_panic(text.unwrap_or("panicked without a message"))
}
