//! Angle filter on a grid, where the resolution decides the number of spheres.
//!
//! Foskey, Lin and Manocha control the size of the result by the grid: `theta` says which sheets there
//! are, the resolution how finely they are cut. A number of spheres is met by a search over the
//! resolution (`methods/size_search.rs`) at the `theta` of the parameters. It can have a fraction,
//! reported in thousandths: then the last voxels stick out of the bounding box.

use medial::shape::Shape;
use medial::simplifier::{RunContext, Simplification, SimplifyError};

use super::{AngleParams, grid};
use crate::by_knob::ByKnob;
use crate::size_search::Knob;

/// Finest lattice of a search: eight million voxels for a cube.
const FINEST: f64 = 200.0;

/// The shape on lattices of any resolution. Builds what all of them share, the tree and the inside
/// test of the surface.
pub(super) fn prepare<'s>(
    shape: &'s Shape,
    params: AngleParams,
    run: &RunContext,
) -> Result<ByKnob<'s>, SimplifyError> {
    shape.surface_tree()?;
    shape.inside_test();
    // A sheet of area A has A R^2 faces, and about as many corners.
    let knob = Knob {
        count: "resolution_in_thousandths",
        unit: "voxels along the longest side",
        range: grid::MIN_RESOLUTION..=FINEST,
        steps: 1e3,
        rate: 0.4,
        exponent: 2.0,
    };
    let run_again = run.clone();
    let at = move |value: Option<f64>| -> Result<Box<dyn Simplification>, SimplifyError> {
        let resolution = value.unwrap_or(params.resolution);
        let lattice = AngleParams { resolution, ..params };
        Ok(Box::new(grid::prepare(shape, &lattice, &run_again)?))
    };
    Ok(ByKnob::new(knob, params.theta, run, at))
}
