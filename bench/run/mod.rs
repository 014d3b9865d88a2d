//! Inputs, items and records: what is run, how it is timed, what is written down.
//!
//! A comparison is a list of [`Item`]s: one method on one input at some levels. [`run_item`] runs
//! one and gives a [`medial_reports::Record`] for each level. An item is plain data, so that it can
//! be handed to another process as it is.

mod input;
mod item;
mod npy;
mod npy_header;
mod progress;
mod provenance;
mod reproduce;
mod search;
mod similar;
mod stage_line;
mod stopwatch;

pub use input::{Input, InputError, Source};
pub use item::{Item, Measure, RunOptions, refused_records, run_item};
pub use npy::{Matrix, NpyError, NpyErrorKind, read_matrix, write_cells, write_npy_header};
pub use npy_header::HeaderError;
pub use progress::Progress;
pub use provenance::{Provenance, hex_digest, peak_bytes};
pub use reproduce::Reproducer;
pub use search::{Found, search_error};
pub use similar::did_you_mean;
pub use stage_line::StageLine;
pub use stopwatch::{Lap, Stopwatch};
