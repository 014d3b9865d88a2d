//! The processes that a process has started, and those that these have started.
//!
//! Neither a process group nor the parents alone hold a tree together: a program can leave its group
//! (`setsid`), and a process whose parent ends gets another one. So on Linux
//!
//! - a worker adopts strays ([`adopt_strays`]): what loses its parent becomes its child, and
//!   [`end_descendants`] finds it;
//! - a [`Family`], which shares its process with others, knows its members by any of four signs:
//!   descent, process group, a mark in the environment, and having been seen before.
//!
//! Where there is no `/proc`, the process group is all there is.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::{Child, Command, ExitStatus};
use std::thread;
use std::time::{Duration, Instant};

/// How long processes that were killed may take to vanish: one that waits for a disk ends later.
const LONGEST_END: Duration = Duration::from_secs(5);

/// Variable of the environment that marks a [`Family`].
const MARK: &str = "MEDIAL_FAMILY";

/// From now on processes whose parent ends become children of this one, where the system can do so.
pub fn adopt_strays() {
    #[cfg(target_os = "linux")]
    // An old kernel has no such thing: strays go to the system then.
    let _ = rustix::process::set_child_subreaper(Some(rustix::process::getpid()));
}

/// All descendants of a process, parents before children; none where the system does not tell.
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

/// Resident bytes of a process and of all its descendants, together.
pub fn resident_bytes(pid: u32) -> u64 {
    let tree = std::iter::once(pid).chain(descendants(pid));
    tree.filter_map(Stat::of).map(|stat| stat.resident_bytes).sum()
}

/// Ends all descendants of this process by force, and says how many still ran.
///
/// Only to be called when no child is awaited by anybody else: their remains are removed too.
pub fn end_descendants() -> usize {
    end_all(|| descendants(std::process::id()).into_iter().filter_map(Stat::of).collect())
}

/// Ends a child with its process group and all its descendants by force, and gives its status.
///
/// Only to be called when no other child is awaited by anybody else, as [`end_descendants`].
pub fn end_tree(child: &mut Child) -> Option<ExitStatus> {
    // While the child lives, its descendants can be told from those of others.
    let below = descendants(child.id());
    kill_group(child.id());
    let _ = child.kill();
    below.into_iter().for_each(kill);
    let status = child.wait().ok();
    end_descendants();
    status
}

/// A child of this process and all that it starts, told from everything else that runs here.
pub struct Family {
    root: u32,
    /// As it stands in the environment of the members.
    mark: Vec<u8>,
    /// Members met so far below the root, with their times of birth, since numbers are used again.
    seen: BTreeMap<u32, u64>,
}

impl Family {
    /// Prepares a command to be the root of a family: it gets a process group of its own, and a mark
    /// that is unlike any other.
    pub fn mark(command: &mut Command) -> String {
        use std::sync::atomic::{AtomicU64, Ordering};
        static FAMILIES: AtomicU64 = AtomicU64::new(0);
        let number = FAMILIES.fetch_add(1, Ordering::Relaxed);
        let born = Stat::of(std::process::id()).map_or(0, |stat| stat.born);
        let mark = format!("{}-{born}-{number}", std::process::id());
        command.env(MARK, &mark);
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(command, 0);
        mark
    }

    /// The family of a child that was started from a command with this mark.
    pub fn of(child: &Child, mark: &str) -> Self {
        let mark = format!("{MARK}={mark}").into_bytes();
        Self { root: child.id(), mark, seen: BTreeMap::new() }
    }

    /// Resident bytes of all members that are below the root now or were once.
    pub fn resident_bytes(&mut self) -> u64 {
        for stat in descendants(self.root).into_iter().filter_map(Stat::of) {
            self.seen.insert(stat.pid, stat.born);
        }
        let seen = self.seen.iter().filter_map(|(&pid, &born)| {
            Stat::of(pid).filter(|stat| stat.born == born).map(|stat| stat.resident_bytes)
        });
        seen.sum::<u64>() + Stat::of(self.root).map_or(0, |stat| stat.resident_bytes)
    }

