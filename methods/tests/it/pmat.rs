//! PMAT on the medial meshes of sampled solids.

use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplification};
use medial_methods::pmat;

use crate::common::shape;

fn prepare(shape: &Shape) -> Box<dyn Simplification + '_> {
    pmat::method().prepare(shape, &Params::none(), &RunContext::default()).expect("prepared")
}

#[test]
fn the_published_level_is_the_least_published_scale_and_says_so() {
    let shape = shape("bracket", 8);
    let mut simplification = prepare(&shape);
    let published = simplification.at(Level::Published).expect("a scale");
    assert!(published.diagnostics.warnings[0].contains("names no default scale"));
    let by_scale = simplification.at(Level::Native(1.18)).expect("a scale");
    assert_eq!(published.mesh, by_scale.mesh);
    let initial = shape.initial().expect("an initial medial mesh").spheres.len();
    assert!((2..initial).contains(&published.mesh.spheres.len()));
}
