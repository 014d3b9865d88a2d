//! The runner behind the command `medial`, and the command itself.
//!
//! Another crate gets the whole command, with its methods added to the built-in ones, by [`main_with`].
//!
//! The modules from low to high: [`host`], the process of the command; [`process_tree`], which ends child processes;
//! [`plugin`], methods as external programs; [`check`], the conformance corpus; [`study`], the items to run; [`measure`],
//! from an output to its record; [`store`], the folder of records; [`exec`], the workers; [`rebuild`], the report of a
//! store. Verbs share [`args`], [`exit`], [`output`], [`files`] and [`interrupt`]. [`cmd`] has one file for each verb,
//! and [`cli`] lists them.

pub mod args;
pub mod check;
pub mod cli;
pub mod cmd;
pub mod exec;
pub mod exit;
pub mod files;
pub mod host;
pub mod interrupt;
pub mod measure;
pub mod output;
pub mod plugin;
pub mod process_tree;
pub mod progress;
pub mod provenance;
pub mod rebuild;
pub mod store;
pub mod study;

pub use cli::{main_hosted, main_with};

/// Counts what each item takes of the heap.
#[global_allocator]
static HEAP: medial::heap::Heap = medial::heap::Heap;
