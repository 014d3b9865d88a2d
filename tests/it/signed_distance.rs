//! Winding numbers and signed distances against sums, closed forms and the exact inside test.

use std::f64::consts::{PI, TAU};

use medial::Vec3;
use medial::surface::{BvhError, SignedDistance, TriangleBvh, WindingTree};
use medial::surface::{GeneralisedWinding, InsideTest, Side, TriMesh};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Quads `(i, j)` of a grid of `n` by `m`, each cut in two.
fn grid_faces(n: u32, m: u32, id: impl Fn(u32, u32) -> u32) -> Vec<[u32; 3]> {
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    faces
}

fn torus(n: u32, m: u32) -> TriMesh {
    let angle = |k: u32, count: u32| TAU * f64::from(k) / f64::from(count);
    let vertices = (0..n * m)
        .map(|k| {
            let (u, v) = (angle(k / m, n), angle(k % m, m));
            let ring = 1.0 + 0.35 * v.cos();
            Vec3::new(ring * u.cos(), ring * u.sin(), 0.35 * v.sin())
        })
        .collect();
    TriMesh { vertices, faces: grid_faces(n, m, |i, j| i % n * m + j % m) }
}

/// The upper half of the unit sphere without its bottom; the rim is a regular `n`-gon at `z = 0`.
fn hemisphere(n: u32, m: u32) -> TriMesh {
    let vertices = (0..=m)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .map(|(i, j)| {
            let (u, v) =
                (TAU * f64::from(j) / f64::from(n), PI / 2.0 * f64::from(i) / f64::from(m));
            // The pole is one point, repeated: its triangles have no area.
            let wide = if i == m { 0.0 } else { v.cos() };
            Vec3::new(wide * u.cos(), wide * u.sin(), v.sin())
        })
        .collect();
    let mut faces = grid_faces(m, n, |i, j| i * n + j % n);
    faces.iter_mut().for_each(|f| f.swap(1, 2));
    TriMesh { vertices, faces }
}

fn vector(rng: &mut Pcg64) -> Vec3 {
    Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0
}

fn soup(count: usize, rng: &mut Pcg64) -> Vec<[Vec3; 3]> {
    (0..count)
        .map(|_| {
            let a = vector(rng);
            [a, a + 0.2 * vector(rng), a + 0.2 * vector(rng)]
        })
        .collect()
}

#[test]
fn closed_surfaces_have_integer_winding_numbers() {
    let mut mesh = torus(48, 32);
    // A second, smaller torus in the tube of the first, turned inside out: winding number 0 there.
    let cavity = torus(48, 16);
    let first = mesh.vertices.len() as u32;
    let shrink = |v: Vec3| {
        let ring = Vec3::new(v.x, v.y, 0.0).normalize();
        ring + 0.5 * (v - ring)
    };
    mesh.vertices.extend(cavity.vertices.iter().map(|&v| shrink(v)));
    mesh.faces.extend(cavity.faces.iter().map(|&[a, b, c]| [a + first, c + first, b + first]));
    let test = InsideTest::new(&mesh);
    let generalised = GeneralisedWinding::new(&mesh);
    assert_eq!(generalised.boundary_edges(), 0);
    let coarse = WindingTree::new(&mesh).unwrap();
    let fine = coarse.clone().with_tolerance(1e-5);
    let mut rng = Pcg64::seed_from_u64(1);
    let mut seen = [0; 2];
    for _ in 0..1500 {
        let p = vector(&mut rng) * Vec3::new(1.4, 1.4, 0.4);
        let exact = test.winding_number(p).unwrap();
        seen[exact as usize] += 1;
        let exact = f64::from(exact);
        assert_eq!(generalised.number(p), Some(exact));
        assert!((coarse.winding_number_by_sum(p) - exact).abs() < 1e-11);
        assert!((coarse.winding_number(p) - exact).abs() <= WindingTree::TOLERANCE);
        assert!((fine.winding_number(p) - exact).abs() <= 1e-5);
        // Barill's method has no bound on the sum; near it is good to a few hundredths.
        assert!((coarse.winding_beyond(p, 2.0).number - exact).abs() < 0.05);
    }
    assert!(seen[0] > 300 && seen[1] > 200, "{seen:?}");
}

