//! Geometry and metrics through the public interface.

mod conforming;
mod corpus;
mod metric_distances;
mod metric_invariance;
mod nearest;
mod shapes;
mod signed_distance;
mod substrates;
mod surface_bad_input;
mod surface_inside;
mod surface_solids;
mod union_axis;
mod union_surface;

use medial::metrics::{Judge, JudgeOptions, Truth};
use medial::surface::{InsideTest, TriMesh, TriangleBvh};

/// A judge of medial meshes of a surface.
fn judge(surface: &TriMesh, truth: Truth, options: JudgeOptions) -> Judge {
    let tree = TriangleBvh::new(surface).expect("faces").into();
    Judge::new(surface.clone(), tree, InsideTest::new(surface).into(), truth, options)
}

/// The result of a function on this number of threads.
fn on_threads<T: Send>(threads: usize, build: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(build)
}
