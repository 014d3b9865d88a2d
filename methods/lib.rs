//! The published simplifiers of the medial axis, one module each.
//!
//! Every method implements [`medial::simplifier::MedialSimplifier`] and knows neither the others
//! nor the runner. [`registry`] lists them all; its order is the order of every table.

use medial::simplifier::MedialSimplifier;

pub mod angle;
pub mod aof;
pub mod dey_zhao;
pub mod hem;
pub mod initial;
pub mod lambda;
mod perturb;
pub mod pmat;
pub mod qmat;
mod ranked;
mod ranked_facets;
mod reuse;
pub mod sat;
pub mod sat_pairwise;
mod sheets;
pub mod tam_heidrich;

/// All methods, in the order of the tables.
pub fn registry() -> Vec<Box<dyn MedialSimplifier>> {
    vec![
        Box::new(initial::method()),
        Box::new(angle::method()),
        Box::new(lambda::method()),
        Box::new(dey_zhao::method()),
        Box::new(qmat::method()),
        Box::new(pmat::method()),
        Box::new(hem::method()),
        Box::new(sat::method()),
        Box::new(sat_pairwise::method()),
        Box::new(tam_heidrich::method()),
        Box::new(aof::method()),
    ]
}

/// The method with an id, or `None`.
pub fn find(id: &str) -> Option<Box<dyn MedialSimplifier>> {
    registry().into_iter().find(|method| method.info().id == id)
}
