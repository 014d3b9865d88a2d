//! The published simplifiers of the medial axis, one module each.
//!
//! Every method implements [`medial::simplifier::MedialSimplifier`] and knows neither the others
//! nor the runner. [`registry`] lists them all; its order is the order of every table.

use medial::simplifier::MedialSimplifier;

pub mod angle;
pub mod aof;
pub mod lambda;
pub mod qmat;
mod ranked;

/// All methods, in the order of the tables.
pub fn registry() -> Vec<Box<dyn MedialSimplifier>> {
    vec![
        Box::new(angle::AngleFilter::new()),
        Box::new(lambda::LambdaMedialAxis::new()),
        Box::new(qmat::Qmat::new()),
        Box::new(aof::AverageOutwardFlux::new()),
    ]
}

/// The method with an id, or `None`.
pub fn find(id: &str) -> Option<Box<dyn MedialSimplifier>> {
    registry().into_iter().find(|method| method.info().id == id)
}
