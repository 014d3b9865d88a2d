//! The medial mesh: a simplicial complex of dimension at most two on medial spheres.

mod formats;
mod mesh;

pub use formats::{
    LoadedMa, MaError, MaErrorKind, parse_ma, parse_ply, read, read_ma, write, write_atomically,
};
pub use mesh::{ComplexError, Contacts, MedialMesh, Sphere};
