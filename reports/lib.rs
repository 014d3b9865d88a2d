//! Result records, and what is made of them: tables, plots, the page.

mod journal;
mod record;

pub use journal::{BadLine, Journal, JournalError, Journaled, read_records, write_records};
pub use record::{Initial, Machine, Record, Repetition, Simplify, Stages, Status};
