//! `medial datasets list` and `medial datasets make`: the built-in shapes.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use medial::surface;
use medial_datasets::{BuiltIn, NoiseKind};
use serde_json::{Value, json};

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
    /// List the built-in shapes.
    List,
    /// Write a built-in shape as a surface file.
    Make(Make),
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
/// When no shape has the id, or the file cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    match &arguments.action {
        Action::List => list(global),
        Action::Make(make) => write(make, global)?,
    }
    Ok(Exit::Done)
}

fn entry(shape: &BuiltIn) -> Value {
    json!({
        "id": shape.id,
        "title": shape.title,
        "summary": shape.summary,
        "betti": shape.expected_betti,
        "default_resolution": shape.default_resolution,
        "known_axis": shape.axis().is_some(),
        "in_default": shape.in_default,
    })
}

fn list(global: &Global) {
    let shapes = medial_datasets::catalogue();
    if global.json {
        print_json(&json!({ "datasets": shapes.iter().map(entry).collect::<Vec<_>>() }), &[]);
        return;
    }
    for shape in &shapes {
        let axis = if shape.axis().is_some() { "axis known" } else { "" };
        print_line(&format!(
            "{:<14} betti {:?}  {axis:<10}  {}",
            shape.id, shape.expected_betti, shape.summary
        ));
    }
    let in_default = shapes.iter().filter(|shape| shape.in_default).count();
    print_line(&format!(
        "compare and stability take the first {in_default} where no mesh is named"
    ));
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
