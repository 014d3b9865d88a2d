//! Files that hold a medial mesh.
//!
//! | extension | read | written | holds |
//! |---|---|---|---|
//! | `.ma` | yes | yes | spheres, edges, faces: the interchange format of the field, in all its dialects |
//! | `.ma_dup`, `.sph`, `.txt`, `.xyzr` | yes | no | the same, and lists of spheres alone |
//! | `.ply` | ASCII | ASCII | the same, with a vertex property `radius`, for viewers |
//! | `.obj` | yes | yes | centres, edges (`l`) and faces (`f`); read with radii as fourth numbers (`v x y z r`), written without, for viewers |
//!
//! Coordinates are read and written in the unit of the file; normalisation is up to the caller. Numbers
//! are written with 17 significant digits, so that they are read back bit for bit.

mod annotations;
mod canonical;
mod error;
mod flags;
mod layout;
mod ma;
mod obj;
mod options;
mod ply;
mod records;
mod scan;
mod trailer;

use std::fs;
use std::io::{self, Write};
use std::path::Path;

pub use annotations::{Annotations, Part, PartKind};
pub use error::{MaError, MaErrorKind};
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

/// Reads a medial mesh from a `.ma` file, a list of spheres, an ASCII `.ply` file or an `.obj` file with radii, told apart
/// by the extension.
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

/// Writes a medial mesh as `.ma`, `.ply` or `.obj`, told apart by the extension.
///
/// The file appears under its name only when it is complete: it is written beside the target
/// and renamed. Contact points are not part of any of these formats.
///
/// # Errors
/// When the extension is another one, the mesh is not in canonical form, or writing fails.
pub fn write(path: impl AsRef<Path>, mesh: &MedialMesh) -> Result<(), MaError> {
    let path = path.as_ref();
    let write_to: fn(&mut dyn Write, &MedialMesh) -> io::Result<()> = match extension(path).as_str()
    {
        "ma" => ma::write_to,
        "ply" => ply::write_to,
        "obj" => obj::write_to,
        other => return Err(MaError::of_file(path, MaErrorKind::unwritable(other))),
    };
    mesh.check().map_err(|error| MaError::of_file(path, error.into()))?;
    write_atomically(path, |out| write_to(out, mesh))
        .map_err(|error| MaError::of_file(path, error.into()))
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
