//! The medial axis of unions of balls: topology against the dual complex, geometry against
//! definitions, and small unions with known axes.

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere, UnionAxis, betti};
use medial::geometry::dual_complex::Class;
use medial::geometry::{DualComplex, UnionBoundary};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn ball(x: f64, y: f64, z: f64, r: f64) -> Sphere {
    Sphere::new(Vec3::new(x, y, z), r)
}

fn unit(rng: &mut Pcg64) -> Vec3 {
    let mut x = || rng.random_range(-1.0..1.0);
    Vec3::new(x(), x(), x())
}

/// The axis, checked as far as any axis can be: a valid complex, nothing open, and the homotopy type
/// of the union.
fn checked(balls: &[Sphere]) -> (UnionAxis, MedialMesh) {
    let axis = UnionAxis::of_balls(balls).expect("admissible balls");
    let mesh = axis.mesh();
    mesh.check().expect("a valid complex");
    let tally = axis.tally();
    assert_eq!((tally.open, tally.doubtful, tally.clamped), (0, 0, 0), "{tally:?} of {balls:?}");
    let expected = DualComplex::of_balls(balls).expect("admissible balls").betti();
    assert_eq!(betti(&mesh), expected, "{balls:?}");
    assert_eq!(axis.union_betti(), expected);
    (axis, mesh)
}

fn random_balls(rng: &mut Pcg64, n: usize) -> Vec<Sphere> {
    let largest = [0.2, 0.4, 0.7, 1.0][rng.random_range(0..4usize)];
    (0..n).map(|_| Sphere::new(unit(rng), rng.random_range(0.02..largest))).collect()
}

#[test]
fn random_unions_have_the_homotopy_type_of_the_dual_complex() {
    let mut rng = Pcg64::seed_from_u64(41);
    let (mut inside, mut apart, mut looped, mut hollow) = (0, 0, 0, 0);
    for round in 0..1_500 {
        let n = if round % 50 == 0 { 400 } else { rng.random_range(1..40) };
        let balls = random_balls(&mut rng, n);
        let (axis, mesh) = checked(&balls);
        inside += axis.tally().inside;
        let [b0, b1, b2] = betti(&mesh);
        apart += u32::from(b0 > 1);
        looped += u32::from(b1 > 0);
        hollow += u32::from(b2 > 0);
    }
    let seen = [apart, looped, hollow];
    assert!(inside > 10_000 && apart > 500 && looped > 200 && hollow > 10, "{inside} {seen:?}");
}

#[test]
fn axes_are_balanced_and_in_the_union() {
    let mut rng = Pcg64::seed_from_u64(42);
    let mut facets = 0;
    for _ in 0..150 {
        let n = rng.random_range(4..30);
        let balls = random_balls(&mut rng, n);
        let (axis, _) = checked(&balls);
        let boundary = UnionBoundary::new(&DualComplex::of_balls(&balls).expect("balls"));
        let corners: Vec<Vec3> = boundary.vertices().iter().map(|v| v.position).collect();
        let signed = |p: Vec3| {
            let each = balls.iter().map(|b| p.distance(b.centre) - b.radius);
            each.fold(f64::INFINITY, f64::min)
        };
        for (&b, s) in axis.balls().iter().zip(axis.spheres()) {
            assert_eq!(balls[b as usize], *s);
        }
        for s in &axis.spheres()[axis.balls().len()..] {
            // Maximal: in the union, and through four corners at least.
            for _ in 0..20 {
                let x = s.centre + (1.0 - 1e-6) * s.radius * unit(&mut rng).normalize();
                assert!(signed(x) < 0.0);
            }
            let touching = corners.iter().filter(|c| c.distance(s.centre) < s.radius + 1e-7);
            assert!(touching.count() >= 4);
            assert!(corners.iter().all(|c| c.distance(s.centre) > s.radius - 1e-9));
        }
        for facet in axis.facets() {
            facets += 1;
            let weights: Vec<f64> =
                facet.polygon.iter().map(|_| rng.random_range(0.01..1.0)).collect();
            let weighted = facet.polygon.iter().zip(&weights);
            let x: Vec3 =
                weighted.map(|(&v, w)| *w * axis.spheres()[v as usize].centre).sum::<Vec3>()
                    / weights.iter().sum::<f64>();
            let [p, q] = facet.corners.map(|c| c.distance(x));
            assert!((p - q).abs() < 1e-7);
            assert!(corners.iter().all(|c| c.distance(x) > p - 1e-7));
            assert!(signed(x + (1.0 - 1e-6) * p * unit(&mut rng).normalize()) < 0.0);
        }
    }
    assert!(facets > 1_500, "{facets}");
}

