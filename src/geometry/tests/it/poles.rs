//! Poles against the definition over all empty circumspheres, and on shapes with known axes.

use medial_geometry::Vec3;
use medial_geometry::predicates::{Sign, circumsphere, in_sphere, orient3d};
use medial_geometry::{Delaunay, Pole, Poles, Sphere};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::{dual_complex, in_cube};

/// Four different indices below `n`, ascending.
fn quadruples(n: usize) -> impl Iterator<Item = [usize; 4]> {
    (0..n).flat_map(move |a| {
        (a + 1..n)
            .flat_map(move |b| (b + 1..n).flat_map(move |c| (c + 1..n).map(move |d| [a, b, c, d])))
    })
}

/// The Voronoi vertices of each sample: circumcentres of empty spheres.
fn voronoi_vertices(samples: &[Vec3]) -> Vec<Vec<Vec3>> {
    let mut of_sample = vec![Vec::new(); samples.len()];
    for q in quadruples(samples.len()) {
        let mut p = q.map(|i| samples[i]);
        if orient3d(p[0], p[1], p[2], p[3]) == Sign::Negative {
            p.swap(0, 1);
        }
        if !samples.iter().any(|s: &Vec3| in_sphere(p[0], p[1], p[2], p[3], *s) == Sign::Positive) {
            let (centre, _) = circumsphere(p).expect("in general position");
            for i in q {
                of_sample[i].push(centre);
            }
        }
    }
    of_sample
}

/// The sum of the outward normals of the hull facets at a sample; `None` inside the hull.
fn hull_direction(samples: &[Vec3], at: usize) -> Option<Vec3> {
    let n = samples.len();
    let mut sum = Vec3::ZERO;
    let mut found = false;
    for i in (0..n).filter(|&i| i != at) {
        for j in (0..n).filter(|&j| j != at && j != i) {
            let [p, q, r] = [at, i, j].map(|k| samples[k]);
            if !samples.iter().any(|s: &Vec3| orient3d(p, q, r, *s) == Sign::Positive) {
                sum += (q - p).cross(r - p).normalize();
                found = true;
            }
        }
    }
    found.then(|| sum.normalize())
}

#[test]
fn random_samples_agree_with_the_definition() {
    let mut rng = Pcg64::seed_from_u64(31);
    let (mut bounded, mut unbounded, mut second) = (0, 0, 0);
    for _ in 0..60 {
        let n = rng.random_range(4..24);
        let mut samples: Vec<Vec3> = (0..n).map(|_| in_cube(&mut rng)).collect();
        samples.push(samples[0]);
        let delaunay = Delaunay::new(&samples).expect("spans space");
        let poles = Poles::new(&delaunay);
        assert_eq!(poles.of_sample(n), poles.of_sample(0));
        let vertices = voronoi_vertices(&samples[..n]);
        let centre = |cell| delaunay.circumsphere(cell).expect("finite").0;
        for (i, &p) in samples[..n].iter().enumerate() {
            let farthest = |side: &dyn Fn(Vec3) -> bool| {
                let candidates = vertices[i].iter().map(|&v| v - p).filter(|&v| side(v));
                candidates.max_by(|a, b| a.length().total_cmp(&b.length()))
            };
            let found = poles.of_sample(i);
            let towards = match (hull_direction(&samples[..n], i), found.first) {
                (Some(expected), Some(Pole::Infinite(direction))) => {
                    unbounded += 1;
                    assert!(direction.distance(expected) < 1e-9);
                    expected
                }
                (None, Some(Pole::Vertex(cell))) => {
                    bounded += 1;
                    let expected = farthest(&|_| true).expect("a bounded cell");
                    assert!(expected.distance(centre(cell) - p) < 1e-6 * expected.length());
                    expected
                }
                (expected, first) => panic!("{expected:?} but {first:?}"),
            };
            match (farthest(&|v| v.dot(towards) < 0.0), found.second) {
                (Some(expected), Some(cell)) => {
                    second += 1;
                    assert!(expected.distance(centre(cell) - p) < 1e-6 * expected.length());
                }
                (None, None) => {}
                (expected, found) => panic!("{expected:?} but {found:?}"),
            }
        }
    }
    assert!(bounded > 100 && unbounded > 300 && second > 300, "{bounded} {unbounded} {second}");
}

#[test]
fn polar_balls_are_those_of_the_poles_and_empty() {
    let mut rng = Pcg64::seed_from_u64(32);
    let samples: Vec<Vec3> = (0..1_500).map(|_| in_cube(&mut rng).normalize()).collect();
    let delaunay = Delaunay::new(&samples).expect("spans space");
    let poles = Poles::new(&delaunay);
    let mut used = vec![false; poles.balls().len()];
    for poles_of in poles.samples() {
        // All samples are on the hull.
        assert!(matches!(poles_of.first, Some(Pole::Infinite(_))));
        let cell = poles_of.second.expect("the centre");
        used[poles.balls().iter().position(|b| b.cell == cell).expect("a polar ball")] = true;
    }
    assert!(used.iter().all(|&u| u));
    assert!(poles.balls().windows(2).all(|w| w[0].cell < w[1].cell));
    for ball in poles.balls() {
        assert_eq!(ball.samples, delaunay.vertices(ball.cell).map(|v| v.0));
        let r = ball.sphere.radius;
        let distance = |s: &Vec3| s.distance(ball.sphere.centre);
        assert!(
            ball.samples.iter().all(|&s| (distance(&samples[s as usize]) - r).abs() < 1e-9 * r)
        );
        assert!(samples.iter().all(|s| distance(s) > r * (1.0 - 1e-9)));
        // The axis of a ball is its centre.
        assert!(ball.sphere.centre.length() < 1e-6);
    }
    assert_eq!(poles.inner_balls(|_| true), poles.balls());
    assert!(poles.inner_balls(|_| false).is_empty());
}

