//! `medial simplify MESH --method ID -o x.ma`: one method, one mesh.

mod bound;
mod outputs;

use std::path::PathBuf;

use clap::Args;
use medial::complex::{self, MedialMesh};
use medial::metrics::topology_warning;
use medial::shape::Shape;
use medial::simplifier::{Level, Params, RunContext, Simplification, SimplifyError};
use medial_methods::tam_heidrich::PartInfo;
use medial_reports::{Simplify, Status};

use super::methods::method;
use crate::args::{
    AxisArguments, Global, MeasureArguments, MeshArgument, SubstrateArguments, params,
    shape_options,
};
use crate::exit::{Exit, Failure};
use crate::files::medial_mesh_for;
use crate::output::{counted, note, print_json, print_line, version};
use crate::run::record::fill_result;
use crate::run::{Entry, Fault, Input, LevelRun, Registry, Source, StageLine, answer, percent};
use bound::Searched;
use outputs::Outputs;

/// Arguments of `simplify`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL, GLB), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// Id of the method; `medial methods` lists them.
    #[arg(long, short, value_name = "ID")]
    method: String,
    /// Number of spheres.
    #[arg(long, value_name = "N", conflicts_with_all = ["level", "max_error"])]
    spheres: Option<usize>,
    /// The method's own level, in its own unit.
    #[arg(long, value_name = "X", conflicts_with = "max_error", allow_negative_numbers = true)]
    level: Option<f64>,
    /// As few spheres as keep the symmetric Hausdorff error within this fraction of the diagonal.
    #[arg(long, value_name = "E")]
    max_error: Option<f64>,
    /// Hold that bound by a certificate, not by samples alone.
    #[arg(long, requires = "max_error")]
    certify: bool,
    /// Set a parameter of the method; can be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Start from this medial mesh instead of the Voronoi one.
    #[arg(long, value_name = "Y.ma")]
    initial: Option<PathBuf>,
    #[command(flatten)]
    fitting: AxisArguments,
    #[command(flatten)]
    outputs: Outputs,
    #[command(flatten)]
    substrate: SubstrateArguments,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// Runs the verb.
///
/// # Errors
/// When the input is refused, the level is not met at all, or the output cannot be written.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let source = Source::parse(&arguments.mesh).map_err(Failure::usage)?;
    let entry = method(registry, &arguments.method)?;
    let method = entry.method();
    let options = shape_options(&arguments.substrate)?;
    bound::check(arguments)?;
    arguments.outputs.check(method)?;
    let line = StageLine::new(global.stages());
    line.at("reading");
    let input = Input::load(&source)?;
    let mut shape = input.shape(options).map_err(|error| Failure::of(&source, error))?;
    let mut warnings = input.report.warnings.clone();
    if let Some(path) = &arguments.initial {
        let (initial, notes) = medial_mesh_for(path, &shape, &arguments.fitting)?.0.with_remarks();
        warnings.extend(notes);
        shape = shape.with_initial(&initial);
    }
    let params = params(&arguments.set)?;
    let start = Start { entry, params, shape: &shape };
    let (run, search) = simplify(arguments, &start, &input, &line)?;
    let mut simplify = describe(arguments, &start, &run);
    let simplified = run.outcome.map_err(|fault| failure(&source, fault))?;
    line.at("checking the topology");
    simplify.warnings.extend(shape.sampling_warning().map(str::to_owned));
    simplify.warnings.extend(topology_warnings(&simplified.mesh, &shape));
    line.at("writing");
    arguments.outputs.write(&simplified, &shape)?;
    drop(line);
    if global.json {
        let mut object = serde_json::to_value(&simplify).map_err(Failure::input)?;
        let extras = &simplified.extras;
        if let Some(search) = &search {
            object["max_error"] = serde_json::to_value(search).map_err(Failure::input)?;
        }
        if let Some(parts) = extras.get::<Vec<PartInfo>>() {
            object["parts"] = in_input_units(parts, &shape).map_err(Failure::input)?;
        }
        if let Some(voxels) = extras.get() {
            object["voxels"] = outputs::describe_voxels(voxels, &shape);
        }
        print_json(&object, &warnings);
    } else {
        print_result(&simplify, search.as_ref(), arguments, global);
        if let Some(parts) = simplified.extras.get::<Vec<PartInfo>>() {
            print_line(&format!("  {}, listed by --json", counted(parts.len() as u64, "part")));
        }
        for warning in simplify.warnings.iter().chain(&warnings) {
            print_line(&format!("  warning: {warning}"));
        }
    }
    Ok(Exit::Done)
}

/// What is to be said where the result, or what it was made from, has not the solid's topology.
fn topology_warnings(result: &MedialMesh, shape: &Shape) -> Vec<String> {
    let expected = shape.expected_betti();
    let Some(own) = topology_warning(complex::betti(result), expected) else { return Vec::new() };
    let initial = shape.initial().ok();
    let start = initial.and_then(|initial| topology_warning(complex::betti(&initial), expected));
    let start = start.map(|start| {
        format!("the initial medial mesh is not right either ({start}); `--sampling auto` adds samples where it fails")
    });
    [Some(format!("the topology is not the solid's: {own}")), start].into_iter().flatten().collect()
}

