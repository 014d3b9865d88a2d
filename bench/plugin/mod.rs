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
//! | `declaration` | the file, read and checked |
//! | `external` | the method: parameters, files for the program, its command, and its result |
//! | `program` | one run of it, to its end |
//!
//! Where the command runs inside an interpreter, classes can stand in for programs: [`load_script`].

use std::fs;
use std::path::Path;

use medial::simplifier::Registered;
use sha2::{Digest, Sha256};

use external::hexadecimal;

mod declaration;
mod external;
mod program;

pub(crate) use declaration::is_id;
pub use declaration::{PluginError, PluginFault};
pub use external::{External, OwnSeconds, ProgramPeak, SCRATCH};

/// Reads and checks a file of plug-ins: its methods, in its order.
///
/// # Errors
/// When the file cannot be read or is wrong: the error names the line and says what to do. An id that
/// is among `taken`, those of the methods that there are, is wrong too.
pub fn load(path: &Path, taken: &[&str]) -> Result<Vec<External>, PluginError> {
    let text = fs::read_to_string(path).map_err(|error| refused(path, error))?;
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
    let declarations = declaration::read(path, text, folder, taken)?;
    declarations
        .into_iter()
        .map(|declared| External::new(declared, folder).map_err(|error| refused(path, error)))
        .collect()
}

/// The refusal of a whole file.
fn refused(path: &Path, fault: impl Into<PluginFault>) -> PluginError {
    PluginError { file: path.to_owned(), line: None, fault: fault.into() }
}

/// A host of the command loads methods from files of its own language, as the Python package does with classes. The
/// command alone knows no such language. These methods run in the worker itself.
pub trait ScriptLoader: Send + Sync {
    /// The methods of a file, in its order.
    ///
    /// # Errors
    /// When the file cannot be loaded or has no method: why, in a sentence.
    fn load(&self, path: &Path) -> Result<Vec<Registered>, String>;
}

/// A method of a file of classes, and the SHA-256 of that file: an edited class is not taken for the old one.
pub struct ScriptMethod {
    /// The method.
    pub method: Registered,
    /// The hash.
    pub fingerprint: String,
}

/// Whether a plug-in file holds classes of Python rather than declarations of programs.
pub fn is_script(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "py")
}

/// The methods of a file of classes.
///
/// # Errors
/// When there is no loader or it refuses the file, and when an id is no id or among `taken`.
pub fn load_script(
    path: &Path,
    loader: Option<&dyn ScriptLoader>,
    taken: &[&str],
) -> Result<Vec<ScriptMethod>, PluginError> {
    let loader = loader.ok_or_else(|| refused(path, PluginFault::NoInterpreter))?;
    let bytes = fs::read(path).map_err(|error| refused(path, error))?;
    let fingerprint = hexadecimal(&Sha256::digest(&bytes));
    let methods = loader.load(path).map_err(|why| refused(path, PluginFault::Script(why)))?;
    if methods.is_empty() {
        return Err(refused(path, PluginFault::NoClass));
    }
    let mut ids: Vec<&str> = taken.to_vec();
    for method in &methods {
        let id = &*method.method.info().id;
        if !is_id(id) {
            return Err(refused(path, PluginFault::Id(id.to_owned())));
        }
        if ids.contains(&id) {
            return Err(refused(path, PluginFault::TakenId(id.to_owned())));
        }
        ids.push(id);
    }
    Ok((methods.into_iter())
        .map(|method| ScriptMethod { method, fingerprint: fingerprint.clone() })
        .collect())
}

#[cfg(test)]
mod tests {
    use medial::shape::Shape;
    use medial::simplifier::{
        Method, MethodInfo, NoParams, RunContext, Simplification, SimplifyError,
    };

    use super::*;

    /// A loader whose files hold methods of these ids.
    struct Ids(&'static [&'static str]);

    impl ScriptLoader for Ids {
        fn load(&self, _: &Path) -> Result<Vec<Registered>, String> {
            fn prepare<'s>(
                _: &'s Shape,
                _: NoParams,
                _: &RunContext,
            ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
                Err(SimplifyError::unsupported("never asked here"))
            }
            let method = |id: &&'static str| {
                Registered::from(Method::new(MethodInfo::new(*id, "A class"), prepare))
            };
            match self.0 {
                ["?"] => Err("SyntaxError: line 1".to_owned()),
                ids => Ok(ids.iter().map(method).collect()),
            }
        }
    }

    #[test]
    fn classes_need_a_loader_and_ids_of_their_own() {
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("mine.py");
        fs::write(&file, "class A: ...").expect("a file");
        let refused = |loader: Option<&dyn ScriptLoader>| {
            load_script(&file, loader, &["qmat"]).err().expect("a refusal").to_string()
        };
        assert!(refused(None).contains("pip install medialaxis"));
        assert!(refused(Some(&Ids(&["?"]))).ends_with("mine.py: SyntaxError: line 1"));
        assert!(refused(Some(&Ids(&[]))).contains("@medial_axis.simplifier"));
        assert!(refused(Some(&Ids(&["Mine"]))).contains("lower-case"));
        assert!(refused(Some(&Ids(&["qmat"]))).contains("called `qmat`"));
        assert!(refused(Some(&Ids(&["mine", "mine"]))).contains("called `mine`"));
    }

    #[test]
    fn an_edited_class_is_another_method() {
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("mine.py");
        let fingerprints = ["a", "a", "b"].map(|text| {
            fs::write(&file, text).expect("a file");
            let mut loaded = load_script(&file, Some(&Ids(&["mine"])), &[]).expect("a method");
            loaded.remove(0).fingerprint
        });
        assert_eq!(fingerprints[0], fingerprints[1]);
        assert_ne!(fingerprints[0], fingerprints[2]);
    }
}
