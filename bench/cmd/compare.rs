//! `medial compare [MESH ...]`: the main job. Methods x meshes x levels, measured and reported.

use std::collections::HashSet;
use std::path::PathBuf;

use clap::Args;
use medial_reports::reasons;
use medial_run::input::Source;
use medial_run::item::{GIVEN, Item};
use medial_run::record::{Record, Status};
use serde_json::json;

use crate::args::{Global, MeasureArguments, MeshArgument, SubstrateArguments, whole};
use crate::exec::Supervisor;
use crate::exec::queue::{Contender, count, missing, refused_params, run_items};
use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::output::{note, print_error, print_json, print_line};
use crate::provenance::provenance;
use crate::rebuild::{Rebuilt, STUDY, of_items, report_of_run, write_study};
use crate::store::{AXES, PAGE, RESULTS, Store};
use crate::study::edition::{Edition, Mixed};
use crate::study::external::ExternalResult;
use crate::study::registry::{INITIAL, Registry};
use crate::study::{Study, StudyMethod, shard, unique_names};

#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface files (OFF, OBJ, PLY, STL), `builtin:ID[:RESOLUTION]` or `dataset:NAME`
    /// [default: `builtin:bracket`, `builtin:torus` and `builtin:blob`].
    meshes: Vec<MeshArgument>,
    /// Add a set of meshes: `builtin`, `public`, `defective`, `small`, `papers`, a package such as
    /// `deb:libcgal-demo`, or the name of one mesh; repeatable.
    #[arg(long, value_name = "SET")]
    dataset: Vec<String>,
    /// Read meshes, methods, levels and limits from a TOML file; the command line takes precedence.
    #[arg(long, value_name = "FILE")]
    study: Option<PathBuf>,
    /// Run these methods, separated by commas, with parameters as in `qmat,qmat:k=0`
    /// [default: all but those that run on request].
    #[arg(long, value_name = "ID[:KEY=VALUE]", value_delimiter = ',')]
    methods: Vec<String>,
    /// Leave out the methods with these ids.
    #[arg(long, value_name = "ID", value_delimiter = ',')]
    without: Vec<String>,
    /// Simplify to these sphere counts [default: 200,100,50; 100,50 without a mesh].
    #[arg(long, value_name = "COUNTS", value_delimiter = ',', allow_negative_numbers = true, value_parser = whole)]
    spheres: Vec<usize>,
    /// Run method ID at these native levels instead of its default sweep; repeatable.
    #[arg(long, value_name = "ID=X,Y")]
    levels: Vec<String>,
    /// Skip the default sweeps of native levels and the initial medial mesh.
    #[arg(long)]
    counts_only: bool,
    /// Search the fewest spheres within each of these Hausdorff errors, as fractions of the diagonal.
    #[arg(long, value_name = "E,F", value_delimiter = ',')]
    max_error: Vec<f64>,
    /// Also run each method at its published level.
    #[arg(long)]
    published: bool,
    /// Add medial meshes computed elsewhere as results of method NAME: a file, `NAME@MESH=FILE` with several
    /// meshes, or a folder of MESH.ma or MESH-COUNT.ma; repeatable. Their counts are the default of
    /// `--spheres`.
    #[arg(long, value_name = "NAME=PATH")]
    given: Vec<String>,
    /// Show the results of an edition, such as `2027.1`, or of another store next to the own ones without running their
    /// methods.
    #[arg(long, value_name = "EDITION")]
    against: Option<PathBuf>,
    /// Time each item N times, alternating between methods, and report the median [default: 1].
    #[arg(long, value_name = "N")]
    repeat: Option<usize>,
    /// Run the methods that depend on a seed with N seeds, from `--seed` on. Their rows are those of the seed with the
    /// median error; plots have the range as bars.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MOST_SEEDS))]
    seeds: Option<u64>,
    /// Run share I of N of the items; merge the folders by `medial report`.
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// Write results to this folder, and skip items that it already has.
    #[arg(long, value_name = "DIR", default_value = "medial-report")]
    out: PathBuf,
    /// Remove the results in the folder first.
    #[arg(long)]
    fresh: bool,
    /// Run failed items again.
    #[arg(long)]
    retry_failed: bool,
    /// Stop an item after SECONDS [default: 300].
    #[arg(long, value_name = "SECONDS")]
    timeout: Option<f64>,
    /// Start no further level of a method on a mesh after SECONDS, and mark the rest `skipped` [default: 60].
    #[arg(long, value_name = "SECONDS")]
    budget: Option<f64>,
    /// Run N items at the same time; tables then omit seconds [default: 1].
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Stop an item that uses more than MB megabytes [default: 3/4 of the machine's memory, divided by the jobs].
    #[arg(long, value_name = "MB")]
    memory: Option<u64>,
    /// Certify each Hausdorff error by an interval of this width, as a fraction of the diagonal.
    #[arg(long, value_name = "WIDTH")]
    certify: Option<f64>,
    /// Measure the spheres of each result alone, without its edges and faces: for collision spheres and clumps.
    #[arg(long)]
    spheres_alone: bool,
    #[command(flatten)]
    substrate: SubstrateArguments,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// Runs the verb. Fails when the command line or the study is wrong, an input does not exist, or the results cannot be
/// written, before any run. Refused meshes and failed methods are rows of the results.
pub fn run(
    arguments: &Arguments,
    global: &Global,
    registry: &mut Registry,
) -> Result<Exit, Failure> {
    let mut study = study(arguments, global)?;
    for file in &study.plugins {
        registry.add_plugins(&study.resolved(file)).map_err(Failure::usage)?;
    }
    registry.remarks.iter().for_each(|remark| note(global, remark));
    arguments.apply_without(&mut study, registry)?;
    arguments.apply_levels(&mut study, registry)?;
    let provenance = provenance();
    let mut items = study.items(registry, &provenance)?;
    if arguments.substrate.as_is {
        study.sources()?.iter().try_for_each(Source::check_as_is)?;
    }
    let (_, remarks) = study.external_files(&unique_names(&study.sources()?))?;
    remarks.iter().for_each(|remark| note(global, remark));
    let edition = Edition::of(&study)?;
    edition.iter().try_for_each(|edition| edition.check(&study, &items))?;
    if let Some(text) = &arguments.shard {
        items = shard(text, &items)?;
    }
    let axes = Some(arguments.out.join(AXES));
    let store = Store::open(&arguments.out, &provenance.command)?;
    let interrupted = interrupt::listen();
    let supervisor = || Supervisor::new(&registry.files, &provenance, axes.clone(), interrupted);
    let supervisors = (0..study.jobs).map(|_| supervisor()).collect();
    store.remarks.iter().for_each(|remark| note(global, remark));
    let mut side = Contender { supervisors, store };
    let (mut left, found) = match arguments.fresh {
        true => (items.clone(), 0),
        false => missing(&items, &side.store, arguments.retry_failed),
    };
    // Before `clear`: a misspelt parameter must not cost earlier results.
    if let Some(why) = refused_params(&left, &mut side.supervisors[0])? {
        return Err(Failure::usage(why));
    }
    // No result is touched before this line.
    if arguments.fresh {
        side.store.clear()?;
    }
    let earlier = Study::read(&arguments.out.join(STUDY)).ok();
    let turns = earlier.is_some_and(|earlier| earlier.against != study.against);
    if !left.is_empty() || turns {
        write_study(&arguments.out, &study)?;
    }
    // Mesh by mesh from cheap to expensive, so that first results come soon.
    for scene in left.chunk_by_mut(|a, b| a.scene == b.scene) {
        let cost = |item: &Item| match item.method.id.as_str() {
            GIVEN | INITIAL => 0.0,
            id => medial_methods::usual_seconds(id).unwrap_or(f64::INFINITY),
        };
        scene.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    }
    let levels: usize = left.iter().map(|item| item.levels.len()).sum();
    let (dir, registry) = (&arguments.out, &*registry);
    if levels > 0 || turns {
        // An earlier page must not pass for a page of all records, even after a killed run.
        side.store.remove_page()?;
    }
    let ended = run_items(&left, std::slice::from_mut(&mut side), global.quiet);
    let run = side.store.added;
    // The flag has no effect from here on.
    if interrupt::stop_listening() {
        print_error(&format!(
            "interrupted: recorded {run} of {levels} results; run the same command again to resume, \
             or make their page by `medial report {}`",
            dir.display()
        ));
        return Ok(Exit::Interrupted);
    }
    ended?;
    // The store stays locked until its report is written; a worker would only hold memory.
    side.supervisors.clear();
    let Rebuilt { records, files, undrawn, .. } =
        report_of_run(dir, &items, registry, &provenance)?;
    undrawn.iter().for_each(|why| note(global, why));
    let records = of_items(records, &items);
    let shown: HashSet<String> = left.iter().flat_map(Item::keys).collect();
    // The reasons of this run are on the screen.
    let earlier: Vec<Record> =
        records.iter().filter(|record| !shown.contains(&record.key)).cloned().collect();
    reasons(&earlier).iter().for_each(|reason| print_error(reason));
    let shown = edition.map(|edition| edition.beside(&study, &records, registry));
    finish(&records, shown.as_ref(), [run, found], arguments, &files, global)
}

/// Numbers of spheres on the example shapes, which need few and show all methods within a minute.
const EXAMPLE_COUNTS: [usize; 2] = [100, 50];

/// The largest number of seeds of a method.
const MOST_SEEDS: u64 = 1_000;

/// The study of the command line, based on the study file if there is one.
fn study(arguments: &Arguments, global: &Global) -> Result<Study, Failure> {
    let mut study = match &arguments.study {
        Some(path) => Study::read(path)?,
        None => Study::default(),
    };
    // An edition has the counts of other meshes.
    let is_example = arguments.meshes.is_empty() && arguments.dataset.is_empty();
    if arguments.study.is_none() && is_example && arguments.against.is_none() {
        study.spheres = EXAMPLE_COUNTS.to_vec();
    }
    if !arguments.meshes.is_empty() {
        // Named meshes replace those of the study, and its sets with them.
        study.meshes = arguments.meshes.iter().map(absolute).collect();
        study.dataset.clear();
    }
    replace(&mut study.dataset, &arguments.dataset);
    // A folder: names of editions stay.
    let against = arguments.against.as_ref();
    let against = against.map(|path| if path.is_dir() { absolute(path) } else { path.clone() });
    study.against = against.or(study.against);
    if !arguments.methods.is_empty() {
        let methods = arguments.methods.iter().map(|text| StudyMethod::parse(text));
        study.methods = methods.collect::<Result<_, _>>()?;
    }
    for text in &arguments.given {
        let mut given = ExternalResult::parse(text).map_err(Failure::usage)?;
        // It is written into the study of the store, in another folder.
        given.file = absolute(&given.file);
        study.given.push(given);
    }
    if arguments.study.is_none() && arguments.spheres.is_empty() && !study.given.is_empty() {
        study.spheres = study.external_counts()?;
    }
    replace(&mut study.spheres, &arguments.spheres);
    replace(&mut study.max_error, &arguments.max_error);
    study.counts_only |= arguments.counts_only;
    study.published |= arguments.published;
    study.repeat = arguments.repeat.unwrap_or(study.repeat);
    study.timeout = arguments.timeout.unwrap_or(study.timeout);
    study.budget = arguments.budget.unwrap_or(study.budget);
    study.jobs = arguments.jobs.unwrap_or(study.jobs);
    study.memory = arguments.memory.or(study.memory);
    study.certify = arguments.certify.or(study.certify);
    study.spheres_alone |= arguments.spheres_alone;
    study.threads = global.threads.or(study.threads);
    study.plugins.extend(global.plugins.iter().map(absolute));
    arguments.substrate.apply(&mut study)?;
    if let Some(count) = arguments.seeds {
        study.seeds = (0..count).map(|k| study.seed.wrapping_add(k)).collect();
    }
    study.samples = arguments.measure.samples.unwrap_or(study.samples);
    Ok(study)
}

/// Lists of the command line replace those of the study unless they are empty.
fn replace<T: Clone>(own: &mut Vec<T>, given: &[T]) {
    if !given.is_empty() {
        *own = given.to_vec();
    }
}

/// A path of the command line.
// It is relative to the working folder, unlike paths of a study file, which are relative to that file.
fn absolute(path: &PathBuf) -> PathBuf {
    match Source::is_name(path) {
        true => path.clone(),
        false => std::path::absolute(path).unwrap_or_else(|_| path.clone()),
    }
}

impl Arguments {
    /// Takes the methods of `--without` out of the study.
    fn apply_without(&self, study: &mut Study, registry: &Registry) -> Result<(), Failure> {
        if self.without.is_empty() {
            return Ok(());
        }
        study.methods = study.entries(registry)?.into_iter().map(|(method, _)| method).collect();
        for id in &self.without {
            if id == INITIAL {
                return Err(Failure::usage(format!("--without {id}: use --counts-only")));
            }
            let before = study.methods.len();
            study.methods.retain(|row| row.id != *id);
            if study.methods.len() == before {
                let why = match registry.entry(id) {
                    Some(_) => format!("`{id}` does not run by default"),
                    None => registry.no_such(id),
                };
                return Err(Failure::usage(format!("--without: {why}")));
            }
        }
        if study.methods.iter().all(|row| row.id == INITIAL) {
            return Err(Failure::usage("--without: no method is left"));
        }
        Ok(())
    }

    /// Applies `--levels` to the methods of the study.
    fn apply_levels(&self, study: &mut Study, registry: &Registry) -> Result<(), Failure> {
        if self.levels.is_empty() {
            return Ok(());
        }
        // Defaults become rows, so that the option can name any of them.
        study.methods = study.entries(registry)?.into_iter().map(|(method, _)| method).collect();
        for word in &self.levels {
            let wrong =
                || Failure::usage(format!("--levels {word}: expected METHOD=LEVEL[,LEVEL...]"));
            let (id, list) = word.split_once('=').ok_or_else(wrong)?;
            let levels = list.split(',').map(|level| level.trim().parse::<f64>());
            let levels: Vec<f64> = levels.collect::<Result<_, _>>().map_err(|_| wrong())?;
            let mut rows: Vec<_> = study.methods.iter_mut().filter(|row| row.id == id).collect();
            if rows.is_empty() {
                return Err(Failure::usage(format!(
                    "--levels {word}: `{id}` does not run; add it by --methods"
                )));
            }
            rows.iter_mut().for_each(|row| row.levels.extend(&levels));
        }
        Ok(())
    }
}

/// Prints the summary and decides the exit code.
fn finish(
    records: &[Record],
    mixed: Option<&Mixed>,
    [run, found]: [usize; 2],
    arguments: &Arguments,
    files: &[PathBuf],
    global: &Global,
) -> Result<Exit, Failure> {
    let ok = records.iter().filter(|record| record.status.is_ok()).count();
    let out = &arguments.out;
    let page = out.join(PAGE);
    let (shown, mut notes) = match mixed {
        Some(mixed) => (&mixed.records[..], mixed.notes.clone()),
        None => (records, Vec::new()),
    };
    notes.extend(medial_reports::remarks_of_meshes(records));
    if global.json {
        let by_status: serde_json::Map<String, serde_json::Value> =
            Status::ALL.iter().map(|&s| (s.key(), count(records, s).into())).collect();
        let object = json!({
            "out": out, "records": records.len(), "run": run, "found": found,
            "status": by_status, "results": out.join(RESULTS), "page": page, "files": files,
        });
        print_json(&object, &notes);
    } else {
        if ok > 0 {
            print_line(&medial_reports::summary_text(shown));
        }
        notes.iter().for_each(|note| print_line(note));
        let external = match count(records, Status::External) {
            0 => String::new(),
            files => format!(" ({files} external)"),
        };
        print_line(&format!(
            "{ok} of {} results as requested{external}{}; {run} run now, {found} found; page: {}",
            records.len(),
            others(records),
            page.display()
        ));
    }
    let measured = records.iter().filter(|record| record.status.has_result()).count();
    Ok(match measured {
        0 => Exit::NothingMeasured,
        _ if records.iter().any(|record| record.status.is_failure()) => Exit::SomeFailed,
        _ => Exit::Done,
    })
}

/// The numbers of results that are not as requested: `, 2 other count, 1 failed`.
fn others(records: &[Record]) -> String {
    let others = Status::ALL.into_iter().filter(|status| !status.is_ok());
    let counted = others.map(|status| (status, count(records, status)));
    let counted = counted.filter(|&(_, count)| count > 0);
    counted.map(|(status, count)| format!(", {count} {status}")).collect()
}
