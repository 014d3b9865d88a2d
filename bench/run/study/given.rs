//! Files of other programs in a study: which mesh each belongs to, how many spheres it has, and who gave the same.

use std::path::PathBuf;

use medial::complex::{Radii, ReadOptions};
use medial::simplifier::Params;
use medial_reports::Target;

use super::items::hash_of;
use super::{Here, Study, StudyError};
use crate::run::axis_file::read_external;
use crate::run::given::Claims;
use crate::run::{GIVEN, Given, Item, MethodSpec, RadiiFrom, SceneSpec, hex_digest};

/// A file that was looked at.
pub(super) struct GivenFile {
    /// Name of the mesh in tables.
    pub mesh: String,
    given: Given,
    claims: Claims,
    path: PathBuf,
    /// SHA-256 of its bytes.
    hash: String,
    /// Number of spheres.
    spheres: usize,
    /// Names of those of the same mesh that have the same bytes.
    same_as: Vec<String>,
}

impl Study {
    /// The given files with the meshes that they belong to, of the names of all meshes.
    ///
    /// # Errors
    /// [`StudyError::Value`] for a file that cannot be read or belongs to no mesh, and for two of one name.
    pub(super) fn given_files(&self, meshes: &[String]) -> Result<Vec<GivenFile>, StudyError> {
        let mut files: Vec<GivenFile> = Vec::new();
        let mut all: Vec<(Given, Claims)> = Vec::new();
        for given in &self.given {
            let folder = self.resolved(&given.file);
            if folder.is_dir() {
                let wrong = |why| StudyError::Value(format!("given `{}`: {why}", given.name));
                let (found, claims) = given.in_folder(&folder, meshes).map_err(wrong)?;
                all.extend(found.into_iter().map(|given| (given, claims.clone())));
            } else {
                all.push((given.clone(), Claims::default()));
            }
        }
        for (given, claims) in all {
            let mesh = mesh_of(&given, meshes)?;
            let named = self.methods.iter().filter_map(|method| method.name.as_ref());
            let taken = named.clone().any(|name| *name == given.name);
            let file = self.look_at(given, claims, mesh)?;
            let same_row = |other: &GivenFile| {
                (&other.mesh, &other.given.name, other.spheres)
                    == (&file.mesh, &file.given.name, file.spheres)
            };
            if taken || files.iter().any(same_row) {
                let GivenFile { given, mesh, spheres, .. } = &file;
                let message = format!(
                    "two methods are named `{}` on {mesh} at {spheres} spheres",
                    given.name
                );
                return Err(StudyError::Value(message));
            }
            files.push(file);
        }
        for file in 0..files.len() {
            let (mesh, hash) = (files[file].mesh.clone(), files[file].hash.clone());
            let others = files.iter().enumerate().filter(|&(other, _)| other != file);
            let same = others.filter(|(_, f)| f.mesh == mesh && f.hash == hash);
            files[file].same_as = same.map(|(_, f)| f.given.name.clone()).collect();
        }
        Ok(files)
    }

    fn look_at(&self, given: Given, claims: Claims, mesh: String) -> Result<GivenFile, StudyError> {
        let path = self.resolved(&given.file);
        let path = std::path::absolute(&path).unwrap_or(path);
        let radii = match given.radii {
            RadiiFrom::File => Radii::Needed,
            RadiiFrom::Surface => Radii::NotNeeded,
        };
        let options = ReadOptions { lenient: given.lenient, block: given.block, radii };
        let wrong = |why: String| StudyError::Value(format!("given `{}`: {why}", given.name));
        let loaded = read_external(&path, options).map_err(wrong)?;
        let spheres = loaded.mesh.spheres.len();
        if spheres == 0 {
            return Err(wrong(format!("{}: no sphere", path.display())));
        }
        let hash = hash_of(&path)?;
        Ok(GivenFile { mesh, given, claims, path, hash, spheres, same_as: vec![] })
    }

    /// The numbers of spheres of the given files, from many to few.
    ///
    /// # Errors
    /// For a file that cannot be read.
    pub fn given_counts(&self) -> Result<Vec<usize>, StudyError> {
        let sources = self.sources()?;
        let files = self.given_files(&super::items::unique_names(&sources))?;
        let mut counts: Vec<usize> = files.iter().map(|file| file.spheres).collect();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        counts.dedup();
        Ok(counts)
    }

    /// The item that judges a given file.
    pub(super) fn given_item(&self, scene: SceneSpec, file: &GivenFile, here: &Here) -> Item {
        let Given { name, fit, radii, lenient, block, .. } = &file.given;
        let mut params = Params::none();
        let mut set = |key: &str, value: serde_json::Value| {
            params.0.insert(key.to_owned(), value);
        };
        set("file", file.path.to_string_lossy().into());
        set("fit", serde_json::to_value(fit).expect("a word"));
        set("radii", serde_json::to_value(radii).expect("a word"));
        if *lenient {
            set("lenient", true.into());
        }
        if let Some(block) = block {
            set("block", (*block).into());
        }
        let Claims { title, citation, seconds } = &file.claims;
        for (key, text) in [("title", title), ("citation", citation)] {
            if !text.is_empty() {
                set(key, text.as_str().into());
            }
        }
        let stem = file.path.file_stem().unwrap_or_default().to_string_lossy();
        if let Some(seconds) = seconds.get(stem.as_ref()) {
            set("claimed_seconds", (*seconds).into());
        }
        if !file.same_as.is_empty() {
            set("same_as", file.same_as.join(", ").into());
        }
        Item {
            scene,
            method: MethodSpec {
                id: GIVEN.to_owned(),
                name: Some(name.clone()),
                params,
                fingerprint: Some(file.hash.clone()),
            },
            levels: vec![Target::Spheres(file.spheres)],
            seed: self.seed,
            repeat: 1,
            threads: self.threads.unwrap_or(here.threads),
            limits: self.limits(here),
            // The program that measures it; its own hash is the fingerprint.
            version: hex_digest(
                format!("{} {}", medial::SOURCE_HASH, medial::geometry::SOURCE_HASH).as_bytes(),
            ),
            binary: here.binary.clone(),
        }
    }
}

/// The mesh that a file belongs to.
fn mesh_of(given: &Given, meshes: &[String]) -> Result<String, StudyError> {
    let name = &given.name;
    let message = match (&given.mesh, meshes) {
        (Some(mesh), _) if meshes.contains(mesh) => return Ok(mesh.clone()),
        (Some(mesh), _) => {
            format!("given `{name}`: no mesh is called `{mesh}`; there are: {}", meshes.join(", "))
        }
        (None, [mesh]) => return Ok(mesh.clone()),
        (None, _) => format!(
            "given `{name}`: there are {} meshes; say which it belongs to, as in --given {name}@{}={}",
            meshes.len(),
            meshes.first().map_or("MESH", String::as_str),
            given.file.display()
        ),
    };
    Err(StudyError::Value(message))
}
