//! Plug-ins as they stand in a TOML file, read and checked: the declaration, the words of its command, and the reasons
//! for which a file is refused.

use std::collections::BTreeSet;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use medial::simplifier::{Level, NativeLevel, ParamInfo};
use serde::{Deserialize, Serialize};
use toml::Spanned;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(default)]
    method: Vec<Written>,
}

/// A table `[[method]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    id: Spanned<String>,
    title: String,
    #[serde(default)]
    citation: String,
    command: Spanned<Vec<Spanned<String>>>,
    levels: Spanned<Vec<LevelKind>>,
    native: Option<WrittenNative>,
    #[serde(default)]
    params: Vec<Spanned<WrittenParam>>,
    #[serde(default)]
    fit: AnswerUnits,
}

/// The units of an answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum AnswerUnits {
    /// Those of the surface.
    #[default]
    None,
    /// Whatever scale and shift fit, where the answer does not fit as it is.
    Auto,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenNative {
    name: String,
    unit: String,
    larger_is_coarser: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenParam {
    name: String,
    default: toml::Value,
    #[serde(default)]
    unit: String,
    #[serde(default)]
    help: String,
}

/// A kind of level that a plug-in can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum LevelKind {
    Spheres,
    Native,
    Published,
}

impl LevelKind {
    /// The kind of a level.
    pub fn of(level: Level) -> Self {
        match level {
            Level::Spheres(_) => Self::Spheres,
            Level::Native(_) => Self::Native,
            Level::Published => Self::Published,
        }
    }

    pub const fn name(self) -> &'static str {
        match self {
            Self::Spheres => "spheres",
            Self::Native => "native",
            Self::Published => "published",
        }
    }
}

/// A plug-in that was checked.
#[derive(Debug)]
pub(super) struct Declaration {
    pub id: String,
    pub title: String,
    pub citation: String,
    pub levels: Vec<LevelKind>,
    pub native: Option<NativeLevel>,
    pub params: Vec<ParamInfo>,
    pub fit: AnswerUnits,
    /// The command as it was written, for the fingerprint.
    pub written: Vec<String>,
    /// The program: an absolute path, or a name that was found in `PATH`.
    pub program: PathBuf,
    pub arguments: Vec<Word>,
}

/// Reads and checks all plug-ins of a file. `folder` is where its relative paths start, `taken` the
/// ids of other methods.
pub(super) fn read(
    file: &Path,
    text: &str,
    folder: &Path,
    taken: &[&str],
) -> Result<Vec<Declaration>, PluginError> {
    read_document(text, folder, taken).map_err(|(span, fault)| {
        let line = span.map(|span| {
            let before = text.as_bytes().get(..span.start).unwrap_or_default();
            1 + before.iter().filter(|&&byte| byte == b'\n').count()
        });
        PluginError { file: file.to_owned(), line, fault }
    })
}

fn read_document(
    text: &str,
    folder: &Path,
    taken: &[&str],
) -> Result<Vec<Declaration>, (Option<Range<usize>>, PluginFault)> {
    let document: Document = toml::from_str(text).map_err(|error| {
        let message = error.message().to_owned();
        // The parser has no error kinds: its words alone tell an unknown key from other errors.
        let fault = match message.starts_with("unknown ") {
            true => PluginFault::UnknownKey(message),
            false => PluginFault::Toml(message),
        };
        (error.span(), fault)
    })?;
    if document.method.is_empty() {
        return Err((None, PluginFault::NoMethod));
    }
    let mut ids = BTreeSet::new();
    let mut declarations = Vec::new();
    for written in document.method {
        let (id, at) = (written.id.get_ref().clone(), Some(written.id.span()));
        if taken.contains(&id.as_str()) {
            return Err((at, PluginFault::TakenId(id)));
        }
        if !ids.insert(id.clone()) {
            return Err((at, PluginFault::DuplicateId(id)));
        }
        declarations.push(written.check(folder).map_err(|(span, fault)| (Some(span), fault))?);
    }
    Ok(declarations)
}

/// Whether a text would do as an id on the command line.
pub(crate) fn is_id(text: &str) -> bool {
    !text.is_empty()
        && text.bytes().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'-')
}

/// What is wrong, and the bytes of the file that it belongs to.
type Misfit = (Range<usize>, PluginFault);

