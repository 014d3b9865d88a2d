//! The command `medial`, inside a Python process.
//!
//! It is the same command; only its workers are started by Python as it was, and plug-in files may
//! hold Python classes.

use std::ffi::OsString;
use std::path::PathBuf;

use medial_bench::host::Host;
use medial_bench::main_hosted;
use pyo3::prelude::*;

use crate::method::Classes;

/// Runs the command and gives its exit code. `program` with `arguments` starts it again; `code` is the file of this
/// module.
#[pyfunction]
pub fn run_command(
    py: Python<'_>,
    program: PathBuf,
    arguments: Vec<OsString>,
    code: PathBuf,
    words: Vec<OsString>,
) -> u8 {
    let host = Host { program, arguments, code, words };
    py.detach(|| main_hosted(medial_methods::registry(), host, Box::new(Classes)) as u8)
}
