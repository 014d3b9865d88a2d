//! `medial worker`: what the supervisor starts. Not for people.

use clap::Args;

use crate::exec::serve::serve;
use crate::exit::{Exit, Failure};
use crate::study::registry::Registry;

/// Arguments of `worker`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Limit of memory.
    #[arg(long, default_value_t = u64::MAX)]
    bytes: u64,
}

/// Runs the verb.
///
/// # Errors
/// Never at present: what goes wrong is told to the supervisor.
pub fn run(arguments: &Arguments, registry: &Registry) -> Result<Exit, Failure> {
    serve(registry, arguments.bytes);
    Ok(Exit::Done)
}
