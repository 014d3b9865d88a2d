//! Cancellation: a method ends soon after the flag is set, wherever it is.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::thread;
use std::time::{Duration, Instant};

use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, Params, RunContext, SimplifyError};
use medial::surface;

/// Longest time from the flag to the return. Load must not exceed it, and a stretch without a check does.
const PROMPT: Duration = Duration::from_secs(5);

/// A shape on which methods take long, with the substrates that no flag interrupts.
fn large_shape() -> Shape {
    let mesh = medial_datasets::find("blob").expect("in the catalogue").mesh(48);
    let report = surface::validate(&mesh).expect("a solid");
    let shape = Shape::new("blob", &mesh, report, ShapeOptions::default()).expect("an extent");
    shape.initial().expect("an initial medial mesh");
    shape.facets().expect("facets");
    shape.inner_balls().expect("polar balls");
    shape.surface_tree().expect("faces");
    shape.inside_test();
    shape
}

#[test]
fn every_method_ends_soon_after_it_is_cancelled() {
    let shape = large_shape();
    let mut cancelled = Vec::new();
    for entry in medial_methods::registry() {
        let id = entry.method.info().id.to_string();
        for delay in [0, 500].map(Duration::from_millis) {
            let run = RunContext::default();
            let flag = run.cancel_flag();
            let is_done = AtomicBool::new(false);
            flag.store(delay.is_zero(), Relaxed);
            let (outcome, late) = thread::scope(|scope| {
                let watch = scope.spawn(|| {
                    let began = Instant::now();
                    while began.elapsed() < delay && !is_done.load(Relaxed) {
                        thread::sleep(Duration::from_millis(5));
                    }
                    flag.store(true, Relaxed);
                    Instant::now()
                });
                let prepared = entry.method.prepare(&shape, &Params::none(), &run);
                let outcome = prepared.and_then(|mut prepared| prepared.at(Level::Spheres(200)));
                let ended = Instant::now();
                is_done.store(true, Relaxed);
                let set = watch.join().expect("no panic");
                (outcome, ended.saturating_duration_since(set))
            });
            assert!(late < PROMPT, "{id}: {late:?} after the flag, which was set after {delay:?}");
            match outcome {
                Err(SimplifyError::Cancelled) => cancelled.push(id.clone()),
                Ok(_) => {}
                Err(error) => panic!("{id}: {error}"),
            }
        }
    }
    cancelled.dedup();
    assert_eq!(cancelled.len(), medial_methods::registry().len(), "{cancelled:?}");
}
