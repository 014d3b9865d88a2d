//! The substrates that methods use of a shape. The requirements on every method are in the corpus of
//! `medial check` (`bench/check`).

use medial::metrics::JudgeOptions;
use medial::shape::{Shape, ShapeOptions, Substrate};
use medial::simplifier::{Params, Registered, RunContext};
use medial::surface;
use medial_methods::registry;

#[test]
fn every_method_pays_for_the_inside_test_and_the_judge_for_nothing() {
    let solid = medial_datasets::find("capsule").expect("in the catalogue");
    let mesh = solid.mesh(solid.default_resolution);
    let report = surface::validate(&mesh).expect("built-in shapes are solids");
    let shape = Shape::new("capsule", &mesh, report, ShapeOptions::default()).expect("an extent");
    shape.judge(None, JudgeOptions::default()).expect("a judge");
    assert!(shape.used().is_empty());
    let usual = registry().into_iter().filter(|entry| !entry.presentation.on_request);
    for Registered { method, .. } in usual {
        let view = shape.view();
        method.prepare(&view, &Params::none(), &RunContext::default()).expect("prepared");
        let paid = view.used().iter().any(|(substrate, _)| *substrate == Substrate::InsideTest);
        assert!(paid, "{}", method.info().id);
    }
}
