//! Dual complexes under changes that change nothing.

use std::collections::BTreeSet;

use medial_geometry::{DualComplex, Regular, Sphere, UnionBoundary, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::balls::{as_set, checked, unit};

/// Simplices as sets of balls by position, so that numbering does not matter.
fn geometric(balls: &[Sphere]) -> BTreeSet<Vec<[u64; 4]>> {
    let key = |i: usize| {
        let b = balls[i];
        [b.centre.x, b.centre.y, b.centre.z, b.radius].map(|x| (x + 0.0).to_bits())
    };
    let simplices = as_set(&checked(balls).simplices());
    let sorted = |s: Vec<usize>| {
        let mut keys: Vec<_> = s.into_iter().map(key).collect();
        keys.sort_unstable();
        keys
    };
    simplices.into_iter().map(sorted).collect()
}

#[test]
fn order_scale_and_translation_do_not_matter() {
    let mut rng = Pcg64::seed_from_u64(24);
    for round in 0..60 {
        let n = rng.random_range(1..60);
        let dyadic = |x: f64, steps: f64| (x * steps).round() / steps;
        let steps = [2.0, 64.0, 1048576.0][round % 3];
        let balls: Vec<_> = (0..n)
            .map(|_| {
                let c = unit(&mut rng).to_array().map(|x| dyadic(x, steps));
                Sphere::new(Vec3::from(c), dyadic(rng.random_range(0.0..0.8), steps))
            })
            .collect();
        let mut shuffled = balls.clone();
        for i in (1..n).rev() {
            shuffled.swap(i, rng.random_range(0..=i));
        }
        assert_eq!(geometric(&balls), geometric(&shuffled));
        let expected = checked(&balls).simplices();
        for scale in [f64::powi(2.0, 40), f64::powi(2.0, -40)] {
            let scaled: Vec<_> =
                balls.iter().map(|b| Sphere::new(b.centre * scale, b.radius * scale)).collect();
            assert_eq!(checked(&scaled).simplices(), expected);
        }
        let moved: Vec<_> = balls
            .iter()
            .map(|b| Sphere::new(b.centre + Vec3::new(1024.0, -65536.0, 2.0), b.radius))
            .collect();
        assert_eq!(checked(&moved).simplices(), expected);
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let mut rng = Pcg64::seed_from_u64(27);
    let balls: Vec<_> =
        (0..6_000).map(|_| Sphere::new(unit(&mut rng), rng.random_range(0.0..0.15))).collect();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let complex = checked(&balls);
            let classes: Vec<_> = complex.edges().collect();
            let boundary = UnionBoundary::new(&complex);
            (complex.simplices(), classes, boundary.vertices().to_vec(), boundary.merge(|_| None))
        })
    };
    let alone = with(1);
    assert!(alone == with(2) && alone == with(5));
}

// ---------------------------------------------------------------------------------------------
// Exact coincidence.

#[test]
fn balls_through_one_point_have_one_vertex_there() {
    let mut rng = Pcg64::seed_from_u64(28);
    let (mut met, mut joined) = (0, 0);
    for _ in 0..300 {
        // Integer centres in the half-space x > 0, spheres through the origin: it is on the boundary.
        let n = rng.random_range(4..14);
        let mut side = |from: i32| f64::from(rng.random_range(from..7));
        let points: Vec<Vec3> = (0..n).map(|_| Vec3::new(side(1), side(-6), side(-6))).collect();
        let weights: Vec<f64> = points.iter().map(|p| p.length_squared()).collect();
        let Ok(regular) = Regular::new(&points, &weights) else { continue };
        let complex = DualComplex::new(&regular);
        complex.check().expect("a complex");
        assert_eq!(complex.betti()[0], 1);
        let boundary = UnionBoundary::new(&complex);
        let merged = boundary.merge(|_| None);
        let at = |i: usize| boundary.vertices()[i].position;
        // Flat triangles place their points badly: those of the origin within this.
        let here: BTreeSet<u32> = (0..boundary.vertices().len())
            .filter(|&i| at(i).length() < 1e-4)
            .map(|i| merged.point_of()[i])
            .collect();
        assert!(here.len() <= 1, "{points:?}");
        met += here.len();
        for &[a, b] in boundary.coincident() {
            joined += 1;
            assert!(at(a as usize).distance(at(b as usize)) < 1e-4, "{points:?}");
        }
    }
    assert!(met > 200 && joined > 300, "{met} {joined}");
}
