//! Medial meshes that a user names: which files hold one, in which units, with which radii.

use std::collections::HashSet;
use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use medial::complex::{self, LoadedMa, MedialMesh, READABLE, Radii, ReadOptions, Sphere};
use medial::shape::{Fit, Shape, ShapeError};
use medial::surface::{self, Side};
use serde::{Deserialize, Serialize};

use crate::error::FileError;
use crate::text::percent;

/// Plausible extents of a medial mesh from the middle of its surface, in diagonals.
const SMALLEST: f64 = 0.01;
const LARGEST: f64 = 5.0;

/// Medians of the difference between radii and distances to the surface, as fractions of the diagonal: above the first,
/// other units are tried, and above the second, a misfit gives a warning even if no units fit.
const DOUBTFUL: f64 = 0.01;
const WRONG: f64 = 0.05;

/// A radius below this fraction of the diagonal is that of a point on the surface.
const ON_SURFACE: f64 = 1e-9;

/// Options of reading a medial mesh and fitting it to its surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AxisOptions {
    /// Whether to read all lines of a medial mesh whose header states a different number.
    pub lenient: bool,
    /// Number of the medial mesh, or link of a robot, in a file that holds several, from 1.
    pub block: Option<usize>,
    /// Origin of the radii.
    pub radii: RadiiFrom,
    /// Conversion of the units of the medial mesh to those of the surface.
    pub fit: FitBy,
}

impl AxisOptions {
    /// The options of the reader of medial meshes.
    pub fn read_options(self) -> ReadOptions {
        let radii = match self.radii {
            RadiiFrom::File => Radii::Needed,
            RadiiFrom::Surface => Radii::NotNeeded,
        };
        ReadOptions { lenient: self.lenient, block: self.block, radii }
    }
}

/// Origin of radii.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RadiiFrom {
    /// From the file.
    #[default]
    File,
    /// The distance of each centre to the surface.
    Surface,
}

/// Conversion of units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FitBy {
    /// The file is in the units of the surface.
    #[default]
    None,
    /// Apply the uniform scale and the shift that fit the spheres to the surface.
    Similarity,
    /// As `similarity`, for files that fit only after scaling.
    Auto,
}

