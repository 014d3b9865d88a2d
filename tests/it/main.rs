//! Geometry and metrics through the public interface.

mod conforming;
mod corpus;
mod metric_distances;
mod metric_invariance;
mod nearest;
mod shapes;
mod signed_distance;
mod substrates;
mod surface_bad_input;
mod surface_inside;
mod surface_solids;
mod union_axis;
mod union_surface;
