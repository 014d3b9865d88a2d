//! The medial mesh: a simplicial complex of dimension at most two on medial spheres.

mod bulges;
pub mod collapse;
mod conforming;
mod contour;
mod formats;
mod mesh;
mod sheets;
mod topology;
mod union;
pub mod union_axis;
mod voronoi;

pub(crate) use bulges::without_bulges;
pub(crate) use conforming::is_coarse;
pub use conforming::{Conforming, ConformingError};
pub use contour::{ContourError, UnionSurface, union_surface, union_surface_within};
pub use formats::{
    LoadedMa, Look, MaError, MaErrorKind, READABLE, Radii, ReadOptions, SphereValues, WRITABLE,
    holds_spheres_alone, left_out, parse_ma, parse_obj, parse_ply, read, read_content, read_with,
    single_precision_loss, write, write_with,
};
pub use mesh::Incidence;
pub use mesh::{ComplexError, Contacts, MedialMesh};
pub use mesh::{Crossings, crossing_faces, faces_cross};
pub use sheets::{Seam, SheetGraph, SheetOptions};
pub use topology::cubical_betti;
pub use topology::{betti, euler};
pub use union::{MedialUnion, NearestPrimitive, Primitive, UnionError};
pub use union_axis::{AxisFacet, AxisTally, UnionAxis};
pub use voronoi::VoronoiFacets;
pub use voronoi::{CellSpheres, DualTriangulation, voronoi_medial_mesh};
pub use voronoi::{ZERO_LENGTH, stability_ratio};

pub use crate::geometry::Sphere;
