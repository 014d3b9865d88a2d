//! The kernel through its public interface, against definitions and brute force.

mod delaunay;
mod dual_complex;
mod hull_distances;
mod poles;
mod regular;
