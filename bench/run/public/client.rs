//! The clients of package registries, as child processes.
//!
//! Each runs in a folder of its own with nothing on standard input, and is ended with all that it started after a limit
//! of time. Only what needs no code of the package to run is asked for: wheels and no source distributions, whose
//! build would run and take minutes; no scripts of npm.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use medial_datasets::published::{Package, PackageKind};

use super::{PublicError, io_error};
use crate::process_tree::Family;

/// Time between two looks at a client.
const LOOK_AGAIN: Duration = Duration::from_millis(20);
/// How much of what a client said is told.
const TOLD: usize = 300;

/// How clients are run.
#[derive(Clone, Copy, Debug)]
pub struct Clients<'a> {
    /// The longest that one may take.
    pub limit: Duration,
    /// Set when the user interrupts.
    pub interrupted: &'a AtomicBool,
}

/// The package without its version, for what any version of it holds.
pub fn any_version(package: &Package) -> Package {
    Package { version: None, options: vec![], ..package.clone() }
}

impl Clients<'_> {
    /// Fetches a package into an empty folder, and gives its archive.
    ///
    /// # Errors
    /// When the client is not there, ends in an error, takes too long or leaves no archive; the message names the
    /// package and what the client said.
    pub(super) fn fetch(&self, package: &Package, folder: &Path) -> Result<PathBuf, PublicError> {
        let failed = |why: String| PublicError::Client(format!("{package}: {why}"));
        let mut absent = Vec::new();
        for words in commands(package) {
            let (program, arguments) = words.split_first().expect("a command has a name");
            match self.run(program, arguments, folder)? {
                Outcome::Absent => absent.push(program.clone()),
                Outcome::TookLong => {
                    let seconds = self.limit.as_secs_f64();
                    return Err(failed(format!("{program} took more than {seconds} s")));
                }
                Outcome::Failed(said) => {
                    return Err(failed(format!("`{}`: {said}", words.join(" "))));
                }
                Outcome::Done => {
                    let archive = archive_in(folder).map_err(io_error(folder))?;
                    return archive.ok_or_else(|| failed(format!("{program} left no archive")));
                }
            }
        }
        let (Some(program), ending) = (absent.first(), ending(package.kind)) else {
            return Err(failed("no client fetches it".into()));
        };
        Err(failed(format!(
            "there is no {program} here; install it, or fetch the {ending} on another machine and take it by `--from FILE`"
        )))
    }

    /// Runs a client to its end.
    fn run(
        &self,
        program: &str,
        arguments: &[String],
        folder: &Path,
    ) -> Result<Outcome, PublicError> {
        let said = folder.join("said");
        let mut command = Command::new(program);
        command.args(arguments).current_dir(folder).env("LC_ALL", "C").stdin(Stdio::null());
        // A file rather than a pipe: it never fills, and needs no thread.
        let output = File::create(&said).map_err(io_error(&said))?;
        let errors = output.try_clone().map_err(io_error(&said))?;
        command.stdout(output).stderr(errors);
        let mark = Family::mark(&mut command);
        let mut child = match command.spawn() {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Outcome::Absent),
            child => child.map_err(|error| PublicError::Client(format!("{program}: {error}")))?,
        };
        let mut family = Family::of(&child, &mark);
        let start = Instant::now();
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) => {}
                Err(error) => {
                    family.end(&mut child);
                    return Err(PublicError::Client(format!("{program}: {error}")));
                }
            }
            if self.interrupted.load(Ordering::Relaxed) {
                family.end(&mut child);
                return Err(PublicError::Interrupted);
            }
            if start.elapsed() > self.limit {
                family.end(&mut child);
                return Ok(Outcome::TookLong);
            }
            thread::sleep(LOOK_AGAIN);
        };
        family.end_strays();
        let text = fs::read(&said).unwrap_or_default();
        let _ = fs::remove_file(&said);
        Ok(if status.success() { Outcome::Done } else { Outcome::Failed(end_of(&text)) })
    }
}

/// What pip is to do: only wheels, which need no code of their own to be fetched.
const PIP: [&str; 7] = [
    "download",
    "--no-deps",
    "--only-binary=:all:",
    "--no-input",
    "--disable-pip-version-check",
    "--dest",
    ".",
];

enum Outcome {
    Done,
    Absent,
    TookLong,
    Failed(String),
}

/// What fetches a package; of several commands the first that is there.
fn commands(package: &Package) -> Vec<Vec<String>> {
    let versioned = |join: &str| match &package.version {
        Some(version) => format!("{}{join}{version}", package.name),
        None => package.name.clone(),
    };
    let command = |program: &[&str], join: &str| {
        let words = program.iter().map(|&word| word.to_owned());
        words.chain(package.options.iter().cloned()).chain([versioned(join)]).collect()
    };
    match package.kind {
        PackageKind::Deb => vec![command(&["apt-get", "download", "-q"], "=")],
        PackageKind::Npm => vec![command(&["npm", "pack", "--ignore-scripts", "--silent"], "@")],
        PackageKind::Pypi => {
            ["pip", "pip3"].map(|program| command(&[&[program][..], &PIP].concat(), "==")).to_vec()
        }
        PackageKind::File => vec![],
    }
}

fn ending(kind: PackageKind) -> &'static str {
    match kind {
        PackageKind::Deb => ".deb",
        PackageKind::Npm => ".tgz",
        PackageKind::Pypi => ".whl",
        PackageKind::File => "file",
    }
}

/// The archive that a client left: the first file by name.
fn archive_in(folder: &Path) -> io::Result<Option<PathBuf>> {
    let mut found: Vec<PathBuf> = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            found.push(entry.path());
        }
    }
    Ok(found.into_iter().min())
}

/// The end of what a client said, on one line.
fn end_of(said: &[u8]) -> String {
    let text = String::from_utf8_lossy(said);
    let words: Vec<&str> = text.split_whitespace().collect();
    let line = words.join(" ");
    let skipped = line.chars().count().saturating_sub(TOLD);
    match (line.is_empty(), skipped) {
        (true, _) => "it failed and said nothing".to_owned(),
        (_, 0) => line,
        _ => format!("... {}", line.chars().skip(skipped).collect::<String>()),
    }
}
