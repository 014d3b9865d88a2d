//! The Delaunay triangulation against brute force, on points of every degenerate kind.

use medial_geometry::Vec3;
use medial_geometry::delaunay::Delaunay;
use medial_geometry::predicates::{Sign, in_sphere, orient3d};
use medial_geometry::triangulation::{TriangulationError, VertexId};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::{cell_set, in_cube, lattice, on_threads, shuffle};

fn check(points: &[Vec3]) -> Delaunay {
    let delaunay = Delaunay::new(points).expect("the points span space");
    delaunay.check().expect("valid");
    delaunay
}

fn cylinder(around: u32, along: u32) -> Vec<Vec3> {
    let step = std::f64::consts::TAU / f64::from(around);
    (0..around * along)
        .map(|i| {
            let (sin, cos) = (f64::from(i % around) * step).sin_cos();
            Vec3::new(cos, sin, f64::from(i / around) * step)
        })
        .collect()
}

/// Small inputs of many kinds, most of them degenerate.
fn small_input(rng: &mut Pcg64) -> Vec<Vec3> {
    let n = rng.random_range(0..40);
    let kind = rng.random_range(0..9);
    let side = rng.random_range(1..5);
    let coarse = |rng: &mut Pcg64| f64::from(rng.random_range(0..=side));
    (0..n)
        .map(|_| match kind {
            0 => Vec3::new(coarse(rng), coarse(rng), coarse(rng)),
            1 => Vec3::new(coarse(rng), coarse(rng), coarse(rng)) / 100.0,
            2 => in_cube(rng).normalize(),
            3 => Vec3::new(coarse(rng), coarse(rng), 0.25),
            4 => Vec3::new(1.0, 2.0, -1.0) * coarse(rng),
            5 => in_cube(rng),
            6 => {
                // The sphere of squared radius 9 or 2 around the origin, in integers.
                let v = [Vec3::new(1.0, 2.0, 2.0), Vec3::new(3.0, 0.0, 0.0)];
                let v = v[rng.random_range(0..2)].to_array();
                let k = rng.random_range(0..3);
                let mut sign = || if rng.random() { 1.0 } else { -1.0 };
                Vec3::new(sign() * v[k], sign() * v[(k + 1) % 3], sign() * v[(k + 2) % 3])
            }
            7 => {
                let angle = f64::from(rng.random_range(0..8u32)) * std::f64::consts::FRAC_PI_4;
                Vec3::new(angle.cos(), angle.sin(), coarse(rng))
            }
            // A line, a plane and a few points off them.
            _ => match rng.random_range(0..5) {
                0 | 1 => Vec3::new(coarse(rng), 0.0, 0.0),
                2 | 3 => Vec3::new(coarse(rng), coarse(rng), 0.0),
                _ => Vec3::new(coarse(rng), coarse(rng), coarse(rng)),
            },
        })
        .collect()
}

/// The typed error that brute force predicts, if any.
fn expected_error(points: &[Vec3]) -> Option<TriangulationError> {
    let mut distinct: Vec<Vec3> = Vec::new();
    for &p in points {
        if !distinct.contains(&p) {
            distinct.push(p);
        }
    }
    let n = distinct.len();
    if n < 4 {
        return Some(TriangulationError::TooFewPoints { points: points.len(), distinct: n });
    }
    let spans_space = (0..n).any(|i| {
        (0..i).any(|j| {
            (0..j)
                .any(|k| orient3d(distinct[0], distinct[i], distinct[j], distinct[k]) != Sign::Zero)
        })
    });
    if spans_space {
        return None;
    }
    // Integer or exactly scaled lines here have exact cross products.
    let (a, b) = (distinct[0], distinct[1]);
    Some(if distinct.iter().all(|&c: &Vec3| medial_geometry::predicates::collinear(a, b, c)) {
        TriangulationError::Collinear { distinct: n }
    } else {
        TriangulationError::Coplanar { distinct: n }
    })
}

/// No point strictly inside any circumsphere, the volume of the hull filled once.
fn check_by_brute_force(d: &Delaunay) {
    for cell in d.finite_cells() {
        let [a, b, c, e] = d.vertices(cell).map(|v| d.point(v));
        assert_eq!(orient3d(a, b, c, e), Sign::Positive);
        for q in 0..d.point_count() as u32 {
            let q = d.point(VertexId(q));
            assert_ne!(in_sphere(a, b, c, e, q), Sign::Positive, "{cell:?} contains {q}");
        }
    }
    for cell in d.infinite_cells() {
        let [a, b, c, _] = d.vertices(cell);
        let [a, b, c] = [a, b, c].map(|v| d.point(v));
        for q in 0..d.point_count() as u32 {
            assert_ne!(orient3d(a, b, c, d.point(VertexId(q))), Sign::Positive);
        }
    }
}

