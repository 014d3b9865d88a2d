//! From packages into the library.
//!
//! 1. What is missing of the meshes wanted says which packages are needed; a package of which nothing is missing is not
//!    fetched.
//! 2. A package is fetched in the version of the catalogue. Every mesh of the catalogue in it is kept, wanted or not:
//!    the archive is here once.
//! 3. Where that version cannot be had, another one is taken for what is the same in it, by the hash.

use std::collections::BTreeMap;
use std::path::Path;

use medial_datasets::published::{Package, Published};

use super::client::{Clients, any_version};
use super::sift::{Limits, sift};
use super::{Library, PublicError, State, io_error};
use crate::run::hex_digest;

/// What came of a package.
#[derive(Clone, Debug, Default)]
pub struct FetchedPackage {
    /// Names of the meshes that were kept.
    pub kept: Vec<String>,
    /// What is not, and why.
    pub refused: Vec<Refusal>,
    /// What else is to be said, such as that another version was taken.
    pub remarks: Vec<String>,
}

/// A mesh that is not kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Its name.
    pub name: String,
    /// Why.
    pub why: String,
}

/// Fetches a package and keeps what the catalogue knows of it and is not here yet.
///
/// # Errors
/// When a file cannot be written, or the user interrupts. A client that fails and an archive that is refused are in
/// what is given back.
pub fn fetch_package(
    library: &Library,
    package: &Package,
    clients: Clients<'_>,
) -> Result<FetchedPackage, PublicError> {
    let id = package.id();
    let mut fetched = FetchedPackage::default();
    let pinned = archived(library, package, clients, &mut fetched);
    let why = match pinned {
        Err(PublicError::Client(why)) => {
            // Only the version may be gone: with any other one a client that is not there is none, either.
            let unpinned = any_version(package);
            match archived(library, &unpinned, clients, &mut fetched) {
                Ok(()) => fetched.remarks.push(format!(
                    "{package} cannot be had ({why}); another version of {id} was taken for what is the same in it"
                )),
                Err(PublicError::Client(_)) => {}
                Err(PublicError::Archive { why, .. }) => fetched.remarks.push(why),
                Err(error) => return Err(error),
            }
            why
        }
        Err(error @ PublicError::Archive { .. }) => error.to_string(),
        Err(error) => return Err(error),
        Ok(()) => format!("it is not in {package}"),
    };
    for mesh in library.catalogue.meshes.iter().filter(|mesh| mesh.package == id) {
        let is_told = fetched.refused.iter().any(|refusal| refusal.name == mesh.name);
        if !is_told && library.state(mesh)? != State::Here {
            fetched.refused.push(Refusal { name: mesh.name.clone(), why: why.clone() });
        }
    }
    Ok(fetched)
}

/// Fetches an archive and takes the meshes of its package.
fn archived(
    library: &Library,
    package: &Package,
    clients: Clients<'_>,
    fetched: &mut FetchedPackage,
) -> Result<(), PublicError> {
    let scratch = tempfile::tempdir().map_err(io_error(&std::env::temp_dir()))?;
    let archive = clients.fetch(package, scratch.path())?;
    take(library, &archive, Some(&package.id()), fetched)
}

/// Keeps what the catalogue knows of an archive that the user has fetched himself, from whatever package it is.
///
/// # Errors
/// When the archive cannot be read or is refused, holds no mesh of the catalogue, or a file cannot be written.
pub fn fetch_archive(library: &Library, archive: &Path) -> Result<FetchedPackage, PublicError> {
    let mut fetched = FetchedPackage::default();
    let known = take(library, archive, None, &mut fetched).map(|()| fetched)?;
    if known.kept.is_empty() && known.refused.is_empty() && known.remarks.is_empty() {
        let why = "it holds no mesh of the catalogue".to_owned();
        return Err(PublicError::Archive { archive: archive.to_owned(), why });
    }
    Ok(known)
}

/// Keeps the meshes of an archive by their hashes. One of `package` that has its path and another content is refused
/// by name.
fn take(
    library: &Library,
    archive: &Path,
    package: Option<&str>,
    fetched: &mut FetchedPackage,
) -> Result<(), PublicError> {
    let meshes = &library.catalogue.meshes;
    let by_hash: BTreeMap<&str, &Published> =
        meshes.iter().map(|mesh| (mesh.sha256.as_str(), mesh)).collect();
    let mut others: BTreeMap<String, String> = BTreeMap::new();
    let mut here_before = 0;
    sift(archive, Limits::USUAL, &mut |found| {
        let hash = hex_digest(&found.bytes);
        match by_hash.get(hash.as_str()) {
            Some(mesh) if library.state(mesh)? == State::Here => here_before += 1,
            Some(mesh) => {
                library.keep(mesh, &found.bytes)?;
                fetched.kept.push(mesh.name.clone());
            }
            None => {
                others.insert(found.path, hash);
            }
        }
        Ok(())
    })?;
    for mesh in meshes.iter().filter(|mesh| Some(mesh.package.as_str()) == package) {
        // The same content elsewhere in the archive is as good.
        if let Some(hash) = others.get(&mesh.path)
            && library.state(mesh)? != State::Here
        {
            let why = format!(
                "{} has the SHA-256 {hash}, and not {} as in the catalogue",
                mesh.path, mesh.sha256
            );
            fetched.refused.push(Refusal { name: mesh.name.clone(), why });
        }
    }
    if package.is_none() && here_before > 0 {
        fetched.remarks.push(format!("{here_before} of its meshes were here before"));
    }
    Ok(())
}
