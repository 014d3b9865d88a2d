//! External results: files and folders of a user as results of a named method.
//!
//! A file is a pseudo-method: it has one result with its number of spheres on its mesh, evaluated like all others.
//! A folder holds `MESH.ma` or `MESH-COUNT.ma`, or another format, for the meshes of the study, and may hold
//! `method.toml` with the claims of its authors. Folders come from others: links that lead out of them are refused.
//! A surface instead of a medial mesh is the decimation baseline. Everything but the claimed seconds is measured here.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::{fs, io};

use medial::shape::Shape;
use medial::simplifier::{
    Level, Method, MethodInfo, ParamFields, Params, RunContext, Simplification, Simplified,
    SimplifyError,
};
use medial::{complex, quoted, read_regular, read_regular_text, shortened};
use medial_run::axis::{
    AxisOptions, FitBy, RadiiFrom, check_size, content, read_axis, read_external,
};
use medial_run::hash::hex_digest;
use medial_run::item::{GIVEN, Item, MethodSpec};
use medial_run::level::Target;
use medial_run::record::{OwnSeconds, Provenance, is_near};
use medial_run::scene::SceneSpec;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::exit::Failure;
use crate::study::{Study, parse_toml, unique_names};

/// An external result with its name in tables.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExternalResult {
    /// Name in tables.
    pub name: String,
    /// The medial mesh.
    pub file: PathBuf,
    /// Name of its mesh; required with several meshes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Conversion of units.
    #[serde(default = "auto")]
    pub fit: FitBy,
    /// Origin of the radii.
    #[serde(default)]
    pub radii: RadiiFrom,
    /// Whether to read all lines where the header states a different number.
    #[serde(default)]
    pub lenient: bool,
    /// Number of the medial mesh in a file with several, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub block: Option<usize>,
}

/// Other programs use other units, and no option of the command line sets them for one file of many.
fn auto() -> FitBy {
    FitBy::Auto
}

impl ExternalResult {
    /// Reads `NAME=FILE` or `NAME@MESH=FILE`.
    ///
    /// # Errors
    /// When the name or the file is missing.
    pub fn parse(text: &str) -> Result<Self, String> {
        // At the first `=`: names of files may have others, names of methods none.
        let (name, file) = text.split_once('=').unwrap_or_default();
        let (name, mesh) = match name.split_once('@') {
            Some((name, mesh)) => (name, Some(mesh.trim().to_owned())),
            None => (name, None),
        };
        if name.trim().is_empty() || file.is_empty() || mesh.as_deref() == Some("") {
            return Err(format!(
                "--given {text}: expected NAME=FILE.ma, or NAME@MESH=FILE.ma with several meshes"
            ));
        }
        let (name, file) = (name.trim().to_owned(), PathBuf::from(file));
        let (radii, lenient, block) = (RadiiFrom::File, false, None);
        Ok(Self { name, file, mesh, fit: FitBy::Auto, radii, lenient, block })
    }
}

/// The claims in a folder's `method.toml`. Everything else about its results is measured.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Claims {
    /// Full name of the method.
    pub title: String,
    /// Who computed the results.
    pub authors: String,
    /// Its source.
    pub citation: String,
    /// The source as a BibTeX entry.
    pub bibtex: String,
    /// How it was run: program, version, options.
    pub run: String,
    /// The machine of the claimed seconds.
    pub machine: String,
    /// Claimed seconds by the name of the file without its extension.
    pub seconds: BTreeMap<String, f64>,
}

impl Claims {
    /// The first claim that cannot be shown.
    fn fault(&self) -> Option<String> {
        let seconds = self.seconds.iter().find(|(_, s)| !(s.is_finite() && **s >= 0.0));
        if let Some((name, value)) = seconds {
            return Some(format!("seconds of {}: {value}: expected a number from 0", quoted(name)));
        }
        let entry = self.bibtex.trim();
        // The depth of braces is 0 again at the last one alone: a second entry follows no other.
        let mut depth = 0_usize;
        let end = entry.char_indices().find(|&(_, c)| {
            depth = if c == '{' { depth + 1 } else { depth - usize::from(c == '}' && depth > 0) };
            c == '}' && depth == 0
        });
        // Commands, unlike entries, affect the whole bibliography.
        let kind = entry.strip_prefix('@').and_then(|rest| rest.split_once('{'));
        let is_kind = kind.map(|(kind, _)| kind.trim().to_ascii_lowercase()).is_some_and(|kind| {
            kind.bytes().all(|byte| byte.is_ascii_alphabetic())
                && !["preamble", "string", "comment"].contains(&&*kind)
        });
        let is_entry = is_kind && end.is_some_and(|(at, _)| at + 1 == entry.len());
        (!entry.is_empty() && !is_entry)
            .then(|| "bibtex: expected one entry @type{key, ...} with balanced braces".to_owned())
    }
}

