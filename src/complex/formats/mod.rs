//! Files that hold a medial mesh.
//!
//! | extension | read | written | holds |
//! |---|---|---|---|
//! | `.ma` | yes | yes | spheres, edges, faces: the interchange format of the field, in all its dialects |
//! | `.ma_dup` | yes | no | the same |
//! | `.sph` | yes | no | the same, lists of spheres, and the deepest level of a tree of spheres |
//! | `.txt`, `.xyzr` | yes | rows `x y z r` | the same; written for granular simulations |
//! | `.csv`, `.json`, `.yaml`, `.yml`, `.xrdf`, `.urdf`, `.xml` | yes | yes | spheres alone, of one link of a robot |
//! | `.ply` | yes | text | the same, with a vertex property `radius`, for viewers |
//! | `.obj` | yes | yes | centres, edges (`l`) and faces (`f`); read with radii as fourth numbers (`v x y z r`), written without, for viewers |
//! | `.vtp` | no | base64 | the same as `.ma` and a value at each sphere, for ParaView |
//! | `.glb` | no | yes | the same in single precision, coloured, and the spheres as bodies, for Blender and browsers |
//!
//! Coordinates are read and written in the unit of the file; the caller normalises. Numbers are written with 17
//! significant digits or as they are in memory, so that they are read back bit for bit.

mod glb;
mod ma;
mod spheres;
mod viewers;

use std::fmt;
use std::io;
use std::path::Path;

pub use glb::single_precision_loss;
pub use ma::{parse_ma, parse_obj};
pub use spheres::{holds_spheres_alone, left_out};
pub use viewers::{Look, SphereValues, parse_ply};

use super::{ComplexError, MedialMesh};
use crate::surface::check_encoding;
use crate::{read_regular, write_atomically};

/// A medial mesh from a file, in canonical form, and the changes that this took.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedMa {
    /// The medial mesh, in the file's unit.
    pub mesh: MedialMesh,
    /// One sentence for each change: added edges, dropped repetitions, deleted elements.
    /// Empty for a file that this crate wrote.
    pub notes: Vec<String>,
    /// One sentence for each doubt: words that could be read in more than one way.
    pub warnings: Vec<String>,
}

impl LoadedMa {
    /// The mesh, and its notes and warnings in one list.
    pub fn with_remarks(self) -> (MedialMesh, Vec<String>) {
        let mut remarks = self.notes;
        remarks.extend(self.warnings);
        (self.mesh, remarks)
    }
}

/// How to read files that contradict their header, or hold more or less than one medial mesh.
///
/// ```
/// use medial::complex::{ReadOptions, parse_ma};
///
/// let short = "3 0 0\nv 0 0 0 1\nv 1 0 0 1\n";
/// assert!(parse_ma(short, "short.ma", ReadOptions::default()).is_err());
/// let lenient = ReadOptions { lenient: true, ..ReadOptions::default() };
/// let loaded = parse_ma(short, "short.ma", lenient)?;
/// assert_eq!((loaded.mesh.spheres.len(), loaded.warnings.len()), (2, 1));
/// # Ok::<(), medial::complex::MaError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Takes the lines as they are where the header announces another number of them, with a warning.
    pub lenient: bool,
    /// Which medial mesh of a file with several appended ones, or link of a robot, from 1. Without it such a file is
    /// rejected.
    pub block: Option<usize>,
    /// Whether the radii of the file are wanted.
    pub radii: Radii,
}

/// Whether the radii of a file are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Radii {
    /// A file without radii is rejected. Negative radii, which some tools write, become their absolute values, with a
    /// warning.
    #[default]
    Needed,
    /// A negative radius is rejected, too: for plug-ins, whose mistakes must show.
    NotNegative,
    /// The caller has radii: files of points are accepted, and the values in the place of radii (0 where there are none)
    /// mean nothing.
    NotNeeded,
}

/// Why a file could not be read or written as a medial mesh: the file, the line, the reason.
#[derive(Debug, thiserror::Error)]
#[error("{file}{}: {kind}", line.map_or(String::new(), |line| format!(", line {line}")))]
pub struct MaError {
    /// The file's name as it was given.
    pub file: String,
    /// Line number from 1, where the reason belongs to a line.
    pub line: Option<usize>,
    /// The reason.
    pub kind: MaErrorKind,
}

impl MaError {
    /// A reason that belongs to no line of the file `name`.
    fn of(name: impl fmt::Display, kind: impl Into<MaErrorKind>) -> Self {
        Self { file: name.to_string(), line: None, kind: kind.into() }
    }
}

/// The defect, without the place.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MaErrorKind {
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The format cannot hold this mesh or these values.
    #[error("{0}")]
    Unwritable(String),
    /// The mesh to be written is not in canonical form.
    #[error("the medial mesh is not valid: {0}")]
    Mesh(#[from] ComplexError),
    /// The extension or the text is none of a medial mesh, or not as the options demand.
    #[error("{0}")]
    Malformed(String),
    /// Every radius is 0.
    #[error("every radius is 0: a surface or a set of points, no medial mesh")]
    Points,
}

/// Extensions of the files that [`read`] reads.
pub const READABLE: [&str; 14] = [
    "ma", "ma_dup", "sph", "txt", "xyzr", "ply", "obj", "csv", "json", "yaml", "yml", "xrdf",
    "urdf", "xml",
];

/// Extensions of the files that [`write()`] writes.
pub const WRITABLE: [&str; 14] = [
    "ma", "ply", "obj", "vtp", "glb", "csv", "json", "yaml", "yml", "xrdf", "urdf", "xml", "txt",
    "xyzr",
];

