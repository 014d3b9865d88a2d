//! Queries a second: closest points on a mesh, inside tests, signed distances, and
//! distances to a union of medial primitives, also of one whose balls nearly coincide.

mod bumpy_torus;
mod plan;

use std::f64::consts::{PI, TAU};
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion};
use medial::geometry::Sphere;
use medial::surface::{InsideTest, SignedDistance, TriangleBvh};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A strip of 50 x 10 spheres along the tube: 500 spheres, 900 faces, 1,400 edges.
fn sheet() -> MedialMesh {
    let (n, m) = (50, 10);
    let spheres = (0..n * m)
        .map(|k| {
            let (u, w) =
                (TAU * f64::from(k / m) / f64::from(n), f64::from(k % m) / f64::from(m - 1) - 0.5);
            let centre = Vec3::new(u.cos(), u.sin(), 0.0) * (bumpy_torus::RING + 0.4 * w);
            Sphere::new(centre + Vec3::Z * 0.05 * (3.0 * u).sin(), 0.3 - 0.3 * w * w)
        })
        .collect();
    let quads = (0..n).flat_map(|i| (0..m - 1).map(move |j| (i, j)));
    let faces = quads
        .flat_map(|(i, j)| {
            let id = |i: u32, j: u32| i % n * m + j;
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    MedialMesh::from_simplices(spheres, vec![], faces).expect("the strip is a complex")
}

fn closest_point(criterion: &mut Criterion) {
    let mesh = bumpy_torus::mesh(224, 224);
    let bvh = TriangleBvh::new(&mesh).expect("the torus has faces");
    let mut rng = Pcg64::seed_from_u64(1);
    let points: Vec<Vec3> = (0..20_000)
        .map(|_| {
            let [u, v] = [(); 2].map(|()| rng.random::<f64>() * TAU);
            bumpy_torus::point(u, v, rng.random::<f64>().sqrt())
        })
        .collect();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let mut group = criterion.benchmark_group("closest_point");
    group.throughput(Throughput::Elements(points.len() as u64));
    let name = |what| BenchmarkId::new(what, mesh.faces.len());
    group.bench_function(name("batch, one thread"), |b| {
        b.iter(|| one.install(|| bvh.closest_batch(black_box(&points))));
    });
    group.bench_function(name("single queries"), |b| {
        b.iter(|| points.iter().map(|&p| bvh.closest(p).distance).sum::<f64>());
    });
    group.finish();
    let mut group = criterion.benchmark_group("closest_point");
    group.throughput(Throughput::Elements(mesh.faces.len() as u64));
    group.bench_function("build", |b| b.iter(|| TriangleBvh::new(black_box(&mesh))));
    group.finish();
}

/// 5,000 balls that nearly coincide, like the initial medial mesh of a sphere.
fn cloud() -> MedialMesh {
    let mut rng = Pcg64::seed_from_u64(3);
    let spread = 1e-6;
    let mut offset = || spread * (rng.random::<f64>() - 0.5);
    let spheres = (0..5000)
        .map(|_| Sphere::new(Vec3::new(offset(), offset(), offset()), 0.3 + offset()))
        .collect();
    MedialMesh { spheres, ..MedialMesh::default() }
}

fn sidedness(criterion: &mut Criterion) {
    let mesh = bumpy_torus::mesh(224, 224);
    let (tree, inside) =
        (TriangleBvh::new(&mesh).expect("the torus has faces"), InsideTest::new(&mesh));
    let mut rng = Pcg64::seed_from_u64(4);
    let half = Vec3::new(1.4, 1.4, 0.4);
    let points: Vec<Vec3> = (0..20_000)
        .map(|_| half * (2.0 * Vec3::new(rng.random(), rng.random(), rng.random()) - 1.0))
        .collect();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let mut group = criterion.benchmark_group("sidedness, one thread");
    group.throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("inside test", |b| {
        b.iter(|| one.install(|| inside.sides(black_box(&points))));
    });
    group.bench_function("signed distance", |b| {
        let distance = SignedDistance::closed(&tree, &inside);
        b.iter(|| one.install(|| distance.batch(black_box(&points))));
    });
    group.finish();
}

fn union_distance(criterion: &mut Criterion) {
    let union = MedialUnion::new(&sheet()).expect("the strip has spheres");
    let mut rng = Pcg64::seed_from_u64(2);
    let points: Vec<Vec3> = (0..200_000)
        .map(|_| {
            let [u, v] = [rng.random::<f64>() * TAU, (rng.random::<f64>() * 2.0 - 1.0) * PI];
            bumpy_torus::point(u, v, 1.0)
        })
        .collect();
    let mut group = criterion.benchmark_group("union_distance");
    group.throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("signed", |b| b.iter(|| union.signed_batch(black_box(&points))));
    group.bench_function("unsigned nearest", |b| {
        b.iter(|| union.unsigned_nearest_batch(black_box(&points)));
    });
    let cloud = MedialUnion::new(&cloud()).expect("the cloud has spheres");
    let around: Vec<Vec3> = points[..20_000].iter().map(|p| 0.2999 * p.normalize()).collect();
    group.throughput(Throughput::Elements(around.len() as u64));
    group.bench_function("signed, coincident", |b| {
        b.iter(|| cloud.signed_batch(black_box(&around)));
    });
    group.bench_function("unsigned nearest, coincident", |b| {
        b.iter(|| cloud.unsigned_nearest_batch(black_box(&around)));
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = plan::criterion();
    targets = closest_point, sidedness, union_distance
}

criterion_main!(benches);
