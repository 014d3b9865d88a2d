//! Writes OFF, OBJ and PLY as text: all or nothing.
//!
//! Coordinates are the shortest decimals (at most 17 digits) that read back as the
//! same double.

use std::io::{self, Write};
use std::path::Path;

use super::error::{Fault, SurfaceError};
use super::mesh::TriMesh;
use super::read::Format;
use crate::atomic::write_atomically;

/// Writes a mesh in the format that the extension tells: `.off`, `.obj` or `.ply`.
///
/// A file of that name is replaced, but only by a complete one.
///
/// # Errors
/// When the extension is unknown or `.stl` (single precision would move vertices), or the file
/// cannot be written.
///
/// ```no_run
/// let loaded = medial::surface::read("scan.stl")?;
/// medial::surface::write("repaired.ply", &loaded.mesh)?;
/// # Ok::<(), medial::surface::SurfaceError>(())
/// ```
pub fn write(path: impl AsRef<Path>, mesh: &TriMesh) -> Result<(), SurfaceError> {
    let path = path.as_ref();
    let written = Format::of(path).and_then(|format| replace(path, mesh, format));
    written.map_err(|fault| SurfaceError { file: Some(path.to_owned()), fault })
}

fn replace(path: &Path, mesh: &TriMesh, format: Format) -> Result<(), Fault> {
    if format == Format::Stl {
        let why = format!("{format} holds single precision only; write .off, .obj or .ply");
        return Err(Fault::Unsupported(why));
    }
    write_atomically(path, |out| write_to(out, mesh, format))
        .map_err(|error| Fault::Io(format!("cannot be written: {error}")))
}

/// The text of a mesh in a format of text.
fn write_to(out: &mut dyn Write, mesh: &TriMesh, format: Format) -> io::Result<()> {
    let (vertices, faces) = (mesh.vertices.len(), mesh.faces.len());
    let (vertex_word, face_word, base) = match format {
        Format::Obj => ("v ", "f", 1),
        _ => ("", "3", 0),
    };
    match format {
        Format::Off => writeln!(out, "OFF\n{vertices} {faces} 0")?,
        Format::Ply => {
            writeln!(out, "ply\nformat ascii 1.0\nelement vertex {vertices}")?;
            writeln!(out, "property double x\nproperty double y\nproperty double z")?;
            writeln!(out, "element face {faces}")?;
            writeln!(out, "property list uchar uint vertex_indices\nend_header")?;
        }
        Format::Obj | Format::Stl => {}
    }
    for v in &mesh.vertices {
        writeln!(out, "{vertex_word}{:?} {:?} {:?}", v.x, v.y, v.z)?;
    }
    for face in &mesh.faces {
        let [a, b, c] = face.map(|v| u64::from(v) + base);
        writeln!(out, "{face_word} {a} {b} {c}")?;
    }
    Ok(())
}
