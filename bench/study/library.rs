//! Published meshes and the user's own, by name: fetched from packages, kept in a folder of caches, verified by their
//! hashes.
//!
//! | file | does |
//! |---|---|
//! | `library` | the folder: which mesh is there, which is missing, what a word of `--dataset` stands for |
//! | `add` | from a user's file into the folder |
//!
//! `scripts/fetch_meshes.py` fills the folder from packages. A file is known by the hash of its content alone.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

use etcetera::BaseStrategy;
use medial::{surface, write_atomically};
use medial_datasets::published::{Catalogue, Published, Set, is_name, published};
use serde::{Deserialize, Serialize};

use crate::provenance::hex_digest;
use crate::study::source::{Source, did_you_mean};

/// What is wrong with published meshes.
#[derive(Debug, thiserror::Error)]
pub enum PublicError {
    /// There is no folder for caches.
    #[error("there is no folder for caches here: set MEDIAL_CACHE to one")]
    NoFolder,
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The catalogue that `MEDIAL_CATALOGUE` names is none.
    #[error("{}: {message}", path.display())]
    Catalogue {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// Nothing has this name.
    #[error(
        "no set, package or mesh is called `{word}`{meant}; `medial datasets list` names them all"
    )]
    Unknown {
        /// What was asked.
        word: String,
        /// What may have been meant.
        meant: String,
    },
    /// Meshes are not in the folder.
    #[error("{word}: {} not here: {how}", absent(names))]
    Missing {
        /// What was asked.
        word: String,
        /// The meshes that are missing.
        names: Vec<String>,
        /// The command that gets them.
        how: String,
    },
    /// A file cannot be kept under this name.
    #[error("{name}: {why}")]
    Name {
        /// The name.
        name: String,
        /// What is wrong, and what to do.
        why: String,
    },
    /// A user's file is no surface.
    #[error(transparent)]
    Surface(#[from] medial::surface::SurfaceError),
}

/// The most names of a list that are told.
const MOST_NAMES: usize = 5;

fn absent(names: &[String]) -> String {
    let more = names.len().saturating_sub(MOST_NAMES);
    let told = names[..names.len() - more].join(", ");
    match (names.len(), more) {
        (1, _) => format!("{told} is"),
        (_, 0) => format!("{told} are"),
        (_, more) => format!("{told} and {more} more are"),
    }
}

/// An error of the file system with the path that it is about.
fn io_error(path: &Path) -> impl FnOnce(io::Error) -> PublicError {
    let path = path.to_owned();
    move |source| PublicError::Io { path, source }
}

/// Variable that names the folder.
const CACHE: &str = "MEDIAL_CACHE";
/// Variable that names another catalogue.
const CATALOGUE: &str = "MEDIAL_CATALOGUE";
/// The set of the user's own files.
const ADDED: &str = "added";

/// Published meshes and the user's own, and the folder in which they are kept.
#[derive(Clone, Debug)]
pub struct Library {
    folder: PathBuf,
    /// What is known of published meshes.
    pub catalogue: Cow<'static, Catalogue>,
}

/// Whether a mesh of the catalogue is in the folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// It is there, with the right content.
    Here,
    /// It is not there.
    Missing,
    /// Something else is there under its name.
    Another,
}

impl State {
    /// Its name in tables and JSON.
    pub fn key(self) -> &'static str {
        match self {
            Self::Here => "here",
            Self::Missing => "missing",
            Self::Another => "another file",
        }
    }
}

impl Library {
    /// The user's library: `MEDIAL_CACHE`, else `medial` in the system's folder of caches; the catalogue
    /// that `MEDIAL_CATALOGUE` names, else the one of this program. Nothing is made.
    ///
    /// # Errors
    /// When there is no such folder, or the catalogue named cannot be read.
    pub fn here() -> Result<Self, PublicError> {
        let [cache, catalogue] = [CACHE, CATALOGUE]
            .map(|name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from));
        let folder = match cache {
            Some(folder) => folder,
            None => etcetera::choose_base_strategy()
                .map(|folders| folders.cache_dir().join("medial"))
                .map_err(|_| PublicError::NoFolder)?,
        };
        // Workers and clients have working folders of their own.
        let folder = std::path::absolute(&folder).map_err(io_error(&folder))?;
        let catalogue = match catalogue {
            Some(path) => Cow::Owned(read_catalogue(&path)?),
            None => Cow::Borrowed(published()),
        };
        Ok(Self { folder, catalogue })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where a mesh of the catalogue is, or would be.
    pub fn path(&self, mesh: &Published) -> PathBuf {
        self.folder.join("meshes").join(mesh.file_name())
    }

    /// The folder of the user's own files.
    pub(crate) fn added_folder(&self) -> PathBuf {
        self.folder.join(ADDED)
    }

