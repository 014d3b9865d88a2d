//! Plug-in declarations in a TOML file, read and checked: the declaration, the words of its command, and the reasons
//! for which a file is refused.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use medial::simplifier::{Capability, Level, MethodInfo, NativeLevel, ParamInfo};
use medial::{parser_message, quoted};
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
    native: Option<NativeLevel>,
    #[serde(default)]
    params: Vec<Spanned<WrittenParam>>,
    #[serde(default)]
    fit: OutputUnits,
    #[serde(default)]
    files: Vec<Spanned<String>>,
}

/// The units of an output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum OutputUnits {
    /// The units of the surface.
    #[default]
    None,
    /// Fitted by scale and shift where the output does not fit unscaled.
    Auto,
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

/// A kind of level that a plug-in supports.
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

    /// The name in the file, which is also the placeholder.
    pub fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }

    /// The name in messages, and the options that request a level of this kind.
    pub fn words(self) -> [&'static str; 2] {
        match self {
            Self::Spheres => ["sphere counts", "--spheres N"],
            Self::Native => ["native level", "--level X"],
            Self::Published => ["published level", "no level"],
        }
    }
}

/// A plug-in that was checked.
#[derive(Debug)]
pub(super) struct Declaration {
    pub info: MethodInfo,
    pub levels: Vec<LevelKind>,
    pub fit: OutputUnits,
    /// The command as in the file, for the fingerprint.
    pub written: Vec<String>,
    /// The program: an absolute path, or a name that was found in `PATH`.
    pub program: PathBuf,
    pub arguments: Vec<Word>,
    /// The working folder of the program and of relative paths.
    pub folder: PathBuf,
    /// Files that the program reads, besides the words of its command.
    pub files: Vec<PathBuf>,
}

/// The reason for which a plug-in file is refused.
#[derive(Debug, thiserror::Error)]
#[error(
    "{}{}: {message}",
    file.display(),
    line.map_or_else(String::new, |line| format!(", line {line}"))
)]
pub struct PluginError {
    /// The file, as it was given.
    pub file: PathBuf,
    /// Line number from 1, where the reason belongs to a line.
    pub line: Option<usize>,
    /// Problem and advice.
    pub message: String,
}

/// The wrong bytes of the file, and the reason.
pub(super) type Fault = (Option<Range<usize>>, String);

fn fault<T>(span: Range<usize>, message: impl Into<String>) -> Result<T, Fault> {
    Err((Some(span), message.into()))
}

/// Refuses a part of the file unless a condition holds.
fn ensure(holds: bool, at: Range<usize>, message: impl Into<String>) -> Result<(), Fault> {
    if holds { Ok(()) } else { fault(at, message) }
}

/// Number of the line where a part of a text begins, from 1.
pub(crate) fn line_of(text: &str, span: &Range<usize>) -> usize {
    let before = text.as_bytes().get(..span.start).unwrap_or_default();
    1 + before.iter().filter(|&&byte| byte == b'\n').count()
}

/// Reads and checks all plug-ins of a file. `folder` is where its relative paths start, `taken` the
/// ids of other methods.
pub(super) fn read(text: &str, folder: &Path, taken: &[&str]) -> Result<Vec<Declaration>, Fault> {
    // The parser names the unknown key or the missing field, and its place.
    let document: Document =
        toml::from_str(text).map_err(|error| (error.span(), parser_message(error.message())))?;
    if document.method.is_empty() {
        return Err((None, "no method is declared; add a table [[method]]".to_owned()));
    }
    let mut ids = BTreeSet::new();
    let mut declarations = Vec::new();
    for written in document.method {
        let (id, at) = (written.id.get_ref().clone(), written.id.span());
        // A plug-in under the id of a published method would replace it in every table.
        ensure(!taken.contains(&id.as_str()), at.clone(), taken_id(&id))?;
        let twice = format!("a method above has the id `{id}` too; change one of them");
        ensure(ids.insert(id), at, twice)?;
        declarations.push(written.check(folder)?);
    }
    Ok(declarations)
}

pub(super) fn taken_id(id: &str) -> String {
    format!("the id `{id}` is taken; choose another")
}

pub(super) fn wrong_id(id: &str) -> String {
    format!(
        "invalid id (found {}, expected lower-case letters, digits and inner hyphens)",
        quoted(id)
    )
}

/// Whether a text is a valid id on the command line.
pub(crate) fn is_id(text: &str) -> bool {
    !text.is_empty()
        // The command line would take it for an option.
        && !text.starts_with('-')
        && text.bytes().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'-')
}

