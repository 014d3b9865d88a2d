//! Results of many nights.

mod steps;
mod student;

pub use steps::{Step, StepOptions, steps};
