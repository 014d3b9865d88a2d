//! Proofs of the three fits, closed forms, and bad levels.

use medial::Vec3;
use medial::metrics::CoverTest;
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplified, SimplifyError};

use super::{BEYOND, CoverParams, Fit, method};
use crate::{test_cuboid as cuboid, test_shape};

fn run(shape: &Shape, fit: &str, level: Level) -> Result<Simplified, SimplifyError> {
    let mut params = Params::none();
    params.set("fit", fit);
    method().prepare(shape, &params, &RunContext::default())?.at(level)
}

/// The upper ends of both certified errors.
fn errors(shape: &Shape, result: &Simplified) -> [f64; 2] {
    let (tree, inside) = (shape.surface_tree().expect("a tree"), shape.inside_test());
    let test = CoverTest::new(shape.mesh(), &tree, &inside);
    let balls = &result.mesh.spheres;
    [test.uncovered(balls, 1e-4), test.overshoot(balls, 1e-4)].map(|e| e.expect("balls").upper)
}

/// The parameter had another name before.
#[test]
fn the_old_word_for_the_fit_is_accepted() {
    let mut params = Params::none();
    params.set("mood", "inside");
    assert_eq!(params.typed::<CoverParams>().unwrap().fit, Fit::Inside);
}

#[test]
fn one_sphere_of_a_cube() {
    let cube = cuboid(Vec3::ONE);
    // The diagonal is 1: half a side is 1 / sqrt 12, and the centre is best.
    let gap = (3_f64.sqrt() - 1.0) / 12_f64.sqrt();
    for (fit, expected) in
        [("inside", [gap, 0.0]), ("outside", [0.0, gap]), ("balanced", [0.5 * gap, 0.5 * gap])]
    {
        let found = errors(&cube, &run(&cube, fit, Level::Spheres(1)).expect("a sphere"));
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 2e-3, "{fit}: {found} {expected}");
            assert!(expected > 0.0 || found == 0.0, "{fit}: {found} is no proof");
        }
    }
}

#[test]
fn moods_are_proven_on_a_box_a_torus_and_a_thin_plate() {
    let torus = medial_datasets::find("torus").expect("a built-in shape");
    let shapes = [
        cuboid(Vec3::new(4.0, 2.0, 1.0)),
        test_shape("torus", torus.default_resolution),
        cuboid(Vec3::new(1.0, 1.0, 0.004)),
    ];
    for (k, shape) in shapes.iter().enumerate() {
        let mut gaps = [0.0; 2];
        for (gap, count) in gaps.iter_mut().zip([12, 30]) {
            let outside = run(shape, "outside", Level::Spheres(count)).expect("spheres");
            let [uncovered, overshoot] = errors(shape, &outside);
            assert_eq!((uncovered, outside.mesh.spheres.len()), (0.0, count), "{k}");
            *gap = outside.native_level.expect("its error");
            assert!(overshoot <= *gap + 2e-4, "{k}: {overshoot} {gap}");
            let inside = run(shape, "inside", Level::Spheres(count)).expect("spheres");
            let [uncovered, overshoot] = errors(shape, &inside);
            assert!(overshoot == 0.0 && uncovered <= *gap + 2e-4, "{k}: {uncovered} {overshoot}");
            let balanced = run(shape, "balanced", Level::Spheres(count)).expect("spheres");
            let larger = errors(shape, &balanced).into_iter().fold(0.0, f64::max);
            assert!(larger <= 0.5 * *gap + 2e-4, "{k}: {larger} {gap}");
        }
        assert!(gaps[1] < 0.8 * gaps[0], "{k}: {gaps:?}");
    }
}

#[test]
fn equal_radii_are_equal_and_proven() {
    let torus = medial_datasets::find("torus").expect("a built-in shape");
    let shapes = [cuboid(Vec3::new(4.0, 2.0, 1.0)), test_shape("torus", torus.default_resolution)];
    for shape in &shapes {
        let mut gaps = vec![];
        for (fit, side) in [("outside", 0), ("inside", 1), ("balanced", 2)] {
            let mut params = Params::none();
            params.set("fit", fit);
            params.set("radii", "equal");
            let run = RunContext::default();
            let prepared = method().prepare(shape, &params, &run);
            let result = prepared.expect("prepared").at(Level::Spheres(24)).expect("spheres");
            let balls = &result.mesh.spheres;
            assert!(balls.iter().all(|ball| ball.radius == balls[0].radius), "{fit}");
            let found = errors(shape, &result);
            assert!(found.get(side).is_none_or(|&error| error == 0.0), "{fit}: {found:?}");
            gaps.push(found[0].max(found[1]));
        }
        let free = run(shape, "outside", Level::Spheres(24)).expect("spheres");
        assert!(gaps[2] < 0.55 * gaps[0], "{gaps:?}");
        assert!(errors(shape, &free)[1] < 1.02 * gaps[0], "{gaps:?}");
    }
}

#[test]
fn an_error_gives_few_spheres_within_it() {
    let shape = cuboid(Vec3::new(4.0, 2.0, 1.0));
    for fit in ["outside", "balanced"] {
        let found = run(&shape, fit, Level::Native(0.04)).expect("spheres");
        let largest = errors(&shape, &found).into_iter().fold(0.0, f64::max);
        assert!(largest <= 0.04 + 1e-4, "{fit}: {largest}");
        let fewer = run(&shape, fit, Level::Spheres(found.mesh.spheres.len() * 4 / 5));
        assert!(fewer.expect("spheres").native_level > Some(0.04), "{fit}");
    }
}

#[test]
fn senseless_levels_are_errors() {
    let cube = cuboid(Vec3::ONE);
    for level in [0.0, -1.0, f64::NAN, BEYOND] {
        let error = run(&cube, "outside", Level::Native(level)).expect_err("no level");
        assert!(matches!(error, SimplifyError::Level(_)), "{error}");
    }
    let many = run(&cube, "inside", Level::Spheres(100_000)).expect_err("too many");
    assert!(many.to_string().contains("at most 1000"), "{many}");
    assert!(run(&cube, "sad", Level::Spheres(1)).is_err());
}