/// Reads a medial mesh of a shape in input units, and the requested change of units.
///
/// # Errors
/// When it cannot be read, has no sphere, or cannot belong to the shape.
pub fn read_axis(
    path: &Path,
    shape: &Shape,
    options: AxisOptions,
) -> Result<(LoadedMa, Option<Fit>), FileError> {
    let named = |why: &dyn Display| FileError::at(path, why);
    let from_surface = options.radii == RadiiFrom::Surface;
    let bytes = content(path).map_err(FileError)?;
    let mut loaded = read_external(path, &bytes, options.read_options()).map_err(FileError)?;
    if loaded.mesh.spheres.is_empty() {
        return Err(named(&"no sphere"));
    }
    if from_surface {
        // The file may have any other numbers in their place.
        loaded.mesh.spheres.iter_mut().for_each(|sphere| sphere.radius = 0.0);
    }
    let reach = reach(&loaded.mesh, shape).map_err(|why| named(&why))?;
    // Without radii, distances have nothing to compare with: only scales that tools use are tried.
    let fit = match (options.fit, from_surface) {
        (FitBy::None, _) => None,
        (FitBy::Similarity, false) => Some(shape.fit(&loaded.mesh).map_err(|error| named(&error))?),
        (FitBy::Auto, false) => shape.fit_if_needed(&loaded.mesh).map_err(|error| named(&error))?,
        (FitBy::Similarity | FitBy::Auto, true) => {
            let fit = shape.fit_of_points(&loaded.mesh).map_err(|error| named(&error))?;
            Some(fit.ok_or_else(|| named(&"no fitting units found; give a file with radii"))?)
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

/// A medial mesh larger than this, in diagonals of the surface, cannot belong to it.
// Next to its spheres the whole surface is less than a rounding error.
const LARGEST_SPHERE: f64 = 1e12;

/// The largest extent of a medial mesh, in the units of a shape's input, from the middle of the surface, in diagonals.
///
/// # Errors
/// Names the sphere that is too far away to be measured.
pub fn reach(mesh: &MedialMesh, shape: &Shape) -> Result<f64, String> {
    let to_normal = shape.normalisation();
    let mut reach = 0.0_f64;
    for (id, sphere) in mesh.spheres.iter().enumerate() {
        let centre = to_normal.forward(sphere.centre);
        // The maximum norm overflows later than the length, and is as good for a bound.
        let size = centre.abs().max_element().max(sphere.radius / to_normal.diagonal);
        reach = reach.max(size);
        // An overflow gives a size that is infinite or not a number.
        if size.is_nan() || size > LARGEST_SPHERE {
            return Err(format!(
                "sphere {id}: too far from the surface ({size:.1e} diagonals); check the units and the surface"
            ));
        }
    }
    Ok(reach)
}

/// The content of a file shows in its first bytes: no header of a PLY file is longer than these.
const HEADER_LIMIT: u64 = 1 << 20;

/// Whether a file holds a medial mesh: `.ma`, lists of spheres, `.ply` whose vertices have a radius,
/// `.obj` whose vertices have a fourth number.
///
/// # Errors
/// When it cannot be read.
pub fn is_medial(path: &Path) -> io::Result<bool> {
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

/// The decision of the first line that has one.
fn any_line(path: &Path, decide: impl Fn(&[&[u8]]) -> Option<bool>) -> io::Result<bool> {
    medial::check_regular(path)?;
    let file = File::open(path)?;
    let mut reader = BufReader::new(file).take(HEADER_LIMIT);
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line)? > 0 {
        let words: Vec<&[u8]> =
            line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).collect();
        if let Some(decision) = decide(&words) {
            return Ok(decision);
        }
        line.clear();
    }
    Ok(false)
}

/// Lower-case extension of a path, or nothing.
pub fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// Most bytes of a medial mesh; larger files are refused unread.
const LARGEST_RESULT: u64 = 200_000_000;

/// Refuses a file by its size, before it is read.
///
/// # Errors
/// Gives both sizes.
pub fn check_size(path: &Path, most: u64) -> Result<(), String> {
    let bytes = fs::metadata(path).map_or(0, |file| file.len());
    let fault = format!("too large (found {bytes} bytes, expected at most {most})");
    if bytes > most { Err(fault) } else { Ok(()) }
}

/// The bytes of an external result.
///
/// # Errors
/// Names the file, which is too large or unreadable.
pub fn content(path: &Path) -> Result<Vec<u8>, String> {
    check_size(path, LARGEST_RESULT).map_err(|why| format!("{}: {why}", path.display()))?;
    surface::content(path).map_err(|error| error.to_string())
}

/// Reads a medial mesh, or a surface as spheres of radius 0: the union of its slabs is the surface
/// itself. `bytes` is the content of the file `path`, which is not opened.
///
/// # Errors
/// Names the file.
pub fn read_external(path: &Path, bytes: &[u8], options: ReadOptions) -> Result<LoadedMa, String> {
    let is_surface = match extension(path).as_str() {
        "off" | "stl" => return read_surface(path, bytes),
        "ply" => true,
        // Read as a surface, a medial mesh without radii would have spheres of radius 0.
        "obj" => !lists_edges(bytes),
        _ => false,
    };
    // First as a medial mesh, because every medial mesh with faces would pass as a surface.
    let read = complex::read_content(path, bytes, options).map_err(|error| error.to_string());
    match read {
        // Without radii it is a surface. If it is neither, the first error is the more useful one.
        Err(why) if is_surface => read_surface(path, bytes).map_err(|_| why),
        read => read,
    }
}

fn read_surface(path: &Path, bytes: &[u8]) -> Result<LoadedMa, String> {
    let surface = surface::inspect_bytes(path, bytes).map_err(|error| error.to_string())?.mesh;
    let spheres = surface.vertices.iter().map(|&v| Sphere::new(v, 0.0)).collect();
    let mesh = MedialMesh::from_simplices(spheres, vec![], surface.faces);
    let mesh = mesh.map_err(|error| format!("{}: {error}", path.display()))?;
    let notes = vec!["read a surface as spheres of radius 0".to_owned()];
    Ok(LoadedMa { mesh, notes, warnings: Vec::new() })
}

/// Whether the lines `l` of an `.obj` file are the edges of a medial mesh: it has no face, or a line is
/// the side of a face.
// In a surface they are edges without a face, which some modellers write.
fn lists_edges(obj: &[u8]) -> bool {
    let (mut edges, mut sides) = (HashSet::new(), Vec::new());
    for line in obj.split(|&byte| byte == b'\n') {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        let keyword = words.next();
        // Texture coordinates and normals follow a slash.
        let corners = words.map_while(|word| word.split('/').next()?.parse().ok());
        let corners: Vec<u32> = corners.collect();
        // Sorted pairs: a side is the same edge in both directions.
        let pairs = corners.windows(2).map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])]);
        match keyword {
            Some("l") => edges.extend(pairs),
            Some("f") => sides.extend(pairs),
            _ => {}
        }
    }
    !edges.is_empty() && (sides.is_empty() || sides.iter().any(|side| edges.contains(side)))
}

