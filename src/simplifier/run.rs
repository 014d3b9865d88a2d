//! What surrounds a run.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::SimplifyError;

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
