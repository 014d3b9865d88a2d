//! The inside test against closed forms and against the generalised winding number.

use std::f64::consts::PI;

use medial::Vec3;
use medial::surface::{InsideTest, Sampling, Side, TriMesh, sample};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::shapes::*;

/// The generalised winding number: the sum of solid angles over `4 pi`
/// (A. van Oosterom, J. Strackee, 10.1109/TBME.1983.325207).
fn solid_angle_winding(mesh: &TriMesh, p: Vec3) -> f64 {
    let angle = |face: usize| {
        let [a, b, c] = mesh.triangle(face).map(|v| v - p);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    (0..mesh.faces.len()).map(angle).sum::<f64>() / (4.0 * PI)
}

/// Whether a point lies on a triangle, for small integers: exact in 64 bits.
fn is_on(mesh: &TriMesh, p: Vec3) -> bool {
    let int = |v: Vec3| v.to_array().map(|x| x as i64);
    let cross = |a: [i64; 3], b: [i64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let dot = |a: [i64; 3], b: [i64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let within = |a: [i64; 3], b: [i64; 3]| cross(a, b) == [0; 3] && dot(a, b) <= 0;
    (0..mesh.faces.len()).any(|face| {
        let [a, b, c] = mesh.triangle(face).map(|v| int(v - p));
        let turns = [cross(a, b), cross(b, c), cross(c, a)];
        let normal: [i64; 3] = std::array::from_fn(|k| turns.iter().map(|t| t[k]).sum());
        if normal == [0; 3] {
            return within(a, b) || within(b, c) || within(c, a);
        }
        dot(normal, a) == 0 && turns.iter().all(|&turn| dot(turn, normal) >= 0)
    })
}

fn check_against_solid_angles(mesh: &TriMesh, points: impl IntoIterator<Item = Vec3>) {
    let test = InsideTest::new(mesh);
    for p in points {
        let exact = test.winding_number(p);
        if is_on(mesh, p) {
            assert_eq!(exact, None, "{p}");
        } else {
            let angles = solid_angle_winding(mesh, p);
            assert!((angles - angles.round()).abs() < 1e-6, "{p}: {angles}");
            assert_eq!(exact, Some(angles.round() as i32), "{p}");
        }
    }
}

fn lattice(lo: i32, hi: i32) -> impl Iterator<Item = Vec3> {
    let axis = move || (lo..=hi).map(f64::from);
    axis().flat_map(move |x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x, y, z))))
}

#[test]
fn cube_with_cavity_by_closed_form() {
    let inner = inverted(cuboid(Vec3::splat(2.0), Vec3::splat(4.0)));
    let solid = joined(&[cuboid(Vec3::ZERO, Vec3::splat(6.0)), inner]);
    let test = InsideTest::new(&solid);
    for p in lattice(-1, 7) {
        let within = |lo: f64, hi: f64| p.min_element() >= lo && p.max_element() <= hi;
        let strictly = |lo: f64, hi: f64| p.min_element() > lo && p.max_element() < hi;
        let on =
            (within(0.0, 6.0) && !strictly(0.0, 6.0)) || (within(2.0, 4.0) && !strictly(2.0, 4.0));
        let inside = strictly(0.0, 6.0) && !within(2.0, 4.0);
        let expected = match (on, inside) {
            (true, _) => Side::On,
            (_, true) => Side::Inside,
            _ => Side::Outside,
        };
        assert_eq!(test.side(p), expected, "{p}");
    }
}

#[test]
fn overlapping_and_nested_shells_add_up() {
    let mesh = joined(&[
        cuboid(Vec3::ZERO, Vec3::splat(4.0)),
        cuboid(Vec3::splat(2.0), Vec3::splat(6.0)),
        cuboid(Vec3::splat(-2.0), Vec3::splat(8.0)),
    ]);
    let test = InsideTest::new(&mesh);
    assert_eq!(test.winding_number(Vec3::splat(3.0)), Some(3));
    assert_eq!(test.winding_number(Vec3::splat(1.0)), Some(2));
    assert_eq!(test.winding_number(Vec3::splat(-1.0)), Some(1));
    assert_eq!(InsideTest::new(&inverted(mesh)).winding_number(Vec3::splat(3.0)), Some(-3));
}

#[test]
fn smooth_shapes_and_random_points() {
    for mesh in [sphere(3), torus(40, 20)] {
        let test = InsideTest::new(&mesh);
        let mut rng = Pcg64::seed_from_u64(1);
        for _ in 0..300 {
            let p = Vec3::new(rng.random(), rng.random(), rng.random()) * 7.0 - 3.5;
            let angles = solid_angle_winding(&mesh, p);
            assert_eq!(test.winding_number(p), Some(angles.round() as i32), "{p}");
        }
        // Every vertex and the middle of every edge of an axis-parallel fan lie on the surface.
        assert!(mesh.vertices.iter().all(|&v| test.side(v) == Side::On));
    }
}

