//! The error of a medial mesh, and the search for the last collapse within a bound.

use std::sync::Arc;

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, UnionError};
use medial::metrics::{EnvelopeOptions, MetricError, sample_envelope};
use medial::simplifier::SimplifyError;
use medial::surface::TriangleBvh;

use super::params::Inside;

/// Approximate number of samples on the boundary of the union.
const ENVELOPE_SAMPLES: usize = 20_000;
/// A point deeper than this in some primitive, in diagonals, is not on the boundary of the union.
const MAX_BURIAL: f64 = 1e-7;
/// Number of evenly spread states that are measured before a bound is refused.
const SPREAD_STATES: usize = 16;

/// Measures medial meshes. Lengths are fractions of the diagonal.
pub(super) struct Ruler {
    /// The samples that some sphere is responsible for.
    pub samples: Vec<Vec3>,
    /// The error of a sample inside the union.
    pub inside: Inside,
    /// The surface, if the other direction counts too.
    pub surface: Option<Arc<TriangleBvh>>,
}

impl Ruler {
    /// The largest error of a sample against the whole union; with two sides also that of a point on
    /// the union's boundary against the surface.
    ///
    /// # Errors
    /// When the mesh has no union.
    pub(super) fn error(&self, mesh: &MedialMesh) -> Result<f64, SimplifyError> {
        let union = MedialUnion::new(mesh).map_err(no_union)?;
        let at_samples = sample_error(mesh, &union, &self.samples, self.inside)?;
        let Some(surface) = &self.surface else {
            return Ok(at_samples);
        };
        let options = EnvelopeOptions { samples: ENVELOPE_SAMPLES, burial: MAX_BURIAL, seed: 0 };
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
    // The union leaves out spheres inside cones, but their surfaces count in this reading.
    let spheres = MedialUnion::of_spheres(&mesh.spheres).map_err(no_union)?;
    let mut distances = union.unsigned_nearest_batch(samples);
    for (distance, sphere) in distances.iter_mut().zip(spheres.unsigned_nearest_batch(samples)) {
        *distance = distance.min(sphere);
    }
    Ok(largest(distances))
}

/// The result of a search for a bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Found {
    /// After this many collapses the mesh is within the bound; one more exceeds it or does not exist.
    Within(usize),
    /// No measured state is within the bound.
    None {
        /// Collapses of the state of least error.
        best: usize,
        /// That error.
        error: f64,
        /// Number of states that were measured.
        measured: usize,
    },
}

/// A large number of collapses, up to `all`, after which the mesh is within a bound, such that one
/// more exceeds it.
///
/// The error is not monotone, and the initial mesh need not have the least one. So states are
/// measured backwards from the last in growing steps. If even the initial mesh exceeds the bound,
/// states spread over all collapses are measured. From the first state within the bound, bisection
/// finds one whose next collapse exceeds it.
///
/// # Errors
/// Those of the measurement.
pub(super) fn last_within(
    all: usize,
    bound: f64,
    mut error_at: impl FnMut(usize) -> Result<f64, SimplifyError>,
) -> Result<Found, SimplifyError> {
    let (mut best, mut measured) = ((f64::INFINITY, 0), 0);
    // Remembers the best state, for the message of a refusal.
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
    // From coarse to fine, so that the first state within is the coarsest of them.
    for k in (1..SPREAD_STATES).rev() {
        if is_found {
            break;
        }
        (within, beyond) = (all * k / SPREAD_STATES, all * (k + 1) / SPREAD_STATES);
        is_found = within < beyond && is_within(within)?;
    }
    // Invariant: `within` was measured and holds the bound; `beyond` exceeds it or is `all + 1`.
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
