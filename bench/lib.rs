//! The runner behind the command `medial`, and the command itself.
//!
//! A crate of its own gets the whole command with its methods beside the others by [`main_with`].
//!
//! From below: [`host`] is the process that it runs in; [`process_tree`] ends what was started; [`plugin`] makes methods of external programs; [`check`] is what
//! every method must do; [`run`] knows inputs, items, workers and records, and nothing of the command line; [`args`], [`exit`], [`output`], [`files`] and
//! [`interrupt`] are what verbs share; [`cmd`] holds one file for each verb; [`cli`] lists them.

pub mod args;
pub mod check;
pub mod cli;
pub mod cmd;
pub mod exit;
pub mod files;
pub mod host;
pub mod interrupt;
pub mod output;
pub mod plugin;
pub mod process_tree;
pub mod run;

pub use cli::{main_hosted, main_with};

/// Counts what each item takes of the heap.
#[global_allocator]
static HEAP: medial::heap::Heap = medial::heap::Heap;
