//! Progress on standard error: of a list of items, and of the stages of one.

use std::io::{IsTerminal, Write};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use std::{io, thread};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use medial::simplifier::Progress as Steps;
use medial_reports::printable;

/// Progress through a known number of items.
pub struct Progress {
    style: Style,
    done: usize,
    total: usize,
}

/// Whether progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verbosity {
    /// Only failures go to standard error.
    Quiet,
    /// Progress goes there, too.
    Progress,
}

enum Style {
    Bar(ProgressBar),
    Lines,
    Quiet,
}

impl Progress {
    /// Progress through `total` items.
    pub fn new(verbosity: Verbosity, total: usize) -> Self {
        let style = if verbosity == Verbosity::Quiet {
            Style::Quiet
        } else if io::stderr().is_terminal() {
            Style::Bar(bar(total))
        } else {
            Style::Lines
        };
        Self { style, done: 0, total }
    }

    /// Names what is being done now.
    pub fn at(&mut self, what: &str) {
        if let Style::Bar(bar) = &self.style {
            bar.set_message(printable(what));
        } else {
            self.line(&format!("[{}/{}] {what}", self.done + 1, self.total));
        }
    }

    /// One item is done.
    pub fn done(&mut self) {
        self.done += 1;
        if let Style::Bar(bar) = &self.style {
            bar.inc(1);
        }
    }

    /// A remark that stays on the screen.
    pub fn remark(&self, text: &str) {
        match &self.style {
            Style::Bar(bar) => bar.println(printable(text)),
            _ => self.line(text),
        }
    }

    fn line(&self, text: &str) {
        if matches!(self.style, Style::Lines) {
            let _ = writeln!(io::stderr(), "{}", printable(text));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Style::Bar(bar) = &self.style {
            bar.finish_and_clear();
        }
    }
}

fn bar(total: usize) -> ProgressBar {
    let bar = ProgressBar::new(total as u64);
    let template = "{bar:30} {pos}/{len}  {elapsed}  {msg}";
    bar.set_style(ProgressStyle::with_template(template).unwrap_or(ProgressStyle::default_bar()));
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    bar
}

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
    steps: Option<Steps>,
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
    pub fn steps(&self) -> impl Fn(Steps) + Send + Sync + 'static {
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
            Some(Steps { done, total }) if total > 0 && total < usize::MAX => {
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
        line.steps()(Steps { done: 30, total: 120 });
        assert_eq!(shown(9).as_deref(), Some("measuring \u{fffd}[2J, 25 %, 9 s"));
        line.at("writing");
        assert_eq!(shown(3).as_deref(), Some("writing, 3 s"));
    }
}
