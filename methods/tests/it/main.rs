//! The tests of the methods against real shapes, definitions and published figures.

mod aof;
mod aof_losses;
mod aof_refusals;
mod aof_solids;
mod box_axis;
mod chain;
mod common;
mod dey_zhao;
mod dey_zhao_by_definition;
mod filter_levels;
mod filters;
mod hem;
mod order;
mod pmat;
mod qmat;
mod sat;
mod substrates;
mod tam_heidrich;
mod vmas;
