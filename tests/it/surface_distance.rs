//! Distances between surfaces against closed forms and brute force.

use std::sync::Arc;

use medial::Vec3;
use medial::metrics::{
    DistanceOptions, Judge, JudgeOptions, SurfaceDistances, Truth, surface_distances,
};
use medial::surface::{InsideTest, TriMesh, TriangleBvh};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// The box of the given half sides around the origin.
fn cuboid(half: Vec3) -> TriMesh {
    let corner = |k: u32| {
        let sign = |bit: u32| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
        half * Vec3::new(sign(0), sign(1), sign(2))
    };
    let quads =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh { vertices: (0..8).map(corner).collect(), faces }
}

fn measure(surface: &TriMesh, other: &TriMesh) -> SurfaceDistances {
    let options =
        DistanceOptions { surface_samples: 20_000, envelope_samples: 20_000, ..Default::default() };
    surface_distances(surface, &TriangleBvh::new(surface).unwrap(), other, &options).unwrap()
}

#[test]
fn boxes_in_boxes() {
    let (inner, outer) = (cuboid(Vec3::new(0.4, 0.3, 0.2)), cuboid(Vec3::new(0.5, 0.4, 0.3)));
    let same = measure(&inner, &inner);
    assert!(same.hausdorff < 1e-15, "{same:?}");
    // From the inner box the outer one is 0.1 away everywhere; its corners are farther.
    let out = measure(&inner, &outer);
    assert!((out.forward - 0.1).abs() < 1e-15 && (out.mean - 0.1).abs() < 1e-12, "{out:?}");
    assert!((out.rms - 0.1).abs() < 1e-12, "{out:?}");
    assert!((out.reverse - 0.1 * 3f64.sqrt()).abs() < 1e-15, "{out:?}");
    assert_eq!(out.hausdorff, out.reverse);
    assert_eq!((out.samples, out.reverse_samples), (20_008, 20_008));
    // And the other way round.
    let back = measure(&outer, &inner);
    assert_eq!((back.forward, back.reverse), (out.reverse, out.forward));
    assert!((back.mean - out.reverse_mean).abs() < 1e-4, "{back:?} {out:?}");
}

/// Distance from a point to a triangle by descent over a grid of its points: an independent route.
fn to_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> f64 {
    let at = |u: f64, v: f64| {
        let (u, v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
        let (u, v) = if u + v > 1.0 { (u / (u + v), v / (u + v)) } else { (u, v) };
        (p.distance(a + (b - a) * u + (c - a) * v), u, v)
    };
    let mut best = at(1.0 / 3.0, 1.0 / 3.0);
    let mut step = 0.5;
    while step > 1e-9 {
        let around = (-2..=2).flat_map(|i| (-2..=2).map(move |j| (f64::from(i), f64::from(j))));
        let found = around
            .map(|(i, j)| at(best.1 + i * step, best.2 + j * step))
            .fold(best, |x, y| if y.0 < x.0 { y } else { x });
        if found.0 >= best.0 - 1e-16 {
            step *= 0.6;
        }
        best = found;
    }
    best.0
}

#[test]
fn random_soups_agree_with_brute_force() {
    let mut rng = Pcg64::seed_from_u64(11);
    let mut soup = |count: u32| {
        let mut point = || Vec3::new(rng.random(), rng.random(), rng.random());
        let vertices = (0..3 * count).map(|_| point()).collect();
        let faces = (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        TriMesh { vertices, faces }
    };
    let (s, t) = (soup(6), soup(9));
    let options = DistanceOptions { surface_samples: 1, envelope_samples: 1, seed: 5 };
    let found = surface_distances(&s, &TriangleBvh::new(&s).unwrap(), &t, &options).unwrap();
    // Vertices are among the samples: their largest distance is a lower bound, and one uniform
    // sample beside them moves it by at most its own distance, which the brute force bounds too.
    let directed = |from: &TriMesh, to: &TriMesh| {
        let nearest = |&p: &Vec3| {
            (0..to.faces.len()).map(|f| to_triangle(p, to.triangle(f))).fold(f64::MAX, f64::min)
        };
        from.vertices.iter().map(nearest).fold(0.0, f64::max)
    };
    let (there, back) = (directed(&s, &t), directed(&t, &s));
    // The distance to one triangle is convex, so a vertex is often, not always, the farthest.
    assert!(found.forward >= there - 1e-7 && found.reverse >= back - 1e-7, "{found:?}");
    let other = if found.mean > there + 1e-7 { found.mean } else { there };
    assert!((found.forward - other).abs() < 1e-6, "{found:?} {there}");
    assert_eq!((found.samples, found.reverse_samples), (19, 28));
}

#[test]
fn a_judge_measures_the_same_from_the_samples_that_it_keeps() {
    let (inner, outer) = (cuboid(Vec3::new(0.4, 0.3, 0.2)), cuboid(Vec3::new(0.41, 0.29, 0.25)));
    let tree = Arc::new(TriangleBvh::new(&inner).unwrap());
    let inside = Arc::new(InsideTest::new(&inner));
    let options = JudgeOptions { samples: 3_000, volume_depth: 0, seed: 8 };
    let judge = Judge::new(inner.clone(), Arc::clone(&tree), inside, Truth::default(), options);
    let afresh = DistanceOptions { surface_samples: 3_000, envelope_samples: 3_000, seed: 8 };
    let afresh = surface_distances(&inner, &tree, &outer, &afresh).unwrap();
    assert_eq!(judge.surface_distances(&outer).unwrap(), afresh);
}

#[test]
fn surfaces_without_area_are_refused() {
    let solid = cuboid(Vec3::ONE);
    let tree = TriangleBvh::new(&solid).unwrap();
    let flat = TriMesh { vertices: vec![Vec3::ZERO; 3], faces: vec![[0, 1, 2]] };
    assert!(surface_distances(&solid, &tree, &flat, &DistanceOptions::default()).is_err());
    let none = DistanceOptions { envelope_samples: 0, ..Default::default() };
    assert!(surface_distances(&solid, &tree, &solid, &none).is_err());
}
