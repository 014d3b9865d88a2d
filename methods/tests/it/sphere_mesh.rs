//! Sphere-Meshes on whole shapes with few spheres, whose best sphere-mesh is known.

use medial::Vec3;
use medial::simplifier::Level;
use medial_datasets::find;

use crate::common::{at, shape};

/// The centres are those of the solid and the radii its own, to within the facets of the surface.
#[test]
fn a_sphere_is_one_sphere_and_a_capsule_two() {
    for (id, count, centres, radius) in [
        ("sphere", 1, vec![Vec3::new(0.0, 0.0, 0.0)], 1.0),
        ("capsule", 2, vec![Vec3::new(0.0, 0.0, -0.8), Vec3::new(0.0, 0.0, 0.8)], 0.4),
    ] {
        let shape = shape(id, find(id).expect("in the catalogue").default_resolution);
        let units = shape.normalisation();
        let found = at(&shape, "sphere-mesh", &[], Level::Spheres(count)).to_input(units);
        let mut spheres = found.spheres.clone();
        spheres.sort_by(|a, b| a.centre.z.total_cmp(&b.centre.z));
        assert_eq!(spheres.len(), count, "{id}");
        for (sphere, centre) in spheres.iter().zip(centres) {
            assert!(sphere.centre.distance(centre) < 0.01 * radius, "{id}: {sphere:?}");
            assert!((sphere.radius - radius).abs() < 0.01 * radius, "{id}: {sphere:?}");
        }
        assert_eq!(found.edges.len(), count - 1, "{id}");
    }
}

/// A finer level after a coarse one starts again and gives the same result as alone.
#[test]
fn levels_do_not_depend_on_each_other() {
    let shape = shape("torus", 16);
    let method = medial_methods::find("sphere-mesh").expect("registered");
    let mut prepared =
        method.prepare(&shape, &Default::default(), &Default::default()).expect("prepared");
    let counts = [20, 5, 20].map(|count| prepared.at(Level::Spheres(count)).expect("spheres").mesh);
    assert_eq!(counts[0], counts[2]);
    assert_eq!(counts[1], at(&shape, "sphere-mesh", &[], Level::Spheres(5)));
}
