//! Progress on standard error: of a list of items, and of the stages of one.

use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use medial::simplifier::Progress as Steps;
use medial_reports::printable;

/// Interval between updates of a line.
// A line draws itself, because most work does not report progress.
const INTERVAL: Duration = Duration::from_millis(250);

/// Whether progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verbosity {
    /// Only failures go to standard error.
    Quiet,
    /// Progress goes there, too.
    Progress,
}

/// Progress through a known number of items: a bar on a terminal, else lines.
pub struct Progress {
    bar: Option<ProgressBar>,
    verbosity: Verbosity,
    done: usize,
    total: usize,
}

impl Progress {
    /// Progress through `total` items.
    pub fn new(verbosity: Verbosity, total: usize) -> Self {
        // In a log file a bar would be one long line of control characters.
        let is_drawn = verbosity == Verbosity::Progress && io::stderr().is_terminal();
        let bar = is_drawn.then(|| ProgressBar::new(total as u64));
        if let Some(bar) = &bar {
            draw(bar, "{bar:30} {pos}/{len}  {elapsed}  {msg}");
        }
        Self { bar, verbosity, done: 0, total }
    }

    /// Names the current item.
    pub fn at(&mut self, what: &str) {
        match &self.bar {
            Some(bar) => bar.set_message(printable(what)),
            None => self.line(&format!("[{}/{}] {what}", self.done + 1, self.total)),
        }
    }

    /// One item is done.
    pub fn done(&mut self) {
        self.done += 1;
        self.bar.iter().for_each(|bar| bar.inc(1));
    }

    /// A remark that stays on the screen.
    pub fn remark(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(printable(text)),
            None => self.line(text),
        }
    }

    fn line(&self, text: &str) {
        if self.verbosity == Verbosity::Progress {
            let _ = writeln!(io::stderr(), "{}", printable(text));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.iter().for_each(ProgressBar::finish_and_clear);
    }
}

/// A line on standard error with the current stage, if that is a terminal; removed when dropped.
pub struct StageLine(ProgressBar);

impl StageLine {
    /// A line; none without a terminal or with [`Verbosity::Quiet`].
    pub fn new(verbosity: Verbosity) -> Self {
        let bar = match verbosity {
            Verbosity::Quiet => ProgressBar::hidden(),
            Verbosity::Progress => ProgressBar::new_spinner(),
        };
        draw(&bar, "{msg}{share}, {elapsed}");
        Self(bar)
    }

    /// Names the stage that begins.
    pub fn at(&self, what: impl Into<String>) {
        // The time on the line is that of the stage.
        self.0.reset();
        // A share of the stage before would stay until the first step of this one.
        self.0.unset_length();
        self.0.set_message(printable(&what.into()));
    }

    /// Takes the steps of a method, such as for
    /// [`RunContext::on_progress`](medial::simplifier::RunContext::on_progress).
    pub fn steps(&self) -> impl Fn(Steps) + Send + Sync + 'static {
        let bar = self.0.clone();
        move |Steps { done, total }| {
            // Some stages do not know how many steps there will be.
            if total > 0 && total < usize::MAX {
                bar.set_length(total as u64);
                bar.set_position(done as u64);
            }
        }
    }
}

impl Drop for StageLine {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

fn draw(bar: &ProgressBar, template: &str) {
    let share = |state: &ProgressState, out: &mut dyn fmt::Write| {
        if state.len().is_some() {
            // A line that could not be drawn is no reason to fail.
            let _ = write!(out, ", {:.0} %", 100.0 * state.fraction());
        }
    };
    let style = ProgressStyle::with_template(template).unwrap_or(ProgressStyle::default_bar());
    bar.set_style(style.with_key("share", share));
    bar.enable_steady_tick(INTERVAL);
}
