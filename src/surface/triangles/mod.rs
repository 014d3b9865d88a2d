//! Queries on triangles, whatever they bound: the closest point, the generalised winding number.

mod block;
mod closest;
mod expansion;
mod solid_angle;
mod winding_tree;

pub use closest::{BvhError, Closest, Feature, TriangleBvh};
pub use winding_tree::{Winding, WindingTree};
