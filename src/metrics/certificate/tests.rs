use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::metrics::{DistanceOptions, distances};

/// The box of the given half sides around the origin.
fn cuboid(half: Vec3) -> TriMesh {
    let corner = |k: u32| {
        let sign = |bit: u32| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
        half * Vec3::new(sign(0), sign(1), sign(2))
    };
    let quads =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh { vertices: (0..8).map(corner).collect(), faces }
}

fn medial(spheres: &[(Vec3, f64)], edges: &[[u32; 2]], faces: &[[u32; 3]]) -> MedialMesh {
    let spheres = spheres.iter().map(|&(c, r)| Sphere::new(c, r)).collect();
    MedialMesh::from_simplices(spheres, edges.to_vec(), faces.to_vec()).unwrap()
}

fn certified(surface: &TriMesh, mesh: &MedialMesh, tolerance: f64) -> Certificate {
    let bvh = TriangleBvh::new(surface).unwrap();
    let certificate = certify(surface, &bvh, mesh, tolerance).unwrap();
    assert!(certificate.upper - certificate.lower <= tolerance, "{certificate:?}");
    // The lower end is the distance of the witness, which is where it is said to be.
    let Witness { point, on } = certificate.witness;
    let signed = MedialUnion::new(mesh).unwrap().signed(point);
    let to_surface = bvh.closest(point).distance;
    let (off, distance) = match on {
        WitnessSide::Surface => (to_surface, signed.abs()),
        WitnessSide::Union => (signed.abs(), to_surface),
    };
    assert!(off <= ROUNDING, "the witness is {off} off the {on:?}");
    assert!((distance - certificate.lower).abs() <= 2.0 * ROUNDING, "{certificate:?}: {distance}");
    certificate
}

#[track_caller]
fn holds(surface: &TriMesh, mesh: &MedialMesh, exact: f64) {
    for tolerance in [1e-2, 1e-3, 1e-4] {
        let Certificate { lower, upper, .. } = certified(surface, mesh, tolerance);
        assert!((lower..=upper).contains(&exact), "{exact} is not within {lower} to {upper}");
    }
}

#[test]
fn the_interval_holds_known_distances() {
    let half = Vec3::new(0.4, 0.3, 0.2);
    let surface = cuboid(half);
    // A ball inside: the corners are farthest, or the middle of the ball's surface.
    let ball = |c, r| medial(&[(c, r)], &[], &[]);
    holds(&surface, &ball(Vec3::ZERO, 0.15), half.length() - 0.15);
    // A ball around the box: its poles over the largest faces.
    holds(&surface, &ball(Vec3::ZERO, 0.9), 0.9 - 0.2);
    // A point.
    holds(&surface, &ball(Vec3::ZERO, 0.0), half.length());
    // A capsule along the longest axis: the corners again.
    let ends = [(-0.3 * Vec3::X, 0.1), (0.3 * Vec3::X, 0.1)];
    let capsule = medial(&ends, &[[0, 1]], &[]);
    holds(&surface, &capsule, Vec3::new(0.1, 0.3, 0.2).length() - 0.1);
    // A tapered cone that sticks out: its far end.
    let spike = medial(&[(Vec3::ZERO, 0.15), (Vec3::X, 0.05)], &[[0, 1]], &[]);
    let corner = Cone::new(Sphere::new(Vec3::ZERO, 0.15), Sphere::new(Vec3::X, 0.05));
    holds(
        &surface,
        &spike,
        (1.05_f64 - 0.4).max(corner.signed_distance(Vec3::new(-0.4, 0.3, 0.2))),
    );
    // A slab far above: its plane is parallel to the box's top.
    let corners = [Vec3::new(-0.1, -0.1, 0.7), Vec3::new(0.2, -0.1, 0.7), Vec3::new(0.0, 0.2, 0.7)];
    let slab = medial(&corners.map(|c| (c, 0.05)), &[], &[[0, 1, 2]]);
    let depth = Slab::new(corners.map(|c| Sphere::new(c, 0.05)));
    let below = surface.vertices.iter().map(|&v| depth.signed_distance(v)).fold(0.0, f64::max);
    holds(&surface, &slab, below.max(0.75 - 0.2));
}

/// The octahedron with every face divided `levels` times and carried to the unit sphere.
fn geodesic(levels: u32) -> TriMesh {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
    let octants = (0..8_u32).map(|k| {
        let pick = |axis: u32| axis + 3 * (k >> axis & 1);
        let [a, b, c] = [0, 1, 2].map(pick);
        if k.count_ones() % 2 == 0 { [a, b, c] } else { [a, c, b] }
    });
    let mut mesh = TriMesh { vertices: axes.to_vec(), faces: octants.collect() };
    for _ in 0..levels {
        let mut middles = std::collections::BTreeMap::new();
        let mut faces = Vec::new();
        for [a, b, c] in mesh.faces.clone() {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let sum = mesh.vertices[i as usize] + mesh.vertices[j as usize];
                    mesh.vertices.push(sum.normalize());
                    mesh.vertices.len() as u32 - 1
                })
            };
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        mesh.faces = faces;
    }
    mesh
}

#[test]
fn the_interval_holds_the_distance_of_balls_and_spheres() {
    for levels in [0, 2, 3] {
        let surface = geodesic(levels);
        // Every face is acute: the foot of the centre lies in it.
        let plane = |f: usize| {
            let [a, b, c] = surface.triangle(f);
            (b - a).cross(c - a).normalize().dot(a)
        };
        let inradius = (0..surface.faces.len()).map(plane).fold(1.0, f64::min);
        let ball = |r| medial(&[(Vec3::ZERO, r)], &[], &[]);
        // Within: the vertices are farthest. Around: the points over the middles of faces.
        holds(&surface, &ball(0.3), 1.0 - 0.3);
        holds(&surface, &ball(1.25), 1.25 - inradius);
        // Two balls, one of them buried: nothing changes.
        let two = medial(&[(Vec3::ZERO, 1.25), (0.2 * Vec3::X, 0.9)], &[], &[]);
        holds(&surface, &two, 1.25 - inradius);
    }
}

