//! The verbs of the command, one file each. They share nothing but the layers below them.

pub mod axis;
pub mod baseline;
pub mod check;
pub mod compare;
pub mod completions;
pub mod convert;
pub mod datasets;
pub mod doctor;
pub mod evaluate;
pub mod hierarchy;
pub mod history;
pub mod info;
pub mod methods;
pub mod paper;
mod pictures;
pub mod reconstruct;
pub mod render;
pub mod repair;
pub mod report;
pub mod run_item;
pub mod simplify;
pub mod stability;
pub mod triangulate;
pub mod voxels;
pub mod worker;
