//! The context of a run, and its errors.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::complex::ComplexError;
use crate::shape::ShapeError;

/// What surrounds a run: seed, cancellation, progress. The number of threads is that of the
/// rayon pool in which the method is called.
#[derive(Clone, Default)]
pub struct RunContext {
    /// Seed of every random choice.
    pub seed: u64,
    cancelled: Arc<AtomicBool>,
    progress: Option<Arc<dyn Fn(Progress) + Send + Sync>>,
}

/// A step towards the end of the current stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Steps done.
    pub done: usize,
    /// Steps in all.
    pub total: usize,
}

impl RunContext {
    /// A context with a seed, never cancelled, that reports to nobody.
    pub fn with_seed(seed: u64) -> Self {
        Self { seed, ..Self::default() }
    }

    /// The same context, reporting to `progress`.
    pub fn on_progress(mut self, progress: impl Fn(Progress) + Send + Sync + 'static) -> Self {
        self.progress = Some(Arc::new(progress));
        self
    }

    /// The flag that cancels the run once it is set.
    pub fn cancel_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.cancelled)
    }

    /// Whether the run was cancelled: for work that only waits, and has no progress to report.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Reports progress and asks whether to go on. Called every few thousand steps.
    ///
    /// # Errors
    /// [`SimplifyError::Cancelled`] once the flag is set.
    pub fn step(&self, done: usize, total: usize) -> Result<(), SimplifyError> {
        if let Some(progress) = &self.progress {
            progress(Progress { done, total });
        }
        if self.is_cancelled() {
            return Err(SimplifyError::Cancelled);
        }
        Ok(())
    }
}

/// Why a method gave no result.
#[derive(Debug, thiserror::Error)]
pub enum SimplifyError {
    /// The method does not do this: an answer, not a failure.
    #[error("unsupported: {why}")]
    Unsupported {
        /// What it does not do, and what it does instead.
        why: String,
    },
    /// A parameter is unknown, of the wrong type or out of range.
    #[error("parameter: {0}")]
    Parameter(String),
    /// A level is out of range.
    #[error("level: {0}")]
    Level(String),
    /// A substrate could not be built for this shape.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The method returned something that is no valid complex.
    #[error("invalid output: {0}")]
    InvalidOutput(String),
    /// A hierarchy cannot be built, or is not one of the method that was asked to go on from it.
    #[error("hierarchy: {0}")]
    Hierarchy(String),
    /// The method could not do it, and says why in its own words.
    #[error("failed: {0}")]
    Failed(String),
    /// The method's program was ended by a signal.
    #[error("crashed: {0}")]
    Crashed(String),
    /// The run was cancelled.
    #[error("cancelled")]
    Cancelled,
}

impl SimplifyError {
    /// [`SimplifyError::Unsupported`] with what the method does not do, and what it does instead.
    pub fn unsupported(why: impl Into<String>) -> Self {
        Self::Unsupported { why: why.into() }
    }
}

impl From<ComplexError> for SimplifyError {
    fn from(error: ComplexError) -> Self {
        Self::InvalidOutput(error.to_string())
    }
}
