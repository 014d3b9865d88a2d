//! `medial simplify MESH [--method ID] -o x.ma`: one method, one mesh.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use medial::complex;
use medial::simplifier::RunContext;
use medial_run::axis::read_axis;
use medial_run::level::Target;
use medial_run::record::{Simplify, Status};
use medial_run::simplify::{Output, Request, Searched};
use medial_run::text::{file_stem, percent, significant};
use medial_run::timed::Fault;

use crate::args::{
    AxisArguments, Global, MeasureArguments, MeshArgument, SubstrateArguments, key_value, method,
    params, whole,
};
use crate::exit::{Exit, Failure};
use crate::files::{check_apart, check_output, left_out, shape_of};
use crate::output::{counted, print_result};
use crate::study::registry::{DEFAULT, Entry, Registry};

#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// Run the method with this id; list the ids by `medial methods`
    /// [default with --spheres or --max-error: tight].
    #[arg(long, short, value_name = "ID")]
    method: Option<String>,
    /// Simplify to N spheres.
    #[arg(long, value_name = "N", conflicts_with_all = ["level", "max_error"], allow_negative_numbers = true, value_parser = whole)]
    spheres: Option<usize>,
    /// Simplify to native level X, in the unit of the method, or to its `published` level [default with --method].
    #[arg(long, value_name = "X", conflicts_with = "max_error", allow_negative_numbers = true, value_parser = level)]
    level: Option<Target>,
    /// Search the fewest spheres with a symmetric Hausdorff error of at most E, a fraction of the diagonal.
    #[arg(long, value_name = "E", value_parser = error_bound)]
    max_error: Option<f64>,
    /// Prove the error bound by a certificate instead of samples.
    #[arg(long, requires = "max_error", conflicts_with_all = ["spheres", "level"])]
    certify: bool,
    /// Set a parameter of the method; repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<(String, String)>,
    /// Start from this medial mesh instead of the Voronoi one.
    #[arg(long, value_name = "Y.ma")]
    initial: Option<PathBuf>,
    #[command(flatten)]
    fitting: AxisArguments,
    /// Write the result in the units of the surface: .ma, .ply, .obj, .vtp, .glb; or its spheres: .csv, .json, .yaml
    /// (cuRobo), .xrdf, .urdf, .xml (MuJoCo), .txt, .xyzr.
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    substrate: SubstrateArguments,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// Runs the verb. Fails when the input is refused, the level is not met at all, or the output cannot be written.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let start = Instant::now();
    let entry = arguments.entry(registry)?;
    let options = arguments.substrate.shape_options()?;
    // Errors that need no mesh are reported before it is read.
    check_output(arguments.output.as_deref())?;
    let read = arguments.initial.iter().map(PathBuf::as_path).chain([&*arguments.mesh]);
    check_apart(arguments.output.as_deref(), read)?;
    let line = global.stages();
    line.at("reading");
    let (input, mut shape) = shape_of(&arguments.mesh, options, arguments.substrate.as_is)?;
    if arguments.output.is_none() && !global.json {
        let example = format!("{}-{}.ma", file_stem(&input.name), entry.id());
        return Err(Failure::usage(format!(
            "no output: write the result with -o {example}, or print its figures with --json"
        )));
    }
    // The others are remarks of the result.
    let repairs = input.report.repairs.iter().filter(|repair| !repair.changes_solid());
    let mut warnings: Vec<String> = repairs.map(|repair| format!("repaired: {repair}")).collect();
    if let Some(path) = &arguments.initial {
        let (initial, notes) = read_axis(path, &shape, arguments.fitting.into())?.0.with_remarks();
        warnings.extend(notes);
        shape = shape.with_initial(&initial);
    }
    let params = params(&arguments.set);
    let seed = arguments.substrate.seed();
    let request = Request {
        shape: &shape,
        method: entry.method(),
        sweep: &entry.presentation.sweep,
        params: &params,
        context: &RunContext::with_seed(seed).on_progress(line.steps()),
        judge: arguments.measure.judge_options(seed),
        certify: arguments.certify,
        spheres_alone: arguments.output.as_deref().is_some_and(complex::holds_spheres_alone),
        on_stage: &|stage| line.at(stage),
    };
    let output = request.run(arguments.target()).map_err(|fault| arguments.failure(fault))?;
    let Output { simplify, result, search } = output;
    line.at("writing");
    if let Some(path) = &arguments.output {
        let units = shape.normalisation();
        let mesh = result.mesh.to_input(units);
        complex::write(path, &mesh).map_err(Failure::input)?;
        warnings.extend(left_out(path, &mesh));
    }
    drop(line);
    let mut object = serde_json::to_value(&simplify).map_err(Failure::input)?;
    if let Some(search) = &search {
        object["max_error"] = serde_json::to_value(search).map_err(Failure::input)?;
    }
    let native = entry.method().info().native.as_ref();
    let unit =
        native.map_or_else(String::new, |native| format!("({}, {})", native.name, native.unit));
    let text = described(&simplify, search.as_ref(), arguments, &unit, start.elapsed());
    warnings.splice(..0, simplify.warnings);
    Ok(print_result(global, &object, &text, &warnings))
}

