//! External results: files and folders of a user as results of a named method.
//!
//! A file is a pseudo-method: it has one result with its number of spheres on its mesh, evaluated like all others.
//! A folder holds `MESH.ma` or `MESH-COUNT.ma`, or another format, for the meshes of the study, and may hold
//! `method.toml` with the claims of its authors. Folders come from others: links that lead out of them are refused.
//! A surface instead of a medial mesh is the decimation baseline. Everything but the claimed seconds is measured here.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::{fs, io};

use clap::{Args, ValueEnum};
use medial::complex::{LoadedMa, MedialMesh, Radii, ReadOptions, Sphere};
use medial::shape::{Fit, Shape, ShapeError};
use medial::simplifier::{
    Level, Method, MethodInfo, ParamFields, Params, RunContext, Simplification, Simplified,
    SimplifyError,
};
use medial::surface::Side;
use medial::{complex, quoted, read_regular, read_regular_text, shortened, surface};
use medial_reports::{COUNT_TOLERANCE, Target, significant};
use serde::{Deserialize, Serialize};

use crate::plugin::{OwnSeconds, reach};
use crate::provenance::{Provenance, hex_digest};
use crate::study::item::{Item, MethodSpec, SceneSpec};
use crate::study::{Study, StudyError, parse_toml};

/// Id of the pseudo-method.
pub const GIVEN: &str = "given";

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
            return Some(format!(
                "seconds of {}: {value} is no time (expected a number from 0)",
                quoted(name)
            ));
        }
        let entry = self.bibtex.trim();
        // The depth of braces is 0 again at the last one alone: a second entry follows no other.
        let mut depth = 0_usize;
        let end = entry.char_indices().find(|&(_, c)| {
            depth = if c == '{' { depth + 1 } else { depth - usize::from(c == '}' && depth > 0) };
            c == '}' && depth == 0
        });
        let is_entry = entry.starts_with('@') && end.is_some_and(|(at, _)| at + 1 == entry.len());
        (!entry.is_empty() && !is_entry)
            .then(|| "bibtex: expected one entry @type{key, ...} with balanced braces".to_owned())
    }
}

/// Name of the file with [`Claims`].
const CLAIMS: &str = "method.toml";
/// Most bytes of it, of a result in its folder, and of one that is named by itself; larger files are refused unread.
const LARGEST_CLAIMS: u64 = 100_000;
const LARGEST_IN_FOLDER: u64 = 4_000_000;
const LARGEST_RESULT: u64 = 200_000_000;
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
    fn refused(&self, why: impl Display) -> StudyError {
        StudyError::Value(format!("given `{}`: {why}", self.name))
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
        let (mut files, mut skipped) = (Vec::new(), Vec::new());
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
        #[serde(skip_serializing_if = "std::ops::Not::not")]
        lenient: bool = false, "true or false";
        /// Number of the medial mesh in a file with several, from 1.
        #[serde(skip_serializing_if = "Option::is_none")]
        block: Option<usize> = None, "number";
        /// Full name of the method, as claimed.
        #[serde(skip_serializing_if = "String::is_empty")]
        title: String = String::new(), "text";
        /// Who computed the results, as claimed.
        #[serde(skip_serializing_if = "String::is_empty")]
        authors: String = String::new(), "text";
        /// Source of the method, as claimed.
        #[serde(skip_serializing_if = "String::is_empty")]
        citation: String = String::new(), "text";
        /// The source as BibTeX, as claimed.
        #[serde(skip_serializing_if = "String::is_empty")]
        bibtex: String = String::new(), "text";
        /// How it was run, as claimed.
        #[serde(skip_serializing_if = "String::is_empty")]
        run: String = String::new(), "text";
        /// The machine of the seconds, as claimed.
        #[serde(skip_serializing_if = "String::is_empty")]
        machine: String = String::new(), "text";
        /// Seconds as claimed.
        #[serde(skip_serializing_if = "Option::is_none")]
        claimed_seconds: Option<f64> = None, "seconds";
        /// Further names of external results with the same bytes.
        #[serde(skip_serializing_if = "String::is_empty")]
        same_as: String = String::new(), "names";
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
    let ExternalParams { file, same_as, fit, radii, lenient, block, claimed_seconds, .. } = params;
    let options = AxisOptions { lenient, block, radii, fit };
    let read = read_axis(&file, shape, options);
    let (loaded, _) = read.map_err(|error| SimplifyError::Parameter(error.to_string()))?;
    // Notes of the reader belong to the result, since they affect its numbers.
    let (mesh, mut remarks) = loaded.with_remarks();
    if !same_as.is_empty() {
        remarks.push(format!("has the same bytes as {same_as}"));
    }
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
    params: ExternalParams,
    /// SHA-256 of its bytes.
    hash: String,
    /// Requested number of spheres, which the result has to within 2 %.
    spheres: usize,
}

