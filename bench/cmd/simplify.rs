//! `medial simplify MESH --method ID -o x.ma`: one method, one mesh.

use std::path::PathBuf;

use clap::Args;
use medial::complex;
use medial::metrics::JudgeOptions;
use medial::shape::Shape;
use medial::simplifier::{
    Level, MedialSimplifier, Params, PartInfo, RunContext, Simplification, Simplified,
    SimplifyError, Work,
};
use medial_reports::{Simplify, Stages, Status};
use serde::Serialize;

use super::hierarchy::{self, Loaded, Origin};
use super::methods::unknown_method;
use super::{
    Exit, Failure, check_folder, check_output, counted, judge_options, medial_mesh_for, note,
    params, percent, print_json, print_line, shape_options, voxels,
};
use crate::cli::{Global, MeasureArguments, MeshArgument, SubstrateArguments};
use crate::run::{Input, Lap, Source, StageLine, Stopwatch, peak_bytes, search_error};

/// What a search over sphere counts found, for the answer to `--max-error`.
#[derive(Debug, Serialize)]
struct Search {
    /// The bound, a fraction of the diagonal.
    bound: f64,
    /// The error of the result.
    hausdorff: f64,
    /// Number of sphere counts that were tried.
    tried: usize,
}

/// Arguments of `simplify`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL), or `builtin:ID[:RESOLUTION]`.
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
    /// Set a parameter of the method; can be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Start from this medial mesh instead of the Voronoi one.
    #[arg(long, value_name = "Y.ma")]
    initial: Option<PathBuf>,
    /// The result (.ma, .ply, .obj), in the units of the surface.
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Write all levels into a file, for `--hierarchy`; for methods that have them.
    #[arg(long, value_name = "FILE")]
    save_hierarchy: Option<PathBuf>,
    /// Take the level from such a file, made from the same mesh by the same method, instead of
    /// computing it.
    #[arg(long, value_name = "FILE")]
    hierarchy: Option<PathBuf>,
    /// Write the voxels with their distance and flux (.ply, .npy, .csv), for methods on a lattice.
    #[arg(long, value_name = "FILE")]
    voxels: Option<PathBuf>,
    #[command(flatten)]
    substrate: SubstrateArguments,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// Runs the verb.
///
/// # Errors
/// When the input is refused, the level is not met at all, or the output cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let source = Source::parse(&arguments.mesh).map_err(Failure::usage)?;
    let method =
        medial_methods::find(&arguments.method).ok_or_else(|| unknown_method(&arguments.method))?;
    let options = shape_options(&arguments.substrate)?;
    check_output(arguments.output.as_deref())?;
    check_bound(arguments)?;
    check_hierarchy(arguments, method.as_ref())?;
    check_voxels(arguments, method.as_ref())?;
    let line = StageLine::new(global.quiet || global.json);
    line.at("reading");
    let input = Input::load(&source)?;
    let mut shape = input.shape(options).map_err(|error| Failure::of(&source, error))?;
    let mut warnings = input.report.warnings.clone();
    if let Some(path) = &arguments.initial {
        let (initial, notes) = medial_mesh_for(path, &shape)?.with_remarks();
        warnings.extend(notes);
        shape = shape.with_initial(&initial);
    }
    let params = params(&arguments.set)?;
    let given = arguments.initial.is_some();
    let origin = Origin::new(&arguments.method, &params, &input, &shape, given);
    let loaded = arguments.hierarchy.as_deref();
    let loaded = loaded.map(|path| hierarchy::load(path, &origin, &shape)).transpose()?;
    let start = Start { method: method.as_ref(), params, shape: &shape, loaded };
    let (simplified, simplify, search) =
        simplify(arguments, &start, &input, &line).map_err(|error| match error {
            Error::Method(error) => failure(&source, error),
            Error::Other(failure) => failure,
        })?;
    line.at("writing");
    simplified.mesh.check().map_err(|error| Failure::of(&source, error))?;
    if simplified.mesh.spheres.is_empty() {
        return Err(Failure::of(&source, nothing_left(&simplified)));
    }
    if let Some(output) = &arguments.output {
        let back = shape.normalisation();
        let mesh = simplified.mesh.transformed(back.diagonal, |p| back.backward(p));
        complex::write(output, &mesh).map_err(Failure::input)?;
    }
    if let (Some(path), Some(all)) = (&arguments.save_hierarchy, &simplified.extras.hierarchy) {
        hierarchy::save(path, all, &origin)?;
    }
    let voxels = simplified.extras.voxels.as_deref();
    if let (Some(path), Some(voxels)) = (&arguments.voxels, voxels) {
        voxels::write(path, voxels, &shape)?;
    }
    drop(line);
    if global.json {
        let mut object = serde_json::to_value(&simplify).map_err(Failure::input)?;
        if let Some(search) = &search {
            object["max_error"] = serde_json::to_value(search).map_err(Failure::input)?;
        }
        if let Some(parts) = &simplified.extras.parts {
            object["parts"] = in_input_units(parts, &shape).map_err(Failure::input)?;
        }
        if let Some(voxels) = voxels {
            object["voxels"] = voxels::describe(voxels, &shape);
        }
        print_json(&object, &warnings);
    } else {
        print_result(&simplify, search.as_ref(), arguments, global);
        if let Some(parts) = &simplified.extras.parts {
            print_line(&format!("  {}, listed by --json", counted(parts.len() as u64, "part")));
        }
        for warning in simplify.warnings.iter().chain(&warnings) {
            print_line(&format!("  warning: {warning}"));
        }
    }
    Ok(Exit::Done)
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

