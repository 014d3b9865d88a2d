//! Repairs on demand: small components dropped, touching parts separated, holes filled.

use std::path::Path;

use super::check::orient_and_examine;
use super::error::Fault;
use super::holes;
use super::repair::repair;
use super::report::Repair;
use super::separate::separate;
use super::soup::PolygonSoup;
use super::topology::Topology;
use super::{Format, Loaded, SurfaceError, TriMesh, accept, examine, in_file, read};

/// Which parts of a surface are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Components {
    /// All of them.
    #[default]
    All,
    /// The one of the largest area, the first of several.
    Largest,
}

/// Repairs on demand, beside those of [`read`](super::read).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MendOptions {
    /// Whether holes are closed by triangles between their vertices, with the largest dihedral angle
    /// as small as possible.
    pub fill_holes: bool,
    /// Whether parts that touch in a vertex are moved apart there, by a thousandth of the size of the
    /// faces at the vertex.
    pub separate: bool,
    /// Which parts are kept.
    pub components: Components,
}

/// Reads a surface and repairs more than [`read`](super::read) does; the result must pass the checks
/// of [`read`](super::read). Only vertices of separated parts are moved. The report lists all repairs
/// in order.
///
/// # Errors
/// As [`read`](super::read) for what is left after the repairs, and when a hole is too long to be
/// filled, meets itself, or cannot be closed without edges that are there already.
///
/// # Cost
/// That of [`read`](super::read) twice, and `O(n^3)` for a hole of `n` edges.
pub fn mend(path: impl AsRef<Path>, options: MendOptions) -> Result<Loaded, SurfaceError> {
    let path = path.as_ref();
    let mended = || -> Result<Loaded, Fault> {
        let format = Format::of(path)?;
        mended(&read::content(path)?, format, options)
    };
    mended().map_err(|fault| in_file(path, fault))
}

/// [`mend`] for the content of a file.
///
/// # Errors
/// As [`mend`], without the name of a file.
///
/// ```
/// use medial::surface::{Format, MendOptions, mend_bytes};
///
/// let open = b"OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n";
/// let options = MendOptions { fill_holes: true, ..MendOptions::default() };
/// let mended = mend_bytes(open, Format::Off, options)?;
/// assert_eq!(mended.mesh.faces.len(), 4);
/// assert_eq!(mended.report.repairs[0].to_string(), "filled a hole of 3 edges with 1 triangle");
/// # Ok::<(), medial::surface::SurfaceError>(())
/// ```
pub fn mend_bytes(
    bytes: &[u8],
    format: Format,
    options: MendOptions,
) -> Result<Loaded, SurfaceError> {
    Ok(mended(bytes, format, options)?)
}

fn mended(bytes: &[u8], format: Format, options: MendOptions) -> Result<Loaded, Fault> {
    let examined = examine(bytes, format)?;
    let mut mesh = examined.mesh;
    let mut repairs = examined.report.repairs;
    let mut warnings = match &examined.fault {
        // The examination of the result repeats its warnings; a failed one has none of the reader.
        Some(_) => Vec::new(),
        None => examined.report.warnings,
    };
    if options.components == Components::Largest {
        repairs.extend(keep_largest(&mut mesh));
    }
    let TriMesh { mut vertices, mut faces } = mesh;
    // Before the holes: their loops pass a vertex once only if its fans are separate.
    if options.separate {
        repairs.extend(separate(&mut vertices, &mut faces));
    }
    if options.fill_holes {
        repairs.extend(holes::fill(&vertices, &mut faces)?);
    }
    let mut soup = PolygonSoup { vertices, ..PolygonSoup::default() };
    soup.corners = faces.as_flattened().to_vec();
    soup.ends = (1..=faces.len() as u32).map(|face| 3 * face).collect();
    let mut loaded = accept(orient_and_examine(repair(soup)?))?;
    repairs.append(&mut loaded.report.repairs);
    loaded.report.repairs = repairs;
    warnings.retain(|warning| !loaded.report.warnings.contains(warning));
    loaded.report.warnings.splice(0..0, warnings);
    Ok(loaded)
}

/// Keeps the faces of the largest component.
fn keep_largest(mesh: &mut TriMesh) -> Option<Repair> {
    let component = Topology::new(mesh.vertices.len(), &mesh.faces).component;
    let components = component.iter().max().map_or(0, |&last| last as usize + 1);
    let mut areas = vec![0.0; components];
    for (face, &component) in component.iter().enumerate() {
        let [a, b, c] = mesh.triangle(face);
        areas[component as usize] += (b - a).cross(c - a).length();
    }
    let largest = (0..components).max_by(|&a, &b| areas[a].total_cmp(&areas[b]).then(b.cmp(&a)))?;
    let all = mesh.faces.len();
    let mut of_face = component.iter();
    mesh.faces.retain(|_| of_face.next() == Some(&(largest as u32)));
    let dropped =
        Repair::DroppedComponents { components: components - 1, faces: all - mesh.faces.len() };
    (components > 1).then_some(dropped)
}
