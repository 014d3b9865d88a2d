//! The dual complex and the vertices of the union's boundary, against definitions without any
//! triangulation, and on balls with known topology.

use std::collections::BTreeSet;

use medial_geometry::dual_complex::Class;
use medial_geometry::{
    DualComplex, Regular, Sphere, TriangulationError, UnionBoundary, Vec3, VertexId,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::{dual_complex, in_cube, lattice, on_threads, shuffle};

fn ball(x: f64, y: f64, z: f64, r: f64) -> Sphere {
    Sphere::new(Vec3::new(x, y, z), r)
}

/// Each simplex as its ascending vertices.
fn simplices(complex: &DualComplex<'_>) -> BTreeSet<Vec<usize>> {
    let regular = complex.regular();
    let vertices = complex.vertices().map(|(v, _)| vec![v]);
    let edges = complex.edges().map(|(edge, _)| complex.edge_vertices(edge).to_vec());
    let triangles = complex.triangles().map(|(facet, _)| regular.facet_vertices(facet).to_vec());
    let tetrahedra = complex.tetrahedra().map(|cell| regular.vertices(cell).to_vec());
    let all = vertices.chain(edges).chain(triangles).chain(tetrahedra);
    all.map(|mut simplex| {
        simplex.sort_unstable();
        simplex.into_iter().map(VertexId::index).collect()
    })
    .collect()
}

fn random_balls(rng: &mut Pcg64, n: usize) -> Vec<Sphere> {
    let largest = [0.3, 0.6, 1.0][rng.random_range(0..3usize)];
    let mut balls: Vec<Sphere> = Vec::new();
    for i in 0..n {
        // Every third near another, where it may be hidden.
        let centre =
            if i % 3 == 2 { balls[i - 1].centre + 0.15 * in_cube(rng) } else { in_cube(rng) };
        balls.push(Sphere::new(centre, rng.random_range(0.02..largest)));
    }
    balls
}

// Definitions, in rounded arithmetic and without a triangulation.

/// A decision that rounding could have changed ends a trial.
struct Doubtful;

fn decide(x: f64) -> Result<bool, Doubtful> {
    if x.abs() < 1e-9 { Err(Doubtful) } else { Ok(x > 0.0) }
}

/// The orthocentre of up to four balls in their affine hull: Gram-Schmidt, one ball at a time.
fn orthocentre(balls: &[Sphere], ids: &[usize]) -> Result<(Vec3, f64), Doubtful> {
    let first = balls[ids[0]];
    let weight = |s: Sphere| s.radius * s.radius;
    let mut basis: Vec<Vec3> = Vec::new();
    let mut offset = Vec3::ZERO;
    for &i in &ids[1..] {
        let d = balls[i].centre - first.centre;
        let lift = d.length_squared() + weight(first) - weight(balls[i]);
        let mut fresh = d;
        for b in &basis {
            fresh -= fresh.dot(*b) * *b;
        }
        decide(fresh.length() - 1e-4)?;
        let fresh = fresh.normalize();
        // 2 d . (offset + t fresh) = lift
        offset += (lift / 2.0 - d.dot(offset)) / d.dot(fresh) * fresh;
        basis.push(fresh);
    }
    Ok((first.centre + offset, offset.length_squared() - weight(first)))
}

fn power(s: Sphere, x: Vec3) -> f64 {
    x.distance_squared(s.centre) - s.radius * s.radius
}

/// All subsets of `0..n` of `k` members.
fn subsets(n: usize, k: usize) -> Vec<Vec<usize>> {
    if k == 0 {
        return vec![vec![]];
    }
    let smaller = subsets(n, k - 1);
    smaller
        .into_iter()
        .flat_map(|s: Vec<usize>| {
            let start = s.last().map_or(0, |l| l + 1);
            (start..n).map(move |i| [s.clone(), vec![i]].concat())
        })
        .collect()
}

/// The dual complex: a simplex is in it if no ball at all has a smaller power at its orthocentre
/// than it has and that power is negative, or if it is a face of such a one.
fn complex_by_definition(balls: &[Sphere]) -> Result<BTreeSet<Vec<usize>>, Doubtful> {
    let mut complex = BTreeSet::new();
    for k in (1..=4.min(balls.len())).rev() {
        for s in subsets(balls.len(), k) {
            if complex.iter().any(|t: &Vec<usize>| s.iter().all(|i| t.contains(i))) {
                complex.insert(s);
                continue;
            }
            let (o, rho2) = orthocentre(balls, &s)?;
            let mut member = !decide(rho2)?;
            for (_, b) in balls.iter().enumerate().filter(|(i, _)| !s.contains(i)) {
                member &= decide(power(*b, o) - rho2)?;
            }
            if member {
                complex.insert(s);
            }
        }
    }
    Ok(complex)
}

/// The points of three spheres on the boundary of the union.
fn vertices_by_definition(balls: &[Sphere]) -> Result<Vec<([u32; 3], Vec3)>, Doubtful> {
    let mut found = Vec::new();
    for s in subsets(balls.len(), 3) {
        let (o, rho2) = orthocentre(balls, &s)?;
        if decide(rho2)? {
            continue;
        }
        let [a, b, c] = [0, 1, 2].map(|k| balls[s[k]].centre);
        let up = (b - a).cross(c - a).normalize();
        for x in [o + (-rho2).sqrt() * up, o - (-rho2).sqrt() * up] {
            let mut visible = true;
            for (_, b) in balls.iter().enumerate().filter(|(i, _)| !s.contains(i)) {
                visible &= decide(power(*b, x))?;
            }
            if visible {
                found.push(([0, 1, 2].map(|k| s[k] as u32), x));
            }
        }
    }
    Ok(found)
}

#[test]
fn random_balls_agree_with_the_definitions() {
    let mut rng = Pcg64::seed_from_u64(21);
    let (mut trials, mut hidden, mut outside, mut vertices) = (0, 0, 0, 0);
    while trials < 500 {
        let n = rng.random_range(1..17);
        let balls = random_balls(&mut rng, n);
        let (Ok(expected), Ok(points)) =
            (complex_by_definition(&balls), vertices_by_definition(&balls))
        else {
            continue;
        };
        trials += 1;
        let complex = dual_complex(&balls);
        assert_eq!(simplices(&complex), expected, "{balls:?}");
        hidden += complex.regular().hidden().iter().filter(|v| v.index() < n).count();
        let visible = (0..n as u32).map(VertexId).filter(|&v| complex.regular().is_vertex(v));
        outside += visible.filter(|&v| complex.vertex_class(v).is_none()).count();

        let boundary = UnionBoundary::new(&complex);
        assert_eq!(boundary.vertices().len(), points.len(), "{balls:?}");
        vertices += points.len();
        for (mut ids, x) in points {
            ids.sort_unstable();
            let near = boundary.vertices().iter().any(|v| {
                let mut balls = v.balls;
                balls.sort_unstable();
                balls == ids && v.position.distance(x) < 1e-7
            });
            assert!(near, "{ids:?} at {x} of {balls:?}");
        }
        assert_eq!(boundary.merge().0.len(), boundary.vertices().len());
    }
    assert!(hidden > 30 && outside > 60 && vertices > 1_000, "{hidden} {outside} {vertices}");
}

#[test]
fn boundary_vertices_of_many_balls_are_on_the_boundary() {
    let mut rng = Pcg64::seed_from_u64(22);
    for radius in [0.1, 0.3, 0.5] {
        let balls: Vec<_> = (0..600)
            .map(|_| Sphere::new(in_cube(&mut rng), radius * rng.random_range(0.2..1.0)))
            .collect();
        let complex = dual_complex(&balls);
        let boundary = UnionBoundary::new(&complex);
        assert!(radius < 0.2 || boundary.vertices().len() > 300);
        for v in boundary.vertices() {
            for i in v.balls {
                assert!(power(balls[i as usize], v.position).abs() < 1e-9);
            }
            assert!(balls.iter().all(|&b| power(b, v.position) > -1e-9));
        }
    }
}

// Small and lower-dimensional inputs.

#[test]
fn no_balls_have_an_empty_complex() {
    let complex = dual_complex(&[]);
    assert_eq!((complex.counts(), complex.betti(), complex.euler()), ([0; 4], [0; 3], 0));
    assert!(UnionBoundary::new(&complex).vertices().is_empty());
}

#[test]
fn one_ball_is_one_vertex() {
    for b in [
        ball(0.0, 0.0, 0.0, 1.0),
        ball(1e57, -1e57, 3.0, 1e-9),
        ball(7.0, -5.0, 3.0, 0.0),
        ball(1e-200, 0.0, 0.0, 1e-210),
    ] {
        let complex = dual_complex(&[b]);
        assert_eq!(complex.counts(), [1, 0, 0, 0]);
        assert_eq!(complex.vertex_class(VertexId(0)), Some(Class::Singular));
    }
}

#[test]
fn two_balls_are_joined_if_they_meet() {
    let pair = |distance: f64, r: f64, s: f64| {
        let balls = [ball(1.0, 2.0, 3.0, r), ball(1.0 + distance, 2.0, 3.0, s)];
        let complex = dual_complex(&balls);
        (complex.counts(), complex.vertices().map(|(v, _)| v.0).collect::<Vec<_>>())
    };
    assert_eq!(pair(3.0, 1.0, 1.0), ([2, 0, 0, 0], vec![0, 1]));
    // Exactly tangent from outside.
    assert_eq!(pair(2.0, 1.0, 1.0), ([2, 1, 0, 0], vec![0, 1]));
    assert_eq!(pair(2.0, 1.5, 0.5), ([2, 1, 0, 0], vec![0, 1]));
    assert_eq!(pair(1.0, 1.0, 1.0), ([2, 1, 0, 0], vec![0, 1]));
    // One inside the other, not concentric: visible, but only the large one counts.
    assert_eq!(pair(1.0, 4.0, 0.5), ([1, 0, 0, 0], vec![0]));
    assert_eq!(pair(1.0, 0.5, 4.0), ([1, 0, 0, 0], vec![1]));
    // Internally tangent: the point of tangency is in the closed power cell of the small one.
    assert_eq!(pair(1.0, 3.0, 2.0), ([2, 1, 0, 0], vec![0, 1]));
    // Concentric, and the same twice.
    assert_eq!(pair(0.0, 3.0, 2.0), ([1, 0, 0, 0], vec![0]));
    assert_eq!(pair(0.0, 2.0, 3.0), ([1, 0, 0, 0], vec![1]));
    assert_eq!(pair(0.0, 2.0, 2.0), ([1, 0, 0, 0], vec![0]));
}

#[test]
fn balls_on_a_line_are_a_chain() {
    let direction = Vec3::new(1.0, -2.0, 2.0);
    let row: Vec<_> = (0..7).map(|k| Sphere::new(f64::from(k) * direction, 1.5)).collect();
    let complex = dual_complex(&row);
    assert_eq!((complex.counts(), complex.betti()), ([7, 6, 0, 0], [1, 0, 0]));
    assert!(complex.edges().all(|(_, class)| class == Class::Singular));
    let apart: Vec<_> = row.iter().map(|b| Sphere::new(b.centre, 1.5f64.next_down())).collect();
    assert_eq!(dual_complex(&apart).betti(), [7, 0, 0]);
}

#[test]
fn three_balls_have_the_arrangement_s_complex() {
    let three = |r: f64| {
        let balls = [ball(0.0, 0.0, 0.0, r), ball(6.0, 0.0, 0.0, r), ball(0.0, 8.0, 0.0, r)];
        let complex = dual_complex(&balls);
        (complex.counts(), UnionBoundary::new(&complex).vertices().len())
    };
    assert_eq!(three(2.0), ([3, 0, 0, 0], 0));
    assert_eq!(three(3.0), ([3, 1, 0, 0], 0));
    assert_eq!(three(4.5), ([3, 2, 0, 0], 0));
    // The circle through the right-angled corners has radius 5: they meet in one point, then in two.
    assert_eq!(three(5.0), ([3, 3, 1, 0], 1));
    assert_eq!(three(6.0), ([3, 3, 1, 0], 2));
}

#[test]
fn balls_in_a_plane_may_leave_holes() {
    let grid = |r: f64, tilt: Vec3| {
        let balls: Vec<_> = (0..16)
            .map(|i: u32| {
                let (x, y) = (f64::from(i % 4), f64::from(i / 4));
                Sphere::new(Vec3::new(6.0 * x, 8.0 * y, 0.0) + tilt * x, r)
            })
            .collect();
        let complex = dual_complex(&balls);
        (complex.betti(), UnionBoundary::new(&complex).merge().0.len())
    };
    assert_eq!(grid(2.5, Vec3::ZERO), ([16, 0, 0], 0));
    assert_eq!(grid(3.0, Vec3::ZERO), ([4, 0, 0], 0));
    assert_eq!(grid(4.0, Vec3::ZERO), ([1, 9, 0], 0));
    // All four balls of a rectangle meet in its middle, then above and below it.
    assert_eq!(grid(5.0, Vec3::ZERO), ([1, 0, 0], 9));
    assert_eq!(grid(6.0, Vec3::ZERO), ([1, 0, 0], 18));
    assert_eq!(grid(4.2, Vec3::new(-0.75, 0.0, 1.0)), ([1, 9, 0], 0));
}

#[test]
fn unusable_balls_are_named() {
    let good = ball(0.0, 0.0, 0.0, 1.0);
    for radius in [-1.0, f64::NAN, f64::INFINITY] {
        let error = DualComplex::of_balls(&[good, ball(0.0, 0.0, 1.0, radius)]).expect_err("bad");
        assert!(matches!(error, TriangulationError::Radius { index: 1, .. }));
    }
    let error = DualComplex::of_balls(&[ball(f64::NAN, 0.0, 0.0, 1.0)]).expect_err("bad");
    assert!(matches!(error, TriangulationError::NotFinite { index: 0, .. }));
}

// Arrangements with known topology.

/// Betti numbers and the number of distinct boundary vertices of equal balls on a 3 x 3 x 3 lattice.
#[test]
fn equal_balls_on_a_lattice_pass_their_thresholds_exactly() {
    for (weight, betti, vertices) in [
        (-1.0, [0, 0, 0], 0),
        (0.0, [27, 0, 0], 0),
        (0.25f64.next_down(), [27, 0, 0], 0),
        // 54 edges of the lattice close.
        (0.25, [1, 28, 0], 0),
        (0.5f64.next_down(), [1, 28, 0], 0),
        // Each of 36 squares is filled in a point, which leaves eight voids; then it has two
        // points, one on either side.
        (0.5, [1, 0, 8], 36),
        (0.5f64.next_up(), [1, 0, 8], 72),
        (0.75f64.next_down(), [1, 0, 8], 72),
        // The voids close in points; only the outer squares have vertices.
        (0.75, [1, 0, 0], 24),
        (2.0, [1, 0, 0], 24),
    ] {
        let regular = Regular::new(&lattice(3, 1.0), &[weight; 27]).expect("spans space");
        let complex = DualComplex::new(&regular);
        complex.check().expect("a complex");
        assert_eq!(complex.betti(), betti, "weight {weight}");
        assert_eq!(UnionBoundary::new(&complex).merge().0.len(), vertices);
    }
}

#[test]
fn rings_and_shells_have_their_loops_and_voids() {
    let ring: Vec<_> = (0..40)
        .map(|k| f64::from(k) * std::f64::consts::TAU / 40.0)
        .map(|t| ball(t.cos(), t.sin(), 0.3 * t.sin(), 0.15))
        .collect();
    assert_eq!(dual_complex(&ring).betti(), [1, 1, 0]);
    // Two rings, and one point away from them.
    let mut two = ring.clone();
    two.extend(ring.iter().map(|b| Sphere::new(b.centre + 5.0 * Vec3::Z, 0.15)));
    two.push(ball(0.0, 0.0, 2.0, 0.0));
    assert_eq!(dual_complex(&two).betti(), [3, 2, 0]);
    let mut rng = Pcg64::seed_from_u64(23);
    let shell: Vec<_> = (0..400).map(|_| Sphere::new(in_cube(&mut rng).normalize(), 0.3)).collect();
    let complex = dual_complex(&shell);
    assert_eq!((complex.betti(), complex.euler()), ([1, 0, 1], 2));
    // A ball inside the void, then one that fills it.
    let mut more = shell.clone();
    more.push(ball(0.0, 0.0, 0.0, 0.2));
    assert_eq!(dual_complex(&more).betti(), [2, 0, 1]);
    more.push(ball(0.0, 0.0, 0.0, 0.9));
    assert_eq!(dual_complex(&more).betti(), [1, 0, 0]);
}

// Changes that change nothing.

/// Simplices as sets of balls by position, so that numbering does not matter.
fn geometric(balls: &[Sphere]) -> BTreeSet<Vec<[u64; 4]>> {
    simplices(&dual_complex(balls))
        .into_iter()
        .map(|s: Vec<usize>| {
            let mut keys: Vec<_> = s
                .into_iter()
                .map(|i: usize| {
                    let b = balls[i];
                    [b.centre.x, b.centre.y, b.centre.z, b.radius].map(|x| (x + 0.0).to_bits())
                })
                .collect();
            keys.sort_unstable();
            keys
        })
        .collect()
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
                let c = in_cube(&mut rng).to_array().map(|x| dyadic(x, steps));
                Sphere::new(Vec3::from(c), dyadic(rng.random_range(0.0..0.8), steps))
            })
            .collect();
        let mut shuffled = balls.clone();
        shuffle(&mut shuffled, &mut rng);
        assert_eq!(geometric(&balls), geometric(&shuffled));
        let expected = simplices(&dual_complex(&balls));
        for scale in [f64::powi(2.0, 40), f64::powi(2.0, -40)] {
            let scaled: Vec<_> =
                balls.iter().map(|b| Sphere::new(b.centre * scale, b.radius * scale)).collect();
            assert_eq!(simplices(&dual_complex(&scaled)), expected);
        }
        let moved: Vec<_> = balls
            .iter()
            .map(|b| Sphere::new(b.centre + Vec3::new(1024.0, -65536.0, 2.0), b.radius))
            .collect();
        assert_eq!(simplices(&dual_complex(&moved)), expected);
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let mut rng = Pcg64::seed_from_u64(27);
    let balls: Vec<_> =
        (0..6_000).map(|_| Sphere::new(in_cube(&mut rng), rng.random_range(0.0..0.15))).collect();
    let [one, two, five] = [1, 2, 5].map(|threads| {
        on_threads(threads, || {
            let complex = dual_complex(&balls);
            let classes: Vec<_> = complex.edges().collect();
            let boundary = UnionBoundary::new(&complex);
            (simplices(&complex), classes, boundary.vertices().to_vec(), boundary.merge())
        })
    });
    assert!(one == two && one == five);
}

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
        let (_, point_of) = boundary.merge();
        let at = |i: usize| boundary.vertices()[i].position;
        // Flat triangles place their points badly: those of the origin within this.
        let here: BTreeSet<u32> = (0..boundary.vertices().len())
            .filter(|&i| at(i).length() < 1e-4)
            .map(|i| point_of[i])
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
