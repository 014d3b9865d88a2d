//! Tests of reports as a whole.

mod browser;
mod common;
mod diff;
mod history;
mod journal;
mod report;