/// Whether a result counts as one with a requested number of spheres.
fn is_near(spheres: usize, requested: usize) -> bool {
    spheres.abs_diff(requested) as f64 <= COUNT_TOLERANCE * requested as f64
}

impl Study {
    /// The external results with their meshes, among the names of all meshes.
    ///
    /// # Errors
    /// [`StudyError::Value`] for a file that cannot be read or belongs to no mesh, and for two of one name.
    pub(crate) fn external_files(
        &self,
        meshes: &[String],
    ) -> Result<Vec<ExternalFile>, StudyError> {
        let mut files: Vec<ExternalFile> = Vec::new();
        let mut all: Vec<(ExternalResult, Claims)> = Vec::new();
        for given in &self.given {
            let folder = self.resolved(&given.file);
            if folder.is_dir() {
                let Folder { files, claims, .. } =
                    given.in_folder(&folder, meshes).map_err(|why| given.refused(why))?;
                all.extend(files.into_iter().map(|given| (given, claims.clone())));
            } else {
                all.push((given.clone(), Claims::default()));
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
                return Err(StudyError::Value(message));
            }
            files.push(file);
        }
        for file in 0..files.len() {
            let (mesh, hash) = (&files[file].mesh, &files[file].hash);
            let others = files.iter().enumerate().filter(|&(other, _)| other != file);
            let same = others.filter(|(_, f)| f.mesh == *mesh && f.hash == *hash);
            let names: Vec<&str> = same.map(|(_, f)| f.name.as_str()).collect();
            files[file].params.same_as = names.join(", ");
        }
        Ok(files)
    }

    /// A remark on each folder of results with files that are no results on a mesh of the study.
    ///
    /// # Errors
    /// When a folder is refused.
    pub fn external_remarks(&self) -> Result<Vec<String>, StudyError> {
        /// Names that a remark lists.
        const LISTED: usize = 10;
        let mut remarks = Vec::new();
        for given in &self.given {
            let folder = self.resolved(&given.file);
            if !folder.is_dir() {
                continue;
            }
            let meshes = crate::study::unique_names(&self.sources()?);
            let found = given.in_folder(&folder, &meshes).map_err(|why| given.refused(why))?;
            let mut names = found.skipped;
            let more = if names.len() > LISTED { ", ..." } else { "" };
            names.truncate(LISTED);
            if !names.is_empty() {
                remarks.push(format!(
                    "{}: skipped files that are no result of a mesh of the study in a known format ({}{more})",
                    folder.display(),
                    names.join(", ")
                ));
            }
        }
        Ok(remarks)
    }

    fn read_result(
        &self,
        given: ExternalResult,
        claims: Claims,
        mesh: String,
    ) -> Result<ExternalFile, StudyError> {
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
        let claimed_seconds = seconds.get(&*stem).copied();
        let (file, same_as) = (path.to_string_lossy().into_owned().into(), String::new());
        let params = ExternalParams {
            file,
            fit,
            radii,
            lenient,
            block,
            title,
            authors,
            citation,
            bibtex,
            run,
            machine,
            claimed_seconds,
            same_as,
        };
        Ok(ExternalFile { mesh, name: given.name, params, hash: hex_digest(&bytes), spheres })
    }

