//! Reconstructions and how far they are from the surface.

use std::path::Path;

use medial::complex::{ContourError, MedialMesh, union_surface};
use medial::shape::Shape;
use medial::surface::{SignedDistance, TriMesh};

use crate::exit::Failure;

/// The boundary of a union, and the signed distance of its vertices from the surface, in its diagonals.
pub struct Deviation {
    pub mesh: TriMesh,
    /// Positive outside.
    pub values: Vec<f64>,
}

impl Deviation {
    pub fn max(&self) -> f64 {
        self.values.iter().copied().map(f64::abs).fold(0.0, f64::max)
    }

    pub fn mean(&self) -> f64 {
        self.values.iter().copied().map(f64::abs).sum::<f64>() / self.values.len().max(1) as f64
    }
}

/// Makes the reconstruction of a medial mesh in diagonals of the surface, and measures it.
pub fn deviation(
    shape: &Shape,
    path: &Path,
    axis: &MedialMesh,
    tolerance: f64,
) -> Result<Deviation, Failure> {
    let made = union_surface(axis, tolerance).map_err(|error| match error {
        ContourError::TooFine { tolerance, feasible, .. } => Failure::usage(format!(
            "--tolerance {tolerance} is too fine for {}; {feasible:.1e} is feasible", path.display()
        )),
        ContourError::TooThin { feasible, .. } => Failure::usage(format!(
            "--tolerance {tolerance}: no sphere of {} is thick enough to show; {feasible:.1e} would show the largest", path.display()
        )),
        other => Failure::input(format!("{}: {other}", path.display())),
    })?;
    let tree = shape.surface_tree().map_err(Failure::input)?;
    let inside = shape.inside_test();
    let values = SignedDistance::closed(&tree, &inside).batch(&made.mesh.vertices);
    Ok(Deviation { mesh: made.mesh, values })
}
