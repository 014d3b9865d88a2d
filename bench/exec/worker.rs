//! A worker from the supervisor's side: a child process, its events, its standard error, its end.

use std::io::{BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};
use std::{io, thread};

use tempfile::TempDir;

use crate::exec::protocol::{Event, Request, receive};
use crate::host::{self, Host};
use crate::plugin::{Drain, SCRATCH};
use crate::process_tree::Tree;

/// Longest wait for the end of standard error after the worker has ended.
const LONGEST_DRAIN: Duration = Duration::from_secs(5);

/// How a worker is started. Another item can use it only if its options are the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerOptions {
    /// The program; the running one unless given.
    pub program: Option<PathBuf>,
    pub threads: usize,
    /// Limit of memory, in bytes.
    pub bytes: u64,
    pub plugins: Vec<PathBuf>,
}

impl WorkerOptions {
    /// The verb and its options.
    pub fn arguments(&self) -> Vec<String> {
        let (threads, bytes) = (self.threads.to_string(), self.bytes.to_string());
        let mut words =
            ["worker", "--threads", &threads, "--bytes", &bytes].map(str::to_owned).to_vec();
        // Study files and arguments have UTF-8 paths.
        let files = self.plugins.iter().map(|file| file.display().to_string());
        words.extend(files.flat_map(|file| ["--plugins".to_owned(), file]));
        words
    }
}

pub struct Worker {
    child: Child,
    /// It, and all processes that it started.
    pub tree: Tree,
    requests: Option<ChildStdin>,
    /// Its events, until it has ended or closed its output.
    pub events: Receiver<Event>,
    stderr: Drain,
    /// Folder for the files of the programs that it starts; removed with the worker at any kind of end.
    _scratch: TempDir,
    /// Whether it has named the protocol of this build.
    pub is_ready: bool,
    /// How it was started.
    pub options: WorkerOptions,
}

impl Worker {
    /// Starts a worker: the running program, with the verb `worker`.
    pub fn start(options: WorkerOptions) -> io::Result<Self> {
        let mut command = match &options.program {
            Some(program) => host::named(Command::new(program)),
            None => Host::here()?.command(),
        };
        command.args(options.arguments());
        // One folder for each worker: when it is killed, the files of its programs go with it.
        let scratch = tempfile::Builder::new().prefix("medial-").tempdir()?;
        command.env(SCRATCH, scratch.path());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn()?;
        let (Some(requests), Some(output), Some(errors)) =
            (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err(io::Error::other("a pipe of the worker is missing"));
        };
        let (sender, events) = mpsc::channel();
        thread::spawn(move || {
            receive(BufReader::new(output), |event| {
                // Fails once the supervisor has dropped the worker.
                let _ = sender.send(event);
            });
        });
        let (stderr, tree) = (Drain::start(errors), Tree::of(&child));
        let (requests, _scratch, is_ready) = (Some(requests), scratch, false);
        Ok(Self { child, tree, requests, events, stderr, _scratch, is_ready, options })
    }

    pub fn send(&mut self, request: &Request) -> io::Result<()> {
        let requests = self.requests.as_mut().ok_or(io::ErrorKind::BrokenPipe)?;
        let mut line = serde_json::to_vec(request)?;
        line.push(b'\n');
        requests.write_all(&line)?;
        requests.flush()
    }

    /// Kills the worker and everything that it started, and returns its exit status.
    pub fn end(mut self) -> Option<ExitStatus> {
        self.tree.end(&mut self.child)
    }

    /// The exit status and the end of standard error, once its output has ended. A process that only
    /// closed its output is killed.
    pub fn collect(mut self) -> (Option<ExitStatus>, String) {
        // Its output ends a moment before the process does.
        let deadline = Instant::now() + Duration::from_millis(500);
        let mut status = None;
        while status.is_none() && Instant::now() < deadline {
            status = self.child.try_wait().ok().flatten();
            if status.is_none() {
                thread::sleep(Duration::from_millis(2));
            }
        }
        let killed = self.tree.end(&mut self.child);
        // Everything that could hold the pipe is dead, so it ends at once. The bound is for a process
        // that waits for a disk.
        (status.or(killed), self.stderr.finish(Instant::now() + LONGEST_DRAIN))
    }
}

impl Drop for Worker {
    /// An idle worker ends by itself once its standard input ends; a busy one is ended.
    fn drop(&mut self) {
        drop(self.requests.take());
        // A tenth of a second: an idle worker needs much less, a busy one never ends by itself.
        for _ in 0..100 {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                self.tree.end_orphans();
                return;
            }
            thread::sleep(Duration::from_millis(1));
        }
        let _ = self.tree.end(&mut self.child);
    }
}
