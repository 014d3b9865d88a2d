//! Progress on standard error: a bar on a terminal, plain lines otherwise, nothing when quiet.

use std::io::{self, IsTerminal, Write};

use indicatif::{ProgressBar, ProgressStyle};
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
