//! The error of a medial mesh, and the last collapse within a bound.

use std::sync::Arc;

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, UnionError};
use medial::metrics::{EnvelopeOptions, MetricError, sample_envelope};
use medial::simplifier::SimplifyError;
use medial::surface::TriangleBvh;

use super::params::Inside;

/// Samples on the boundary of the union, about.
const ENVELOPE: usize = 20_000;
/// A point deeper in some primitive, in diagonals, is not on the boundary of the union.
const BURIAL: f64 = 1e-7;
/// States that are measured, spread over all, before a bound is refused.
const SPREAD: usize = 16;

/// What measures a medial mesh. Lengths are fractions of the diagonal.
pub(super) struct Ruler {
    /// The samples that spheres answer for.
    pub samples: Vec<Vec3>,
    /// The reading at samples inside the union.
    pub inside: Inside,
    /// The surface, where the other direction counts too.
    pub surface: Option<Arc<TriangleBvh>>,
}

impl Ruler {
    /// The largest error: of a sample against the whole union, and with two sides of a point of the
    /// union's boundary against the surface.
    ///
    /// # Errors
    /// When the mesh has no union.
    pub(super) fn error(&self, mesh: &MedialMesh) -> Result<f64, SimplifyError> {
        let union = MedialUnion::new(mesh).map_err(no_union)?;
        let at_samples = sample_error(mesh, &union, &self.samples, self.inside)?;
        let Some(surface) = &self.surface else {
            return Ok(at_samples);
        };
        let options = EnvelopeOptions { samples: ENVELOPE, burial: BURIAL, seed: 0 };
        let boundary = sample_envelope(mesh, &union, &options).map_err(no_boundary)?;
        let nearest = surface.closest_batch(&boundary);
        Ok(nearest.iter().map(|n| n.distance).fold(at_samples, f64::max))
    }
}

fn no_union(error: UnionError) -> SimplifyError {
    SimplifyError::Unsupported { why: error.to_string() }
}

fn no_boundary(error: MetricError) -> SimplifyError {
    SimplifyError::Unsupported { why: error.to_string() }
}

/// Largest error of a sample against the whole union, in one of the two readings.
fn sample_error(
    mesh: &MedialMesh,
    union: &MedialUnion,
    samples: &[Vec3],
    inside: Inside,
) -> Result<f64, SimplifyError> {
    let largest = |distances: Vec<f64>| distances.into_iter().fold(0.0, |m, d| d.abs().max(m));
    if inside == Inside::Depth {
        return Ok(largest(union.signed_batch(samples)));
    }
    // Of a sphere that lies in a cone the union has no surface of its own.
    let spheres = MedialUnion::of_spheres(&mesh.spheres).map_err(no_union)?;
    let mut distances = union.unsigned_nearest_batch(samples);
    for (distance, sphere) in distances.iter_mut().zip(spheres.unsigned_nearest_batch(samples)) {
        *distance = distance.min(sphere);
    }
    Ok(largest(distances))
}

/// What a search for a bound came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Found {
    /// So many collapses are within the bound, one more is not or is not there.
    Within(usize),
    /// None of the states that were measured is.
    None {
        /// Collapses of the state of least error.
        best: usize,
        /// That error.
        error: f64,
        /// Number of states that were measured.
        measured: usize,
    },
}

/// The last number of collapses, up to `all`, that is within a bound, as far as it is looked for.
///
/// The error grows and shrinks again, and the initial mesh need not have the least one. So states are
/// measured backwards from the last in growing steps; where even the first is beyond the bound, more
/// that are spread over all; and from the first that is within, bisection finds one that the next
/// collapse takes beyond.
///
/// # Errors
/// Those of the measurement.
pub(super) fn last_within(
    all: usize,
    bound: f64,
    mut error_at: impl FnMut(usize) -> Result<f64, SimplifyError>,
) -> Result<Found, SimplifyError> {
    let (mut best, mut measured) = ((f64::INFINITY, 0), 0);
    let mut is_within = |collapses: usize| {
        let error = error_at(collapses)?;
        measured += 1;
        if error < best.0 {
            best = (error, collapses);
        }
        Ok::<bool, SimplifyError>(error <= bound)
    };
    let (mut within, mut beyond, mut step) = (all, all + 1, 1);
    let mut is_found = is_within(within)?;
    while !is_found && within > 0 {
        beyond = within;
        within = within.saturating_sub(step);
        step *= 2;
        is_found = is_within(within)?;
    }
    for k in (1..SPREAD).rev() {
        if is_found {
            break;
        }
        (within, beyond) = (all * k / SPREAD, all * (k + 1) / SPREAD);
        is_found = within < beyond && is_within(within)?;
    }
    while is_found && beyond - within > 1 {
        let middle = within + (beyond - within) / 2;
        if is_within(middle)? {
            within = middle;
        } else {
            beyond = middle;
        }
    }
    let none = Found::None { best: best.1, error: best.0, measured };
    Ok(if is_found { Found::Within(within) } else { none })
}
