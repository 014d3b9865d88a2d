//! `medial submit-results DIR`: a folder of results as one archive, for others to collect.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::output::{counted, print_json, print_line};
use crate::run::{Packed, Provenance, pack};

/// Arguments of `submit-results`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Folder of results.
    dir: PathBuf,
    /// The archive, a gzipped tar.
    #[arg(long, short, value_name = "FILE", default_value = "medial-results.tar.gz")]
    output: PathBuf,
}

/// Runs the verb.
///
/// # Errors
/// When there is nothing to pack, a medial mesh is missing, or the archive cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let Packed { records, axes } = pack(&arguments.dir, &arguments.output, &Provenance::here())?;
    if global.json {
        let object = json!({ "archive": arguments.output, "records": records, "axes": axes });
        print_json(&object, &[]);
    } else {
        print_line(&format!(
            "{} with {} in {}; who gets it runs `medial collect {}`",
            counted(records as u64, "record"),
            match axes {
                1 => "1 medial mesh".to_owned(),
                axes => format!("{axes} medial meshes"),
            },
            arguments.output.display(),
            arguments.output.file_name().unwrap_or_default().to_string_lossy()
        ));
    }
    Ok(Exit::Done)
}
