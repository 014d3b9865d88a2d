//! The kernel through its public interface, against definitions and brute force.

mod balls;
mod delaunay;
mod dual_complex;
mod dual_complex_invariance;
mod hull_distances;
mod poles;
mod regular;
mod tangent_planes;
