//! Progress on standard error: of a list of items, and of the stages of one.

use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use medial::simplifier::Progress as Steps;
use medial_run::text::printable;

/// Interval between updates of a line.
// A line draws itself, because most work does not report progress.
const INTERVAL: Duration = Duration::from_millis(250);

/// Shorter stages are not shown.
const PATIENCE: Duration = Duration::from_secs(1);

/// Progress through a known list of runs of methods: a bar on a terminal, else lines.
pub struct Progress {
    bar: Option<ProgressBar>,
    /// Whether only reasons of missing results go to standard error.
    is_quiet: bool,
    begun: usize,
    total: usize,
}

impl Progress {
    /// Progress through a number of turns of methods.
    pub fn new(is_quiet: bool, total: usize) -> Self {
        // In a log file a bar would be one long line of control characters.
        let is_drawn = !is_quiet && io::stderr().is_terminal();
        let bar = is_drawn.then(|| ProgressBar::new(total as u64));
        if let Some(bar) = &bar {
            let line = "{bar:30} {pos}/{len}  {elapsed}, about {eta} left  {msg}";
            let style = ProgressStyle::with_template(line);
            bar.set_style(style.unwrap_or(ProgressStyle::default_bar()));
            bar.enable_steady_tick(INTERVAL);
        }
        Self { bar, is_quiet, begun: 0, total }
    }

    /// Shows the current mesh and method, and the number of the repetition among `of`.
    pub fn at(&mut self, mesh: &str, method: &str, [turn, of]: [usize; 2]) {
        self.begun += 1;
        match &self.bar {
            Some(bar) => {
                let turn =
                    if of > 1 { format!(", repetition {turn} of {of}") } else { String::new() };
                bar.set_message(printable(&format!("{mesh}: {method}{turn}")));
            }
            // One line for each mesh and method.
            None if turn == 1 && !self.is_quiet => {
                self.remark(&format!("[{}/{}] {mesh}: {method}", self.begun, self.total));
            }
            None => {}
        }
    }

    /// A turn of a method is done.
    pub fn done(&self) {
        self.bar.iter().for_each(|bar| bar.inc(1));
    }

    /// A remark that stays on the screen, also where no progress is shown.
    pub fn remark(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(printable(text)),
            None => {
                let _ = writeln!(io::stderr(), "{}", printable(text));
            }
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.iter().for_each(ProgressBar::finish_and_clear);
    }
}

/// A line on standard error with the current stage, if that is a terminal; removed when dropped.
pub struct StageLine {
    bar: ProgressBar,
    stage: Arc<Mutex<String>>,
}

impl StageLine {
    /// A line; none without a terminal or if it `is_hidden`.
    pub fn new(is_hidden: bool) -> Self {
        let bar = if is_hidden { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
        let stage = Arc::new(Mutex::new(String::new()));
        let shown = Arc::clone(&stage);
        let line = move |state: &ProgressState, out: &mut dyn fmt::Write| {
            let stage = shown.lock().unwrap_or_else(PoisonError::into_inner);
            // A line that could not be drawn is not an error.
            let _ = out.write_str(&text(&stage, state.elapsed(), state.pos(), state.len()));
        };
        let style = ProgressStyle::with_template("{line}").unwrap_or(ProgressStyle::default_bar());
        bar.set_style(style.with_key("line", line));
        bar.enable_steady_tick(INTERVAL);
        Self { bar, stage }
    }

    /// Names the stage that begins.
    pub fn at(&self, what: impl Into<String>) {
        // The lock first and alone: drawing takes it, too.
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = what.into();
        self.bar.reset();
        self.bar.unset_length();
    }

    /// A callback for the steps of a method, for
    /// [`RunContext::on_progress`](medial::simplifier::RunContext::on_progress).
    pub fn steps(&self) -> impl Fn(Steps) + Send + Sync + 'static {
        let bar = self.bar.clone();
        move |Steps { done, total }| {
            // Some stages have no known number of steps.
            if total > 0 && total < usize::MAX {
                bar.set_length(total as u64);
                bar.set_position(done as u64);
            }
        }
    }
}

impl Drop for StageLine {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// The line of a stage after some time: nothing at first, since short stages would only flicker.
fn text(stage: &str, elapsed: Duration, done: u64, total: Option<u64>) -> String {
    if elapsed < PATIENCE {
        return String::new();
    }
    let share = total.map_or_else(String::new, |total| {
        format!(", {:.0} %", 100.0 * done as f64 / total.max(1) as f64)
    });
    format!("{}{share}, {} s", printable(stage), elapsed.as_secs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_stages_that_last_are_shown() {
        let at =
            |seconds, total| text("measuring \u{1b}[2J", Duration::from_secs(seconds), 30, total);
        assert_eq!(at(0, None), "");
        assert_eq!(at(2, None), "measuring \u{fffd}[2J, 2 s");
        assert_eq!(at(9, Some(120)), "measuring \u{fffd}[2J, 25 %, 9 s");
    }
}
