//! Why a file of plug-ins is refused.

use std::fmt;
use std::path::PathBuf;

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
