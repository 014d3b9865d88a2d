//! Process trees: exactly the descendants of a child end with it.
#![cfg(target_os = "linux")]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use medial_bench::process_tree::{Tree, descendants};

/// Waits until a file holds a line.
fn text_of(path: &Path) -> String {
    for _ in 0..6000 {
        match fs::read_to_string(path) {
            Ok(text) if text.ends_with('\n') => return text.trim().to_owned(),
            _ => thread::sleep(Duration::from_millis(5)),
        }
    }
    panic!("{} was not written", path.display());
}

fn runs(pid: u32) -> bool {
    let state = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // A zombie of another parent is dead.
    state.rsplit(')').next().is_some_and(|rest| !rest.trim().is_empty() && !rest.contains(" Z "))
}

fn shell(folder: &Path, script: &str) -> Child {
    let mut command = Command::new("sh");
    command.args(["-c", script]).current_dir(folder).stdin(Stdio::null());
    command.spawn().expect("a shell")
}

#[test]
fn a_tree_ends_as_a_whole_and_leaves_its_neighbours_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let number = |name: &str| -> u32 { text_of(&folder.path().join(name)).parse().expect("a pid") };
    let mut neighbour = shell(folder.path(), "exec sleep 1000");
    // Descendants of several generations, one of which leaves its session and its parent.
    let script = "sh -c 'sleep 1000 & echo $! > deep; wait' & \
                  setsid sh -c 'echo $$ > orphan; exec sleep 1000' & wait";
    let mut child = shell(folder.path(), script);
    let mut tree = Tree::of(&child);
    let (deep, orphan) = (number("deep"), number("orphan"));
    assert!(tree.resident_bytes() > 100_000);
    assert!(descendants(child.id()).contains(&deep));
    let status = tree.end(&mut child).expect("a status");
    assert!(!status.success() && !runs(deep) && !runs(orphan) && !runs(child.id()));
    assert!(runs(neighbour.id()), "a child of the same process that is no member");
    assert_eq!(tree.end_orphans(), 0);
    neighbour.kill().and_then(|()| neighbour.wait()).expect("ended");
    assert!(descendants(u32::MAX).is_empty());
}
