//! The runner behind the command `medial`, and the command itself.
//!
//! [`run`] knows inputs, items and records, and nothing of the command line; [`cmd`] holds one
//! file for each verb; [`cli`] describes the arguments.

pub mod cli;
pub mod cmd;
pub mod interrupt;
pub mod run;
