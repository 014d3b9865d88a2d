//! Signed distances against closed forms and the exact inside test.

use medial::Vec3;
use medial::surface::{InsideTest, Side, SignedDistance, TriMesh, TriangleBvh};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::shapes::{inverted, joined, torus_of};

/// Radius of the tube of the tori, around a circle of radius 1.
const TUBE: f64 = 0.35;

fn torus(around: u32, along: u32) -> TriMesh {
    torus_of([1.0, TUBE], around, along)
}

fn points(count: usize, seed: u64) -> Vec<Vec3> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let half = Vec3::new(1.4, 1.4, 0.4);
    let mut point = || half * (2.0 * Vec3::new(rng.random(), rng.random(), rng.random()) - 1.0);
    (0..count).map(|_| point()).collect()
}

#[test]
fn a_cavity_is_outside() {
    // A second, smaller torus in the tube of the first, turned inside out: winding number 0 there.
    let cavity = torus_of([1.0, 0.5 * TUBE], 48, 16);
    let mesh = joined(&[torus(48, 32), inverted(cavity)]);
    let (tree, test) = (TriangleBvh::new(&mesh).unwrap(), InsideTest::new(&mesh));
    let distance = SignedDistance::closed(&tree, &test);
    for p in points(500, 3) {
        let from_ring = (p.x.hypot(p.y) - 1.0).hypot(p.z);
        // The smooth tori are within the sagitta of their facets.
        if (from_ring - TUBE).abs() < 0.01 || (from_ring - 0.5 * TUBE).abs() < 0.01 {
            continue;
        }
        let is_inside = (0.5 * TUBE..TUBE).contains(&from_ring);
        assert_eq!(test.winding_number(p), Some(i32::from(is_inside)), "{p}");
        assert_eq!(distance.at(p) < 0.0, is_inside, "{p}");
    }
}

#[test]
fn signed_distances_are_distances_with_the_side_for_any_threads() {
    let mesh = torus(60, 40);
    let (tree, test) = (TriangleBvh::new(&mesh).unwrap(), InsideTest::new(&mesh));
    let distance = SignedDistance::closed(&tree, &test);
    let points = points(2000, 6);
    let batch = |threads: usize| crate::on_threads(threads, || distance.batch(&points));
    let found = batch(1);
    assert_eq!(found, batch(2));
    assert_eq!(found, batch(3));
    for (&p, found) in points.iter().zip(found) {
        let smooth = (p.x.hypot(p.y) - 1.0).hypot(p.z) - TUBE;
        assert!((found - smooth).abs() < 0.004, "{found} for {smooth} at {p}");
        assert_eq!(found.abs(), tree.closest(p).distance);
        assert_eq!(found < 0.0, test.side(p) == Side::Inside);
        assert_eq!(found.to_bits(), distance.at(p).to_bits());
    }
    for &v in mesh.vertices.iter().take(100) {
        assert_eq!(distance.at(v).to_bits(), 0.0_f64.to_bits());
    }
}
