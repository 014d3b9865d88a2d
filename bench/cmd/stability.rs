//! `medial stability [MESH ...]`: methods on noisy surfaces, measured against the clean ones.
//!
//! 1. On the clean surface each method gives its results at the asked numbers of spheres.
//! 2. Each vertex is displaced at random ([`medial_datasets::add_noise`]), for every level and seed;
//!    the method runs on the noisy surface as on any other.
//! 3. The noisy result is carried into the clean surface's unit and measured against the clean surface, its
//!    known axis where it has one, and the method's own clean result.

use std::path::{Path, PathBuf};

use clap::Args;
use medial::complex::{self, MedialMesh};
use medial::metrics::{AxisOptions, Judge, JudgeOptions, axis_distance};
use medial::shape::Shape;
use medial::simplifier::{MedialSimplifier, Params};
use medial::surface::{self, Normalisation};
use medial_reports::{
    AxisShift, Header, Initial, NoiseRecord, Record, STABILITY, write_lines, write_records,
    write_report,
};
use serde_json::json;

use super::compare::{RESULTS, methods, sphere_levels};
use super::report::{rebuild, today};
use crate::args::{
    Global, MeasureArguments, MeshArgument, SubstrateArguments, judge_options, shape_options,
};
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line};
use crate::run::{
    Input, Item, Measure, Progress, Provenance, RunOptions, Source, refused_records, run_item,
};

/// Arguments of `stability`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface files (OFF, OBJ, PLY, STL) or `builtin:ID[:RESOLUTION]` [default: all built-in shapes].
    meshes: Vec<MeshArgument>,
    /// Methods, separated by commas [default: all].
    #[arg(long, value_name = "IDS", value_delimiter = ',')]
    methods: Vec<String>,
    /// Sphere counts, separated by commas.
    #[arg(long, value_name = "COUNTS", value_delimiter = ',', default_values_t = [500, 100])]
    spheres: Vec<usize>,
    /// Levels of noise, separated by commas: the largest displacement of a vertex, as a fraction of
    /// the diagonal.
    #[arg(
        long,
        value_name = "LEVELS",
        value_delimiter = ',',
        default_values_t = [0.001, 0.0025, 0.005, 0.01, 0.02]
    )]
    noise: Vec<f64>,
    /// Random versions of each surface at each level.
    #[arg(long, value_name = "N", default_value_t = 3)]
    noise_seeds: u64,
    /// Folder of the results; a report that is there already gets a section on stability.
    #[arg(long, value_name = "DIR", default_value = "medial-report")]
    out: PathBuf,
    #[command(flatten)]
    substrate: SubstrateArguments,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// Folder of the medial meshes below that of the results.
const FOLDER: &str = "stability";

/// More random versions of each surface would not end.
const MOST_SEEDS: u64 = 10_000;

/// What is the same for all meshes.
struct Study {
    methods: Vec<Box<dyn MedialSimplifier>>,
    items: Vec<Item>,
    judge: JudgeOptions,
    options: RunOptions,
    provenance: Provenance,
}

/// A mesh without noise, and what noisy results are measured against.
struct Clean<'a> {
    input: &'a Input,
    shape: &'a Shape,
    judge: &'a Judge,
    /// Spheres of the initial medial mesh.
    initial: Option<u64>,
    /// By item and level.
    results: Vec<Vec<Option<MedialMesh>>>,
}

/// Runs the verb.
///
/// # Errors
/// When the command line is wrong, a mesh is refused, or the results cannot be written. A noisy
/// surface that is refused and a method that fails are rows of the results.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let sources = match arguments.meshes.as_slice() {
        [] => Source::built_ins(),
        named => named
            .iter()
            .map(|mesh| Source::parse(mesh).map_err(Failure::usage))
            .collect::<Result<_, _>>()?,
    };
    let study = study(arguments)?;
    std::fs::create_dir_all(&arguments.out)
        .map_err(|error| Failure::input(format!("{}: {error}", arguments.out.display())))?;
    let versions = 1 + arguments.noise.len() * arguments.noise_seeds as usize;
    let mut progress = Progress::new(global.quiet, sources.len() * versions * study.methods.len());
    let mut all = Vec::new();
    for source in &sources {
        let input = Input::load(source)?;
        let substrate = shape_options(&arguments.substrate)?;
        let shape = input.shape(substrate.clone()).map_err(|error| Failure::of(source, error))?;
        let judge = shape
            .judge(input.axis.as_ref(), study.judge)
            .map_err(|error| Failure::of(source, error))?;
        let mut clean =
            Clean { input: &input, shape: &shape, judge: &judge, initial: None, results: vec![] };
        run_clean(&study, &mut clean, &mut all, &mut progress);
        for &noise in &arguments.noise {
            for seed in 1..=arguments.noise_seeds {
                progress.at(&format!("{}: noise {noise}, seed {seed}", input.name));
                let noisy = noisy_input(&input, noise, seed);
                let noisy = noisy.and_then(|noisy| {
                    let shape = noisy.shape(substrate.clone()).map_err(|e| e.to_string())?;
                    Ok((noisy, shape))
                });
                run_noisy(&study, &clean, (noise, seed), noisy, &mut all, &mut progress);
            }
        }
    }
    drop(progress);
    write_lines(&arguments.out.join(STABILITY), &all).map_err(Failure::input)?;
    report(arguments, &study, &all)?;
    finish(arguments, global, &all)
}

