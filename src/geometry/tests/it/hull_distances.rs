//! Signed distances to sphere, cone and slab against brute force, over all degenerate classes.

use medial_geometry::Vec3;
use medial_geometry::{Cone, Slab, SlabFace, Sphere};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

type Spheres = Vec<Sphere>;

fn vector(rng: &mut Pcg64) -> Vec3 {
    Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0
}

fn unit(rng: &mut Pcg64) -> Vec3 {
    loop {
        if let Some(v) = vector(rng).try_normalize() {
            return v;
        }
    }
}

/// Minimum of a convex function on [0, 1], ends included.
fn golden(f: impl Fn(f64) -> f64, steps: usize) -> f64 {
    let ratio = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut lo, mut hi) = (0.0, 1.0);
    let (mut a, mut b) = (hi - ratio * (hi - lo), lo + ratio * (hi - lo));
    let (mut fa, mut fb) = (f(a), f(b));
    let mut best = f(0.0).min(f(1.0)).min(fa).min(fb);
    for _ in 0..steps {
        if fa < fb {
            (hi, b, fb) = (b, a, fa);
            a = hi - ratio * (hi - lo);
            fa = f(a);
        } else {
            (lo, a, fa) = (a, b, fb);
            b = lo + ratio * (hi - lo);
            fb = f(b);
        }
        best = best.min(fa).min(fb);
    }
    best
}

/// The objective `|p - c(a)| - r(a)`, minimised by nested golden sections: both levels are convex.
fn brute_force(spheres: &[Sphere], p: Vec3) -> f64 {
    let edge = |a: Sphere, b: Sphere| golden(|t| a.lerp(b, t).signed_distance(p), 90);
    match *spheres {
        [a] => a.signed_distance(p),
        [a, b] => edge(a, b),
        [a, b, c] => golden(|t| edge(a.lerp(c, t), b.lerp(c, t)), 90),
        _ => unreachable!("one to three spheres"),
    }
}

fn signed(spheres: &[Sphere], p: Vec3) -> f64 {
    match *spheres {
        [a] => a.signed_distance(p),
        [a, b] => Cone::new(a, b).signed_distance(p),
        [a, b, c] => Slab::new([a, b, c]).signed_distance(p),
        _ => unreachable!("one to three spheres"),
    }
}

/// Largest coordinate or radius: the unit of the tolerances.
fn scale(spheres: &[Sphere], p: Vec3) -> f64 {
    spheres
        .iter()
        .map(|m| m.centre.abs().max_element().max(m.radius))
        .fold(p.abs().max_element(), f64::max)
}

fn sphere(rng: &mut Pcg64) -> Sphere {
    Sphere::new(vector(rng), rng.random())
}

/// A generic pair, narrow enough to have a lateral surface.
fn tapered(rng: &mut Pcg64) -> [Sphere; 2] {
    let a = sphere(rng);
    let c = vector(rng);
    let growth = (rng.random::<f64>() * 1.8 - 0.9) * a.centre.distance(c);
    [a, Sphere::new(c, (a.radius + growth).max(0.0))]
}

fn pair(class: &str, rng: &mut Pcg64) -> Spheres {
    let [a, b] = tapered(rng);
    let direction = unit(rng);
    match class {
        "generic" => vec![sphere(rng), sphere(rng)],
        "tapered" => vec![a, b],
        "contained" => {
            let inner = a.radius * 0.4;
            vec![a, Sphere::new(a.centre + direction * a.radius * 0.5, inner)]
        }
        "tangent" => {
            let inner = a.radius * 0.5;
            // Down to tangency that only rounding decides.
            let near = 10.0_f64.powf(-12.0 - 5.0 * rng.random::<f64>());
            let off = 1.0 + (rng.random::<f64>() * 2.0 - 1.0) * near;
            vec![a, Sphere::new(a.centre + direction * (a.radius - inner) * off, inner)]
        }
        "zero radii" => vec![Sphere::new(a.centre, 0.0), Sphere::new(b.centre, 0.0)],
        "one zero" => vec![a, Sphere::new(a.centre + direction * 2.0, 0.0)],
        "equal radii" => vec![a, Sphere::new(b.centre, a.radius)],
        "tiny edge" => {
            let length = 1e-13 * (1.0 + rng.random::<f64>());
            let grown = a.radius + length * (rng.random::<f64>() * 1.8 - 0.9);
            vec![a, Sphere::new(a.centre + direction * length, grown.max(0.0))]
        }
        "concentric" => vec![a, Sphere::new(a.centre, b.radius)],
        "equal" => vec![a, a],
        other => unreachable!("{other}"),
    }
}