/// The distance from a point to a triangle's plane region by its barycentric coordinates, or infinity.
fn height_above(x: Vec3, [a, b, c]: [Vec3; 3]) -> f64 {
    let (u, v, w) = (b - a, c - a, x - a);
    let n = u.cross(v);
    let nn = n.length_squared();
    let (s, t) = (w.cross(v).dot(n) / nn, u.cross(w).dot(n) / nn);
    let slack = 1e-9;
    if s < -slack || t < -slack || s + t > 1.0 + slack {
        f64::INFINITY
    } else {
        w.dot(n).abs() / nn.sqrt()
    }
}

#[test]
fn nothing_of_the_axis_is_missing() {
    // Between two points of a tetrahedron of the dual complex with different nearest corners, the
    // axis is crossed where the nearest corner changes.
    let mut rng = Pcg64::seed_from_u64(43);
    let mut crossings = 0;
    while crossings < 3_000 {
        let n = rng.random_range(4..40);
        let balls = random_balls(&mut rng, n);
        let complex = DualComplex::of_balls(&balls).expect("balls");
        let boundary = UnionBoundary::new(&complex);
        let (_, mesh) = checked(&balls);
        let faces: Vec<[Vec3; 3]> =
            mesh.faces.iter().map(|f| f.map(|v| mesh.spheres[v as usize].centre)).collect();
        for cell in complex.tetrahedra() {
            let v = complex.regular().vertices(cell).map(|v| balls[v.index()].centre);
            let mut point = || {
                let w = [0; 4].map(|_| rng.random_range(0.01..1.0));
                let sum: f64 = w.iter().sum();
                (0..4).map(|k| w[k] / sum * v[k]).sum::<Vec3>()
            };
            let nearest = |x: Vec3| {
                let distance = |i: &usize| boundary.vertices()[*i].position.distance(x);
                let all = 0..boundary.vertices().len();
                all.min_by(|i, j| distance(i).total_cmp(&distance(j))).expect("corners")
            };
            let (mut x, mut y) = (point(), point());
            let (near_x, near_y) = (nearest(x), nearest(y));
            if near_x == near_y {
                continue;
            }
            for _ in 0..60 {
                let middle = (x + y) / 2.0;
                if nearest(middle) == near_x { x = middle } else { y = middle }
            }
            let height = faces.iter().map(|f| height_above(x, *f)).fold(f64::INFINITY, f64::min);
            assert!(height < 1e-7, "{x} is {height} off the axis of {balls:?}");
            crossings += 1;
        }
    }
}

#[test]
fn singular_simplices_belong_to_the_axis() {
    let mut rng = Pcg64::seed_from_u64(44);
    let mut found = [0; 3];
    for _ in 0..300 {
        let n = rng.random_range(1..12);
        let balls = random_balls(&mut rng, n);
        let complex = DualComplex::of_balls(&balls).expect("balls");
        let (axis, mesh) = checked(&balls);
        let vertex = |ball: u32| axis.balls().binary_search(&ball).expect("a vertex") as u32;
        for (v, _) in complex.vertices().filter(|v| v.1 == Class::Singular) {
            found[0] += 1;
            let v = vertex(v.0);
            assert!(mesh.edges.iter().all(|e| !e.contains(&v)));
        }
        for (e, _) in complex.edges().filter(|e| e.1 == Class::Singular) {
            found[1] += 1;
            let mut ends = complex.edge_vertices(e).map(|v| vertex(v.0));
            ends.sort_unstable();
            assert!(mesh.edges.contains(&ends));
            assert!(mesh.faces.iter().all(|f| !(f.contains(&ends[0]) && f.contains(&ends[1]))));
        }
        for (f, _) in complex.triangles().filter(|f| f.1 == Class::Singular) {
            found[2] += 1;
            let mut corners = complex.regular().facet_vertices(f).map(|v| vertex(v.0));
            corners.sort_unstable();
            assert!(mesh.faces.contains(&corners));
        }
    }
    assert!(found.iter().all(|&n| n > 100), "{found:?}");
}

