//! Triangle meshes: reading, repairing, checking, sampling, the inside test.
//!
//! ```text
//! file -> read (polygon soup) -> repair (weld, triangulate, drop) -> orient -> check -> TriMesh
//! ```
//!
//! [`read`] gives a mesh only if it bounds a solid: closed, manifold, oriented outward, with
//! positive volume. All changes on the way, and defects that may spoil results without being
//! an error (intersecting faces, faces without area), are in its [`SurfaceReport`].
//! Every sign that a decision depends on is computed exactly.

mod check;
mod closest;
mod contacts;
mod contract;
mod creases;
mod format;
mod inside;
mod intersections;
mod mend;
mod mesh;
mod obj;
mod off;
mod parts;
pub(crate) mod ply;
mod point_grid;
mod repair;
mod report;
mod sample;
mod shrinking_ball;
mod solid;
mod soup;
mod stl;
mod text;
mod topology;
mod wrap;

use std::path::{Path, PathBuf};

use crate::Vec3;

pub use closest::{BvhError, Closest, Feature, TriangleBvh, Vicinity};
pub use contract::{Contraction, Folds, contract_short_edges, crust_surface};
pub use creases::{SharpEdge, sharp_edges, smooth_normals};
pub use format::Format;
pub(crate) use format::check_encoding;
pub use inside::{InsideTest, Side, SignedDistance};
pub use mend::{Components, MendOptions};
#[cfg(test)]
pub(crate) use mesh::fixtures;
pub use mesh::{Normalisation, TriMesh, write};
pub(crate) use point_grid::PointGrid;
pub use report::{Fault, Place, Repair, SurfaceError, SurfaceReport, VertexName};
pub use sample::{ParseSamplingError, Sampling, sample, sample_with_faces};
pub use shrinking_ball::{Ball, End, Touched, shrinking_ball};
pub use wrap::{PRECISION as WRAP_PRECISION, WrapError, WrapOptions, inspect_wrapped, wrap};

/// A surface that bounds a solid: closed, manifold, oriented outward, with positive volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The mesh, in the unit of the file.
    pub mesh: TriMesh,
    /// Findings and repairs.
    pub report: SurfaceReport,
}

/// A surface of any kind, as far as it could be examined: the output of `medial info`.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspection {
    /// The triangles after the repairs of [`read`], oriented as far as that is possible.
    pub mesh: TriMesh,
    /// Findings and repairs.
    pub report: SurfaceReport,
    /// The error of [`read`] for this surface, if any.
    pub refused: Option<SurfaceError>,
    /// The solid that the surface means, if it crosses, overlaps or touches itself.
    pub resolved: Option<Box<Loaded>>,
    /// Name of the file in errors.
    file: Option<PathBuf>,
    /// Number of each vertex of `mesh` in the file.
    file_vertex: Vec<u32>,
}

impl Inspection {
    /// The surface as it is in the file, if it bounds a solid and needs no [`Inspection::resolved`].
    ///
    /// # Errors
    /// [`Inspection::refused`], or [`Fault::Crossing`].
    pub fn as_is(self) -> Result<Loaded, SurfaceError> {
        let Self { mesh, report, refused, file, .. } = self;
        match (refused, report.intersecting_pairs) {
            (Some(error), _) => Err(error),
            (None, 0) => Ok(Loaded { mesh, report }),
            (None, pairs) => Err(SurfaceError { file, fault: Fault::Crossing { pairs } }),
        }
    }

    /// The solid that the surface means: [`Inspection::resolved`], or else the surface, if it bounds one.
    ///
    /// # Errors
    /// [`Inspection::refused`], if nothing was resolved.
    pub fn solid(self) -> Result<Loaded, SurfaceError> {
        match (self.resolved, self.refused) {
            (Some(solid), _) => Ok(*solid),
            (None, Some(error)) => Err(error),
            (None, None) => Ok(Loaded { mesh: self.mesh, report: self.report }),
        }
    }
}

/// Reads a surface, repairs it and checks it. The extension decides the format (`.off`, `.obj`,
/// `.ply`, `.stl`).
///
/// # Errors
/// When the file cannot be read, does not match its extension, or does not bound a solid after
/// the repairs. The error names the file and the line or element.
///
/// # Cost
/// `O(n log n)` time; memory below 16 MB plus 100 times the size of the file.
///
/// ```no_run
/// let medial::surface::Loaded { mesh, report } = medial::surface::read("bunny.ply")?;
/// for repair in &report.repairs {
///     println!("{repair}");
/// }
/// println!("{} triangles, genus {:?}", mesh.faces.len(), report.genus);
/// # Ok::<(), medial::surface::SurfaceError>(())
/// ```
pub fn read(path: impl AsRef<Path>) -> Result<Loaded, SurfaceError> {
    let path = path.as_ref();
    inspect(path)?.solid()
}

/// The bytes of a surface file, for [`inspect_bytes`].
///
/// # Errors
/// When it cannot be read, or is no regular file.
pub fn content(path: impl AsRef<Path>) -> Result<Vec<u8>, SurfaceError> {
    let path = path.as_ref();
    format::content(path).map_err(|fault| in_file(path, fault))
}

/// [`read`] for the content of a file.
///
/// # Errors
/// As [`read`], without the name of a file.
pub fn read_bytes(bytes: &[u8], format: Format) -> Result<Loaded, SurfaceError> {
    examine(bytes, format)?.solid()
}

