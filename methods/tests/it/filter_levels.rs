//! Which levels the variants of the angle filter and of the lambda-medial axis answer, and by what they meet a
//! number of spheres.

use crate::common::{ANGLE, LAMBDA, at, built_in, levels, shape_of};
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, Simplified, SimplifyError};
use medial::surface;

#[test]
fn counts_are_met_from_below_or_it_is_said() {
    let shape = shape_of(&built_in("bracket"));
    let all = ANGLE.iter().map(|set| ("angle", *set)).chain(LAMBDA.map(|set| ("lambda", set)));
    for (method, set) in all {
        let asked = [600, 100, 20].map(Level::Spheres);
        for (found, count) in levels(&shape, method, set, &asked).into_iter().zip([600, 100, 20]) {
            let found = found.expect("a count");
            let reached = found.mesh.spheres.len();
            assert!(reached > 0 && (reached == count || !found.diagnostics.warnings.is_empty()));
            // Sheets end where edges without a facet hold them: these never go.
            let is_held = set == ANGLE[3] && reached > count;
            assert!(reached <= count || is_held, "{method} {set:?}: {reached} for {count}");
        }
        let refused = levels(&shape, method, set, &[Level::Spheres(0)]).remove(0);
        assert!(matches!(refused, Err(SimplifyError::Level(_))), "{method} {set:?}");
    }
}

#[test]
fn the_published_level_is_announced_and_is_a_native_one() {
    let shape = shape_of(&built_in("bracket"));
    let all = ANGLE.iter().map(|set| ("angle", *set)).chain(LAMBDA.map(|set| ("lambda", set)));
    for (method, set) in all.chain([("angle", [].as_slice()), ("lambda", &[])]) {
        let published =
            levels(&shape, method, set, &[Level::Published]).remove(0).expect("a level");
        let said = &published.diagnostics.warnings;
        assert!(said.iter().any(|w| w.starts_with("no single level is published; this is ")));
        assert!(!published.mesh.spheres.is_empty(), "{method} {set:?}");
        let native = Level::Native(published.native_level.expect("a level of its own"));
        assert_eq!(published.mesh, at(&shape, method, set, native), "{method} {set:?}");
    }
    let lambda = levels(&shape, "lambda", &[], &[Level::Published]).remove(0).expect("a level");
    let axis = shape.voronoi().expect("a mesh");
    let sides = [0, 1, 2].map(|k| {
        let along = axis.spheres.iter().map(|s| s.centre[k]);
        along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
    });
    let longest = sides.into_iter().fold(0.0, f64::max);
    assert_eq!(lambda.native_level, Some(0.02 * longest));
}

#[test]
fn a_number_by_sampling_is_the_native_level_of_that_sampling() {
    let mesh = built_in("blob");
    let shape = shape_of(&mesh);
    let count_of = |found: &Simplified, name: &str| {
        let counts = &found.diagnostics.counts;
        counts.iter().find(|(count, _)| count == name).expect("a count").1
    };
    for set in [ANGLE[2], ANGLE[3]] {
        let found = levels(&shape, "angle", set, &[Level::Spheres(300)]).remove(0).expect("300");
        assert!((294..=300).contains(&found.mesh.spheres.len()), "{set:?}");
        let native = Level::Native(found.native_level.expect("theta"));
        let again = if set == ANGLE[2] {
            let thousandths = count_of(&found, "resolution_in_thousandths");
            let resolution = format!("{}.{:03}", thousandths / 1000, thousandths % 1000);
            let set = [("variant", "grid"), ("resolution", resolution.as_str())];
            at(&shape, "angle", &set, native)
        } else {
            let sampling = format!("blue:{}", count_of(&found, "samples"));
            let options = ShapeOptions {
                sampling: sampling.parse().expect("a sampling"),
                ..ShapeOptions::default()
            };
            let report = surface::validate(&mesh).expect("a solid");
            let sampled = Shape::new("shape", &mesh, report, options).expect("an extent");
            at(&sampled, "angle", set, native)
        };
        assert_eq!(found.mesh, again, "{set:?}");
    }
}

#[test]
fn few_spheres_by_sheets_are_spread_as_well_as_by_vertices() {
    for id in ["blob", "bracket", "torus"] {
        let shape = shape_of(&built_in(id));
        let axis = shape.voronoi().expect("a mesh");
        let farthest = |set| {
            let kept = at(&shape, "angle", set, Level::Spheres(100)).spheres;
            let far = axis.spheres.iter().map(|s| {
                let distances = kept.iter().map(|k| k.centre.distance(s.centre));
                distances.fold(f64::INFINITY, f64::min)
            });
            far.fold(0.0, f64::max)
        };
        let [sheets, vertices] = [ANGLE[3], &[]].map(farthest);
        assert!(sheets <= 1.3 * vertices, "{id}: {sheets}, by vertices {vertices}");
    }
}
