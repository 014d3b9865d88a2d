//! Results of searches do not depend on earlier levels.

use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplified};
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
            }
        }
    }
}