/// Name of the file with [`Claims`].
const CLAIMS: &str = "method.toml";
/// Most bytes of it, and of a result in its folder; larger files are refused unread.
const LARGEST_CLAIMS: u64 = 100_000;
const LARGEST_IN_FOLDER: u64 = 4_000_000;
/// Extensions of surfaces that are external results, besides those of medial meshes.
const SURFACES: [&str; 2] = ["off", "stl"];

/// The content of a folder of results.
struct Folder {
    files: Vec<ExternalResult>,
    claims: Claims,
    /// Names of the other entries.
    skipped: Vec<String>,
}

/// Refuses a link of a folder that leads out of it: an error would quote a file of the reader, and a report show it.
fn check_inside(folder: &Path, file: &Path) -> Result<(), String> {
    if !file.is_symlink() {
        return Ok(());
    }
    match (fs::canonicalize(folder), fs::canonicalize(file)) {
        (Ok(folder), Ok(target)) if target.starts_with(&folder) => Ok(()),
        _ => Err(format!(
            "{}: a link that leads out of the folder; put the file there",
            file.display()
        )),
    }
}

impl ExternalResult {
    fn refused(&self, why: impl Display) -> Failure {
        Failure::usage(format!("given `{}`: {why}", self.name))
    }

    /// The files of a folder with the names of their meshes, its claims, and the files without a mesh in the study.
    ///
    /// # Errors
    /// When the folder or its claims cannot be read, a link leads out of it, or no file belongs to a mesh.
    fn in_folder(&self, folder: &Path, meshes: &[String]) -> Result<Folder, String> {
        let failed = |error: io::Error| format!("{}: {error}", folder.display());
        let path = folder.join(CLAIMS);
        check_inside(folder, &path)?;
        let read = check_size(&path, LARGEST_CLAIMS).map_err(io::Error::other);
        let read = read.and_then(|()| read_regular_text(&path));
        let claims: Claims = match read {
            Ok(text) => parse_toml(&text).map_err(|why| format!("{}: {why}", path.display()))?,
            // Claims are optional, but a file that is there must be readable.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Claims::default(),
            Err(error) => return Err(format!("{}: {error}", path.display())),
        };
        if let Some(fault) = claims.fault() {
            return Err(format!("{}: {fault}", path.display()));
        }
        let (mut files, mut skipped, mut stems) = (Vec::new(), Vec::new(), BTreeSet::new());
        for entry in fs::read_dir(folder).map_err(failed)? {
            let file = entry.map_err(failed)?.path();
            let extension = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let belonging = meshes.iter().filter(|mesh| {
                stem.strip_prefix(mesh.as_str()).is_some_and(|rest| {
                    rest.is_empty()
                        || rest.strip_prefix('-').is_some_and(|count| count.parse::<u64>().is_ok())
                })
            });
            // A study may have both `box` and `box-8`: the longest name wins.
            let mesh = belonging.max_by_key(|mesh| mesh.len());
            let is_result =
                complex::READABLE.iter().chain(&SURFACES).any(|known| *known == extension);
            stems.insert(stem);
            if let Some(mesh) = mesh.filter(|_| is_result) {
                check_inside(folder, &file)?;
                // Folders come from others: a single file must not take all memory.
                check_size(&file, LARGEST_IN_FOLDER)
                    .map_err(|why| format!("{}: {why} in a folder", file.display()))?;
                files.push(Self { file, mesh: Some(mesh.clone()), ..self.clone() });
            } else if file != path {
                let name = file.file_name().unwrap_or_default().to_string_lossy();
                skipped.push(shortened(&name));
            }
        }
        // The order of a directory differs between systems.
        files.sort_by(|a, b| a.file.cmp(&b.file));
        skipped.sort();
        if let Some(name) = claims.seconds.keys().find(|name| !stems.contains(*name)) {
            let (path, name) = (path.display(), quoted(name));
            return Err(format!("{path}: seconds of {name}: no file with this name in the folder"));
        }
        if files.is_empty() {
            let known = meshes.join(", ");
            return Err(format!(
                "{}: no file MESH.ma or MESH-COUNT.ma for a mesh of the study ({known})",
                folder.display()
            ));
        }
        Ok(Folder { files, claims, skipped })
    }
}

