//! The runner behind the command `medial`, and the command itself.
//!
//! A crate of its own gets the whole command with its methods beside the others by [`main_with`].
//!
//! From below: [`host`] is the process that it runs in; [`process_tree`] ends what was started; [`plugin`] makes methods of external programs; [`check`] is what
//! every method must do; [`study`] is what to run, [`measure`] the path from an output to its record, [`store`] the folder of
//! records, [`exec`] the workers, [`rebuild`] the report of a store; [`args`], [`exit`], [`output`], [`files`] and
//! [`interrupt`] are what verbs share; [`cmd`] holds one file for each verb; [`cli`] lists them.

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
