//! The power crust ([`PowerCrust`]) as a surface.

use super::{Contraction, Folds, TriMesh, contract_short_edges_while};
use crate::geometry::PowerCrust;

impl From<&PowerCrust> for TriMesh {
    /// The crust as triangles, on all of its corners.
    fn from(crust: &PowerCrust) -> Self {
        Self { vertices: crust.corners().to_vec(), faces: crust.triangles() }
    }
}

/// A power crust as triangles, with corners at one position merged along the edges between them.
///
/// Corners nearer than `coincident`, in the unit of the balls, are at one position; above the level of
/// rounding, which flat groups of balls amplify to some 1e-8 of the diagonal, any value well below
/// the distance of samples will do. `O(n log n)`.
pub fn crust_surface(crust: &PowerCrust, coincident: f64) -> Contraction {
    crust_surface_while(crust, coincident, || true).expect("nobody stops it")
}

/// [`crust_surface`] for as long as `go_on` says so, which is asked every few thousand edges;
/// `None` if it was stopped.
pub fn crust_surface_while(
    crust: &PowerCrust,
    coincident: f64,
    go_on: impl FnMut() -> bool,
) -> Option<Contraction> {
    let limits = vec![coincident; crust.corners().len()];
    contract_short_edges_while(&crust.into(), &limits, Folds::Ignored, go_on)
}
