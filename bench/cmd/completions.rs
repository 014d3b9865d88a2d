//! `medial completions SHELL`.

use std::io;

use clap::{Args, Command};
use clap_complete::Shell;

use crate::exit::{Exit, Failure};

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Runs the verb for the command as a whole.
///
/// # Errors
/// Never; the signature is that of every verb.
pub fn run(arguments: &Arguments, command: &mut Command) -> Result<Exit, Failure> {
    clap_complete::generate(arguments.shell, command, "medial", &mut io::stdout());
    Ok(Exit::Done)
}
