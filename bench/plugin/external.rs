//! A program as a method: its parameters and files, its command, and the meaning of its exit code, its output and its
//! last words.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};

use medial::complex::{self, MedialMesh, Radii, ReadOptions};
use medial::shape::Shape;
use medial::simplifier::{
    Capability, Level, MedialSimplifier, MethodInfo, Params, RunContext, Simplification,
    Simplified, SimplifyError,
};
use medial::surface::{self, TriMesh};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tempfile::TempDir;

use super::declaration::{AnswerUnits, Declaration, LevelKind, Word};
use super::program::{self, Ended, NoEnd};

/// Variable of the environment that names the folder in which temporary folders are made.
pub const SCRATCH: &str = "MEDIAL_SCRATCH";

/// A method that is a program of its own, as a file of plug-ins declares it.
///
/// [`MedialSimplifier::prepare`] writes the files that the program reads, and each level is a run of
/// the program. So what the program does before it knows the level is done for each level anew, and
/// counted so; [`OwnSeconds`](super::OwnSeconds) tells the parts apart where the program does.
#[derive(Debug)]
pub struct External {
    info: MethodInfo,
    declaration: Declaration,
    /// Where the program runs, and relative paths start.
    folder: PathBuf,
    fingerprint: String,
}

impl External {
    pub(super) fn new(declaration: Declaration, folder: &Path) -> io::Result<Self> {
        let fingerprint = fingerprint(&declaration, folder)?;
        let mut info = MethodInfo::new(declaration.id.clone(), declaration.title.clone())
            .citation(declaration.citation.clone())
            .summary(format!("An external program: {}.", declaration.written.join(" ")))
            .params(declaration.params.clone())
            .extra(Capability::new("own_seconds", "seconds that the program measured by itself"))
            .extra(Capability::new("program_peak", "most resident bytes of the program"));
        info.native.clone_from(&declaration.native);
        if declaration.levels.contains(&LevelKind::Published) {
            info = info.published("what the program does without a level");
        }
        Ok(Self { info, declaration, folder: folder.to_owned(), fingerprint })
    }

    /// SHA-256 over the declaration and the files that its command names: an edited script is not
    /// taken for the old one.
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// The text of every parameter: as it was set, or the default.
    ///
    /// The default decides the type: a number, `true` or `false`, or any text.
    fn values(&self, params: &Params) -> Result<Vec<(String, String)>, SimplifyError> {
        let declared = &self.declaration.params;
        if let Some(key) = params.0.keys().find(|key| !declared.iter().any(|p| p.name == **key)) {
            let names: Vec<&str> = declared.iter().map(|param| &*param.name).collect();
            let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            let message = format!("unknown parameter `{key}`; there are: {known}");
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

    fn asks_for(&self, placeholder: &str) -> bool {
        let mut words = self.declaration.arguments.iter();
        words.any(|word| word.placeholders().any(|name| name == placeholder))
    }
}

impl MedialSimplifier for External {
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        let mut values = self.values(params)?;
        let initial = if self.asks_for("initial") { Some(shape.initial()?) } else { None };
        let scratch = scratch_folder().map_err(|error| cannot("make a temporary folder", error))?;
        let files = ["surface.off", "initial.ma"].map(|name| scratch.path().join(name));
        let back = shape.normalisation();
        if self.asks_for("surface") {
            let vertices = shape.mesh().vertices.iter().map(|&v| back.backward(v)).collect();
            let mesh = TriMesh { vertices, faces: shape.mesh().faces.clone() };
            surface::write(&files[0], &mesh).map_err(|error| cannot("write {surface}", error))?;
        }
        if let Some(initial) = initial {
            let mesh = initial.transformed(back.diagonal, |p| back.backward(p));
            complex::write(&files[1], &mesh).map_err(|error| cannot("write {initial}", error))?;
        }
        for (name, path) in ["surface", "initial"].into_iter().zip(files) {
            values.push((name.to_owned(), path.to_string_lossy().into_owned()));
        }
        values.push(("seed".to_owned(), run.seed.to_string()));
        values.push(("threads".to_owned(), rayon::current_num_threads().to_string()));
        let Declaration { id, levels, program, arguments, fit, .. } = &self.declaration;
        Ok(Box::new(Prepared {
            shape,
            id: id.clone(),
            levels: levels.clone(),
            fits: *fit == AnswerUnits::Auto,
            program: program.clone(),
            arguments: arguments.clone(),
            folder: self.folder.clone(),
            values,
            run: run.clone(),
            scratch,
        }))
    }
}

/// One shape in files.
struct Prepared<'s> {
    shape: &'s Shape,
    id: String,
    levels: Vec<LevelKind>,
    fits: bool,
    program: PathBuf,
    arguments: Vec<Word>,
    folder: PathBuf,
    /// Every placeholder but those of a level, with its text.
    values: Vec<(String, String)>,
    run: RunContext,
    /// Removed with all files when the simplification is dropped.
    scratch: TempDir,
}

