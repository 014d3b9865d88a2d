//! Closest points on meshes and distances to unions of medial primitives, against brute force.

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, Primitive, UnionError};
use medial::geometry::Sphere;
use medial::surface::TriMesh;
use medial::surface::{BvhError, Feature, TriangleBvh};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn vector(rng: &mut Pcg64) -> Vec3 {
    Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0
}

fn on_segment(p: Vec3, a: Vec3, b: Vec3) -> f64 {
    let squared = a.distance_squared(b);
    let t = if squared > 0.0 { ((p - a).dot(b - a) / squared).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a.lerp(b, t))
}

/// Distance to a triangle, thin ones included: its plane where the foot is inside, else its sides.
fn to_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> f64 {
    let sides = on_segment(p, a, b).min(on_segment(p, b, c)).min(on_segment(p, c, a));
    let n = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|&(u, v)| n.dot((v - u).cross(p - u)) > 0.0);
    if inside { sides.min((p - a).dot(n.normalize()).abs()) } else { sides }
}

/// Triangles of all shapes: fat, needles, caps, segments, points, in a soup.
fn soup(count: usize, rng: &mut Pcg64) -> TriMesh {
    let mut mesh = TriMesh::default();
    for k in 0..count {
        let a = vector(rng);
        let [u, v] = [vector(rng) * 0.1, vector(rng) * 0.1];
        let (b, c) = match k % 5 {
            0 => (a + u, a + v * 1e-5),
            1 => (a + u, a + u * 0.4 + v * 1e-6),
            2 if k % 2 == 0 => (a + u, a + u),
            2 => (a, a),
            _ => (a + u, a + v),
        };
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend([a, b, c]);
        mesh.faces.push([first, first + 1, first + 2]);
    }
    mesh
}

fn assert_describes(mesh: &TriMesh, p: Vec3, closest: &medial::surface::Closest) {
    let corners = mesh.triangle(closest.face as usize);
    assert!((closest.point.distance(p) - closest.distance).abs() < 1e-14);
    let off = match closest.feature {
        Feature::Face => to_triangle(closest.point, corners),
        Feature::Edge(k) => {
            on_segment(closest.point, corners[k as usize], corners[(k as usize + 1) % 3])
        }
        Feature::Vertex(k) => closest.point.distance(corners[k as usize]),
    };
    assert!(off < 1e-15, "{closest:?} is {off:e} off its feature");
}

#[test]
fn closest_points_match_brute_force() {
    let mut rng = Pcg64::seed_from_u64(11);
    let mesh = soup(400, &mut rng);
    let bvh = TriangleBvh::new(&mesh).unwrap();
    assert_eq!(bvh.face_count(), 400);
    let mut queries: Vec<Vec3> = (0..1000).map(|_| vector(&mut rng) * 1.3).collect();
    queries.extend(mesh.vertices.iter().take(300));
    queries.extend((0..50).map(|_| vector(&mut rng) * 1e4));
    let batch = bvh.closest_batch(&queries);
    let distances = bvh.distance_batch(&queries);
    for (k, &p) in queries.iter().enumerate() {
        let oracle =
            (0..400).map(|f| to_triangle(p, mesh.triangle(f))).fold(f64::INFINITY, f64::min);
        let closest = bvh.closest(p);
        let tolerance = 1e-14 * (1.0 + p.length());
        assert!((closest.distance - oracle).abs() < tolerance, "{closest:?} for {oracle}");
        if p.length() < 10.0 {
            assert_describes(&mesh, p, &closest);
        }
        // Not only close: the same result from any start of the search.
        assert_eq!(batch[k], closest);
        assert_eq!(distances[k], closest.distance);
        assert_eq!(bvh.closest_from(p, Some(k as u32 % 400)), closest);
        for start in [None, Some(399)] {
            assert_eq!(bvh.closest_within_from(p, closest.distance, start), Some(closest));
            assert_eq!(bvh.closest_within_from(p, closest.distance * 0.999 - 1e-12, start), None);
        }
        assert!(bvh.any_within(p, closest.distance));
        assert!(!bvh.any_within(p, closest.distance * 0.999 - 1e-12));
    }
}

