//! Poles against the definition over all empty circumspheres, and on shapes with known axes.

use medial::Vec3;
use medial::geometry::predicates::{Sign, circumsphere, in_sphere, orient3d};
use medial::geometry::{Delaunay, Pole, Poles};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn unit(rng: &mut Pcg64) -> Vec3 {
    let mut x = || rng.random_range(-1.0..1.0);
    Vec3::new(x(), x(), x())
}

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
        let inside = |s: &Vec3| in_sphere(p[0], p[1], p[2], p[3], *s) == Sign::Positive;
        if !samples.iter().any(inside) {
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
            let above = |s: &Vec3| orient3d(p, q, r, *s) == Sign::Positive;
            if !samples.iter().any(above) {
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
        let mut samples: Vec<Vec3> = (0..n).map(|_| unit(&mut rng)).collect();
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
    let samples: Vec<Vec3> = (0..1_500).map(|_| unit(&mut rng).normalize()).collect();
    let delaunay = Delaunay::new(&samples).expect("spans space");
    let poles = Poles::new(&delaunay);
    let mut used = vec![false; poles.balls().len()];
    for poles_of in poles.samples() {
        // All samples are on the hull.
        assert!(matches!(poles_of.first, Some(Pole::Infinite(_))));
        used[poles.ball_of(poles_of.second.expect("the centre")).expect("a polar ball")] = true;
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