impl Simplification for Prepared<'_> {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        self.check(level)?;
        let output = self.scratch.path().join("output.ma");
        // What an earlier level left there must not be taken for the answer to this one.
        match fs::remove_file(&output) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(cannot("clear {output}", error));
            }
            _ => {}
        }
        let ended = match program::run(self.command(level, &output), &self.run) {
            Ok(ended) => ended,
            Err(NoEnd::Cancelled) => return Err(SimplifyError::Cancelled),
            Err(NoEnd::System(error)) => {
                return Err(cannot(&format!("run {}", self.program.display()), error));
            }
        };
        let Self { id, shape, fits, .. } = self;
        answer(&Task { id, shape, level, output: &output, fits: *fits }, ended)
    }
}

impl Prepared<'_> {
    fn check(&self, level: Level) -> Result<(), SimplifyError> {
        if !self.levels.contains(&LevelKind::of(level)) {
            let known: Vec<&str> = self.levels.iter().map(|kind| kind.name()).collect();
            let why = format!(
                "the plug-in {} is not asked for {level}: its levels are {}",
                self.id,
                known.join(", ")
            );
            return Err(SimplifyError::unsupported(why));
        }
        match level {
            Level::Spheres(0) => Err(SimplifyError::Level("ask for at least one sphere".into())),
            Level::Native(value) if !value.is_finite() => {
                Err(SimplifyError::Level(format!("{value} is not a finite number")))
            }
            _ => Ok(()),
        }
    }

    fn command(&self, level: Level, output: &Path) -> Command {
        let mut command = Command::new(&self.program);
        for word in &self.arguments {
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
        command.current_dir(&self.folder);
        command
    }
}

/// The system does not let us do something: that is no fault of the program.
fn cannot(what: &str, error: impl std::fmt::Display) -> SimplifyError {
    SimplifyError::Failed(format!("cannot {what}: {error}"))
}

fn scratch_folder() -> io::Result<TempDir> {
    let mut builder = tempfile::Builder::new();
    builder.prefix("medial-");
    match std::env::var_os(SCRATCH).filter(|folder| !folder.is_empty()) {
        // The program runs elsewhere: a relative path would lead it astray.
        Some(folder) => builder.tempdir_in(std::path::absolute(folder)?),
        None => builder.tempdir(),
    }
}

/// A value as text, if it is of the same type as a default.
fn text_like(value: &Value, default: &str) -> Result<String, &'static str> {
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

/// SHA-256 of a declaration and of every file that a word of its command names.
fn fingerprint(declaration: &Declaration, folder: &Path) -> io::Result<String> {
    let Declaration { id, title, citation, levels, native, params, written, fit, .. } = declaration;
    let declared = json!([id, title, citation, levels, native, params, written, fit]);
    let mut hasher = Sha256::new();
    hasher.update(declared.to_string());
    let words = declaration.arguments.iter().filter_map(Word::plain).map(|word| folder.join(word));
    // A program from PATH is part of the machine, one beside the file is part of the plug-in.
    let own = written.first().is_some_and(|program| program.contains('/'));
    let files = own.then(|| declaration.program.clone()).into_iter().chain(words);
    for (place, file) in files.enumerate().filter(|(_, file)| file.is_file()) {
        hasher.update(format!("\n{place} {}\n", fs::metadata(&file)?.len()));
        io::copy(&mut File::open(&file)?, &mut Hashed(&mut hasher))?;
    }
    Ok(hexadecimal(&hasher.finalize()))
}

/// Bytes of a digest as text.
pub(super) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Hashes what is written.
struct Hashed<'a>(&'a mut Sha256);

impl io::Write for Hashed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

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
struct Task<'a> {
    id: &'a str,
    shape: &'a Shape,
    level: Level,
    output: &'a Path,
    /// Whether the answer may be in other units, which are then found.
    fits: bool,
}