#[test]
fn ten_thousand_small_inputs_are_valid_or_refused() {
    let mut rng = Pcg64::seed_from_u64(7);
    let mut valid = 0;
    for round in 0..10_000 {
        let mut points = small_input(&mut rng);
        let expected = expected_error(&points);
        let delaunay = match Delaunay::new(&points) {
            Ok(d) => d,
            Err(error) => {
                assert_eq!(Some(error), expected, "round {round}: {points:?}");
                continue;
            }
        };
        assert_eq!(expected, None, "round {round}: {points:?}");
        valid += 1;
        delaunay.check().unwrap_or_else(|e| panic!("round {round}: {e}"));
        check_by_brute_force(&delaunay);
        shuffle(&mut points, &mut rng);
        let shuffled = Delaunay::new(&points).expect("a permutation of points that span space");
        let cells = |d: &Delaunay| cell_set(d, |v| d.point(v).to_array().map(f64::to_bits));
        assert_eq!(cells(&delaunay), cells(&shuffled), "round {round}");
    }
    assert!(valid > 4_000, "only {valid} inputs spanned space");
}

#[test]
fn cells_and_their_order_do_not_depend_on_the_number_of_threads() {
    let mut rng = Pcg64::seed_from_u64(8);
    let random: Vec<Vec3> = (0..30_000).map(|_| in_cube(&mut rng)).collect();
    let sphere = random.iter().map(|p| p.normalize_or(Vec3::X)).collect();
    for points in [random, sphere, cylinder(170, 170)] {
        let one = Delaunay::new(&points).expect("they span space");
        for threads in [1, 2, 3, 7] {
            let other = on_threads(threads, || Delaunay::new(&points).expect("they span space"));
            assert_eq!(one.cell_count(), other.cell_count());
            for cell in one.cells() {
                assert_eq!(one.vertices(cell), other.vertices(cell));
                assert_eq!(one.neighbours(cell), other.neighbours(cell));
            }
        }
        one.check().expect("valid");
    }
}

#[test]
fn a_lattice_is_cut_into_positive_cells() {
    let n = 30;
    let d = check(&lattice(n, 1.0));
    let volume: f64 = d
        .finite_cells()
        .map(|c| {
            let [a, b, c, e] = d.vertices(c).map(|v| d.point(v));
            (b - a).cross(c - a).dot(e - a)
        })
        .sum();
    assert_eq!(volume, 6.0 * f64::from(n - 1).powi(3));
    assert_eq!(d.infinite_cell_count(), 12 * (n as usize - 1).pow(2));
}

#[test]
fn surfaces_with_cospherical_points_are_valid() {
    for scale in [1.0 / 128.0, 0.01] {
        let mut points = lattice(21, scale);
        points.retain(|p| p.to_array().iter().any(|&x| x == 0.0 || x == 20.0 * scale));
        check(&points);
    }
    let mut rng = Pcg64::seed_from_u64(3);
    let sphere: Vec<_> = (0..3_000).map(|_| in_cube(&mut rng).normalize()).collect();
    check(&sphere);
    check(&cylinder(64, 50));
}

#[test]
fn duplicates_are_recorded_with_their_first_occurrence() {
    let mut points = lattice(4, 0.1);
    points.extend_from_within(..);
    points.push(Vec3::new(-0.0, 0.0, -0.0));
    let d = check(&points);
    assert_eq!(d.vertex_count(), 64);
    assert_eq!(d.duplicates().len(), 65);
    for i in 0..128 {
        assert_eq!(d.representative(VertexId(i)), VertexId(i % 64));
    }
    assert_eq!(d.representative(VertexId(128)), VertexId(0));
    assert!(!d.is_vertex(VertexId(64)));
}

#[test]
fn clusters_and_huge_ranges_are_valid() {
    let mut rng = Pcg64::seed_from_u64(5);
    let mut points: Vec<_> = (0..400).map(|_| in_cube(&mut rng) * 1e-9).collect();
    points.extend((0..100).map(|_| in_cube(&mut rng) * 1e9));
    points.extend((0..100).map(|_| in_cube(&mut rng) * 1e-40));
    points.extend((0..20).map(|_| in_cube(&mut rng) * 1e-220));
    check(&points);
    // A cone of slivers: one apex, a thousand points of a circle, a large conflict zone.
    let mut fan = cylinder(1000, 1);
    fan.extend([Vec3::Z, -Vec3::Z, Vec3::ZERO]);
    check(&fan);
}