/// The list of parts with their centres as in the input.
fn in_input_units(parts: &[PartInfo], shape: &Shape) -> serde_json::Result<serde_json::Value> {
    let back = shape.normalisation();
    let carried = |part: &PartInfo| PartInfo {
        centre: back.backward(part.centre.into()).to_array(),
        ..part.clone()
    };
    serde_json::to_value(parts.iter().map(carried).collect::<Vec<_>>())
}

/// What a method starts from.
struct Start<'a> {
    entry: &'a Entry,
    params: Params,
    shape: &'a Shape,
}

impl<'a> Start<'a> {
    /// Begins on a view of the shape.
    fn begin<'v>(
        &self,
        view: &'v Shape,
        run: &RunContext,
    ) -> Result<Box<dyn Simplification + 'v>, SimplifyError> {
        self.entry.method().prepare(view, &self.params, run)
    }

    /// Number of spheres that the method starts from.
    fn spheres(&self) -> Result<usize, SimplifyError> {
        Ok(self.shape.initial()?.spheres.len())
    }
}

/// Runs the method at the level that is asked, or at the one that a search finds.
fn simplify(
    arguments: &Arguments,
    start: &Start<'_>,
    input: &Input,
    line: &StageLine,
) -> Result<(LevelRun, Option<Searched>), Failure> {
    let seed = arguments.substrate.seed();
    let run = RunContext::with_seed(seed).on_progress(line.steps());
    let (level, search) = match (arguments.spheres, arguments.level, arguments.max_error) {
        (Some(count), ..) => (Level::Spheres(count), None),
        (_, Some(value), _) => (Level::Native(value), None),
        (.., Some(bound)) => {
            // The seconds are those of the level found, asked alone.
            let (level, search) = bound::search(arguments, start, input, (bound, line))?;
            (level, Some(search))
        }
        _ => (Level::Published, None),
    };
    line.at(format!("preparing {}", arguments.method));
    let view = start.shape.view();
    let mut runs = answer(
        &view,
        start.entry.method().info(),
        || start.begin(&view, &run),
        &[level],
        |level| {
            line.at(format!("simplifying to {level} by {}", arguments.method));
        },
    );
    let run = runs.pop().ok_or_else(|| Failure::input("no level was run"))?;
    Ok((run, search))
}

fn describe(arguments: &Arguments, start: &Start<'_>, run: &LevelRun) -> Simplify {
    let times = &run.times;
    let mut simplify = Simplify {
        params: start.params.clone(),
        seed: arguments.substrate.seed(),
        substrates: times
            .substrates
            .iter()
            .map(|(substrate, cost)| (substrate.name().to_owned(), cost.seconds))
            .collect(),
        seconds: Some(times.seconds()),
        cpu_seconds: Some(times.cpu_seconds()),
        peak_bytes: Some(times.peak_bytes),
        threads: Some(rayon::current_num_threads()),
        version: version().to_owned(),
        ..Simplify::asked(&arguments.method, run.level, Status::Ok)
    };
    if let Ok(result) = &run.outcome {
        fill_result(&mut simplify, result);
    }
    simplify
}

fn failure_of(input: &Input, fault: Fault) -> Failure {
    failure_named(&input.name, fault)
}

fn failure(source: &Source, fault: Fault) -> Failure {
    failure_named(&source.to_string(), fault)
}

fn failure_named(name: &str, Fault { status, reason }: Fault) -> Failure {
    match status {
        Status::Unsupported => Failure { code: Exit::SomeFailed, message: reason },
        Status::Refused => Failure::usage(reason),
        _ => Failure::input(format!("{name}: {reason}")),
    }
}

fn print_result(
    simplify: &Simplify,
    search: Option<&Searched>,
    arguments: &Arguments,
    global: &Global,
) {
    let seconds = simplify.seconds.unwrap_or_default();
    print_line(&format!(
        "{}: {}, {}, {}; substrates {:.2} s, prepare {:.2} s, simplify {:.2} s",
        simplify.method,
        counted(simplify.spheres.unwrap_or(0) as u64, "sphere"),
        counted(simplify.edges.unwrap_or(0) as u64, "edge"),
        counted(simplify.faces.unwrap_or(0) as u64, "face"),
        seconds.substrate,
        seconds.prepare,
        seconds.simplify
    ));
    if let Some(level) = simplify.native_level {
        print_line(&format!("  native level {level}"));
    }
    if let Some(search) = search {
        print_line(&format!(
            "  Hausdorff error {}{}, the fewest spheres of {} tried",
            if search.certified { "at most " } else { "" },
            percent(search.hausdorff),
            counted(search.tried as u64, "level")
        ));
    }
    let written = arguments.outputs.written();
    written.iter().for_each(|line| print_line(&format!("  {line}")));
    if written.is_empty() {
        note(global, "medial: the result was not written; -o FILE.ma keeps it");
    }
}