impl Written {
    fn check(self, folder: &Path) -> Result<Declaration, Fault> {
        let id = self.id.get_ref();
        ensure(is_id(id), self.id.span(), wrong_id(id))?;
        let params = check_params(&self.params)?;
        let mut words = self.command.get_ref().iter();
        let Some(program) = words.next().filter(|program| !program.get_ref().is_empty()) else {
            let message =
                "the command is empty; write the program and its arguments as separate words";
            return fault(self.command.span(), message);
        };
        let Some(name) = parse(program)?.plain() else {
            let message =
                format!("the program {:?} has a placeholder; write its name", program.get_ref());
            return fault(program.span(), message);
        };
        let program = find_program(&name, folder).or_else(|why| fault(program.span(), why))?;
        let mut arguments = Vec::new();
        for word in words {
            let parsed = parse(word)?;
            let is_known = |name: &str| {
                PLACEHOLDERS.contains(&name) || params.iter().any(|param| param.name == name)
            };
            if let Some(name) = parsed.placeholders().find(|name| !is_known(name)) {
                let known = PLACEHOLDERS.map(|name| format!("{{{name}}}")).join(", ");
                let message = format!(
                    "{{{name}}} is neither a parameter of `params` nor one of {known}; declare it, or write \
                     {{{{{name}}}}} for the text itself"
                );
                return fault(word.span(), message);
            }
            arguments.push(parsed);
        }
        self.check_passed(&arguments)?;
        for file in &self.files {
            let path = folder.join(file.get_ref());
            let message = format!("{}: not a regular file; correct `files`", path.display());
            ensure(path.is_file(), file.span(), message)?;
        }
        let levels = self.levels.into_inner();
        let written = self.command.into_inner().into_iter().map(Spanned::into_inner);
        let written: Vec<String> = written.collect();
        let mut info = MethodInfo::new(self.id.into_inner(), self.title)
            .citation(self.citation)
            .summary(format!("An external program: {}.", written.join(" ")))
            .params(params)
            .extra(Capability::new("own_seconds", "seconds that the program measured by itself"))
            .extra(Capability::new("program_peak", "most resident bytes of the program"));
        info.native = self.native;
        info.seeded = written.iter().any(|word| word.contains("{seed}"));
        if levels.contains(&LevelKind::Published) {
            info = info.published("what the program does without a level");
        }
        Ok(Declaration {
            info,
            levels,
            fit: self.fit,
            written,
            program,
            arguments,
            folder: folder.to_owned(),
            files: self.files.iter().map(|file| folder.join(file.get_ref())).collect(),
        })
    }

    /// The program gets the file to write, every parameter, and exactly the levels that are declared.
    fn check_passed(&self, arguments: &[Word]) -> Result<(), Fault> {
        let passes =
            |name: &str| arguments.iter().any(|word| word.placeholders().any(|p| p == name));
        let message = "no argument has {output}; pass the program the name of its output file";
        ensure(passes("output"), self.command.span(), message)?;
        for param in &self.params {
            let name = &param.get_ref().name;
            let message = format!(
                "no argument has {{{name}}}; pass the parameter to the program, or remove it"
            );
            ensure(passes(name), param.span(), message)?;
        }
        let (levels, at) = (self.levels.get_ref(), self.levels.span());
        let message =
            r#"no level is declared; write levels = ["spheres"], "native" or "published""#;
        ensure(!levels.is_empty(), at.clone(), message)?;
        let is_described = self.native.is_some() || !levels.contains(&LevelKind::Native);
        let message =
            r#"levels has "native"; describe it: native = { name, unit, larger_is_coarser }"#;
        ensure(is_described, at.clone(), message)?;
        for kind in [LevelKind::Spheres, LevelKind::Native] {
            let name = kind.name();
            let (is_declared, is_passed) = (levels.contains(&kind), passes(&name));
            let message = format!(
                "levels has {name:?}, but no argument has {{{name}}}; pass the level to the program"
            );
            ensure(is_passed || !is_declared, at.clone(), message)?;
            let message = format!(
                "an argument has {{{name}}}, but levels has no {name:?}; declare or remove it"
            );
            ensure(is_declared || !is_passed, self.command.span(), message)?;
        }
        Ok(())
    }
}

