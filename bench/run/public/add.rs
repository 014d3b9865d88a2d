//! From a user's file into the library: recognised by its bytes.

use std::fs;
use std::io;
use std::path::Path;

use medial::surface;
use medial_datasets::published::{Published, Set, is_name};
use serde::{Deserialize, Serialize};

use super::library::keep;
use super::{Library, PublicError, io_error};
use crate::run::hex_digest;

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
        let loaded = surface::read_any(file)?;
        let refused = surface::inspect(file)?.refused.map(|error| error.fault.to_string());
        let bytes = fs::read(file).map_err(io_error(file))?;
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
