//! The medial mesh: a simplicial complex of dimension at most two on medial spheres.

pub mod collapse;
mod mesh;

pub use mesh::{ComplexError, Contacts, MedialMesh, Sphere};
