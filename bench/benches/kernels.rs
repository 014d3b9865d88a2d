//! The predicates call by call, triangulations of random and degenerate points, unions of balls, distances to a mesh and
//! to a union of medial primitives, and what measuring a result costs. `medial diff --run` times the methods.

#![allow(missing_docs)]

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, UnionAxis, betti};
use medial::geometry::delaunay::Delaunay;
use medial::geometry::predicates::{circumsphere, in_sphere, orient3d};
use medial::geometry::regular::Regular;
use medial::geometry::{CellId, DualComplex, Poles, Sphere, UnionBoundary};
use medial::metrics::{JudgeOptions, spikes, triangle_quality};
use medial::shape::ShapeOptions;
use medial::simplifier::{Level, Params, RunContext};
use medial::surface::TriangleBvh;
use medial_run::input::{Input, Source};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn random_unit(rng: &mut Pcg64) -> Vec3 {
    Vec3::new(rng.random(), rng.random(), rng.random())
}

fn directions(n: usize) -> Vec<Vec3> {
    let mut rng = Pcg64::seed_from_u64(1);
    (0..n).map(|_| (2.0 * random_unit(&mut rng) - Vec3::ONE).normalize_or(Vec3::X)).collect()
}

fn cube(n: usize) -> Vec<Vec3> {
    let mut rng = Pcg64::seed_from_u64(2);
    (0..n).map(|_| random_unit(&mut rng)).collect()
}

fn surface(n: usize) -> Vec<Vec3> {
    let bump = |u: Vec3| u * (1.0 + 0.25 * (3.0 * u.x).sin() * (4.0 * u.y).cos());
    directions(n).into_iter().map(bump).collect()
}

fn lattice(n: u32, step: f64) -> Vec<Vec3> {
    (0..n * n * n)
        .map(|i| [i % n, i / n % n, i / n / n])
        .map(|c| Vec3::from(c.map(|x| f64::from(x) * step)))
        .collect()
}

fn predicates(c: &mut Criterion) {
    let mut group = c.benchmark_group("predicates");
    let corner = |i: u32| Vec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
    let sphere = directions(8);
    let sets: [(&str, Vec<Vec3>); 3] = [
        ("easy", cube(8)),
        ("lattice", (0..8).map(|i| corner(i) / 10.0).collect()),
        ("cospherical", sphere),
    ];
    for (name, p) in &sets {
        group.bench_function(BenchmarkId::new("in_sphere", name), |b| {
            b.iter(|| in_sphere(p[0], p[1], p[2], p[4], black_box(p[7])));
        });
        group.bench_function(BenchmarkId::new("orient3d", name), |b| {
            b.iter(|| orient3d(p[0], p[1], p[2], black_box(p[3])));
        });
        group.bench_function(BenchmarkId::new("circumsphere", name), |b| {
            b.iter(|| circumsphere([p[0], p[1], p[2], black_box(p[4])]));
        });
    }
    group.finish();
}

fn triangulations(c: &mut Criterion) {
    let mut group = c.benchmark_group("delaunay");
    let sets = [
        ("cube", cube(20_000)),
        ("surface", surface(20_000)),
        ("sphere", directions(10_000)),
        ("lattice", lattice(20, 1.0)),
        ("lattice in steps of 0.01", lattice(20, 0.01)),
    ];
    for (name, points) in &sets {
        group.throughput(Throughput::Elements(points.len() as u64));
        group.bench_function(*name, |b| b.iter(|| Delaunay::new(points).map(|d| d.cell_count())));
    }
    group.finish();
    let mut group = c.benchmark_group("regular");
    let points = cube(20_000);
    let mut rng = Pcg64::seed_from_u64(3);
    let weights: Vec<f64> = points.iter().map(|_| 1e-3 * rng.random::<f64>()).collect();
    group.throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("cube", |b| {
        b.iter(|| Regular::new(&points, &weights).map(|r| r.cell_count()));
    });
    group.finish();
}

/// The union of balls: its dual complex, the vertices of its boundary, and the poles of samples,
/// each without the triangulation that it starts from; and its medial axis as a whole.
fn unions(c: &mut Criterion) {
    let samples = surface(20_000);
    let delaunay = Delaunay::new(&samples).expect("spans space");
    let mut group = c.benchmark_group("poles");
    group.throughput(Throughput::Elements(samples.len() as u64));
    group.bench_function("surface", |b| b.iter(|| Poles::new(&delaunay).balls().len()));
    group.finish();
    let poles = Poles::new(&delaunay);
    let inner = poles.inner_balls(|cell| {
        delaunay.circumsphere(cell).is_some_and(|(centre, _)| centre.length() < 0.7)
    });
    let points = cube(20_000);
    let mut rng = Pcg64::seed_from_u64(4);
    let random: Vec<_> =
        points.iter().map(|&p| Sphere::new(p, 0.04 * rng.random::<f64>())).collect();
    let grid = lattice(27, 1.0);
    let sets: [(&str, Vec<Sphere>); 4] = [
        ("cube", random),
        ("inner poles", inner.iter().map(|b| b.sphere).collect()),
        (
            "inner poles grown by 1.1",
            inner.iter().map(|b| Sphere::new(b.sphere.centre, 1.1 * b.sphere.radius)).collect(),
        ),
        ("lattice", grid.into_iter().map(|p| Sphere::new(p, 0.75)).collect()),
    ];
    for (name, balls) in &sets {
        let points: Vec<Vec3> = balls.iter().map(|b| b.centre).collect();
        let weights: Vec<f64> = balls.iter().map(|b| b.radius * b.radius).collect();
        let regular = Regular::new(&points, &weights).expect("spans space");
        let complex = DualComplex::new(&regular);
        for part in ["dual complex", "union boundary", "union axis"] {
            let mut group = c.benchmark_group(part);
            group.throughput(Throughput::Elements(balls.len() as u64));
            group.bench_function(*name, |b| match part {
                "dual complex" => b.iter(|| DualComplex::new(&regular).contains(CellId(0))),
                // With both triangulations.
                "union axis" => b.iter(|| UnionAxis::of_balls(balls).map(|a| a.edges().len())),
                _ => b.iter(|| UnionBoundary::new(&complex).vertices().len()),
            });
            group.finish();
        }
    }
}

