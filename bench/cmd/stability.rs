//! `medial stability [MESH ...]`: methods on noisy surfaces, measured against the clean ones.
//!
//! 1. On the clean surface each method gives its results at the asked numbers of spheres.
//! 2. Each vertex is displaced at random ([`medial_datasets::add_noise`]), for every level and seed;
//!    the method runs on the noisy surface as on any other.
//! 3. The noisy result is carried into the clean surface's unit and measured against the clean surface, its
//!    known axis where it has one, and the method's own clean result.
//!
//! Each of these is an item like those of `compare`, with noise: of 0 for the clean surface.

use std::path::PathBuf;

use clap::Args;
use medial_reports::{NoiseRecord, Record, STABILITY, read_lines, write_records};
use serde_json::json;

use super::report::{Rebuilt, rebuild};
use crate::args::{Global, MeasureArguments, MeshArgument, SubstrateArguments};
use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::output::{note, print_error, print_json, print_line};
use crate::run::{
    Here, Item, Kept, Noise, PlanError, Progress, Provenance, RESULTS, Registry, RunError, Store,
    Study, StudyMethod, Supervisor, missing, run_items,
};

/// Arguments of `stability`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface files (OFF, OBJ, PLY, STL, GLB), `builtin:ID[:RESOLUTION]` or `dataset:NAME` [default: the built-in shapes that
    /// `datasets list` says].
    meshes: Vec<MeshArgument>,
    /// Methods, separated by commas, each with parameters of its own if wanted [default: all but those that run on request].
    #[arg(long, value_name = "ID[:KEY=VALUE]", value_delimiter = ',')]
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
    /// Folder of the results; a report that is there already gets a section on stability. What is
    /// there is not run again.
    #[arg(long, value_name = "DIR", default_value = "medial-report")]
    out: PathBuf,
    /// Run again what failed.
    #[arg(long)]
    retry_failed: bool,
    #[command(flatten)]
    substrate: SubstrateArguments,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// Folder of the medial meshes below that of the results.
const FOLDER: &str = "stability";

/// More random versions of each surface would not end.
const MOST_SEEDS: u64 = 10_000;

/// Runs the verb.
///
/// # Errors
/// When the command line is wrong, an input does not exist, or the results cannot be written. A
/// surface that is refused and a method that fails are rows of the results.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let provenance = Provenance::here();
    let items = items(arguments, global, registry, &Here::of(&provenance))?;
    let mut store = Store::open(&arguments.out, STABILITY, &provenance.command)?;
    store.remarks.iter().for_each(|remark| note(global, remark));
    let (left, _) = missing(&items, &store, arguments.retry_failed.into());
    let mut progress = Progress::new(global.progress(), left.len());
    let axes = Some(arguments.out.join(FOLDER));
    let interrupted = interrupt::listen();
    let mut supervisor = Supervisor::new(registry.files(), &provenance, axes, interrupted);
    let ended = run_items(&left, &mut supervisor, &mut progress, &mut |item, kept: &[Kept]| {
        let records: Vec<NoiseRecord> = kept.iter().map(|kept| noise_record(item, kept)).collect();
        store.keep(&records)
    });
    drop(progress);
    match ended {
        Err(PlanError::Run(RunError::Interrupted)) => {
            print_error("interrupted: what was made is kept; the same command goes on from there");
            return Ok(Exit::Interrupted);
        }
        ended => ended?,
    }
    let all: Vec<NoiseRecord> =
        read_lines(&arguments.out.join(STABILITY)).map_err(Failure::input)?;
    report(arguments, registry, &all)?;
    finish(arguments, global, &items, &all)
}

