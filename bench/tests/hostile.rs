//! The command against files and arguments as they come from elsewhere.

use std::fs;
use std::path::Path;

use assert_cmd::Command;

fn medial(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("medial").expect("the binary is built");
    command.args(arguments);
    command
}

/// Runs the command and returns its exit code and both outputs.
fn run(arguments: &[&str]) -> (i32, String, String) {
    let output = medial(arguments).output().expect("the command starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("no signal"), text(output.stdout), text(output.stderr))
}

fn text_path(path: &Path) -> &str {
    path.to_str().expect("a UTF-8 path")
}

#[test]
fn deleted_elements_change_no_byte_of_an_evaluation() {
    let dir = tempfile::tempdir().expect("a folder");
    let (plain, flagged) = (dir.path().join("plain.ma"), dir.path().join("flagged.ma"));
    assert_eq!(run(&["axis", "builtin:box", "-o", text_path(&plain)]).0, 0);
    let text = fs::read_to_string(&plain).expect("read");
    // As MATFP writes it, with a deleted sphere far outside at the end.
    let mut lines = text.lines();
    let counts: Vec<usize> =
        lines.next().expect("a header").split(' ').map(|n| n.parse().expect("a count")).collect();
    let mut spheres = String::new();
    let mut simplices = String::new();
    for line in lines {
        match line.as_bytes()[0] {
            b'v' => spheres += &format!("{line} 2 0\n"),
            b'e' => simplices += &format!("{line} 1\n"),
            _ => simplices += &format!("{line}\n"),
        }
    }
    let (all, edges, faces) = (counts[0] + 1, counts[1] + 1, counts[2]);
    let text = format!(
        "{all} {edges} {faces}\n{spheres}v 50 50 50 3 2 1\n{simplices}e 0 {} 0\n",
        counts[0]
    );
    fs::write(&flagged, text).expect("written");
    let evaluate = |axis: &Path| {
        run(&["evaluate", "builtin:box", text_path(axis), "--samples", "500", "--json"])
    };
    let (of_plain, of_flagged) = (evaluate(&plain), evaluate(&flagged));
    assert_eq!((of_plain.0, of_flagged.0), (0, 0));
    assert_eq!(of_plain.1, of_flagged.1);
    assert!(of_flagged.2.contains("1 sphere was dropped: marked as deleted"), "{}", of_flagged.2);
    assert!(of_flagged.2.contains("1 edge was dropped: on a deleted sphere"), "{}", of_flagged.2);
}
