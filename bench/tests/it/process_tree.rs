//! Process trees: exactly the descendants of a child end with it.
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::{Child, Command, Stdio};

use medial_bench::process_tree::{Tree, descendants};

use crate::command::{pid_in, runs};

fn shell(folder: &Path, script: &str) -> Child {
    let mut command = Command::new("sh");
    command.args(["-c", script]).current_dir(folder).stdin(Stdio::null());
    command.spawn().expect("a shell")
}

#[test]
fn a_tree_ends_as_a_whole_and_leaves_its_neighbours_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let number = |name: &str| pid_in(&folder.path().join(name));
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
