//! Single precision only selects the primitives to measure: results are those of all primitives measured in double
//! precision, bit by bit.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::search::Shape;
use super::*;
use crate::geometry::Slab;

fn vector(rng: &mut Pcg64) -> Vec3 {
    Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - Vec3::ONE
}

/// A ball that is nearly tangent to another from inside, so that their cone is as steep as can be.
fn steep(m: Sphere, rng: &mut Pcg64) -> Sphere {
    let radius = m.radius * rng.random::<f64>();
    let away = vector(rng).normalize() * (m.radius - radius) * (1.0 + 1e-9 * rng.random::<f64>());
    Sphere::new(m.centre + away, radius)
}

/// A mesh of random triangles and edges among spheres of a kind.
fn mesh(kind: &str, count: u32, rng: &mut Pcg64) -> MedialMesh {
    let mut spheres = vec![Sphere::new(Vec3::ZERO, 0.3)];
    for _ in 1..count {
        let last = spheres[spheres.len() - 1];
        let centre = vector(rng);
        spheres.push(match kind {
            "scattered" => Sphere::new(centre, 0.2 * rng.random::<f64>()),
            "points" => Sphere::new(centre, 0.0),
            "steep" => steep(last, rng),
            "flat" => Sphere::new(centre * Vec3::new(1.0, 1.0, 1e-13), 0.1 + 1e-7 * centre.z),
            "collinear" => Sphere::new(Vec3::X * centre.x + 1e-9 * centre, 0.1),
            "cluster" => Sphere::new(1e-14 * centre, 1.0 + 1e-14 * centre.y),
            "clusters" => {
                let at = Vec3::X * f64::from(rng.random_range(0..3_u8));
                Sphere::new(at + 1e-7 * centre, 0.2 + 1e-6 * rng.random::<f64>())
            }
            "nested" => Sphere::new(1e-9 * centre, rng.random()),
            "far apart" => Sphere::new(centre * 10.0_f64.powi(rng.random_range(-6..7)), 1e-3),
            // Balls in a ball, from inside towards its surface: along their cones the radius falls to nothing.
            "spikes" => {
                let size = if spheres.len() % 2 == 0 { 0.5 } else { 0.03 };
                let radius = size * (1.0 + rng.random::<f64>()) / 2.0;
                Sphere::new((1.0 - radius) * centre.normalize(), radius)
            }
            _ => unreachable!("{kind}"),
        });
    }
    let mut pick = || rng.random_range(0..count);
    let edges = (0..count).map(|_| [pick(), pick()]).filter(|[a, b]| a != b).collect();
    let faces: Vec<[u32; 3]> = (0..count).map(|_| [pick(), pick(), pick()]).collect();
    let faces = faces.into_iter().filter(|[a, b, c]| a != b && b != c && c != a).collect();
    MedialMesh::from_simplices(spheres, edges, faces).unwrap()
}

/// The signed distances to all primitives, one after the other.
fn all(mesh: &MedialMesh, p: Vec3) -> Vec<(f64, Primitive)> {
    let sphere = |v: u32| mesh.spheres[v as usize];
    let mut all = vec![];
    let mut add = |primitive, shape: Shape| all.push((shape.signed(p), primitive));
    for (v, &m) in (0..).zip(&mesh.spheres) {
        add(Primitive::Sphere(v), Shape::Sphere(m));
    }
    for (e, &[a, b]) in (0..).zip(&mesh.edges) {
        add(Primitive::Edge(e), Shape::Cone(Cone::new(sphere(a), sphere(b))));
    }
    for (f, &corners) in (0..).zip(&mesh.faces) {
        if let Some(face) = SlabFace::new(corners.map(sphere)) {
            add(Primitive::Face(f), Shape::Slab(face));
        }
    }
    all
}

#[test]
fn results_are_those_of_all_primitives() {
    let mut rng = Pcg64::seed_from_u64(7);
    let kinds = [
        "scattered",
        "points",
        "steep",
        "flat",
        "collinear",
        "cluster",
        "clusters",
        "nested",
        "far apart",
        "spikes",
    ];
    for kind in kinds {
        for count in [1, 2, 5, 40, 120] {
            let mesh = mesh(kind, count, &mut rng);
            let union = MedialUnion::new(&mesh).unwrap();
            let queries: Vec<Vec3> =
                (0..60).map(|query| query_near(&mesh, query, &mut rng)).collect();
            let signed = union.signed_batch(&queries);
            let unsigned = union.unsigned_nearest_batch(&queries);
            for (k, &p) in queries.iter().enumerate() {
                // Spheres that another part covers have none of their own; they are nearer by
                // rounding at most.
                let own = all(&mesh, p);
                let own = || own.iter().filter(|part| has_part(&union, part.1));
                let least = own().map(|part| part.0).fold(f64::INFINITY, f64::min);
                let deepest = union.deepest(p);
                assert_eq!(deepest.signed.to_bits(), least.to_bits(), "{kind}, {count}, {p}");
                assert_eq!(signed[k].to_bits(), least.to_bits(), "{kind}, {count}, {p}");
                let first = own().filter(|part| part.0 == least).map(|part| part.1).min();
                assert_eq!(Some(deepest.primitive), first, "{kind}, {count}, {p}");
                let nearest = own().map(|part| part.0.abs()).fold(f64::INFINITY, f64::min);
                assert_eq!(unsigned[k].to_bits(), nearest.to_bits(), "{kind}, {p}");
                let depth = least + vector(&mut rng).x * 1e-7;
                for depth in [depth, 0.0, -1e-3] {
                    assert_eq!(union.buries(p, -depth), least < depth, "{kind}, {count}, {p}");
                }
                let below = union.below_batch(&[p], &[depth])[0].map(|found| found.signed);
                assert_eq!(below, (least < depth).then_some(least), "{kind}, {count}, {p}");
                let mut near = 0;
                union.each_nearer(p, 0.1, |_, _| near += 1);
                assert_eq!(near, own().filter(|part| part.0 < 0.1).count(), "{kind}, {p}");
            }
            let unburied = signed.into_iter().enumerate().filter(|&(_, signed)| signed >= -1e-3);
            assert_eq!(union.unburied(&queries, 1e-3), unburied.collect::<Vec<_>>(), "{kind}");
        }
    }
}

