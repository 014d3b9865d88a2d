//! Samplings: exact counts, distribution by area, spacing, determinism.

use crate::shapes::*;
use medial::Vec3;
use medial::surface::{InsideTest, Sampling, Side, TriMesh, sample};

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
        ("auto", Sampling::Auto),
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
    // Spacing of the densest packing of so many points on this area.
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
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_eq!(pool.install(|| sample(&mesh, &sampling)), points);
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
