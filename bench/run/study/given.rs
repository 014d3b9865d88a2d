//! Files of other programs in a study: which mesh each belongs to, how many spheres it has, and who gave the same.

use std::path::PathBuf;

use medial::complex::{self, Radii, ReadOptions};
use medial::simplifier::Params;
use medial_reports::Target;

use super::items::hash_of;
use super::{Here, Study, StudyError};
use crate::run::{GIVEN, Given, Item, MethodSpec, RadiiFrom, SceneSpec};

/// A file that was looked at.
pub(super) struct GivenFile<'a> {
    /// Name of the mesh in tables.
    pub mesh: String,
    given: &'a Given,
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
    pub(super) fn given_files(&self, meshes: &[String]) -> Result<Vec<GivenFile<'_>>, StudyError> {
        let mut files: Vec<GivenFile<'_>> = Vec::new();
        for given in &self.given {
            let mesh = mesh_of(given, meshes)?;
            let named = self.methods.iter().filter_map(|method| method.name.as_ref());
            let mut taken = files.iter().filter(|file| file.mesh == mesh).map(|f| &f.given.name);
            if taken.any(|name| *name == given.name) || named.clone().any(|n| *n == given.name) {
                let message = format!("two methods are named `{}` on {mesh}", given.name);
                return Err(StudyError::Value(message));
            }
            files.push(self.look_at(given, mesh)?);
        }
        for file in 0..files.len() {
            let (mesh, hash) = (files[file].mesh.clone(), files[file].hash.clone());
            let others = files.iter().enumerate().filter(|&(other, _)| other != file);
            let same = others.filter(|(_, f)| f.mesh == mesh && f.hash == hash);
            files[file].same_as = same.map(|(_, f)| f.given.name.clone()).collect();
        }
        Ok(files)
    }

    fn look_at<'a>(&'a self, given: &'a Given, mesh: String) -> Result<GivenFile<'a>, StudyError> {
        let path = self.resolved(&given.file);
        let path = std::path::absolute(&path).unwrap_or(path);
        let radii = match given.radii {
            RadiiFrom::File => Radii::Needed,
            RadiiFrom::Surface => Radii::NotNeeded,
        };
        let options = ReadOptions { lenient: given.lenient, block: given.block, radii };
        let wrong = |why: String| StudyError::Value(format!("given `{}`: {why}", given.name));
        let loaded = complex::read_with(&path, options).map_err(|e| wrong(e.to_string()))?;
        let spheres = loaded.mesh.spheres.len();
        if spheres == 0 {
            return Err(wrong(format!("{}: no sphere", path.display())));
        }
        let hash = hash_of(&path)?;
        Ok(GivenFile { mesh, given, path, hash, spheres, same_as: vec![] })
    }

    /// The numbers of spheres of the given files, from many to few.
    ///
    /// # Errors
    /// For a file that cannot be read.
    pub fn given_counts(&self) -> Result<Vec<usize>, StudyError> {
        let looked = self.given.iter().map(|given| self.look_at(given, String::new()));
        let mut counts =
            looked.map(|file| Ok(file?.spheres)).collect::<Result<Vec<_>, StudyError>>()?;
        counts.sort_unstable_by(|a, b| b.cmp(a));
        counts.dedup();
        Ok(counts)
    }

    /// The item that judges a given file.
    pub(super) fn given_item(&self, scene: SceneSpec, file: &GivenFile<'_>, here: &Here) -> Item {
        let Given { name, fit, radii, lenient, block, .. } = file.given;
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
