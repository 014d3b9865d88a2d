//! The `.ma` format.
//!
//! ```text
//! nV nE nF          numbers of spheres, edges, faces
//! v x y z r         nV times: centre and radius
//! e i j             nE times: indices of two spheres, from 0
//! f i j k           nF times: indices of three spheres
//! ```
//!
//! Tools of the field add types of features and marks of deletion at the end of a line, and a
//! fourth count with lines `t a b c d` of tetrahedra: `flags.rs` says which. What is marked as
//! deleted is dropped, with whatever uses it, and counted.
//!
//! Lists of spheres alone are read, too, by their first line: `n` or nothing before lines `v x y z r` (MATFP, Coverage
//! Axis), `n` or `4 n` before lines `x y z r` (Point2Skeleton, MATTopo's `.sph`). Lines `n x y z` of normals (SEG-MAT) are
//! counted and not used. Types of features, importances, tetrahedra and a trailer of parts (MATStruct) are kept as
//! [`Annotations`](super::Annotations).

use std::io::{self, Write};

use super::error::{MaError, MaErrorKind};
use super::layout::{Layout, counts};
use super::obj::{has_elements, parse_obj};
use super::options::ReadOptions;
use super::records::Records;
use super::scan::lines;
use super::{LoadedMa, trailer};
use crate::complex::{MedialMesh, Sphere};

/// Reads a medial mesh from the text of a `.ma` file; `name` stands for the file in errors.
///
/// Empty lines, comments (`#`), carriage returns and any order of the lines are accepted. Edges and
/// faces may be in any order and orientation; missing sides of faces are added. What a trailing flag
/// marks as deleted is dropped, with the edges and faces that use it. Of negative radii the absolute values are taken.
/// [`LoadedMa::notes`] and [`LoadedMa::warnings`] say what was done.
///
/// ```
/// let text = "3 0 1\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 0 1 2\n";
/// let loaded = medial::complex::parse_ma(text, "triangle.ma")?;
/// assert_eq!(loaded.mesh.edges, [[0, 1], [0, 2], [1, 2]]);
/// assert_eq!(loaded.notes, ["3 edges were added: sides of faces that were not listed"]);
/// # Ok::<(), medial::complex::MaError>(())
/// ```
///
/// # Errors
/// When the header or a line is not as above, a number is not finite, an
/// index is out of range, trailing words are the flags of no known tool, the lines are not as
/// many as announced (but for edges and faces of a writer that is known to miscount them), or a second medial mesh was
/// appended.
pub fn parse_ma(text: impl AsRef<[u8]>, name: &str) -> Result<LoadedMa, MaError> {
    parse_ma_with(text, name, ReadOptions::default())
}

/// [`parse_ma`] for files that are not what their header says, hold several medial meshes, or no radii.
///
/// # Errors
/// As [`parse_ma`], but for what the options allow, and when there is no such block.
pub fn parse_ma_with(
    text: impl AsRef<[u8]>,
    name: &str,
    options: ReadOptions,
) -> Result<LoadedMa, MaError> {
    let bytes = text.as_ref();
    let mut rest = lines(bytes, name);
    let of_file = |kind| MaError::of(name, kind);
    let header = rest.next().ok_or_else(|| {
        of_file(MaErrorKind::Malformed("the file is empty; expected a line `nV nE nF`".into()))
    })?;
    let mut records = Records::announced(&header, bytes.len(), options)?;
    if records.layout == Layout::Bare {
        if has_elements(bytes) {
            return parse_obj(bytes, name, options);
        }
        records.take(&header)?;
    }
    let mut block = 1;
    while let Some(line) = rest.next() {
        if records.are_complete() && line.words().rest().count() == 1 && records.parts.is_empty() {
            records.parts = trailer::parts(&line, &mut rest, records.announced)?;
        } else if records.are_complete() && counts(&line).is_some() {
            // Tools that open their file for appending write a second result behind the first.
            match options.block {
                None => return Err(line.error(MaErrorKind::Appended)),
                Some(wanted) if wanted == block => break,
                Some(_) => {
                    block += 1;
                    records = Records::announced(&line, bytes.len(), options)?;
                }
            }
        } else {
            records.take(&line)?;
        }
    }
    match options.block {
        Some(wanted) if wanted != block => {
            Err(of_file(MaErrorKind::Block { wanted, blocks: block }))
        }
        _ => records.finish(name),
    }
}

/// Writes a medial mesh as `.ma`.
pub(super) fn write_to(out: &mut dyn Write, mesh: &MedialMesh) -> io::Result<()> {
    writeln!(out, "{} {} {}", mesh.spheres.len(), mesh.edges.len(), mesh.faces.len())?;
    for Sphere { centre: c, radius } in &mesh.spheres {
        writeln!(out, "v {:.16e} {:.16e} {:.16e} {radius:.16e}", c.x, c.y, c.z)?;
    }
    for [a, b] in &mesh.edges {
        writeln!(out, "e {a} {b}")?;
    }
    for [a, b, c] in &mesh.faces {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
