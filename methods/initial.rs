//! No simplification: the initial medial mesh as it is.
//!
//! Its row in a comparison shows which errors and wrong Betti numbers belong to the common start.

use medial::shape::Shape;
use medial::simplifier::{
    Level, Method, MethodInfo, NoParams, RunContext, Simplified, SimplifyError,
};

use crate::Prepared;

/// The initial medial mesh as a method.
pub fn method() -> Method<NoParams> {
    let info = MethodInfo::new("initial", "Initial medial mesh")
        .citation("N. Amenta, M. Bern, 1999, Surface reconstruction by Voronoi filtering, doi:10.1007/PL00009475")
        .bibtex(crate::references(&["AmentaBern1999"]))
        .summary("Simplifies nothing: the inner part of the Voronoi diagram of the samples.")
        .published("the whole of it; there is no other level")
        .fixed();
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, _params: NoParams, _run: &RunContext) -> Prepared<'s> {
    let initial = shape.initial()?;
    Ok(Box::new(move |level: Level| match level {
        Level::Published => Ok(Simplified::new(initial.as_ref().clone(), level)),
        _ => Err(SimplifyError::unsupported("the only level is the published one")),
    }))
}
