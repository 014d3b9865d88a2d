//! The verbs of the command, one file each. They share nothing but the layers below them.

pub mod axis;
pub mod check;
pub mod compare;
pub mod convert;
pub mod datasets;
pub mod diff;
pub mod evaluate;
pub mod history;
pub mod info;
pub mod methods;
pub mod reconstruct;
pub mod render;
pub mod repair;
pub mod report;
pub mod simplify;
pub mod view;
