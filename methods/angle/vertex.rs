//! Angle filter, per sphere.
//!
//! 1. The initial medial mesh with the contact points `Pi(x)` of each sphere.
//! 2. The separation angle; for contact points at distance `r` from `x`,
//!    `S = 2 arcsin(|p - q| / 2r)`.
//! 3. Keep the spheres with `S > theta`, or the given number of spheres with the largest `S`.
//! 4. The induced subcomplex: edges and faces all of whose spheres are kept.
//!
//! # Deviations from the papers
//! - Attali and Montanvert, and Foskey et al., filter the facets of a Voronoi diagram and of a
//!   grid. This variant filters Voronoi vertices, so that it can be asked for a number of spheres
//!   like every other method.
//! - A sphere that touches the boundary at its own centre (radius zero), or in fewer than two points,
//!   has no angle; it gets `S = 0` and goes first.

use medial::geometry::separation_angle;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, SimplifyError};
use rayon::prelude::*;

use crate::ranked::Ranked;
use crate::scale::Scale;

/// Ranks the spheres of the initial medial mesh. `O(n log n)`.
pub(super) fn prepare(shape: &Shape, scale: Scale) -> Result<Ranked, SimplifyError> {
    let mesh = shape.initial()?;
    let mut diagnostics = Diagnostics::default();
    let contacts = shape.contacts(&mesh, &mut diagnostics)?;
    let value = mesh
        .spheres
        .par_iter()
        .enumerate()
        .map(|(sphere, &s)| {
            contacts.with(sphere, |points| separation_angle(s.centre, points)).to_degrees()
        })
        .collect();
    Ok(Ranked::new(mesh, value, scale, diagnostics))
}
