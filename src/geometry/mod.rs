//! Exact predicates, Delaunay and regular triangulations, dual complexes, poles, bounding-volume
//! trees, distances to medial primitives.

mod bvh;
mod cone;
pub mod delaunay;
pub mod dual_complex;
mod enclosing;
mod nearby;
pub(crate) mod planar_frame;
pub mod poles;
pub mod power_crust;
pub mod predicates;
pub mod regular;
mod separation;
mod signed_distance;
mod slab;
mod sphere;
mod tangent_planes;
pub mod triangulation;
pub mod union_boundary;

pub(crate) use bvh::{
    Bounds, Node, Plan, Search, Tree, WideTree, in_morton_order, morton_code, morton_order,
};
pub use bvh::{BvhError, Closest, Feature, TriangleBvh, Winding, WindingTree, spread_order};
pub(crate) use bvh::{ConeBlock, FaceBlock, Lanes, Measure, Query, ReachTree};
pub use cone::Cone;
pub use delaunay::Delaunay;
pub use dual_complex::DualComplex;
pub use enclosing::enclosing_ball;
pub use nearby::{NearBatch, NearPoint, NearSet, NearbyTriangles};
pub use poles::{PolarBall, Pole, Poles, SamplePoles, unbounded_directions};
pub use power_crust::PowerCrust;
pub use regular::Regular;
pub use separation::separation_angle;
pub use signed_distance::SignedDistance;
pub use slab::{Slab, SlabFace};
pub use sphere::{HullFoot, Sphere};
pub use tangent_planes::{ConeFrame, SlabPlanes, boundary_edge_normal};
pub use triangulation::{CellId, TriangulationError, VertexId};
pub use union_boundary::{MergedVertices, UnionBoundary, UnionVertex, shared_sample};
