//! Searches that keep what they computed: the answers do not depend on what was asked before, and
//! the work says what had been done.

use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplified, Work};
use medial::surface;

fn built_in(id: &str) -> Shape {
    let built_in = medial_datasets::find(id).expect("in the catalogue");
    let mesh = built_in.mesh(built_in.default_resolution);
    let report = surface::validate(&mesh).expect("a solid");
    Shape::new(id, &mesh, report, ShapeOptions::default()).expect("an extent")
}

fn answers(method: &dyn MedialSimplifier, shape: &Shape, counts: &[usize]) -> Vec<Simplified> {
    let run = RunContext::default();
    let mut prepared = method.prepare(shape, &Params::none(), &run).expect("prepared");
    counts.iter().map(|&count| prepared.at(Level::Spheres(count)).expect("a count")).collect()
}

#[test]
fn answers_do_not_depend_on_earlier_ones() {
    for id in ["sat", "aof"] {
        let method = medial_methods::find(id).expect("registered");
        for shape in ["bracket", "plate", "pair"] {
            let shape = built_in(shape);
            let counts = [150, 1000, 400, 30, 150];
            for (count, after) in counts.iter().zip(answers(method.as_ref(), &shape, &counts)) {
                let alone = answers(method.as_ref(), &shape, &[*count]).remove(0);
                let name = format!("{id} on {} at {count}", shape.name());
                assert_eq!(after.mesh, alone.mesh, "{name}");
                assert_eq!(after.native_level, alone.native_level, "{name}");
                assert_eq!(after.diagnostics, alone.diagnostics, "{name}");
                assert_eq!(alone.work, Work::Anew, "{name}");
            }
        }
    }
}

#[test]
fn work_that_was_done_before_is_told() {
    for id in ["sat", "aof"] {
        let method = medial_methods::find(id).expect("registered");
        let shape = built_in("bracket");
        let works = answers(method.as_ref(), &shape, &[400, 100, 100]).into_iter().map(|a| a.work);
        let costs: Vec<f64> = works
            .map(|work| match work {
                Work::Reused(cost) => cost.cpu_seconds,
                Work::Anew => 0.0,
                Work::Continued => panic!("{id} does not go on from level to level"),
            })
            .collect();
        // The first has nothing to reuse, the second some, the third everything.
        assert!(costs[0] == 0.0 && costs[1] > 0.0 && costs[2] >= costs[1], "{id}: {costs:?}");
    }
}
