//! What measuring a result costs: everything that the judge does, and its parts, at three sizes of medial meshes.

mod plan;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use medial::complex::{MedialMesh, betti};
use medial::metrics::{JudgeOptions, spikes, triangle_quality};
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, Params, RunContext};
use medial_run::input::{Input, Source};

/// Surface samples, and about as many of the union: as `medial compare` takes.
const SAMPLES: usize = 10_000;
/// Division of space for the volume, likewise.
const VOLUME_DEPTH: u32 = 5;

/// The blob, and its medial meshes by Q-MAT at three counts.
fn results() -> (Shape, Vec<MedialMesh>) {
    let source = Source::BuiltIn { id: "blob".into(), resolution: None };
    let input = Input::load(&source).expect("a built-in shape");
    let shape = input.shape(ShapeOptions::default()).expect("an extent");
    let qmat = medial_methods::find("qmat").expect("registered");
    let run = RunContext::default();
    let mut levels = qmat.prepare(&shape, &Params::none(), &run).expect("prepared");
    let meshes =
        [2000, 500, 100].map(|spheres| levels.at(Level::Spheres(spheres)).expect("a level").mesh);
    drop(levels);
    (shape, meshes.into())
}

fn metrics(criterion: &mut Criterion) {
    let (shape, meshes) = results();
    let options =
        JudgeOptions { samples: SAMPLES, volume_depth: VOLUME_DEPTH, ..JudgeOptions::default() };
    let judge = shape.judge(None, options).expect("the shape has faces");
    for mesh in &meshes {
        let count = mesh.spheres.len();
        let name = |what| BenchmarkId::new(what, format!("{count} spheres"));
        let mut group = criterion.benchmark_group("metrics");
        group.bench_function(name("everything"), |b| b.iter(|| judge.evaluate(black_box(mesh))));
        group.bench_function(name("distances"), |b| {
            b.iter(|| judge.distances(black_box(mesh)));
        });
        group.bench_function(name("volume"), |b| {
            b.iter(|| judge.volume_error(black_box(mesh)));
        });
        group.bench_function(name("topology"), |b| b.iter(|| betti(black_box(mesh))));
        group.bench_function(name("quality and spikes"), |b| {
            b.iter(|| (triangle_quality(black_box(mesh)), spikes(black_box(mesh))));
        });
        group.finish();
    }
}

criterion_group! { name = benches; config = plan::criterion(); targets = metrics }

criterion_main!(benches);
