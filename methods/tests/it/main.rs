//! The tests of the methods against real shapes, definitions and published figures.

mod across;
mod aof;
mod box_axis;
mod cancel;
mod chain;
mod common;
mod dey_zhao;
mod filters;
mod hem;
mod pmat;
mod qmat;
mod rounding;
mod sat;
mod sphere_mesh;
mod tam_heidrich;
mod vmas;
