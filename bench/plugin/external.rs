//! A program as a method: its parameters and files, its command, and the meaning of its exit code, its output and its
//! standard error.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::sync::Arc;
use std::{fs, io};

use medial::complex::{self, MedialMesh, Radii, ReadOptions};
use medial::shape::Shape;
use medial::simplifier::{
    Level, MedialSimplifier, MethodInfo, Params, RunContext, Simplification, Simplified,
    SimplifyError,
};
use medial::surface::{self, TriMesh};
use medial_run::axis::reach;
use medial_run::hash::hex;
use medial_run::record::OwnSeconds;
use medial_run::timed::ProgramPeak;
use serde::Deserialize;
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};
use tempfile::TempDir;

use super::declaration::{Declaration, LevelKind, OutputUnits, Word};
use super::program::{self, Ended};
use crate::process_tree::ending_signal;

/// Environment variable with the folder of temporary folders.
pub const SCRATCH: &str = "MEDIAL_SCRATCH";

/// An external program as a method, declared in a plug-in file.
///
/// [`MedialSimplifier::prepare`] writes the files that the program reads, and each level is a run of
/// the program. So the program repeats its preparation for each level, and its time counts each time.
/// A program can report the parts as [`OwnSeconds`].
#[derive(Debug)]
pub struct External {
    declaration: Arc<Declaration>,
    /// SHA-256 over the declaration and its files: an edited script is a new version.
    pub fingerprint: String,
}

impl External {
    pub(super) fn new(declaration: Declaration) -> io::Result<Self> {
        let fingerprint = fingerprint(&declaration)?;
        Ok(Self { declaration: Arc::new(declaration), fingerprint })
    }

    /// A warning about files that the command names inside of a word, such as `--in=in.ma` or a script in a shell
    /// command, and that the fingerprint does not cover.
    pub fn remark(&self) -> Option<String> {
        let Declaration { info, folder, arguments, .. } = &*self.declaration;
        let covered: Vec<_> = files(&self.declaration).flat_map(fs::canonicalize).collect();
        let is_end = |c: char| c.is_whitespace() || "=,;:'\"()<>|&".contains(c);
        let texts: Vec<String> = arguments.iter().map(|word| word.fill(|_| " ".into())).collect();
        let mut names: Vec<&str> = texts.iter().flat_map(|text| text.split(is_end)).collect();
        names.retain(|name| {
            let path = fs::canonicalize(folder.join(name));
            path.is_ok_and(|path| path.is_file() && !covered.contains(&path))
        });
        (!names.is_empty()).then(|| {
            let (id, names) = (&info.id, names.join(", "));
            format!(
                "plug-in {id}: changes of {names} are not noticed; list them in `files = [...]`"
            )
        })
    }

    /// The text of every parameter: as it was set, or the default.
    ///
    /// The default decides the type: a number, `true` or `false`, or any text.
    fn values(&self, params: &Params) -> Result<Vec<(String, String)>, SimplifyError> {
        let declared = &self.declaration.info.params;
        if let Some(key) = params.0.keys().find(|key| !declared.iter().any(|p| p.name == **key)) {
            let names: Vec<&str> = declared.iter().map(|param| &*param.name).collect();
            let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            let message = format!("unknown parameter `{key}` (expected one of: {known})");
            return Err(SimplifyError::Parameter(message));
        }
        let mut values = Vec::new();
        for param in declared {
            let text = match params.0.get(&*param.name) {
                Some(value) => text_like(value, &param.default).map_err(|why| {
                    SimplifyError::Parameter(format!("{} = {value}: {why}", param.name))
                })?,
                None => param.default.clone(),
            };
            values.push((param.name.to_string(), text));
        }
        Ok(values)
    }

    fn uses(&self, placeholder: &str) -> bool {
        let mut words = self.declaration.arguments.iter();
        words.any(|word| word.placeholders().any(|name| name == placeholder))
    }
}

