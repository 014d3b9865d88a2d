//! Every registered method on one built-in shape: preparation, and one level from it.
//!
//! A new method appears here by being registered.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use medial::shape::ShapeOptions;
use medial::simplifier::{Level, Params, RunContext};
use medial_bench::run::{Input, Source};

/// Spheres that each method is asked for.
const SPHERES: usize = 100;

fn methods(criterion: &mut Criterion) {
    let source = Source::BuiltIn { id: "blob".into(), resolution: None };
    let input = Input::load(&source).expect("a built-in shape");
    let shape = input.shape(ShapeOptions::default()).expect("an extent");
    // Substrates are shared and timed by themselves.
    shape.initial().expect("an initial medial mesh");
    let run = RunContext::default();
    for method in medial_methods::registry() {
        let prepare = || method.prepare(&shape, &Params::none(), &run).expect("prepared");
        let mut group = criterion.benchmark_group(method.info().id);
        group.bench_function("prepare", |b| b.iter_with_large_drop(|| black_box(prepare())));
        group.bench_function(format!("to {SPHERES} spheres"), |b| {
            let level = Level::Spheres(SPHERES);
            b.iter_batched(prepare, |mut s| black_box(s.at(level)), BatchSize::LargeInput);
        });
        group.finish();
    }
}

fn substrates(criterion: &mut Criterion) {
    let source = Source::BuiltIn { id: "blob".into(), resolution: None };
    let input = Input::load(&source).expect("a built-in shape");
    criterion.bench_function("initial medial mesh", |b| {
        let shape = || input.shape(ShapeOptions::default()).expect("an extent");
        b.iter_batched(shape, |shape| black_box(shape.initial()).is_ok(), BatchSize::LargeInput);
    });
}

criterion_group!(benches, substrates, methods);
criterion_main!(benches);
