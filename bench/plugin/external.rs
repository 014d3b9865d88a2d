//! A program as a method.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use medial::complex;
use medial::shape::Shape;
use medial::simplifier::{
    Capability, Level, MedialSimplifier, MethodInfo, Params, RunContext, Simplification,
    Simplified, SimplifyError,
};
use medial::surface::{self, TriMesh};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tempfile::TempDir;

use super::answer::{Task, answer};
use super::declaration::{AnswerUnits, Declaration, LevelKind};
use super::program::{self, NoEnd};
use super::template::Word;

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
        let value = |param: &medial::simplifier::ParamInfo| {
            let text = match params.0.get(&*param.name) {
                Some(value) => text_like(value, &param.default).map_err(|why| {
                    SimplifyError::Parameter(format!("{} = {value}: {why}", param.name))
                })?,
                None => param.default.clone(),
            };
            Ok((param.name.to_string(), text))
        };
        declared.iter().map(value).collect()
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
        let value = |name: &str| match (name, level) {
            ("output", _) => output.to_string_lossy().into_owned(),
            ("spheres", Level::Spheres(count)) => count.to_string(),
            ("native", Level::Native(value)) => value.to_string(),
            _ => {
                // The placeholder of a level that is not asked is empty.
                let known = self.values.iter().find(|(known, _)| known == name);
                known.map_or_else(String::new, |(_, text)| text.clone())
            }
        };
        let mut command = Command::new(&self.program);
        command.args(self.arguments.iter().map(|word| word.fill(value)));
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
