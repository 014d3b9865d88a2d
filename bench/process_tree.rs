//! Process trees: a process and all its descendants.
//!
//! A worker leads a new session and adopts the orphans among its descendants (subreaper). So every
//! process that a method starts is a descendant of the worker while the worker lives. Afterwards it
//! has the worker's session unless it called `setsid`. A [`Tree`] finds its members by descent, by
//! session, by process group, and in the list of earlier members. Only these are ended, never another
//! child of the supervisor.
//!
//! Without `/proc`, only the process group is known.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::{Child, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

#[cfg(unix)]
use rustix::process::Signal;

#[cfg(not(unix))]
#[derive(Clone, Copy)]
enum Signal {
    KILL,
    STOP,
}

/// Longest wait for killed processes to vanish.
// A process that waits for a disk ends later, and must not hold up the rest.
const LONGEST_END: Duration = Duration::from_secs(5);

/// Whether this process adopts the orphans among its descendants: then every child is its own.
static ADOPTS: AtomicBool = AtomicBool::new(false);

/// Makes this process, a worker, the leader of a session that adopts orphans, where the system can.
pub fn become_worker() {
    #[cfg(unix)]
    // An interrupt from the keyboard goes to the supervisor alone.
    let _ = rustix::process::setsid();
    #[cfg(target_os = "linux")]
    if rustix::process::set_child_subreaper(Some(rustix::process::getpid())).is_ok() {
        ADOPTS.store(true, Ordering::Relaxed);
    }
}

/// All descendants of a process, parents before children; empty on systems without `/proc`.
pub fn descendants(pid: u32) -> Vec<u32> {
    let mut found = vec![pid];
    let mut all: Option<Vec<Stat>> = None;
    let mut next = 0;
    while let Some(&parent) = found.get(next) {
        match children(parent) {
            Some(children) => found.extend(children),
            // A kernel without lists of children, or a process that just ended.
            None => {
                let all = all.get_or_insert_with(processes);
                found.extend(all.iter().filter(|s| s.parent == parent).map(|s| s.pid));
            }
        }
        next += 1;
    }
    found.split_off(1)
}

/// Kills all descendants of this process, a worker. Returns the number that still ran.
///
/// Only for a process all of whose children are its own, because it reaps them too.
pub fn end_descendants() -> usize {
    end_all(|| descendants(std::process::id()).into_iter().filter_map(Stat::of).collect())
}

/// A child of this process with all its descendants.
pub struct Tree {
    root: u32,
    /// Descendants of the root found so far, with their start times.
    // The system reuses process ids.
    seen: BTreeMap<u32, u64>,
}

impl Tree {
    /// The tree of a child.
    pub fn of(child: &Child) -> Self {
        Self { root: child.id(), seen: BTreeMap::new() }
    }

    /// Resident bytes of the root and of all present and earlier descendants.
    pub fn resident_bytes(&mut self) -> u64 {
        // Only this list has a descendant that changes its session and loses its parent later.
        for stat in descendants(self.root).into_iter().filter_map(Stat::of) {
            self.seen.insert(stat.pid, stat.born);
        }
        let seen = self.seen.iter().filter_map(|(&pid, &born)| {
            Stat::of(pid).filter(|stat| stat.born == born).map(|stat| stat.resident_bytes)
        });
        seen.sum::<u64>() + Stat::of(self.root).map_or(0, |stat| stat.resident_bytes)
    }

    /// Kills the root and all members, and returns the root's status.
    pub fn end(&mut self, root: &mut Child) -> Option<ExitStatus> {
        // Listed while the root lives: later their descent is lost. A stopped root starts no other.
        signal(self.root, Signal::STOP);
        self.resident_bytes();
        let _ = root.kill();
        let status = root.wait().ok();
        self.end_orphans();
        status
    }

    /// Kills the remaining members after the root has ended and was waited for. Returns the number that still ran.
    pub fn end_orphans(&mut self) -> usize {
        // Without `/proc` only the process group is known.
        if Stat::of(std::process::id()).is_none() {
            kill_group(self.root);
        }
        if ADOPTS.load(Ordering::Relaxed) { end_descendants() } else { end_all(|| self.members()) }
    }

    /// All members but the root.
    fn members(&self) -> Vec<Stat> {
        let mut members = processes();
        let ids: BTreeSet<u32> = (members.iter())
            .filter(|stat| {
                stat.group == self.root
                    || stat.session == self.root
                    // The system reuses process ids: the start time distinguishes two processes.
                    || self.seen.get(&stat.pid) == Some(&stat.born)
            })
            .map(|stat| stat.pid)
            .collect();
        let below: BTreeSet<u32> = ids.iter().flat_map(|&pid| descendants(pid)).collect();
        members.retain(|s| s.pid != self.root && (ids.contains(&s.pid) || below.contains(&s.pid)));
        members
    }
}