#[test]
fn a_vicinity_has_the_closest_points_of_the_tree() {
    let mut rng = Pcg64::seed_from_u64(12);
    for scale in [1.0, 1e-60, 1e60] {
        let mut mesh = soup(400, &mut rng);
        mesh.vertices.iter_mut().for_each(|v| *v *= scale);
        let bvh = TriangleBvh::new(&mesh).unwrap();
        for k in 0..600 {
            // Around points of the surface, and around others; down to balls that are points.
            let near = vector(&mut rng) * scale;
            let centre = if k % 5 == 0 { bvh.closest(near).point } else { near };
            let radius = scale * [0.3, 1e-2, 1e-4, 1e-9, 0.0][k % 5] * rng.random::<f64>();
            let vicinity =
                bvh.vicinity(centre, radius, &bvh.closest(centre), 400).expect("is small");
            let inner = centre + vector(&mut rng).normalize() * (0.5 * radius);
            let foot = bvh.closest(inner);
            let start = foot.face;
            let narrowed = vicinity.narrowed(inner, 0.5 * radius, &foot, 400).expect("is small");
            for _ in 0..10 {
                let direction = vector(&mut rng).normalize();
                for (vicinity, p) in [
                    (&vicinity, centre + direction * radius),
                    (&narrowed, inner + direction * (0.5 * radius)),
                ] {
                    let closest = bvh.closest(p);
                    assert_eq!(vicinity.closest_from(p, start), closest);
                    for bound in [closest.distance, closest.distance * 0.999] {
                        let within = bvh.closest_within_from(p, bound, None);
                        assert_eq!(vicinity.closest_within(p, bound), within);
                    }
                }
            }
        }
    }
    // Of many triangles equally far away none can be left out.
    let sphere: Vec<_> = (0..2000).map(|_| [vector(&mut rng).normalize(); 3]).collect();
    let bvh = TriangleBvh::from_triangles(&sphere).unwrap();
    assert!(bvh.vicinity(Vec3::ZERO, 0.1, &bvh.closest(Vec3::ZERO), 1999).is_none());
}

#[test]
fn features_are_distinguished() {
    let vertices = vec![Vec3::ZERO, Vec3::X, 2.0 * Vec3::Y];
    for turn in 0..3 {
        let mut face = [0, 1, 2];
        face.rotate_left(turn);
        let bvh = TriangleBvh::new(&TriMesh { vertices: vertices.clone(), faces: vec![face] });
        let bvh = bvh.unwrap();
        let corner = |v: u32| face.iter().position(|&c| c == v).unwrap() as u8;
        let feature = |x, y| bvh.closest(Vec3::new(x, y, 1.0)).feature;
        assert_eq!(feature(0.2, 0.2), Feature::Face);
        assert_eq!(feature(0.5, -1.0), Feature::Edge(corner(0)));
        assert_eq!(feature(1.0, 1.5), Feature::Edge(corner(1)));
        assert_eq!(feature(-1.0, 1.0), Feature::Edge(corner(2)));
        assert_eq!(feature(-1.0, -1.0), Feature::Vertex(corner(0)));
        assert_eq!(feature(3.0, -1.0), Feature::Vertex(corner(1)));
        assert_eq!(feature(0.0, 3.0), Feature::Vertex(corner(2)));
    }
}

#[test]
fn unusable_meshes_are_refused_by_name() {
    assert_eq!(TriangleBvh::new(&TriMesh::default()).unwrap_err(), BvhError::Empty);
    for bad in [f64::NAN, f64::INFINITY, -1e200] {
        let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, bad, 0.0)];
        let mesh = TriMesh { vertices, faces: vec![[0, 0, 1], [0, 1, 2]] };
        let error = TriangleBvh::new(&mesh).unwrap_err();
        assert!(matches!(error, BvhError::Corner { face: 1, .. }), "{error}");
    }
    let mesh = soup(10, &mut Pcg64::seed_from_u64(1));
    let bvh = TriangleBvh::new(&mesh).unwrap();
    assert!(bvh.closest(Vec3::NAN).distance.is_nan());
    assert!(!bvh.closest(Vec3::splat(f64::INFINITY)).distance.is_finite());
    assert!(!bvh.any_within(Vec3::NAN, 1.0) && !bvh.any_within(Vec3::ZERO, f64::NAN));
    assert_eq!(bvh.closest_within_from(Vec3::ZERO, -1.0, None), None);
}