#[test]
fn batches_equal_single_queries_for_any_number_of_threads() {
    let mesh = torus(30, 15);
    let test = InsideTest::new(&mesh);
    let points: Vec<Vec3> = lattice(-7, 7).map(|p| p * 0.45).chain(mesh.vertices.clone()).collect();
    let single: Vec<Side> = points.iter().map(|&p| test.side(p)).collect();
    for threads in [1, 3] {
        assert_eq!(crate::on_threads(threads, || test.sides(&points)), single);
    }
    assert!(test.sides(&[]).is_empty());
}

#[test]
fn hostile_queries_and_meshes_have_results() {
    let test = InsideTest::new(&cube());
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, 1e300] {
        assert_eq!(test.side(Vec3::new(bad, 0.5, 0.5)), Side::Outside);
        assert_eq!(test.sides(&[Vec3::splat(bad)]), [Side::Outside]);
    }
    assert_eq!(test.side(Vec3::new(0.5, 0.5, 1e-300)), Side::On, "as if it were zero");
    assert_eq!(test.side(Vec3::new(0.5, 0.5, 1e-40)), Side::Inside);
    assert_eq!(InsideTest::new(&TriMesh::default()).side(Vec3::ZERO), Side::Outside);
    let point = TriMesh { vertices: vec![Vec3::ONE; 3], faces: vec![[0, 1, 2]] };
    assert_eq!(InsideTest::new(&point).side(Vec3::ONE), Side::On);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Closed surfaces with vertices anywhere on a small lattice: they cross themselves, faces
    /// collapse, and nearly every query is in line with edges and vertices.
    #[test]
    fn tangled_surfaces_on_a_lattice(coordinates in prop::collection::vec(0_i32..6, 54), kind in 0..2) {
        let mesh = if kind == 0 { sphere(1) } else { torus(6, 3) };
        let mut next = coordinates.iter().cycle().map(|&c| f64::from(c));
        let mut tangled = mesh;
        for v in &mut tangled.vertices {
            *v = Vec3::from_array(std::array::from_fn(|_| next.next().unwrap()));
        }
        check_against_solid_angles(&tangled, lattice(-1, 6));
    }

    /// Scaling and moving by amounts that doubles carry out exactly changes nothing.
    #[test]
    fn exact_under_scaling_and_translation(
        coordinates in prop::collection::vec(0_i32..8, 54),
        exponent in prop::sample::select(vec![-1040, -530, -300, 40, 500, 1000]),
        shift in prop::sample::select(vec![0.0, 1e12, -4e9]),
    ) {
        let mut mesh = sphere(1);
        for (v, c) in mesh.vertices.iter_mut().zip(coordinates.chunks(3)) {
            *v = Vec3::new(c[0].into(), c[1].into(), c[2].into());
        }
        let points: Vec<Vec3> = lattice(-1, 8).step_by(3).collect();
        let plain = InsideTest::new(&mesh);
        let shifted = InsideTest::new(&moved(mesh.clone(), |v| v + shift));
        // In two steps, since 2^-1040 by itself is rounded to zero.
        let half = 2_f64.powi(exponent / 2);
        let scaled = InsideTest::new(&moved(mesh, |v| v * half * half));
        for p in points {
            let expected = plain.winding_number(p);
            prop_assert_eq!(shifted.winding_number(p + shift), expected);
            prop_assert_eq!(scaled.winding_number(p * half * half), expected);
        }
    }
}

// Samplings: exact counts, distribution by area, spacing, determinism.

const UNIFORM: Sampling = Sampling::AreaUniform { count: 20_000, seed: 5 };
const BLUE: Sampling = Sampling::BlueNoise { count: 2_000, seed: 5 };

/// A plate of 4 x 2 x 0.01 whose faces have very different sizes.
fn plate() -> TriMesh {
    cuboid(Vec3::ZERO, Vec3::new(4.0, 2.0, 0.01))
}

/// Distance from each point to its nearest other one.
fn spacings(points: &[Vec3]) -> Vec<f64> {
    let nearest = |i: usize| {
        let others = (0..points.len()).filter(|&j| j != i);
        others.map(|j| points[i].distance(points[j])).fold(f64::INFINITY, f64::min)
    };
    (0..points.len()).map(nearest).collect()
}