impl MedialSimplifier for External {
    fn info(&self) -> &MethodInfo {
        &self.declaration.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        // Before any substrate is built: a wrong parameter must not cost the time for one.
        let mut values = self.values(params)?;
        // Only where the command names it: each substrate that is used counts in the method's seconds.
        let initial = if self.uses("initial") { Some(shape.initial()?) } else { None };
        let scratch = scratch_folder().map_err(|error| cannot("make a temporary folder", error))?;
        let files = ["surface.off", "initial.ma"].map(|name| scratch.path().join(name));
        let back = shape.normalisation();
        if self.uses("surface") {
            let vertices = shape.mesh().vertices.iter().map(|&v| back.backward(v)).collect();
            let mesh = TriMesh { vertices, faces: shape.mesh().faces.clone() };
            surface::write(&files[0], &mesh).map_err(|error| cannot("write {surface}", error))?;
        }
        if let Some(initial) = initial {
            let mesh = initial.to_input(back);
            complex::write(&files[1], &mesh).map_err(|error| cannot("write {initial}", error))?;
        }
        for (name, path) in ["surface", "initial"].into_iter().zip(files) {
            values.push((name.to_owned(), path.to_string_lossy().into_owned()));
        }
        values.push(("seed".to_owned(), run.seed.to_string()));
        values.push(("threads".to_owned(), rayon::current_num_threads().to_string()));
        let declaration = Arc::clone(&self.declaration);
        Ok(Box::new(PreparedProgram { shape, declaration, values, run: run.clone(), scratch }))
    }
}

/// A program with one shape in files.
struct PreparedProgram<'s> {
    shape: &'s Shape,
    declaration: Arc<Declaration>,
    /// Every placeholder but those of a level, with its text.
    values: Vec<(String, String)>,
    run: RunContext,
    /// Removed with all files when the simplification is dropped.
    scratch: TempDir,
}

impl Simplification for PreparedProgram<'_> {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        self.check(level)?;
        let output = self.scratch.path().join("output.ma");
        // The output of an earlier level must not pass for this one.
        match fs::remove_file(&output) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(cannot("clear {output}", error));
            }
            _ => {}
        }
        let ended = program::run(self.command(level, &output), &self.run)
            .map_err(|error| cannot(&format!("run {}", self.declaration.program.display()), error));
        let ended = ended?.ok_or(SimplifyError::Cancelled)?;
        check_status(&self.declaration.info.id, ended.status, &ended.stderr)?;
        self.result(level, &output, &ended)
    }
}

impl PreparedProgram<'_> {
    fn check(&self, level: Level) -> Result<(), SimplifyError> {
        let Declaration { info, levels, .. } = &*self.declaration;
        if !levels.contains(&LevelKind::of(level)) {
            let options: Vec<&str> = levels.iter().map(|kind| kind.words()[1]).collect();
            let (kind, options) = (LevelKind::of(level).words()[0], options.join(" or "));
            let id = &info.id;
            return Err(SimplifyError::unsupported(format!("{id} has no {kind}; give {options}")));
        }
        match level {
            Level::Spheres(0) => Err(SimplifyError::Level("give at least one sphere".into())),
            Level::Native(value) if !value.is_finite() => {
                Err(SimplifyError::Level(format!("expected a finite number, found {value}")))
            }
            _ => Ok(()),
        }
    }

    fn command(&self, level: Level, output: &Path) -> Command {
        let mut command = Command::new(&self.declaration.program);
        for word in &self.declaration.arguments {
            command.arg(word.fill(|name| match (name, level) {
                ("output", _) => output.to_string_lossy().into_owned(),
                ("spheres", Level::Spheres(count)) => count.to_string(),
                ("native", Level::Native(value)) => value.to_string(),
                _ => {
                    // The placeholder of a level that is not requested is empty.
                    let known = self.values.iter().find(|(known, _)| known == name);
                    known.map_or_else(String::new, |(_, text)| text.clone())
                }
            }));
        }
        command.current_dir(&self.declaration.folder);
        command
    }

    /// The result of a program that exited with code 0.
    fn result(
        &self,
        level: Level,
        output: &Path,
        ended: &Ended,
    ) -> Result<Simplified, SimplifyError> {
        let (mesh, notes) = self.read(output)?;
        let report = Report::of(&ended.stdout);
        let mut simplified = Simplified::new(mesh, level);
        // A program need not report the native level that it was started with.
        simplified.native_level = match level {
            Level::Native(value) => report.native_level.or(Some(value)),
            _ => report.native_level,
        };
        let diagnostics = &mut simplified.diagnostics;
        report.warnings.into_iter().chain(notes).for_each(|warning| diagnostics.warn(warning));
        if ended.orphans > 0 {
            diagnostics.warn(format!("processes that the program left running: {}", ended.orphans));
        }
        simplified.extras.insert(ProgramPeak(ended.peak));
        if let Some(seconds) = report.seconds {
            simplified.extras.insert(seconds);
        }
        Ok(simplified)
    }

    /// The medial mesh of the output in normalised units, and notes on repairs.
    fn read(&self, output: &Path) -> Result<(MedialMesh, Vec<String>), SimplifyError> {
        let invalid = |why: String| Err(SimplifyError::InvalidOutput(why));
        let metadata = match fs::metadata(output) {
            Err(_) => return invalid("{output}: no file, but exit code 0".to_owned()),
            // A device or a pipe could be read without end.
            Ok(metadata) if !metadata.is_file() => {
                return invalid("{output}: not a regular file".to_owned());
            }
            Ok(metadata) => metadata,
        };
        let bytes = metadata.len();
        // By the size that the system reports: an endless file must not be read.
        if bytes > LARGEST_OUTPUT {
            return invalid(format!(
                "{{output}}: too large (found {bytes} bytes, expected at most {LARGEST_OUTPUT})"
            ));
        }
        let bytes = match fs::read(output) {
            Ok(bytes) => bytes,
            Err(error) => return invalid(format!("{{output}}: {error}")),
        };
        let strict = ReadOptions { radii: Radii::NotNegative, ..ReadOptions::default() };
        let mut loaded = match complex::parse_ma(bytes, "", strict) {
            Ok(loaded) => loaded,
            Err(error) => {
                // The name of the temporary file would not help.
                let line = error.line.map_or_else(String::new, |line| format!(", line {line}"));
                return invalid(format!("{{output}}{line}: {}", error.kind));
            }
        };
        if self.declaration.fit == OutputUnits::Auto
            && let Some(fit) = self.shape.fit_if_needed(&loaded.mesh)?
        {
            loaded.mesh = fit.similarity.mesh(&loaded.mesh);
            loaded.notes.push(format!("fitted: {fit}"));
        }
        reach(&loaded.mesh, self.shape).map_err(SimplifyError::InvalidOutput)?;
        let normal = self.shape.normalisation();
        let mesh = loaded.mesh.to_normal(normal);
        // The reader repairs lists, and the check refuses all other defects.
        mesh.check()?;
        Ok((mesh, loaded.notes))
    }
}

