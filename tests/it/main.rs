//! Geometry and metrics through the public interface.

mod medial_corpus;
mod metric_distances;
mod metric_invariance;
mod misfits;
mod nearest;
mod power_crust;
mod refined_samples;
mod shapes;
mod signed_distance;
mod simplices;
mod surface_bad_input;
mod surface_corpus;
mod surface_distance;
mod surface_inside;
mod surface_mend;
mod surface_sampling;
mod surface_solids;
mod union_axis;
mod union_surface;
