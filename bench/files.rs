//! Medial meshes that a user names, and outputs that are checked before the work for them is done.

use std::path::Path;

use medial::complex::{self, MedialMesh, WRITABLE, single_precision_loss};
use medial::shape::{Shape, ShapeOptions};
use medial_run::axis::extension;
use medial_run::input::{Input, Source};
use medial_run::journal::replace_file;

use crate::exit::Failure;

/// Reads a surface or makes a built-in one, and the shape of it. Errors name the surface. Fails when it does not exist,
/// is refused, has no extent, or is changed by reading it though it `is_as_is`.
pub fn shape_of(
    mesh: &Path,
    options: ShapeOptions,
    is_as_is: bool,
) -> Result<(Input, Shape), Failure> {
    let source = Source::parse(mesh)?;
    if is_as_is {
        source.check_as_is()?;
    }
    let input = Input::load(&source)?;
    let shape = input.shape(options).map_err(|error| Failure::at(mesh, error))?;
    Ok((input, shape))
}

/// A note on the part of a medial mesh that the file `path` cannot hold.
pub fn left_out(path: &Path, mesh: &MedialMesh) -> Option<String> {
    match &*extension(path) {
        "glb" => {
            let loss = single_precision_loss(mesh);
            Some(format!(
                "rounded coordinates and radii to single precision, by at most {loss:.1e}"
            ))
        }
        "obj" => Some("left out the radii: .obj has no place for them".to_owned()),
        _ => complex::left_out(path, mesh),
    }
}

/// Refuses an output that could not be written, before the work for it is done. Fails when the extension is none of a
/// medial mesh, or the folder does not exist.
pub fn check_output(output: Option<&Path>) -> Result<(), Failure> {
    let Some(path) = output else { return Ok(()) };
    // Methods can take hours: a wrong name must fail before them.
    check_extension(path, &WRITABLE)?;
    check_folder(path)
}

/// Extensions of surfaces that are written.
pub const SURFACES: [&str; 4] = ["ply", "off", "obj", "stl"];

/// Refuses a file of a kind that is not written.
pub fn check_extension(path: &Path, known: &[&str]) -> Result<(), Failure> {
    let extension = extension(path);
    if known.contains(&extension.as_str()) {
        return Ok(());
    }
    let (path, known) = (path.display(), known.join(", ."));
    let found = format!("found {extension:?}, expected one of .{known}");
    Err(Failure::input(format!("{path}: unknown extension ({found})")))
}

/// Refuses a file in a folder that does not exist.
pub fn check_folder(path: &Path) -> Result<(), Failure> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) if !folder.is_dir() => Err(Failure::input(format!(
            "{}: the folder does not exist; create it by `mkdir -p {}`",
            path.display(),
            folder.display()
        ))),
        _ => Ok(()),
    }
}

/// Refuses an output that would replace a file that the command reads, or its other output. Fails when both paths lead
/// to the same file.
pub fn check_apart<'a>(
    output: Option<&Path>,
    others: impl IntoIterator<Item = &'a Path>,
) -> Result<(), Failure> {
    let Some(output) = output else { return Ok(()) };
    let place = |path: &Path| {
        path.canonicalize().ok().or_else(|| {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
            Some(folder.join(path.file_name()?))
        })
    };
    let own = place(output);
    if own.is_some() && others.into_iter().any(|other| place(other) == own) {
        let why = "the command reads or writes this file already; name another one for the output";
        return Err(Failure::usage(format!("{}: {why}", output.display())));
    }
    Ok(())
}

/// Writes a file, complete or not at all, and creates its folder.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    replace_file(path, bytes).map_err(|error| Failure::at(path, error))
}