/// A method that does not answer, or anything else that went wrong.
enum Error {
    Method(SimplifyError),
    Other(Failure),
}

impl From<SimplifyError> for Error {
    fn from(error: SimplifyError) -> Self {
        Self::Method(error)
    }
}

impl From<Failure> for Error {
    fn from(failure: Failure) -> Self {
        Self::Other(failure)
    }
}

fn check_bound(arguments: &Arguments) -> Result<(), Failure> {
    match arguments.max_error {
        Some(bound) if !(bound.is_finite() && bound > 0.0) => {
            let message = format!("--max-error {bound}: a positive fraction of the diagonal");
            Err(Failure::usage(message))
        }
        // The whole solid is within one diagonal of anything inside it.
        Some(bound) if bound >= 1.0 => Err(Failure::usage(format!(
            "--max-error {bound}: a fraction of the diagonal is meant, and this is {} % of it; \
             write {} for {bound} %",
            100.0 * bound,
            bound / 100.0
        ))),
        Some(_) => judge_options(&arguments.measure, JudgeOptions::default(), 0).map(|_| ()),
        None => Ok(()),
    }
}

/// Why a result has no sphere. That is no success: there is nothing to write.
fn nothing_left(simplified: &Simplified) -> String {
    let why = simplified.diagnostics.warnings.join("; ");
    format!("the result has no sphere ({why}); ask for a finer level")
}

/// What a method starts from.
struct Start<'a> {
    method: &'a dyn MedialSimplifier,
    params: Params,
    shape: &'a Shape,
    loaded: Option<Loaded>,
}

impl<'a> Start<'a> {
    fn simplification(&self, run: &RunContext) -> Result<Box<dyn Simplification + 'a>, Error> {
        let Self { method, params, shape, loaded } = self;
        match loaded {
            Some(loaded) => Ok(loaded.resume(*method, params)?),
            None => Ok(method.prepare(shape, params, run)?),
        }
    }

    /// Number of spheres that the method starts from.
    fn spheres(&self) -> Result<usize, SimplifyError> {
        Ok(match &self.loaded {
            Some(loaded) => loaded.hierarchy.initial().spheres.len(),
            None => self.shape.initial()?.spheres.len(),
        })
    }
}

fn check_hierarchy(arguments: &Arguments, method: &dyn MedialSimplifier) -> Result<(), Failure> {
    let asked =
        [("--hierarchy", &arguments.hierarchy), ("--save-hierarchy", &arguments.save_hierarchy)];
    if let Some((option, _)) = asked.iter().find(|(_, path)| path.is_some())
        && !method.has_hierarchy()
    {
        let id = method.info().id;
        return Err(Failure::usage(format!("{option}: {id} has no hierarchy of levels")));
    }
    arguments.save_hierarchy.as_deref().map_or(Ok(()), check_folder)
}

fn check_voxels(arguments: &Arguments, method: &dyn MedialSimplifier) -> Result<(), Failure> {
    let Some(path) = &arguments.voxels else { return Ok(()) };
    if !method.has_voxels() {
        let id = method.info().id;
        return Err(Failure::usage(format!("--voxels: {id} has no voxels")));
    }
    voxels::check(path)
}