medial::parameters! {
    /// Parameters of the pseudo-method.
    #[derive(Clone, Debug)]
    pub struct ExternalParams {
        /// The medial mesh.
        file: PathBuf = PathBuf::new(), "path";
        /// Conversion of units.
        fit: FitBy = FitBy::None, "none, similarity or auto";
        /// Origin of the radii.
        radii: RadiiFrom = RadiiFrom::File, "file or surface";
        /// Counts of the header may be wrong.
        lenient: bool = false, "true or false";
        /// Number of the medial mesh in a file with several, from 1.
        block: Option<usize> = None, "number";
        /// Full name of the method, as claimed.
        title: String = String::new(), "text";
        /// Who computed the results, as claimed.
        authors: String = String::new(), "text";
        /// Source of the method, as claimed.
        citation: String = String::new(), "text";
        /// The source as BibTeX, as claimed.
        bibtex: String = String::new(), "text";
        /// How it was run, as claimed.
        run: String = String::new(), "text";
        /// The machine of the seconds, as claimed.
        machine: String = String::new(), "text";
        /// Seconds as claimed.
        claimed_seconds: Option<f64> = None, "seconds";
    }
}

/// SHA-256 of the file that some parameters name; `None` where it cannot be read.
pub fn fingerprint(params: &Params) -> Option<String> {
    let file = params.0.get("file")?.as_str()?;
    read_regular(file).ok().map(|bytes| hex_digest(&bytes))
}