    /// Whether a mesh is there: its file is read.
    ///
    /// # Errors
    /// When it is there and cannot be read.
    pub fn state(&self, mesh: &Published) -> Result<State, PublicError> {
        let path = self.path(mesh);
        match fs::read(&path) {
            Ok(bytes) if hex_digest(&bytes) == mesh.sha256 => Ok(State::Here),
            Ok(_) => Ok(State::Another),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(State::Missing),
            Err(error) => Err(io_error(&path)(error)),
        }
    }

    /// The meshes of the catalogue that a word stands for: a set, a package, or the name of one.
    ///
    /// # Errors
    /// [`PublicError::Unknown`].
    pub fn wanted(&self, word: &str) -> Result<Vec<&Published>, PublicError> {
        let set = Set::ALL.into_iter().find(|set| set.key() == word);
        let mut wanted: Vec<_> = self.catalogue.meshes.iter().collect();
        wanted.retain(|mesh| match set {
            Some(set) => mesh.set == set,
            None => mesh.package == word || mesh.name == word,
        });
        // A set may be empty, a package or a mesh that is in no catalogue is a slip.
        if wanted.is_empty() && set.is_none() { Err(self.unknown(word)) } else { Ok(wanted) }
    }

    /// The inputs that a word of `--dataset` stands for: `builtin`, a set, `added`, the meshes of a package that are
    /// usable, or one mesh.
    ///
    /// # Errors
    /// When nothing has this name, or some of it is not in the folder; the message names the command that gets it.
    pub fn sources(&self, word: &str) -> Result<Vec<Source>, PublicError> {
        if medial_datasets::find(word).is_some() {
            return Ok(vec![Source::BuiltIn { id: word.to_owned(), resolution: None }]);
        }
        let own = added(self)?;
        if word == ADDED || word == Set::Papers.key() {
            let mut sources: Vec<_> = (own.iter())
                .filter(|added| word == ADDED || added.set() == word)
                .map(|added| self.of_added(added))
                .collect();
            for mesh in self.catalogue.meshes.iter().filter(|mesh| mesh.set.key() == word) {
                let is_listed = sources.iter().any(|source: &Source| source.name() == mesh.name);
                if !is_listed && self.state(mesh)? == State::Here {
                    sources.push(self.of_published(mesh));
                }
            }
            sources.sort_by_key(Source::name);
            return match sources.is_empty() {
                true => Err(self.missing(word, vec!["all of it".to_owned()])),
                false => Ok(sources),
            };
        }
        if let Some(added) = own.iter().find(|added| added.name == word) {
            return Ok(vec![self.of_added(added)]);
        }
        let mut wanted = self.wanted(word)?;
        if wanted.iter().all(|mesh| mesh.package == word) {
            wanted.retain(|mesh| mesh.set == Set::Public);
        }
        let (mut sources, mut missing) = (Vec::new(), Vec::new());
        for mesh in wanted {
            match self.state(mesh)? {
                State::Here => sources.push(self.of_published(mesh)),
                State::Missing | State::Another => missing.push(mesh.name.clone()),
            }
        }
        if missing.is_empty() { Ok(sources) } else { Err(self.missing(word, missing)) }
    }

    /// The one input that a name stands for.
    ///
    /// # Errors
    /// As [`Library::sources`]; a word for several is unknown.
    pub fn source(&self, name: &str) -> Result<Source, PublicError> {
        let is_one = self.catalogue.meshes.iter().any(|mesh| mesh.name == name)
            || added(self)?.iter().any(|added| added.name == name);
        if !is_one {
            return Err(self.unknown(name));
        }
        let source = self.sources(name)?.into_iter().next();
        source.ok_or_else(|| self.unknown(name))
    }

    fn of_published(&self, mesh: &Published) -> Source {
        let (name, set) = (mesh.name.clone(), mesh.set.key().to_owned());
        Source::Cached { name, set, path: self.path(mesh) }
    }

    fn of_added(&self, added: &Added) -> Source {
        let (name, set) = (added.name.clone(), added.set().to_owned());
        Source::Cached { name, set, path: self.added_folder().join(&added.file) }
    }

    fn missing(&self, word: &str, names: Vec<String>) -> PublicError {
        let mut wanted = self.catalogue.meshes.iter().filter(|mesh| names.contains(&mesh.name));
        let is_added = word == ADDED || word == Set::Papers.key();
        let how = match is_added || wanted.any(Published::is_file) {
            true => "`medial datasets add FILE` takes them in".to_owned(),
            false => format!("`medial datasets fetch {word}` gets what is missing"),
        };
        PublicError::Missing { word: word.to_owned(), names, how }
    }

    fn unknown(&self, word: &str) -> PublicError {
        let meshes = self.catalogue.meshes.iter().map(|mesh| mesh.name.as_str());
        let packages = self.catalogue.packages.iter().map(|package| package.id.as_str());
        let sets = Set::ALL.map(Set::key).into_iter().chain(["builtin", ADDED]);
        let known = sets.chain(packages).chain(meshes);
        let meant = did_you_mean(word, known);
        PublicError::Unknown { word: word.to_owned(), meant }
    }

