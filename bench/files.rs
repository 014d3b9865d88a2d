//! Medial meshes that a user names, and outputs that are checked before the work for them is done.

use std::path::Path;

use medial::complex::{self, LoadedMa};
use medial::shape::Shape;

use crate::exit::Failure;
use crate::run::reach;

/// How far from the middle of its surface a medial mesh reaches, in diagonals, if it is no slip.
const SMALLEST: f64 = 0.01;
const LARGEST: f64 = 5.0;

/// Reads a medial mesh that was made for a shape, in input units.
///
/// # Errors
/// When it cannot be read, has no sphere, or cannot belong to the shape.
pub fn medial_mesh_for(path: &Path, shape: &Shape) -> Result<LoadedMa, Failure> {
    let mut loaded = complex::read(path).map_err(Failure::input)?;
    if loaded.mesh.spheres.is_empty() {
        return Err(Failure::input(format!("{}: no sphere", path.display())));
    }
    let reach = reach(&loaded.mesh, shape)
        .map_err(|why| Failure::input(format!("{}: {why}", path.display())))?;
    // The middle of the surface is the origin.
    if !(SMALLEST..=LARGEST).contains(&reach) {
        loaded.warnings.push(format!(
            "{}: it reaches {:.2e} diagonals of the surface from the middle of that: is it in the same units?",
            path.display(),
            reach
        ));
    }
    Ok(loaded)
}

/// Refuses an output that could not be written anyway, before the work for it is done.
///
/// # Errors
/// When the extension is none of a medial mesh, or the folder does not exist.
pub fn check_output(output: Option<&Path>) -> Result<(), Failure> {
    let Some(path) = output else { return Ok(()) };
    check_extension(path, &MEDIAL_MESHES)?;
    check_folder(path)
}

/// Extensions of medial meshes that are written.
const MEDIAL_MESHES: [&str; 5] = ["ma", "ply", "obj", "vtp", "glb"];

/// Extensions of surfaces that are written.
pub const SURFACES: [&str; 3] = ["ply", "off", "obj"];

/// Refuses a file of a kind that is not written.
///
/// # Errors
/// When the extension is none of those known.
pub fn check_extension(path: &Path, known: &[&str]) -> Result<(), Failure> {
    let extension = extension(path);
    if known.contains(&extension.as_str()) {
        return Ok(());
    }
    let (path, known) = (path.display(), known.join(", ."));
    Err(Failure::input(format!("{path}: the extension {extension:?} is not one of .{known}")))
}

/// Refuses a file in a folder that does not exist.
///
/// # Errors
/// When the folder does not exist.
pub fn check_folder(path: &Path) -> Result<(), Failure> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) if !folder.is_dir() => Err(Failure::input(format!(
            "{}: there is no folder {}; make it first",
            path.display(),
            folder.display()
        ))),
        _ => Ok(()),
    }
}

/// Lower-case extension of a path, or nothing.
pub fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}
