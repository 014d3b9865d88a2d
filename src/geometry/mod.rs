//! Exact predicates, Delaunay triangulation, bounding-volume trees, distances to medial primitives.

mod enclosing;

pub use enclosing::enclosing_ball;