/// An operation that the system refused, not a fault of the program.
fn cannot(what: &str, error: impl std::fmt::Display) -> SimplifyError {
    SimplifyError::Failed(format!("cannot {what}: {error}"))
}

fn scratch_folder() -> io::Result<TempDir> {
    let mut builder = tempfile::Builder::new();
    builder.prefix("medial-");
    match std::env::var_os(SCRATCH).filter(|folder| !folder.is_empty()) {
        // The program runs in another folder, where a relative path would be wrong.
        Some(folder) => builder.tempdir_in(std::path::absolute(folder)?),
        None => builder.tempdir(),
    }
}

/// A value as text, if it is of the same type as a default.
fn text_like(value: &Value, default: &str) -> Result<String, &'static str> {
    // The default decides the type, as the declaration has no other place for it.
    let default: Value = serde_json::from_str(default).unwrap_or_else(|_| default.into());
    match (value, default) {
        (Value::Array(_) | Value::Object(_) | Value::Null, _) => Err("expected a single value"),
        (Value::Number(number), Value::Number(_)) => Ok(number.to_string()),
        (_, Value::Number(_)) => Err("expected a number"),
        (Value::Bool(flag), Value::Bool(_)) => Ok(flag.to_string()),
        (_, Value::Bool(_)) => Err("expected true or false"),
        (Value::String(text), _) => Ok(text.clone()),
        (other, _) => Ok(other.to_string()),
    }
}

/// The files of a plug-in: its program, those that are words of the command, and those that it lists.
fn files(declaration: &Declaration) -> impl Iterator<Item = PathBuf> {
    let words = declaration.arguments.iter().filter_map(Word::plain);
    let words = words.map(|word| declaration.folder.join(word));
    // A program from PATH is part of the machine, one next to the file is part of the plug-in.
    let own = declaration.written.first().is_some_and(|program| program.contains('/'));
    let program = own.then(|| declaration.program.clone());
    program.into_iter().chain(words).chain(declaration.files.iter().cloned())
}

/// SHA-256 of a declaration and of its files.
fn fingerprint(declaration: &Declaration) -> io::Result<String> {
    let Declaration { info, levels, written, fit, .. } = declaration;
    let MethodInfo { id, title, citation, native, params, .. } = info;
    let declared = json!([id, title, citation, levels, native, params, written, fit]);
    let mut hasher = Sha256::new();
    hasher.update(declared.to_string());
    for (place, file) in files(declaration).enumerate().filter(|(_, file)| file.is_file()) {
        let bytes = fs::read(&file)?;
        // With its place and its length: otherwise bytes could move from one file to the next unnoticed.
        hasher.update(format!("\n{place} {}\n", bytes.len()));
        hasher.update(bytes);
    }
    Ok(hex(&hasher.finalize()))
}

