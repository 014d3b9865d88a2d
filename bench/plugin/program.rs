//! Runs a program to its end, whatever it does.
//!
//! 1. It is started in a process group of its own, with nothing on standard input.
//! 2. Two threads take what it writes, and keep the end of it, so that no pipe ever fills.
//! 3. Until it ends it is looked at now and then: memory, and whether the run was cancelled.
//! 4. What it left running is ended. Only then is the end of its output awaited, for a while:
//!    whoever still holds a pipe would keep it open for ever.

use std::io::{self, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use medial::simplifier::RunContext;

use crate::process_tree::Tree;

/// How much of the end of each output is kept.
const KEPT: usize = 64 * 1024;
/// Longest time between two looks.
const LOOK_AGAIN: Duration = Duration::from_millis(10);
/// First one.
// Short, because programs that are quick to end are not waited for.
const FIRST_LOOK: Duration = Duration::from_micros(200);
/// How long outputs may stay open after everything was ended.
const LONGEST_DRAIN: Duration = Duration::from_secs(2);

/// How a program ended.
#[derive(Debug)]
pub(super) struct Ended {
    pub status: ExitStatus,
    /// The end of its standard output.
    pub stdout: String,
    /// The end of its standard error.
    pub stderr: String,
    /// Most resident bytes of it and its descendants together, as far as they were looked at.
    pub peak: u64,
    /// Processes that it had left running.
    pub strays: usize,
}

/// Why there is no end.
#[derive(Debug)]
pub(super) enum NoEnd {
    /// It cannot be started, or not be waited for.
    System(io::Error),
    /// The run was cancelled, and the program with all its descendants ended.
    Cancelled,
}

impl From<io::Error> for NoEnd {
    fn from(error: io::Error) -> Self {
        Self::System(error)
    }
}

/// Lifts the limit of memory that a program inherits from its worker.
// The supervisor limits both together by their resident bytes: what a program prints when an
// allocation fails decides nothing.
fn lift_limit(child: &Child) {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Pid, Resource, Rlimit, getrlimit, prlimit};
        let Rlimit { maximum, .. } = getrlimit(Resource::Data);
        let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
        // A program that has ended already needs no more memory.
        let _ = prlimit(pid, Resource::Data, Rlimit { current: maximum, maximum });
    }
    let _ = child;
}

/// Runs a program to its end.
pub(super) fn run(mut command: Command, context: &RunContext) -> Result<Ended, NoEnd> {
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn()?;
    // At once: children that leave the group early are known by having been seen.
    let mut tree = Tree::of(&child);
    lift_limit(&child);
    let stdout = child.stdout.take().map(Drain::start);
    let stderr = child.stderr.take().map(Drain::start);
    let (status, peak) = match watch(&mut child, &mut tree, context) {
        Ok(watched) => watched,
        Err(none) => {
            // The child would outlive the error otherwise, and hold the scratch folder.
            tree.end(&mut child);
            return Err(none);
        }
    };
    // Before the outputs are read: a stray that holds a pipe would keep them open.
    let strays = tree.end_orphans();
    let deadline = Instant::now() + LONGEST_DRAIN;
    let [stdout, stderr] = [stdout, stderr].map(|drain| drain.map(|drain| drain.finish(deadline)));
    let (stdout, stderr) = (stdout.unwrap_or_default(), stderr.unwrap_or_default());
    Ok(Ended { status, stdout, stderr, peak, strays })
}

fn watch(
    child: &mut Child,
    tree: &mut Tree,
    context: &RunContext,
) -> Result<(ExitStatus, u64), NoEnd> {
    let (mut peak, mut pause) = (0, FIRST_LOOK);
    loop {
        // Before the status: of a process that has ended nothing can be read any more.
        peak = peak.max(tree.resident_bytes());
        if let Some(status) = child.try_wait()? {
            return Ok((status, peak));
        }
        if context.is_cancelled() {
            return Err(NoEnd::Cancelled);
        }
        thread::sleep(pause);
        // Short programs are timed well, long ones are not disturbed.
        pause = (2 * pause).min(LOOK_AGAIN);
    }
}

/// A thread that takes an output and keeps its end.
pub(crate) struct Drain {
    end: Arc<Mutex<Tail>>,
    thread: JoinHandle<()>,
}

impl Drain {
    /// From the start of a process: one that fills a pipe that nobody reads would wait for ever.
    pub fn start(mut output: impl Read + Send + 'static) -> Self {
        let end = Arc::new(Mutex::new(Tail::default()));
        let kept = Arc::clone(&end);
        let thread = thread::spawn(move || {
            let mut buffer = vec![0; KEPT];
            loop {
                match output.read(&mut buffer) {
                    Ok(0) => break,
                    Ok(count) => lock(&kept).push(&buffer[..count]),
                    // A signal to this process is no end of the output.
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(_) => break,
                }
            }
        });
        Self { end, thread }
    }

    /// The end of the output. A thread that is not done by then is left behind; it ends with its output.
    pub fn finish(&self, deadline: Instant) -> String {
        while !self.thread.is_finished() && Instant::now() < deadline {
            thread::sleep(FIRST_LOOK);
        }
        lock(&self.end).text()
    }
}

fn lock(tail: &Mutex<Tail>) -> std::sync::MutexGuard<'_, Tail> {
    tail.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The last [`KEPT`] bytes of what was pushed, and up to as many before them.
#[derive(Default)]
struct Tail(Vec<u8>);

impl Tail {
    fn push(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
        // Cut at twice the length: each byte is moved once at most.
        if self.0.len() >= 2 * KEPT {
            self.0.drain(..self.0.len() - KEPT);
        }
    }

    fn text(&self) -> String {
        let kept = &self.0[self.0.len().saturating_sub(KEPT)..];
        String::from_utf8_lossy(kept).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tail_is_the_end_and_no_longer_than_that() {
        let mut tail = Tail::default();
        let bytes: Vec<u8> = (0..5 * KEPT).map(|k| b'a' + (k % 26) as u8).collect();
        for chunk in bytes.chunks(1000) {
            tail.push(chunk);
            assert!(tail.0.len() < 2 * KEPT + 1000);
        }
        assert_eq!(tail.text().as_bytes(), &bytes[4 * KEPT..]);
    }
}
