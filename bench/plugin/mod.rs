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
//! [`load`] reads such a file; each method is an [`External`]. `docs/plugins.md` describes the inputs,
//! the outputs and the exit codes of a program.
//!
//! | file | step |
//! |---|---|
//! | `declaration` | the file, read and checked |
//! | `external` | the method: parameters, files for the program, its command, and its result |
//! | `program` | one run of it, to its end |
//!
//! Where the command runs inside an interpreter, classes can stand in for programs: [`load_script`].

use std::path::Path;

use medial::simplifier::Registered;
use medial::{read_regular, read_regular_text};
use medial_run::hash::hex_digest;

mod declaration;
mod external;
mod program;

pub use declaration::PluginError;
pub(crate) use declaration::{is_id, line_of};
pub(crate) use external::last_line;
pub use external::{External, SCRATCH};
pub(crate) use program::Drain;

/// Reads and checks a file of plug-ins: its methods, in its order.
///
/// # Errors
/// When the file cannot be read or is wrong, with the line and advice, or when an id is among `taken`,
/// the ids of the known methods.
pub fn load(path: &Path, taken: &[&str]) -> Result<Vec<External>, PluginError> {
    let text = read_regular_text(path);
    let text = text.map_err(|why| refused(path, format!("cannot be read: {why}")))?;
    parse(path, &text, taken)
}

/// [`load`] of a text; `path` is where its relative paths start.
///
/// # Errors
/// As [`load`].
pub fn parse(path: &Path, text: &str, taken: &[&str]) -> Result<Vec<External>, PluginError> {
    // Absolute, since programs run in this folder, whatever folder we are in by then.
    let absolute = std::path::absolute(path).map_err(|error| refused(path, error))?;
    let folder = absolute.parent().unwrap_or(Path::new("/"));
    let declarations = declaration::read(text, folder, taken).map_err(|(span, message)| {
        PluginError { line: span.map(|span| line_of(text, &span)), ..refused(path, message) }
    });
    let methods = declarations?.into_iter().map(External::new);
    methods.collect::<Result<_, _>>().map_err(|error| refused(path, error))
}

/// The refusal of a whole file.
fn refused(path: &Path, why: impl ToString) -> PluginError {
    PluginError { file: path.to_owned(), line: None, message: why.to_string() }
}

/// Loads methods from files in the language of the host, as the Python package does with classes. The command alone
/// has no loader. These methods run inside the worker process.
pub trait ScriptLoader: Send + Sync {
    /// The methods of a file, in its order.
    ///
    /// # Errors
    /// When the file cannot be loaded, with the reason.
    fn load(&self, path: &Path) -> Result<Vec<Registered>, String>;
}

/// The methods of a file of classes, and the SHA-256 of that file: an edited class is a new version.
///
/// # Errors
/// When there is no loader or it refuses the file, and when an id is invalid or among `taken`.
pub fn load_script(
    path: &Path,
    loader: Option<&dyn ScriptLoader>,
    taken: &[&str],
) -> Result<(Vec<Registered>, String), PluginError> {
    let loader = loader.ok_or_else(|| {
        let why = "Python classes need the command of the Python package; run `pip install ./python` in the \
                   sources and use its `medial`, or declare a program in a TOML file";
        refused(path, why)
    })?;
    let bytes = read_regular(path);
    let bytes = bytes.map_err(|error| refused(path, error))?;
    let methods = loader.load(path).map_err(|why| refused(path, why))?;
    if methods.is_empty() {
        let why = "no method found; put @medial_axis.simplifier before a class";
        return Err(refused(path, why));
    }
    // Classes of one file must differ from each other, too.
    let mut ids: Vec<&str> = taken.to_vec();
    for method in &methods {
        let id = &*method.method.info().id;
        if !is_id(id) {
            return Err(refused(path, declaration::wrong_id(id)));
        }
        if ids.contains(&id) {
            return Err(refused(path, declaration::taken_id(id)));
        }
        ids.push(id);
    }
    Ok((methods, hex_digest(&bytes)))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use medial::simplifier::{MethodInfo, SimplifyError, simple};

    use super::*;

    /// A loader whose files hold methods of these ids.
    struct Ids(&'static [&'static str]);

    impl ScriptLoader for Ids {
        fn load(&self, _: &Path) -> Result<Vec<Registered>, String> {
            let method = |id: &&'static str| {
                let info = MethodInfo::new(*id, "A class");
                simple(info, |_, _| Err(SimplifyError::unsupported("never run here"))).into()
            };
            match self.0 {
                ["?"] => Err("SyntaxError: line 1".to_owned()),
                ids => Ok(ids.iter().map(method).collect()),
            }
        }
    }

    #[test]
    fn classes_need_a_loader_and_unique_ids() {
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("mine.py");
        fs::write(&file, "class A: ...").expect("a file");
        let refused = |loader: Option<&dyn ScriptLoader>| {
            load_script(&file, loader, &["qmat"]).err().expect("a refusal").to_string()
        };
        assert!(refused(None).contains("pip install ./python"));
        assert!(refused(Some(&Ids(&["?"]))).ends_with("mine.py: SyntaxError: line 1"));
        assert!(refused(Some(&Ids(&[]))).contains("@medial_axis.simplifier"));
        assert!(refused(Some(&Ids(&["Mine"]))).contains("lower-case"));
        assert!(refused(Some(&Ids(&["qmat"]))).contains("id `qmat` is taken"));
        assert!(refused(Some(&Ids(&["mine", "mine"]))).contains("id `mine` is taken"));
    }

    #[test]
    fn an_edited_class_is_another_method() {
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("mine.py");
        let fingerprints = ["a", "a", "b"].map(|text| {
            fs::write(&file, text).expect("a file");
            load_script(&file, Some(&Ids(&["mine"])), &[]).expect("a method").1
        });
        assert_eq!(fingerprints[0], fingerprints[1]);
        assert_ne!(fingerprints[0], fingerprints[2]);
    }
}
