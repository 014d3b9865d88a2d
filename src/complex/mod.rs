//! The medial mesh: a simplicial complex of dimension at most two on medial spheres.

mod mesh;
mod voronoi;

pub use mesh::{ComplexError, Contacts, MedialMesh, Sphere};
pub use voronoi::{CellSpheres, DualTriangulation, voronoi_medial_mesh};
