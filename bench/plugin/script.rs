//! Plug-ins that a host of the command loads: classes of its language, instead of programs.
//!
//! The command alone knows no such language. A program that it runs in, as the Python package does, hands it a
//! [`ScriptLoader`]; the methods of a file then run in the worker itself.

use std::fs;
use std::path::Path;

use medial::simplifier::MedialSimplifier;
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
    fn load(&self, path: &Path) -> Result<Vec<Box<dyn MedialSimplifier>>, String>;
}

/// Whether a plug-in file holds classes of Python rather than declarations of programs.
pub fn is_script(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == PYTHON)
}

/// The methods of a file of classes, each with the fingerprint of that file.
///
/// # Errors
/// When there is no loader or it refuses the file, and when an id is no id or among `taken`.
pub fn load_script(
    path: &Path,
    loader: Option<&dyn ScriptLoader>,
    taken: &[&str],
) -> Result<Vec<(Box<dyn MedialSimplifier>, String)>, PluginError> {
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
        let id = &*method.info().id;
        if !is_id(id) {
            return Err(refuse(PluginFault::Id(id.to_owned())));
        }
        if ids.contains(&id) {
            return Err(refuse(PluginFault::TakenId(id.to_owned())));
        }
        ids.push(id);
    }
    Ok(methods.into_iter().map(|method| (method, fingerprint.clone())).collect())
}