    /// The numbers of spheres of the external results, descending.
    ///
    /// # Errors
    /// For a file that cannot be read.
    pub fn external_counts(&self) -> Result<Vec<usize>, StudyError> {
        let sources = self.sources()?;
        let files = self.external_files(&crate::study::unique_names(&sources))?;
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
        let params = serde_json::to_value(&file.params).and_then(serde_json::from_value);
        let method = MethodSpec {
            id: GIVEN.to_owned(),
            name: Some(file.name.clone()),
            params: params.expect("plain data"),
            fingerprint: Some(file.hash.clone()),
        };
        // The program that measures it; its own hash is the fingerprint.
        let judge = format!("{} {}", medial::SOURCE_HASH, medial::geometry::SOURCE_HASH);
        let (levels, version) = (vec![Target::Spheres(file.spheres)], hex_digest(judge.as_bytes()));
        Item { repeat: 1, ..self.item(scene, method, levels, version, here) }
    }
}

/// The mesh that a file belongs to.
fn mesh_of(given: &ExternalResult, meshes: &[String]) -> Result<String, StudyError> {
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
    Err(StudyError::Value(message))
}

/// Plausible extents of a medial mesh from the middle of its surface, in diagonals.
const SMALLEST: f64 = 0.01;
const LARGEST: f64 = 5.0;

/// Medians of the difference between radii and distances to the surface, as fractions of the diagonal: above the first,
/// other units are tried, and above the second, a misfit gives a warning even if no units fit.
const DOUBTFUL: f64 = 0.01;
const WRONG: f64 = 0.05;

/// A radius below this fraction of the diagonal is that of a point on the surface.
const ON_SURFACE: f64 = 1e-9;

/// Options of reading a medial mesh and fitting it to its surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Args)]
#[serde(default, deny_unknown_fields)]
pub struct AxisOptions {
    /// Read all lines of a medial mesh whose header states a different number.
    #[arg(long)]
    pub lenient: bool,
    /// Read the K-th medial mesh, or link of a robot, of a file that holds several, counted from 1.
    #[arg(long, value_name = "K")]
    pub block: Option<usize>,
    /// Read radii from the file, or compute them where it has none or other numbers instead.
    #[arg(long, value_enum, default_value_t)]
    pub radii: RadiiFrom,
    /// Convert the units of the medial mesh to those of the surface, and print the scale and shift.
    #[arg(long, value_enum, default_value_t)]
    pub fit: FitBy,
}

impl AxisOptions {
    /// The options of the reader of medial meshes.
    pub fn read_options(self) -> ReadOptions {
        let radii = match self.radii {
            RadiiFrom::File => Radii::Needed,
            RadiiFrom::Surface => Radii::NotNeeded,
        };
        ReadOptions { lenient: self.lenient, block: self.block, radii }
    }
}

/// Origin of radii.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RadiiFrom {
    /// From the file.
    #[default]
    File,
    /// The distance of each centre to the surface.
    Surface,
}

/// Conversion of units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FitBy {
    /// The file is in the units of the surface.
    #[default]
    None,
    /// Apply the uniform scale and the shift that fit the spheres to the surface.
    Similarity,
    /// As `similarity`, for files that fit only after scaling.
    Auto,
}

/// The reason for which a file has no medial mesh for a surface, with its name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct AxisError(String);

/// Reads a medial mesh of a shape in input units, and the requested change of units.
///
/// # Errors
/// When it cannot be read, has no sphere, or cannot belong to the shape.
pub fn read_axis(
    path: &Path,
    shape: &Shape,
    options: AxisOptions,
) -> Result<(LoadedMa, Option<Fit>), AxisError> {
    let named = |why: &dyn Display| AxisError(format!("{}: {why}", path.display()));
    let from_surface = options.radii == RadiiFrom::Surface;
    let bytes = content(path).map_err(AxisError)?;
    let mut loaded = read_external(path, &bytes, options.read_options()).map_err(AxisError)?;
    if loaded.mesh.spheres.is_empty() {
        return Err(named(&"no sphere"));
    }
    if from_surface {
        // The file may have any other numbers in their place.
        loaded.mesh.spheres.iter_mut().for_each(|sphere| sphere.radius = 0.0);
    }
    let reach = reach(&loaded.mesh, shape).map_err(|why| named(&why))?;
    // Without radii, distances have nothing to compare with: only scales that tools use are tried.
    let fit = match (options.fit, from_surface) {
        (FitBy::None, _) => None,
        (FitBy::Similarity, false) => Some(shape.fit(&loaded.mesh).map_err(|error| named(&error))?),
        (FitBy::Auto, false) => shape.fit_if_needed(&loaded.mesh).map_err(|error| named(&error))?,
        (FitBy::Similarity | FitBy::Auto, true) => {
            let fit = shape.fit_of_points(&loaded.mesh).map_err(|error| named(&error))?;
            Some(fit.ok_or_else(|| named(&"no fitting units found; give a file with radii"))?)
        }
    };
    if let Some(fit) = &fit {
        loaded.mesh = fit.similarity.mesh(&loaded.mesh);
        loaded.notes.push(format!("fitted: {fit}"));
    }
    if from_surface {
        take_radii(&mut loaded, shape).map_err(|why| named(&why))?;
    } else {
        let doubts =
            doubts(&loaded.mesh, shape, fit.is_some(), reach).map_err(|error| named(&error))?;
        loaded.warnings.extend(doubts.map(|doubt| format!("{}: {doubt}", path.display())));
    }
    Ok((loaded, fit))
}

