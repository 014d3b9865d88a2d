//! Medial meshes that a user names, and outputs that are checked before the work for them is done.

use std::fmt::Display;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use medial::complex::{self, LoadedMa, MedialMesh, Radii, ReadOptions};
use medial::shape::{Fit, Shape, ShapeError};
use medial::surface::Side;

use crate::args::{AxisArguments, FitBy, RadiiFrom};
use crate::exit::Failure;
use crate::output::percent;
use crate::run::reach;

/// How far from the middle of its surface a medial mesh reaches, in diagonals, if it is no slip.
const SMALLEST: f64 = 0.01;
const LARGEST: f64 = 5.0;

/// Medians of the difference between radii and distances to the surface, as fractions of the diagonal: from here on other
/// units are tried, and from here on it is said that something is wrong though none fit.
const DOUBTFUL: f64 = 0.01;
const WRONG: f64 = 0.05;

/// A radius below this fraction of the diagonal is that of a point on the surface.
const ON_SURFACE: f64 = 1e-9;

/// Reads a medial mesh that was made for a shape, in input units, and the change of units that brought it there, if one
/// was asked for.
///
/// # Errors
/// When it cannot be read, has no sphere, or cannot belong to the shape.
pub fn medial_mesh_for(
    path: &Path,
    shape: &Shape,
    arguments: &AxisArguments,
) -> Result<(LoadedMa, Option<Fit>), Failure> {
    let named = |why: &dyn Display| Failure::input(format!("{}: {why}", path.display()));
    let from_surface = arguments.radii == RadiiFrom::Surface;
    let radii = if from_surface { Radii::NotNeeded } else { Radii::Needed };
    let options = ReadOptions { radii, ..arguments.read.options() };
    let mut loaded = complex::read_with(path, options).map_err(Failure::input)?;
    if loaded.mesh.spheres.is_empty() {
        return Err(named(&"no sphere"));
    }
    if from_surface {
        // What stands in their place may be anything.
        loaded.mesh.spheres.iter_mut().for_each(|sphere| sphere.radius = 0.0);
    }
    let reach = reach(&loaded.mesh, shape).map_err(|why| named(&why))?;
    let fit = match (arguments.fit, from_surface) {
        (FitBy::None, _) => None,
        (FitBy::Similarity, false) => Some(shape.fit(&loaded.mesh).map_err(|error| named(&error))?),
        (FitBy::Auto, false) => {
            fit_if_needed(&loaded.mesh, shape).map_err(|error| named(&error))?
        }
        (FitBy::Similarity | FitBy::Auto, true) => {
            let fit = shape.fit_of_points(&loaded.mesh).map_err(|error| named(&error))?;
            Some(fit.ok_or_else(|| named(&"without radii only the cubes that tools write are tried, and none of them fits the surface"))?)
        }
    };
    if let Some(fit) = &fit {
        loaded.mesh = fit.similarity.mesh(&loaded.mesh);
        loaded.notes.push(said(fit));
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

/// A change of units, where one is needed and found.
fn fit_if_needed(mesh: &MedialMesh, shape: &Shape) -> Result<Option<Fit>, ShapeError> {
    let fits = |misfit: Option<f64>| misfit.is_some_and(|misfit| misfit <= DOUBTFUL);
    if fits(shape.misfit(mesh)?) {
        return Ok(None);
    }
    Ok(Some(shape.fit(mesh)?).filter(|fit| fits(fit.misfit)))
}

/// A change of units, in words.
pub fn said(fit: &Fit) -> String {
    let Fit { similarity, source, misfit_before, misfit } = fit;
    let misfit = match (misfit_before, misfit) {
        (Some(before), Some(after)) => format!(
            "; radii and distances to the surface differ by {} at the median, {} before",
            percent(*after),
            percent(*before)
        ),
        _ => String::new(),
    };
    format!("fitted: {similarity} ({source}){misfit}")
}

/// Gives every sphere the distance of its centre to the surface as its radius.
fn take_radii(loaded: &mut LoadedMa, shape: &Shape) -> Result<(), String> {
    let units = shape.normalisation();
    let centres: Vec<_> = loaded.mesh.spheres.iter().map(|sphere| sphere.centre).collect();
    let radii = shape.distances(&centres).map_err(|error| error.to_string())?;
    if radii.iter().all(|&radius| radius <= ON_SURFACE * units.diagonal) {
        return Err(
            "every point is on the surface: it is that surface, or a sample of it".to_owned()
        );
    }
    for (sphere, radius) in loaded.mesh.spheres.iter_mut().zip(radii) {
        sphere.radius = radius;
    }
    loaded.notes.push("every radius is the distance of its centre to the surface".to_owned());
    let normal: Vec<_> = centres.iter().map(|&centre| units.forward(centre)).collect();
    let sides = shape.view().inside_test().sides(&normal);
    let outside = sides.iter().filter(|side| **side == Side::Outside).count();
    if outside > 0 {
        let all = centres.len();
        loaded.warnings.push(format!(
            "{outside} of {all} centres are outside of the surface: is it in the same units? `--fit similarity` finds others"
        ));
    }
    Ok(())
}

/// Why a medial mesh may not belong to its surface as it is, if there is a reason to think so.
fn doubts(
    mesh: &MedialMesh,
    shape: &Shape,
    is_fitted: bool,
    reach: f64,
) -> Result<Option<String>, ShapeError> {
    let misfit = shape.misfit(mesh)?.unwrap_or_default();
    if misfit <= DOUBTFUL {
        return Ok(None);
    }
    let differ = format!(
        "radii and distances to the surface differ by {} of the diagonal at the median",
        percent(misfit)
    );
    if !is_fitted {
        let fit = shape.fit(mesh)?;
        if fit.misfit.is_some_and(|misfit| misfit <= DOUBTFUL) {
            let found = percent(fit.misfit.unwrap_or_default());
            return Ok(Some(format!(
                "{differ}, by {found} in other units ({}; {}): `--fit similarity` takes those",
                fit.similarity, fit.source
            )));
        }
        // The middle of the surface is the origin.
        if !(SMALLEST..=LARGEST).contains(&reach) {
            return Ok(Some(format!(
                "it reaches {reach:.2e} diagonals of the surface from the middle of that: is it in the same units? \
                 No scale and shift was found that fits"
            )));
        }
    }
    Ok((misfit > WRONG).then(|| {
        format!("{differ}: of another surface, or no radii (`--radii surface` takes the distances)")
    }))
}

/// What a file holds is told by its first bytes; no header of a PLY file is longer than so many.
const HEADER_LIMIT: u64 = 1 << 20;

/// Whether a file holds a medial mesh: `.ma`, lists of spheres and `.vtp`, `.ply` and `.glb` whose vertices have a radius,
/// `.obj` whose vertices have a fourth number.
///
/// # Errors
/// When it cannot be read.
pub fn is_medial(path: &Path) -> Result<bool, Failure> {
    match extension(path).as_str() {
        "ma" | "ma_dup" | "sph" | "txt" | "xyzr" | "vtp" => Ok(true),
        "glb" => complex::glb_has_radii(path).map_err(Failure::input),
        "ply" => any_line(path, |words| match words {
            [b"end_header"] => Some(false),
            [b"property", _, b"radius" | b"r"] => Some(true),
            _ => None,
        }),
        "obj" => any_line(path, |words| match words {
            [b"v", coordinates @ ..] => Some(coordinates.len() == 4),
            _ => None,
        }),
        _ => Ok(false),
    }
}

/// What the first line says that says anything.
fn any_line(path: &Path, says: impl Fn(&[&[u8]]) -> Option<bool>) -> Result<bool, Failure> {
    let fail = |error| Failure::input(format!("{}: {error}", path.display()));
    let mut reader = BufReader::new(File::open(path).map_err(fail)?).take(HEADER_LIMIT);
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line).map_err(fail)? > 0 {
        let words: Vec<&[u8]> =
            line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).collect();
        if let Some(said) = says(&words) {
            return Ok(said);
        }
        line.clear();
    }
    Ok(false)
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
