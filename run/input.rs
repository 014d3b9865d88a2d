//! Surfaces that a user names: files, meshes of the library, built-in shapes.

use std::path::{Component, Path, PathBuf};
use std::{fmt, fs, io};

use medial::complex::MedialMesh;
use medial::shape::{Shape, ShapeError, ShapeOptions};
use medial::surface::{self, SurfaceReport, TriMesh};
use medial_datasets::BuiltIn;
use serde::{Deserialize, Serialize};

use crate::error::InputError;
use crate::hash::hex_digest;
use crate::library::{Cached, Library};
use crate::text::did_you_mean;

/// Origin of a mesh.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// A surface file.
    File(PathBuf),
    /// A built-in shape at its default or a chosen resolution.
    BuiltIn {
        /// Id in the catalogue.
        id: String,
        /// Resolution; its meaning depends on the shape.
        resolution: Option<u32>,
    },
    /// A mesh of the library.
    Cached(Cached),
}

/// Prefix of the names of built-in shapes.
const BUILT_IN: &str = "builtin:";
/// A part with edges, a loop, a smooth body with limbs.
const EXAMPLES: [&str; 3] = ["bracket", "torus", "blob"];
/// Prefix of the names of meshes of the library.
const DATASET: &str = "dataset:";

impl Source {
    /// Whether an argument is a name rather than a path.
    pub fn is_name(argument: &Path) -> bool {
        let text = argument.to_string_lossy();
        text.starts_with(BUILT_IN) || text.starts_with(DATASET)
    }

    /// The file, where it is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) | Self::Cached(Cached { path, .. }) => Some(path),
            Self::BuiltIn { .. } => None,
        }
    }

    /// Reads an argument: `builtin:ID` or `builtin:ID:RESOLUTION`, `dataset:NAME`, else a path.
    ///
    /// # Errors
    /// When the resolution is not a number, or the library has no such mesh.
    pub fn parse(argument: &Path) -> Result<Self, InputError> {
        if let Some(name) = argument.to_str().and_then(|text| text.strip_prefix(DATASET)) {
            return Ok(Self::Cached(Library::here()?.mesh(name)?));
        }
        let Some(spec) = argument.to_str().and_then(|text| text.strip_prefix(BUILT_IN)) else {
            return Ok(Self::File(argument.to_owned()));
        };
        let (id, resolution) = match spec.split_once(':') {
            None => (spec, None),
            Some((id, text)) => {
                // Anything behind the second colon: a typing error must not become the default.
                let resolution = text.parse().map_err(|_| {
                    InputError::option(format!(
                        "wrong resolution `{text}`; write builtin:ID:NUMBER"
                    ))
                })?;
                (id, Some(resolution))
            }
        };
        Ok(Self::BuiltIn { id: id.to_owned(), resolution })
    }

    /// Refuses missing and unreadable files, unknown shapes and resolutions out of range, before any run.
    ///
    /// # Errors
    /// The error names the input.
    pub fn check(&self) -> Result<(), InputError> {
        match self {
            Self::File(path) | Self::Cached(Cached { path, .. }) => {
                let failed = |error: io::Error| {
                    InputError::file(path, format!("{error}{}", meant_shape(path)))
                };
                let kind = fs::metadata(path).map_err(failed)?;
                // Opening a pipe or a device could wait for ever.
                if !kind.is_file() {
                    return Err(failed(io::Error::other("not a regular file")));
                }
                fs::File::open(path).map(|_| ()).map_err(failed)
            }
            Self::BuiltIn { id, resolution } => built_in(id, *resolution).map(|_| ()),
        }
    }

    /// Refuses a surface file that bounds a solid only after changes.
    ///
    /// # Errors
    /// The error names the file and its defect.
    pub fn check_as_is(&self) -> Result<(), InputError> {
        match self.path() {
            Some(path) => Ok(surface::inspect(path)?.as_is().map(|_| ())?),
            None => Ok(()),
        }
    }

    /// The default meshes of a comparison: few built-in shapes, so that it ends soon, on which methods differ.
    pub fn examples() -> Vec<Self> {
        EXAMPLES.map(|id| Self::BuiltIn { id: id.into(), resolution: None }).into()
    }

    /// The set `builtin`: built-in shapes at their default resolutions, in the order of the catalogue.
    fn built_ins() -> Vec<Self> {
        let shapes = medial_datasets::catalogue();
        shapes
            .iter()
            .filter(|shape| shape.in_default)
            .map(|shape| Self::BuiltIn { id: shape.id.into(), resolution: None })
            .collect()
    }

    /// The inputs of a word of `--dataset`: the set `builtin`, a built-in shape, or meshes of the library.
    ///
    /// # Errors
    /// For an unknown name, or a mesh that was not fetched.
    pub fn set(word: &str) -> Result<Vec<Self>, InputError> {
        if word == "builtin" {
            return Ok(Self::built_ins());
        }
        if medial_datasets::find(word).is_some() {
            return Ok(vec![Self::BuiltIn { id: word.to_owned(), resolution: None }]);
        }
        Ok(Library::here()?.meshes(word)?.into_iter().map(Self::Cached).collect())
    }

    /// Name for tables: the file's stem, the name in the library, or the id of the built-in shape.
    pub fn name(&self) -> String {
        match self {
            Self::File(path) => path
                .file_stem()
                .map_or_else(|| path.display().to_string(), |stem| stem.to_string_lossy().into()),
            Self::Cached(Cached { name, .. }) => name.clone(),
            Self::BuiltIn { id, resolution: None } => id.clone(),
            Self::BuiltIn { id, resolution: Some(resolution) } => format!("{id}-{resolution}"),
        }
    }

    /// The set of the mesh, if any.
    pub fn dataset(&self) -> Option<&str> {
        match self {
            Self::File(_) => None,
            Self::Cached(Cached { set, .. }) => Some(set),
            Self::BuiltIn { .. } => Some("builtin"),
        }
    }

    /// A longer name where [`Source::name`] is not unique: with the extension (depth 1), and with
    /// the folder that holds the file (depth 2). Names of built-in and library meshes stay the same.
    pub fn long_name(&self, depth: usize) -> String {
        let Self::File(path) = self else { return self.to_string() };
        let parts: Vec<_> = path
            .components()
            .filter_map(|part| match part {
                Component::Normal(name) => Some(name.to_string_lossy()),
                _ => None,
            })
            .collect();
        parts[parts.len().saturating_sub(depth)..].join("/")
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Cached(Cached { name, .. }) => write!(f, "{DATASET}{name}"),
            Self::BuiltIn { id, resolution: None } => write!(f, "builtin:{id}"),
            Self::BuiltIn { id, resolution: Some(r) } => write!(f, "builtin:{id}:{r}"),
        }
    }
}

