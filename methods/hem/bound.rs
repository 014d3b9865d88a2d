//! The error of a medial mesh at its samples, and the last collapse within a bound.

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, UnionError};
use medial::simplifier::SimplifyError;

use super::params::Inside;

/// Largest error of a sample against the whole union, in one of the two readings.
///
/// # Errors
/// When the mesh has no union.
pub(super) fn sample_error(
    mesh: &MedialMesh,
    samples: &[Vec3],
    inside: Inside,
) -> Result<f64, SimplifyError> {
    let none = |error: UnionError| SimplifyError::Unsupported { why: error.to_string() };
    let union = MedialUnion::new(mesh).map_err(none)?;
    let largest = |distances: Vec<f64>| distances.into_iter().fold(0.0, |m, d| d.abs().max(m));
    if inside == Inside::Depth {
        return Ok(largest(union.signed_batch(samples)));
    }
    // Of a sphere that lies in a cone the union has no surface of its own.
    let spheres = MedialUnion::of_spheres(&mesh.spheres).map_err(none)?;
    let mut distances = union.unsigned_nearest_batch(samples);
    for (distance, sphere) in distances.iter_mut().zip(spheres.unsigned_nearest_batch(samples)) {
        *distance = distance.min(sphere);
    }
    Ok(largest(distances))
}

/// A number of collapses, up to `all`, that is within a bound, while one more is not: `all` itself
/// where it is. Looked for backwards in growing steps, because the error can grow and shrink again,
/// and the latest level is the coarsest; none at all is known to be within.
///
/// # Errors
/// Those of the test.
pub(super) fn last_within(
    all: usize,
    mut is_within: impl FnMut(usize) -> Result<bool, SimplifyError>,
) -> Result<usize, SimplifyError> {
    let (mut within, mut beyond, mut step) = (all, all + 1, 1);
    while within > 0 && !is_within(within)? {
        beyond = within;
        within = within.saturating_sub(step);
        step *= 2;
    }
    while beyond - within > 1 {
        let middle = within + (beyond - within) / 2;
        if is_within(middle)? {
            within = middle;
        } else {
            beyond = middle;
        }
    }
    Ok(within)
}
