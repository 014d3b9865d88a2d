//! Substrates, metrics and the simplifier trait for the 3D **medial axis transform** (MAT).
//!
//! Everything that a simplifier of the medial axis needs, and nothing about any one method:
//!
//! | module | holds |
//! |---|---|
//! | [`surface`] | triangle meshes: reading, repairing, checking, sampling, the inside test |
//! | [`geometry`] | the crate `medial-geometry`: exact predicates, triangulations, box trees, distances to sphere, cone and slab |
//! | [`complex`] | the medial mesh, its formats, its topology, the edge-collapse engine |
//! | [`metrics`] | Hausdorff distances, triangle quality, spikes, topology against the solid's own |
//! | [`shape`] | one normalised input with its substrates, each built once, on demand, and timed |
//! | [`simplifier`] | the trait [`simplifier::MedialSimplifier`] with its inputs and outputs |
//!
//! Lengths are in units of the input's bounding-box diagonal wherever a [`shape::Shape`] is
//! involved, and in the unit of the arguments everywhere else.
//!
//! ```
//! use medial::complex::betti;
//! use medial::metrics::JudgeOptions;
//! use medial::shape::{Shape, ShapeOptions};
//! use medial::surface::{self, Format};
//!
//! let tetrahedron = b"OFF 4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
//! let loaded = surface::read_bytes(tetrahedron, Format::Off)?;
//! let options = ShapeOptions { sampling: "uniform:500".parse()?, ..ShapeOptions::default() };
//! let shape = Shape::new("tetrahedron", &loaded.mesh, loaded.report, options)?;
//!
//! // The Voronoi medial mesh, and how far its spheres, cones and slabs are from the surface.
//! let initial = shape.initial()?;
//! let judge = shape.judge(None, JudgeOptions { samples: 2_000, ..JudgeOptions::default() })?;
//! let distances = judge.distances(&initial)?;
//! assert_eq!(betti(&initial)[0], 1);
//! assert!(distances.hausdorff < 0.15, "{} of the diagonal", distances.hausdorff);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

/// A hash of the sources of this crate; that of the kernel is its own.
pub const SOURCE_HASH: &str = env!("SOURCE_HASH");

mod atomic;
mod colour;
pub mod complex;
mod diagnostics;
pub mod heap;
mod input;
pub mod metrics;
pub mod range_queue;
pub mod shape;
pub mod simplifier;
mod sum;
pub mod surface;

pub use atomic::{remove_temporaries, write_atomically};
pub use colour::{ColourMap, decode_srgb};
pub use input::{
    check_regular, parser_message, quoted, read_regular, read_regular_text, shortened,
};

pub use geometry::Vec3;
/// Triangulations, dual complexes, box trees, distances to sphere, cone and slab: a separate crate.
pub use medial_geometry as geometry;
// For the code that `parameters!` generates.
#[doc(hidden)]
pub use serde;
