//! The folder of meshes that are known by name.
//!
//! | in the folder | what |
//! |---|---|
//! | `meshes/NAME.EXTENSION` | a mesh of the catalogue, with the hash that stands there |
//! | `added/NAME.EXTENSION`, `added/NAME.json` | a user's file, and what it is |
//!
//! Every file is looked at again, by its hash, whenever it is asked for: a cache can be swept, copied and edited.

use std::borrow::Cow;
use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use etcetera::BaseStrategy;
use medial::write_atomically;
use medial_datasets::published::{Catalogue, Published, Set, published};

use super::{Added, PublicError, added, io_error};
use crate::run::{Source, did_you_mean, hex_digest};

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
        let set = |name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
        let folder = match set(CACHE) {
            Some(folder) => folder,
            None => etcetera::choose_base_strategy()
                .map(|folders| folders.cache_dir().join("medial"))
                .map_err(|_| PublicError::NoFolder)?,
        };
        // Workers and clients have working folders of their own.
        let folder = std::path::absolute(&folder).map_err(io_error(&folder))?;
        let catalogue = match set(CATALOGUE) {
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
    pub(super) fn added_folder(&self) -> PathBuf {
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
        let meshes = self.catalogue.meshes.iter();
        let is_wanted = |mesh: &&Published| match Set::ALL.iter().find(|set| set.key() == word) {
            Some(&set) => mesh.set == set,
            None => mesh.package == word || mesh.name == word,
        };
        let wanted: Vec<_> = meshes.filter(is_wanted).collect();
        let is_word = Set::ALL.iter().any(|set| set.key() == word);
        if wanted.is_empty() && !is_word { Err(self.unknown(word)) } else { Ok(wanted) }
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
            let in_set = |added: &&Added| word == ADDED || added.set() == word;
            let mut sources: Vec<_> = own.iter().filter(in_set).map(|a| self.of_added(a)).collect();
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
    pub(super) fn is_taken(&self, name: &str) -> bool {
        let words = Set::ALL.map(Set::key).into_iter().chain(["builtin", ADDED]);
        words.into_iter().any(|word| word == name)
            || medial_datasets::find(name).is_some()
            || self.catalogue.meshes.iter().any(|mesh| mesh.name == name)
    }
}

/// Writes a file of the library, with its folder.
pub(super) fn keep(path: &Path, bytes: &[u8]) -> Result<(), PublicError> {
    let folder = path.parent().unwrap_or(path);
    fs::create_dir_all(folder).map_err(io_error(folder))?;
    write_atomically(path, |out| out.write_all(bytes)).map_err(io_error(path))
}

fn read_catalogue(path: &Path) -> Result<Catalogue, PublicError> {
    let text = fs::read_to_string(path).map_err(io_error(path))?;
    Catalogue::parse(&text)
        .map_err(|message| PublicError::Catalogue { path: path.to_owned(), message })
}
