//! What the end of a program means.

use std::fs;
use std::path::Path;
use std::process::ExitStatus;

use medial::complex::{self, MedialMesh, Radii, ReadOptions};
use medial::shape::Shape;
use medial::simplifier::{Level, Simplified, SimplifyError};

use super::program::Ended;
use super::report::{Report, last_line};

/// Exit code of a program that does not do what it was asked, which is an answer and no failure.
const UNSUPPORTED: i32 = 65;
/// Bytes of an output; larger ones are refused unread.
const LARGEST_OUTPUT: u64 = 1_000_000_000;
/// A medial mesh larger than this, in diagonals of the surface, cannot belong to it.
const LARGEST_SPHERE: f64 = 1e12;

/// Most resident bytes of a program and its descendants together, as far as they were looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramPeak(pub u64);

/// What a program was asked for.
pub(super) struct Task<'a> {
    pub id: &'a str,
    pub shape: &'a Shape,
    pub level: Level,
    pub output: &'a Path,
    /// Whether the answer may be in other units, which are then found.
    pub fits: bool,
}

/// The result of a program that has ended.
pub(super) fn answer(task: &Task<'_>, ended: Ended) -> Result<Simplified, SimplifyError> {
    check_status(task.id, ended.status, &ended.stderr)?;
    let (mesh, notes) = read(task)?;
    let report = Report::of(&ended.stdout);
    let mut simplified = Simplified::new(mesh, task.level);
    simplified.native_level = match task.level {
        Level::Native(value) => report.native_level.or(Some(value)),
        _ => report.native_level,
    };
    let diagnostics = &mut simplified.diagnostics;
    report.warnings.into_iter().chain(notes).for_each(|warning| diagnostics.warn(warning));
    if ended.strays > 0 {
        let (count, were) = (ended.strays, if ended.strays == 1 { "was" } else { "were" });
        diagnostics.warn(format!(
            "the program had left {count} of its processes behind, which {were} ended"
        ));
    }
    simplified.extras.insert(ProgramPeak(ended.peak));
    if let Some(seconds) = report.seconds {
        simplified.extras.insert(seconds);
    }
    Ok(simplified)
}

/// Nothing, if the program says that it is done.
fn check_status(id: &str, status: ExitStatus, stderr: &str) -> Result<(), SimplifyError> {
    let said = last_line(stderr);
    match status.code() {
        Some(0) => Ok(()),
        Some(UNSUPPORTED) => {
            let nothing = || format!("{id} ended with exit code {UNSUPPORTED} and gave no reason");
            Err(SimplifyError::Unsupported { why: said.unwrap_or_else(nothing) })
        }
        Some(code) => {
            let said = said.unwrap_or_else(|| "nothing on standard error".to_owned());
            Err(SimplifyError::Failed(format!("{id} ended with exit code {code}: {said}")))
        }
        None => {
            let said = said.map_or_else(String::new, |line| format!("; it said: {line}"));
            let by = ending(status);
            Err(SimplifyError::Crashed(format!("{id} was ended by {by}{said}")))
        }
    }
}

/// What ended a program that did not end by itself.
#[cfg(unix)]
fn ending(status: ExitStatus) -> String {
    let signal = std::os::unix::process::ExitStatusExt::signal(&status).unwrap_or(0);
    const NAMES: [(i32, &str); 14] = [
        (1, "SIGHUP"),
        (2, "SIGINT"),
        (3, "SIGQUIT"),
        (4, "SIGILL, an illegal instruction"),
        (5, "SIGTRAP"),
        (6, "SIGABRT: it gave up by itself"),
        (8, "SIGFPE, an impossible computation"),
        (9, "SIGKILL; the system may have done so for lack of memory"),
        (11, "SIGSEGV, an access to memory that is not its own"),
        (13, "SIGPIPE"),
        (14, "SIGALRM"),
        (15, "SIGTERM"),
        (24, "SIGXCPU, a limit of processor time"),
        (25, "SIGXFSZ, a limit of the size of files"),
    ];
    // Numbers beside these differ between systems.
    let name = NAMES.iter().find(|(number, _)| *number == signal);
    name.map_or_else(|| format!("signal {signal}"), |(_, name)| (*name).to_owned())
}

#[cfg(not(unix))]
fn ending(status: ExitStatus) -> String {
    status.to_string()
}

/// The medial mesh of the output in normalised units, and what was repaired.
fn read(task: &Task<'_>) -> Result<(MedialMesh, Vec<String>), SimplifyError> {
    let invalid = |message: String| SimplifyError::InvalidOutput(message);
    let Ok(metadata) = fs::metadata(task.output) else {
        return Err(invalid("exit 0, but no file at {output}".to_owned()));
    };
    if !metadata.is_file() {
        return Err(invalid("exit 0, but what is at {output} is not a file".to_owned()));
    }
    let bytes = metadata.len();
    if bytes > LARGEST_OUTPUT {
        let message = format!("the file at {{output}} has {bytes} bytes, {LARGEST_OUTPUT} at most");
        return Err(invalid(message));
    }
    let bytes = fs::read(task.output)
        .map_err(|error| invalid(format!("the file at {{output}}: {error}")))?;
    let strict = ReadOptions { radii: Radii::NotNegative, ..ReadOptions::default() };
    let mut loaded = complex::parse_ma_with(bytes, "", strict).map_err(|error| {
        // The file's name is a temporary one and says nothing.
        let line = error.line.map_or_else(String::new, |line| format!(", line {line}"));
        invalid(format!("the file at {{output}}{line}: {}", error.kind))
    })?;
    if task.fits
        && let Some(fit) = task.shape.fit_if_needed(&loaded.mesh)?
    {
        loaded.mesh = fit.similarity.mesh(&loaded.mesh);
        loaded.notes.push(format!("fitted: {fit}"));
    }
    let normal = task.shape.normalisation();
    let mesh = loaded.mesh.transformed(1.0 / normal.diagonal, |p| normal.forward(p));
    mesh.check()?;
    let size = |s: &complex::Sphere| s.centre.abs().max_element().max(s.radius);
    if let Some(id) = mesh.spheres.iter().position(|sphere| size(sphere) > LARGEST_SPHERE) {
        return Err(invalid(format!(
            "sphere {id} reaches {:.1e} diagonals of the surface away from it: write the units of \
             {{surface}}",
            size(&mesh.spheres[id])
        )));
    }
    Ok((mesh, loaded.notes))
}
