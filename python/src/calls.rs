//! Calls from Python: long calls, numpy arrays, exceptions.
//!
//! Long work runs in a new thread without the interpreter's lock. The calling thread waits for it and checks every
//! [`PATIENCE`] for Ctrl-C and progress, so that both arrive during steps without support for them. An interrupted call
//! returns at once. The work gets the cancel flag and ends at its next step; until then it continues in the background,
//! and its result is dropped.
//!
//! `medial_axis/_arguments.py` has checked kind and shape of arrays; here they are copied, since the work may outlive the
//! call.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::Duration;

use medial::Vec3;
use medial::complex::{ComplexError, MaError};
use medial::geometry::triangulation::TriangulationError;
use medial::metrics::MetricError;
use medial::shape::ShapeError;
use medial::simplifier::{Progress, RunContext, SimplifyError};
use medial::surface::{BvhError, SurfaceError};
use medial_run::error::InputError;
use medial_run::record::Status;
use medial_run::timed::Fault;
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyType;

/// Longest delay of Ctrl-C and progress.
const PATIENCE: Duration = Duration::from_millis(40);

/// As in the main thread of a program.
const STACK_BYTES: usize = 8 << 20;

/// More threads than this are rejected.
const MOST_THREADS: usize = 1024;

/// The progress of the work, for the waiting thread.
#[derive(Clone, Default)]
pub struct Monitor {
    now: Arc<Mutex<Now>>,
}

#[derive(Default)]
struct Now {
    stage: String,
    steps: Option<Progress>,
    is_new: bool,
}

impl Monitor {
    /// Sets the current stage.
    pub fn at(&self, stage: &str) {
        *self.locked() = Now { stage: stage.to_owned(), steps: None, is_new: true };
    }

    fn steps(&self, steps: Progress) {
        let mut now = self.locked();
        (now.steps, now.is_new) = (Some(steps), true);
    }

    /// The stage and its finished share, if either has changed.
    fn news(&self) -> Option<(String, Option<f64>)> {
        let mut now = self.locked();
        if !std::mem::take(&mut now.is_new) {
            return None;
        }
        // Some stages have no known number of steps.
        let known = now.steps.filter(|steps| steps.total > 0 && steps.total < usize::MAX);
        Some((
            now.stage.clone(),
            known.map(|steps| (steps.done as f64 / steps.total as f64).min(1.0)),
        ))
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The arguments of a long call, from the tuple that `medial_axis/_arguments.py` has checked.
pub struct Call {
    /// Seed of every random choice.
    pub seed: u64,
    /// Threads of a separate pool; `None` for the pool that all calls share.
    pub threads: Option<usize>,
    /// Called with a stage and its finished share.
    pub progress: Option<Py<PyAny>>,
}

impl<'a, 'py> FromPyObject<'a, 'py> for Call {
    type Error = PyErr;

    fn extract(tuple: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let (seed, threads, progress) = tuple.extract()?;
        Ok(Self { seed, threads, progress })
    }
}

/// Runs `work` in a new thread; see the head of this file.
///
/// # Errors
/// Errors of the work, exceptions of a progress function, and `KeyboardInterrupt`.
pub fn long<T: Send + 'static>(
    py: Python<'_>,
    call: &Call,
    work: impl FnOnce(&RunContext, &Monitor) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let pool = call.threads.map(pool).transpose()?;
    let monitor = Monitor::default();
    let (stages, steps) = (monitor.clone(), monitor.clone());
    let run = RunContext::with_seed(call.seed).on_progress(move |progress| steps.steps(progress));
    let cancel = run.cancel_flag();
    let (sender, mut receiver) = mpsc::sync_channel(1);
    let all = move || {
        let guarded = || catch_unwind(AssertUnwindSafe(|| work(&run, &stages)));
        let outcome = match pool {
            Some(pool) => pool.install(guarded),
            None => guarded(),
        };
        // Fails after an interrupt.
        let _ = sender.send(outcome.unwrap_or_else(|panic| Err(of_panic(panic.as_ref()))));
    };
    let builder = thread::Builder::new().name("medial".to_owned()).stack_size(STACK_BYTES);
    let started = builder.spawn(all);
    started
        .map_err(|error| Failure::new(Kind::Failed, format!("cannot start a thread: {error}")))?;
    // Any early end of this call cancels the work.
    let cancelled = |error: PyErr| {
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
        py.check_signals().map_err(cancelled)?;
        if let (Some(progress), Some(news)) = (&call.progress, monitor.news()) {
            progress.call1(py, news).map_err(cancelled)?;
        }
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, Failure> {
    if !(1..=MOST_THREADS).contains(&threads) {
        let message = format!("threads = {threads}: expected 1 to {MOST_THREADS}");
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

// Exceptions, with the messages of the command.

/// The exceptions of `medial_axis/errors.py`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An input is wrong: a file, an array, a surface that bounds no solid.
    Input,
    /// A parameter or a level is wrong.
    Parameter,
    /// The method does not support the request.
    Unsupported,
    /// The method failed.
    Failed,
    /// The run was cancelled.
    Cancelled,
    /// A broken invariant: a fault of this program.
    Internal,
}

/// The reason for which a call has no result.
#[derive(Debug)]
pub struct Failure {
    kind: Kind,
    message: String,
}

/// A message whose advice names calls of the package instead of commands.
pub(crate) fn advice_in_python(message: &str) -> String {
    let calls = [
        ("medial repair FILE --fill-holes -o OUT", "Mesh.repair(..., fill_holes=True)"),
        ("medial repair FILE --wrap -o OUT", "Mesh.repair(..., wrap=True)"),
        ("--sampling conforming:N", "sampling=\"conforming:N\""),
    ];
    calls.iter().fold(message.to_owned(), |text, (command, call)| text.replace(command, call))
}

impl Failure {
    /// A failure of a kind.
    pub fn new(kind: Kind, message: impl ToString) -> Self {
        Self { kind, message: advice_in_python(&message.to_string()) }
    }

    /// A failure of [`Kind::Input`].
    pub fn input(message: impl ToString) -> Self {
        Self::new(Kind::Input, message)
    }

    /// A failure of [`Kind::Parameter`].
    pub fn parameter(message: impl ToString) -> Self {
        Self::new(Kind::Parameter, message)
    }

    /// The failure of a fault of the runner.
    pub fn of_fault(fault: Fault) -> Self {
        if fault.is_bug() {
            return Self::of_panic(&fault.reason);
        }
        let kind = match fault.status {
            Status::Unsupported => Kind::Unsupported,
            Status::Refused | Status::BoundMissed => Kind::Parameter,
            _ => Kind::Failed,
        };
        Self::new(kind, fault.reason)
    }

    /// The failure of a panic.
    pub fn of_panic(message: &str) -> Self {
        let advice = "this is a bug of medialaxis, please report it with the input";
        Self::new(Kind::Internal, format!("{message}; {advice}"))
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        let name = match failure.kind {
            Kind::Input => "InputError",
            Kind::Parameter => "ParameterError",
            Kind::Unsupported => "UnsupportedError",
            Kind::Failed => "FailedError",
            Kind::Cancelled => "CancelledError",
            Kind::Internal => "InternalError",
        };
        Python::attach(|py| {
            let class = py.import("medial_axis.errors").and_then(|module| module.getattr(name));
            match class.and_then(|class| Ok(class.cast_into::<PyType>()?)) {
                Ok(class) => Self::from_type(class, failure.message),
                Err(error) => error,
            }
        })
    }
}

impl From<SimplifyError> for Failure {
    fn from(error: SimplifyError) -> Self {
        let kind = match &error {
            SimplifyError::Unsupported { .. } => Kind::Unsupported,
            SimplifyError::Parameter(_) | SimplifyError::Level(_) => Kind::Parameter,
            SimplifyError::Shape(_) => Kind::Input,
            SimplifyError::Cancelled => Kind::Cancelled,
            _ => Kind::Failed,
        };
        Self::new(kind, error)
    }
}

/// Errors that are always about the input.
macro_rules! about_input {
    ($($error:ty),+) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::input(error)
            }
        })+
    };
}