impl Written {
    fn check(self, folder: &Path) -> Result<Declaration, Misfit> {
        let id = self.id.get_ref();
        if !is_id(id) {
            return Err((self.id.span(), PluginFault::Id(id.clone())));
        }
        let params = check_params(&self.params)?;
        let (program, arguments) = check_command(&self.command, folder)?;
        self.check_placeholders(&arguments)?;
        self.check_levels(&arguments)?;
        Ok(Declaration {
            id: self.id.into_inner(),
            title: self.title,
            citation: self.citation,
            levels: self.levels.into_inner(),
            native: self.native.map(|native| NativeLevel {
                name: native.name.into(),
                unit: native.unit.into(),
                larger_is_coarser: native.larger_is_coarser,
            }),
            params,
            fit: self.fit,
            written: self.command.into_inner().into_iter().map(Spanned::into_inner).collect(),
            program,
            arguments: arguments.into_iter().map(|(word, _)| word).collect(),
        })
    }

    /// Every placeholder is known, and everything that has to be passed is.
    fn check_placeholders(&self, arguments: &[(Word, Range<usize>)]) -> Result<(), Misfit> {
        for (word, span) in arguments {
            let mut names = word.placeholders();
            if let Some(name) = names.find(|name| {
                !PLACEHOLDERS.contains(name)
                    && !self.params.iter().any(|param| param.get_ref().name == *name)
            }) {
                let known = PLACEHOLDERS.map(|name| format!("{{{name}}}")).join(", ");
                let fault = PluginFault::UnknownPlaceholder { name: name.to_owned(), known };
                return Err((span.clone(), fault));
            }
        }
        if !passes(arguments, "output") {
            return Err((self.command.span(), PluginFault::NoOutput));
        }
        match self.params.iter().find(|param| !passes(arguments, &param.get_ref().name)) {
            Some(param) => {
                Err((param.span(), PluginFault::UnusedParam(param.get_ref().name.clone())))
            }
            None => Ok(()),
        }
    }

    /// The levels are those that the command speaks of.
    fn check_levels(&self, arguments: &[(Word, Range<usize>)]) -> Result<(), Misfit> {
        let levels = self.levels.get_ref();
        if levels.is_empty() {
            return Err((self.levels.span(), PluginFault::NoLevels));
        }
        if levels.contains(&LevelKind::Native) && self.native.is_none() {
            return Err((self.levels.span(), PluginFault::NoNative));
        }
        for kind in [LevelKind::Spheres, LevelKind::Native] {
            match (levels.contains(&kind), passes(arguments, kind.name())) {
                (true, false) => {
                    return Err((self.levels.span(), PluginFault::LevelNotPassed(kind.name())));
                }
                (false, true) => {
                    return Err((self.command.span(), PluginFault::LevelNotDeclared(kind.name())));
                }
                _ => {}
            }
        }
        Ok(())
    }
}

fn passes(arguments: &[(Word, Range<usize>)], name: &str) -> bool {
    arguments.iter().any(|(word, _)| word.placeholders().any(|other| other == name))
}

fn check_params(written: &[Spanned<WrittenParam>]) -> Result<Vec<ParamInfo>, Misfit> {
    let mut params: Vec<ParamInfo> = Vec::new();
    for spanned in written {
        let WrittenParam { name, default, unit, help } = spanned.get_ref();
        if PLACEHOLDERS.contains(&name.as_str()) {
            return Err((spanned.span(), PluginFault::ReservedParam(name.clone())));
        }
        if params.iter().any(|other| other.name == *name) {
            return Err((spanned.span(), PluginFault::DuplicateParam(name.clone())));
        }
        // Numbers keep the digits of the file: the program gets them as text.
        let default = match default {
            toml::Value::String(text) => text.clone(),
            toml::Value::Integer(number) => number.to_string(),
            toml::Value::Float(number) => format!("{number:?}"),
            toml::Value::Boolean(flag) => flag.to_string(),
            _ => return Err((spanned.span(), PluginFault::Default(name.clone()))),
        };
        params.push(ParamInfo::new(name.clone(), default, unit.clone(), help.clone()));
    }
    Ok(params)
}

