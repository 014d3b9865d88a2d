//! Keeps the largest balls of the initial medial mesh, with the edges and faces between them.

use medial::shape::Shape;
use medial::simplifier::{
    Level, Method, MethodInfo, ParamInfo, RunContext, Simplification, Simplified, SimplifyError,
};
use serde::Deserialize;

/// Lengths are fractions of the surface's bounding-box diagonal, as everywhere in a method.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    least: f64,
}

pub fn method() -> Method<Params> {
    let info = MethodInfo::new("largest-rust", "Largest balls first (Rust)")
        .citation("An example")
        .summary("Keeps the largest balls, with the edges and faces between them.")
        .param(ParamInfo::new("least", 0, "fraction of the diagonal", "least radius that is kept"));
    Method::new(info, prepare)
}

/// Timed as `prepare`; `shape.initial()` is a substrate, whose cost is told beside it.
fn prepare<'s>(
    shape: &'s Shape,
    params: Params,
    _run: &RunContext,
) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
    let initial = shape.initial()?;
    let radius = |i: usize| initial.spheres[i].radius;
    let mut order: Vec<usize> = (0..initial.spheres.len()).collect();
    order.retain(|&i| radius(i) >= params.least);
    // Equal radii by number: the same bytes always.
    order.sort_by(|&a, &b| radius(b).total_cmp(&radius(a)).then(a.cmp(&b)));
    // Timed as `simplify`, once for each level.
    Ok(Box::new(move |level: Level| {
        let Level::Spheres(count @ 1..) = level else {
            return Err(SimplifyError::unsupported("ask for a number of spheres, at least 1"));
        };
        let mut keep = vec![false; initial.spheres.len()];
        order.iter().take(count).for_each(|&i| keep[i] = true);
        Ok(Simplified::new(initial.induced(&keep), level))
    }))
}