    /// Ends the root and all members by force.
    pub fn end(&mut self, root: &mut Child) {
        // Noted while the root lives: later their descent cannot be told.
        self.resident_bytes();
        kill_group(self.root);
        let _ = root.kill();
        let _ = root.wait();
        self.end_strays();
    }

    /// Ends by force what is left after the root has ended and was waited for, and says how many
    /// members still ran.
    pub fn end_strays(&mut self) -> usize {
        if Stat::of(std::process::id()).is_none() {
            // The system does not tell who is left.
            kill_group(self.root);
        }
        end_all(|| self.members())
    }

    /// All members but the root, by any sign.
    fn members(&self) -> Vec<Stat> {
        let all = processes();
        let is_marked = |stat: &Stat| {
            let environment = fs::read(format!("/proc/{}/environ", stat.pid)).unwrap_or_default();
            environment.split(|&byte| byte == 0).any(|variable| variable == self.mark)
        };
        let is_member = |stat: &Stat| {
            stat.group == self.root
                || self.seen.get(&stat.pid) == Some(&stat.born)
                || is_marked(stat)
        };
        let ids: BTreeSet<u32> = all.iter().filter(|stat| is_member(stat)).map(|s| s.pid).collect();
        let below: BTreeSet<u32> = ids.iter().flat_map(|&pid| descendants(pid)).collect();
        let mut members = all;
        members.retain(|s| s.pid != self.root && (ids.contains(&s.pid) || below.contains(&s.pid)));
        members
    }
}

/// Kills what a listing finds, again and again until it finds nothing new, since what is killed may
/// have started another just before. Gives the number of those that still ran.
fn end_all(list: impl Fn() -> Vec<Stat>) -> usize {
    let mut ended = BTreeSet::new();
    let mut remains = BTreeSet::new();
    let start = Instant::now();
    loop {
        let (over, running): (Vec<Stat>, Vec<Stat>) = list().into_iter().partition(|s| s.is_zombie);
        for stat in &running {
            kill(stat.pid);
            ended.insert((stat.pid, stat.born));
        }
        // Somebody else's remains are not ours to collect, and need not be waited for.
        over.iter().filter(|stat| stat.parent == std::process::id()).for_each(|s| collect(s.pid));
        // A process that ended while the listing was made has handed its children to another parent,
        // perhaps to one whose children were already listed: its remains ask for one more look.
        let remains_now: BTreeSet<_> = over.iter().map(|stat| (stat.pid, stat.born)).collect();
        let is_quiet = running.is_empty() && remains_now.is_subset(&remains);
        if is_quiet || start.elapsed() > LONGEST_END {
            return ended.len();
        }
        remains = remains_now;
        thread::sleep(Duration::from_millis(1));
    }
}

fn kill(pid: u32) {
    #[cfg(unix)]
    if let Some(pid) = pid_of(pid) {
        let _ = rustix::process::kill_process(pid, rustix::process::Signal::KILL);
    }
    let _ = pid;
}

fn kill_group(leader: u32) {
    #[cfg(unix)]
    if let Some(leader) = pid_of(leader) {
        let _ = rustix::process::kill_process_group(leader, rustix::process::Signal::KILL);
    }
    let _ = leader;
}

/// Removes what is left of a child that was adopted and has ended.
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

/// The children of a process, as the kernel lists them for each of its threads.
fn children(pid: u32) -> Option<Vec<u32>> {
    let mut children = Vec::new();
    for thread in fs::read_dir(format!("/proc/{pid}/task")).ok()? {
        let listed = fs::read_to_string(thread.ok()?.path().join("children")).ok()?;
        children
            .extend(listed.split_ascii_whitespace().filter_map(|word| word.parse::<u32>().ok()));
    }
    children.sort_unstable();
    Some(children)
}

/// What the system tells of all processes.
fn processes() -> Vec<Stat> {
    let Ok(entries) = fs::read_dir("/proc") else { return Vec::new() };
    let pids = entries.flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.filter_map(Stat::of).collect()
}

/// What the system tells of a process.
struct Stat {
    pid: u32,
    parent: u32,
    group: u32,
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
            born: number(19)?,
            resident_bytes: number(21)? * page_bytes(),
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
