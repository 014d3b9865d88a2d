//! Every registered method on two built-in shapes at three sizes: preparation and one level, without the shared
//! substrates. Separately the initial medial mesh, which is one of these, and what measuring a result costs.
//!
//! Every registered method appears here. `tight` takes seconds for each result: it runs only at the smallest size, with
//! fewer samples and rounds than by default.

mod plan;

use std::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use medial::complex::{MedialMesh, betti};
use medial::metrics::{JudgeOptions, spikes, triangle_quality};
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, MedialSimplifier, Params, Registered, RunContext};
use medial_run::input::{Input, Source};

/// Requested number of spheres.
const SPHERES: usize = 100;

/// Shapes and their resolutions: one smooth and round, one of flat sheets with sharp edges, whose samples are degenerate.
const SIZES: [(&str, u32); 6] =
    [("blob", 30), ("blob", 40), ("blob", 50), ("box", 12), ("box", 18), ("box", 25)];

/// The smallest size, for `tight`.
const SMALLEST: (&str, u32) = ("box", 8);

/// A built-in shape, with its name and its number of vertices as a benchmark's.
fn built_in((id, resolution): (&str, u32)) -> (String, Input) {
    let source = Source::BuiltIn { id: id.into(), resolution: Some(resolution) };
    let input = Input::load(&source).expect("a built-in shape");
    let shape = input.shape(ShapeOptions::default()).expect("an extent");
    (format!("{id}, {} vertices", shape.mesh().vertices.len()), input)
}

fn shape(input: &Input) -> Shape {
    let shape = input.shape(ShapeOptions::default()).expect("an extent");
    // Substrates are shared and timed by themselves.
    shape.initial().expect("an initial medial mesh");
    shape
}

fn methods(criterion: &mut Criterion) {
    let shapes = SIZES.map(built_in).map(|(name, input)| (name, shape(&input)));
    let registry = medial_methods::registry().into_iter();
    for Registered { method, .. } in registry.filter(|entry| !entry.presentation.on_request) {
        // `tight` has its own benchmark.
        for (name, shape) in shapes.iter().filter(|_| method.info().id != "tight") {
            one(criterion, &*method, name, shape, &Params::none());
        }
    }
}

/// A method on a shape: preparation and one level.
fn one(
    criterion: &mut Criterion,
    method: &dyn MedialSimplifier,
    name: &str,
    shape: &Shape,
    params: &Params,
) {
    let run = RunContext::default();
    let mut group = criterion.benchmark_group(&*method.info().id);
    // As many runs for each sample as for the next: slow methods run once for each.
    group.sampling_mode(SamplingMode::Flat);
    group.bench_function(name, |b| {
        b.iter_with_large_drop(|| {
            let mut levels = method.prepare(shape, params, &run).expect("prepared");
            black_box(levels.at(Level::Spheres(SPHERES)).expect("a result"))
        });
    });
    group.finish();
}

fn tight(criterion: &mut Criterion) {
    let (name, input) = built_in(SMALLEST);
    let shape = shape(&input);
    let mut params = Params::none();
    for (key, value) in [("rounds", "1"), ("start", "300"), ("samples", "3000")] {
        params.set(key, value);
    }
    let method = medial_methods::find("tight").expect("registered");
    one(criterion, &*method, &name, &shape, &params);
}

fn substrates(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("initial medial mesh");
    for (name, input) in SIZES.map(built_in) {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            let shape = || input.shape(ShapeOptions::default()).expect("an extent");
            b.iter_batched(
                shape,
                |shape| black_box(shape.initial()).is_ok(),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

/// Everything that the judge does, and its parts, on results of Q-MAT of three sizes.
fn metrics(criterion: &mut Criterion) {
    let (_, input) = built_in(("blob", 40));
    let shape = shape(&input);
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

criterion_group! {
    name = benches;
    config = plan::criterion();
    targets = substrates, methods, tight, metrics
}

criterion_main!(benches);