    /// Whether a name stands for something else than a user's file.
    pub(crate) fn is_taken(&self, name: &str) -> bool {
        let words = Set::ALL.map(Set::key).into_iter().chain(["builtin", ADDED]);
        words.into_iter().any(|word| word == name)
            || medial_datasets::find(name).is_some()
            || self.catalogue.meshes.iter().any(|mesh| mesh.name == name)
    }
}

/// Writes a file of the library, with its folder.
pub(crate) fn keep(path: &Path, bytes: &[u8]) -> Result<(), PublicError> {
    let folder = path.parent().unwrap_or(path);
    fs::create_dir_all(folder).map_err(io_error(folder))?;
    write_atomically(path, |out| out.write_all(bytes)).map_err(io_error(path))
}

fn read_catalogue(path: &Path) -> Result<Catalogue, PublicError> {
    let text = fs::read_to_string(path).map_err(io_error(path))?;
    Catalogue::parse(&text)
        .map_err(|message| PublicError::Catalogue { path: path.to_owned(), message })
}

/// A user's file in the library.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Added {
    /// Its name.
    pub name: String,
    /// The name of its file beside this description.
    pub file: String,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Number of vertices after reading.
    pub vertices: usize,
    /// Number of triangles after reading.
    pub faces: usize,
    /// Why it is refused as an input, where it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// The mesh of the catalogue that it is, where it is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known: Option<String>,
    /// The set of that mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_set: Option<Set>,
}

impl Added {
    /// The set that it belongs to.
    pub fn set(&self) -> &'static str {
        self.known_set.map_or("added", Set::key)
    }
}

impl Library {
    /// Copies a user's file into the library, and tells what mesh of the catalogue it is, if any. Its name is that given,
    /// else that of the mesh it is, else the stem of its own.
    ///
    /// # Errors
    /// When it cannot be read or understood, or its name cannot be used or belongs to another surface.
    pub fn add(
        &self,
        file: &Path,
        name: Option<&str>,
    ) -> Result<(Added, Option<&Published>), PublicError> {
        // First, since it refuses what is no regular file and would never end.
        let bytes = surface::content(file)?;
        let loaded = surface::read_any(file, &bytes)?;
        let refused = surface::inspect(file)?.refused.map(|error| error.fault.to_string());
        let sha256 = hex_digest(&bytes);
        let known = self.catalogue.meshes.iter().find(|mesh| mesh.sha256 == sha256);
        let name = match (name, known) {
            (Some(name), _) => name.to_owned(),
            (None, Some(mesh)) => mesh.name.clone(),
            (None, None) => {
                file.file_stem().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
            }
        };
        self.check_name(&name, &sha256, known)?;
        let extension = file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let added = Added {
            file: format!("{name}.{extension}"),
            name,
            sha256,
            vertices: loaded.report.vertices,
            faces: loaded.report.faces,
            refused,
            known: known.map(|mesh| mesh.name.clone()),
            known_set: known.map(|mesh| mesh.set),
        };
        let folder = self.added_folder();
        keep(&folder.join(&added.file), &bytes)?;
        // The description last: without it the file is not there.
        let path = folder.join(format!("{}.json", added.name));
        let text = serde_json::to_vec(&added).map_err(|error| io_error(&path)(error.into()))?;
        keep(&path, &text)?;
        Ok((added, known))
    }

    fn check_name(
        &self,
        name: &str,
        sha256: &str,
        known: Option<&Published>,
    ) -> Result<(), PublicError> {
        let wrong = |why: &str| {
            Err(PublicError::Name {
                name: name.to_owned(),
                why: format!("{why}; give another `--name`"),
            })
        };
        if !is_name(name) {
            return wrong("a name has lower-case letters, digits, `.`, `_` and `-`");
        }
        if self.is_taken(name) && known.is_none_or(|mesh| mesh.name != name) {
            return wrong("the name of another mesh, shape or set");
        }
        match added(self)?.iter().find(|added| added.name == name) {
            Some(other) if other.sha256 != sha256 => {
                wrong(&format!("another file was added under this name ({})", other.file))
            }
            _ => Ok(()),
        }
    }
}

/// The user's files in the library, by name. A description that cannot be read, or whose file is not there as it was
/// added, is passed over: caches can be swept.
///
/// # Errors
/// When the folder cannot be read.
pub fn added(library: &Library) -> Result<Vec<Added>, PublicError> {
    let folder = library.added_folder();
    let entries = match fs::read_dir(&folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(io_error(&folder))?,
    };
    let mut found = Vec::new();
    for entry in entries {
        let path = entry.map_err(io_error(&folder))?.path();
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        let text = fs::read(&path).map_err(io_error(&path))?;
        let Ok(added) = serde_json::from_slice::<Added>(&text) else { continue };
        let is_ours = is_name(&added.name) && is_name(&added.file);
        let content = if is_ours { fs::read(folder.join(&added.file)).ok() } else { None };
        if content.is_some_and(|bytes| hex_digest(&bytes) == added.sha256) {
            found.push(added);
        }
    }
    found.sort_by(|a: &Added, b| a.name.cmp(&b.name));
    Ok(found)
}
