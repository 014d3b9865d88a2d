//! The published simplifiers of the medial axis, one module each, and one of this project.
//!
//! Every method implements [`medial::simplifier::MedialSimplifier`] and knows neither the others
//! nor the runner. [`registry`] lists the published ones, in the order of every table;
//! [`on_request`] has what runs only where it is named.

use medial::simplifier::MedialSimplifier;

pub mod angle;
pub mod aof;
mod by_knob;
pub mod coverage_axis;
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
mod scale;
mod sheets;
mod size_search;
pub mod tam_heidrich;
mod ties;
pub mod tight;
pub mod vmas;
mod within;

/// The published methods, in the order of the tables.
pub fn registry() -> Vec<Box<dyn MedialSimplifier>> {
    vec![
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
        Box::new(coverage_axis::method(qmat::keeping)),
    ]
}

/// Methods that run where they are named, because they take long.
pub fn on_request() -> Vec<Box<dyn MedialSimplifier>> {
    vec![Box::new(vmas::method()), Box::new(tight::method(qmat::method()))]
}

/// The method with an id, or `None`. [`initial`] simplifies nothing and is not among them.
pub fn find(id: &str) -> Option<Box<dyn MedialSimplifier>> {
    registry().into_iter().chain(on_request()).find(|method| method.info().id == id)
}

#[cfg(test)]
mod tests {
    use super::registry;

    #[test]
    fn default_sweeps_go_from_fine_to_coarse_wherever_there_is_a_native_level() {
        for method in registry() {
            let info = method.info();
            let Some(native) = &info.native else {
                assert!(info.sweep.is_empty(), "{}: levels of no scalar", info.id);
                continue;
            };
            assert!(info.sweep.len() >= 3, "{}: {:?}", info.id, info.sweep);
            let is_coarser = |pair: &[f64]| match native.larger_is_coarser {
                true => pair[0] < pair[1],
                false => pair[0] > pair[1],
            };
            assert!(info.sweep.windows(2).all(is_coarser), "{}: {:?}", info.id, info.sweep);
        }
    }
}

#[cfg(doctest)]
#[doc = include_str!("README.md")]
struct Readme;
