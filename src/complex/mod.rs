//! The medial mesh: a simplicial complex of dimension at most two on medial spheres.

mod mesh;
mod union;

pub use mesh::{ComplexError, Contacts, MedialMesh};
pub use union::{MedialUnion, NearestPrimitive, Primitive, UnionError};

pub use crate::geometry::Sphere;