/// A point at random, at a centre, on a sphere, or at any distance.
fn query_near(mesh: &MedialMesh, query: usize, rng: &mut Pcg64) -> Vec3 {
    let m = mesh.spheres[rng.random_range(0..mesh.spheres.len())];
    match query % 4 {
        0 => vector(rng),
        1 => m.centre,
        2 => m.centre + m.radius * vector(rng).normalize(),
        _ => vector(rng) * 10.0_f64.powi(rng.random_range(-3..5)),
    }
}

/// Where a search begins does not matter, even if that is nonsense.
#[test]
fn the_start_of_a_search_does_not_change_its_result() {
    let mut rng = Pcg64::seed_from_u64(17);
    for kind in ["scattered", "clusters", "nested", "far apart"] {
        let mut mesh = mesh(kind, 60, &mut rng);
        let points: Vec<Vec3> = (0..700).map(|_| vector(&mut rng)).collect();
        let union = MedialUnion::new(&mesh).unwrap();
        let before: Vec<_> = points.iter().map(|&p| union.deepest(p)).collect();
        mesh.spheres.iter_mut().for_each(|m| m.centre += 0.01 * vector(&mut rng));
        let union = MedialUnion::new(&mesh).unwrap();
        let fresh: Vec<_> = points.iter().map(|&p| union.deepest(p)).collect();
        let all = |_| None;
        assert_eq!(union.deepest_batch_near(&points, &before, all), fresh, "{kind}");
        assert_eq!(union.deepest_batch_near(&points, &[], all), fresh, "{kind}");
        let far = NearestPrimitive { signed: 0.0, primitive: Primitive::Face(u32::MAX) };
        assert_eq!(union.deepest_batch_near(&points, &[far], all), fresh, "{kind}");
        // Depths that suffice are found if there are any, and everything else is as before.
        let enough = |i: usize| i.is_multiple_of(2).then_some(-0.05);
        let found = union.deepest_batch_near(&points, &before, enough);
        for (i, (found, fresh)) in found.iter().zip(&fresh).enumerate() {
            let is_enough = enough(i).is_some_and(|enough| fresh.signed <= enough);
            assert!(if is_enough { found.signed <= -0.05 } else { found == fresh }, "{kind}, {i}");
        }
    }
}

/// The least distance to a whole sphere, cone or slab.
fn least_of_hulls(mesh: &MedialMesh, p: Vec3) -> f64 {
    let spheres = mesh.spheres.iter().map(|m| m.signed_distance(p));
    let cones = mesh.edges.iter().map(|&edge| {
        let [a, b] = mesh.spheres_of(edge);
        Cone::new(a, b).signed_distance(p)
    });
    let slabs = mesh.faces.iter().map(|&f| Slab::new(mesh.spheres_of(f)).signed_distance(p));
    spheres.chain(cones).chain(slabs).fold(f64::INFINITY, f64::min)
}

/// The representatives of equal parts are as near as any, to the tolerance of equality.
#[test]
fn no_primitive_is_nearer_than_its_part() {
    let mut rng = Pcg64::seed_from_u64(11);
    for (kind, fewer) in [
        ("cluster", true),
        ("nested", false),
        ("steep", false),
        ("points", false),
        ("scattered", false),
    ] {
        for count in [1, 2, 5, 40, 120] {
            let mesh = mesh(kind, count, &mut rng);
            let union = MedialUnion::new(&mesh).unwrap();
            let primitives = mesh.spheres.len() + mesh.edges.len() + mesh.faces.len();
            assert!(!fewer || 2 * union.parts.primitives().len() <= primitives.max(2), "{count}");
            for _ in 0..100 {
                let p = vector(&mut rng) * 10.0_f64.powi(rng.random_range(-2..2));
                let least = least_of_hulls(&mesh, p);
                let found = union.signed(p);
                let off = 6.0 * EQUAL + 1e-15 * (1.0 + p.length());
                assert!((found - least).abs() <= off, "{kind}, {count}, {p}: {found} {least}");
            }
        }
    }
}

fn has_part(union: &MedialUnion, primitive: Primitive) -> bool {
    union.parts.primitives().contains(&primitive)
}