fn check_params(written: &[Spanned<WrittenParam>]) -> Result<Vec<ParamInfo>, Fault> {
    let mut params: Vec<ParamInfo> = Vec::new();
    for spanned in written {
        let WrittenParam { name, default, unit, help } = spanned.get_ref();
        let wrong = |why: &str| fault(spanned.span(), format!("`{name}` {why}"));
        if PLACEHOLDERS.contains(&name.as_str()) {
            return wrong("is the name of a placeholder; rename the parameter");
        }
        if params.iter().any(|other| other.name == *name) {
            return wrong("is the name of a parameter above, too; rename one of them");
        }
        // Numbers keep the digits of the file: the program gets them as text.
        let default = match default {
            toml::Value::String(text) => text.clone(),
            toml::Value::Integer(number) => number.to_string(),
            toml::Value::Float(number) => format!("{number:?}"),
            toml::Value::Boolean(flag) => flag.to_string(),
            _ => return wrong("has a wrong default (expected a text, a number, true or false)"),
        };
        params.push(ParamInfo::new(name.clone(), default, unit.clone(), help.clone()));
    }
    Ok(params)
}

fn parse(word: &Spanned<String>) -> Result<Word, Fault> {
    Word::parse(word.get_ref()).or_else(|why| fault(word.span(), why))
}

/// A program by a path, which starts at the folder, or by its name in `PATH`.
fn find_program(name: &str, folder: &Path) -> Result<PathBuf, String> {
    let absent = |searched: &str| {
        format!("no program {name:?} {searched}; install it, or correct the command")
    };
    if name.contains(['/', std::path::MAIN_SEPARATOR]) {
        let path = folder.join(name);
        if is_program(&path) {
            return Ok(path);
        }
        return Err(absent(&format!("that can be executed at {}", path.display())));
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    // There is no shell that appends `.exe`.
    let names = [name.to_owned(), format!("{name}{}", std::env::consts::EXE_SUFFIX)];
    // A relative folder would depend on where the command runs.
    std::env::split_paths(&path)
        .filter(|folder| folder.is_absolute())
        .flat_map(|folder| names.iter().map(move |name| folder.join(name)))
        .find(|path| is_program(path))
        .ok_or_else(|| absent("in PATH"))
}

fn is_program(path: &Path) -> bool {
    let Ok(metadata) = std::fs::metadata(path) else { return false };
    #[cfg(unix)]
    let allowed = std::os::unix::fs::PermissionsExt::mode(&metadata.permissions()) & 0o111 != 0;
    #[cfg(not(unix))]
    let allowed = true;
    metadata.is_file() && allowed
}

/// Placeholders that the runner fills in, in addition to the parameters.
pub(super) const PLACEHOLDERS: [&str; 7] =
    ["surface", "initial", "output", "spheres", "native", "seed", "threads"];

/// A word of a command: text and placeholders in turn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Word(Vec<WordPart>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum WordPart {
    Text(String),
    Placeholder(String),
}

impl Word {
    /// Reads a word: `{name}` is a placeholder, `{{` and `}}` are the braces themselves.
    pub fn parse(word: &str) -> Result<Self, String> {
        let single = || {
            format!("a brace in {word:?} has no partner; write {{{{ or }}}} for a literal brace")
        };
        let (mut pieces, mut text, mut rest) = (Vec::new(), String::new(), word);
        while let Some(at) = rest.find(['{', '}']) {
            text.push_str(&rest[..at]);
            let (brace, after) = rest[at..].split_at(1);
            if let Some(after) = after.strip_prefix(brace) {
                text.push_str(brace);
                rest = after;
                continue;
            }
            let (name, after) = after.split_once('}').ok_or_else(single)?;
            if brace == "}" || name.contains('{') {
                return Err(single());
            }
            pieces.push(WordPart::Text(std::mem::take(&mut text)));
            pieces.push(WordPart::Placeholder(name.to_owned()));
            rest = after;
        }
        text.push_str(rest);
        pieces.push(WordPart::Text(text));
        // So that equal words compare as equal, independent of their braces.
        pieces.retain(|piece| *piece != WordPart::Text(String::new()));
        Ok(Self(pieces))
    }

    /// Names of the placeholders.
    pub fn placeholders(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter_map(|piece| match piece {
            WordPart::Placeholder(name) => Some(name.as_str()),
            WordPart::Text(_) => None,
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
                WordPart::Text(text) => text.clone(),
                WordPart::Placeholder(name) => value(name),
            })
            .collect()
    }
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
            assert!(Word::parse(text).is_err_and(|why| why.contains("a brace in")), "{text}");
        }
    }
}
