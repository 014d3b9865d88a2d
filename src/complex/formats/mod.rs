//! Files that hold a medial mesh.
//!
//! | extension | read | written | holds |
//! |---|---|---|---|
//! | `.ma` | yes | yes | spheres, edges, faces: the interchange format of the field, in all its dialects |
//! | `.ma_dup`, `.sph`, `.txt`, `.xyzr` | yes | no | the same, and lists of spheres alone |
//! | `.ply` | ASCII | ASCII | the same, with a vertex property `radius`, for viewers |
//! | `.obj` | no | yes | centres, edges (`l`) and faces (`f`), without radii, for viewers |
//!
//! Coordinates are read and written in the unit of the file; normalisation is up to the caller. Numbers
//! are written with 17 significant digits, so that they are read back bit for bit.

mod canonical;
mod error;
mod flags;
mod layout;
mod ma;
mod obj;
mod ply;
mod scan;

use std::fs;
use std::io::{self, Write};
use std::path::Path;

pub use error::{MaError, MaErrorKind};
pub use ma::parse_ma;
pub use ply::parse_ply;

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
}

impl LoadedMa {
    /// The mesh, and its notes and warnings in one list.
    pub fn with_remarks(self) -> (MedialMesh, Vec<String>) {
        let mut remarks = self.notes;
        remarks.extend(self.warnings);
        (self.mesh, remarks)
    }
}

/// Reads a medial mesh from a `.ma` file, a list of spheres or an ASCII `.ply` file, told apart by the extension.
///
/// # Errors
/// When the file cannot be read, has another extension, or does not hold a medial mesh; the error
/// names the file and the line.
pub fn read(path: impl AsRef<Path>) -> Result<LoadedMa, MaError> {
    let path = path.as_ref();
    match extension(path).as_str() {
        "ma" | "ma_dup" | "sph" | "txt" | "xyzr" => read_ma(path),
        "ply" => parse_ply(load(path)?, &path.display().to_string()),
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
mod flags_tests;
#[cfg(test)]
mod tests;