/// Kills the listed processes until there are no new ones, and returns the number of those that still ran.
// Repeated, since a process may start another just before it is killed.
fn end_all(list: impl Fn() -> Vec<Stat>) -> usize {
    let mut ended = BTreeSet::new();
    let mut zombies = BTreeSet::new();
    let start = Instant::now();
    loop {
        let (over, running): (Vec<Stat>, Vec<Stat>) = list().into_iter().partition(|s| s.is_zombie);
        for stat in &running {
            signal(stat.pid, Signal::KILL);
            ended.insert((stat.pid, stat.born));
        }
        // Reap only our own zombies.
        over.iter().filter(|stat| stat.parent == std::process::id()).for_each(|s| collect(s.pid));
        // A process that ended while the listing was made has handed its children to another parent,
        // perhaps to one whose children were already listed: a new zombie requires one more listing.
        let zombies_now: BTreeSet<_> = over.iter().map(|stat| (stat.pid, stat.born)).collect();
        let is_quiet = running.is_empty() && zombies_now.is_subset(&zombies);
        if is_quiet || start.elapsed() > LONGEST_END {
            return ended.len();
        }
        zombies = zombies_now;
        // Killed processes need a moment to vanish, and a busy loop would delay them.
        thread::sleep(Duration::from_millis(1));
    }
}

fn signal(pid: u32, signal: Signal) {
    #[cfg(unix)]
    if let Some(pid) = pid_of(pid) {
        let _ = rustix::process::kill_process(pid, signal);
    }
    let _ = (pid, signal);
}

fn kill_group(leader: u32) {
    #[cfg(unix)]
    if let Some(leader) = pid_of(leader) {
        let _ = rustix::process::kill_process_group(leader, Signal::KILL);
    }
    let _ = leader;
}

/// Reaps an adopted child that has ended.
fn collect(pid: u32) {
    #[cfg(unix)]
    if let Some(pid) = pid_of(pid) {
        let _ = rustix::process::waitpid(Some(pid), rustix::process::WaitOptions::NOHANG);
    }
    let _ = pid;
}

#[cfg(unix)]
fn pid_of(pid: u32) -> Option<rustix::process::Pid> {
    rustix::process::Pid::from_raw(i32::try_from(pid).ok()?)
}

/// The signal that ended a process, with its usual cause. Numbers that are not listed differ between systems.
pub fn ending_signal(status: ExitStatus) -> Option<String> {
    #[cfg(unix)]
    let signal = std::os::unix::process::ExitStatusExt::signal(&status)?;
    #[cfg(not(unix))]
    let signal = status.code().is_none().then_some(0)?;
    Some(match signal {
        1 => "SIGHUP".to_owned(),
        2 => "SIGINT".to_owned(),
        4 => "SIGILL (illegal instruction)".to_owned(),
        6 => "SIGABRT (aborted by itself)".to_owned(),
        8 => "SIGFPE (arithmetic error)".to_owned(),
        9 => "SIGKILL (possibly by the system, out of memory)".to_owned(),
        11 => "SIGSEGV (invalid memory access)".to_owned(),
        15 => "SIGTERM".to_owned(),
        24 => "SIGXCPU (CPU time limit)".to_owned(),
        25 => "SIGXFSZ (file size limit)".to_owned(),
        _ => format!("signal {signal}"),
    })
}

/// The children of a process, as the kernel lists them for each of its threads.
fn children(pid: u32) -> Option<Vec<u32>> {
    let mut children = Vec::new();
    for thread in fs::read_dir(format!("/proc/{pid}/task")).ok()? {
        let listed = fs::read_to_string(thread.ok()?.path().join("children")).ok()?;
        children
            .extend(listed.split_ascii_whitespace().filter_map(|word| word.parse::<u32>().ok()));
    }
    // By number, whatever order the threads are listed in.
    children.sort_unstable();
    Some(children)
}

/// All processes; empty on systems without `/proc`.
fn processes() -> Vec<Stat> {
    let Ok(entries) = fs::read_dir("/proc") else { return Vec::new() };
    let pids = entries.flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.filter_map(Stat::of).collect()
}

/// The fields of `/proc/PID/stat` that are used.
struct Stat {
    pid: u32,
    parent: u32,
    group: u32,
    session: u32,
    /// In ticks since the system started.
    born: u64,
    resident_bytes: u64,
    is_zombie: bool,
}

impl Stat {
    fn of(pid: u32) -> Option<Self> {
        let text = fs::read(format!("/proc/{pid}/stat")).ok()?;
        // The program's name in parentheses can hold anything: fields are counted after its end.
        let after = text.iter().rposition(|&byte| byte == b')')? + 2;
        let text = std::str::from_utf8(text.get(after..)?).ok()?;
        let fields: Vec<&str> = text.split_ascii_whitespace().collect();
        let number = |field: usize| fields.get(field)?.parse::<u64>().ok();
        Some(Self {
            pid,
            parent: number(1)? as u32,
            group: number(2)? as u32,
            session: number(3)? as u32,
            born: number(19)?,
            // The kernel counts pages.
            resident_bytes: number(21)? * page_bytes(),
            // Z waits for its parent, X is about to vanish: neither runs.
            is_zombie: matches!(fields.first(), Some(&("Z" | "X"))),
        })
    }
}

fn page_bytes() -> u64 {
    #[cfg(unix)]
    return rustix::param::page_size() as u64;
    #[cfg(not(unix))]
    return 4096;
}