/// Refuses a file by its size, before it is read.
fn check_size(path: &Path, most: u64) -> Result<(), String> {
    let bytes = fs::metadata(path).map_or(0, |file| file.len());
    let fault = format!("too large (found {bytes} bytes, expected at most {most})");
    if bytes > most { Err(fault) } else { Ok(()) }
}

/// The bytes of an external result.
fn content(path: &Path) -> Result<Vec<u8>, String> {
    check_size(path, LARGEST_RESULT).map_err(|why| format!("{}: {why}", path.display()))?;
    surface::content(path).map_err(|error| error.to_string())
}

/// Reads a medial mesh, or a surface as spheres of radius 0: the union of its slabs is the surface
/// itself. `bytes` is the content of the file `path`, which is not opened.
///
/// # Errors
/// Names the file.
fn read_external(path: &Path, bytes: &[u8], options: ReadOptions) -> Result<LoadedMa, String> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let is_surface = match extension.as_str() {
        "off" | "stl" => return read_surface(path, bytes),
        "ply" => true,
        // Read as a surface, a medial mesh without radii would have spheres of radius 0.
        "obj" => !lists_edges(bytes),
        _ => false,
    };
    // First as a medial mesh, because every medial mesh with faces would pass as a surface.
    let read = complex::read_content(path, bytes, options).map_err(|error| error.to_string());
    match read {
        // Without radii it is a surface. If it is neither, the first error is the more useful one.
        Err(why) if is_surface => read_surface(path, bytes).map_err(|_| why),
        read => read,
    }
}

fn read_surface(path: &Path, bytes: &[u8]) -> Result<LoadedMa, String> {
    let surface = surface::inspect_bytes(path, bytes).map_err(|error| error.to_string())?.mesh;
    let spheres = surface.vertices.iter().map(|&v| Sphere::new(v, 0.0)).collect();
    let mesh = MedialMesh::from_simplices(spheres, vec![], surface.faces);
    let mesh = mesh.map_err(|error| format!("{}: {error}", path.display()))?;
    let notes = vec!["read a surface as spheres of radius 0".to_owned()];
    Ok(LoadedMa { mesh, notes, warnings: Vec::new() })
}

/// Whether the lines `l` of an `.obj` file are the edges of a medial mesh: it has no face, or a line is
/// the side of a face.
// In a surface they are edges without a face, which some modellers write.
fn lists_edges(obj: &[u8]) -> bool {
    let (mut edges, mut sides) = (HashSet::new(), Vec::new());
    for line in obj.split(|&byte| byte == b'\n') {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        let keyword = words.next();
        // Texture coordinates and normals follow a slash.
        let corners = words.map_while(|word| word.split('/').next()?.parse().ok());
        let corners: Vec<u32> = corners.collect();
        // Sorted pairs: a side is the same edge in both directions.
        let pairs = corners.windows(2).map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])]);
        match keyword {
            Some("l") => edges.extend(pairs),
            Some("f") => sides.extend(pairs),
            _ => {}
        }
    }
    !edges.is_empty() && (sides.is_empty() || sides.iter().any(|side| edges.contains(side)))
}