const PAIRS: [&str; 10] = [
    "generic",
    "tapered",
    "contained",
    "tangent",
    "zero radii",
    "one zero",
    "equal radii",
    "tiny edge",
    "concentric",
    "equal",
];

fn triple(class: &str, rng: &mut Pcg64) -> Spheres {
    let [a, b] = tapered(rng);
    let c = sphere(rng);
    let span = b.centre - a.centre;
    match class {
        "third in cone" => {
            let m = a.lerp(b, rng.random());
            let inner = m.radius * 0.5;
            vec![a, b, Sphere::new(m.centre + unit(rng) * m.radius * 0.4, inner)]
        }
        "steep" => {
            // The radius grows faster across the edge than the centres move apart.
            let m = a.lerp(b, 0.5);
            let away = span.any_orthonormal_vector() * 0.3;
            vec![a, b, Sphere::new(m.centre + away, m.radius + 0.5)]
        }
        "nearly steep" => {
            let m = a.lerp(b, 0.5);
            let level = Sphere::new(b.centre, a.radius);
            let rise = 1.0 - 1e-9 * rng.random::<f64>();
            let away = span.any_orthonormal_vector() * 0.3;
            vec![a, level, Sphere::new(m.centre + away, a.radius + 0.3 * rise)]
        }
        "collinear, linear radii" => vec![a, b, a.lerp(b, rng.random())],
        "collinear" => vec![a, b, Sphere::new(a.centre.lerp(b.centre, rng.random()), c.radius)],
        "nearly collinear" => {
            let t = rng.random::<f64>() * 1.5 - 0.25;
            let thin = 10.0_f64.powf(-2.0 - 12.0 * rng.random::<f64>());
            let away = span.any_orthonormal_vector() * thin;
            let bump = thin * (rng.random::<f64>() - 0.5);
            let m = a.lerp(b, t);
            vec![a, b, Sphere::new(m.centre + away, (m.radius + bump).max(0.0))]
        }
        "needle" => {
            let short = unit(rng) * 10.0_f64.powf(-2.0 - 12.0 * rng.random::<f64>());
            let grown = a.radius + short.length() * (rng.random::<f64>() - 0.5);
            vec![a, b, Sphere::new(a.centre + short, grown.max(0.0))]
        }
        "all one" => vec![a, a, a],
        "zero radii" => [a, b, c].map(|m| Sphere::new(m.centre, 0.0)).to_vec(),
        "equal radii" => [a, b, c].map(|m| Sphere::new(m.centre, a.radius)).to_vec(),
        "flat taper" => vec![a, b, Sphere::new(c.centre, 0.5 * (a.radius + b.radius))],
        pair_class => {
            let mut spheres = pair(pair_class, rng);
            spheres.insert(rng.random_range(0..3), c);
            spheres
        }
    }
}

const TRIPLES: [&str; 11] = [
    "third in cone",
    "steep",
    "nearly steep",
    "collinear, linear radii",
    "collinear",
    "nearly collinear",
    "needle",
    "all one",
    "zero radii",
    "equal radii",
    "flat taper",
];

/// Queries all around, on the axes, in the plane, at centres, at the apex of a cone, far away.
fn queries(spheres: &[Sphere], rng: &mut Pcg64) -> Vec<Vec3> {
    let [a, b] = [spheres[0], spheres[1]];
    let last = spheres[spheres.len() - 1];
    let t = rng.random::<f64>() * 3.0 - 1.0;
    let mut points = vec![
        vector(rng) * 2.0,
        a.centre + vector(rng) * 0.3,
        vector(rng) * 1000.0,
        a.centre,
        last.centre,
        a.centre.lerp(b.centre, t),
        a.centre.lerp(b.centre, t).lerp(last.centre, rng.random::<f64>() * 2.0 - 0.5),
        a.centre + unit(rng) * a.radius,
    ];
    let growth = b.radius - a.radius;
    if growth.abs() > 1e-3 {
        points.push(a.centre.lerp(b.centre, -a.radius / growth));
    }
    points
}

fn assert_matches(class: &str, spheres: &[Sphere], rng: &mut Pcg64) {
    for p in queries(spheres, rng) {
        let (exact, oracle) = (signed(spheres, p), brute_force(spheres, p));
        let off = (exact - oracle).abs() / scale(spheres, p);
        assert!(off <= 1e-12, "{class}: {exact} for {oracle}, off by {off:e}: {spheres:?} at {p}");
        let (nearest, _) = nearest_sphere(spheres, p);
        assert!(nearest.signed_distance(p).is_finite(), "{class}: {spheres:?} at {p}");
    }
}

