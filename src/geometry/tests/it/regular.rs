//! The regular triangulation against brute force and against the Delaunay triangulation.

use medial_geometry::Vec3;
use medial_geometry::delaunay::Delaunay;
use medial_geometry::predicates::{Sign, orient3d, power_test};
use medial_geometry::regular::Regular;
use medial_geometry::triangulation::{TriangulationError, VertexId};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::{cell_set, in_cube, lattice, shuffle};

fn check(points: &[Vec3], weights: &[f64]) -> Regular {
    let regular = Regular::new(points, weights).expect("the points span space");
    regular.check().expect("valid");
    regular
}

/// Small weighted inputs: grids, spheres, random points; equal, integer, squared or wild weights.
fn small_input(rng: &mut Pcg64) -> (Vec<Vec3>, Vec<f64>) {
    let n = rng.random_range(4..30);
    let (kind, weighting) = (rng.random_range(0..4), rng.random_range(0..5));
    let mut points = Vec::new();
    let mut weights = Vec::new();
    for _ in 0..n {
        let mut coarse = || f64::from(rng.random_range(0..4u32));
        let grid = Vec3::new(coarse(), coarse(), coarse());
        let free = in_cube(rng);
        let p = match kind {
            0 => grid,
            1 => grid / 10.0,
            2 => free.normalize(),
            _ => free,
        };
        let r: f64 = rng.random();
        points.push(p);
        weights.push(match weighting {
            0 => 0.3,
            1 => f64::from(rng.random_range(0..4u32)),
            2 => (0.5 * r) * (0.5 * r),
            // Every point on one paraboloid's tangent plane: all powers at the origin are zero.
            3 => p.length_squared(),
            _ => r * 10f64.powi(rng.random_range(-200..3)),
        });
    }
    (points, weights)
}

fn weighted(r: &Regular, v: u32) -> (Vec3, f64) {
    (r.point(VertexId(v)), r.weight(VertexId(v)))
}

fn check_by_brute_force(r: &Regular) {
    let points = 0..r.point_count() as u32;
    for cell in r.finite_cells() {
        let [a, b, c, d] = r.vertices(cell).map(|v| weighted(r, v.0));
        assert_eq!(orient3d(a.0, b.0, c.0, d.0), Sign::Positive);
        for q in points.clone() {
            assert_ne!(power_test(a, b, c, d, weighted(r, q)), Sign::Positive, "{cell:?}, {q}");
        }
        if let Some((centre, power)) = r.orthosphere(cell) {
            for (p, w) in [a, b, c, d] {
                let difference = (centre.distance_squared(p) - w - power).abs();
                assert!(difference <= 1e-5 * (1.0 + centre.length_squared()), "{difference}");
            }
        }
    }
    for cell in r.infinite_cells() {
        let [a, b, c, _] = r.vertices(cell);
        let [a, b, c] = [a, b, c].map(|v| r.point(v));
        for q in points.clone() {
            assert_ne!(orient3d(a, b, c, weighted(r, q).0), Sign::Positive);
        }
    }
}

#[test]
fn small_weighted_inputs_agree_with_brute_force() {
    let mut rng = Pcg64::seed_from_u64(11);
    let (mut valid, mut hidden) = (0, 0);
    for round in 0..3_000 {
        let (mut points, mut weights) = small_input(&mut rng);
        let regular = match Regular::new(&points, &weights) {
            Ok(r) => r,
            Err(error) if error.is_flat() => {
                let o = points[0];
                let flat = points.iter().all(|&a| {
                    let others = || points.iter().copied();
                    others().all(|b| others().all(|c| orient3d(o, a, b, c) == Sign::Zero))
                });
                assert!(flat, "round {round}: {points:?}");
                continue;
            }
            Err(error) => panic!("round {round}: {error}"),
        };
        valid += 1;
        hidden += regular.hidden().len();
        regular.check().unwrap_or_else(|e| panic!("round {round}: {e}"));
        check_by_brute_force(&regular);
        let mut pairs: Vec<_> = points.into_iter().zip(weights).collect();
        shuffle(&mut pairs, &mut rng);
        (points, weights) = pairs.into_iter().unzip();
        let shuffled = Regular::new(&points, &weights).expect("a permutation");
        let cells = |r: &Regular| {
            cell_set(r, |v| (r.point(v).to_array().map(f64::to_bits), r.weight(v).to_bits()))
        };
        assert_eq!(cells(&regular), cells(&shuffled), "round {round}");
    }
    assert!(valid > 2_900 && hidden > 4_000, "{valid} valid inputs, {hidden} hidden points");
}

#[test]
fn equal_weights_give_the_delaunay_triangulation() {
    let mut rng = Pcg64::seed_from_u64(13);
    let sphere: Vec<_> = (0..1_000).map(|_| in_cube(&mut rng).normalize()).collect();
    for points in [sphere, lattice(10, 0.01)] {
        let delaunay = Delaunay::new(&points).expect("spans space");
        for weight in [0.0, 0.1, -3.0, 1e-300, 1e20] {
            let regular = check(&points, &vec![weight; points.len()]);
            assert!(regular.hidden().is_empty());
            let vertices = |c| (delaunay.vertices(c), delaunay.neighbours(c));
            let same = regular
                .cells()
                .all(|c| (regular.vertices(c), regular.neighbours(c)) == vertices(c));
            assert!(same && regular.cell_count() == delaunay.cell_count(), "weight {weight}");
        }
    }
}

#[test]
fn weights_that_flatten_the_paraboloid_leave_the_hull() {
    // With w = |p|^2 every lift is zero, and lower weights inside lift above the plane.
    let points = lattice(7, 1.0);
    let inner = |p: &Vec3| p.to_array().iter().any(|&x| x != 0.0 && x != 6.0);
    let weights: Vec<_> =
        points.iter().map(|p| p.length_squared() - f64::from(u8::from(inner(p)))).collect();
    let regular = check(&points, &weights);
    assert_eq!(regular.vertex_count(), 8);
    assert_eq!(regular.hidden().len(), 335);
}

#[test]
fn lighter_points_at_one_position_are_hidden() {
    let mut points = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    points.extend_from_within(..);
    let weights = [0.0, 0.1, 0.0, 0.0, 0.5, 0.0, 0.0, -1.0];
    let regular = check(&points, &weights);
    assert_eq!(regular.hidden(), [VertexId(0), VertexId(5), VertexId(7)]);
    assert_eq!(regular.duplicates(), [(VertexId(6), VertexId(2))]);
    let mut bad = weights;
    bad[3] = f64::INFINITY;
    let error = Regular::new(&points, &bad).expect_err("infinite");
    assert!(matches!(error, TriangulationError::Weight { index: 3, .. }));
    let error = Regular::new(&points, &weights[1..]).expect_err("one missing");
    assert_eq!(error, TriangulationError::WeightCount { points: 8, weights: 7 });
}
