//! The runner behind the command `medial`, and the command itself.
//!
//! Another crate gets the whole command, with its methods added to the built-in ones, by [`main_with`].
//!
//! The modules from low to high:
//!
//! | module | content |
//! |---|---|
//! | [`host`], [`process_tree`] | the process of the command, the end of child processes |
//! | [`plugin`], [`check`] | methods as external programs, the conformance tests |
//! | [`study`] | the items to run |
//! | `store`, `exec` | the folder of records, the workers |
//! | [`own_metric`], `rebuild` | metrics of the user, the report of a store |
//! | `args`, [`exit`], `output`, `files`, `interrupt` | shared by the verbs |
//! | `cmd`, [`cli`] | one file for each verb, their list |

mod args;
pub mod check;
pub mod cli;
mod cmd;
mod exec;
pub mod exit;
mod files;
pub mod host;
mod interrupt;
mod output;
pub mod own_metric;
pub mod plugin;
pub mod process_tree;
mod progress;
pub mod provenance;
mod rebuild;
mod store;
pub mod study;

pub use cli::{main_hosted, main_with};
pub use rebuild::measure_own;

/// Counts what each item takes of the heap.
#[global_allocator]
static HEAP: medial::heap::Heap = medial::heap::Heap;
