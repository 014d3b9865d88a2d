//! The `.obj` format, for viewers: centres, edges as lines, faces; indices from 1, no radii.

use std::io::{self, Write};

use crate::complex::MedialMesh;

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
