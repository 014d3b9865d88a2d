//! `medial completions SHELL`.

use clap::Args;
use clap_complete::Shell;

use super::output::print_raw;
use super::{Exit, Failure};
use crate::cli;

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Runs the verb.
///
/// # Errors
/// Never; the signature is that of every verb.
pub fn run(arguments: &Arguments) -> Result<Exit, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut cli::command(), "medial", &mut script);
    print_raw(&String::from_utf8_lossy(&script));
    Ok(Exit::Done)
}