/// The result of a program that has ended.
fn answer(task: &Task<'_>, ended: Ended) -> Result<Simplified, SimplifyError> {
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
            let why = said.unwrap_or_else(|| {
                format!("{id} ended with exit code {UNSUPPORTED} and gave no reason")
            });
            Err(SimplifyError::Unsupported { why })
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
    let Ok(metadata) = fs::metadata(task.output) else {
        return Err(SimplifyError::InvalidOutput("exit 0, but no file at {output}".to_owned()));
    };
    if !metadata.is_file() {
        return Err(SimplifyError::InvalidOutput(
            "exit 0, but what is at {output} is not a file".to_owned(),
        ));
    }
    let bytes = metadata.len();
    if bytes > LARGEST_OUTPUT {
        let message = format!("the file at {{output}} has {bytes} bytes, {LARGEST_OUTPUT} at most");
        return Err(SimplifyError::InvalidOutput(message));
    }
    let bytes = fs::read(task.output).map_err(|error| {
        SimplifyError::InvalidOutput(format!("the file at {{output}}: {error}"))
    })?;
    let strict = ReadOptions { radii: Radii::NotNegative, ..ReadOptions::default() };
    let mut loaded = complex::parse_ma_with(bytes, "", strict).map_err(|error| {
        // The file's name is a temporary one and says nothing.
        let line = error.line.map_or_else(String::new, |line| format!(", line {line}"));
        SimplifyError::InvalidOutput(format!("the file at {{output}}{line}: {}", error.kind))
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
    for (id, sphere) in mesh.spheres.iter().enumerate() {
        let reach = sphere.centre.abs().max_element().max(sphere.radius);
        if reach > LARGEST_SPHERE {
            return Err(SimplifyError::InvalidOutput(format!(
                "sphere {id} reaches {reach:.1e} diagonals of the surface away from it: write the units of \
                 {{surface}}"
            )));
        }
    }
    Ok((mesh, loaded.notes))
}

/// More or longer warnings than this are a program that writes its log there.
const MOST_WARNINGS: usize = 50;
/// Characters of a warning.
const LONGEST_WARNING: usize = 1000;

/// Seconds that a program measured by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OwnSeconds {
    /// Work that does not depend on the level.
    pub prepare: Option<f64>,
    /// The rest.
    pub simplify: Option<f64>,
}

/// What a program said, as far as it can be understood.
#[derive(Clone, Debug, Default, PartialEq)]
struct Report {
    seconds: Option<OwnSeconds>,
    native_level: Option<f64>,
    /// Its own, then those on the report.
    warnings: Vec<String>,
}

impl Report {
    /// The last line that is a JSON object, or nothing.
    fn of(stdout: &str) -> Self {
        let mut report = Self::default();
        let mut objects = stdout.lines().rev().filter_map(|line| {
            serde_json::from_str::<serde_json::Map<String, Value>>(line.trim()).ok()
        });
        let Some(object) = objects.next() else { return report };
        let mut remarks = Vec::new();
        for (key, value) in object {
            let understood = match key.as_str() {
                "seconds" => report.set_seconds(&value, &mut remarks),
                "native_level" => value.as_f64().map(|level| report.native_level = Some(level)),
                "warnings" => report.set_warnings(&value),
                _ => {
                    remarks.push(format!("its report has a key `{}`, ignored", clean(&key)));
                    Some(())
                }
            };
            if understood.is_none() {
                remarks.push(format!("its report has no sensible `{key}`, ignored"));
            }
        }
        report.warnings.extend(remarks);
        report
    }

    fn set_seconds(&mut self, value: &Value, remarks: &mut Vec<String>) -> Option<()> {
        let mut seconds = OwnSeconds::default();
        for (key, value) in value.as_object()? {
            let number = value.as_f64().filter(|seconds| *seconds >= 0.0);
            match key.as_str() {
                "prepare" => seconds.prepare = Some(number?),
                "simplify" => seconds.simplify = Some(number?),
                other => {
                    remarks
                        .push(format!("its report has a key `seconds.{}`, ignored", clean(other)));
                }
            }
        }
        self.seconds = Some(seconds);
        Some(())
    }

    fn set_warnings(&mut self, value: &Value) -> Option<()> {
        let list = value.as_array()?;
        let texts: Option<Vec<&str>> = list.iter().map(Value::as_str).collect();
        self.warnings = texts?.into_iter().take(MOST_WARNINGS).map(clean).collect();
        Some(())
    }
}

/// The last line that is not empty, fit to stand in a sentence.
fn last_line(text: &str) -> Option<String> {
    text.lines().rev().map(clean).find(|line| !line.is_empty())
}

/// A text of a program without what would disturb a terminal or a table.
fn clean(text: &str) -> String {
    let printable = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    printable.take(LONGEST_WARNING).collect::<String>().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_object_counts_and_what_is_odd_in_it_is_named() {
        let text = "log\n{\"native_level\": 1}\n{\"native_level\": 2.5, \"seconds\": {\"simplify\": 3, \
                    \"io\": 1}, \"warnings\": [\"thin\\u0007\"], \"extra\": 0}\nbye\n[1]\n";
        let report = Report::of(text);
        assert_eq!(report.native_level, Some(2.5));
        assert_eq!(report.seconds, Some(OwnSeconds { prepare: None, simplify: Some(3.0) }));
        assert_eq!(report.warnings[0], "thin");
        assert!(report.warnings[1].contains("seconds.io") && report.warnings[2].contains("extra"));
        for odd in ["{\"seconds\": 3}", "{\"seconds\": {\"prepare\": -1}}", "{\"warnings\": [1]}"] {
            let report = Report::of(odd);
            assert!(report.warnings[0].contains("no sensible"), "{odd}: {report:?}");
            assert_eq!(report.seconds, None);
        }
        assert_eq!(Report::of("nothing\n"), Report::default());
    }

    #[test]
    fn last_lines_are_fit_to_be_read() {
        assert_eq!(last_line("one\ntwo\u{1b}[0m \n\n").as_deref(), Some("two [0m"));
        assert_eq!(last_line(" \n"), None);
    }
}