/// The items of the clean surface and of each noisy one, mesh by mesh.
fn items(
    arguments: &Arguments,
    global: &Global,
    registry: &Registry,
    here: &Here,
) -> Result<Vec<Item>, Failure> {
    if let Some(noise) = arguments.noise.iter().find(|&&noise| !(noise > 0.0 && noise <= 1.0)) {
        return Err(Failure::usage(format!("--noise {noise}: a fraction above 0, at most 1")));
    }
    if !(1..=MOST_SEEDS).contains(&arguments.noise_seeds) {
        let seeds = arguments.noise_seeds;
        let message = format!("--noise-seeds {seeds}: ask for at least one, at most {MOST_SEEDS}");
        return Err(Failure::usage(message));
    }
    let methods = arguments.methods.iter().map(|text| StudyMethod::parse(text));
    let mut study = Study {
        meshes: arguments.meshes.clone(),
        spheres: arguments.spheres.clone(),
        methods: methods.collect::<Result<_, _>>()?,
        counts_only: true,
        threads: global.threads,
        ..Study::default()
    };
    arguments.substrate.apply(&mut study)?;
    arguments.measure.apply(&mut study)?;
    let clean = study.items(registry, here)?;
    let versions: Vec<Noise> = arguments
        .noise
        .iter()
        .flat_map(|&eta| (1..=arguments.noise_seeds).map(move |seed| Noise { eta, seed }))
        .collect();
    let with = |items: &[Item], noise: Noise| -> Vec<Item> {
        let mut items = items.to_vec();
        items.iter_mut().for_each(|item| item.scene.noise = Some(noise));
        items
    };
    // All versions of a mesh follow each other, so that a worker has its clean results at hand.
    let of_mesh = |items: &[Item]| -> Vec<Item> {
        let all = [Noise { eta: 0.0, seed: 0 }].into_iter().chain(versions.iter().copied());
        all.flat_map(|noise| with(items, noise)).collect()
    };
    Ok(clean.chunk_by(|a, b| a.scene == b.scene).flat_map(of_mesh).collect())
}

fn noise_record(item: &Item, kept: &Kept) -> NoiseRecord {
    let Noise { eta, seed } = item.scene.noise.unwrap_or(Noise { eta: 0.0, seed: 0 });
    let part = kept.noise.as_ref();
    NoiseRecord {
        noise: eta,
        noise_seed: seed,
        growth: part.and_then(|part| part.growth),
        shift: part.and_then(|part| part.shift),
        record: kept.record.clone(),
    }
}

/// Adds the section to the report that is there, or writes one of the clean runs.
fn report(
    arguments: &Arguments,
    registry: &Registry,
    all: &[NoiseRecord],
) -> Result<Rebuilt, Failure> {
    let results = arguments.out.join(RESULTS);
    if !results.exists() {
        let clean = all.iter().filter(|noisy| noisy.noise == 0.0);
        let clean: Vec<Record> = clean.map(|noisy| noisy.record.clone()).collect();
        write_records(&results, &clean).map_err(Failure::input)?;
    }
    rebuild(&arguments.out, registry)
}

fn finish(
    arguments: &Arguments,
    global: &Global,
    items: &[Item],
    all: &[NoiseRecord],
) -> Result<Exit, Failure> {
    let keys: std::collections::HashSet<String> = items.iter().flat_map(Item::keys).collect();
    // The last record of a key counts.
    let asked: std::collections::BTreeMap<&str, &NoiseRecord> = all
        .iter()
        .filter(|noisy| keys.contains(&noisy.record.key))
        .map(|noisy| (noisy.record.key.as_str(), noisy))
        .collect();
    let measured = asked.values().filter(|noisy| noisy.record.evaluate.is_some()).count();
    let (total, page) = (asked.len(), arguments.out.join("index.html"));
    if global.json {
        let records = arguments.out.join(STABILITY);
        let object = json!({
            "records": total, "measured": measured, "results": records, "page": page,
        });
        print_json(&object, &[]);
    } else {
        print_line(&format!("{measured} of {total} results measured; page: {}", page.display()));
    }
    Ok(match measured {
        0 => Exit::NothingMeasured,
        _ if measured < total => Exit::SomeFailed,
        _ => Exit::Done,
    })
}
