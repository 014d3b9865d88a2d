use proptest::prelude::*;

use super::*;
use medial::surface::TriangleBvh;

/// Two boxes joined to an L, with one reflex edge in four pieces and flat edges between.
fn bracket() -> TriMesh {
    // Profile in (x, z), counter-clockwise seen from -y.
    let profile = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
    let (n, steps) = (profile.len() as u32, 4_u32);
    let vertices = (0..=steps)
        .flat_map(|j| profile.map(|[x, z]| Vec3::new(x, f64::from(j) * 0.5, z)))
        .collect();
    let mut faces = Vec::new();
    for j in 0..steps {
        for i in 0..n {
            let [a, b] = [j * n + i, j * n + (i + 1) % n];
            faces.extend([[a, b + n, b], [a, a + n, b + n]]);
        }
    }
    for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]] {
        faces.push([a, b, c]);
        let top = steps * n;
        faces.push([top + a, top + c, top + b]);
    }
    TriMesh { vertices, faces }
}

#[test]
fn only_the_reflex_edge_and_its_vertices_are_fans() {
    let mesh = bracket();
    let near = NearbyTriangles::new(&mesh);
    let set = near.all(Vec3::new(0.7, 1.1, 0.6));
    let mut batch = NearBatch::default();
    // Over the reflex edge at (1, 1); under the top of the wall; beside the inner wall.
    let asked = [Vec3::new(0.9, 1.1, 0.9), Vec3::new(0.5, 1.0, 2.9), Vec3::new(0.9, 0.9, 2.0)];
    asked.iter().for_each(|&p| batch.push(p - set.centre(), f64::INFINITY));
    near.closest(&set, &mut batch);
    let found = [0, 1, 2].map(|k| near.answer(&set, &batch, k).expect("no bound"));
    assert!(found[0].on_fan && !found[1].on_fan && !found[2].on_fan);
    let diagonal = -(Vec3::X + Vec3::Z) / 2.0_f64.sqrt();
    assert!(found[0].gradient.distance(diagonal) < 1e-12);
    assert!((found[0].distance - 0.02_f64.sqrt()).abs() < 1e-12);
    assert!(found[1].gradient.distance(-Vec3::Z) < 1e-12);
}

/// Triangles with all their corners in a unit box, some of them flat.
fn soups() -> impl Strategy<Value = TriMesh> {
    let corner = || (0.0..1.0, 0.0..1.0, 0.0..1.0).prop_map(|(x, y, z)| Vec3::new(x, y, z));
    prop::collection::vec((corner(), corner(), corner(), 0..8), 1..40).prop_map(|triangles| {
        let corners = triangles.iter().flat_map(|&(a, b, c, kind)| match kind {
            0 => [a, b, a.lerp(b, 0.25)],
            1 => [a, a, b],
            _ => [a, b, c],
        });
        let vertices: Vec<Vec3> = corners.collect();
        let faces = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        TriMesh { vertices, faces }
    })
}

proptest! {
    #[test]
    fn narrowed_sets_hold_the_closest_points_of_their_balls(
        mesh in soups(),
        seeds in prop::collection::vec((-1.0..1.0, -1.0..1.0, -1.0..1.0), 12),
        reach in 0.01..0.5,
    ) {
        let near = NearbyTriangles::new(&mesh);
        let bvh = TriangleBvh::new(&mesh).expect("triangles");
        let whole = near.all(Vec3::splat(0.5));
        let (mut outer, mut inner) = (NearSet::default(), NearSet::default());
        let directions: Vec<Vec3> =
            seeds.iter().map(|&(x, y, z)| Vec3::new(x, y, z) / 3.0_f64.sqrt()).collect();
        let centre = Vec3::splat(0.5) + directions[0];
        near.narrow(&whole, centre, 2.0 * reach, &mut outer);
        near.narrow(&outer, centre + directions[1] * reach, reach, &mut inner);
        prop_assert!(inner.len() <= outer.len());
        prop_assert!((inner.distance() - bvh.closest(inner.centre()).distance).abs() < 1e-12);
        let mut batch = NearBatch::default();
        directions.iter().for_each(|&u| batch.push(u * reach, f64::INFINITY));
        near.closest(&inner, &mut batch);
        for k in 0..batch.len() {
            let p = inner.centre() + batch.point(k);
            let truth = bvh.closest(p);
            let found = near.answer(&inner, &batch, k).expect("no bound");
            prop_assert!((found.distance - truth.distance).abs() < 1e-12);
            let point = near.closest_point(&inner, &batch, k).expect("no bound");
            prop_assert!((point.distance(p) - truth.distance).abs() < 1e-12);
            if truth.distance > 1e-6 {
                prop_assert!((p - found.gradient * found.distance).distance(point) < 1e-9);
            }
        }
        // One query at a time, and the sums over all of them.
        let near_one = |k: usize| near.closest_within(&inner, batch.point(k), f64::INFINITY);
        let (mut beside, mut total) = (0.0, 0.0);
        let within = near.sum_along(&inner, &batch, |k, point| {
            beside += point.gradient.dot(batch.point(k));
        });
        for k in 0..batch.len() {
            let found = near.answer(&inner, &batch, k).expect("no bound");
            let (point, distance) = near_one(k).expect("no bound");
            prop_assert!((distance - found.distance).abs() < 1e-12);
            let p = inner.centre() + batch.point(k);
            prop_assert!((point.distance(p) - distance).abs() < 1e-12);
            prop_assert!(near.closest_within(&inner, batch.point(k), 0.999 * distance).is_none());
            total += found.gradient.dot(batch.point(k));
        }
        prop_assert!((within + beside - total).abs() < 1e-12);
        // A bound that is met stays; one that is not is replaced.
        let truth: Vec<f64> =
            directions.iter().map(|&u| bvh.closest(inner.centre() + u * reach).distance).collect();
        batch.clear();
        for (k, &u) in directions.iter().enumerate() {
            batch.push(u * reach, truth[k] * if k % 2 == 0 { 0.5 } else { 2.0 });
        }
        near.closest(&inner, &mut batch);
        for (k, distance) in truth.iter().enumerate().filter(|(_, d)| **d > 1e-6) {
            let found = near.answer(&inner, &batch, k);
            prop_assert_eq!(found.is_some(), k % 2 == 1, "{} {}", k, distance);
        }
    }
}
