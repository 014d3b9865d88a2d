//! Lambda-medial axis, per sphere.
//!
//! 1. The initial medial mesh with the contact points `Pi(x)` of each sphere.
//! 2. `F(x)`, the radius of the smallest ball enclosing `Pi(x)`.
//! 3. Keep the spheres with `F >= lambda`, or the given number of spheres with the largest `F`.
//! 4. The induced subcomplex: edges and faces all of whose spheres are kept.
//!
//! # Deviations from the paper
//! - The paper's set is a closed subset of the whole axis; the filter on Voronoi vertices with the
//!   induced subcomplex can be asked for a number of spheres like every other method.

use medial::geometry::enclosing_ball;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, SimplifyError};
use rayon::prelude::*;

use crate::ranked::Ranked;

/// Ranks the spheres of the initial medial mesh. `O(n log n)`.
pub(super) fn prepare(shape: &Shape) -> Result<Ranked, SimplifyError> {
    let mesh = shape.initial()?;
    let mut diagnostics = Diagnostics::default();
    let contacts = shape.contacts(&mesh, &mut diagnostics)?;
    let value = (0..mesh.spheres.len())
        .into_par_iter()
        .map(|sphere| contacts.with(sphere, |points| enclosing_ball(points).1))
        .collect();
    let scale = super::scale(&mesh);
    Ok(Ranked::new(mesh, value, scale, diagnostics))
}
