//! Triangle meshes: reading, repairing, checking, sampling, the inside test.

mod mesh;

pub use mesh::{Normalisation, TriMesh};