/// A native level, or the published one.
fn level(text: &str) -> Result<Target, String> {
    match text {
        "published" => Ok(Target::Published),
        _ => {
            text.parse().map(Target::Native).map_err(|_| "expected a number or `published`".into())
        }
    }
}

impl Arguments {
    /// The named method, or the default where each method takes the level.
    fn entry<'r>(&self, registry: &'r Registry) -> Result<&'r Entry, Failure> {
        match (&self.method, self.spheres, self.max_error) {
            (Some(id), ..) => method(registry, id),
            (None, None, None) => Err(Failure::usage(format!(
                "no method: name one with --method ID, or request --spheres N or --max-error E from the default, {DEFAULT}"
            ))),
            _ => method(registry, DEFAULT),
        }
    }

    fn target(&self) -> Target {
        match (self.max_error, self.spheres, self.level) {
            (Some(bound), ..) => Target::MaxError(bound),
            (_, Some(count), _) => Target::Spheres(count),
            (.., level) => level.unwrap_or_default(),
        }
    }

    fn failure(&self, fault: Fault) -> Failure {
        let is_bug = fault.is_bug();
        let Fault { status, reason } = fault;
        match status {
            _ if is_bug => Failure::bug(format!("{}: {reason}", self.mesh.display())),
            Status::Unsupported => Failure { code: Exit::SomeFailed, message: reason },
            // Another value of an option would be accepted.
            Status::Refused | Status::BoundMissed => Failure::usage(reason),
            _ => Failure::at(&self.mesh, reason),
        }
    }
}

/// The result in words.
fn described(
    simplify: &Simplify,
    search: Option<&Searched>,
    arguments: &Arguments,
    unit: &str,
    all: Duration,
) -> String {
    let seconds = simplify.seconds.unwrap_or_default();
    let mut text = format!(
        "{}{}: {}, {}, {}; shared data {:.2} s, prepare {:.2} s, simplify {:.2} s, in all {:.2} s",
        simplify.method,
        if arguments.method.is_none() { " (default)" } else { "" },
        counted(simplify.spheres.unwrap_or(0) as u64, "sphere"),
        counted(simplify.edges.unwrap_or(0) as u64, "edge"),
        counted(simplify.faces.unwrap_or(0) as u64, "face"),
        seconds.substrate,
        seconds.prepare,
        seconds.simplify,
        all.as_secs_f64()
    );
    if let Some(level) = simplify.native_level {
        text += &format!("\n  native level {} {unit}", significant(level, 4));
    }
    if let Some(search) = search {
        let of = match search.tried {
            1 => String::new(),
            tried => format!(", the fewest spheres of {tried} levels tried"),
        };
        let certified = if search.certified { "at most " } else { "" };
        text += &format!("\n  Hausdorff error {certified}{}{of}", percent(search.hausdorff));
    }
    if let Some(path) = &arguments.output {
        text += &format!("\n  written: {}", path.display());
    }
    text
}

/// Reads a bound.
// The whole solid is within one diagonal of each of its points, so that 1 and more are implausible.
fn error_bound(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(bound) if bound > 0.0 && bound < 1.0 => Ok(bound),
        Ok(bound) if bound >= 1.0 && bound.is_finite() => Err(format!(
            "expected a fraction of the diagonal below 1; write {} for {bound} %",
            bound / 100.0
        )),
        _ => Err("expected a positive fraction of the diagonal".to_owned()),
    }
}
