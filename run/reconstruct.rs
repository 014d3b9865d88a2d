//! A surface from a medial mesh: the boundary of its union, or the power crust.

use std::cell::LazyCell;

use medial::Vec3;
use medial::complex::{ContourError, MedialMesh, MedialUnion, UnionSurface, union_surface};
use medial::geometry::PowerCrust;
use medial::metrics::union_betti;
use medial::shape::{Shape, ShapeError};
use medial::surface::{self, Normalisation, SurfaceReport, TriMesh};
use serde::Serialize;

use crate::error::InputError;
use crate::text::{counted, significant};

/// A reconstructed surface in input units, with its diagnostics.
pub struct Reconstruction {
    /// The surface.
    pub mesh: TriMesh,
    /// The unit of the tolerance, in input units.
    pub diagonal: f64,
    /// Largest distance to the reconstructed set, as a fraction of the diagonal.
    pub tolerance: f64,
    /// Betti numbers of the union, where they are known.
    pub union_betti: Option<[u64; 3]>,
    /// Figures of this kind of surface only.
    pub figures: Figures,
    /// One sentence each.
    pub warnings: Vec<String>,
}

/// Figures of one kind of surface.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Figures {
    /// Of the boundary of a union.
    Union {
        /// Tetrahedra of the grid.
        tetrahedra: usize,
        /// Spheres too small for the grid.
        lost: usize,
        /// Largest distance of a face's centre from the union, as a fraction of the diagonal.
        faces_to_union: f64,
    },
    /// Of a power crust.
    PowerCrust {
        /// Inner balls.
        inner: usize,
        /// Outer poles.
        outer: usize,
        /// Poles without a ball of finite size.
        rejected: usize,
        /// Facets between inner and outer cells.
        facets: usize,
        /// Corners that were merged with a coincident one.
        merged: usize,
        /// Boundary samples.
        samples: usize,
        /// Their sampling.
        sampling: String,
    },
}

/// An error of the contour, with tolerances as fractions of the diagonal. A feasible tolerance can be much larger than
/// necessary, so `usual` comes first.
pub fn contour_error(error: ContourError, diagonal: f64, usual: f64) -> InputError {
    InputError::option(match error {
        ContourError::TooFine { tolerance, most, feasible } => {
            let [tolerance, feasible] = [tolerance, feasible].map(|length| length / diagonal);
            let advised = feasible.min(if tolerance < usual { usual } else { 1.0 });
            let advice = match advised > tolerance && feasible < HOPELESS {
                true => format!("give a tolerance of {advised:.1e}"),
                false => "no tolerance works; check the units of the medial mesh".to_owned(),
            };
            let tolerance = significant(tolerance, 4);
            format!("tolerance {tolerance} is too fine (more than {most} tetrahedra); {advice}")
        }
        ContourError::TooThin { feasible, .. } => format!(
            "every sphere is too thin for this tolerance; give a tolerance of {:.1e} for the largest, or larger radii",
            feasible / diagonal
        ),
        other => return InputError::input(other),
    })
}

/// Tolerances are at most 1. Feasible ones can be larger than the least that works by this factor.
const HOPELESS: f64 = 5.0;

/// Corners of a power crust that are nearer than this along it are merged, as a fraction of the diagonal.
const COINCIDENT: f64 = 1e-6;

/// The power crust of the spheres of a medial mesh in input units, or of all inner poles, and of the outer poles.
///
/// # Errors
/// When the surface has no poles, or no inner ball has a cell.
pub fn power_crust(shape: &Shape, axis: Option<&MedialMesh>) -> Result<Reconstruction, InputError> {
    let balls = shape.polar_balls().map_err(InputError::input)?;
    let units = shape.normalisation();
    let inner = match axis {
        Some(axis) => axis.to_normal(units).spheres,
        None => balls.inner,
    };
    let crust = PowerCrust::new(&inner, &balls.outer).map_err(InputError::input)?;
    let facets = crust.facet_count();
    let mut crust = surface::crust_surface(&crust, COINCIDENT);
    // A medial mesh in other units lies outside of all cells.
    if crust.mesh.faces.is_empty() {
        let why = "no inner ball has a power cell; check surface and units of the medial mesh";
        return Err(InputError::input(why));
    }
    crust.mesh.vertices.iter_mut().for_each(|vertex| *vertex = units.backward(*vertex));
    let figures = Figures::PowerCrust {
        inner: inner.len(),
        outer: balls.outer.len(),
        rejected: balls.rejected,
        facets,
        merged: crust.contracted,
        samples: shape.samples().len(),
        sampling: shape.options().sampling.to_string(),
    };
    let (diagonal, tolerance) = (units.diagonal, COINCIDENT);
    let (mesh, union_betti, warnings) = (crust.mesh, None, vec![]);
    Ok(Reconstruction { mesh, diagonal, tolerance, union_betti, figures, warnings })
}

