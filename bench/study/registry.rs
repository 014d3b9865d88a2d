//! The known methods: built-in methods and plug-ins.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use medial::simplifier::{MedialSimplifier, Presentation, Registered};
use medial_methods::initial;
use medial_run::hash::hex_digest;
use serde::{Serialize, Serializer};

use crate::plugin::{self, PluginError, ScriptLoader};

/// Id of the pseudo-method that returns the initial medial mesh.
pub const INITIAL: &str = "initial";

/// Id of the method of `simplify` for a sphere count or an error bound.
pub const DEFAULT: &str = "tight";

/// Raised when a change of the runner changes records.
const RUNNER: u32 = 1;

/// Methods by id, in the order of the tables.
pub struct Registry {
    /// All methods, without the initial medial mesh and external results.
    pub entries: Vec<Entry>,
    /// Entries that can be run but are not methods: the initial medial mesh and external results.
    others: [Entry; 2],
    /// The plug-in files that were added, as absolute paths.
    pub files: Vec<PathBuf>,
    /// Loader of plug-in files in the host's language.
    pub loader: Option<Box<dyn ScriptLoader>>,
    /// Remarks on plug-ins, for the user.
    pub remarks: Vec<String>,
}

/// A method, its presentation, and for a plug-in a hash of its files. As JSON the first two, in one object.
#[derive(Serialize)]
pub struct Entry {
    #[serde(flatten, serialize_with = "described")]
    method: Arc<dyn MedialSimplifier>,
    /// How it is presented.
    #[serde(flatten)]
    pub presentation: Presentation,
    /// Hash of the declaration and the files of a plug-in; `None` for a method of the program, which
    /// the program's own hash covers.
    #[serde(skip)]
    pub fingerprint: Option<String>,
    /// See [`Registered::version`].
    #[serde(skip)]
    version: Option<String>,
}

fn described<S: Serializer>(method: &Arc<dyn MedialSimplifier>, to: S) -> Result<S::Ok, S::Error> {
    method.info().serialize(to)
}

impl Entry {
    /// The method.
    pub fn method(&self) -> &dyn MedialSimplifier {
        self.method.as_ref()
    }

    fn new(registered: Registered, fingerprint: Option<String>) -> Self {
        let Registered { method, presentation, version } = registered;
        let version = version.map(|version| version.into_owned());
        Self { method: method.into(), presentation, fingerprint, version }
    }

    /// A hash that changes whenever the results of the method may. `binary` is the hash of the running
    /// program, which replaces the version of a built-in method without one.
    pub fn version(&self, binary: &str) -> String {
        let own = match (&self.version, &self.fingerprint) {
            (Some(version), None) => version.clone(),
            // The program writes the input of a plug-in and measures its output.
            (version, Some(fingerprint)) => {
                let library = [medial::SOURCE_HASH, medial::geometry::SOURCE_HASH];
                format!("{fingerprint} {} {}", library.join(" "), version.as_deref().unwrap_or(""))
            }
            (None, None) => binary.to_owned(),
        };
        hex_digest(format!("{RUNNER} {own}").as_bytes())
    }

    /// Its id.
    pub fn id(&self) -> &str {
        &self.method.info().id
    }
}

impl Registry {
    /// The methods of a program.
    ///
    /// # Errors
    /// When two methods have the same id.
    pub fn new(methods: Vec<Registered>) -> Result<Self, String> {
        let mut initial = Entry::new(initial::method().into(), None);
        initial.version = medial_methods::version(INITIAL);
        let given = Entry::new(crate::study::external::method().into(), None);
        let (entries, others) = (Vec::new(), [initial, given]);
        let (files, remarks) = (Vec::new(), Vec::new());
        let mut registry = Self { entries, others, files, loader: None, remarks };
        for registered in methods {
            let id = &registered.method.info().id;
            if registry.entry(id).is_some() {
                return Err(format!("two methods have the id `{id}`; change one of them"));
            }
            registry.entries.push(Entry::new(registered, None));
        }
        Ok(registry)
    }

    /// Adds the methods of a plug-in file.
    ///
    /// # Errors
    /// When the file is wrong, or an id is taken.
    pub fn add_plugins(&mut self, file: &Path) -> Result<(), PluginError> {
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        // A study file and the command line may both name it.
        if self.files.contains(&file) {
            return Ok(());
        }
        // Those of the pseudo-methods, too.
        let taken: Vec<&str> = self.entries.iter().chain(&self.others).map(Entry::id).collect();
        let new: Vec<Entry> = if file.extension().is_some_and(|end| end == "py") {
            let (methods, hash) = plugin::load_script(&file, self.loader.as_deref(), &taken)?;
            methods.into_iter().map(|method| Entry::new(method, Some(hash.clone()))).collect()
        } else {
            (plugin::load(&file, &taken)?.into_iter())
                .map(|external| {
                    self.remarks.extend(external.remark());
                    let fingerprint = Some(external.fingerprint.clone());
                    Entry::new(external.into(), fingerprint)
                })
                .collect()
        };
        self.entries.extend(new);
        self.files.push(file);
        Ok(())
    }

    /// The method with an id, [`INITIAL`] or [`GIVEN`](medial_run::item::GIVEN).
    pub fn entry(&self, id: &str) -> Option<&Entry> {
        self.entries.iter().chain(&self.others).find(|entry| entry.id() == id)
    }

    /// The message for an id that no method has.
    pub fn no_such(&self, id: &str) -> String {
        let known: Vec<String> = self.entries.iter().map(|entry| entry.id().to_owned()).collect();
        super::no_such_method(id, &known)
    }

    /// The methods that run by default: all but those on request.
    pub fn usual(&self) -> impl Iterator<Item = &Entry> {
        self.entries.iter().filter(|entry| !entry.presentation.on_request)
    }
}
