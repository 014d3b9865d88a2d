//! `medial simplify MESH [--method ID] -o x.ma`: one method, one mesh.

use std::path::{Path, PathBuf};

use clap::Args;
use medial::complex;
use medial::complex::MedialMesh;
use medial::metrics::topology_warning;
use medial::shape::Shape;
use medial::simplifier::{MedialSimplifier, Params, RunContext, Simplified};
use medial::surface::Sampling;
use medial_methods::aof;
use medial_methods::aof::LatticeVoxels;
use medial_methods::tam_heidrich::PartInfo;
use medial_reports::{Simplify, Status, Target, file_stem, significant};
use serde_json::json;

use crate::args::{
    Global, MeasureArguments, MeshArgument, SubstrateArguments, key_value, method, params,
};
use crate::exit::{Exit, Failure};
use crate::files::{check_apart, check_extension, check_folder, check_output, left_out, shape_of};
use crate::measure::answer::{Fault, LevelRun, Searched, Single};
use crate::measure::{fill_costs, fill_result};
use crate::output::{counted, print_json, print_line, version};
use crate::progress::StageLine;
use crate::study::external::{AxisOptions, percent, read_axis};
use crate::study::registry::{DEFAULT, Entry, Registry};

/// Arguments of `simplify`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// Run the method with this id; list the ids by `medial methods`
    /// [default with --spheres or --max-error: tight].
    #[arg(long, short, value_name = "ID")]
    method: Option<String>,
    /// Simplify to N spheres.
    #[arg(long, value_name = "N", conflicts_with_all = ["level", "max_error"])]
    spheres: Option<usize>,
    /// Simplify to native level X, in the unit of the method.
    #[arg(long, value_name = "X", conflicts_with = "max_error", allow_negative_numbers = true)]
    level: Option<f64>,
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
    fitting: AxisOptions,
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
    let entry = arguments.entry(registry)?;
    let options = arguments.substrate.shape_options()?;
    // Errors that need no mesh are reported before it is read.
    arguments.outputs.check(entry.method())?;
    let read: Vec<&Path> =
        arguments.initial.iter().map(PathBuf::as_path).chain([&*arguments.mesh]).collect();
    let Outputs { output, voxels } = &arguments.outputs;
    check_apart(output.as_deref(), read.iter().copied().chain(voxels.as_deref()))?;
    check_apart(voxels.as_deref(), read)?;
    let line = StageLine::new(global.stages());
    line.at("reading");
    let (input, mut shape) = shape_of(&arguments.mesh, options)?;
    if arguments.outputs.is_empty() && !global.json {
        let example = format!("{}-{}.ma", file_stem(&input.name), entry.id());
        return Err(Failure::usage(format!(
            "no output: write the result with -o {example}, or print its figures with --json"
        )));
    }
    let repairs = input.report.repairs.iter().map(|repair| format!("repaired: {repair}"));
    let mut warnings: Vec<String> = repairs.chain(input.report.warnings.iter().cloned()).collect();
    if let Some(path) = &arguments.initial {
        let (initial, notes) = read_axis(path, &shape, arguments.fitting)?.0.with_remarks();
        warnings.extend(notes);
        shape = shape.with_initial(&initial);
    }
    let params = params(&arguments.set);
    let (run, search) = arguments.run(entry, &params, &shape, &line);
    let mut simplify = Simplify {
        params,
        seed: arguments.substrate.seed(),
        threads: Some(rayon::current_num_threads()),
        version: version().to_owned(),
        ..Simplify::asked(entry.id(), run.level, Status::Ok)
    };
    fill_costs(&mut simplify, &run.times);
    let simplified = run.outcome.map_err(|fault| arguments.failure(fault))?;
    fill_result(&mut simplify, &simplified);
    line.at("checking the topology");
    simplify.warnings.extend(shape.sampling_warning());
    simplify.warnings.extend(topology_warnings(&simplified.mesh, &shape));
    line.at("writing");
    warnings.extend(arguments.outputs.write(&simplified, &shape)?);
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
            object["voxels"] = describe_voxels(voxels, &shape);
        }
        print_json(&object, &warnings);
    } else {
        print_result(&simplify, search.as_ref(), arguments);
        if let Some(parts) = simplified.extras.get::<Vec<PartInfo>>() {
            print_line(&format!("  {}, listed by --json", counted(parts.len() as u64, "part")));
        }
        for warning in simplify.warnings.iter().chain(&warnings) {
            print_line(&format!("  warning: {warning}"));
        }
    }
    Ok(Exit::Done)
}