/// A mesh that was read and checked, or generated.
pub struct Input {
    /// Name for tables.
    pub name: String,
    /// SHA-256 of the file, or of the generated surface.
    pub hash: String,
    /// The surface, in input units.
    pub mesh: TriMesh,
    /// Defects and repairs.
    pub report: SurfaceReport,
    /// The exactly known medial axis, in input units.
    pub axis: Option<MedialMesh>,
}

impl Input {
    /// Reads or generates a mesh.
    ///
    /// # Errors
    /// When the file cannot be read or is refused, or no such built-in shape exists.
    pub fn load(source: &Source) -> Result<Self, InputError> {
        match source {
            Source::File(path) | Source::Cached(Cached { path, .. }) => {
                // One read: the hash is that of the bytes that were parsed.
                let bytes = surface::content(path)?;
                let loaded = surface::inspect_bytes(path, &bytes)?.solid()?;
                Ok(Self {
                    name: source.name(),
                    hash: hex_digest(&bytes),
                    mesh: loaded.mesh,
                    report: loaded.report,
                    axis: None,
                })
            }
            Source::BuiltIn { id, resolution } => {
                let (shape, resolution) = built_in(id, *resolution)?;
                let mesh = shape.mesh(resolution);
                let report = surface::validate(&mesh)?;
                let axis = shape.axis().map(|axis| axis.mesh);
                let coordinates = mesh.vertices.iter().flat_map(|v| v.to_array());
                let indices = mesh.faces.iter().flatten().flat_map(|i| i.to_le_bytes());
                // Records hold distances to the known axis: a corrected axis is another input.
                let spheres = axis.iter().flat_map(|axis| &axis.spheres);
                let known = spheres.flat_map(|s| [s.centre.x, s.centre.y, s.centre.z, s.radius]);
                let bytes = coordinates.flat_map(f64::to_le_bytes).chain(indices);
                let bytes: Vec<u8> = bytes.chain(known.flat_map(f64::to_le_bytes)).collect();
                let hash = hex_digest(&bytes);
                Ok(Self { name: source.name(), hash, mesh, report, axis })
            }
        }
    }

    /// The normalised shape, without substrates.
    ///
    /// # Errors
    /// When the surface has no extent.
    pub fn shape(&self, options: ShapeOptions) -> Result<Shape, ShapeError> {
        Shape::new(self.name.clone(), &self.mesh, self.report.clone(), options)
    }
}

/// A built-in shape and its resolution, by default that of the shape.
fn built_in(
    id: &str,
    resolution: Option<u32>,
) -> Result<(medial_datasets::BuiltIn, u32), InputError> {
    let shape = medial_datasets::find(id).ok_or_else(|| {
        let ids = medial_datasets::catalogue().into_iter().map(|shape| shape.id);
        let meant = did_you_mean(id, ids.collect::<Vec<_>>());
        InputError::option(format!(
            "unknown built-in shape `{id}`{meant}; list all names by `medial datasets list`"
        ))
    })?;
    let resolution = resolution.unwrap_or(shape.default_resolution);
    let range = shape.resolutions();
    if !range.contains(&resolution) {
        let (least, most) = (range.start(), range.end());
        return Err(InputError::option(format!(
            "builtin:{id}: wrong resolution (found {resolution}, expected {least} to {most})"
        )));
    }
    // Estimated, because generating the mesh would take too long.
    let vertices = estimated_vertices(&shape, resolution);
    if vertices > MAX_VERTICES {
        return Err(InputError::option(format!(
            "builtin:{id}: resolution {resolution} is too fine (about {vertices:.1e} vertices, at most \
             {MAX_VERTICES:.0e})"
        )));
    }
    Ok((shape, resolution))
}

/// Built-in shapes of more vertices take hours in most verbs and are rejected as implausible.
const MAX_VERTICES: f64 = 2e6;

/// The number of vertices grows with the square of the resolution.
fn estimated_vertices(shape: &BuiltIn, resolution: u32) -> f64 {
    let times = f64::from(resolution) / f64::from(shape.default_resolution);
    if times <= 1.0 {
        return 0.0;
    }
    shape.mesh(shape.default_resolution).vertices.len() as f64 * times * times
}

/// A hint for a missing file with the name of a built-in shape.
fn meant_shape(path: &Path) -> String {
    let id = path.file_name().and_then(|name| medial_datasets::find(name.to_str()?));
    id.map_or(String::new(), |shape| format!("; the built-in shape is `builtin:{}`", shape.id))
}
