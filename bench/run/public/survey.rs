//! From packages into the catalogue: what meshes they hold, and what each is.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use medial::surface::{self, Fault, SurfaceReport};
use medial_datasets::published::{
    Catalogue, LEAST_VERTICES, Package, PackageKind, Published, Set, is_name,
};

use super::client::Clients;
use super::library::read_catalogue;
use super::sift::{Found, Limits, sift};
use super::{PublicError, io_error};
use crate::run::hex_digest;
use crate::run::source::surface_hash;

/// A catalogue that was made anew.
#[derive(Clone, Debug)]
pub struct Survey {
    /// The catalogue.
    pub catalogue: Catalogue,
    /// What is not in it, and why.
    pub left_out: Vec<String>,
}

/// Surveys the packages that a catalogue names: all its meshes are found anew and described, by name; meshes that it
/// knew already keep their names. Files that no package holds are looked for in the folder `files`.
///
/// # Errors
/// When a package cannot be fetched or read, a file is missing, or the user interrupts.
pub fn survey(catalogue: &Path, files: &Path, clients: Clients<'_>) -> Result<Survey, PublicError> {
    let old = read_catalogue(catalogue)?;
    let names = old.meshes.iter().map(|mesh| (mesh.sha256.as_str(), mesh.name.as_str()));
    let mut surveyor = Surveyor {
        names: names.collect(),
        meshes: Vec::new(),
        hashes: BTreeSet::new(),
        surfaces: BTreeMap::new(),
        left_out: Vec::new(),
    };
    for package in &old.packages {
        match package.kind {
            PackageKind::File => {
                for name in &package.files {
                    let path = files.join(name);
                    let bytes = fs::read(&path).map_err(io_error(&path))?;
                    surveyor.take(package, Found { path: name.clone(), bytes })?;
                }
            }
            _ => {
                let scratch = tempfile::tempdir().map_err(io_error(&std::env::temp_dir()))?;
                let archive = clients.fetch(package, scratch.path())?;
                sift(&archive, Limits::USUAL, &mut |found| surveyor.take(package, found))?;
            }
        }
    }
    let Surveyor { mut meshes, left_out, .. } = surveyor;
    meshes.sort_by(|a, b| a.name.cmp(&b.name));
    let catalogue = Catalogue { packages: old.packages, meshes };
    Ok(Survey { catalogue, left_out })
}

struct Surveyor<'a> {
    /// Names that meshes had, by their hashes.
    names: BTreeMap<&'a str, &'a str>,
    meshes: Vec<Published>,
    hashes: BTreeSet<String>,
    /// Names of the meshes by their surfaces: the same one twice would have twice the weight in a set.
    surfaces: BTreeMap<String, String>,
    left_out: Vec<String>,
}

impl Surveyor<'_> {
    fn take(&mut self, package: &Package, found: Found) -> Result<(), PublicError> {
        let Found { path, bytes } = found;
        let mut leave = |why: &str| self.left_out.push(format!("{package}: {path}: {why}"));
        if package.without.iter().any(|start| path.starts_with(start)) {
            leave("as the package says");
            return Ok(());
        }
        let sha256 = hex_digest(&bytes);
        if !self.hashes.insert(sha256.clone()) {
            leave("the same file as another");
            return Ok(());
        }
        let set = if package.kind == PackageKind::File { Set::Papers } else { Set::Defective };
        let mut mesh = Published {
            name: String::new(),
            set,
            package: package.id(),
            path,
            sha256,
            surface: None,
            vertices: None,
            faces: None,
            components: None,
            genus: None,
            betti: None,
            defects: vec![],
            refused: None,
        };
        if !described(&mut mesh, &bytes)? {
            self.left_out.push(format!("{package}: {}: points without faces", mesh.path));
            return Ok(());
        }
        if let Some(other) = mesh.surface.as_ref().and_then(|surface| self.surfaces.get(surface)) {
            let line = format!("{package}: {}: the same surface as {other}", mesh.path);
            self.left_out.push(line);
            return Ok(());
        }
        mesh.name = match self.names.get(mesh.sha256.as_str()) {
            Some(&name) => name.to_owned(),
            None => self.new_name(package, &mesh.path),
        };
        if let Some(surface) = &mesh.surface {
            self.surfaces.insert(surface.clone(), mesh.name.clone());
        }
        self.meshes.push(mesh);
        Ok(())
    }

    /// A name that nothing else has: the stem of the file, with the tag of the package where it must be.
    fn new_name(&self, package: &Package, path: &str) -> String {
        let stem = match stem(path).as_str() {
            // It tells less than the package.
            "index" => package.name.clone(),
            stem => stem.to_owned(),
        };
        let tag = package.tag.as_deref().unwrap_or(&package.name);
        let is_free = |name: &String| {
            let is_shape = medial_datasets::find(name).is_some();
            let is_word = Set::ALL.iter().any(|set| set.key() == name);
            let mut taken =
                self.meshes.iter().map(|mesh| &*mesh.name).chain(self.names.values().copied());
            is_name(name) && !is_shape && !is_word && !taken.any(|taken| taken == name)
        };
        let tagged = [stem.clone(), format!("{stem}-{tag}")];
        let numbered = (2..).map(|number| format!("{stem}-{tag}-{number}"));
        tagged.into_iter().chain(numbered).find(is_free).expect("numbers do not end")
    }
}

