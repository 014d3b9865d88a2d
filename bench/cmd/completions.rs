//! `medial completions SHELL`.

use clap::{Args, Command};
use clap_complete::Shell;

use crate::exit::{Exit, Failure};
use crate::output::print_raw;

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
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, command, "medial", &mut script);
    print_raw(&String::from_utf8_lossy(&script));
    Ok(Exit::Done)
}