#[test]
fn soups_match_the_sum_within_the_tolerance_and_the_reported_error() {
    let mut rng = Pcg64::seed_from_u64(2);
    let triangles = soup(700, &mut rng);
    let tree = WindingTree::from_triangles(&triangles).unwrap();
    let (mut worst, mut promised): (f64, f64) = (0.0, 0.0);
    for tolerance in [1e-1, 1e-2, 1e-3, 1e-6, 0.0] {
        let tree = tree.clone().with_tolerance(tolerance);
        for k in 0..300 {
            let p = vector(&mut rng) * if k % 10 == 0 { 50.0 } else { 1.5 };
            let (winding, sum) = (tree.winding(p), tree.winding_number_by_sum(p));
            assert!(winding.error <= tolerance);
            let off = (winding.number - sum).abs();
            assert!(off <= winding.error + 1e-12, "{off:e} above {:e}", winding.error);
            (worst, promised) = (worst.max(off), promised.max(winding.error));
        }
    }
    // The promise is not an empty one.
    assert!(promised < 1e4 * worst, "promised {promised:e}, seen {worst:e}");
}

/// With the missing bottom, a polygon, the winding number would be 1 inside and 0 outside. Seen from
/// the axis the solid angle of a regular polygon is `2 pi` minus the turns between its sides' planes.
#[test]
fn an_open_hemisphere_has_its_closed_form() {
    let n = 40;
    let mesh = hemisphere(n, 20);
    let tree = WindingTree::new(&mesh).unwrap().with_tolerance(1e-6);
    let by_boundary = GeneralisedWinding::new(&mesh);
    assert_eq!(by_boundary.boundary_edges(), n as usize);
    for height in [-3.0, -0.5, -1e-3, 1e-3, 0.5, 0.9, 2.0] {
        let eye = Vec3::Z * height;
        let corner = |k: u32| {
            let u = TAU * f64::from(k) / f64::from(n);
            Vec3::new(u.cos(), u.sin(), 0.0) - eye
        };
        let planes = [corner(0).cross(corner(1)), corner(1).cross(corner(2))];
        let turn = planes[0].cross(planes[1]).length().atan2(planes[0].dot(planes[1]));
        let bottom = (TAU - f64::from(n) * turn) / (4.0 * PI);
        let inside = f64::from(u8::from((0.0..0.99).contains(&height)));
        let exact = if height > 0.0 { inside - bottom } else { bottom };
        assert!((tree.winding_number_by_sum(eye) - exact).abs() < 1e-12, "at {height}");
        assert!((tree.winding_number(eye) - exact).abs() <= 1e-6);
        assert!((by_boundary.number(eye).unwrap() - exact).abs() < 1e-12);
    }
    assert!((tree.winding_number_by_sum(Vec3::ZERO) - 0.5).abs() < 1e-14);
}

/// The mean of both sides within faces; at edges and corners the share of the full angle.
#[test]
fn on_the_surface_the_number_is_the_share_of_the_inside() {
    let corner =
        |k: u32| Vec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2 & 1)) - 0.5;
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let cube = TriMesh { vertices: (0..8).map(corner).collect(), faces };
    let tree = WindingTree::new(&cube).unwrap();
    let cases = [
        (Vec3::ZERO, 1.0),
        (Vec3::new(0.5, 0.1, 0.2), 0.5),
        (Vec3::new(0.5, 0.0, 0.0), 0.5),
        (Vec3::new(0.5, 0.5, 0.2), 0.25),
        (Vec3::splat(0.5), 0.125),
        (Vec3::new(0.5, 0.0, 3.0), 0.0),
    ];
    for (p, exact) in cases {
        let found = tree.winding_number_by_sum(p);
        assert!((found - exact).abs() < 1e-15, "{found} at {p}");
    }
}

