//! The wrap of a file, checked.

use std::ops::ControlFlow;
use std::path::Path;

use super::super::check::examine_unrepaired;
use super::super::closest::TriangleBvh;
use super::super::format::{self, Format};
use super::super::inside::{InsideTest, Side};
use super::super::mesh::Unit;
use super::super::report::{Fault, Repair};
use super::super::{Inspection, SurfaceError, TriMesh, in_file, repair};
use super::wrap;
use crate::Vec3;
use crate::geometry::trees::Bounds;
use crate::geometry::{TriangleTree, triangles_meet};

/// Lengths of a wrap, as fractions of the diagonal of the input's bounding box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrapOptions {
    /// Radius of the carving ball. Smaller balls enter narrower openings and give more triangles.
    pub alpha: f64,
    /// Distance of the wrap's vertices from the input.
    pub offset: f64,
}

impl WrapOptions {
    /// Offset as a fraction of alpha, as in the authors' implementation in CGAL.
    pub const OFFSET_RATIO: f64 = 1.0 / 30.0;

    /// The usual offset for a radius.
    pub fn with_alpha(alpha: f64) -> Self {
        Self { alpha, offset: Self::OFFSET_RATIO * alpha }
    }
}

impl Default for WrapOptions {
    /// A radius of a hundredth of the diagonal.
    fn default() -> Self {
        Self::with_alpha(0.01)
    }
}

/// Excess of [`farthest`] over the largest distance, as a fraction of it.
const FARTHEST_TOLERANCE: f64 = 0.01;

/// Reads a surface of any kind, or points without faces, and wraps it: see [`wrap`]. The file may be open, not
/// manifold, one-sided, or a soup of triangles. The last repair in the report describes the wrap.
///
/// # Errors
/// When the bytes are no file of that name, there is no vertex or one that is not finite, and where [`wrap`] fails.
pub fn inspect_wrapped(
    path: impl AsRef<Path>,
    bytes: &[u8],
    options: WrapOptions,
) -> Result<Inspection, SurfaceError> {
    let path = path.as_ref();
    let wrapped = Format::of(path).and_then(|format| wrapped(bytes, format, options));
    let mut inspection = wrapped.map_err(|fault| in_file(path, fault))?;
    inspection.file = Some(path.to_owned());
    Ok(inspection)
}

fn wrapped(bytes: &[u8], format: Format, options: WrapOptions) -> Result<Inspection, Fault> {
    let mut soup = format::parse_points(bytes, format)?;
    if soup.vertices.is_empty() {
        return Err(Fault::NoFaces { vertices: 0 });
    }
    let is_cloud = soup.len() == 0;
    let (points, triangles, mut repairs, warnings) = if is_cloud {
        let own = (0..soup.vertices.len() as u32).map(|v| [v; 3]).collect();
        (soup.vertices, own, Vec::new(), soup.warnings)
    } else {
        let repaired = repair::repair(&mut soup)?;
        (repaired.vertices, repaired.faces, repaired.repairs, repaired.warnings)
    };
    let Bounds { lo, hi } = Bounds::of_points(points.iter().copied());
    // Halved first, so that it cannot overflow. One point has no diagonal.
    let diagonal = 2.0 * (0.5 * hi - 0.5 * lo).length();
    if !diagonal.is_normal() {
        return Err(Fault::Extent { diagonal });
    }
    let [alpha, offset] = [options.alpha, options.offset].map(|share| share * diagonal);
    let mesh = wrap(&points, &triangles, alpha, offset)?;
    let mut report = examine_unrepaired(&mesh)?;
    if report.self_intersecting {
        return Err(Fault::WrapCrosses);
    }
    if let Some(triangle) = first_escape(&points, &triangles, &mesh) {
        return Err(Fault::WrapMisses { triangle });
    }
    let farthest = scaled_farthest(&points, &triangles, &mesh);
    let count = triangles.len();
    let (points, triangles) = if is_cloud { (count, 0) } else { (0, count) };
    repairs.push(Repair::Wrapped { triangles, points, alpha, offset, farthest });
    report.repairs = repairs;
    report.warnings.splice(0..0, warnings);
    Ok(Inspection {
        mesh,
        report,
        refused: None,
        resolved: None,
        file: None,
        file_vertex: Vec::new(),
    })
}

/// The first triangle that is not strictly inside of a closed surface: it has a corner that is not, or meets a face.
pub(super) fn first_escape(
    points: &[Vec3],
    triangles: &[[u32; 3]],
    mesh: &TriMesh,
) -> Option<usize> {
    let sides = InsideTest::new(mesh).sides(points);
    let tree = TriangleTree::new(0..mesh.faces.len() as u32, |face| mesh.triangle(face as usize));
    triangles.iter().position(|corners| {
        let triangle = corners.map(|v| points[v as usize]);
        let mut escapes = corners.iter().any(|&v| sides[v as usize] != Side::Inside);
        tree.overlapping(triangle, |_, face| {
            // Of different surfaces, so no corner is shared.
            escapes |= triangles_meet([0, 1, 2], triangle, [3, 4, 5], face);
            if escapes { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        escapes
    })
}

/// [`farthest`] of coordinates whose squares overflow or vanish.
fn scaled_farthest(points: &[Vec3], triangles: &[[u32; 3]], mesh: &TriMesh) -> f64 {
    let unit = Unit::of(&mesh.vertices);
    let (vertices, faces) = (unit.forward_all(&mesh.vertices), mesh.faces.clone());
    let found = farthest(&unit.forward_all(points), triangles, &TriMesh { vertices, faces });
    unit.restore(Vec3::splat(found)).x
}

/// Bound on the distance of a surface's points from the triangles, at most [`FARTHEST_TOLERANCE`] above the largest one.
///
/// The distance from one triangle is convex, so over a face it is largest at a corner. Faces where this bound from the
/// triangle nearest to their centre exceeds the largest distance found are quartered.
pub(super) fn farthest(points: &[Vec3], triangles: &[[u32; 3]], mesh: &TriMesh) -> f64 {
    let corners: Vec<_> = triangles.iter().map(|t| t.map(|v| points[v as usize])).collect();
    let Ok(input) = TriangleBvh::from_triangles(&corners) else { return f64::NAN };
    let mut parts: Vec<[Vec3; 3]> = (0..mesh.faces.len()).map(|face| mesh.triangle(face)).collect();
    let mut most = 0.0_f64;
    while !parts.is_empty() {
        let centres: Vec<Vec3> = parts.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let nearest = input.closest_batch(&centres);
        most = nearest.iter().map(|closest| closest.distance).fold(most, f64::max);
        let limit = most * (1.0 + FARTHEST_TOLERANCE);
        let open = parts.iter().zip(nearest).filter(|(part, closest)| {
            part.iter().any(|&corner| input.distance_from_face(corner, closest.face) > limit)
        });
        parts = open.flat_map(|(part, _)| quartered(*part)).collect();
    }
    most * (1.0 + FARTHEST_TOLERANCE)
}

fn quartered([a, b, c]: [Vec3; 3]) -> [[Vec3; 3]; 4] {
    let [ab, bc, ca] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}
