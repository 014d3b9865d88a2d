//! Messages about workers that ended before they had finished, which tell the user what to do.

use std::process::ExitStatus;
use std::time::Duration;

use medial_reports::Status;

use super::{Fault, Limits};

/// The stage that a worker had reached when it ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// Reading and preparing the input.
    Loading,
    /// The method prepared.
    Preparing,
    /// The method was asked for its levels; this many had been answered.
    Asked(usize),
    /// The results were measured.
    Measuring,
    /// A case of the conformance corpus ran.
    Checking,
}

impl Stage {
    fn words(self) -> &'static str {
        match self {
            Self::Loading => "while the input was read and prepared",
            Self::Preparing => "while the method prepared",
            Self::Asked(_) => "while the method simplified",
            Self::Measuring => "while the results were measured",
            Self::Checking => "while the case ran",
        }
    }
}

/// The limit of time was reached.
pub fn timed_out(stage: Stage, limits: &Limits) -> Fault {
    let seconds = limits.seconds;
    let reason = format!(
        "ended after {seconds} s {}; --timeout gives it longer, and the same command tries again then",
        stage.words()
    );
    Fault { status: Status::TimedOut, reason }
}

/// The limit of memory was reached.
pub fn out_of_memory(stage: Stage, limits: &Limits) -> Fault {
    let megabytes = limits.bytes / 1_000_000;
    let reason = format!(
        "it needed more than {megabytes} MB {}; --memory gives it more, and the same command tries \
         again then",
        stage.words()
    );
    Fault { status: Status::OutOfMemory, reason }
}

/// The worker ended by itself: the fault by its exit status and its last words, or by its own signal
/// that memory was refused.
pub fn ended(
    stage: Stage,
    status: Option<ExitStatus>,
    last_words: &str,
    memory_refused: bool,
    limits: &Limits,
) -> Fault {
    if memory_refused {
        return out_of_memory(stage, limits);
    }
    if last_words.contains("has overflowed its stack") {
        let reason =
            format!("its stack overflowed {}: is there a recursion without end?", stage.words());
        return Fault { status: Status::Panicked, reason };
    }
    let said =
        last_line(last_words).map_or_else(String::new, |line| format!("; last words: {line}"));
    let how = match status {
        None => "its process vanished".to_owned(),
        Some(status) => how_it_ended(status),
    };
    Fault { status: Status::Panicked, reason: format!("{how} {}{said}", stage.words()) }
}

fn how_it_ended(status: ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        let name = signal_name(signal);
        let by =
            if signal == 9 { " (by the system for lack of memory, or by somebody)" } else { "" };
        return format!("its process was ended by signal {signal}{name}{by}");
    }
    match status.code() {
        Some(code) => format!("its process ended itself with exit code {code}"),
        None => "its process ended".to_owned(),
    }
}

/// The name of a signal that methods meet, in parentheses.
fn signal_name(signal: i32) -> &'static str {
    match signal {
        4 => " (SIGILL)",
        6 => " (SIGABRT)",
        7 => " (SIGBUS)",
        8 => " (SIGFPE)",
        9 => " (SIGKILL)",
        11 => " (SIGSEGV)",
        15 => " (SIGTERM)",
        25 => " (SIGXFSZ)",
        _ => "",
    }
}

fn last_line(text: &str) -> Option<String> {
    let line = text.lines().rev().map(str::trim).find(|line| !line.is_empty())?;
    Some(line.chars().filter(|c| !c.is_control()).take(200).collect())
}

/// The interval at which a supervisor checks time and memory.
pub const LOOK_AGAIN: Duration = Duration::from_millis(50);