#[test]
fn motions_and_scales_change_nothing() {
    let mut rng = Pcg64::seed_from_u64(3);
    let triangles = soup(200, &mut rng);
    let tree = WindingTree::from_triangles(&triangles).unwrap();
    let (sin, cos) = 0.7_f64.sin_cos();
    let turn = |p: Vec3| Vec3::new(cos * p.x - sin * p.y, p.z, -(sin * p.x + cos * p.y));
    let moved = |p: Vec3| turn(p) + Vec3::new(2.0, -1.0, 0.5);
    let turned =
        WindingTree::from_triangles(&triangles.iter().map(|t| t.map(moved)).collect::<Vec<_>>())
            .unwrap();
    for scale in [1e140, 1e-140, 3.0] {
        let scaled: Vec<_> = triangles.iter().map(|t| t.map(|v| v * scale)).collect();
        let scaled = WindingTree::from_triangles(&scaled).unwrap();
        for _ in 0..20 {
            let p = vector(&mut rng) * 1.5;
            let number = tree.winding_number_by_sum(p);
            assert!((turned.winding_number_by_sum(moved(p)) - number).abs() < 1e-11);
            assert!((turned.winding_number(moved(p)) - number).abs() <= turned.tolerance());
            assert!((scaled.winding_number_by_sum(p * scale) - number).abs() < 1e-11);
            assert!((scaled.winding_number(p * scale) - number).abs() <= scaled.tolerance());
        }
    }
}

#[test]
fn any_threads_give_the_same_bytes() {
    let mesh = torus(60, 40);
    let (tree, test) = (TriangleBvh::new(&mesh).unwrap(), InsideTest::new(&mesh));
    let winding = WindingTree::new(&mesh).unwrap();
    let mut rng = Pcg64::seed_from_u64(4);
    let points: Vec<Vec3> = (0..5000).map(|_| vector(&mut rng) * 1.3).collect();
    let answers = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let bits = |values: Vec<f64>| values.into_iter().map(f64::to_bits).collect::<Vec<_>>();
        pool.install(|| {
            [
                bits(winding.winding_number_batch(&points)),
                bits(SignedDistance::closed(&tree, &test).batch(&points)),
                bits(SignedDistance::soup(&tree, &winding).batch(&points)),
            ]
        })
    };
    let one = answers(1);
    assert_eq!(one, answers(2));
    assert_eq!(one, answers(3));
    let single = points.iter().map(|&p| winding.winding_number(p).to_bits());
    assert!(single.eq(one[0].iter().copied()));
    assert_eq!(one[1], one[2], "the torus is closed: both tests tell the same side");
}

#[test]
fn signed_distances_are_distances_with_the_side() {
    let mesh = torus(60, 40);
    let (tree, test) = (TriangleBvh::new(&mesh).unwrap(), InsideTest::new(&mesh));
    let distance = SignedDistance::closed(&tree, &test);
    let mut rng = Pcg64::seed_from_u64(6);
    let points: Vec<Vec3> =
        (0..2000).map(|_| vector(&mut rng) * Vec3::new(1.4, 1.4, 0.4)).collect();
    for (&p, found) in points.iter().zip(distance.batch(&points)) {
        // The smooth torus is within the sagitta of its facets.
        let smooth = (p.x.hypot(p.y) - 1.0).hypot(p.z) - 0.35;
        assert!((found - smooth).abs() < 0.004, "{found} for {smooth} at {p}");
        assert_eq!(found.abs(), tree.closest(p).distance);
        assert_eq!(found < 0.0, test.side(p) == Side::Inside);
        assert_eq!(found.to_bits(), distance.at(p).to_bits());
    }
    for &v in mesh.vertices.iter().take(100) {
        assert_eq!(distance.at(v).to_bits(), 0.0_f64.to_bits());
    }
}

/// A surface with a hole still tells its inside, away from the hole.
#[test]
fn holes_are_bridged() {
    let mut mesh = torus(60, 40);
    mesh.faces.drain(100..130);
    let tree = TriangleBvh::new(&mesh).unwrap();
    let winding = GeneralisedWinding::new(&mesh);
    let distance = SignedDistance::open(&tree, &winding);
    let expanded = WindingTree::new(&mesh).unwrap();
    let approximate = SignedDistance::soup(&tree, &expanded);
    let mut rng = Pcg64::seed_from_u64(7);
    for _ in 0..1000 {
        let p = vector(&mut rng) * Vec3::new(1.4, 1.4, 0.4);
        let smooth = (p.x.hypot(p.y) - 1.0).hypot(p.z) - 0.35;
        let found = distance.at(p);
        assert_eq!(found.abs(), tree.closest(p).distance);
        let near_hole = mesh.vertices[40..120].iter().any(|v| v.distance(p) < 0.15);
        if smooth.abs() > 0.005 && !near_hole {
            assert_eq!(found < 0.0, smooth < 0.0, "{found} for {smooth} at {p}");
            assert_eq!(found, approximate.at(p));
        }
    }
}

