//! Substrates, metrics and the simplifier trait for the 3D **medial axis transform** (MAT).
//!
//! Everything that a simplifier of the medial axis needs, and nothing about any one method:
//!
//! | module | holds |
//! |---|---|
//! | [`surface`] | triangle meshes: reading, repairing, checking, sampling, the inside test |
//! | [`geometry`] | exact predicates, Delaunay triangulation, bounding-volume trees, distances to sphere, cone and slab |
//! | [`complex`] | the medial mesh, its formats, its topology, the edge-collapse engine |
//! | [`metrics`] | Hausdorff distances, triangle quality, spikes, topology against the solid's own |
//! | [`shape`] | one normalised input with its substrates, each built once, on demand, and timed |
//! | [`simplifier`] | the trait [`simplifier::MedialSimplifier`] and what goes in and out of it |
//!
//! Lengths are in units of the input's bounding-box diagonal wherever a [`shape::Shape`] is
//! involved, and in the unit of the arguments everywhere else.

mod atomic;
pub mod complex;
mod diagnostics;
pub mod heap;
pub mod metrics;
pub mod shape;
pub mod simplifier;
mod sum;
pub mod surface;

pub use atomic::{remove_temporaries, write_atomically};

pub use geometry::Vec3;
/// Triangulations, dual complexes, box trees, distances to sphere, cone and slab: a crate of its own.
pub use medial_geometry as geometry;