/// Exit code of a program that does not support the request, which is not a failure.
const UNSUPPORTED: i32 = 65;
/// Most bytes of an output; larger files are refused unread.
const LARGEST_OUTPUT: u64 = 1_000_000_000;

/// Returns an error for every exit code but 0.
fn check_status(id: &str, status: ExitStatus, stderr: &str) -> Result<(), SimplifyError> {
    let message = last_line(stderr);
    match status.code() {
        Some(0) => Ok(()),
        Some(UNSUPPORTED) => {
            let why = message.unwrap_or_else(|| {
                format!("{id}: exit code {UNSUPPORTED} without a reason on standard error")
            });
            Err(SimplifyError::Unsupported { why })
        }
        Some(code) => {
            let message = message.unwrap_or_else(|| "no text on standard error".to_owned());
            Err(SimplifyError::Failed(format!("{id}: exit code {code}: {message}")))
        }
        None => {
            let message = message.map_or_else(String::new, |line| format!(": {line}"));
            let by = ending_signal(status).unwrap_or_default();
            Err(SimplifyError::Crashed(format!("{id}: ended by {by}{message}")))
        }
    }
}

/// Most warnings of a program; further ones are probably a log.
const MOST_WARNINGS: usize = 50;
/// Most characters of a warning.
const LONGEST_WARNING: usize = 1000;

/// The report of a program about its run.
#[derive(Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
struct Report {
    seconds: Option<OwnSeconds>,
    native_level: Option<f64>,
    /// Warnings of the program, then warnings about the report.
    warnings: Vec<String>,
    #[serde(flatten)]
    unknown: BTreeMap<String, Value>,
}

impl Report {
    /// The last line that is a JSON object.
    // Programs print any text: an invalid report gives a warning and keeps the result.
    fn of(stdout: &str) -> Self {
        let mut objects = stdout
            .lines()
            .rev()
            .filter_map(|line| serde_json::from_str::<Map<_, _>>(line.trim()).ok());
        let Some(object) = objects.next() else { return Self::default() };
        let mut report = match serde_json::from_value::<Self>(Value::Object(object)) {
            Ok(report) => report,
            Err(why) => {
                let ignored = format!("the report is invalid and ignored: {why}");
                return Self { warnings: vec![clean(&ignored)], ..Self::default() };
            }
        };
        report.warnings.truncate(MOST_WARNINGS);
        report.warnings.iter_mut().for_each(|warning| *warning = clean(warning));
        for key in std::mem::take(&mut report.unknown).into_keys() {
            report
                .warnings
                .push(format!("the report has an unknown key `{}`, ignored", clean(&key)));
        }
        let seconds = report.seconds.unwrap_or_default();
        if [seconds.prepare, seconds.simplify].into_iter().flatten().any(|seconds| seconds < 0.0) {
            report.warnings.push("the report has negative seconds, ignored".to_owned());
            report.seconds = None;
        }
        report
    }
}

/// The last line that is not empty, without control characters.
pub(crate) fn last_line(text: &str) -> Option<String> {
    text.lines().rev().map(clean).find(|line| !line.is_empty())
}

/// A text of a program without control characters, of limited length.
fn clean(text: &str) -> String {
    // Escape sequences of a program would move the cursor in a printed table.
    let printable = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    printable.take(LONGEST_WARNING).collect::<String>().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_object_counts_and_invalid_parts_give_warnings() {
        let text = "log\n{\"native_level\": 1}\n{\"native_level\": 2.5, \"seconds\": {\"simplify\": 3, \
                    \"io\": 1}, \"warnings\": [\"thin\\u0007\"], \"extra\": 0}\nbye\n[1]\n";
        let report = Report::of(text);
        assert_eq!(report.native_level, Some(2.5));
        assert_eq!(report.seconds, Some(OwnSeconds { prepare: None, simplify: Some(3.0) }));
        assert!(report.warnings[0] == "thin" && report.warnings[1].contains("`extra`"));
        for odd in ["{\"seconds\": 3}", "{\"seconds\": {\"prepare\": -1}}", "{\"warnings\": [1]}"] {
            let report = Report::of(odd);
            assert!(report.warnings[0].contains("ignored"), "{odd}: {report:?}");
            assert_eq!(report.seconds, None);
        }
        assert_eq!(Report::of("nothing\n"), Report::default());
    }

    #[test]
    fn last_lines_have_no_control_characters() {
        assert_eq!(last_line("one\ntwo\u{1b}[0m \n\n").as_deref(), Some("two [0m"));
        assert_eq!(last_line(" \n"), None);
    }
}
