//! The medial mesh: a simplicial complex of dimension at most two on medial spheres.

mod mesh;

pub use mesh::{ComplexError, Contacts, MedialMesh, Sphere};