/// A polyhedron with its vertices on a cone that is thicker by `t` everywhere is `t` away from it.
#[test]
fn the_interval_holds_the_distance_of_a_cone() {
    let (length, radii, steps) = (0.8_f64, [0.1, 0.25], 24_u32);
    // Angle from the axis at which the lateral meets both spheres.
    let meet = (-(radii[1] - radii[0]) / length).acos();
    let angle = |k: u32, from: f64, to: f64| from + (to - from) * f64::from(k) / 8.0;
    let pi = std::f64::consts::PI;
    let mut profile: Vec<(f64, f64)> = (1..=8)
        .map(|k| angle(k, 0.0, pi - meet))
        .map(|a| (-radii[0] * a.cos(), radii[0] * a.sin()))
        .collect();
    profile.extend(
        (0..8)
            .map(|k| angle(k, pi - meet, pi))
            .map(|a| (length - radii[1] * a.cos(), radii[1] * a.sin())),
    );
    let mut vertices = vec![-radii[0] * Vec3::X];
    for &(x, rho) in &profile {
        vertices.extend((0..steps).map(|k| {
            let (sin, cos) = (2.0 * pi * f64::from(k) / f64::from(steps)).sin_cos();
            Vec3::new(x, rho * cos, rho * sin)
        }));
    }
    vertices.push((length + radii[1]) * Vec3::X);
    let last = vertices.len() as u32 - 1;
    let id = |ring: u32, k: u32| 1 + ring * steps + k % steps;
    let mut faces = Vec::new();
    for k in 0..steps {
        faces.extend([[0, id(0, k + 1), id(0, k)]]);
        faces.push([last, id(profile.len() as u32 - 1, k), id(profile.len() as u32 - 1, k + 1)]);
        for ring in 1..profile.len() as u32 {
            let [a, b] = [id(ring - 1, k), id(ring - 1, k + 1)];
            let [c, d] = [id(ring, k + 1), id(ring, k)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    let surface = TriMesh { vertices, faces };
    let on = Cone::new(Sphere::new(Vec3::ZERO, radii[0]), Sphere::new(length * Vec3::X, radii[1]));
    assert!(surface.vertices.iter().all(|&v| on.signed_distance(v).abs() < 1e-14));
    for t in [0.05, 0.09] {
        let ends = [(Vec3::ZERO, radii[0] - t), (length * Vec3::X, radii[1] - t)];
        holds(&surface, &medial(&ends, &[[0, 1]], &[]), t);
    }
}

/// The boundary of a ball that another one mostly covers counts only where it is not covered.
#[test]
fn buried_parts_do_not_count() {
    let surface = cuboid(Vec3::splat(0.3));
    let balls = [(Vec3::ZERO, 0.5), (0.1 * Vec3::X, 0.3)];
    let alone = certified(&surface, &medial(&balls[..1], &[], &[]), 1e-4);
    let both = certified(&surface, &medial(&balls, &[], &[]), 1e-4);
    assert!((alone.lower - both.lower).abs() <= 1e-4 && (alone.upper - both.upper).abs() <= 1e-4);
}

#[test]
fn the_interval_agrees_with_samples_on_random_meshes() {
    let mut rng = Pcg64::seed_from_u64(7);
    let mut random =
        |scale: f64| scale * Vec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
    let surface = cuboid(Vec3::new(0.35, 0.3, 0.2));
    let bvh = TriangleBvh::new(&surface).unwrap();
    for round in 0..12 {
        let spheres: Vec<_> =
            (0..8).map(|_| (random(0.3), random(0.2).length() * f64::from(round % 3))).collect();
        let edges = [[0, 5], [5, 6], [1, 7]];
        let mesh = medial(&spheres, &edges, &[[0, 1, 2], [1, 2, 3], [2, 3, 4]]);
        let interval = certified(&surface, &mesh, 1e-3);
        let options = DistanceOptions { surface_samples: 5_000, envelope_samples: 5_000, seed: 1 };
        let sampled = distances(&surface, &bvh, &mesh, &options).unwrap().hausdorff;
        assert!(sampled <= interval.upper, "{sampled} is above {interval:?}");
        // The largest samples alone fall short by a tenth.
        assert!(sampled >= 0.99 * interval.lower, "{sampled} is far below {interval:?}");
    }
}

#[test]
fn the_same_for_any_number_of_threads() {
    let surface = cuboid(Vec3::splat(0.3));
    let spheres = [(Vec3::ZERO, 0.2), (0.2 * Vec3::Y, 0.1), (0.2 * Vec3::X, 0.1)];
    let mesh = medial(&spheres, &[], &[[0, 1, 2]]);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| certified(&surface, &mesh, 1e-4))
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn what_cannot_be_certified_is_refused() {
    let surface = cuboid(Vec3::splat(0.3));
    let bvh = TriangleBvh::new(&surface).unwrap();
    let mesh = medial(&[(Vec3::ZERO, 0.2)], &[], &[]);
    for tolerance in [0.0, -1.0, 1e-9, 2.0, f64::NAN, f64::INFINITY] {
        let refused = certify(&surface, &bvh, &mesh, tolerance);
        assert!(matches!(refused, Err(MetricError::Tolerance(_))), "{refused:?}");
    }
    let empty = certify(&surface, &bvh, &MedialMesh::default(), 1e-3);
    assert!(matches!(empty, Err(MetricError::Union(_))));
}
