//! Q-MAT on the medial meshes of sampled solids.

use medial::complex::betti;
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, RunContext, Simplification, Simplified};
use medial::surface;
use medial_methods::qmat;

use crate::common::{self, shape_of};

fn shape(id: &str, resolution: u32) -> Shape {
    shape_of(&medial_datasets::find(id).expect("in the catalogue").mesh(resolution))
}

fn prepare<'s>(shape: &'s Shape, params: &[(&str, &str)]) -> Box<dyn Simplification + 's> {
    let params = common::params(params);
    qmat::method().prepare(shape, &params, &RunContext::default()).expect("prepared")
}

fn spheres(simplification: &mut dyn Simplification, count: usize) -> Simplified {
    simplification.at(Level::Spheres(count)).expect("a count")
}

#[test]
fn a_sampled_sphere_becomes_one_sphere() {
    // Radius 1 and bounding-box diagonal sqrt(12); the published result is 3e-7 off.
    let shape = shape("sphere", 40);
    let result = spheres(prepare(&shape, &[]).as_mut(), 1);
    assert_eq!(result.mesh.spheres.len(), 1);
    let sphere = result.mesh.spheres[0];
    let scale = shape.normalisation().diagonal;
    assert!((sphere.radius * scale - 1.0).abs() < 1e-6, "{sphere:?}");
    assert!(shape.normalisation().backward(sphere.centre).length() < 1e-6, "{sphere:?}");
}

#[test]
fn topology_is_kept_at_every_level() {
    for (id, resolution, smallest) in [("torus", 26, 3), ("hollow-sphere", 20, 4)] {
        let shape = shape(id, resolution);
        let initial = shape.initial().expect("an initial medial mesh");
        let expected = medial_datasets::find(id).expect("in the catalogue").expected_betti;
        assert_eq!(betti(&initial), expected, "{id}: too coarse a sample for this test");
        let mut simplification = prepare(&shape, &[]);
        let mut count = initial.spheres.len();
        while count > 1 {
            count = if count > 60 { count * 9 / 10 } else { count - 1 };
            let result = spheres(simplification.as_mut(), count);
            assert_eq!(betti(&result.mesh), expected, "{id} at {count}");
            let reached = result.mesh.spheres.len();
            assert!(reached >= smallest, "{id}: {reached} spheres cannot hold this topology");
            assert_eq!(reached > count, !result.diagnostics.warnings.is_empty(), "{id} at {count}");
        }
    }
}

/// The default on every built-in shape whose initial mesh has the topology of the solid.
#[test]
fn by_default_what_the_initial_mesh_has_is_kept_on_every_built_in_shape() {
    let mut tested = 0;
    for built_in in medial_datasets::catalogue() {
        let shape = shape(built_in.id, built_in.default_resolution);
        let initial = shape.initial().expect("an initial medial mesh");
        if betti(&initial) != built_in.expected_betti {
            continue;
        }
        tested += 1;
        let mut simplification = prepare(&shape, &[]);
        for count in [3000, 1000, 300, 100, 30, 8] {
            let result = spheres(simplification.as_mut(), count);
            assert_eq!(betti(&result.mesh), built_in.expected_betti, "{} at {count}", built_in.id);
        }
    }
    assert!(tested >= 10, "{tested}");
}

/// What is published checks from 200 spheres on, and only there does that decide.
#[test]
fn the_published_level_checks_from_200_spheres_on() {
    let shape = shape("frame", medial_datasets::find("frame").expect("a frame").default_resolution);
    let at = |params: &[(&str, &str)], level: Level| {
        prepare(&shape, params).at(level).expect("a level").mesh
    };
    let published = at(&[], Level::Published);
    assert_eq!(published, at(&[("topology_from", "200")], Level::Spheres(100)));
    assert_eq!(at(&[], Level::Spheres(100)), at(&[("topology_from", "all")], Level::Spheres(100)));
    let told = at(&[("topology_from", "all")], Level::Published);
    assert_eq!(told, at(&[], Level::Spheres(100)));
    // Going from one to the other starts anew.
    let mut both = prepare(&shape, &[]);
    assert_eq!(spheres(both.as_mut(), 300).mesh, at(&[], Level::Spheres(300)));
    let after = both.at(Level::Published).expect("a level");
    assert_eq!(after.mesh, published);
}

#[test]
fn topology_is_kept_at_every_level_of_real_meshes() {
    for path in medial_test_support::surfaces() {
        let shape = shape_of(&surface::read(&path).expect("a solid").mesh);
        let initial = shape.initial().expect("an initial medial mesh");
        // Not that of the solid where the samples are too coarse for it.
        let expected = betti(&initial);
        let mut simplification = prepare(&shape, &[]);
        let mut count = initial.spheres.len();
        while count > 4 {
            count /= 4;
            let result = spheres(simplification.as_mut(), count);
            assert_eq!(betti(&result.mesh), expected, "{} at {count}", path.display());
        }
    }
}

#[test]
fn all_spheres_and_more_are_the_initial_mesh() {
    let shape = shape("capsule", 24);
    let initial = shape.initial().expect("an initial medial mesh");
    let mut simplification = prepare(&shape, &[]);
    for count in [200, 80, 80, 120] {
        assert_eq!(spheres(simplification.as_mut(), count).mesh.spheres.len(), count);
    }
    let all = spheres(simplification.as_mut(), initial.spheres.len());
    assert_eq!((&all.mesh, all.diagnostics.warnings.len()), (&*initial, 0));
    let more = spheres(simplification.as_mut(), initial.spheres.len() + 1);
    assert_eq!((&more.mesh, more.diagnostics.warnings.len()), (&*initial, 1));
    let published = simplification.at(Level::Published).expect("the count of Table II");
    assert_eq!(published.mesh.spheres.len(), 100);
}
