//! Medial meshes that a user names, and outputs that are checked before the work for them is done.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use medial::complex::{self, MedialMesh, READABLE, WRITABLE, single_precision_loss};
use medial::shape::{Shape, ShapeOptions};

use crate::exit::Failure;
use crate::study::source::{Input, Source};

/// Reads a surface or makes a built-in one, and the shape of it. Errors name the surface.
///
/// # Errors
/// When it does not exist, is refused, or has no extent.
pub fn shape_of(mesh: &Path, options: ShapeOptions) -> Result<(Input, Shape), Failure> {
    let input = Input::load(&Source::parse(mesh)?)?;
    let shape = input.shape(options).map_err(|error| Failure::at(mesh, error))?;
    Ok((input, shape))
}

/// The content of a file shows in its first bytes: no header of a PLY file is longer than these.
const HEADER_LIMIT: u64 = 1 << 20;

/// Whether a file holds a medial mesh: `.ma`, lists of spheres, `.ply` whose vertices have a radius,
/// `.obj` whose vertices have a fourth number.
///
/// # Errors
/// When it cannot be read.
pub fn is_medial(path: &Path) -> Result<bool, Failure> {
    match extension(path).as_str() {
        // Surfaces and medial meshes share these extensions: their first lines decide.
        "ply" => any_line(path, |words| match words {
            [b"end_header"] => Some(false),
            [b"property", _, b"radius" | b"r"] => Some(true),
            _ => None,
        }),
        "obj" => any_line(path, |words| match words {
            [b"v", coordinates @ ..] => Some(coordinates.len() == 4),
            _ => None,
        }),
        other => Ok(READABLE.contains(&other)),
    }
}

/// Opens a file of a user for reading.
///
/// # Errors
/// When it cannot be opened, or is a pipe or device, which may never end.
pub fn open_regular(path: &Path) -> Result<File, Failure> {
    let file = medial::check_regular(path).and_then(|()| File::open(path));
    file.map_err(|error| Failure::at(path, error))
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

/// The decision of the first line that has one.
fn any_line(path: &Path, decide: impl Fn(&[&[u8]]) -> Option<bool>) -> Result<bool, Failure> {
    let file = open_regular(path)?;
    let mut reader = BufReader::new(file).take(HEADER_LIMIT);
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line).map_err(|error| Failure::at(path, error))? > 0 {
        let words: Vec<&[u8]> =
            line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).collect();
        if let Some(decision) = decide(&words) {
            return Ok(decision);
        }
        line.clear();
    }
    Ok(false)
}

/// Refuses an output that could not be written, before the work for it is done.
///
/// # Errors
/// When the extension is none of a medial mesh, or the folder does not exist.
pub fn check_output(output: Option<&Path>) -> Result<(), Failure> {
    let Some(path) = output else { return Ok(()) };
    // Methods can take hours: a wrong name must fail before them.
    check_extension(path, &WRITABLE)?;
    check_folder(path)
}

/// Corners of a power crust that are nearer than this along it become one in the surface that is written, as a
/// fraction of the diagonal.
pub const COINCIDENT: f64 = 1e-6;

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
    let found = format!("found {extension:?}, expected one of .{known}");
    Err(Failure::input(format!("{path}: unknown extension ({found})")))
}

/// Refuses a file in a folder that does not exist.
///
/// # Errors
/// When the folder does not exist.
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

/// Refuses an output that would replace a file that the command reads, or its other output.
///
/// # Errors
/// When both paths lead to the same file.
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

/// Writes a file, complete or not at all.
///
/// # Errors
/// When it cannot be written; the message names it.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    medial::write_atomically(path, |out| out.write_all(bytes))
        .map_err(|error| Failure::at(path, error))
}

/// Lower-case extension of a path, or nothing.
pub fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}
