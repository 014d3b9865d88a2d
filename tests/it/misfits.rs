//! Files whose scale, place or radii do not fit the mesh are named as such.

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::metrics::{Judge, JudgeOptions, Truth};
use medial::surface::TriangleBvh;
use medial::surface::{InsideTest, TriMesh};

/// A box of diagonal 1 around the origin, and its exact axis.
fn cuboid() -> (TriMesh, MedialMesh) {
    let half = Vec3::new(1.5, 1.0, 0.5) / 14f64.sqrt();
    let sign = |k: u32, bit: u32| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
    let corner = |k: u32| half * Vec3::new(sign(k, 0), sign(k, 1), sign(k, 2));
    let quads =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let surface = TriMesh { vertices: (0..8).map(corner).collect(), faces };
    let flat = |i: u32, j: u32, n: u32| {
        let at = |k: u32, side: f64| (2.0 * f64::from(k) / f64::from(n) - 1.0) * (side - half.z);
        Sphere::new(Vec3::new(at(i, half.x), at(j, half.y), 0.0), half.z)
    };
    let n = 6;
    let grid: Vec<Sphere> = (0..=n).flat_map(|i| (0..=n).map(move |j| flat(i, j, n))).collect();
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let squares = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let sheet = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    (surface, MedialMesh::from_simplices(grid, vec![], sheet.collect()).unwrap())
}

fn warnings(mesh: &MedialMesh) -> Vec<String> {
    let (surface, _) = cuboid();
    let tree = TriangleBvh::new(&surface).unwrap().into();
    let inside = InsideTest::new(&surface).into();
    let options = JudgeOptions { samples: 2_000, volume_depth: 3, seed: 0 };
    Judge::new(surface, tree, inside, Truth::default(), options).evaluate(mesh).unwrap().warnings
}

fn with_radii(of: impl Fn(f64) -> f64) -> MedialMesh {
    let (_, mut axis) = cuboid();
    axis.spheres.iter_mut().for_each(|s| s.radius = of(s.radius));
    axis
}

#[test]
fn radii_that_do_not_fit_are_named() {
    assert!(warnings(&cuboid().1).is_empty(), "{:?}", warnings(&cuboid().1));
    for (factor, told) in [
        (1e-3, " 1.0e-3 times"),
        (0.0, " 0.0e0 times"),
        (0.02, " 0.020 times"),
        (0.5, " 0.500 times"),
        (0.8, " 0.800 times"),
        (1.3, " 1.300 times"),
        (2.0, " 2.000 times"),
    ] {
        let found = warnings(&with_radii(|r| factor * r));
        assert!(found.iter().any(|w| w.contains("radii") && w.contains(told)), "{found:?}");
    }
    let squared = warnings(&with_radii(|r| r * r));
    assert!(squared.iter().any(|w| w.contains("squared")), "{squared:?}");
}

#[test]
fn other_units_and_other_places_are_named() {
    let (_, axis) = cuboid();
    for scale in [25.4, 1e-3, 1000.0] {
        let found = warnings(&axis.transformed(scale, |p| p * scale));
        assert!(found.iter().any(|w| w.contains("other units")), "{scale}: {found:?}");
    }
    let moved = warnings(&axis.transformed(1.0, |p| p + 2.0 * Vec3::X));
    assert!(moved.iter().any(|w| w.contains("moved, or of another mesh")), "{moved:?}");
}

/// What a poor simplification does to radii is no misfit of the file.
#[test]
fn poor_results_are_not_taken_for_misfits() {
    let (_, axis) = cuboid();
    let keep: Vec<bool> = (0..axis.spheres.len()).map(|k| k < 20).collect();
    assert!(warnings(&axis.induced(&keep)).is_empty());
    let uneven = |r: f64| r * if r > 0.0 { 0.95 } else { 1.0 };
    assert!(warnings(&with_radii(uneven)).is_empty());
}
