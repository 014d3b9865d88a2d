//! A medial mesh from a file, brought to its surface: units, and radii where the file has none.

use std::fmt::Display;
use std::path::Path;

use clap::ValueEnum;
use medial::complex::{self, LoadedMa, MedialMesh, Radii, ReadOptions, Sphere};
use medial::shape::{Fit, Shape, ShapeError};
use medial::surface::{self, Side};
use serde::{Deserialize, Serialize};

use super::reach;

/// How far from the middle of its surface a medial mesh reaches, in diagonals, if it is no slip.
const SMALLEST: f64 = 0.01;
const LARGEST: f64 = 5.0;

/// Medians of the difference between radii and distances to the surface, as fractions of the diagonal: from here on other
/// units are tried, and from here on it is said that something is wrong though none fit.
const DOUBTFUL: f64 = 0.01;
const WRONG: f64 = 0.05;

/// A radius below this fraction of the diagonal is that of a point on the surface.
const ON_SURFACE: f64 = 1e-9;

/// How a medial mesh from a file is read and brought to its surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AxisOptions {
    /// Whether lines are taken as they are where the header announces another number of them.
    pub lenient: bool,
    /// Which medial mesh is meant of several in one file, from 1.
    pub block: Option<usize>,
    /// Where radii come from.
    pub radii: RadiiFrom,
    /// How units are found.
    pub fit: FitBy,
}

/// Where radii come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RadiiFrom {
    /// From the file.
    #[default]
    File,
    /// From the surface.
    Surface,
}

/// How units are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FitBy {
    /// The file is in the units of the surface.
    #[default]
    None,
    /// By the uniform scale and the shift under which spheres and surface fit.
    Similarity,
    /// The same, if the file does not fit as it is and does so then.
    Auto,
}

/// Why a file gives no medial mesh for a surface, in words that name it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct AxisError(String);

/// Reads a medial mesh that was made for a shape, in input units, and the change of units that brought it there, if one
/// was asked for.
///
/// # Errors
/// When it cannot be read, has no sphere, or cannot belong to the shape.
pub fn read_axis(
    path: &Path,
    shape: &Shape,
    options: &AxisOptions,
) -> Result<(LoadedMa, Option<Fit>), AxisError> {
    let named = |why: &dyn Display| AxisError(format!("{}: {why}", path.display()));
    let from_surface = options.radii == RadiiFrom::Surface;
    let radii = if from_surface { Radii::NotNeeded } else { Radii::Needed };
    let read = ReadOptions { lenient: options.lenient, block: options.block, radii };
    let mut loaded = read_external(path, read).map_err(AxisError)?;
    if loaded.mesh.spheres.is_empty() {
        return Err(named(&"no sphere"));
    }
    if from_surface {
        // What stands in their place may be anything.
        loaded.mesh.spheres.iter_mut().for_each(|sphere| sphere.radius = 0.0);
    }
    let reach = reach(&loaded.mesh, shape).map_err(|why| named(&why))?;
    let fit = match (options.fit, from_surface) {
        (FitBy::None, _) => None,
        (FitBy::Similarity, false) => Some(shape.fit(&loaded.mesh).map_err(|error| named(&error))?),
        (FitBy::Auto, false) => shape.fit_if_needed(&loaded.mesh).map_err(|error| named(&error))?,
        (FitBy::Similarity | FitBy::Auto, true) => {
            let fit = shape.fit_of_points(&loaded.mesh).map_err(|error| named(&error))?;
            Some(fit.ok_or_else(|| named(&"without radii only the cubes that tools write are tried, and none of them fits the surface"))?)
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

/// Reads a medial mesh, or a surface as one of spheres without extent: the union of its slabs is the
/// surface itself.
///
/// # Errors
/// In words that name the file.
pub(super) fn read_external(path: &Path, options: ReadOptions) -> Result<LoadedMa, String> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let read = || complex::read_with(path, options).map_err(|error| error.to_string());
    let surface = || -> Result<LoadedMa, String> {
        let surface = surface::read_any(path).map_err(|error| error.to_string())?.mesh;
        let spheres = surface.vertices.iter().map(|&v| Sphere::new(v, 0.0)).collect();
        let mesh = MedialMesh::from_simplices(spheres, vec![], surface.faces);
        let mesh = mesh.map_err(|error| format!("{}: {error}", path.display()))?;
        let notes = vec!["a surface: measured as spheres of radius 0".to_owned()];
        Ok(LoadedMa { mesh, notes, warnings: Vec::new() })
    };
    match extension.as_str() {
        "off" | "stl" => surface(),
        // Without radii it is a surface, and its first error is the more telling one if it is neither.
        "ply" | "obj" => read().or_else(|why| surface().map_err(|_| why)),
        _ => read(),
    }
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

/// A fraction of the diagonal as a percentage with three decimals.
pub fn percent(fraction: f64) -> String {
    format!("{:.3} %", 100.0 * fraction)
}
