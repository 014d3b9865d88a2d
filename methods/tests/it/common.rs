//! Shapes and levels that several test modules use, and the variants of the filters.

use medial::Vec3;
use medial::complex::MedialMesh;
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, Params, RunContext, Simplified, SimplifyError};
use medial::surface::{self, TriMesh};

pub const FACET: &[(&str, &str)] = &[("variant", "facet")];

pub fn shape_of(mesh: &TriMesh) -> Shape {
    let report = surface::validate(mesh).expect("a solid");
    Shape::new("shape", mesh, report, ShapeOptions::default()).expect("an extent")
}

pub fn sampled(mesh: &TriMesh, sampling: &str) -> Shape {
    let report = surface::validate(mesh).expect("a solid");
    let sampling = sampling.parse().expect("a sampling");
    let options = ShapeOptions { sampling, ..ShapeOptions::default() };
    Shape::new("shape", mesh, report, options).expect("an extent")
}

pub fn built_in(id: &str) -> TriMesh {
    let shape = medial_datasets::find(id).expect("in the catalogue");
    shape.mesh(shape.default_resolution)
}

pub fn shape(id: &str, resolution: u32) -> Shape {
    shape_of(&medial_datasets::find(id).expect("in the catalogue").mesh(resolution))
}

pub fn default_shape(id: &str) -> Shape {
    shape_of(&built_in(id))
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

/// The count of a name.
pub fn count(found: &Simplified, name: &str) -> u64 {
    let count = found.diagnostics.counts.iter().find(|count| count.0 == name);
    count.unwrap_or_else(|| panic!("no count {name} in {:?}", found.diagnostics)).1
}

/// A box around the origin with half sides `half`, as twelve triangles.
pub fn cuboid(half: Vec3) -> TriMesh {
    let signs = [-1.0, 1.0];
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    TriMesh {
        vertices: (0..8)
            .map(|i| half * Vec3::new(signs[i & 1], signs[i >> 1 & 1], signs[i >> 2]))
            .collect(),
        faces: quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    }
}

/// The result of a function on a pool of this number of threads.
pub fn with_threads<R: Send>(threads: usize, function: impl FnOnce() -> R + Send) -> R {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a pool").install(function)
}