/// Reads a medial mesh from a `.ma` file, a list of spheres, a `.ply` file or an `.obj` file with radii. The
/// extension decides.
///
/// # Errors
/// When the file cannot be read, has another extension, or does not hold a medial mesh; the error
/// names the file and the line.
pub fn read(path: impl AsRef<Path>) -> Result<LoadedMa, MaError> {
    read_with(path, ReadOptions::default())
}

/// [`read`] for files that contradict their header, hold several medial meshes, or no radii.
///
/// # Errors
/// As [`read`], with options.
pub fn read_with(path: impl AsRef<Path>, options: ReadOptions) -> Result<LoadedMa, MaError> {
    let path = path.as_ref();
    parser(path)?;
    let bytes = read_regular(path).map_err(|error| MaError::of(path.display(), error))?;
    read_content(path, &bytes, options)
}

/// [`read_with`] for the bytes of the file `path`, which is not opened.
///
/// # Errors
/// As [`read_with`].
pub fn read_content(
    path: impl AsRef<Path>,
    bytes: &[u8],
    options: ReadOptions,
) -> Result<LoadedMa, MaError> {
    let path = path.as_ref();
    // Editors of some systems write a byte-order mark.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let name = path.display().to_string();
    let refused = |why: &str| MaError::of(&name, MaErrorKind::Malformed(why.to_owned()));
    check_encoding(bytes).map_err(refused)?;
    parser(path)?(bytes, &name, options)
}

type Parser<'a> = fn(&'a [u8], &str, ReadOptions) -> Result<LoadedMa, MaError>;

fn parser<'a>(path: &Path) -> Result<Parser<'a>, MaError> {
    match extension(path).as_str() {
        "ma" | "ma_dup" => Ok(parse_ma),
        "sph" => Ok(spheres::parse_tree),
        "txt" | "xyzr" => Ok(spheres::parse_clump),
        "ply" => Ok(parse_ply),
        "obj" => Ok(parse_obj),
        "csv" => Ok(spheres::parse_rows),
        "json" => Ok(spheres::parse_json),
        "yaml" | "yml" | "xrdf" => Ok(spheres::parse_yaml),
        "urdf" | "xml" => Ok(spheres::parse_xml),
        other => {
            let known = READABLE.join(", .");
            let why = format!("the extension {other:?} is not one of .{known}");
            Err(MaError::of(path.display(), MaErrorKind::Malformed(why)))
        }
    }
}

/// Writes a medial mesh as `.ma`, `.ply`, `.obj`, `.vtp` or `.glb`, or its spheres alone in the other formats of
/// [`WRITABLE`]. The extension decides.
///
/// The file appears under its name only when it is complete: it is written next to the target
/// and renamed. Contact points are not part of any of these formats.
///
/// # Errors
/// When the extension is another one, the mesh is not in canonical form, or writing fails.
pub fn write(path: impl AsRef<Path>, mesh: &MedialMesh) -> Result<(), MaError> {
    write_with(path, mesh, &Look::default())
}

/// [`write()`] with values at the spheres, for the formats of viewers that hold them.
///
/// ```no_run
/// use medial::complex::{Look, SphereValues, read, write_with};
///
/// let mesh = read("bunny.ma")?.mesh;
/// let values = Some(SphereValues::stability(&mesh, 1.0));
/// write_with("bunny.glb", &mesh, &Look { values, balls: true })?;
/// # Ok::<(), medial::complex::MaError>(())
/// ```
///
/// # Errors
/// As [`write()`]; when the format cannot hold the values or bodies; and `.glb` for a mesh without spheres,
/// numbers beyond single precision, or more than 4 GB.
///
/// # Panics
/// If the values are not one for each sphere.
pub fn write_with(path: impl AsRef<Path>, mesh: &MedialMesh, look: &Look) -> Result<(), MaError> {
    let path = path.as_ref();
    if let Some(SphereValues { values, .. }) = &look.values {
        assert_eq!(values.len(), mesh.spheres.len(), "a value for each sphere");
    }
    write_as(&extension(path), path, mesh, look).map_err(|kind| MaError::of(path.display(), kind))
}

fn write_as(
    extension: &str,
    path: &Path,
    mesh: &MedialMesh,
    look: &Look,
) -> Result<(), MaErrorKind> {
    if !WRITABLE.contains(&extension) {
        let why = format!("the extension {extension:?} is not one of .{}", WRITABLE.join(", ."));
        return Err(MaErrorKind::Unwritable(why));
    }
    let lacks = match extension {
        "glb" => None,
        _ if look.balls => Some("spheres as bodies; write .glb"),
        "vtp" => None,
        _ => look.values.as_ref().map(|_| "values; write .vtp or .glb"),
    };
    if let Some(lacks) = lacks {
        return Err(MaErrorKind::Unwritable(format!("{extension:?} files hold no {lacks}")));
    }
    mesh.check()?;
    match extension {
        "ma" => write_atomically(path, |out| ma::write_ma(out, mesh))?,
        "ply" => write_atomically(path, |out| viewers::write_ply(out, mesh))?,
        "obj" => write_atomically(path, |out| viewers::write_obj(out, mesh))?,
        "vtp" => write_atomically(path, |out| viewers::write_vtp(out, mesh, look))?,
        "glb" => {
            let bytes = glb::file(mesh, look).map_err(MaErrorKind::Unwritable)?;
            write_atomically(path, |out| out.write_all(&bytes))?;
        }
        _ if mesh.spheres.is_empty() => {
            return Err(MaErrorKind::Unwritable("no sphere to write".to_owned()));
        }
        _ => write_atomically(path, |out| spheres::write_spheres(out, path, mesh))?,
    }
    Ok(())
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

#[cfg(test)]
mod tests;
