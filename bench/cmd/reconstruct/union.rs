//! The boundary of the union of spheres, cones and slabs.
//!
//! Where no tolerance is asked, the surface is made coarsely first, and more finely until it has the
//! union's topology: a few large spheres need no fine one.

use medial::complex::{ContourError, MedialMesh, MedialUnion, UnionSurface, union_surface};
use medial::metrics::union_betti;
use medial::shape::{Cost, Shape};
use medial::surface::{self, Normalisation, TriMesh};
use serde_json::{Map, Value};

use super::{Arguments, Made, Said, Stages, betti_of, face_centres, no_axis};
use crate::exit::Failure;
use crate::output::counted;

/// Balls that stand for the union where its topology is asked are so far apart, in tolerances.
const BALL_SPACING: f64 = 0.5;

/// Tolerances that are tried first where none is asked for.
const COARSE: [f64; 2] = [0.04, 0.02];

/// The tolerance where these show too little.
const FINE: f64 = 0.01;

/// Faces of a surface that was made without asking for a tolerance are this near to the union.
const FACES_WITHIN: f64 = 0.005;

/// The boundary of the union of spheres, cones and slabs.
pub fn surface_of(
    arguments: &Arguments,
    shape: Option<&Shape>,
    axis: Option<&MedialMesh>,
    stages: &mut Stages,
) -> Result<Made, Failure> {
    let (Some(axis), Some(path)) = (axis, &arguments.axis) else { return Err(no_axis()) };
    let of_file = |message: String| Failure::input(format!("{}: {message}", path.display()));
    let union = MedialUnion::new(axis).map_err(|error| of_file(error.to_string()))?;
    let (lo, hi) = union.bounding_box();
    let corners = TriMesh { vertices: vec![lo, hi], faces: vec![] };
    let diagonal = shape.map(|s| s.normalisation().diagonal);
    let of_balls = || Normalisation::of(&corners).map(|n| n.diagonal);
    let diagonal = diagonal
        .or_else(of_balls)
        .ok_or_else(|| of_file("its spheres have no extent, or one that is not finite".into()))?;
    let (made, lap) = Cost::of(|| fitting_surface(axis, &union, diagonal, arguments.tolerance));
    stages.add("reconstruct", lap);
    let Fitting { made, tolerance, off, betti } =
        made.map_err(|error| of_file(contour_error(error, diagonal)))?;
    let mut warnings = Vec::new();
    if made.lost > 0 {
        warnings.push(format!(
            "{} with a radius below {:.1e} of the diagonal: where the union is as thin, parts of it may be \
             missing; a finer --tolerance shows more",
            counted(made.lost as u64, "sphere"),
            made.smallest / diagonal
        ));
    }
    let more = Map::from_iter([
        ("tetrahedra".to_owned(), Value::from(made.tetrahedra)),
        ("lost".to_owned(), Value::from(made.lost)),
        ("faces_to_union".to_owned(), Value::from(off)),
    ]);
    let said = Said { diagonal, tolerance, union: betti, more };
    Ok(Made { mesh: made.mesh, said, warnings })
}

/// A surface of a union at the tolerance that was taken.
pub struct Fitting {
    /// The surface.
    pub made: UnionSurface,
    /// The tolerance, in diagonals.
    pub tolerance: f64,
    /// Largest distance of a face's centre from the union, in diagonals.
    pub off: f64,
    /// Betti numbers of the union, where there are not too many balls to tell.
    pub betti: Option<[u64; 3]>,
}

/// The surface of a union at a tolerance in diagonals, or at the coarsest that shows what there is.
///
/// # Errors
/// When the tolerance is too fine or too coarse for this union: which one would do.
pub fn fitting_surface(
    axis: &MedialMesh,
    union: &MedialUnion,
    diagonal: f64,
    asked: Option<f64>,
) -> Result<Fitting, ContourError> {
    let finest = asked.unwrap_or(FINE);
    // There may be too many balls to tell.
    let betti = union_betti(axis, BALL_SPACING * finest * diagonal).ok();
    let at = |tolerance: f64| -> Result<Fitting, ContourError> {
        let made = union_surface(axis, tolerance * diagonal)?;
        let off = union.signed_batch(&face_centres(&made.mesh)).into_iter().map(f64::abs);
        let off = off.fold(0.0, f64::max) / diagonal;
        Ok(Fitting { made, tolerance, off, betti })
    };
    let shows_all = |fitting: &Fitting| {
        let found = surface::validate(&fitting.made.mesh).ok().and_then(|report| betti_of(&report));
        fitting.off <= FACES_WITHIN && found.is_some() && found == betti
    };
    let coarse = if asked.is_none() { &COARSE[..] } else { &[] };
    for &tolerance in coarse {
        match at(tolerance) {
            Ok(fitting) if shows_all(&fitting) => return Ok(fitting),
            Ok(_) | Err(ContourError::TooThin { .. }) => {}
            Err(other) => return Err(other),
        }
    }
    at(finest)
}

fn contour_error(error: ContourError, diagonal: f64) -> String {
    match error {
        ContourError::TooFine { tolerance, most, feasible } => format!(
            "--tolerance {} needs more than {most} tetrahedra, or finer ones than there are; \
             --tolerance {:.1e} is feasible",
            tolerance / diagonal,
            feasible / diagonal
        ),
        ContourError::TooThin { feasible, .. } => format!(
            "no sphere is thick enough to show; --tolerance {:.1e} would show the largest",
            feasible / diagonal
        ),
        other => other.to_string(),
    }
}