/// Checks spheres of each class: some as they are, others with radii of any size.
fn check_classes(
    classes: impl IntoIterator<Item = &'static str>,
    make: fn(&str, &mut Pcg64) -> Spheres,
    [as_they_are, resized]: [usize; 2],
    rng: &mut Pcg64,
) {
    for class in classes {
        for round in 0..as_they_are + resized {
            let mut spheres = make(class, rng);
            for sphere in spheres.iter_mut().filter(|_| round >= as_they_are) {
                sphere.radius *= [0.0, 1e-9, 1e-3, 1.0, 1e3][rng.random_range(0..5)];
            }
            assert_matches(class, &spheres, rng);
        }
    }
}

#[test]
fn cones_match_brute_force() {
    check_classes(PAIRS, pair, [400, 100], &mut Pcg64::seed_from_u64(1));
}

#[test]
fn slabs_match_brute_force() {
    let classes = TRIPLES.into_iter().chain(PAIRS);
    check_classes(classes, triple, [40, 100], &mut Pcg64::seed_from_u64(2));
}

fn any_class() -> impl Strategy<Value = (Spheres, Vec3)> {
    let classes: Vec<(usize, &str)> =
        TRIPLES.map(|c| (3, c)).into_iter().chain(PAIRS.map(|c| (2, c))).collect();
    (proptest::sample::select(classes), any::<u64>()).prop_map(|((count, class), seed)| {
        let mut rng = Pcg64::seed_from_u64(seed);
        let spheres = if count == 3 { triple(class, &mut rng) } else { pair(class, &mut rng) };
        let p = vector(&mut rng) * 2.0;
        (spheres, p)
    })
}

