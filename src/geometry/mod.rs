//! Exact predicates, Delaunay triangulation, bounding-volume trees, distances to medial primitives.

pub mod delaunay;
pub mod predicates;
pub mod regular;
pub mod triangulation;
