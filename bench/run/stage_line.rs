//! The current stage of a verb on one mesh: a line on a terminal, shown for long stages.

use std::io::{self, IsTerminal};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use medial::simplifier::Progress;
use medial_reports::printable;

use super::Verbosity;

/// Shorter stages are not shown.
const PATIENCE: Duration = Duration::from_secs(1);

/// Interval between updates of the line.
const INTERVAL: Duration = Duration::from_millis(250);

/// A line on standard error with the current stage, if that is a terminal; removed when dropped.
///
/// A separate thread draws it, because most stages do not report progress themselves.
pub struct StageLine {
    stage: Arc<Mutex<Stage>>,
    /// Dropping the sender ends the thread.
    drawer: Option<(mpsc::Sender<()>, JoinHandle<()>)>,
}

/// The current stage, its start, and its progress.
struct Stage {
    what: String,
    since: Instant,
    steps: Option<Progress>,
}

impl StageLine {
    /// A line; none without a terminal or with [`Verbosity::Quiet`].
    pub fn new(verbosity: Verbosity) -> Self {
        let stage = Stage { what: String::new(), since: Instant::now(), steps: None };
        let stage = Arc::new(Mutex::new(stage));
        let seen = verbosity == Verbosity::Progress && io::stderr().is_terminal();
        let drawer = seen.then(|| {
            let (sender, ended) = mpsc::channel();
            let stage = Arc::clone(&stage);
            (sender, thread::spawn(move || draw(&stage, &ended)))
        });
        Self { stage, drawer }
    }

    /// Names what is being done from now on.
    pub fn at(&self, what: impl Into<String>) {
        *locked(&self.stage) = Stage { what: what.into(), since: Instant::now(), steps: None };
    }

    /// Takes the steps of a method, such as for
    /// [`RunContext::on_progress`](medial::simplifier::RunContext::on_progress).
    pub fn steps(&self) -> impl Fn(Progress) + Send + Sync + 'static {
        let stage = Arc::clone(&self.stage);
        move |progress| locked(&stage).steps = Some(progress)
    }
}

impl Drop for StageLine {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.drawer.take() {
            drop(sender);
            // A line that could not be drawn is no reason to fail.
            let _ = thread.join();
        }
    }
}

fn locked(stage: &Mutex<Stage>) -> MutexGuard<'_, Stage> {
    stage.lock().unwrap_or_else(PoisonError::into_inner)
}

fn draw(stage: &Mutex<Stage>, ended: &mpsc::Receiver<()>) {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    bar.set_style(
        ProgressStyle::with_template("{msg}").unwrap_or(ProgressStyle::default_spinner()),
    );
    while ended.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
        match locked(stage).line(Instant::now()) {
            Some(line) => bar.set_message(line),
            None => continue,
        }
        bar.tick();
    }
    bar.finish_and_clear();
}

impl Stage {
    /// The line to show at a moment, if it is time for one.
    fn line(&self, now: Instant) -> Option<String> {
        let elapsed = now.saturating_duration_since(self.since);
        if self.what.is_empty() || elapsed < PATIENCE {
            return None;
        }
        let steps = match self.steps {
            // Some stages do not know how many steps there will be.
            Some(Progress { done, total }) if total > 0 && total < usize::MAX => {
                format!(", {:.0} %", 100.0 * done as f64 / total as f64)
            }
            _ => String::new(),
        };
        Some(format!("{}{steps}, {} s", printable(&self.what), elapsed.as_secs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_stages_that_last_are_shown() {
        let line = StageLine::new(Verbosity::Quiet);
        line.at("measuring \u{1b}[2J");
        let shown = |seconds: u64| {
            let stage = locked(&line.stage);
            stage.line(stage.since + Duration::from_secs(seconds))
        };
        assert_eq!(shown(0), None);
        assert_eq!(shown(2).as_deref(), Some("measuring \u{fffd}[2J, 2 s"));
        line.steps()(Progress { done: 30, total: 120 });
        assert_eq!(shown(9).as_deref(), Some("measuring \u{fffd}[2J, 25 %, 9 s"));
        line.at("writing");
        assert_eq!(shown(3).as_deref(), Some("writing, 3 s"));
    }
}