/// Crossings and walls against the sum of all solid angles: on an open mesh, on a soup without
/// shared vertices, and at points straight below and above vertices and edges, and below everything.
#[test]
fn one_ray_and_the_boundary_give_the_sum() {
    let mut rng = Pcg64::seed_from_u64(8);
    let mut holed = torus(24, 16);
    holed.faces.drain(50..90);
    holed.faces.drain(300..301);
    let mut crooked = hemisphere(12, 5);
    // One face turned over, one twice.
    crooked.faces[7].swap(0, 1);
    crooked.faces.push(crooked.faces[40]);
    let separate = soup(60, &mut rng);
    let vertices = separate.iter().flatten().copied().collect();
    let separate =
        TriMesh { vertices, faces: (0..60).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect() };
    let lattice = TriMesh {
        vertices: (0..27)
            .map(|k| Vec3::new((k % 3) as f64, (k / 3 % 3) as f64, (k / 9) as f64))
            .collect(),
        faces: (0..40).map(|_| [(); 3].map(|()| rng.random_range(0..27))).collect(),
    };
    for (mesh, edges) in [(holed, None), (crooked, None), (separate, Some(180)), (lattice, None)] {
        let winding = GeneralisedWinding::new(&mesh);
        assert_eq!(winding.boundary_edges(), edges.unwrap_or(winding.boundary_edges()));
        let tree = WindingTree::new(&mesh).unwrap();
        let mut points: Vec<Vec3> = (0..600).map(|_| vector(&mut rng) * 1.5).collect();
        for f in 0..mesh.faces.len() {
            let [a, b, c] = mesh.triangle(f);
            for height in [-7.0, -0.25, 0.75, 9.0] {
                points.extend([a, (a + b) * 0.5, (a + b + c) / 3.0].map(|v| v + Vec3::Z * height));
            }
        }
        let surface = TriangleBvh::new(&mesh).unwrap();
        let mut told = 0;
        for (&p, number) in points.iter().zip(winding.numbers(&points)) {
            assert_eq!(number, winding.number(p));
            // Beside a boundary edge both sides round.
            let near =
                mesh.faces.iter().flatten().any(|&v| mesh.vertices[v as usize].distance(p) < 1e-3);
            let Some(number) = number.filter(|_| !near) else { continue };
            if surface.closest(p).distance > 1e-6 {
                let sum = tree.winding_number_by_sum(p);
                assert!((number - sum).abs() < 1e-9, "{number} for {sum} at {p}");
                told += 1;
            }
        }
        assert!(told > 800, "{told} of {}", points.len());
    }
}

#[test]
fn hostile_input_is_refused_or_answered() {
    assert_eq!(WindingTree::from_triangles(&[]).unwrap_err(), BvhError::Empty);
    let bad = [[Vec3::ZERO, Vec3::NAN, Vec3::X]];
    let refused = WindingTree::from_triangles(&bad).unwrap_err();
    assert!(matches!(refused, BvhError::Corner { face: 0, .. }));
    for t in [[Vec3::ZERO; 3], [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]] {
        let tree = WindingTree::from_triangles(&[t; 9]).unwrap();
        for p in [Vec3::ZERO, Vec3::ONE, 1e200 * Vec3::ONE, 1e308 * Vec3::X] {
            assert_eq!(tree.winding_number(p), 0.0);
        }
    }
    let tree = WindingTree::from_triangles(&[[Vec3::X, Vec3::Y, Vec3::Z]; 5]).unwrap();
    assert_eq!(tree.winding_number(1e300 * Vec3::ONE), 0.0);
    for p in [Vec3::NAN, Vec3::INFINITY, Vec3::X * f64::INFINITY] {
        assert!(!tree.winding_number(p).is_finite());
    }
}