/// The program, found, and the words that follow it.
#[expect(clippy::type_complexity, reason = "two parts of one command, used once")]
fn check_command(
    command: &Spanned<Vec<Spanned<String>>>,
    folder: &Path,
) -> Result<(PathBuf, Vec<(Word, Range<usize>)>), Misfit> {
    let mut words = command.get_ref().iter();
    let Some(program) = words.next().filter(|program| !program.get_ref().is_empty()) else {
        return Err((command.span(), PluginFault::EmptyCommand));
    };
    let span = program.span();
    let name = Word::parse(program.get_ref()).map_err(|fault| (span.clone(), fault))?;
    let Some(name) = name.plain() else {
        return Err((span, PluginFault::ProgramPlaceholder(program.get_ref().clone())));
    };
    let found = find_program(&name, folder).map_err(|fault| (span, fault))?;
    let mut arguments = Vec::new();
    for word in words {
        let parsed = Word::parse(word.get_ref()).map_err(|fault| (word.span(), fault))?;
        arguments.push((parsed, word.span()));
    }
    Ok((found, arguments))
}

/// A program by a path, which starts at the folder, or by its name in `PATH`.
fn find_program(name: &str, folder: &Path) -> Result<PathBuf, PluginFault> {
    let program = name.to_owned();
    if name.contains(['/', std::path::MAIN_SEPARATOR]) {
        let path = folder.join(name);
        if is_program(&path) {
            return Ok(path);
        }
        let searched = format!("at {}, or it may not be executed", path.display());
        return Err(PluginFault::NoProgram { program, searched });
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let names = [name.to_owned(), format!("{name}{}", std::env::consts::EXE_SUFFIX)];
    // A relative folder would depend on where the command runs.
    std::env::split_paths(&path)
        .filter(|folder| folder.is_absolute())
        .flat_map(|folder| names.iter().map(move |name| folder.join(name)))
        .find(|path| is_program(path))
        .ok_or_else(|| PluginFault::NoProgram { program, searched: "in PATH".to_owned() })
}

fn is_program(path: &Path) -> bool {
    let Ok(metadata) = std::fs::metadata(path) else { return false };
    #[cfg(unix)]
    let allowed = std::os::unix::fs::PermissionsExt::mode(&metadata.permissions()) & 0o111 != 0;
    #[cfg(not(unix))]
    let allowed = true;
    metadata.is_file() && allowed
}

/// What the runner fills in, beside the parameters.
pub(super) const PLACEHOLDERS: [&str; 7] =
    ["surface", "initial", "output", "spheres", "native", "seed", "threads"];

/// A word of a command: text and placeholders in turn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Word(Vec<Piece>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Text(String),
    Placeholder(String),
}

impl Word {
    /// Reads a word: `{name}` is a placeholder, `{{` and `}}` are the braces themselves.
    pub fn parse(word: &str) -> Result<Self, PluginFault> {
        let (mut pieces, mut text, mut rest) = (Vec::new(), String::new(), word);
        while let Some(at) = rest.find(['{', '}']) {
            text.push_str(&rest[..at]);
            let (brace, after) = rest[at..].split_at(1);
            if let Some(after) = after.strip_prefix(brace) {
                text.push_str(brace);
                rest = after;
                continue;
            }
            let (name, after) =
                after.split_once('}').ok_or_else(|| PluginFault::Brace(word.to_owned()))?;
            if brace == "}" || name.contains('{') {
                return Err(PluginFault::Brace(word.to_owned()));
            }
            pieces.push(Piece::Text(std::mem::take(&mut text)));
            pieces.push(Piece::Placeholder(name.to_owned()));
            rest = after;
        }
        text.push_str(rest);
        pieces.push(Piece::Text(text));
        pieces.retain(|piece| *piece != Piece::Text(String::new()));
        Ok(Self(pieces))
    }

    /// Names of the placeholders.
    pub fn placeholders(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter_map(|piece| match piece {
            Piece::Placeholder(name) => Some(name.as_str()),
            Piece::Text(_) => None,
        })
    }

    /// The word where it has no placeholder.
    pub fn plain(&self) -> Option<String> {
        self.placeholders().next().is_none().then(|| self.fill(|_| String::new()))
    }

    /// The word with every placeholder replaced.
    pub fn fill(&self, value: impl Fn(&str) -> String) -> String {
        (self.0.iter())
            .map(|piece| match piece {
                Piece::Text(text) => text.clone(),
                Piece::Placeholder(name) => value(name),
            })
            .collect()
    }
}

/// Why a file of plug-ins is refused: the file, the line, and what to do.
#[derive(Debug, thiserror::Error)]
pub struct PluginError {
    /// The file, as it was given.
    pub file: PathBuf,
    /// Line number from 1, where the reason belongs to a line.
    pub line: Option<usize>,
    /// The reason.
    pub fault: PluginFault,
}