#[test]
fn text_and_back() {
    for (text, sampling) in [
        ("vertices", Sampling::MeshVertices),
        ("conforming", Sampling::default()),
        ("conforming:500", Sampling::Conforming { least: 500 }),
        ("uniform:20000", Sampling::AreaUniform { count: 20_000, seed: 0 }),
        ("blue:20000", Sampling::BlueNoise { count: 20_000, seed: 0 }),
        ("blue:12:7", Sampling::BlueNoise { count: 12, seed: 7 }),
    ] {
        assert_eq!(text.parse::<Sampling>().unwrap(), sampling);
        assert_eq!(sampling.to_string(), text);
        let json = serde_json::to_string(&sampling).unwrap();
        assert_eq!(json, format!("{text:?}"));
        assert_eq!(serde_json::from_str::<Sampling>(&json).unwrap(), sampling);
    }
    for text in [
        "",
        "vertex",
        "vertices:3",
        "uniform",
        "uniform:",
        "uniform:0",
        "uniform:-3",
        "blue:1:2:3",
        "blue:x",
        "red:5",
        "blue:99999999999",
        "blue:1000001",
    ] {
        assert!(text.parse::<Sampling>().is_err(), "{text}");
    }
}

#[test]
fn counts_are_exact_and_points_lie_on_the_surface() {
    let mesh = torus(20, 10);
    assert_eq!(sample(&mesh, &Sampling::MeshVertices), mesh.vertices);
    let flat = plate();
    let test = InsideTest::new(&flat);
    for count in [1, 2, 3, 500] {
        for sampling in
            [Sampling::AreaUniform { count, seed: 1 }, Sampling::BlueNoise { count, seed: 1 }]
        {
            let points = sample(&flat, &sampling);
            assert_eq!(points.len(), count, "{sampling}");
            assert!(points.iter().all(|&p| test.side(p) == Side::On));
            assert_eq!(sample(&mesh, &sampling).len(), count);
        }
    }
    for nothing in [TriMesh::default(), moved(cube(), |_| Vec3::ONE)] {
        assert!(sample(&nothing, &BLUE).is_empty() && sample(&nothing, &UNIFORM).is_empty());
    }
    let none = Sampling::BlueNoise { count: 0, seed: 0 };
    assert!(sample(&mesh, &none).is_empty());
}

/// The number of points in parts of known area: within five standard deviations.
#[test]
fn distribution_follows_area() {
    let (a, b) = (8.0, 0.02 + 0.04);
    let total = 2.0 * a + 2.0 * b;
    let in_part = |points: &[Vec3], part: &dyn Fn(Vec3) -> bool| {
        points.iter().filter(|p| part(**p)).count() as f64 / points.len() as f64
    };
    for (sampling, slack) in [(UNIFORM, 5.0), (BLUE, 2.0)] {
        let points = sample(&plate(), &sampling);
        let expect = |share: f64, part: &dyn Fn(Vec3) -> bool| {
            let deviation = (share * (1.0 - share) / points.len() as f64).sqrt();
            let found = in_part(&points, part);
            assert!((found - share).abs() < slack * deviation, "{sampling}: {found} for {share}");
        };
        expect(a / total, &|p| p.z == 0.0);
        expect(a / total, &|p| p.z == 0.01);
        expect(0.25, &|p| p.x < 1.0 - b / 8.0);
        // The diagonal that separates the two triangles of the large sides.
        expect(0.5, &|p| p.y * 2.0 < p.x);
    }
}

#[test]
fn blue_noise_keeps_its_distance() {
    let mesh = torus(60, 30);
    let area = 4.0 * std::f64::consts::PI.powi(2) * 2.0;
    // Spacing of the densest packing of this number of points on this area.
    let densest = (2.0 * area / (3.0_f64.sqrt() * 2_000.0)).sqrt();
    let mut blue = spacings(&sample(&mesh, &BLUE));
    let mut uniform = spacings(&sample(&mesh, &Sampling::AreaUniform { count: 2_000, seed: 5 }));
    blue.sort_by(f64::total_cmp);
    uniform.sort_by(f64::total_cmp);
    assert!(blue[0] > 0.55 * densest, "{} of {densest}", blue[0]);
    assert!(blue[1_000] > 0.7 * densest && blue[1_999] < 1.1 * densest);
    assert!(uniform[0] < 0.1 * densest);
}

#[test]
fn seeds_threads_and_scale() {
    let mesh = torus(20, 10);
    for sampling in [UNIFORM, BLUE] {
        let points = sample(&mesh, &sampling);
        for threads in [1, 3] {
            assert_eq!(crate::on_threads(threads, || sample(&mesh, &sampling)), points);
        }
        // Powers of two scale exactly; 1e200 must not overflow when squared.
        for power in [2_f64.powi(660), 2_f64.powi(-530)] {
            let scaled = sample(&moved(mesh.clone(), |v| v * power), &sampling);
            assert!(scaled.iter().zip(&points).all(|(s, p)| *s == *p * power));
        }
    }
    let other = Sampling::BlueNoise { count: 2_000, seed: 6 };
    assert_ne!(sample(&mesh, &BLUE), sample(&mesh, &other));
    // One value spelled out, so that a change of the generator does not go unnoticed.
    let first = sample(&cube(), &Sampling::AreaUniform { count: 1, seed: 1 })[0];
    assert_eq!(first, Vec3::new(1.0, 0.13152442752421076, 0.014980857228631569));
}