fn nearest_sphere(spheres: &[Sphere], p: Vec3) -> (Sphere, Vec<f64>) {
    match *spheres {
        [a, b] => {
            let (sphere, weights) = Cone::new(a, b).nearest_sphere(p);
            (sphere, weights.to_vec())
        }
        [a, b, c] => {
            let (sphere, weights) = Slab::new([a, b, c]).nearest_sphere(p);
            (sphere, weights.to_vec())
        }
        _ => unreachable!("two or three spheres"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// The direction from the nearest centre supports the hull: no ball reaches beyond the nearest
    /// point in it.
    #[test]
    fn nearest_centres_attain_the_distance((spheres, p) in any_class()) {
        let (distance, centre) = match *spheres {
            [a, b] => {
                let cone = Cone::new(a, b);
                prop_assert_eq!(cone.nearest_centre(p).0, cone.signed_distance(p));
                cone.nearest_centre(p)
            }
            [a, b, c] => {
                let cones = [[a, b], [b, c], [c, a]].map(|[m, n]| Cone::new(m, n).nearest_centre(p));
                let sides = cones.into_iter().reduce(|x: (f64, Vec3), y: (f64, Vec3)| if y.0 < x.0 { y } else { x }).expect("three");
                let face = SlabFace::new([a, b, c]);
                let inner = face.and_then(|face| face.nearest_centre(p));
                prop_assert_eq!(inner.map(|i| i.0), face.and_then(|f| f.signed_distance(p)));
                inner.unwrap_or(sides)
            }
            _ => unreachable!("two or three spheres"),
        };
        prop_assert!((distance - signed(&spheres, p)).abs() <= 1e-12);
        if let Some(u) = (p - centre).try_normalize() {
            let reach = |m: &Sphere| (m.centre - p).dot(u) + m.radius;
            let reach = spheres.iter().map(reach).fold(f64::NEG_INFINITY, f64::max);
            // At internal tangency the centre carries half the digits.
            prop_assert!(reach <= 1e-6 - distance, "{} {}", reach, distance);
        }
    }

    #[test]
    fn nearest_spheres_attain_the_distance_and_have_their_weights((spheres, p) in any_class()) {
        let (m, weights) = nearest_sphere(&spheres, p);
        prop_assert!((m.signed_distance(p) - signed(&spheres, p)).abs() <= 1e-12);
        prop_assert!(weights.iter().all(|&w| w >= 0.0));
        prop_assert!((weights.iter().sum::<f64>() - 1.0).abs() <= 1e-12);
        let thin = spheres.len() == 3
            && (spheres[1].centre - spheres[0].centre)
                .cross(spheres[2].centre - spheres[0].centre).length() < 1e-3;
        if !thin {
            let centre: Vec3 = spheres.iter().zip(&weights).map(|(m, w)| m.centre * *w).sum();
            let radius: f64 = spheres.iter().zip(&weights).map(|(m, w)| m.radius * w).sum();
            prop_assert!(centre.distance(m.centre) <= 1e-9);
            prop_assert!((radius - m.radius).abs() <= 1e-9);
        }
    }
}

// Tangent planes of slabs and cones, and the quadrics that are made of them.

type Matrix = [[f64; 4]; 4];

fn small_sphere(rng: &mut Pcg64) -> Sphere {
    Sphere::new(vector(rng), rng.random::<f64>() * 0.5)
}

/// Sum of `(n, 1)(n, 1)^T` over planes.
fn quadric(normals: &[Vec3]) -> Matrix {
    let mut sum = [[0.0; 4]; 4];
    for n in normals {
        let n = [n.x, n.y, n.z, 1.0];
        for i in 0..4 {
            for j in 0..4 {
                sum[i][j] += n[i] * n[j];
            }
        }
    }
    sum
}

/// `(m - o)^T A (m - o)`.
fn error(a: &Matrix, m: Sphere, origin: Sphere) -> f64 {
    let d = m.centre - origin.centre;
    let d = [d.x, d.y, d.z, m.radius - origin.radius];
    (0..4).map(|i| (0..4).map(|j| d[i] * a[i][j] * d[j]).sum::<f64>()).sum()
}

#[test]
fn slab_planes_touch_all_three_balls() {
    let mut rng = Pcg64::seed_from_u64(5);
    let (mut with, mut without) = (0, 0);
    for _ in 0..2000 {
        let m = [(); 3].map(|()| small_sphere(&mut rng));
        let slab = Slab::new(m);
        let Some(planes) = slab.planes() else {
            without += 1;
            continue;
        };
        with += 1;
        let normals = planes.normals();
        for n in normals {
            assert!((n.length() - 1.0).abs() < 1e-12);
            let offsets = m.map(|m| n.dot(m.centre) + m.radius);
            let spread = offsets.map(|o| (o - offsets[0]).abs());
            assert!(spread.iter().all(|&s| s < 1e-11), "{offsets:?}");
            // The touched points are on the boundary of the hull, so the plane is outside.
            for ball in m {
                assert!(slab.signed_distance(ball.centre + ball.radius * n).abs() < 1e-10);
            }
        }
        let turn = (m[1].centre - m[0].centre).cross(m[2].centre - m[0].centre);
        assert!(
            planes.centre_normal.dot(turn) > 0.0 && normals[0].dot(turn) > normals[1].dot(turn)
        );

        let a = quadric(&normals);
        let g = planes.gradient;
        let block = 2.0 * g.x * g.y
            + 2.0 * planes.rise.powi(2) * planes.centre_normal.x * planes.centre_normal.y;
        assert!((a[0][1] - block).abs() < 1e-12 && (a[0][3] + 2.0 * g.x).abs() < 1e-12);
        for _ in 0..4 {
            let [s, t] = [(); 2].map(|()| rng.random::<f64>() * 6.0 - 3.0);
            let affine = Sphere::new(
                m[0].centre + s * (m[1].centre - m[0].centre) + t * (m[2].centre - m[0].centre),
                m[0].radius + s * (m[1].radius - m[0].radius) + t * (m[2].radius - m[0].radius),
            );
            assert!(error(&a, affine, m[0]).abs() < 1e-11);
        }
    }
    assert!(with > 1000 && without > 20, "{with} with planes, {without} without");
}

#[test]
fn cone_planes_do_not_depend_on_the_frame() {
    let mut rng = Pcg64::seed_from_u64(6);
    for _ in 0..2000 {
        let [a, b] = [(); 2].map(|()| small_sphere(&mut rng));
        let Some(frame) = Cone::new(a, b).frame() else {
            assert!(a.centre.distance(b.centre) <= (a.radius - b.radius).abs());
            continue;
        };
        let sum = quadric(&frame.normals());
        let (s, u) = (frame.s, frame.u);
        for i in 0..3 {
            for j in 0..3 {
                let across = f64::from(u8::from(i == j)) - u[i] * u[j];
                let closed = 4.0 * s * s * u[i] * u[j] + 2.0 * (1.0 - s * s) * across;
                assert!((sum[i][j] - closed).abs() < 1e-13);
            }
            assert!((sum[i][3] + 4.0 * s * u[i]).abs() < 1e-13);
            let along: f64 = (0..3).map(|j| sum[i][j] * u[j]).sum::<f64>() + sum[i][3] * s;
            assert!(along.abs() < 1e-13, "the null vector is (u, s)");
        }
        assert!((sum[3][3] - 4.0).abs() < 1e-13);
        assert!(error(&sum, a.lerp(b, 7.0 * rng.random::<f64>()), a).abs() < 1e-11);
        for n in frame.normals() {
            assert!((n.dot(b.centre - a.centre) + b.radius - a.radius).abs() < 1e-13);
        }
    }
}
