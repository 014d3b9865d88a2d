//! Closest points on a mesh and distances to a union of medial primitives, queries a second.

use std::f64::consts::{PI, TAU};
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion};
use medial::geometry::{Sphere, TriangleBvh};
use medial::surface::TriMesh;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Radii of the bumpy torus that both benches are made of.
const RING: f64 = 1.0;

fn tube(u: f64, v: f64) -> f64 {
    0.35 + 0.05 * (5.0 * u).sin() * (4.0 * v).cos()
}

fn torus_point(u: f64, v: f64, share: f64) -> Vec3 {
    let r = share * tube(u, v);
    let ring = RING + r * v.cos();
    Vec3::new(ring * u.cos(), ring * u.sin(), r * v.sin())
}

/// A closed mesh of `2 n m` triangles.
fn torus(n: u32, m: u32) -> TriMesh {
    let angle = |k: u32, count: u32| TAU * f64::from(k) / f64::from(count);
    let vertices = (0..n * m).map(|k| torus_point(angle(k / m, n), angle(k % m, m), 1.0)).collect();
    let id = |i: u32, j: u32| i % n * m + j % m;
    let quads = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let faces = quads
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriMesh { vertices, faces }
}

/// A strip of 50 x 10 spheres along the tube: 500 spheres, 900 faces, 1,400 edges.
fn sheet() -> MedialMesh {
    let (n, m) = (50, 10);
    let spheres = (0..n * m)
        .map(|k| {
            let (u, w) =
                (TAU * f64::from(k / m) / f64::from(n), f64::from(k % m) / f64::from(m - 1) - 0.5);
            let centre = Vec3::new(u.cos(), u.sin(), 0.0) * (RING + 0.4 * w);
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
    let mesh = torus(224, 224);
    let bvh = TriangleBvh::new(&mesh).expect("the torus has faces");
    let mut rng = Pcg64::seed_from_u64(1);
    let points: Vec<Vec3> = (0..100_000)
        .map(|_| {
            let [u, v] = [(); 2].map(|()| rng.random::<f64>() * TAU);
            torus_point(u, v, rng.random::<f64>().sqrt())
        })
        .collect();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let mut group = criterion.benchmark_group("closest_point");
    group.sample_size(10).throughput(Throughput::Elements(points.len() as u64));
    let name = |what| BenchmarkId::new(what, mesh.faces.len());
    group.bench_function(name("batch, one thread"), |b| {
        b.iter(|| one.install(|| bvh.closest_batch(black_box(&points))));
    });
    group.bench_function(name("single queries"), |b| {
        b.iter(|| points.iter().map(|&p| bvh.closest(p).distance).sum::<f64>());
    });
    group.finish();
    let mut group = criterion.benchmark_group("closest_point");
    group.sample_size(10).throughput(Throughput::Elements(mesh.faces.len() as u64));
    group.bench_function("build", |b| b.iter(|| TriangleBvh::new(black_box(&mesh))));
    group.finish();
}

fn union_distance(criterion: &mut Criterion) {
    let union = MedialUnion::new(&sheet()).expect("the strip has spheres");
    let mut rng = Pcg64::seed_from_u64(2);
    let points: Vec<Vec3> = (0..1_000_000)
        .map(|_| {
            let [u, v] = [rng.random::<f64>() * TAU, (rng.random::<f64>() * 2.0 - 1.0) * PI];
            torus_point(u, v, 1.0)
        })
        .collect();
    let mut group = criterion.benchmark_group("union_distance");
    group.sample_size(10).throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("signed", |b| b.iter(|| union.signed_batch(black_box(&points))));
    group.bench_function("unsigned nearest", |b| {
        b.iter(|| union.unsigned_nearest_batch(black_box(&points)));
    });
    group.finish();
}

criterion_group!(benches, closest_point, union_distance);
criterion_main!(benches);
