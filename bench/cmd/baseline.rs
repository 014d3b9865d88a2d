//! `medial baseline MESH --surfaces LIST`: decimated surfaces beside the methods of a report.
//!
//! The surfaces come from elsewhere (`scripts/baselines/decimate.sh` makes them); LIST names them:
//! `{"tool": "NAME VERSION", "surfaces": [{"file": "a.off", "numbers": 4000, "seconds": 0.01}]}`, files
//! relative to its folder, in the units of the mesh.

use std::path::{Path, PathBuf};

use clap::Args;
use medial::metrics::JudgeOptions;
use medial::shape::ShapeOptions;
use medial::surface::{self, TriMesh};
use medial_reports::{BASELINES, Baseline, read_lines, write_lines};
use serde::Deserialize;
use serde_json::json;

use super::report::rebuild;
use crate::args::{Global, MeasureArguments, MeshArgument, judge_options};
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line};
use crate::run::{Input, Provenance, RESULTS, Registry, Source, percent};

/// Arguments of `baseline`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL, GLB), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// List of the decimated surfaces (JSON), as `scripts/baselines/decimate.sh` writes it.
    #[arg(long, value_name = "LIST")]
    surfaces: PathBuf,
    /// Folder of the report that the baseline is added to.
    #[arg(long, value_name = "DIR", default_value = "medial-report")]
    out: PathBuf,
    /// Seed of the samples.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// The list of surfaces.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    tool: String,
    surfaces: Vec<Listed>,
}

/// One decimated surface.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Listed {
    file: PathBuf,
    /// Floats that were asked for.
    numbers: usize,
    #[serde(default)]
    seconds: Option<f64>,
}

/// Runs the verb.
///
/// # Errors
/// When the mesh, the list or one of its surfaces is refused, or the results cannot be written.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let source = Source::parse(&arguments.mesh).map_err(Failure::usage)?;
    let quick = JudgeOptions { samples: 10_000, volume_depth: 0, seed: 0 };
    let options = judge_options(&arguments.measure, quick, arguments.seed)?;
    let list = read_list(&arguments.surfaces)?;
    let input = Input::load(&source)?;
    let shape =
        input.shape(ShapeOptions::default()).map_err(|error| Failure::of(&source, error))?;
    let judge = shape.judge(None, options).map_err(|error| Failure::of(&source, error))?;
    let normal = shape.normalisation();
    let provenance = Provenance::here();
    let folder = arguments.surfaces.parent().unwrap_or(Path::new(""));
    let mut new = Vec::new();
    for listed in &list.surfaces {
        let path = folder.join(&listed.file);
        let surface = surface::read_any(&path).map_err(Failure::input)?.mesh;
        let moved = TriMesh {
            vertices: surface.vertices.iter().map(|&v| normal.forward(v)).collect(),
            faces: surface.faces,
        };
        let refused = |error| Failure::input(format!("{}: {error}", path.display()));
        new.push(Baseline {
            mesh: input.name.clone(),
            mesh_hash: input.hash.clone(),
            tool: list.tool.clone(),
            numbers_asked: listed.numbers,
            vertices: moved.vertices.len(),
            faces: moved.faces.len(),
            seconds: listed.seconds,
            distances: judge.surface_distances(&moved).map_err(refused)?,
            seed: options.seed,
            command: provenance.command.clone(),
            version: provenance.version.clone(),
        });
    }
    keep(&arguments.out.join(BASELINES), &new)?;
    let reported = arguments.out.join(RESULTS).exists();
    if reported {
        rebuild(&arguments.out, registry)?;
    }
    if global.json {
        print_json(&json!({ "baselines": new, "report": reported }), &[]);
        return Ok(Exit::Done);
    }
    print_line(&format!("{}, {}", input.name, list.tool));
    for baseline in &new {
        print_line(&format!(
            "  {:>7} numbers ({} faces): Hausdorff {}, mean {}",
            baseline.numbers(),
            baseline.faces,
            percent(baseline.distances.hausdorff),
            percent(baseline.distances.mean)
        ));
    }
    if !reported {
        print_line(&format!(
            "no {RESULTS} in {}: `medial compare --out {0}` shows the baseline beside the methods",
            arguments.out.display()
        ));
    }
    Ok(Exit::Done)
}

fn read_list(path: &Path) -> Result<List, Failure> {
    let failed = |error: String| Failure::input(format!("{}: {error}", path.display()));
    let bytes = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
    serde_json::from_slice(&bytes).map_err(|error| failed(error.to_string()))
}

/// Adds baselines to the file; those of the same mesh, tool and number are replaced.
fn keep(path: &Path, new: &[Baseline]) -> Result<(), Failure> {
    let key = |b: &Baseline| (b.mesh_hash.clone(), b.tool.clone(), b.numbers_asked);
    let mut all: Vec<Baseline> = read_lines(path).map_err(Failure::input)?;
    all.retain(|old| new.iter().all(|b| key(b) != key(old)));
    all.extend_from_slice(new);
    write_lines(path, &all).map_err(Failure::input)
}