about_input!(
    BvhError,
    ComplexError,
    InputError,
    MaError,
    MetricError,
    ShapeError,
    SurfaceError,
    TriangulationError
);

// Arrays.

/// The rows of an n x 3 array as points.
///
/// # Errors
/// When the array has another shape.
pub fn points(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Vec3>> {
    Ok(triples(array)?.into_iter().map(Vec3::from).collect())
}

/// The rows of an n x 3 array.
///
/// # Errors
/// When the array has another shape.
pub fn triples<T: Element + Copy>(array: &PyReadonlyArray2<'_, T>) -> PyResult<Vec<[T; 3]>> {
    let array = array.as_array();
    if array.ncols() != 3 {
        return Err(Failure::input("an array without three columns").into());
    }
    Ok(array.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect())
}

/// A new array of points, n x 3.
pub fn of_points<'py>(
    py: Python<'py>,
    points: impl ExactSizeIterator<Item = Vec3>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    of_rows(py, points.map(|point| point.to_array()))
}

/// A new array with these rows.
pub fn of_rows<'py, T: Element + Copy, const N: usize>(
    py: Python<'py>,
    rows: impl ExactSizeIterator<Item = [T; N]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let count = rows.len();
    let flat: Vec<T> = rows.flatten().collect();
    PyArray1::from_vec(py, flat).reshape([count, N])
}

/// An array that is created at the first access. It is read-only, since it is shared.
#[derive(Default)]
pub struct Once(OnceLock<Py<PyAny>>);

impl Once {
    /// The array.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn get<'py, A>(
        &self,
        py: Python<'py>,
        make: impl FnOnce() -> PyResult<Bound<'py, A>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if let Some(known) = self.0.get() {
            return Ok(known.bind(py).clone());
        }
        let made = make()?.into_any();
        made.getattr("flags")?.setattr("writeable", false)?;
        Ok(self.0.get_or_init(|| made.unbind()).bind(py).clone())
    }
}