fn study(arguments: &Arguments) -> Result<Study, Failure> {
    let methods = methods(&arguments.methods)?;
    let levels = sphere_levels(&arguments.spheres)?;
    if let Some(noise) = arguments.noise.iter().find(|&&noise| !(noise > 0.0 && noise <= 1.0)) {
        return Err(Failure::usage(format!("--noise {noise}: a fraction above 0, at most 1")));
    }
    if !(1..=MOST_SEEDS).contains(&arguments.noise_seeds) {
        let seeds = arguments.noise_seeds;
        let message = format!("--noise-seeds {seeds}: ask for at least one, at most {MOST_SEEDS}");
        return Err(Failure::usage(message));
    }
    let item = |method: &dyn MedialSimplifier| Item {
        method: method.info().id.to_owned(),
        params: Params::none(),
        levels: levels.clone(),
    };
    let seed = arguments.substrate.seed;
    let quick = JudgeOptions { samples: 10_000, volume_depth: 5, seed: 0 };
    Ok(Study {
        items: methods.iter().map(|method| item(method.as_ref())).collect(),
        methods,
        judge: judge_options(&arguments.measure, quick, seed)?,
        options: RunOptions { seed, repeat: 1, out: Some(arguments.out.join(FOLDER)) },
        provenance: Provenance::here(),
    })
}

fn initial_of(shape: &Shape) -> Option<Initial> {
    shape.view().initial().ok().map(|mesh| Initial::of(&mesh, shape.expected_betti()))
}

fn run_clean(
    study: &Study,
    clean: &mut Clean<'_>,
    all: &mut Vec<NoiseRecord>,
    progress: &mut Progress,
) {
    let initial = initial_of(clean.shape);
    clean.initial = initial.map(|initial| initial.spheres);
    let measure = Measure { input: clean.input, shape: clean.shape, judge: clean.judge, initial };
    for (method, item) in study.methods.iter().zip(&study.items) {
        progress.at(&format!("{}: {}", clean.input.name, item.method));
        let records = run_item(method.as_ref(), item, &measure, &study.options, &study.provenance);
        let normal = clean.shape.normalisation();
        clean.results.push(records.iter().map(|record| saved(study, record, normal)).collect());
        all.extend(records.into_iter().map(|record| NoiseRecord {
            noise: 0.0,
            noise_seed: 0,
            growth: clean.initial.map(|_| 1.0),
            shift: None,
            record: placed(record),
        }));
        progress.done();
    }
}

/// The noisy surface, or why it does not bound a solid.
fn noisy_input(clean: &Input, noise: f64, seed: u64) -> Result<Input, String> {
    let mesh = medial_datasets::add_noise(&clean.mesh, noise, seed);
    let report = surface::validate(&mesh).map_err(|error| error.to_string())?;
    let mut input = Input {
        name: format!("{}-noise-{noise}-seed-{seed}", clean.name),
        dataset: clean.dataset.clone(),
        hash: String::new(),
        mesh,
        report,
        axis: None,
    };
    input.hash = input.surface_hash();
    Ok(input)
}