/// Warnings for a result, and its initial medial mesh, without the solid's topology.
fn topology_warnings(result: &MedialMesh, shape: &Shape) -> Vec<String> {
    // A list of spheres has no connectivity that could be wrong.
    if result.edges.is_empty() && result.spheres.len() > 1 {
        return Vec::new();
    }
    let expected = shape.expected_betti();
    // The topology of the initial medial mesh takes longer: only for wrong results.
    let Some(own) = topology_warning(complex::betti(result), expected) else { return Vec::new() };
    let initial = shape.initial().ok();
    let start = initial.and_then(|initial| topology_warning(complex::betti(&initial), expected));
    let is_conforming = matches!(shape.options().sampling, Sampling::Conforming { .. });
    let advice = match is_conforming || shape.has_given_initial() {
        true => "",
        false => "; try `--sampling conforming`",
    };
    let start =
        start.map(|start| format!("the initial medial mesh is not right either ({start}){advice}"));
    [Some(format!("the topology differs from the solid's: {own}")), start]
        .into_iter()
        .flatten()
        .collect()
}

/// The list of parts with their centres as in the input.
fn in_input_units(parts: &[PartInfo], shape: &Shape) -> serde_json::Result<serde_json::Value> {
    let back = shape.normalisation();
    let mut parts = parts.to_vec();
    for part in &mut parts {
        part.centre = back.backward(part.centre.into()).to_array();
    }
    serde_json::to_value(parts)
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

    /// Runs the method at the requested level, or at the one that a search finds.
    fn run(
        &self,
        entry: &Entry,
        params: &Params,
        shape: &Shape,
        line: &StageLine,
    ) -> (LevelRun, Option<Searched>) {
        let seed = self.substrate.seed();
        let id = entry.id();
        line.at(format!("preparing {id}"));
        let target = match (self.max_error, self.spheres, self.level) {
            (Some(bound), ..) => Target::MaxError(bound),
            (_, Some(count), _) => Target::Spheres(count),
            (.., Some(value)) => Target::Native(value),
            _ => Target::Published,
        };
        let at = |level| match self.max_error {
            Some(_) => line.at(format!("searching the bound: {level}")),
            None => line.at(format!("simplifying to {level} by {id}")),
        };
        let single = Single {
            shape,
            method: entry.method(),
            sweep: &entry.presentation().sweep,
            params,
            context: &RunContext::with_seed(seed).on_progress(line.steps()),
            judge: self.measure.judge_options(seed),
            certify: self.certify,
            on_level: &at,
        };
        single.run(target)
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

fn print_result(simplify: &Simplify, search: Option<&Searched>, arguments: &Arguments) {
    let seconds = simplify.seconds.unwrap_or_default();
    print_line(&format!(
        "{}{}: {}, {}, {}; substrates {:.2} s, prepare {:.2} s, simplify {:.2} s",
        simplify.method,
        if arguments.method.is_none() { " (default)" } else { "" },
        counted(simplify.spheres.unwrap_or(0) as u64, "sphere"),
        counted(simplify.edges.unwrap_or(0) as u64, "edge"),
        counted(simplify.faces.unwrap_or(0) as u64, "face"),
        seconds.substrate,
        seconds.prepare,
        seconds.simplify
    ));
    if let Some(level) = simplify.native_level {
        print_line(&format!("  native level {}", significant(level, 4)));
    }
    if let Some(search) = search {
        let of = match search.tried {
            1 => String::new(),
            tried => format!(", the fewest spheres of {tried} levels tried"),
        };
        let certified = if search.certified { "at most " } else { "" };
        print_line(&format!("  Hausdorff error {certified}{}{of}", percent(search.hausdorff)));
    }
    arguments.outputs.written().iter().for_each(|line| print_line(&format!("  {line}")));
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

/// Files to write.
#[derive(Debug, Args)]
struct Outputs {
    /// Write the result in the units of the surface: .ma, .ply, .obj, .vtp, .glb; or its spheres: .csv, .json, .yaml
    /// (cuRobo), .xrdf, .urdf, .xml (MuJoCo), .txt, .xyzr.
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Write the voxels with their distance and flux (.csv), for methods on a lattice.
    #[arg(long, value_name = "FILE")]
    voxels: Option<PathBuf>,
}

impl Outputs {
    /// Refuses outputs that the method lacks or that cannot be written, before any computation.
    ///
    /// # Errors
    /// When an extension is unknown, a folder is missing, or the method has no voxels.
    fn check(&self, method: &dyn MedialSimplifier) -> Result<(), Failure> {
        check_output(self.output.as_deref())?;
        let Some(path) = &self.voxels else { return Ok(()) };
        let info = method.info();
        if !info.has_extra(aof::VOXELS) {
            return Err(Failure::usage(format!("--voxels: {} has no voxels", info.id)));
        }
        check_extension(path, &["csv"])?;
        check_folder(path)
    }

    fn is_empty(&self) -> bool {
        self.output.is_none() && self.voxels.is_none()
    }

    /// Writes the requested files. Returns a note on lost parts of the result.
    ///
    /// # Errors
    /// When a file cannot be written.
    fn write(&self, result: &Simplified, shape: &Shape) -> Result<Option<String>, Failure> {
        let mut note = None;
        if let Some(path) = &self.output {
            let back = shape.normalisation();
            let mesh = result.mesh.to_input(back);
            complex::write(path, &mesh).map_err(Failure::input)?;
            note = left_out(path, &mesh);
        }
        if let (Some(path), Some(voxels)) = (&self.voxels, result.extras.get::<LatticeVoxels>()) {
            write_voxels(path, voxels, shape)?;
        }
        Ok(note)
    }

    /// A line for each written file.
    fn written(&self) -> Vec<String> {
        let files = [(&self.output, ""), (&self.voxels, ", a point for each voxel")];
        let written = files.into_iter().filter_map(|(path, what)| {
            path.as_ref().map(|path| format!("written: {}{what}", path.display()))
        });
        written.collect()
    }
}

/// Writes a line for each voxel: its centre and distance in the units of the surface, its flux, and
/// its indices in the lattice.
fn write_voxels(path: &Path, voxels: &LatticeVoxels, shape: &Shape) -> Result<(), Failure> {
    let back = shape.normalisation();
    medial::write_atomically(path, |out| {
        writeln!(out, "x,y,z,distance,flux,i,j,k")?;
        for voxel in &voxels.voxels {
            let [x, y, z] = back.backward(voxels.grid.centre(voxel.place)).to_array();
            let [distance, flux] = [voxel.distance, voxel.flux].map(f64::from);
            let ([i, j, k], distance) = (voxel.place, distance * back.diagonal);
            writeln!(out, "{x},{y},{z},{distance},{flux},{i},{j},{k}")?;
        }
        Ok(())
    })
    .map_err(|error| Failure::at(path, error))
}

/// The lattice of the voxels, for the JSON of the result.
fn describe_voxels(voxels: &LatticeVoxels, shape: &Shape) -> serde_json::Value {
    let back = shape.normalisation();
    json!({
        "count": voxels.voxels.len(),
        "origin": back.backward(voxels.grid.origin).to_array(),
        "side": voxels.grid.side * back.diagonal,
        "size": voxels.grid.size,
        "betti": voxels.betti(),
    })
}