#[test]
fn grids_have_poles_and_the_same_ones_again() {
    // The surface of a block of unit cubes: all cells are degenerate.
    let samples: Vec<Vec3> = (0..9 * 9 * 5u32)
        .map(|i| [i % 9, i / 9 % 9, i / 81])
        .filter(|c| c[0] % 8 == 0 || c[1] % 8 == 0 || c[2] % 4 == 0)
        .map(|c| Vec3::from(c.map(f64::from)))
        .collect();
    let delaunay = Delaunay::new(&samples).expect("spans space");
    let poles = Poles::new(&delaunay);
    for (p, found) in samples.iter().zip(poles.samples()) {
        assert!(matches!(found.first, Some(Pole::Infinite(_))));
        let second = found.second.expect("the inside");
        let (centre, _) = delaunay.circumsphere(second).expect("finite");
        // The middle of a side looks at the axis, in the middle of the block.
        let middle = |x: f64, side: f64| x > 2.0 && x < side - 2.0;
        if middle(p.x, 8.0) && middle(p.y, 8.0) {
            assert!((centre.z - 2.0).abs() < 0.26, "{p} {centre}");
        }
    }
    let again = Poles::new(&Delaunay::new(&samples).expect("spans space"));
    assert_eq!(again.samples(), poles.samples());
    assert_eq!(again.balls(), poles.balls());
}

// Unions of polar balls.

const TORUS: (f64, f64) = (1.0, 0.4);

fn torus_samples(n: u32) -> Vec<Vec3> {
    let mut rng = Pcg64::seed_from_u64(25);
    let golden = 0.618_033_988_749_894_9;
    (0..n)
        .map(|i| {
            let jitter = 0.2 * rng.random::<f64>() / f64::from(n).sqrt();
            let u = std::f64::consts::TAU * (f64::from(i) / f64::from(n));
            let v = std::f64::consts::TAU * ((f64::from(i) * golden).fract() + jitter);
            let ring = TORUS.0 + TORUS.1 * v.cos();
            Vec3::new(ring * u.cos(), ring * u.sin(), TORUS.1 * v.sin())
        })
        .collect()
}

#[test]
fn inner_polar_balls_of_a_torus_are_a_torus() {
    let samples = torus_samples(4_000);
    let delaunay = Delaunay::new(&samples).expect("spans space");
    let poles = Poles::new(&delaunay);
    let inside = |p: Vec3| (p.truncate().length() - TORUS.0).hypot(p.z) < TORUS.1;
    let is_inside = |cell| delaunay.circumsphere(cell).is_some_and(|(c, _)| inside(c));
    let inner = poles.inner_balls(is_inside);
    for b in &inner {
        // The axis of the solid torus is the circle.
        let off = (b.sphere.centre.truncate().length() - TORUS.0).hypot(b.sphere.centre.z);
        assert!(off < 0.15, "{off}");
    }
    let mut without = 0;
    for poles in poles.samples() {
        let first = matches!(poles.first, Some(Pole::Vertex(cell)) if is_inside(cell));
        without += usize::from(!first && !poles.second.is_some_and(is_inside));
    }
    assert_eq!(without, 0, "samples without an inner pole");
    // Balls along a curve meet in circles, without a vertex.
    for grow in [1.002, 1.1, 1.5] {
        let grown = inner.iter().map(|b| Sphere::new(b.sphere.centre, grow * b.sphere.radius));
        assert_eq!(dual_complex(&grown.collect::<Vec<_>>()).betti(), [1, 1, 0], "grown by {grow}");
    }
}

#[test]
fn inner_polar_balls_of_an_ellipsoid_fill_it() {
    let axes = Vec3::new(1.0, 0.8, 0.5);
    let mut rng = Pcg64::seed_from_u64(26);
    let samples: Vec<Vec3> = (0..3_000).map(|_| in_cube(&mut rng).normalize() * axes).collect();
    let delaunay = Delaunay::new(&samples).expect("spans space");
    let inner = Poles::new(&delaunay).inner_balls(|cell| {
        delaunay.circumsphere(cell).is_some_and(|(c, _)| (c / axes).length() < 1.0)
    });
    for grow in [1.002, 1.1] {
        let grown = inner.iter().map(|b| Sphere::new(b.sphere.centre, grow * b.sphere.radius));
        assert_eq!(dual_complex(&grown.collect::<Vec<_>>()).betti(), [1, 0, 0], "grown by {grow}");
    }
}