fn run_noisy(
    study: &Study,
    clean: &Clean<'_>,
    (noise, noise_seed): (f64, u64),
    noisy: Result<(Input, Shape), String>,
    all: &mut Vec<NoiseRecord>,
    progress: &mut Progress,
) {
    // Only the measures against the clean surface count; those against the noisy one are made as
    // cheap as can be.
    let cheap = JudgeOptions { samples: 1, volume_depth: 0, seed: 0 };
    let ready = noisy.and_then(|(input, shape)| {
        let judge = shape.judge(None, cheap).map_err(|error| error.to_string())?;
        Ok((input, shape, judge))
    });
    let initial = ready.as_ref().ok().and_then(|(_, shape, _)| initial_of(shape));
    let spheres = initial.map(|initial| initial.spheres);
    let growth = spheres.zip(clean.initial).map(|(noisy, clean)| noisy as f64 / clean as f64);
    for (index, (method, item)) in study.methods.iter().zip(&study.items).enumerate() {
        let records = match &ready {
            Ok((input, shape, judge)) => {
                let measure = Measure { input, shape, judge, initial };
                run_item(method.as_ref(), item, &measure, &study.options, &study.provenance)
            }
            Err(reason) => refused_records(&clean.input.name, item, reason, &study.provenance),
        };
        for (level, record) in records.into_iter().enumerate() {
            let reference = clean.results[index][level].as_ref();
            let (record, shift) = against_clean(study, clean, record, reference);
            all.push(NoiseRecord { noise, noise_seed, growth, shift, record });
        }
        progress.done();
    }
}

/// A record of a noisy run with its measures against the clean surface, and its distances to the
/// clean result.
fn against_clean(
    study: &Study,
    clean: &Clean<'_>,
    mut record: Record,
    reference: Option<&MedialMesh>,
) -> (Record, Option<AxisShift>) {
    record.mesh.clone_from(&clean.input.name);
    record.mesh_hash = Some(clean.input.hash.clone());
    record.evaluate = None;
    let Some(mesh) = saved(study, &record, clean.shape.normalisation()) else {
        return (placed(record), None);
    };
    match clean.judge.evaluate(&mesh) {
        Ok(evaluation) => record.evaluate = Some(evaluation),
        Err(error) => record.simplify.warnings.push(format!("not measured: {error}")),
    }
    let options = AxisOptions { samples: study.judge.samples, seed: study.judge.seed };
    let shift = reference.and_then(|clean| axis_distance(&mesh, clean, &options).ok());
    (placed(record), shift.map(|s| AxisShift { in_space: s.in_space, with_radius: s.with_radius }))
}

/// The result of a record, in the unit of the clean surface.
fn saved(study: &Study, record: &Record, normal: &Normalisation) -> Option<MedialMesh> {
    let path = study.options.out.as_deref()?.join(record.artifact.as_deref()?);
    let mesh = complex::read(path).ok()?.mesh;
    Some(mesh.transformed(1.0 / normal.diagonal, |p| normal.forward(p)))
}

/// The record with the path of its medial mesh from the folder of the results.
fn placed(mut record: Record) -> Record {
    record.artifact = record.artifact.map(|path| format!("{FOLDER}/{path}"));
    record
}

/// Adds the section to the report that is there, or writes one of the clean runs.
fn report(arguments: &Arguments, study: &Study, all: &[NoiseRecord]) -> Result<(), Failure> {
    let out: &Path = &arguments.out;
    if out.join(RESULTS).exists() {
        return rebuild(out).map(|_| ());
    }
    let clean = all.iter().filter(|noisy| noisy.noise == 0.0);
    let clean: Vec<Record> = clean.map(|noisy| noisy.record.clone()).collect();
    write_records(&out.join(RESULTS), &clean).map_err(Failure::input)?;
    let header = Header {
        title: "Medial axis simplification: stability under noise".into(),
        command: study.provenance.command.clone(),
        version: study.provenance.version.clone(),
        date: Some(today()),
        machine: Some(study.provenance.machine.clone()),
        methods: study.methods.iter().map(|method| method.info().into()).collect(),
        notes: vec![],
    };
    write_report(out, &clean, &header).map(|_| ()).map_err(Failure::input)
}

fn finish(arguments: &Arguments, global: &Global, all: &[NoiseRecord]) -> Result<Exit, Failure> {
    let measured = all.iter().filter(|noisy| noisy.record.evaluate.is_some()).count();
    let page = arguments.out.join("index.html");
    if global.json {
        let records = arguments.out.join(STABILITY);
        let object = json!({
            "records": all.len(), "measured": measured, "results": records, "page": page,
        });
        print_json(&object, &[]);
    } else {
        let total = all.len();
        print_line(&format!("{measured} of {total} results measured; page: {}", page.display()));
    }
    Ok(match measured {
        0 => Exit::NothingMeasured,
        _ if measured < all.len() => Exit::SomeFailed,
        _ => Exit::Done,
    })
}