/// Examines a surface that may be unfit for [`read`].
///
/// # Errors
/// When the file cannot be read, does not match its extension, or has no triangle with an area. A surface that is open,
/// non-manifold or otherwise rejected is no error here; see [`Inspection::refused`].
pub fn inspect(path: impl AsRef<Path>) -> Result<Inspection, SurfaceError> {
    let path = path.as_ref();
    // Before the file is read, which may be large.
    Format::of(path).map_err(|fault| in_file(path, fault))?;
    inspect_bytes(path, &content(path)?)
}

/// [`inspect`] for the bytes of the file `path`, which is not opened: hash and mesh of the same bytes cannot differ.
///
/// # Errors
/// As [`inspect`].
pub fn inspect_bytes(path: impl AsRef<Path>, bytes: &[u8]) -> Result<Inspection, SurfaceError> {
    let path = path.as_ref();
    let examined = Format::of(path).and_then(|format| examine(bytes, format));
    let mut examined = examined.map_err(|fault| in_file(path, fault))?;
    examined.file = Some(path.to_owned());
    examined.refused.iter_mut().for_each(|error| error.file.clone_from(&examined.file));
    Ok(examined)
}

/// [`read`] for arrays: the same repairs, the same orientation, the same refusals.
///
/// # Errors
/// When a coordinate is not finite, a face names a vertex that does not exist, or the surface does not bound a solid after the
/// repairs; errors name faces and vertices by their numbers from 0.
///
/// ```
/// use medial::{Vec3, surface::{self, Fault}};
///
/// let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
/// // Inside out: it is turned.
/// let loaded = surface::read_triangles(&corners, &[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])?;
/// assert_eq!(loaded.mesh.faces[0], [0, 2, 1]);
/// let open = surface::read_triangles(&corners, &[[0, 1, 2]]).unwrap_err();
/// assert!(matches!(open.fault, Fault::Open { edges: 3, .. }));
/// # Ok::<(), surface::SurfaceError>(())
/// ```
pub fn read_triangles(vertices: &[Vec3], faces: &[[u32; 3]]) -> Result<Loaded, SurfaceError> {
    inspected(soup::PolygonSoup::of_triangles(vertices, faces)?)?.solid()
}

/// Checks a mesh that was not read from a file. Nothing is repaired: repeated corners, duplicate
/// faces, unreferenced vertices and faces that are oriented the wrong way are errors.
///
/// # Errors
/// The first reason why the mesh does not bound a solid.
///
/// # Cost
/// `O(F log F)`, most of it for the self-intersections.
///
/// ```
/// use medial::{Vec3, surface::{self, TriMesh}};
///
/// let tetrahedron = TriMesh {
///     vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
///     faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
/// };
/// let report = surface::validate(&tetrahedron)?;
/// assert_eq!(report.expected_betti, Some([1, 0, 0]));
/// # Ok::<(), surface::SurfaceError>(())
/// ```
pub fn validate(mesh: &TriMesh) -> Result<SurfaceReport, SurfaceError> {
    Ok(check::examine_unrepaired(mesh)?)
}

fn examine(bytes: &[u8], format: Format) -> Result<Inspection, Fault> {
    inspected(format::parse(bytes, format)?)
}

fn inspected(mut soup: soup::PolygonSoup) -> Result<Inspection, Fault> {
    let repaired = repair::repair(&mut soup)?;
    let unit = repaired.unit;
    let mut inspection = check::orient_and_examine(repaired);
    if inspection.refused.is_some()
        || inspection.report.self_intersecting
        || solid::has_contacts(&inspection.mesh, unit)
    {
        inspection.resolved = solid::resolve(&soup, unit, &inspection).map(Box::new);
        if inspection.resolved.is_none() && inspection.refused.is_none() {
            let why = match inspection.report.self_intersecting {
                true => "the intersections were not resolved, so that results may be wrong",
                false => {
                    "bodies nearer than 1e-6 of the diagonal were not joined, so that results may be wrong"
                }
            };
            let why = format!("{why}; wrap the surface (`medial repair FILE --wrap -o OUT`)");
            inspection.report.warnings.push(why);
        }
    }
    if let Some((spacing, diagonal)) = lost_digits(&inspection.mesh) {
        let Inspection { report, refused, resolved, .. } = &mut inspection;
        let warning = report::lost_digits(spacing, diagonal);
        if let Some(error) = refused {
            let fault = Box::new(error.fault.clone());
            error.fault = Fault::LostDigits { spacing, diagonal, fault };
        }
        let resolved = resolved.iter_mut().map(|solid| &mut solid.report);
        resolved.chain([report]).for_each(|report| report.warnings.push(warning.clone()));
    }
    Ok(inspection)
}

/// The distance of neighbouring numbers in single precision at the largest coordinate, and the diagonal of the bounding
/// box, where all coordinates are such numbers and the distance is a large share of the diagonal.
fn lost_digits(mesh: &TriMesh) -> Option<(f64, f64)> {
    /// Share of the diagonal that counts as large.
    const LARGE: f64 = 1e-5;
    let mut coordinates = mesh.vertices.iter().flat_map(|vertex| vertex.to_array());
    let largest = coordinates.clone().fold(0.0_f64, |largest, x| largest.max(x.abs())) as f32;
    let spacing = f64::from(largest.next_up()) - f64::from(largest);
    let diagonal = Normalisation::of(mesh)?.diagonal;
    let is_large = spacing.is_finite() && spacing > LARGE * diagonal;
    (is_large && coordinates.all(|x| f64::from(x as f32) == x)).then_some((spacing, diagonal))
}

fn in_file(path: &Path, fault: Fault) -> SurfaceError {
    SurfaceError { file: Some(path.to_owned()), fault }
}