/// Gives every sphere the distance of its centre to the surface as its radius.
fn take_radii(loaded: &mut LoadedMa, shape: &Shape) -> Result<(), String> {
    let units = shape.normalisation();
    let centres: Vec<_> = loaded.mesh.spheres.iter().map(|sphere| sphere.centre).collect();
    let radii = shape.distances(&centres).map_err(|error| error.to_string())?;
    if radii.iter().all(|&radius| radius <= ON_SURFACE * units.diagonal) {
        return Err(
            "every point is on the surface; give a medial mesh, not samples of the surface"
                .to_owned(),
        );
    }
    for (sphere, radius) in loaded.mesh.spheres.iter_mut().zip(radii) {
        sphere.radius = radius;
    }
    loaded.notes.push("computed radii as distances of the centres to the surface".to_owned());
    let normal: Vec<_> = centres.iter().map(|&centre| units.forward(centre)).collect();
    // A separate view: its substrates must not be listed as used by a method.
    let sides = shape.view().inside_test().sides(&normal);
    let outside = sides.iter().filter(|side| **side == Side::Outside).count();
    if outside > 0 {
        let all = centres.len();
        loaded.warnings.push(format!(
            "{outside} of {all} centres are outside of the surface; find other units by --fit similarity"
        ));
    }
    Ok(())
}

/// A warning for a medial mesh that probably does not belong to its surface, or has other units.
fn doubts(
    mesh: &MedialMesh,
    shape: &Shape,
    is_fitted: bool,
    reach: f64,
) -> Result<Option<String>, ShapeError> {
    // The median: a medial mesh with a few wrong spheres is still of this surface.
    let misfit = shape.misfit(mesh)?.unwrap_or_default();
    if misfit <= DOUBTFUL || covers(mesh, shape) {
        return Ok(None);
    }
    let differ = format!(
        "radii and distances to the surface differ by {} of the diagonal at the median",
        percent(misfit)
    );
    if !is_fitted {
        let fit = shape.fit(mesh)?;
        if fit.is_needed {
            let found = percent(fit.misfit.unwrap_or_default());
            return Ok(Some(format!(
                "{differ}, by {found} in other units ({}; {}); convert them by --fit similarity",
                fit.similarity, fit.source
            )));
        }
        // The middle of the surface is the origin.
        if !(SMALLEST..=LARGEST).contains(&reach) {
            return Ok(Some(format!(
                "reaches {reach:.2e} diagonals from the middle of the surface, and no scale and shift fits; check the \
                 units and the surface"
            )));
        }
    }
    Ok((misfit > WRONG)
        .then(|| format!("{differ}; check the surface, or compute radii by --radii surface")))
}

/// Whether a mesh is a list of spheres most of whose centres lie in the solid: spheres that cover it are larger than
/// the distance to its surface in any unit.
fn covers(mesh: &MedialMesh, shape: &Shape) -> bool {
    let (units, inside) = (shape.normalisation(), shape.inside_test());
    let is_within = |s: &&Sphere| inside.winding_number(units.forward(s.centre)) != Some(0);
    let within = mesh.spheres.iter().filter(is_within);
    mesh.edges.is_empty() && 2 * within.count() > mesh.spheres.len()
}

/// A fraction of the diagonal as a percentage with three significant digits.
pub fn percent(fraction: f64) -> String {
    format!("{} %", significant(100.0 * fraction, 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_obj_without_radii_is_a_surface_unless_its_lines_are_sides_of_faces() {
        let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 2\n\
                           f 1/1 3/1 2/1\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
        for (lines, is_surface) in [("", true), ("l 4 5\n", true), ("l 4 5\nl 3 1\n", false)] {
            let text = format!("{tetrahedron}{lines}");
            let read = read_external(Path::new("a.obj"), text.as_bytes(), ReadOptions::default());
            match read {
                Ok(loaded) => assert!(is_surface && loaded.mesh.faces.len() == 4, "{lines}"),
                Err(why) => assert!(!is_surface && why.contains("without radii"), "{why}"),
            }
        }
        let curve = b"v 0 0 0\nv 1 0 0\nl 1 2\n";
        let why = read_external(Path::new("a.obj"), curve, ReadOptions::default()).unwrap_err();
        assert!(why.contains("without radii"), "{why}");
    }

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
