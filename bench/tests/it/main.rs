//! Tests of the command and the runner as a whole.

mod adapters;
mod check;
mod cli;
mod cli_compare;
mod cli_simplify;
mod command;
mod diff;
mod edition;
mod external_results;
mod faults;
mod history;
mod hostile;
mod layers;
mod own_metric;
mod plugin;
mod plugin_output;
mod process_tree;
mod public;
mod readers;
mod reconstruct;
mod render;
mod store;
