//! The `.obj` format: read with radii as fourth numbers of the vertices, as the tools around Q-MAT write it; written without
//! radii, for viewers. Indices are from 1.

use std::io::{self, Write};

use super::canonical::canonical;
use super::error::{MaError, MaErrorKind};
use super::scan::{Line, lines, shortened};
use super::{LoadedMa, Radii, ReadOptions};
use crate::complex::{MedialMesh, Sphere};

/// Statements of the format that say nothing about spheres, edges and faces.
const IGNORED: [&str; 11] =
    ["vn", "vt", "vp", "o", "g", "s", "p", "usemtl", "mtllib", "mg", "usemap"];

/// Whether lines of edges or faces stand in a text: what tells this format from a list of spheres.
pub(super) fn has_elements(bytes: &[u8]) -> bool {
    let starts =
        |line: &[u8]| matches!(line, [b'l' | b'f', next, ..] if next.is_ascii_whitespace());
    bytes.split(|&byte| byte == b'\n').any(|line| starts(line.trim_ascii_start()))
}

/// Reads a medial mesh from the text of an OBJ file: vertices `v x y z r`, lines `l i j ...`, triangles `f i j k`, with indices
/// from 1 or, if negative, back from the last vertex; `name` stands for the file in errors.
///
/// ```
/// use medial::complex::{ReadOptions, parse_obj};
///
/// let loaded = parse_obj("v 0 0 0 1\nv 1 0 0 0.5\nl 1 2\n", "x.obj", ReadOptions::default())?;
/// assert_eq!((loaded.mesh.spheres[1].radius, loaded.mesh.edges[0]), (0.5, [0, 1]));
/// # Ok::<(), medial::complex::MaError>(())
/// ```
///
/// # Errors
/// When a vertex has no fourth number and radii are needed, a face is no triangle, a line is not of this format, a
/// number is not finite, or an index is out of range.
pub fn parse_obj(
    text: impl AsRef<[u8]>,
    name: &str,
    options: ReadOptions,
) -> Result<LoadedMa, MaError> {
    let (mut spheres, mut edges, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for line in lines(text.as_ref(), name) {
        let mut words = line.words();
        match words.next_word() {
            Some("v") => spheres.push(vertex(&line, options.radii)?),
            Some("l") => {
                let corners = indices(&line, spheres.len())?;
                if corners.len() < 2 {
                    return Err(line.error(MaErrorKind::Missing { field: "index of a sphere" }));
                }
                edges.extend(corners.windows(2).map(|pair| [pair[0], pair[1]]));
            }
            Some("f") => faces.push(indices(&line, spheres.len())?.try_into().map_err(
                |corners: Vec<u32>| {
                    let why = format!("faces must be triangles, found {} corners", corners.len());
                    line.error(MaErrorKind::Malformed(why))
                },
            )?),
            Some(word) if IGNORED.contains(&word) => {}
            other => {
                let found = shortened(other.unwrap_or_default());
                let why = format!("expected a line that starts with v, l or f, found {found:?}");
                return Err(line.error(MaErrorKind::Malformed(why)));
            }
        }
    }
    canonical(spheres, edges, faces, options.radii, Vec::new()).map_err(|kind| MaError {
        file: name.to_owned(),
        line: None,
        kind,
    })
}

/// Centre and radius of a line `v x y z r`.
fn vertex(line: &Line<'_>, radii: Radii) -> Result<Sphere, MaError> {
    let mut words = line.words();
    words.next_word();
    let numbers = line.words().rest().count() - 1;
    match (numbers, radii) {
        (4, _) => words.sphere(radii),
        // Behind the coordinates there may be colours.
        (_, Radii::NotNeeded) => Ok(Sphere::new(words.point()?, 0.0)),
        (3, _) => Err(line.error(MaErrorKind::NoRadii)),
        _ => {
            let why = format!("a vertex has 4 numbers, x y z and a radius; found {numbers}");
            Err(line.error(MaErrorKind::Malformed(why)))
        }
    }
}

/// The vertices that a line names, out of those above it.
fn indices(line: &Line<'_>, vertices: usize) -> Result<Vec<u32>, MaError> {
    let index = |word: &str| {
        // Behind a slash stand texture coordinates and normals.
        let number = word.split('/').next().and_then(|text| text.parse::<i64>().ok());
        let from_zero = number.and_then(|number| match number {
            1.. => Some(number - 1),
            0 => None,
            _ => (vertices as i64).checked_add(number),
        });
        let index = from_zero.filter(|&index| (0..vertices as i64).contains(&index));
        index.and_then(|index| u32::try_from(index).ok()).ok_or_else(|| {
            let why = format!(
                "{:?} is not one of the {vertices} vertices above, counted from 1",
                shortened(word)
            );
            line.error(MaErrorKind::Malformed(why))
        })
    };
    line.words().rest().skip(1).map(index).collect()
}

/// Writes the centres, edges and faces of a medial mesh as Wavefront OBJ.
pub(super) fn write_to(out: &mut dyn Write, mesh: &MedialMesh) -> io::Result<()> {
    for sphere in &mesh.spheres {
        let c = sphere.centre;
        writeln!(out, "v {:.16e} {:.16e} {:.16e}", c.x, c.y, c.z)?;
    }
    // In 64 bits: the last of 2^32 spheres still has a successor.
    for [a, b] in mesh.edges.iter().map(|edge| edge.map(|i| u64::from(i) + 1)) {
        writeln!(out, "l {a} {b}")?;
    }
    for [a, b, c] in mesh.faces.iter().map(|face| face.map(|i| u64::from(i) + 1)) {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
