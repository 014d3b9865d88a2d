//! The error of a medial mesh at its samples, and the last collapse within a bound.

use std::sync::Arc;

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion};
use medial::shape::ContactSets;
use medial::simplifier::SimplifyError;

use super::params::Inside;

/// The samples that some sphere of the initial mesh touches.
pub(super) struct SampleError {
    samples: Vec<Vec3>,
    inside: Inside,
}

impl SampleError {
    pub(super) fn new(contacts: &ContactSets, inside: Inside) -> Self {
        let all: &Arc<[Vec3]> = contacts.samples();
        let mut touched = vec![false; all.len()];
        for sphere in 0..contacts.len() {
            for &id in contacts.ids(sphere) {
                touched[id as usize] = true;
            }
        }
        let samples = all.iter().zip(&touched).filter(|&(_, &t)| t).map(|(&p, _)| p).collect();
        Self { samples, inside }
    }

    /// Largest error of a sample against the whole union, in the reading of the parameter.
    pub(super) fn of(&self, mesh: &MedialMesh) -> Result<f64, SimplifyError> {
        let broken = |error| SimplifyError::Level(format!("the union has no distances: {error}"));
        let union = MedialUnion::new(mesh).map_err(broken)?;
        let largest = |distances: Vec<f64>| distances.into_iter().fold(0.0, |m, d| d.abs().max(m));
        if self.inside == Inside::Depth {
            return Ok(largest(union.signed_batch(&self.samples)));
        }
        let spheres = MedialUnion::of_spheres(&mesh.spheres).map_err(broken)?;
        let to_spheres = spheres.unsigned_nearest_batch(&self.samples);
        let to_all = union.unsigned_nearest_batch(&self.samples);
        Ok(largest(to_all.into_iter().zip(to_spheres).map(|(a, b)| a.min(b)).collect()))
    }
}

/// The largest number of collapses up to `all` that bisection finds within a bound; none at all is
/// known to be.
pub(super) fn last_within(
    all: usize,
    mut is_within: impl FnMut(usize) -> Result<bool, SimplifyError>,
) -> Result<usize, SimplifyError> {
    if is_within(all)? {
        return Ok(all);
    }
    let (mut within, mut beyond) = (0, all);
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
