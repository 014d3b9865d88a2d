//! Every registered method on two built-in shapes at three sizes: preparation and one level, without the shared
//! substrates. Separately the initial medial mesh, which is one of these, and queries of a hierarchy.
//!
//! Every registered method appears here. `tight` takes seconds for each result: it runs only at the smallest size, with
//! fewer samples and rounds than by default.

mod plan;

use std::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use medial::complex::collapse::Hierarchy;
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

/// A stage of a hierarchy as a mesh.
fn hierarchy(criterion: &mut Criterion) {
    let source = Source::BuiltIn { id: "blob".into(), resolution: None };
    let input = Input::load(&source).expect("a built-in shape");
    let shape = input.shape(ShapeOptions::default()).expect("an extent");
    let pmat = medial_methods::find("pmat").expect("registered");
    let run = RunContext::default();
    let mut levels = pmat.prepare(&shape, &Params::none(), &run).expect("prepared");
    let end = levels.at(Level::Spheres(1)).expect("the end");
    let hierarchy = end.extras.get_shared::<Hierarchy>().expect("PMAT has a hierarchy");
    let half = hierarchy.steps().len() / 2;
    let mut group = criterion.benchmark_group("hierarchy");
    group.bench_function("half as a mesh", |b| b.iter_with_large_drop(|| hierarchy.mesh(half)));
    group.finish();
}

criterion_group! {
    name = benches;
    config = plan::criterion();
    targets = substrates, methods, hierarchy, tight
}

criterion_main!(benches);
