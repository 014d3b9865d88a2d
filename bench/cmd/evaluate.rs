//! `medial evaluate MESH X.ma`: every metric of a medial mesh from anywhere.

use std::path::PathBuf;

use clap::Args;
use medial::complex::LoadedMa;
use medial::metrics::{Certificate, Evaluation, JudgeOptions, MetricError, Witness, WitnessSide};
use medial::shape::{Fit, ShapeOptions};
use medial_reports::measured_rows;
use serde::Serialize;

use crate::args::{AxisArguments, Global, MeasureArguments, MeshArgument, judge_options};
use crate::exit::{Exit, Failure};
use crate::files::medial_mesh_for;
use crate::output::{counted, note, print_json, print_line};
use crate::run::{Input, Source, StageLine};

/// Arguments of `evaluate`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL, GLB), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// Medial mesh (.ma and its dialects, or .ply or .obj with radii), in the units of the surface unless
    /// `--fit` finds others.
    axis: PathBuf,
    #[command(flatten)]
    fitting: AxisArguments,
    /// Seed of the samples.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Enclose the Hausdorff distance in an interval at most so wide, as a fraction of the diagonal.
    #[arg(long, value_name = "TOL")]
    certify: Option<f64>,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// Runs the verb.
///
/// # Errors
/// When the surface or the medial mesh is refused.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let source = Source::parse(&arguments.mesh).map_err(Failure::usage)?;
    let options = judge_options(&arguments.measure, JudgeOptions::default(), arguments.seed)?;
    let line = StageLine::new(global.stages());
    line.at("reading");
    let input = Input::load(&source)?;
    let shape =
        input.shape(ShapeOptions::default()).map_err(|error| Failure::of(&source, error))?;
    let (loaded, fit) = medial_mesh_for(&arguments.axis, &shape, &arguments.fitting)?;
    let LoadedMa { mesh, notes, mut warnings, .. } = loaded;
    line.at("preparing the surface");
    let judge =
        shape.judge(input.axis.as_ref(), options).map_err(|error| Failure::of(&source, error))?;
    let to_normal = shape.normalisation();
    let mesh = mesh.transformed(1.0 / to_normal.diagonal, |p| to_normal.forward(p));
    let refused = |error: MetricError| match error {
        MetricError::Tolerance(_) | MetricError::TooFine { .. } => {
            Failure::usage(format!("--certify: {error}"))
        }
        MetricError::NoArea | MetricError::NoVolume(_) => Failure::of(&source, error),
        _ => Failure::input(format!("{}: {error}", arguments.axis.display())),
    };
    if arguments.certify.is_some() {
        line.at("certifying the Hausdorff distance");
    }
    let certified = arguments.certify.map(|tolerance| judge.certify(&mesh, tolerance));
    let mut certified = certified.transpose().map_err(refused)?;
    if let Some(Certificate { witness, .. }) = &mut certified {
        witness.point = to_normal.backward(witness.point);
    }
    line.at("measuring");
    let evaluation = Evaluation { certified, ..judge.evaluate(&mesh).map_err(refused)? };
    drop(line);
    // No number depends on how a file writes its mesh, so the answer does not either.
    for line in &notes {
        note(global, &format!("{}: {line}", arguments.axis.display()));
    }
    warnings.extend(input.report.warnings);
    if global.json {
        print_json(&Evaluated { evaluation: &evaluation, fit }, &warnings);
    } else {
        print_evaluation(&evaluation);
        for warning in evaluation.warnings.iter().chain(&warnings) {
            print_line(&format!("  warning: {warning}"));
        }
    }
    Ok(Exit::Done)
}

/// An evaluation and the change of units that it was made after.
#[derive(Serialize)]
struct Evaluated<'a> {
    #[serde(flatten)]
    evaluation: &'a Evaluation,
    #[serde(skip_serializing_if = "Option::is_none")]
    fit: Option<Fit>,
}

/// Prints every metric, lengths in percent of the diagonal.
pub fn print_evaluation(evaluation: &Evaluation) {
    let counts = &evaluation.counts;
    print_line(&format!(
        "{}, {} ({} without a face), {}",
        counted(counts.spheres, "sphere"),
        counted(counts.edges, "edge"),
        counts.lone_edges,
        counted(counts.faces, "face")
    ));
    let betti = match evaluation.expected_betti {
        Some(expected) => format!("{:?} (the solid's: {expected:?})", evaluation.betti),
        None => format!("{:?}", evaluation.betti),
    };
    for (metric, mut values) in measured_rows(&[evaluation]) {
        print_line(&format!("  {metric:<32} {}", values.remove(0)));
    }
    print_line(&format!("  {:<32} {betti}", "Betti numbers"));
    if let Some(certified) = evaluation.certified {
        let Witness { point, on } = certified.witness;
        let on = match on {
            WitnessSide::Surface => "surface",
            WitnessSide::Union => "union",
        };
        print_line(&format!(
            "  {:<32} on the {on}: {} {} {}",
            "farthest point", point.x, point.y, point.z
        ));
    }
}