#[test]
fn unusable_points_are_named() {
    let mut points = lattice(3, 1.0);
    points[5].y = f64::NAN;
    let error = Delaunay::new(&points).expect_err("not a number");
    assert!(matches!(error, TriangulationError::NotFinite { index: 5, .. }), "{error}");
    points[5].y = 1e60;
    let error = Delaunay::new(&points).expect_err("too large");
    assert!(matches!(error, TriangulationError::OutOfRange { index: 5, .. }), "{error}");
}

#[test]
fn rings_turn_around_edges() {
    let d = check(&lattice(4, 1.0));
    for (cell, i, j) in d.finite_edges() {
        let (a, b) = (d.vertices(cell)[i], d.vertices(cell)[j]);
        let ring: Vec<_> = d.edge_ring(cell, i, j).collect();
        assert!(ring.len() >= 3 && ring[0] == cell);
        for (k, &c) in ring.iter().enumerate() {
            let after = ring[(k + 1) % ring.len()];
            assert!(d.neighbours(c).contains(&after));
            assert!(d.vertices(c).contains(&a) && d.vertices(c).contains(&b));
            if d.is_infinite(c) || d.is_infinite(after) {
                continue;
            }
            // The vertex that is left behind, the axis and the vertex ahead turn right-handed.
            let [p, q] = [a, b].map(|v| d.point(v));
            let shared = |v: &VertexId| d.vertices(after).contains(v);
            let left = d.vertices(c).into_iter().find(|v| !shared(v)).expect("one is left");
            let hinge = d
                .vertices(c)
                .into_iter()
                .find(|&v| v != a && v != b && v != left)
                .expect("one stays");
            assert_eq!(orient3d(p, q, d.point(left), d.point(hinge)), Sign::Positive);
        }
    }
    // Euler's relation for a ball counts each edge once.
    let hull = d.infinite_cell_count();
    let facets = (4 * d.finite_cell_count() + hull) / 2;
    let edges = d.finite_edges().count();
    assert_eq!(d.vertex_count() + facets, edges + d.finite_cell_count() + 1);
}

#[test]
fn points_that_are_flat_but_for_their_exponents_take_no_longer_than_others() {
    let mut rng = Pcg64::seed_from_u64(5);
    for height in [1e-100, 1e-290] {
        let mut random = || rng.random::<f64>();
        let points: Vec<Vec3> =
            (0..20_000).map(|_| Vec3::new(random(), random(), random() * height)).collect();
        // A minute or so where every in-sphere test goes to the widest integers.
        let flat = Delaunay::new(&points).expect("not flat");
        flat.check().expect("valid");
    }
    // Cospherical by fours and more: every test is exact.
    let mut flat = lattice(10, 1.0);
    flat.iter_mut().for_each(|p| p.z *= 1e-100);
    check(&flat);
}

#[test]
fn points_that_are_inserted_later_give_the_same_cells() {
    let mut rng = Pcg64::seed_from_u64(17);
    let mut inserted = 0;
    for _ in 0..1_000 {
        let mut points = small_input(&mut rng);
        points.extend((0..rng.random_range(0..60)).map(|_| in_cube(&mut rng)));
        let first = rng.random_range(0..=points.len());
        let Ok(mut delaunay) = Delaunay::new(&points[..first]) else { continue };
        // In two steps: the second inserts into a result of the first.
        let second = rng.random_range(first..=points.len());
        for part in [&points[first..second], &points[second..]] {
            delaunay.insert(part).expect("admissible points");
            delaunay.check().expect("valid");
        }
        let at_once = Delaunay::new(&points).expect("the points span space");
        assert_eq!(cell_set(&delaunay, |v| v), cell_set(&at_once, |v| v));
        assert_eq!(delaunay.duplicates(), at_once.duplicates());
        inserted += points.len() - first;
    }
    assert!(inserted > 10_000, "{inserted}");
    let mut whole = Delaunay::new(&lattice(6, 1.0)).expect("spans space");
    let before = cell_set(&whole, |v| v);
    let refused = whole.insert(&[Vec3::splat(0.3), Vec3::NAN]);
    assert!(matches!(refused, Err(TriangulationError::NotFinite { index: 1, .. })));
    assert_eq!(cell_set(&whole, |v| v), before);
}