/// The stem of a path's last part as a name.
fn stem(path: &str) -> String {
    let file = path.rsplit(['/', '!']).next().unwrap_or(path);
    let file = file.strip_suffix(".gz").unwrap_or(file);
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem).to_ascii_lowercase();
    let plain = |c: char| if c.is_ascii_alphanumeric() || "._".contains(c) { c } else { '-' };
    stem.chars().map(plain).collect::<String>().trim_matches(['-', '.', '_']).to_owned()
}

/// Says what a mesh is, as reading it does; `false` for points without faces.
fn described(mesh: &mut Published, bytes: &[u8]) -> Result<bool, PublicError> {
    let folder = tempfile::tempdir().map_err(io_error(&std::env::temp_dir()))?;
    let path = folder.path().join("mesh").with_extension(mesh.extension());
    fs::write(&path, bytes).map_err(io_error(&path))?;
    let loaded = match surface::read_any(&path) {
        Ok(loaded) => loaded,
        Err(error) if matches!(error.fault, Fault::NoFaces { .. }) => return Ok(false),
        Err(error) => {
            mesh.refused = Some(error.fault.to_string());
            return Ok(true);
        }
    };
    let report = &loaded.report;
    mesh.surface = Some(surface_hash(&loaded.mesh));
    mesh.vertices = Some(report.vertices);
    mesh.faces = Some(report.faces);
    mesh.components = Some(report.components);
    mesh.genus = report.genus;
    mesh.betti = report.expected_betti;
    mesh.defects = defects(report);
    mesh.refused = surface::inspect(&path)?.refused.map(|error| error.fault.to_string());
    let is_sound =
        mesh.refused.is_none() && !report.self_intersecting && report.degenerate_faces == 0;
    if mesh.set != Set::Papers {
        mesh.set = match is_sound {
            true if report.vertices >= LEAST_VERTICES => Set::Public,
            true => Set::Small,
            false => Set::Defective,
        };
    }
    Ok(true)
}

fn defects(report: &SurfaceReport) -> Vec<String> {
    let counts = [
        ("boundary edges", report.boundary_edges),
        ("edges of more than two faces", report.nonmanifold_edges),
        ("vertices of more than one fan", report.nonmanifold_vertices),
        ("zero-area faces", report.degenerate_faces),
        ("pairs of crossing faces", report.intersecting_pairs),
    ];
    let counts = counts.into_iter().filter(|&(_, count)| count > 0);
    let mut defects: Vec<String> = counts.map(|(what, count)| format!("{what}: {count}")).collect();
    if !report.oriented {
        defects.push("not oriented".to_owned());
    }
    defects.extend(report.repairs.iter().map(|repair| format!("repaired: {repair}")));
    defects
}

#[cfg(test)]
mod tests {
    use super::stem;

    #[test]
    fn a_stem_is_a_name() {
        assert_eq!(stem("doc/data.tar.gz!data/poly2x^2+y^2.OFF"), "poly2x-2-y-2");
        assert_eq!(stem("package/models/dragon_vrip_res4.ply.gz"), "dragon_vrip_res4");
        assert_eq!(stem("package/index.js"), "index");
    }
}
