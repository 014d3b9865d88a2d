//! Plug-ins: programs in any language as methods, declared in a TOML file.
//!
//! ```toml
//! [[method]]
//! id = "largest"
//! title = "Largest balls first"
//! citation = "Who, when, where, DOI"
//! command = ["python3", "largest.py", "{initial}", "{output}", "--spheres", "{spheres}"]
//! levels = ["spheres"]
//! ```
//!
//! [`load`] reads such a file; each method is an [`External`]. What a program is given, what it has
//! to give back and what its exit code means stands in `docs/plugins.md`.
//!
//! | file | step |
//! |---|---|
//! | `declaration`, `template`, `error` | the file, read and checked |
//! | `external` | the method: parameters, files for the program, its command |
//! | `program` | one run of it, to its end |
//! | `answer`, `report` | what its end, its output and its last words mean |
//! | `script` | classes instead of programs, where the command runs inside an interpreter |

use std::fs;
use std::path::Path;

mod answer;
mod declaration;
mod error;
mod external;
mod program;
mod report;
mod script;
mod template;

pub use answer::ProgramPeak;
pub use error::{PluginError, PluginFault};
pub use external::{External, SCRATCH};
pub use report::OwnSeconds;
pub use script::{ScriptLoader, ScriptMethod, is_script, load_script};

/// Reads and checks a file of plug-ins: its methods, in its order.
///
/// # Errors
/// When the file cannot be read or is wrong: the error names the line and says what to do. An id that
/// is among `taken`, those of the methods that there are, is wrong too.
pub fn load(path: &Path, taken: &[&str]) -> Result<Vec<External>, PluginError> {
    let refuse =
        |error| PluginError { file: path.to_owned(), line: None, fault: PluginFault::Io(error) };
    parse(path, &fs::read_to_string(path).map_err(refuse)?, taken)
}

/// [`load`] of a text; `path` is where its relative paths start.
///
/// # Errors
/// As [`load`].
pub fn parse(path: &Path, text: &str, taken: &[&str]) -> Result<Vec<External>, PluginError> {
    let refuse =
        |error| PluginError { file: path.to_owned(), line: None, fault: PluginFault::Io(error) };
    // Absolute, since programs run in this folder, whatever folder we are in by then.
    let absolute = std::path::absolute(path).map_err(refuse)?;
    let folder = absolute.parent().unwrap_or(Path::new("/"));
    let declarations = declaration::read(path, text, folder, taken)?;
    declarations
        .into_iter()
        .map(|declared| External::new(declared, folder).map_err(refuse))
        .collect()
}