impl fmt::Display for PluginError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.file.display();
        match self.line {
            Some(line) => write!(f, "{file}, line {line}: {}", self.fault),
            None => write!(f, "{file}: {}", self.fault),
        }
    }
}

/// What is wrong, without the place.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PluginFault {
    /// The operating system refused.
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// It is not TOML, or a key is missing or of the wrong type.
    #[error("{0}")]
    Toml(String),
    /// A key that a plug-in does not have.
    #[error("{0}; correct the key, or take it out")]
    UnknownKey(String),
    /// A file of Python classes, given to the command on its own.
    #[error(
        "Python classes run in the command of the Python package: `pip install medialaxis`, and use its `medial`; \
         or declare a program that runs them, in a TOML file"
    )]
    NoInterpreter,
    /// The interpreter could not load the file.
    #[error("{0}")]
    Script(String),
    /// The file has no class that is a method.
    #[error("no class is a method; put @medial_axis.simplifier before one")]
    NoClass,
    /// The file declares nothing.
    #[error("no method is declared; add a table [[method]]")]
    NoMethod,
    /// An id that would not do on the command line.
    #[error("the id {0:?} is not made of lower-case letters, digits and hyphens; choose another")]
    Id(String),
    /// Two methods of the file have one id.
    #[error("a method above is called `{0}` too; give one of them another id")]
    DuplicateId(String),
    /// A method of the program, or of another file, has the id.
    #[error("there is a method called `{0}` already; choose another id")]
    TakenId(String),
    /// `command = []`.
    #[error("the command is empty; write the program and its arguments, each a word of its own")]
    EmptyCommand,
    /// The program of the command does not exist.
    #[error("there is no program {program:?} {searched}; install it, or correct the command")]
    NoProgram {
        /// As it stands in the command.
        program: String,
        /// Where it was searched.
        searched: String,
    },
    /// The program itself has a placeholder.
    #[error("the program {0:?} has a placeholder; name it as it is")]
    ProgramPlaceholder(String),
    /// The program would not know where to write.
    #[error(
        "no argument has {{output}}; pass the program the name of the file that it has to write"
    )]
    NoOutput,
    /// A `{` without its `}`, or a `}` without its `{`.
    #[error("a brace in {0:?} has no partner; write {{{{ or }}}} for the brace itself")]
    Brace(String),
    /// A placeholder that is neither built in nor a parameter.
    #[error(
        "{{{name}}} is neither a parameter of `params` nor one of {known}; declare it, or write \
         {{{{{name}}}}} for the text itself"
    )]
    UnknownPlaceholder {
        /// Its name.
        name: String,
        /// The built-in ones.
        known: String,
    },
    /// A parameter that no argument passes on.
    #[error("no argument has {{{0}}}; pass the parameter to the program, or take it out")]
    UnusedParam(String),
    /// Two parameters have one name.
    #[error("a parameter above is called `{0}` too; give one of them another name")]
    DuplicateParam(String),
    /// A parameter with the name of a built-in placeholder.
    #[error("`{0}` is the name of a placeholder; give the parameter another name")]
    ReservedParam(String),
    /// A default that is not a single value.
    #[error("the default of `{0}` is not a text, a number, or true or false")]
    Default(String),
    /// `levels = []`.
    #[error("no level is declared; write levels = [\"spheres\"], \"native\" or \"published\"")]
    NoLevels,
    /// `levels` has `native`, but what it is was not said.
    #[error("levels has \"native\"; say what it is: native = {{ name, unit, larger_is_coarser }}")]
    NoNative,
    /// A level that the program is not told of.
    #[error("levels has \"{0}\", but no argument has {{{0}}}; pass the level to the program")]
    LevelNotPassed(&'static str),
    /// A placeholder of a level that is never asked.
    #[error(
        "an argument has {{{0}}}, but levels has no \"{0}\"; declare the level, or take it out"
    )]
    LevelNotDeclared(&'static str),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_text_and_placeholders() {
        let cases =
            [("-k={k}:{seed}", "-k=K:SEED"), ("", ""), ("a}}{{b", "a}{b"), ("{{{x}}}", "{X}")];
        for (text, filled) in cases {
            let word = Word::parse(text).expect("braces in pairs");
            assert_eq!(word.fill(str::to_uppercase), filled);
        }
        for text in ["{", "}", "{a", "a}", "{a{b}}", "{}}"] {
            assert!(matches!(Word::parse(text), Err(PluginFault::Brace(_))), "{text}");
        }
    }
}
