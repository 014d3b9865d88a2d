//! What the tests of the filters share: their variants, shapes, and how a level is asked.

use medial::complex::MedialMesh;
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, Params, RunContext, Simplified, SimplifyError};
use medial::surface::{self, TriMesh};

pub const ANGLE: [&[(&str, &str)]; 4] = [
    &[("variant", "facet")],
    &[("variant", "facet"), ("at", "minimum")],
    &[("variant", "grid")],
    &[("variant", "homotopy")],
];
pub const LAMBDA: [&[(&str, &str)]; 2] =
    [&[("variant", "cell")], &[("variant", "cell"), ("leftovers", "false")]];

pub fn shape_of(mesh: &TriMesh) -> Shape {
    let report = surface::validate(mesh).expect("a solid");
    Shape::new("shape", mesh, report, ShapeOptions::default()).expect("an extent")
}

pub fn built_in(id: &str) -> TriMesh {
    let shape = medial_datasets::find(id).expect("in the catalogue");
    shape.mesh(shape.default_resolution)
}

pub fn params(set: &[(&str, &str)]) -> Params {
    let mut params = Params::none();
    set.iter().for_each(|(key, value)| params.set(key, value));
    params
}

pub fn levels(
    shape: &Shape,
    method: &str,
    set: &[(&str, &str)],
    levels: &[Level],
) -> Vec<Result<Simplified, SimplifyError>> {
    let method = medial_methods::find(method).expect("registered");
    let run = RunContext::default();
    let mut prepared = method.prepare(shape, &params(set), &run).expect("prepared");
    levels.iter().map(|&level| prepared.at(level)).collect()
}

pub fn at(shape: &Shape, method: &str, set: &[(&str, &str)], level: Level) -> MedialMesh {
    let mesh = levels(shape, method, set, &[level]).remove(0).expect("a level").mesh;
    mesh.check().expect("a valid complex");
    mesh
}