/// Gives every sphere the distance of its centre to the surface as its radius.
fn take_radii(loaded: &mut LoadedMa, shape: &Shape) -> Result<(), String> {
    let units = shape.normalisation();
    let centres: Vec<_> = loaded.mesh.spheres.iter().map(|sphere| sphere.centre).collect();
    let radii = shape.distances(&centres).map_err(|error| error.to_string())?;
    if radii.iter().all(|&radius| radius <= ON_SURFACE * units.diagonal) {
        return Err(
            "every point is on the surface; give a medial mesh, not samples of the surface"
                .to_owned(),
        );
    }
    for (sphere, radius) in loaded.mesh.spheres.iter_mut().zip(radii) {
        sphere.radius = radius;
    }
    loaded.notes.push("computed radii as distances of the centres to the surface".to_owned());
    let normal: Vec<_> = centres.iter().map(|&centre| units.forward(centre)).collect();
    // A separate view: its substrates must not be listed as used by a method.
    let sides = shape.view().inside_test().sides(&normal);
    let outside = sides.iter().filter(|side| **side == Side::Outside).count();
    if outside > 0 {
        let all = centres.len();
        loaded.warnings.push(format!(
            "{outside} of {all} centres are outside of the surface; find other units by --fit similarity"
        ));
    }
    Ok(())
}

/// A warning for a medial mesh that probably does not belong to its surface, or has other units.
fn doubts(
    mesh: &MedialMesh,
    shape: &Shape,
    is_fitted: bool,
    reach: f64,
) -> Result<Option<String>, ShapeError> {
    // The median: a medial mesh with a few wrong spheres is still of this surface.
    let misfit = shape.misfit(mesh)?.unwrap_or_default();
    if misfit <= DOUBTFUL || covers(mesh, shape) {
        return Ok(None);
    }
    let differ = format!(
        "radii and distances to the surface differ by {} of the diagonal at the median",
        percent(misfit)
    );
    if !is_fitted {
        let fit = shape.fit(mesh)?;
        if fit.is_needed {
            let found = percent(fit.misfit.unwrap_or_default());
            return Ok(Some(format!(
                "{differ}, by {found} in other units ({}; {}); convert them by --fit similarity",
                fit.similarity, fit.source
            )));
        }
        // The middle of the surface is the origin.
        if !(SMALLEST..=LARGEST).contains(&reach) {
            return Ok(Some(format!(
                "reaches {reach:.2e} diagonals from the middle of the surface, and no scale and shift fits; check the \
                 units and the surface"
            )));
        }
    }
    Ok((misfit > WRONG)
        .then(|| format!("{differ}; check the surface, or compute radii by --radii surface")))
}

/// Whether a mesh is a list of spheres most of whose centres lie in the solid: spheres that cover it are larger than
/// the distance to its surface in any unit.
fn covers(mesh: &MedialMesh, shape: &Shape) -> bool {
    let (units, inside) = (shape.normalisation(), shape.inside_test());
    let is_within = |s: &&Sphere| inside.winding_number(units.forward(s.centre)) != Some(0);
    let within = mesh.spheres.iter().filter(is_within);
    mesh.edges.is_empty() && 2 * within.count() > mesh.spheres.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_obj_without_radii_is_a_surface_unless_its_lines_are_sides_of_faces() {
        let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 2\n\
                           f 1/1 3/1 2/1\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
        for (lines, is_surface) in [("", true), ("l 4 5\n", true), ("l 4 5\nl 3 1\n", false)] {
            let text = format!("{tetrahedron}{lines}");
            let read = read_external(Path::new("a.obj"), text.as_bytes(), ReadOptions::default());
            match read {
                Ok(loaded) => assert!(is_surface && loaded.mesh.faces.len() == 4, "{lines}"),
                Err(why) => assert!(!is_surface && why.contains("without radii"), "{why}"),
            }
        }
        let curve = b"v 0 0 0\nv 1 0 0\nl 1 2\n";
        let why = read_external(Path::new("a.obj"), curve, ReadOptions::default()).unwrap_err();
        assert!(why.contains("without radii"), "{why}");
    }
}
