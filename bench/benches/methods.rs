//! Every registered method on one built-in shape: preparation, and one level from it.
//!
//! A new method appears here by being registered.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use medial::complex::collapse::Hierarchy;
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
        let mut group = criterion.benchmark_group(&*method.info().id);
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

/// What a hierarchy is asked for: the way between two stages, simplex by simplex, one stage as a
/// view and as a mesh of its own, and its file.
fn hierarchy(criterion: &mut Criterion) {
    let source = Source::BuiltIn { id: "blob".into(), resolution: None };
    let input = Input::load(&source).expect("a built-in shape");
    let shape = input.shape(ShapeOptions::default()).expect("an extent");
    let pmat = medial_methods::find("pmat").expect("registered");
    let run = RunContext::default();
    let mut levels = pmat.prepare(&shape, &Params::none(), &run).expect("prepared");
    let end = levels.at(Level::Spheres(1)).expect("the end");
    let hierarchy = end.extras.get_shared::<Hierarchy>().expect("PMAT has a hierarchy");
    let last = hierarchy.last_stage();
    let mut group = criterion.benchmark_group("hierarchy");
    let ways = [
        ("finest to coarsest", 0, last),
        ("coarsest to finest", last, 0),
        ("one step", last / 2, last / 2 + 1),
    ];
    for (name, from, to) in ways {
        group.bench_function(name, |b| {
            b.iter(|| {
                let change = hierarchy.change(from, to);
                change.edges_removed().for_each(|edge| {
                    black_box(edge);
                });
                change.edges_added().for_each(|edge| {
                    black_box(edge);
                });
                change.faces_removed().for_each(|face| {
                    black_box(face);
                });
                change.faces_added().for_each(|face| {
                    black_box(face);
                });
            });
        });
    }
    let half = hierarchy.stage(last / 2);
    group.bench_function("half as a mesh", |b| b.iter_with_large_drop(|| half.to_mesh()));
    let mut bytes = Vec::new();
    hierarchy.write_to(&mut bytes, "").expect("into memory");
    group.bench_function("parse", |b| b.iter_with_large_drop(|| Hierarchy::parse(&bytes, "")));
    group.finish();
}

criterion_group!(benches, substrates, methods, hierarchy);
criterion_main!(benches);