/// Distances of points inside the unit ball and on a bumpy surface around it.
fn distances(c: &mut Criterion) {
    let ball = medial_datasets::find("sphere").expect("a built-in shape").mesh(100);
    let tree = TriangleBvh::new(&ball).expect("the sphere has faces");
    let inside: Vec<Vec3> =
        directions(20_000).into_iter().zip(cube(20_000)).map(|(d, t)| d * t.x).collect();
    let mut group = c.benchmark_group("closest_point");
    group.throughput(Throughput::Elements(inside.len() as u64));
    group.bench_function("batch", |b| b.iter(|| tree.closest_batch(black_box(&inside))));
    group.bench_function("build", |b| b.iter(|| TriangleBvh::new(black_box(&ball))));
    group.finish();
    // A ribbon through the points of a lattice.
    let spheres = lattice(8, 0.25).into_iter().map(|p| Sphere::new(p - Vec3::ONE, 0.15)).collect();
    let faces = (3..512).map(|k| [k - 3, k - 1, k]).collect();
    let sheet = MedialMesh::from_simplices(spheres, vec![], faces).expect("a complex");
    // 5,000 balls that nearly coincide, like the initial medial mesh of a sphere.
    let ball = |p: Vec3| Sphere::new(1e-6 * p, 0.3 + 1e-6 * p.x);
    let cloud = cube(5_000).into_iter().map(ball).collect();
    let cloud = MedialMesh { spheres: cloud, ..MedialMesh::default() };
    let points = surface(20_000);
    let mut group = c.benchmark_group("union_distance");
    group.throughput(Throughput::Elements(points.len() as u64));
    for (name, mesh) in [("sheet", sheet), ("coincident", cloud)] {
        let union = MedialUnion::new(&mesh).expect("it has spheres");
        group.bench_function(BenchmarkId::new("signed", name), |b| {
            b.iter(|| union.signed_batch(black_box(&points)));
        });
        group.bench_function(BenchmarkId::new("unsigned nearest", name), |b| {
            b.iter(|| union.unsigned_nearest_batch(black_box(&points)));
        });
    }
    group.finish();
}

/// Everything that the judge does, and its parts, on results of Q-MAT of three sizes.
fn metrics(criterion: &mut Criterion) {
    let source = Source::BuiltIn { id: "blob".into(), resolution: Some(40) };
    let input = Input::load(&source).expect("a built-in shape");
    let shape = input.shape(ShapeOptions::default()).expect("an extent");
    let qmat = medial_methods::find("qmat").expect("registered");
    let mut levels =
        qmat.prepare(&shape, &Params::none(), &RunContext::default()).expect("prepared");
    let meshes: [MedialMesh; 3] =
        [2000, 500, 100].map(|spheres| levels.at(Level::Spheres(spheres)).expect("a level").mesh);
    // As `medial compare` measures.
    let options = JudgeOptions { samples: 10_000, volume_depth: 5, ..JudgeOptions::default() };
    let judge = shape.judge(None, options).expect("the shape has faces");
    let mut group = criterion.benchmark_group("metrics");
    for mesh in &meshes {
        let name = |what| BenchmarkId::new(what, format!("{} spheres", mesh.spheres.len()));
        group.bench_function(name("everything"), |b| b.iter(|| judge.evaluate(black_box(mesh))));
        group.bench_function(name("distances"), |b| b.iter(|| judge.distances(black_box(mesh))));
        group.bench_function(name("volume"), |b| b.iter(|| judge.volume_error(black_box(mesh))));
        group.bench_function(name("topology"), |b| b.iter(|| betti(black_box(mesh))));
        group.bench_function(name("quality and spikes"), |b| {
            b.iter(|| (triangle_quality(black_box(mesh)), spikes(black_box(mesh))));
        });
    }
    group.finish();
}

/// Two seconds for each benchmark, more for slow ones, which take the least number of samples.
fn plan() -> Criterion {
    Criterion::default()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1700))
        .sample_size(10)
        // With few samples, more resamples add no information.
        .nresamples(10_000)
}

criterion_group! {
    name = benches;
    config = plan();
    targets = predicates, triangulations, unions, distances, metrics
}

criterion_main!(benches);
