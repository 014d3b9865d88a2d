//! Progress on standard error: of a list of items, and of the stages of one.

use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};
use medial::simplifier::Progress as Steps;
use medial_run::text::printable;

/// Interval between updates of a line.
// A line draws itself, because most work does not report progress.
const INTERVAL: Duration = Duration::from_millis(250);

/// Progress through a known list of runs of methods: a bar on a terminal, else lines.
pub struct Progress {
    bar: Option<ProgressBar>,
    /// Whether only reasons of missing results go to standard error.
    is_quiet: bool,
    begun: usize,
    turns: usize,
    /// The usual seconds of all turns and of those that are done.
    total: f64,
    done: f64,
    start: Instant,
    estimate: Arc<Mutex<Option<Estimate>>>,
}

/// The remaining time, as estimated at an instant.
type Estimate = (Instant, Duration);

/// Share of the work before which there is no estimate.
const EARLY: f64 = 0.05;

impl Progress {
    /// Progress through turns of methods with these usual seconds, whose ratios give the estimate.
    pub fn new(is_quiet: bool, seconds: Vec<f64>) -> Self {
        let (turns, total) = (seconds.len(), seconds.iter().sum());
        let estimate: Arc<Mutex<Option<Estimate>>> = Arc::default();
        // In a log file a bar would be one long line of control characters.
        let is_drawn = !is_quiet && io::stderr().is_terminal();
        let bar = is_drawn.then(|| ProgressBar::new(turns as u64));
        if let Some(bar) = &bar {
            let line = style("{bar:30} {pos}/{len}  {elapsed}{left}  {msg}");
            let shown = Arc::clone(&estimate);
            // Between two results it falls with the clock.
            let left = move |_: &ProgressState, line: &mut dyn fmt::Write| {
                if let Some((at, left)) = *shown.lock().unwrap_or_else(PoisonError::into_inner) {
                    let left = left.saturating_sub(at.elapsed());
                    let _ = write!(line, ", about {} left", HumanDuration(left));
                }
            };
            bar.set_style(line.with_key("left", left));
            bar.enable_steady_tick(INTERVAL);
        }
        let start = Instant::now();
        Self { bar, is_quiet, begun: 0, turns, total, done: 0.0, start, estimate }
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
                self.remark(&format!("[{}/{}] {mesh}: {method}", self.begun, self.turns));
            }
            None => {}
        }
    }

    /// A turn of a method of these usual seconds is done.
    pub fn done(&mut self, seconds: f64) {
        self.done += seconds;
        let share = self.done / self.total;
        if share >= EARLY {
            let left = self.start.elapsed().mul_f64((1.0 - share).max(0.0) / share);
            let mut estimate = self.estimate.lock().unwrap_or_else(PoisonError::into_inner);
            *estimate = Some((Instant::now(), left));
        }
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
}

/// A stage, and one whose number of steps is known.
const STAGE: &str = "{msg}, {elapsed}";
const STEPS: &str = "{msg}, {percent} %, {elapsed}";

impl StageLine {
    /// A line; none without a terminal or if it `is_hidden`.
    pub fn new(is_hidden: bool) -> Self {
        let bar = if is_hidden { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
        bar.enable_steady_tick(INTERVAL);
        Self { bar }
    }

    /// Names the stage that begins.
    pub fn at(&self, what: impl AsRef<str>) {
        self.bar.reset();
        self.bar.unset_length();
        self.bar.set_style(style(STAGE));
        self.bar.set_message(printable(what.as_ref()));
    }

    /// A callback for the steps of a method, for
    /// [`RunContext::on_progress`](medial::simplifier::RunContext::on_progress).
    pub fn steps(&self) -> impl Fn(Steps) + Send + Sync + 'static {
        let bar = self.bar.clone();
        move |Steps { done, total }| {
            // Some stages have no known number of steps.
            if total > 0 && total < usize::MAX {
                if bar.length().is_none() {
                    bar.set_style(style(STEPS));
                }
                bar.set_length(total as u64);
                bar.set_position(done as u64);
            }
        }
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or(ProgressStyle::default_bar())
}

impl Drop for StageLine {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