#[test]
fn small_unions_have_known_axes() {
    let sizes = |balls: &[Sphere]| {
        let (_, mesh) = checked(balls);
        [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()]
    };
    assert_eq!(sizes(&[]), [0, 0, 0]);
    assert_eq!(sizes(&[ball(1.0, 2.0, 3.0, 0.5)]), [1, 0, 0]);
    // Two balls: the segment between their centres, or both.
    let two = [ball(0.0, 0.0, 0.0, 1.0), ball(1.5, 0.0, 0.0, 0.7)];
    let (_, mesh) = checked(&two);
    assert_eq!((mesh.spheres, mesh.edges), (two.to_vec(), vec![[0, 1]]));
    assert_eq!(sizes(&[two[0], ball(3.0, 0.0, 0.0, 0.7)]), [2, 0, 0]);
    // Three balls: a triangle if all meet in two points, its sides if only pairs meet.
    let three =
        |r: f64| [ball(0.0, 0.0, 0.0, r), ball(2.0, 0.0, 0.0, r), ball(1.0, 3f64.sqrt(), 0.0, r)];
    assert_eq!(sizes(&three(1.2)), [3, 3, 1]);
    assert_eq!(sizes(&three(1.1)), [3, 3, 0]);
    // A chain.
    let chain: Vec<_> =
        (0..9).map(|k| ball(f64::from(k), 0.1 * f64::from(k * k), 0.0, 0.9)).collect();
    assert_eq!(sizes(&chain[..3]), [3, 2, 0]);
    // One inside another: only the large one.
    let (_, mesh) = checked(&[ball(0.3, 0.0, 0.0, 0.5), ball(0.0, 0.0, 0.0, 1.0)]);
    assert_eq!(mesh.spheres, [ball(0.0, 0.0, 0.0, 1.0)]);
    // Four balls around a point: their centres and the point with equal distances to all corners.
    let four = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]];
    let four = four.map(|c| Sphere::new(Vec3::from(c), 1.8));
    let (_, mesh) = checked(&four);
    assert_eq!([mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()], [5, 10, 6]);
    assert!(mesh.spheres[4].centre.length() < 1e-14);
    // On the line through a face's centre, sqrt(3) away from the centre of the fourth ball.
    let distance = 3f64.sqrt() / 3.0 + (1.8f64.powi(2) - 8.0 / 3.0).sqrt();
    assert!((mesh.spheres[4].radius - distance).abs() < 1e-14);
}

#[test]
fn a_ball_covered_by_several_others_vanishes() {
    let mut balls: Vec<_> =
        [[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]]
            .map(|c| Sphere::new(Vec3::from(c), 1.5))
            .to_vec();
    balls.push(ball(0.0, 0.0, 0.0, 1.0));
    let covered = balls[6];
    let in_one = |b: &Sphere| b.centre.distance(covered.centre) <= b.radius - covered.radius;
    assert!(!balls[..6].iter().any(in_one));
    let (axis, _) = checked(&balls);
    assert_eq!(axis.balls(), [0, 1, 2, 3, 4, 5]);
    // The spheres of three balls meet at (a, a, a) with (a - 1)^2 + 2 a^2 = 1.5^2.
    let corner = 3f64.sqrt() * (1.0 + 4.75f64.sqrt()) / 3.0;
    for s in &axis.spheres()[6..] {
        assert!(s.centre.length() < 1e-14 && (s.radius - corner).abs() < 1e-14);
    }
    for (radius, count) in [(corner - 0.01, 6), (corner + 0.01, 7)] {
        balls[6].radius = radius;
        assert_eq!(checked(&balls).0.balls().len(), count);
    }
}

#[test]
fn lattices_of_balls_have_the_homotopy_type_once_perturbed() {
    // All corners and centres are degenerate, and balls touch each other in single points.
    let mut rng = Pcg64::seed_from_u64(45);
    let mut wrong = 0;
    for round in 0..400 {
        let n = rng.random_range(4..40);
        let size = rng.random_range(2..5);
        let balls: Vec<_> = (0..n)
            .map(|_| {
                let mut x = || f64::from(rng.random_range(0..size));
                let c = Vec3::new(x(), x(), x());
                let r = [0.5, 0.75, 1.0, 1.25][rng.random_range(0..4usize)];
                Sphere::new(c, if round % 2 == 0 { r } else { 0.75 })
            })
            .collect();
        let axis = UnionAxis::of_balls(&balls).expect("balls");
        let mesh = axis.mesh();
        mesh.check().expect("a valid complex");
        wrong += u32::from(betti(&mesh) != axis.union_betti());
        // As the authors of the scale axis transform do.
        let moved =
            |b: &Sphere| Sphere::new(b.centre + 1e-4 * b.radius * unit(&mut rng), 1.002 * b.radius);
        checked(&balls.iter().map(moved).collect::<Vec<_>>());
    }
    // Parts that touch in a point or along a side of measure zero: 12 of these unions.
    assert!(wrong <= 20, "{wrong}");
}

#[test]
fn threads_and_powers_of_two_do_not_matter() {
    let mut rng = Pcg64::seed_from_u64(46);
    let balls: Vec<_> =
        (0..5_000).map(|_| Sphere::new(unit(&mut rng), rng.random_range(0.0..0.15))).collect();
    let with = |threads: usize| crate::on_threads(threads, || checked(&balls).1);
    let alone = with(1);
    assert!(alone == with(2) && alone == with(5));
    let scaled: Vec<_> =
        balls.iter().map(|b| Sphere::new(1024.0 * b.centre, 1024.0 * b.radius)).collect();
    assert_eq!(checked(&scaled).1, alone.transformed(1024.0, |p| 1024.0 * p));
}
