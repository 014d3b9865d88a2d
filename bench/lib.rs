//! The runner behind the command `medial`, and the command itself.
//!
//! From below: [`run`] knows inputs, items and records, and nothing of the command line; [`args`],
//! [`exit`], [`output`] and [`files`] are what verbs share; [`cmd`] holds one file for each verb;
//! [`cli`] lists them.

pub mod args;
pub mod cli;
pub mod cmd;
pub mod exit;
pub mod files;
pub mod output;
pub mod run;