/// The pseudo-method.
pub fn method() -> Method<ExternalParams> {
    let info = MethodInfo::new(GIVEN, "A file of another program")
        .summary(
            "An external result: a medial mesh from a file, evaluated like the results of methods.",
        )
        .published("the file as it is")
        .params(ExternalParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(
    shape: &'s Shape,
    params: ExternalParams,
    _run: &RunContext,
) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
    let ExternalParams { file, fit, radii, lenient, block, claimed_seconds, .. } = params;
    let options = AxisOptions { lenient, block, radii, fit };
    let read = read_axis(&file, shape, options);
    let (loaded, _) = read.map_err(|error| SimplifyError::Parameter(error.to_string()))?;
    // Notes of the reader belong to the result, since they affect its numbers.
    let (mesh, remarks) = loaded.with_remarks();
    let units = *shape.normalisation();
    let mesh = mesh.to_normal(&units);
    Ok(Box::new(move |level: Level| {
        let spheres = mesh.spheres.len();
        match level {
            Level::Published => {}
            Level::Spheres(count) if is_near(spheres, count) => {}
            _ => {
                let why = format!("the file has only the level of {spheres} spheres");
                return Err(SimplifyError::unsupported(why));
            }
        }
        // The same for every level that is accepted: a file has one.
        let mut simplified = Simplified::new(mesh.clone(), level);
        remarks.iter().for_each(|remark| simplified.diagnostics.warn(remark.clone()));
        if claimed_seconds.is_some() {
            let claimed = OwnSeconds { prepare: None, simplify: claimed_seconds };
            simplified.extras.insert(claimed);
        }
        Ok(simplified)
    }))
}

/// A file that was read.
pub(crate) struct ExternalFile {
    /// Name of the mesh in tables.
    pub mesh: String,
    /// Name of the method in tables.
    name: String,
    /// Those of [`ExternalParams`] that are not the default.
    params: Params,
    /// SHA-256 of its bytes.
    hash: String,
    /// Requested number of spheres, which the result has to within 2 %.
    spheres: usize,
}

impl Study {
    /// The external results with their meshes, among the names of all meshes, and a remark on each folder of results with
    /// files that are no results on these meshes.
    ///
    /// # Errors
    /// For a file that cannot be read or belongs to no mesh, and for two of one name.
    pub(crate) fn external_files(
        &self,
        meshes: &[String],
    ) -> Result<(Vec<ExternalFile>, Vec<String>), Failure> {
        /// Names that a remark lists.
        const LISTED: usize = 10;
        let (mut files, mut remarks): (Vec<ExternalFile>, _) = (Vec::new(), Vec::new());
        let mut all: Vec<(ExternalResult, Claims)> = Vec::new();
        for given in &self.given {
            let folder = self.resolved(&given.file);
            if !folder.is_dir() {
                all.push((given.clone(), Claims::default()));
                continue;
            }
            let Folder { files, claims, mut skipped } =
                given.in_folder(&folder, meshes).map_err(|why| given.refused(why))?;
            all.extend(files.into_iter().map(|given| (given, claims.clone())));
            let more = if skipped.len() > LISTED { ", ..." } else { "" };
            skipped.truncate(LISTED);
            if !skipped.is_empty() {
                remarks.push(format!(
                    "{}: skipped files that are no result of a mesh of the study in a known format ({}{more})",
                    folder.display(),
                    skipped.join(", ")
                ));
            }
        }
        // By name, mesh and count: several counts of one method are one curve.
        for (given, claims) in all {
            let mesh = mesh_of(&given, meshes)?;
            let file = self.read_result(given, claims, mesh)?;
            let ExternalFile { name, mesh, spheres, .. } = &file;
            let is_method = self.methods.iter().any(|method| method.name.as_ref() == Some(name));
            let is_file = files
                .iter()
                .any(|other| (&other.mesh, &other.name, &other.spheres) == (mesh, name, spheres));
            if is_method || is_file {
                let message =
                    format!("{mesh}, {spheres} spheres: two results named `{name}`; rename one");
                return Err(Failure::usage(message));
            }
            files.push(file);
        }
        Ok((files, remarks))
    }

    fn read_result(
        &self,
        given: ExternalResult,
        claims: Claims,
        mesh: String,
    ) -> Result<ExternalFile, Failure> {
        let path = self.resolved(&given.file);
        // The worker that reads it has another working folder.
        let path = std::path::absolute(&path).unwrap_or(path);
        // One read: the hash is that of the bytes whose spheres are counted.
        let bytes = content(&path).map_err(|error| given.refused(error))?;
        let ExternalResult { fit, radii, lenient, block, .. } = given;
        let options = AxisOptions { lenient, block, radii, fit }.read_options();
        let loaded = read_external(&path, &bytes, options).map_err(|why| given.refused(why))?;
        let spheres = loaded.mesh.spheres.len();
        if spheres == 0 {
            return Err(given.refused(format!("{}: no sphere", path.display())));
        }
        let Claims { title, authors, citation, bibtex, run, machine, seconds } = claims;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        // The count in the name, if it is as near as the results of methods must be.
        let named = stem.rsplit_once('-').and_then(|(_, count)| count.parse().ok());
        let spheres = named.filter(|&count| is_near(spheres, count)).unwrap_or(spheres);
        let params = json!({
            "file": path.to_string_lossy(), "fit": fit, "radii": radii, "lenient": lenient, "block": block,
            "title": title, "authors": authors, "citation": citation, "bibtex": bibtex, "run": run,
            "machine": machine, "claimed_seconds": seconds.get(&*stem),
        });
        let mut params: Params = serde_json::from_value(params).expect("an object");
        params.0.retain(|_, value| ![json!(null), json!(false), json!("")].contains(value));
        Ok(ExternalFile { mesh, name: given.name, params, hash: hex_digest(&bytes), spheres })
    }

    /// The numbers of spheres of the external results, descending.
    ///
    /// # Errors
    /// For a file that cannot be read.
    pub fn external_counts(&self) -> Result<Vec<usize>, Failure> {
        let (files, _) = self.external_files(&unique_names(&self.sources()?))?;
        let mut counts: Vec<usize> = files.iter().map(|file| file.spheres).collect();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        counts.dedup();
        Ok(counts)
    }

    /// The item that evaluates an external result.
    pub(crate) fn external_item(
        &self,
        scene: SceneSpec,
        file: &ExternalFile,
        here: &Provenance,
    ) -> Item {
        let method = MethodSpec {
            id: GIVEN.to_owned(),
            name: Some(file.name.clone()),
            params: file.params.clone(),
            fingerprint: Some(file.hash.clone()),
        };
        // The program that measures it; its own hash is the fingerprint.
        let judge = format!("{} {}", medial::SOURCE_HASH, medial::geometry::SOURCE_HASH);
        let (levels, version) = (vec![Target::Spheres(file.spheres)], hex_digest(judge.as_bytes()));
        Item { repeat: 1, ..self.item(scene, method, levels, version, here) }
    }
}

/// The mesh that a file belongs to.
fn mesh_of(given: &ExternalResult, meshes: &[String]) -> Result<String, Failure> {
    let name = &given.name;
    let message = match (&given.mesh, meshes) {
        (Some(mesh), _) if meshes.contains(mesh) => return Ok(mesh.clone()),
        (Some(mesh), _) => {
            let (mesh, known) = (shortened(mesh), meshes.join(", "));
            format!("given `{name}`: unknown mesh `{mesh}` (expected one of: {known})")
        }
        (None, [mesh]) => return Ok(mesh.clone()),
        (None, _) => format!(
            "given `{name}`: no mesh named (found {} meshes); write --given {name}@{}={}",
            meshes.len(),
            meshes.first().map_or("MESH", String::as_str),
            given.file.display()
        ),
    };
    Err(Failure::usage(message))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_names_the_method_the_mesh_and_the_file() {
        let given = ExternalResult::parse("Q-MAT, authors@bear=out/x=1.ma").expect("a result");
        assert_eq!((given.name.as_str(), given.mesh.as_deref()), ("Q-MAT, authors", Some("bear")));
        assert_eq!(given.file, PathBuf::from("out/x=1.ma"));
        assert_eq!(ExternalResult::parse("a=b.ma").expect("both").mesh, None);
        for wrong in ["a", "=b.ma", "a=", "a@=b.ma", " @x=b.ma"] {
            assert!(ExternalResult::parse(wrong).is_err(), "{wrong}");
        }
    }
}
