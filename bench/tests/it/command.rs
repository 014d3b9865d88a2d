//! Helpers of the tests: runs of the command, and its records.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::thread;
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

/// The command.
pub const MEDIAL: &str = env!("CARGO_BIN_EXE_medial");

/// A temporary folder in which the command runs, or the same with other methods. A line has its words without quotes,
/// and the names of files in it are relative to the folder.
pub struct Folder {
    dir: TempDir,
    program: PathBuf,
}

impl Folder {
    /// An empty folder for the command.
    pub fn new() -> Self {
        Self::of(MEDIAL)
    }

    /// An empty folder for a program that is the command with other methods.
    pub fn of(program: impl Into<PathBuf>) -> Self {
        Self { dir: tempfile::tempdir().expect("a folder"), program: program.into() }
    }

    /// The path of a file there.
    pub fn at(&self, name: impl AsRef<Path>) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Whether a file is there.
    pub fn has(&self, name: impl AsRef<Path>) -> bool {
        self.at(name).exists()
    }

    /// Writes a file.
    #[track_caller]
    pub fn write(&self, name: impl AsRef<Path>, content: impl AsRef<[u8]>) {
        fs::write(self.at(name), content).expect("written");
    }

    /// The content of a file.
    #[track_caller]
    pub fn text(&self, name: impl AsRef<Path>) -> String {
        let path = self.at(name);
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// The records of a store.
    pub fn records(&self, store: &str) -> Vec<Value> {
        records(self.at(store))
    }

    /// The command of a line, to which more may be added.
    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(&self.program);
        command.args(line.split_whitespace()).current_dir(&self.dir);
        command
    }

    /// Runs a line and returns its exit code and both outputs.
    pub fn run(&self, line: &str) -> (i32, String, String) {
        ended(self.command(line).output().expect("the command starts"))
    }

    /// Runs a line that must succeed, and returns its standard output.
    #[track_caller]
    pub fn done(&self, line: &str) -> String {
        let (code, stdout, stderr) = self.run(line);
        assert_eq!(code, 0, "{line}: {stderr}");
        stdout
    }

    /// Runs a line that must end in this code and with these words on standard error.
    #[track_caller]
    pub fn refused(&self, line: &str, expected: i32, words: &str) {
        let (code, _, stderr) = self.run(line);
        assert!(code == expected && stderr.contains(words), "{line}: {code}, {stderr}");
    }

    /// Runs a line with `--json` and returns its exit code and the one object that it prints.
    #[track_caller]
    pub fn json(&self, line: &str) -> (i32, Value) {
        json_of(self.run(&format!("{line} --json")))
    }
}

/// The exit code and both outputs of a process that no signal ended.
pub fn ended(output: Output) -> (i32, String, String) {
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8"));
    let code = output.status.code().unwrap_or_else(|| panic!("a signal ended it: {stderr}"));
    (code, stdout, stderr)
}

/// The exit code and the one object of a run with `--json`.
#[track_caller]
pub fn json_of((code, stdout, stderr): (i32, String, String)) -> (i32, Value) {
    assert_eq!(stdout.lines().count(), 1, "one line of JSON: {stdout}\n{stderr}");
    let object: Value = serde_json::from_str(&stdout).expect("JSON");
    assert!(object["warnings"].is_array() && object["version"].is_string(), "{object}");
    (code, object)
}

/// The command with methods that go wrong, which cargo builds with its tests.
pub fn faulty() -> PathBuf {
    let test = std::env::current_exe().expect("the test knows its file");
    let target = test.parent().and_then(Path::parent).expect("target/PROFILE/deps/TEST");
    let file = target.join("examples/faulty");
    assert!(file.exists(), "{} is not built: cargo build --examples", file.display());
    file
}

/// The records of a folder of results.
pub fn records(out: impl AsRef<Path>) -> Vec<Value> {
    let text = fs::read_to_string(out.as_ref().join("results.jsonl")).expect("results");
    text.lines().map(|line| serde_json::from_str(line).expect("a whole record")).collect()
}

/// A field that is a number.
#[track_caller]
pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// Records without the fields that differ from run to run: seconds, memory, the command, and the number of jobs.
pub fn without_timings(mut records: Vec<Value>) -> Vec<Value> {
    for record in &mut records {
        for key in ["evaluate_seconds", "repetitions", "command"] {
            record.as_object_mut().expect("an object").remove(key);
        }
        record["conditions"].as_object_mut().expect("an object").remove("jobs");
        let simplify = record["simplify"].as_object_mut().expect("an object");
        for key in ["seconds", "cpu_seconds", "peak_bytes", "substrates", "own_seconds"] {
            simplify.remove(key);
        }
    }
    records.sort_by_key(|record| record["key"].as_str().map(str::to_owned));
    records
}

/// Cubes of 8 vertices and 6 squares, each a lowest corner and a side, as OFF.
pub fn cubes_off(cubes: &[([f64; 3], f64)]) -> String {
    const QUADS: [[usize; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let (mut vertices, mut faces) = (String::new(), String::new());
    for (k, (low, side)) in cubes.iter().enumerate() {
        for i in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|bit| low[bit] + side * f64::from(i >> bit & 1));
            vertices += &format!("{x} {y} {z}\n");
        }
        for [a, b, c, d] in QUADS.map(|quad| quad.map(|corner| 8 * k + corner)) {
            faces += &format!("4 {a} {b} {c} {d}\n");
        }
    }
    format!("OFF\n{} {} 0\n{vertices}{faces}", 8 * cubes.len(), 6 * cubes.len())
}

/// Ids of the processes with a text in the command line; none on systems without `/proc`.
pub fn processes_with(text: &str) -> Vec<u32> {
    let Ok(entries) = fs::read_dir("/proc") else { return Vec::new() };
    let pids = entries.flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let has = |pid: &u32| {
        let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        String::from_utf8_lossy(&line).replace('\0', " ").contains(text)
    };
    pids.filter(has).collect()
}

/// The id of a process that a file will hold.
pub fn pid_in(path: &Path) -> u32 {
    for _ in 0..6000 {
        match fs::read_to_string(path) {
            Ok(text) if text.ends_with('\n') => return text.trim().parse().expect("an id"),
            _ => thread::sleep(Duration::from_millis(5)),
        }
    }
    panic!("{} was not written", path.display());
}

/// Whether a process runs, by `/proc`.
pub fn runs(pid: u32) -> bool {
    let state = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // A zombie of another parent is dead.
    state.rsplit(')').next().is_some_and(|rest| !rest.trim().is_empty() && !rest.contains(" Z "))
}
