//! Plug-ins that a host of the command loads: classes of its language, instead of programs.
//!
//! The command alone knows no such language. A program that it runs in, as the Python package does, hands it a
//! [`ScriptLoader`]; the methods of a file then run in the worker itself.

use std::fs;
use std::path::Path;

use medial::simplifier::Registered;
use sha2::{Digest, Sha256};

use super::declaration::is_id;
use super::external::hexadecimal;
use super::{PluginError, PluginFault};

/// Extension of files of Python classes.
const PYTHON: &str = "py";

/// What loads methods from files of a language.
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
    path.extension().is_some_and(|extension| extension == PYTHON)
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
    let refuse = |fault| PluginError { file: path.to_owned(), line: None, fault };
    let loader = loader.ok_or_else(|| refuse(PluginFault::NoInterpreter))?;
    let bytes = fs::read(path).map_err(|error| refuse(error.into()))?;
    let fingerprint = hexadecimal(&Sha256::digest(&bytes));
    let methods = loader.load(path).map_err(|why| refuse(PluginFault::Script(why)))?;
    if methods.is_empty() {
        return Err(refuse(PluginFault::NoClass));
    }
    let mut ids: Vec<&str> = taken.to_vec();
    for method in &methods {
        let id = &*method.method.info().id;
        if !is_id(id) {
            return Err(refuse(PluginFault::Id(id.to_owned())));
        }
        if ids.contains(&id) {
            return Err(refuse(PluginFault::TakenId(id.to_owned())));
        }
        ids.push(id);
    }
    let with_hash = |method| ScriptMethod { method, fingerprint: fingerprint.clone() };
    Ok(methods.into_iter().map(with_hash).collect())
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
