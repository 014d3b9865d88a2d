//! Tests of reports as a whole.

mod browser;
mod common;
mod diff;
mod extras;
mod history;
mod journal;
mod papers;
mod report;
mod scaling;
