//! The predicates call by call, triangulations of random and degenerate points, unions of balls, distances to a mesh and
//! to a union of medial primitives, and what measuring a result costs. `medial diff --run` times the methods.

#![allow(missing_docs)]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
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

/// Times some work on a number of elements, as `GROUP/NAME`.
fn time<T>(
    c: &mut Criterion,
    group: &str,
    name: impl ToString,
    elements: usize,
    mut work: impl FnMut() -> T,
) {
    let mut group = c.benchmark_group(group);
    group.throughput(Throughput::Elements(elements as u64));
    group.bench_function(name.to_string(), |b| b.iter(&mut work));
    group.finish();
}

fn predicates(c: &mut Criterion) {
    let corner = |i: u32| Vec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
    let sets: [(&str, Vec<Vec3>); 3] = [
        ("easy", cube(8)),
        ("lattice", (0..8).map(|i| corner(i) / 10.0).collect()),
        ("cospherical", directions(8)),
    ];
    for (name, p) in &sets {
        time(c, "in_sphere", name, 1, || in_sphere(p[0], p[1], p[2], p[4], black_box(p[7])));
        time(c, "orient3d", name, 1, || orient3d(p[0], p[1], p[2], black_box(p[3])));
        time(c, "circumsphere", name, 1, || circumsphere([p[0], p[1], p[2], black_box(p[4])]));
    }
}

fn triangulations(c: &mut Criterion) {
    let sets = [
        ("cube", cube(20_000)),
        ("surface", surface(20_000)),
        ("sphere", directions(10_000)),
        ("lattice", lattice(20, 1.0)),
        ("lattice in steps of 0.01", lattice(20, 0.01)),
    ];
    for (name, points) in &sets {
        let count = || Delaunay::new(points).map(|d| d.cell_count());
        time(c, "delaunay", name, points.len(), count);
    }
    let points = cube(20_000);
    let mut rng = Pcg64::seed_from_u64(3);
    let weights: Vec<f64> = points.iter().map(|_| 1e-3 * rng.random::<f64>()).collect();
    let count = || Regular::new(&points, &weights).map(|r| r.cell_count());
    time(c, "regular", "cube", points.len(), count);
}

/// The union of balls: its dual complex, the vertices of its boundary, and the poles of samples,
/// each without the triangulation that it starts from; and its medial axis as a whole.
fn unions(c: &mut Criterion) {
    let samples = surface(20_000);
    let delaunay = Delaunay::new(&samples).expect("spans space");
    time(c, "poles", "surface", samples.len(), || Poles::new(&delaunay).balls().len());
    let poles = Poles::new(&delaunay);
    let inner = poles.inner_balls(|cell| {
        delaunay.circumsphere(cell).is_some_and(|(centre, _)| centre.length() < 0.7)
    });
    let points = cube(20_000);
    let mut rng = Pcg64::seed_from_u64(4);
    let random: Vec<_> =
        points.iter().map(|&p| Sphere::new(p, 0.04 * rng.random::<f64>())).collect();
    let grown = |times: f64| {
        let grow = move |s: Sphere| Sphere::new(s.centre, times * s.radius);
        inner.iter().map(|ball| grow(ball.sphere)).collect()
    };
    let grid = lattice(27, 1.0);
    let sets: [(&str, Vec<Sphere>); 4] = [
        ("cube", random),
        ("inner poles", grown(1.0)),
        ("inner poles grown by 1.1", grown(1.1)),
        ("lattice", grid.into_iter().map(|p| Sphere::new(p, 0.75)).collect()),
    ];
    for (name, balls) in &sets {
        let points: Vec<Vec3> = balls.iter().map(|b| b.centre).collect();
        let weights: Vec<f64> = balls.iter().map(|b| b.radius * b.radius).collect();
        let regular = Regular::new(&points, &weights).expect("spans space");
        let complex = DualComplex::new(&regular);
        let dual = || DualComplex::new(&regular).contains(CellId(0));
        time(c, "dual complex", name, balls.len(), dual);
        let boundary = || UnionBoundary::new(&complex).vertices().len();
        time(c, "union boundary", name, balls.len(), boundary);
        // With both triangulations.
        let axis = || UnionAxis::of_balls(balls).map(|a| a.edges().len());
        time(c, "union axis", name, balls.len(), axis);
    }
}

/// Distances of points inside the unit ball and on a bumpy surface around it.
fn distances(c: &mut Criterion) {
    let ball = medial_datasets::find("sphere").expect("a built-in shape").mesh(100);
    let tree = TriangleBvh::new(&ball).expect("the sphere has faces");
    let inside: Vec<Vec3> =
        directions(20_000).into_iter().zip(cube(20_000)).map(|(d, t)| d * t.x).collect();
    let batch = || tree.closest_batch(black_box(&inside));
    time(c, "closest_point", "batch", inside.len(), batch);
    let build = || TriangleBvh::new(black_box(&ball));
    time(c, "closest_point", "build", inside.len(), build);
    // A ribbon through the points of a lattice.
    let spheres = lattice(8, 0.25).into_iter().map(|p| Sphere::new(p - Vec3::ONE, 0.15)).collect();
    let faces = (3..512).map(|k| [k - 3, k - 1, k]).collect();
    let sheet = MedialMesh::from_simplices(spheres, vec![], faces).expect("a complex");
    // 5,000 balls that nearly coincide, like the initial medial mesh of a sphere.
    let ball = |p: Vec3| Sphere::new(1e-6 * p, 0.3 + 1e-6 * p.x);
    let cloud = cube(5_000).into_iter().map(ball).collect();
    let cloud = MedialMesh { spheres: cloud, ..MedialMesh::default() };
    let points = surface(20_000);
    for (name, mesh) in [("sheet", sheet), ("coincident", cloud)] {
        let union = MedialUnion::new(&mesh).expect("it has spheres");
        let signed = || union.signed_batch(black_box(&points));
        time(c, "union_distance signed", name, points.len(), signed);
        let nearest = || union.unsigned_nearest_batch(black_box(&points));
        time(c, "union_distance unsigned nearest", name, points.len(), nearest);
    }
}

/// Everything that the judge does, and its parts, on results of Q-MAT of three sizes.
fn metrics(c: &mut Criterion) {
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
    for mesh in &meshes {
        let count = mesh.spheres.len();
        let name = format!("{count} spheres");
        time(c, "metrics everything", &name, count, || judge.evaluate(black_box(mesh)));
        time(c, "metrics distances", &name, count, || judge.distances(black_box(mesh)));
        time(c, "metrics volume", &name, count, || judge.volume_error(black_box(mesh)));
        time(c, "metrics topology", &name, count, || betti(black_box(mesh)));
        let quality = || (triangle_quality(black_box(mesh)), spikes(black_box(mesh)));
        time(c, "metrics quality and spikes", &name, count, quality);
    }
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
