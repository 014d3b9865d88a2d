//! The box: the one solid whose separation angles and enclosing balls are known everywhere.
//!
//! A box with half sides `A > B > C` has a central rectangle `(A - C) x (B - C)` of radius `C`,
//! where two opposite contacts give an angle of 180 degrees and an enclosing ball of radius `C`,
//! and twelve sheets from its edges, where contacts on two perpendicular sides give 90 degrees and
//! an enclosing ball of radius `r / sqrt 2`.

use std::sync::Arc;

use medial::Vec3;
use medial::complex::{Contacts, MedialMesh, Sphere};
use medial::shape::Shape;
use medial::simplifier::Level;

use crate::common::{at, cuboid, shape_of};

const HALF: Vec3 = Vec3::new(1.5, 1.0, 0.5);

/// A medial sphere of the box with its exact contacts.
struct Exact {
    sphere: Sphere,
    contacts: [Vec3; 2],
    central: bool,
}

/// Spheres on the central rectangle and on the sheets of all twelve edges.
fn exact_spheres() -> Vec<Exact> {
    let mut spheres = Vec::new();
    for i in -4..=4 {
        for j in -4..=4 {
            let at = |k: i32, room: f64| f64::from(k) / 4.0 * room;
            let centre = Vec3::new(at(i, HALF.x - HALF.z), at(j, HALF.y - HALF.z), 0.0);
            let lift = Vec3::new(0.0, 0.0, HALF.z);
            let contacts = [centre + lift, centre - lift];
            spheres.push(Exact { sphere: Sphere::new(centre, HALF.z), contacts, central: true });
        }
    }
    for along in 0..3 {
        let (u, v) = ((along + 1) % 3, (along + 2) % 3);
        for signs in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            for step in 1..10 {
                let radius = f64::from(step) / 10.0 * HALF.z;
                let mut centre = Vec3::ZERO;
                centre[u] = signs.0 * (HALF[u] - radius);
                centre[v] = signs.1 * (HALF[v] - radius);
                let mut contacts = [centre; 2];
                contacts[0][u] = signs.0 * HALF[u];
                contacts[1][v] = signs.1 * HALF[v];
                spheres.push(Exact {
                    sphere: Sphere::new(centre, radius),
                    contacts,
                    central: false,
                });
            }
        }
    }
    spheres
}

fn exact_shape(exact: &[Exact]) -> Shape {
    let samples: Arc<[Vec3]> = exact.iter().flat_map(|e| e.contacts).collect();
    let spheres = exact.iter().map(|e| e.sphere).collect();
    let mut mesh = MedialMesh::from_simplices(spheres, vec![], vec![]).expect("valid spheres");
    let of_sphere = (0..exact.len() as u32).map(|i| [2 * i, 2 * i + 1, 2 * i, 2 * i + 1]).collect();
    mesh.contacts = Some(Contacts { samples, of_sphere });
    shape_of(&cuboid(HALF)).with_initial(&mesh)
}

/// Whether each exact sphere survives a method at a level, by its centre.
fn kept(shape: &Shape, exact: &[Exact], method: &str, level: f64) -> Vec<bool> {
    let result = at(shape, method, &[], Level::Native(level));
    let normal = shape.normalisation();
    let centres: Vec<Vec3> = result.spheres.iter().map(|s| normal.backward(s.centre)).collect();
    let survives = |e: &Exact| centres.iter().any(|c| c.distance(e.sphere.centre) < 1e-9);
    exact.iter().map(survives).collect()
}

#[test]
fn angle_leaves_the_central_rectangle_just_above_90_degrees() {
    let exact = exact_spheres();
    let shape = exact_shape(&exact);
    let central: Vec<bool> = exact.iter().map(|e| e.central).collect();
    assert_eq!(kept(&shape, &exact, "angle", 90.0 + 1e-6), central);
    assert_eq!(kept(&shape, &exact, "angle", 179.9), central);
    assert!(kept(&shape, &exact, "angle", 90.0 - 1e-6).iter().all(|&kept| kept));
}

#[test]
fn lambda_eats_the_edges_up_to_its_root_two_fold() {
    let exact = exact_spheres();
    let shape = exact_shape(&exact);
    let diagonal = shape.normalisation().diagonal;
    for lambda in [0.02, 0.1, 0.2, 0.3, 0.4, 0.499] {
        let expected: Vec<bool> =
            exact.iter().map(|e| e.central || e.sphere.radius >= 2.0_f64.sqrt() * lambda).collect();
        assert_eq!(kept(&shape, &exact, "lambda", lambda / diagonal), expected, "lambda {lambda}");
    }
    let beyond_half_thickness = (HALF.z + 1e-6) / diagonal;
    assert!(kept(&shape, &exact, "lambda", beyond_half_thickness).iter().all(|&kept| !kept));
}
