//! Q-MAT on the medial meshes of sampled solids.

use medial::complex::{SheetGraph, SheetOptions, betti};
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, RunContext, Simplification, Simplified};
use medial::surface;
use medial_methods::qmat;

use crate::common::{self, default_shape, shape, shape_of};

fn prepare<'s>(shape: &'s Shape, params: &[(&str, &str)]) -> Box<dyn Simplification + 's> {
    let params = common::params(params);
    qmat::method().prepare(shape, &params, &RunContext::default()).expect("prepared")
}

fn spheres(simplification: &mut dyn Simplification, count: usize) -> Simplified {
    simplification.at(Level::Spheres(count)).expect("a count")
}

/// The default on every built-in shape whose initial mesh has the topology of the solid.
#[test]
fn the_topology_of_the_initial_mesh_is_kept_on_every_built_in_shape() {
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

/// Sheets, seams and junctions of the true axis at 2,000 spheres. The others have narrow sheets that samples cut short
/// (plate, wedge), noise of curved sheets next to sharp edges (fillet, holed plate, blind hole) or at a smooth rim
/// (ellipsoid).
#[test]
fn at_2000_spheres_most_known_axes_have_their_sheets_seams_and_junctions() {
    let (mut right, mut wrong) = (vec![], vec![]);
    for built_in in medial_datasets::catalogue() {
        let Some(axis) = built_in.axis() else { continue };
        let shape = shape(built_in.id, built_in.default_resolution);
        let mesh = spheres(prepare(&shape, &[]).as_mut(), 2000).mesh;
        let graph = SheetGraph::new(&mesh, SheetOptions::default());
        let parts = [graph.areas.len(), graph.seams.len(), graph.junctions.len()];
        if parts == axis.parts { &mut right } else { &mut wrong }.push((built_in.id, parts));
    }
    assert!(right.len() >= 12, "{right:?}, wrong: {wrong:?}");
}

/// The published level checks topology from 200 spheres on, and no other level does.
#[test]
fn the_published_level_checks_from_200_spheres_on() {
    let shape = default_shape("frame");
    let at = |params: &[(&str, &str)], level: Level| {
        prepare(&shape, params).at(level).expect("a level").mesh
    };
    let published = at(&[], Level::Published);
    assert_eq!(published, at(&[("topology_from", "200")], Level::Spheres(100)));
    assert_eq!(at(&[], Level::Spheres(100)), at(&[("topology_from", "all")], Level::Spheres(100)));
    let checked = at(&[("topology_from", "all")], Level::Published);
    assert_eq!(checked, at(&[], Level::Spheres(100)));
    // A change of level kind starts again.
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
