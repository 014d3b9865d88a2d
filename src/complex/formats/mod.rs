//! Files that hold a medial mesh.
//!
//! | extension | read | written | holds |
//! |---|---|---|---|
//! | `.ma` | yes | yes | spheres, edges, faces: the interchange format of the field, in all its dialects |
//! | `.ma_dup`, `.sph`, `.txt`, `.xyzr` | yes | no | the same, and lists of spheres alone |
//! | `.ply` | ASCII | ASCII | the same, with a vertex property `radius`, for viewers |
//! | `.obj` | yes | yes | centres, edges (`l`) and faces (`f`); read with radii as fourth numbers (`v x y z r`), written without, for viewers |
//! | `.vtp` | no | base64 | the same as `.ma` and a value at each sphere, for ParaView |
//! | `.glb` | no | yes | the same in single precision, coloured, and the spheres as bodies, for Blender and browsers |
//!
//! Coordinates are read and written in the unit of the file; normalisation is up to the caller. Numbers are written
//! with 17 significant digits or as they are in memory, so that they are read back bit for bit; but for `.glb`, which
//! has single precision.

mod annotations;
mod canonical;
mod error;
mod flags;
mod glb;
mod layout;
mod lone;
mod look;
mod ma;
mod obj;
mod options;
mod ply;
mod records;
mod scan;
mod trailer;
mod vtp;

use std::fs;
use std::path::Path;

pub use annotations::{Annotations, Part, PartKind};
pub use error::{MaError, MaErrorKind};
pub use glb::single_precision_loss;
use lone::{isolated, lone_edges};
pub use look::{Look, SphereValues};
pub use ma::{parse_ma, parse_ma_with};
pub use obj::parse_obj;
pub use options::{Radii, ReadOptions};
pub use ply::{parse_ply, parse_ply_with};

use super::MedialMesh;
use crate::atomic::write_atomically;

/// A medial mesh from a file, in canonical form, and what had to be done to bring it there.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedMa {
    /// The medial mesh, in the file's unit.
    pub mesh: MedialMesh,
    /// One sentence for each thing done: added edges, dropped repetitions, deleted elements.
    /// Empty for a file that this crate wrote.
    pub notes: Vec<String>,
    /// One sentence for each doubt: words that could be read in more than one way.
    pub warnings: Vec<String>,
    /// Where deleted spheres were dropped: for each sphere left, its index in the file.
    pub kept: Option<Vec<u32>>,
    /// Types and structure, where the file has them.
    pub annotations: Annotations,
}

impl LoadedMa {
    /// The mesh, and its notes and warnings in one list.
    pub fn with_remarks(self) -> (MedialMesh, Vec<String>) {
        let mut remarks = self.notes;
        remarks.extend(self.warnings);
        (self.mesh, remarks)
    }
}

/// Reads a medial mesh from a `.ma` file, a list of spheres, an ASCII `.ply` file or an `.obj` file with radii, told apart by the extension.
///
/// # Errors
/// When the file cannot be read, has another extension, or does not hold a medial mesh; the error
/// names the file and the line.
pub fn read(path: impl AsRef<Path>) -> Result<LoadedMa, MaError> {
    read_with(path, ReadOptions::default())
}

/// [`read`] for files that are not what their header says, hold several medial meshes, or no radii.
///
/// # Errors
/// As [`read`], but for what the options allow.
pub fn read_with(path: impl AsRef<Path>, options: ReadOptions) -> Result<LoadedMa, MaError> {
    let path = path.as_ref();
    let name = path.display().to_string();
    match extension(path).as_str() {
        "ma" | "ma_dup" | "sph" | "txt" | "xyzr" => parse_ma_with(load(path)?, &name, options),
        "ply" => parse_ply_with(load(path)?, &name, options),
        "obj" => parse_obj(load(path)?, &name, options),
        other => Err(MaError::of_file(path, MaErrorKind::unreadable(other))),
    }
}

/// Reads a `.ma` file, whatever its extension.
///
/// # Errors
/// When the file cannot be read or [`parse_ma`] refuses it.
pub fn read_ma(path: impl AsRef<Path>) -> Result<LoadedMa, MaError> {
    let path = path.as_ref();
    parse_ma(load(path)?, &path.display().to_string())
}

/// Writes a medial mesh as `.ma`, `.ply`, `.obj`, `.vtp` or `.glb`, told apart by the extension.
///
/// The file appears under its name only when it is complete: it is written beside the target
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
/// As [`write()`]; when the format has no room for what is to be shown; and `.glb` for a mesh without spheres,
/// numbers beyond single precision, or more than 4 GB.
///
/// # Panics
/// If the values are not one for each sphere.
pub fn write_with(path: impl AsRef<Path>, mesh: &MedialMesh, look: &Look) -> Result<(), MaError> {
    let path = path.as_ref();
    let fail = |kind| MaError::of_file(path, kind);
    let extension = extension(path);
    if let Some(SphereValues { values, .. }) = &look.values {
        assert_eq!(values.len(), mesh.spheres.len(), "a value for each sphere");
    }
    if !WRITTEN.contains(&extension.as_str()) {
        return Err(fail(MaErrorKind::unwritable(&extension)));
    }
    has_room(&extension, look).map_err(fail)?;
    mesh.check().map_err(|error| fail(error.into()))?;
    let written = match extension.as_str() {
        "ma" => write_atomically(path, |out| ma::write_to(out, mesh)),
        "ply" => write_atomically(path, |out| ply::write_to(out, mesh)),
        "obj" => write_atomically(path, |out| obj::write_to(out, mesh)),
        "vtp" => write_atomically(path, |out| vtp::write_to(out, mesh, look)),
        _ => {
            let bytes =
                glb::file(mesh, look).map_err(|error| fail(MaErrorKind::Unwritable(error)))?;
            write_atomically(path, |out| out.write_all(&bytes))
        }
    };
    written.map_err(|error| fail(error.into()))
}

/// Extensions that [`write()`] knows; the last is the arm for all others there.
const WRITTEN: [&str; 5] = ["ma", "ply", "obj", "vtp", "glb"];

fn has_room(extension: &str, look: &Look) -> Result<(), MaErrorKind> {
    let refused =
        |what, known| Err(MaErrorKind::NoRoom { extension: extension.to_owned(), what, known });
    match extension {
        "glb" => Ok(()),
        _ if look.balls => refused("spheres as bodies", ".glb"),
        "vtp" => Ok(()),
        _ if look.values.is_some() => refused("values", ".vtp or .glb"),
        _ => Ok(()),
    }
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

fn load(path: &Path) -> Result<Vec<u8>, MaError> {
    fs::read(path).map_err(|error| MaError::of_file(path, error.into()))
}

#[cfg(test)]
mod dialects_tests;
#[cfg(test)]
mod flags_tests;
#[cfg(test)]
mod tests;
