//! Exact predicates, Delaunay triangulation, bounding-volume trees, distances to medial primitives.

mod bvh;
mod cone;
mod planar_frame;
mod slab;
mod sphere;
mod tangent_planes;

pub(crate) use bvh::{Bounds, Node, Plan, Search, Tree, in_morton_order};
pub use bvh::{BvhError, Closest, Feature, TriangleBvh};
pub use cone::Cone;
pub use slab::Slab;
pub(crate) use slab::SlabFace;
pub use sphere::{HullFoot, Sphere};
pub use tangent_planes::{ConeFrame, SlabPlanes, boundary_edge_normal};
