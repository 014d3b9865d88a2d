//! One corpus for every method: what each must do on each shape, whatever it is.
//!
//! Exceptions: none at present.

use medial::complex::MedialMesh;
use medial::metrics::JudgeOptions;
use medial::shape::{Shape, ShapeOptions, Substrate};
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, SimplifyError, Work};
use medial::surface::{self, TriMesh};
use medial_methods::registry;

/// Small built-in shapes that differ in kind: thin, round, looped, hollow, sharp.
const SHAPES: [&str; 6] = ["sphere", "box", "capsule", "torus", "hollow-sphere", "bracket"];

fn built_in(id: &str) -> TriMesh {
    let shape = medial_datasets::find(id).unwrap_or_else(|| panic!("{id} is in the catalogue"));
    shape.mesh(shape.default_resolution)
}

fn shape_of(mesh: &TriMesh) -> Shape {
    let report = surface::validate(mesh).expect("built-in shapes are solids");
    Shape::new("shape", mesh, report, ShapeOptions::default()).expect("an extent")
}

fn at(method: &dyn MedialSimplifier, shape: &Shape, level: Level) -> MedialMesh {
    let run = RunContext::default();
    let mut simplification = method.prepare(shape, &Params::none(), &run).expect("prepared");
    simplification.at(level).expect("every method can be asked for spheres").mesh
}

#[test]
fn results_are_valid_and_meet_the_count_or_say_why() {
    for id in SHAPES {
        let shape = shape_of(&built_in(id));
        let initial = shape.initial().expect("an initial medial mesh");
        for method in registry() {
            let name = &method.info().id;
            let run = RunContext::default();
            let mut simplification =
                method.prepare(&shape, &Params::none(), &run).expect("prepared");
            for count in [400, 100, 20, 1] {
                let result = simplification.at(Level::Spheres(count)).expect("a count");
                result.mesh.check().unwrap_or_else(|e| panic!("{name} on {id} at {count}: {e}"));
                let reached = result.mesh.spheres.len();
                assert!(reached > 0, "{name} on {id} at {count}: nothing left");
                assert_eq!(result.asked, Level::Spheres(count));
                if reached != count.min(initial.spheres.len()) {
                    let warnings = result.diagnostics.warnings;
                    assert!(!warnings.is_empty(), "{name} on {id}: {reached} for {count}, unsaid");
                }
            }
        }
    }
}

#[test]
fn continuing_gives_what_asking_alone_gives() {
    let shape = shape_of(&built_in("torus"));
    for method in registry() {
        let run = RunContext::default();
        let mut simplification = method.prepare(&shape, &Params::none(), &run).expect("prepared");
        for count in [300, 100, 200] {
            let continued = simplification.at(Level::Spheres(count)).expect("a count");
            let alone = at(method.as_ref(), &shape, Level::Spheres(count));
            assert_eq!(continued.mesh, alone, "{} at {count}", method.info().id);
            // Nothing finer can be had by going on.
            assert!(count != 200 || continued.work != Work::Continued, "{}", method.info().id);
        }
    }
}

#[test]
fn every_method_pays_for_the_inside_test_and_the_judge_for_nothing() {
    let shape = shape_of(&built_in("capsule"));
    shape.judge(None, JudgeOptions::default()).expect("a judge");
    assert!(shape.used().is_empty());
    for method in registry() {
        let view = shape.view();
        method.prepare(&view, &Params::none(), &RunContext::default()).expect("prepared");
        let paid = view.used().iter().any(|(substrate, _)| *substrate == Substrate::InsideTest);
        assert!(paid, "{}", method.info().id);
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    for method in registry() {
        let results = [1, 2, 5].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a pool").install(|| {
                let shape = shape_of(&built_in("bracket"));
                at(method.as_ref(), &shape, Level::Spheres(150))
            })
        });
        assert_eq!(results[0], results[1], "{}", method.info().id);
        assert_eq!(results[0], results[2], "{}", method.info().id);
    }
}

#[test]
fn scale_by_a_power_of_two_changes_nothing() {
    let mesh = built_in("capsule");
    for method in registry() {
        let plain = at(method.as_ref(), &shape_of(&mesh), Level::Spheres(100));
        for scale in [1.0 / 1024.0, 4096.0] {
            let vertices = mesh.vertices.iter().map(|&v| v * scale).collect();
            let scaled = TriMesh { vertices, faces: mesh.faces.clone() };
            let result = at(method.as_ref(), &shape_of(&scaled), Level::Spheres(100));
            assert_eq!(plain, result, "{} at scale {scale}", method.info().id);
        }
    }
}

#[test]
fn unknown_parameters_and_senseless_levels_are_refused() {
    let shape = shape_of(&built_in("sphere"));
    for method in registry() {
        let name = &method.info().id;
        let mut params = Params::none();
        params.set("no_such_parameter", "1");
        let refused = method.prepare(&shape, &params, &RunContext::default());
        assert!(matches!(refused, Err(SimplifyError::Parameter(_))), "{name}");
        let run = RunContext::default();
        let mut simplification = method.prepare(&shape, &Params::none(), &run).expect("prepared");
        for level in [Level::Spheres(0), Level::Native(f64::NAN), Level::Native(-1.0)] {
            assert!(simplification.at(level).is_err(), "{name} accepted {level}");
        }
    }
}

#[test]
fn documented_defaults_are_the_defaults() {
    let shape = shape_of(&built_in("sphere"));
    for method in registry() {
        let mut params = Params::none();
        for param in &method.info().params {
            params.set(&param.name, &param.default);
        }
        let run = RunContext::default();
        let mut spelled = method.prepare(&shape, &params, &run).expect("defaults are accepted");
        let spelled = spelled.at(Level::Spheres(50)).expect("a count").mesh;
        assert_eq!(
            spelled,
            at(method.as_ref(), &shape, Level::Spheres(50)),
            "{}",
            method.info().id
        );
    }
}
