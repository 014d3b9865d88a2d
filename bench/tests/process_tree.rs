//! Trees of processes. One test in a program of its own, since it ends all that the program started.
#![cfg(target_os = "linux")]

use std::fs;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use medial_bench::process_tree::{
    adopt_strays, descendants, end_descendants, end_tree, resident_bytes,
};

/// Waits until a file has a text.
fn text_of(path: &std::path::Path) -> String {
    for _ in 0..1000 {
        match fs::read_to_string(path) {
            Ok(text) if text.ends_with('\n') => return text.trim().to_owned(),
            _ => thread::sleep(Duration::from_millis(5)),
        }
    }
    panic!("{} was not written", path.display());
}

fn exists(pid: u32) -> bool {
    fs::metadata(format!("/proc/{pid}")).is_ok()
}

#[test]
fn a_tree_is_seen_and_ended_with_its_strays() {
    adopt_strays();
    let folder = tempfile::tempdir().expect("a folder");
    let shell = |script: &str| {
        let mut command = Command::new("sh");
        command.args(["-c", script]).current_dir(folder.path()).stdin(Stdio::null());
        command.spawn().expect("a shell")
    };
    let file = |name: &str| folder.path().join(name);
    // Descendants of several generations.
    let mut child = shell("sh -c 'sleep 1000 & echo $! > deep; wait' & wait");
    let deep: u32 = text_of(&file("deep")).parse().expect("a number");
    let below = descendants(child.id());
    assert!(below.len() >= 2 && below.contains(&deep), "{below:?} {deep}");
    assert!(descendants(std::process::id()).contains(&deep));
    assert!(resident_bytes(child.id()) > 100_000);
    let status = end_tree(&mut child).expect("a status");
    assert!(!status.success() && !exists(deep) && !exists(child.id()));
    // Strays that left their group and lost their parent; one of them starts others all the time.
    let script = "(setsid sh -c 'echo $$ > stray; while :; do sleep 1000 & sleep 0.001; done' &)";
    let mut child = shell(script);
    assert!(child.wait().expect("a status").success());
    let stray: u32 = text_of(&file("stray")).parse().expect("a number");
    assert!(exists(stray) && end_descendants() >= 1);
    assert!(!exists(stray) && descendants(std::process::id()).is_empty());
    assert_eq!(
        (end_descendants(), descendants(u32::MAX).len(), resident_bytes(u32::MAX)),
        (0, 0, 0)
    );
}