fn simplify(
    arguments: &Arguments,
    start: &Start<'_>,
    input: &Input,
    line: &StageLine,
) -> Result<(Simplified, Simplify, Option<Search>), Error> {
    let Start { shape, loaded, .. } = start;
    let seed = arguments.substrate.seed;
    let run = RunContext::with_seed(seed).on_progress(line.steps());
    line.at(format!("preparing {}", arguments.method));
    let (prepared, mut prepare) = Stopwatch::time(|| start.simplification(&run));
    let mut simplification = prepared?;
    let spent = shape.spent();
    prepare.seconds = (prepare.seconds - spent.seconds).max(0.0);
    prepare.cpu_seconds = (prepare.cpu_seconds - spent.cpu_seconds).max(0.0);
    if let Some(loaded) = loaded {
        prepare += loaded.read;
    }
    line.at(format!("simplifying by {}", arguments.method));
    let mut search = None;
    let (answer, lap) = if let Some(bound) = arguments.max_error {
        let options = judge_options(&arguments.measure, JudgeOptions::default(), seed)?;
        let judge = shape.judge(input.axis.as_ref(), options).map_err(SimplifyError::from)?;
        let found =
            search_error(simplification.as_mut(), &judge, start.spheres()?, bound, |count| {
                line.at(format!("searching the bound: {count} spheres"));
            })?;
        search = Some(Search { bound, hausdorff: found.hausdorff, tried: found.tried });
        // The seconds are those of the level found, asked alone.
        let count = found.simplified.mesh.spheres.len();
        line.at(format!("timing {count} spheres alone"));
        let mut alone = start.simplification(&run)?;
        Stopwatch::time(|| alone.at(Level::Spheres(count)))
    } else {
        let level = match (arguments.spheres, arguments.level) {
            (Some(count), _) => Level::Spheres(count),
            (None, Some(value)) => Level::Native(value),
            (None, None) => Level::Published,
        };
        Stopwatch::time(|| simplification.at(level))
    };
    let simplified = answer?;
    debug_assert!(simplified.work == Work::Anew || lap.seconds >= 0.0);
    let mut record = describe(arguments, shape, &simplified, prepare, lap);
    record.params.clone_from(&start.params);
    Ok((simplified, record, search))
}

fn describe(
    arguments: &Arguments,
    shape: &Shape,
    simplified: &Simplified,
    prepare: Lap,
    lap: Lap,
) -> Simplify {
    let used = shape.used();
    // From +0: the sum of nothing is -0 otherwise, and prints so.
    let sum = |part: fn(&medial::shape::Cost) -> f64| {
        used.iter().fold(0.0, |sum, (_, cost)| sum + part(cost))
    };
    let mesh = &simplified.mesh;
    Simplify {
        seed: arguments.substrate.seed,
        reached: Some(mesh.spheres.len()),
        native_level: simplified.native_level,
        spheres: Some(mesh.spheres.len()),
        edges: Some(mesh.edges.len()),
        faces: Some(mesh.faces.len()),
        substrates: used.iter().map(|(s, cost)| (s.name().to_owned(), cost.seconds)).collect(),
        seconds: Some(Stages::new(sum(|c| c.seconds), prepare.seconds, lap.seconds)),
        cpu_seconds: Some(Stages::new(
            sum(|c| c.cpu_seconds),
            prepare.cpu_seconds,
            lap.cpu_seconds,
        )),
        peak_bytes: peak_bytes(),
        threads: Some(rayon::current_num_threads()),
        diagnostics: simplified.diagnostics.counts.iter().cloned().collect(),
        warnings: simplified.diagnostics.warnings.clone(),
        version: super::version().to_owned(),
        ..Simplify::asked(&arguments.method, simplified.asked, Status::Ok)
    }
}

fn failure(source: &Source, error: SimplifyError) -> Failure {
    match error {
        SimplifyError::Unsupported { .. } => {
            Failure { code: Exit::SomeFailed, message: error.to_string() }
        }
        SimplifyError::Parameter(_) | SimplifyError::Level(_) => Failure::usage(error),
        _ => Failure::of(source, error),
    }
}

fn print_result(
    simplify: &Simplify,
    search: Option<&Search>,
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
            "  Hausdorff error {}, the fewest of {} tried",
            percent(search.hausdorff),
            counted(search.tried as u64, "count")
        ));
    }
    if let Some(output) = &arguments.output {
        print_line(&format!("  written: {}", output.display()));
    }
    if let Some(path) = &arguments.save_hierarchy {
        print_line(&format!("  written: {} with all levels", path.display()));
    }
    if let Some(path) = &arguments.voxels {
        print_line(&format!("  written: {}, a point for each voxel", path.display()));
    }
    let outputs = [&arguments.output, &arguments.save_hierarchy, &arguments.voxels];
    if outputs.iter().all(|output| output.is_none()) {
        note(global, "medial: the result was not written; -o FILE.ma keeps it");
    }
}
