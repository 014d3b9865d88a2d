//! Runs a program to its end.
//!
//! 1. Start it in a new process group, with empty standard input.
//! 2. Two threads read its outputs, so that no pipe ever fills, and keep the last bytes.
//! 3. Until it ends, sample its memory and check whether the run was cancelled.
//! 4. Kill its remaining processes. Only then wait for the end of its output, for a limited time:
//!    a process with an open pipe would block for ever.

use std::io::{self, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use medial::simplifier::RunContext;

use crate::process_tree::Tree;

/// Bytes of the end of each output that stay in memory.
const TAIL_BYTES: usize = 64 * 1024;
/// Longest time between two samples.
const LONGEST_PAUSE: Duration = Duration::from_millis(10);
/// Time before the second sample.
// Short, so that the time of quick programs is exact.
const FIRST_PAUSE: Duration = Duration::from_micros(200);
/// Longest wait for the end of outputs after all processes have ended.
const LONGEST_DRAIN: Duration = Duration::from_secs(2);

/// How a program ended.
#[derive(Debug)]
pub(super) struct Ended {
    pub status: ExitStatus,
    /// The end of its standard output.
    pub stdout: String,
    /// The end of its standard error.
    pub stderr: String,
    /// Most resident bytes of it and its descendants together, at the times of sampling.
    pub peak: u64,
    /// Number of processes that it left running.
    pub orphans: usize,
}

/// Lifts the limit of memory that a program inherits from its worker.
// The supervisor limits both together by their resident bytes: the message of a program after a
// failed allocation is irrelevant.
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

/// Runs a program to its end; `None` if the run was cancelled, and the program with all its descendants ended.
pub(super) fn run(mut command: Command, context: &RunContext) -> io::Result<Option<Ended>> {
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn()?;
    // At once: children that leave the group early are found only by an early listing.
    let mut tree = Tree::of(&child);
    lift_limit(&child);
    let stdout = child.stdout.take().map(Drain::start);
    let stderr = child.stderr.take().map(Drain::start);
    let watched = watch(&mut child, &mut tree, context);
    let Ok(Some((status, peak))) = watched else {
        // The child would outlive the error otherwise, and hold the scratch folder.
        tree.end(&mut child);
        return watched.map(|_| None);
    };
    // Before the outputs are read: an orphan with an open pipe would block them.
    let orphans = tree.end_orphans();
    let deadline = Instant::now() + LONGEST_DRAIN;
    let [stdout, stderr] = [stdout, stderr].map(|drain| drain.map(|drain| drain.finish(deadline)));
    let (stdout, stderr) = (stdout.unwrap_or_default(), stderr.unwrap_or_default());
    Ok(Some(Ended { status, stdout, stderr, peak, orphans }))
}

/// The status and the peak of memory of a program; `None` if the run was cancelled.
fn watch(
    child: &mut Child,
    tree: &mut Tree,
    context: &RunContext,
) -> io::Result<Option<(ExitStatus, u64)>> {
    let (mut peak, mut pause) = (0, FIRST_PAUSE);
    loop {
        // Before the status: the memory of an ended process cannot be read.
        peak = peak.max(tree.resident_bytes());
        if let Some(status) = child.try_wait()? {
            return Ok(Some((status, peak)));
        }
        if context.is_cancelled() {
            return Ok(None);
        }
        thread::sleep(pause);
        // Short programs are timed well, long ones are not disturbed.
        pause = (2 * pause).min(LONGEST_PAUSE);
    }
}

/// A thread that reads an output and stores its end.
pub(crate) struct Drain {
    end: Arc<Mutex<Tail>>,
    thread: JoinHandle<()>,
}

impl Drain {
    /// Call it at the start of a process: a process with a full pipe waits for ever.
    pub fn start(mut output: impl Read + Send + 'static) -> Self {
        let end = Arc::new(Mutex::new(Tail::default()));
        let tail = Arc::clone(&end);
        let thread = thread::spawn(move || {
            let mut buffer = vec![0; TAIL_BYTES];
            loop {
                match output.read(&mut buffer) {
                    Ok(0) => break,
                    Ok(count) => lock(&tail).push(&buffer[..count]),
                    // A signal to this process does not end the output.
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(_) => break,
                }
            }
        });
        Self { end, thread }
    }

    /// The end of the output. A thread that has not finished by the deadline ends with its output.
    pub fn finish(&self, deadline: Instant) -> String {
        while !self.thread.is_finished() && Instant::now() < deadline {
            thread::sleep(FIRST_PAUSE);
        }
        lock(&self.end).text()
    }
}

fn lock(tail: &Mutex<Tail>) -> std::sync::MutexGuard<'_, Tail> {
    tail.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The last [`TAIL_BYTES`] pushed bytes, and up to as many before them.
#[derive(Default)]
struct Tail(Vec<u8>);

impl Tail {
    fn push(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
        // Cut at twice the length: each byte is moved once at most.
        if self.0.len() >= 2 * TAIL_BYTES {
            self.0.drain(..self.0.len() - TAIL_BYTES);
        }
    }

    fn text(&self) -> String {
        let end = &self.0[self.0.len().saturating_sub(TAIL_BYTES)..];
        String::from_utf8_lossy(end).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tail_has_only_the_last_bytes() {
        let mut tail = Tail::default();
        let bytes: Vec<u8> = (0..5 * TAIL_BYTES).map(|k| b'a' + (k % 26) as u8).collect();
        for chunk in bytes.chunks(1000) {
            tail.push(chunk);
            assert!(tail.0.len() < 2 * TAIL_BYTES + 1000);
        }
        assert_eq!(tail.text().as_bytes(), &bytes[4 * TAIL_BYTES..]);
    }
}
