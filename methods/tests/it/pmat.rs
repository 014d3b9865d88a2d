//! PMAT on the medial meshes of sampled solids, and uses of a hierarchy.

use std::sync::Arc;

use medial::complex::collapse::{CollapseComplex, Hierarchy};
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplification};
use medial_methods::pmat;

use crate::common::shape;

fn prepare(shape: &Shape) -> Box<dyn Simplification + '_> {
    pmat::method().prepare(shape, &Params::none(), &RunContext::default()).expect("prepared")
}

fn hierarchy(shape: &Shape) -> Arc<Hierarchy> {
    let end = prepare(shape).at(Level::Published).expect("the end");
    end.extras.get_shared().expect("PMAT has a hierarchy")
}

#[test]
fn levels_are_those_of_the_collapse_engine() {
    let shape = shape("bracket", 8);
    let hierarchy = hierarchy(&shape);
    let initial = hierarchy.initial();
    let last = hierarchy.steps().len();
    let mut complex = CollapseComplex::from_mesh(initial);
    for (stage, step) in hierarchy.steps().iter().enumerate() {
        if [0, 1, last / 3, last / 2, last - 3].contains(&stage) {
            assert_eq!(hierarchy.mesh(stage), complex.to_mesh(), "{stage}");
        }
        complex.collapse(step.kept, step.removed, initial.spheres[step.kept as usize]);
    }
    assert_eq!(hierarchy.mesh(last), complex.to_mesh());
}

#[test]
fn the_published_level_is_the_least_published_scale_and_says_so() {
    let shape = shape("bracket", 8);
    let mut simplification = prepare(&shape);
    let published = simplification.at(Level::Published).expect("a scale");
    assert!(published.diagnostics.warnings[0].contains("leaves the scale to the user"));
    let by_scale = simplification.at(Level::Native(1.18)).expect("a scale");
    assert_eq!(published.mesh, by_scale.mesh);
    let initial = shape.initial().expect("an initial medial mesh").spheres.len();
    assert!((2..initial).contains(&published.mesh.spheres.len()));
}