/// The boundary of the union of spheres, cones and slabs, at a tolerance in diagonals, or at the coarsest one with the
/// topology of the union. Without a diagonal, that of the union's box is the unit.
///
/// # Errors
/// When there is no union, or the tolerance is too fine or too coarse for it, with a feasible one.
pub fn union_boundary(
    axis: &MedialMesh,
    diagonal: Option<f64>,
    tolerance: Option<f64>,
) -> Result<Reconstruction, InputError> {
    let union = MedialUnion::new(axis).map_err(InputError::input)?;
    let (low, high) = union.bounding_box();
    let corners = TriMesh { vertices: vec![low, high], faces: vec![] };
    let diagonal = diagonal.or_else(|| Normalisation::of(&corners).map(|units| units.diagonal));
    let why = "the extent of the spheres is zero or not finite";
    let diagonal = diagonal.ok_or_else(|| InputError::input(why))?;
    // Squares of tiny lengths would underflow.
    let unit = axis.unit();
    let (axis, diagonal) = (axis.transformed(1.0 / unit, |p| p / unit), diagonal / unit);
    let fitting = fitting_surface(&axis, diagonal, tolerance);
    let Fitting { mut made, tolerance, off, betti } =
        fitting.map_err(|error| contour_error(error, diagonal, FINE))?;
    let mut warnings = Vec::new();
    if made.lost > 0 {
        warnings.push(format!(
            "{} with a radius below {:.1e} of the diagonal: thin parts of the union may be missing; give a \
             smaller tolerance",
            counted(made.lost, "sphere", "spheres"),
            made.smallest / diagonal
        ));
    }
    let figures =
        Figures::Union { tetrahedra: made.tetrahedra, lost: made.lost, faces_to_union: off };
    made.mesh.vertices.iter_mut().for_each(|vertex| *vertex *= unit);
    let (mesh, union_betti, diagonal) = (made.mesh, betti, diagonal * unit);
    Ok(Reconstruction { mesh, diagonal, tolerance, union_betti, figures, warnings })
}

/// Spacing of the balls that replace the union for its topology, in tolerances.
const BALL_SPACING: f64 = 0.5;

/// The first tolerances without `--tolerance`.
const COARSE: [f64; 2] = [0.04, 0.02];

/// The last tolerance without `--tolerance`.
const FINE: f64 = 0.01;

/// Without `--tolerance`, all faces are within this distance of the union, in diagonals.
const FACES_WITHIN: f64 = 0.005;

/// A surface of a union at the tolerance that was taken.
struct Fitting {
    /// The surface.
    made: UnionSurface,
    /// The tolerance, in diagonals.
    tolerance: f64,
    /// Largest distance of a face's centre from the union, in diagonals.
    off: f64,
    /// Betti numbers of the union; `None` for too many balls.
    betti: Option<[u64; 3]>,
}

/// The surface of a union at a tolerance in diagonals, or at the coarsest with the right topology.
fn fitting_surface(
    axis: &MedialMesh,
    diagonal: f64,
    tolerance: Option<f64>,
) -> Result<Fitting, ContourError> {
    let union = MedialUnion::new(axis)?;
    let finest = tolerance.unwrap_or(FINE);
    // Fails for too many balls. Not before the surface, which is refused sooner.
    let betti = LazyCell::new(|| union_betti(axis, BALL_SPACING * finest * diagonal).ok());
    let at = |tolerance: f64| -> Result<Fitting, ContourError> {
        let made = union_surface(axis, tolerance * diagonal)?;
        let off = union.signed_batch(&face_centres(&made.mesh)).into_iter().map(f64::abs);
        let off = off.fold(0.0, f64::max) / diagonal;
        Ok(Fitting { made, tolerance, off, betti: *betti })
    };
    let shows_all = |fitting: &Fitting| {
        let found = surface::validate(&fitting.made.mesh).ok().and_then(|report| betti_of(&report));
        fitting.off <= FACES_WITHIN && found.is_some() && found == fitting.betti
    };
    let coarse = if tolerance.is_none() { &COARSE[..] } else { &[] };
    // Coarse first: each halving costs eight times the cells.
    for &tolerance in coarse {
        match at(tolerance) {
            Ok(fitting) if shows_all(&fitting) => return Ok(fitting),
            Ok(_) | Err(ContourError::TooThin { .. }) => {}
            Err(other) => return Err(other),
        }
    }
    at(finest)
}

fn face_centres(mesh: &TriMesh) -> Vec<Vec3> {
    (0..mesh.faces.len()).map(|f| mesh.triangle(f).into_iter().sum::<Vec3>() / 3.0).collect()
}

/// The Betti numbers of the solid that a closed surface bounds.
pub fn betti_of(report: &SurfaceReport) -> Option<[u64; 3]> {
    Some(report.expected_betti?.map(|b| b as u64))
}

/// The largest and the mean distance of a surface's vertices and face centres from the mesh of a
/// shape, as fractions of its diagonal.
///
/// # Errors
/// When the surface has no tree.
pub fn deviation(shape: &Shape, mesh: &TriMesh) -> Result<[f64; 2], ShapeError> {
    let to_normal = shape.normalisation();
    let points = mesh.vertices.iter().copied().chain(face_centres(mesh));
    let points: Vec<_> = points.map(|p| to_normal.forward(p)).collect();
    let distances = shape.surface_tree()?.distance_batch(&points);
    let max = distances.iter().copied().fold(0.0, f64::max);
    Ok([max, distances.iter().sum::<f64>() / distances.len() as f64])
}