#[test]
fn results_do_not_depend_on_threads() {
    let mut rng = Pcg64::seed_from_u64(13);
    let surface = soup(500, &mut rng);
    let spheres = (0..200).map(|_| Sphere::new(vector(&mut rng), 0.3 * rng.random::<f64>()));
    let faces = (0..100).map(|k| [k, k + 1, k + 5]).collect();
    let mesh = MedialMesh::from_simplices(spheres.collect(), vec![], faces).unwrap();
    let queries: Vec<Vec3> = (0..5000).map(|_| vector(&mut rng) * 1.5).collect();
    let run = |threads| {
        crate::on_threads(threads, || {
            let union = MedialUnion::new(&mesh).unwrap();
            let bvh = TriangleBvh::new(&surface).unwrap();
            let unsigned = union.unsigned_nearest_batch(&queries);
            (union.signed_batch(&queries), unsigned, bvh.closest_batch(&queries))
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(5));
}

#[test]
fn spheres_alone_and_degenerate_unions() {
    let spheres = [Sphere::new(Vec3::ZERO, 1.0), Sphere::new(3.0 * Vec3::X, 0.5)];
    let union = MedialUnion::of_spheres(&spheres).unwrap();
    assert_eq!(union.signed(1.5 * Vec3::X), 0.5);
    assert_eq!(union.deepest(1.6 * Vec3::X).primitive, Primitive::Sphere(0));
    assert_eq!(union.deepest(2.0 * Vec3::X).primitive, Primitive::Sphere(1));
    assert_eq!(union.bounding_box(), (Vec3::splat(-1.0), Vec3::new(3.5, 1.0, 1.0)));
    assert_eq!(MedialUnion::of_spheres(&[]).unwrap_err(), UnionError::Empty);
    let bad = MedialUnion::of_spheres(&[Sphere::new(Vec3::ZERO, -1.0)]);
    assert!(matches!(bad, Err(UnionError::Invalid(_))));
    assert!(union.signed(Vec3::NAN).is_nan());
}

/// Pruning in single precision loses nothing: bit for bit the least of the distances to each
/// triangle alone, of equal ones the first, wherever and however large the mesh is.
#[test]
fn closest_points_are_those_of_single_triangles() {
    let mut rng = Pcg64::seed_from_u64(14);
    let mesh = soup(150, &mut rng);
    let queries: Vec<Vec3> = (0..200)
        .map(|k| vector(&mut rng) * [1.0, 1.3, 70.0, 1e5][k % 4])
        .chain(mesh.vertices.iter().copied().take(60))
        .collect();
    let shifts = [(1.0, 0.0), (1.0, 1e6), (1e-12, 1.0), (1e140, 0.0), (1e-140, 0.0), (1e-3, 3.0)];
    for (scale, shift) in shifts {
        let place = |p: Vec3| p * scale + Vec3::new(shift, -shift, 0.5 * shift);
        let triangles: Vec<[Vec3; 3]> = (0..150).map(|f| mesh.triangle(f).map(place)).collect();
        let bvh = TriangleBvh::from_triangles(&triangles).unwrap();
        let alone: Vec<TriangleBvh> =
            triangles.iter().map(|&t| TriangleBvh::from_triangles(&[t]).unwrap()).collect();
        let queries: Vec<Vec3> = queries.iter().map(|&p| place(p)).collect();
        for (&p, found) in queries.iter().zip(bvh.closest_batch(&queries)) {
            let each = alone.iter().map(|t| t.closest(p).distance);
            let least =
                (0..).zip(each).fold(
                    (0, f64::INFINITY),
                    |best: (u32, f64), (f, d)| {
                        if d < best.1 { (f, d) } else { best }
                    },
                );
            assert_eq!(found.distance, least.1);
            // Distances may agree where their squares do not.
            let tied = alone[found.face as usize].closest(p).distance == least.1;
            assert!(found.face == least.0 || tied, "{found:?} for {least:?}");
        }
    }
}

/// Balls that nearly coincide, as in the initial medial mesh of a sphere: bit for bit the least of
/// all, although nearly all are nearly as near; to the tolerance of equality where they are equal
/// but for rounding.
#[test]
fn nearly_coincident_balls_are_distinguished() {
    let mut rng = Pcg64::seed_from_u64(15);
    let middle = Vec3::new(0.2, -0.1, 0.3);
    for spread in [1e-2, 1e-6, 1e-10, 1e-14, 0.0] {
        let spheres: Vec<Sphere> = (0..800)
            .map(|_| {
                let radius = 0.3 + spread * rng.random::<f64>();
                Sphere::new(middle + spread * vector(&mut rng), radius)
            })
            .collect();
        let union = MedialUnion::of_spheres(&spheres).unwrap();
        for k in 0..200 {
            let reach = 0.3 + [0.0, 1e-3, -1e-3, spread, 1.0][k % 5] * rng.random::<f64>();
            let p = middle + reach * vector(&mut rng).normalize();
            let signed = || spheres.iter().map(|m| m.signed_distance(p));
            let (sigma, mu) = (signed().fold(f64::INFINITY, f64::min), signed().map(f64::abs));
            let mu = mu.fold(f64::INFINITY, f64::min);
            // As far as two of the balls can be apart, in centre and radius; equal ones are equal.
            let most = if spread > 1e-13 { 0.0 } else { 5.0 * spread };
            assert!((union.signed(p) - sigma).abs() <= most, "{spread}, {p}");
            let unsigned = union.unsigned_nearest_batch(&[p])[0];
            assert!((unsigned - mu).abs() <= most, "{spread}, {p}");
        }
    }
}
