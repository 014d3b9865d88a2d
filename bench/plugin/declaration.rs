//! Plug-ins as they stand in a TOML file, read and checked.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use medial::simplifier::{Level, NativeLevel, ParamInfo};
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::error::{PluginError, PluginFault};
use super::template::{PLACEHOLDERS, Word};

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
    let line = |span: Range<usize>| {
        let before = text.as_bytes().get(..span.start).unwrap_or_default();
        Some(1 + before.iter().filter(|&&byte| byte == b'\n').count())
    };
    let refuse = |line, fault| PluginError { file: file.to_owned(), line, fault };
    let document: Document = toml::from_str(text).map_err(|error| {
        let message = error.message().to_owned();
        let fault = match message.starts_with("unknown ") {
            true => PluginFault::UnknownKey(message),
            false => PluginFault::Toml(message),
        };
        refuse(error.span().and_then(line), fault)
    })?;
    if document.method.is_empty() {
        return Err(refuse(None, PluginFault::NoMethod));
    }
    let mut ids = BTreeSet::new();
    let check = |written: Written| {
        let at = written.id.span();
        if taken.contains(&written.id.get_ref().as_str()) {
            return Err(refuse(line(at), PluginFault::TakenId(written.id.into_inner())));
        }
        if !ids.insert(written.id.get_ref().clone()) {
            let fault = PluginFault::DuplicateId(written.id.into_inner());
            return Err(refuse(line(at), fault));
        }
        written.check(folder).map_err(|(span, fault)| refuse(line(span), fault))
    };
    document.method.into_iter().map(check).collect()
}

/// Whether a text would do as an id on the command line.
pub(super) fn is_id(text: &str) -> bool {
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    !text.is_empty() && text.chars().all(allowed)
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
        let is_param = |name: &str| self.params.iter().any(|param| param.get_ref().name == name);
        for (word, span) in arguments {
            let mut names = word.placeholders();
            if let Some(name) = names.find(|name| !PLACEHOLDERS.contains(name) && !is_param(name)) {
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
        let refuse = |fault: fn(String) -> PluginFault| Err((spanned.span(), fault(name.clone())));
        if PLACEHOLDERS.contains(&name.as_str()) {
            return refuse(PluginFault::ReservedParam);
        }
        if params.iter().any(|other| other.name == *name) {
            return refuse(PluginFault::DuplicateParam);
        }
        let default = match default {
            toml::Value::String(text) => text.clone(),
            toml::Value::Integer(number) => number.to_string(),
            toml::Value::Float(number) => format!("{number:?}"),
            toml::Value::Boolean(flag) => flag.to_string(),
            _ => return refuse(PluginFault::Default),
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
    let parse = |word: &Spanned<String>| match Word::parse(word.get_ref()) {
        Ok(parsed) => Ok((parsed, word.span())),
        Err(fault) => Err((word.span(), fault)),
    };
    let mut words = command.get_ref().iter();
    let program = words.next().filter(|program| !program.get_ref().is_empty());
    let Some(program) = program else {
        return Err((command.span(), PluginFault::EmptyCommand));
    };
    let (name, span) = parse(program)?;
    let Some(name) = name.plain() else {
        return Err((span, PluginFault::ProgramPlaceholder(program.get_ref().clone())));
    };
    let found = find_program(&name, folder).map_err(|fault| (span, fault))?;
    Ok((found, words.map(parse).collect::<Result<_, _>>()?))
}

/// A program by a path, which starts at the folder, or by its name in `PATH`.
fn find_program(name: &str, folder: &Path) -> Result<PathBuf, PluginFault> {
    let refuse = |searched: String| PluginFault::NoProgram { program: name.to_owned(), searched };
    if name.contains(['/', std::path::MAIN_SEPARATOR]) {
        let path = folder.join(name);
        let searched = || format!("at {}, or it may not be executed", path.display());
        return if is_program(&path) { Ok(path) } else { Err(refuse(searched())) };
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let names = [name.to_owned(), format!("{name}{}", std::env::consts::EXE_SUFFIX)];
    let found = std::env::split_paths(&path)
        .filter(|folder| folder.is_absolute())
        .flat_map(|folder| names.iter().map(move |name| folder.join(name)))
        .find(|path| is_program(path));
    found.ok_or_else(|| refuse("in PATH".to_owned()))
}

fn is_program(path: &Path) -> bool {
    let Ok(metadata) = std::fs::metadata(path) else { return false };
    #[cfg(unix)]
    let allowed = std::os::unix::fs::PermissionsExt::mode(&metadata.permissions()) & 0o111 != 0;
    #[cfg(not(unix))]
    let allowed = true;
    metadata.is_file() && allowed
}
