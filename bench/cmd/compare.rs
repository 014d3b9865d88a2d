//! `medial compare [MESH ...]`: the main job. Methods x meshes x levels, measured and reported.

use std::path::{Component, Path, PathBuf};

use clap::Args;
use medial::metrics::JudgeOptions;
use medial::shape::ShapeOptions;
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, SimplifyError};
use medial_reports::{Header, Initial, Journal, Record, Status, read_records, write_report};
use serde_json::json;

use super::methods::unknown_method;
use crate::args::{
    Global, MeasureArguments, MeshArgument, SubstrateArguments, judge_options, shape_options,
};
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line};
use crate::run::{
    Input, Item, Measure, Progress, Provenance, RunOptions, Source, refused_records, run_item,
};

/// Name of the append-only list of records in the folder of the results.
pub const RESULTS: &str = "results.jsonl";

/// How a comparison measures unless told otherwise: coarser than `evaluate`, since it measures
/// hundreds of results. Sample counts are in every record.
const QUICK: JudgeOptions = JudgeOptions { samples: 10_000, volume_depth: 5, seed: 0 };

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface files (OFF, OBJ, PLY, STL) or `builtin:ID[:RESOLUTION]` [default: all built-in shapes].
    meshes: Vec<MeshArgument>,
    /// A set of meshes beside those named: `builtin`.
    #[arg(long, value_name = "SET")]
    dataset: Option<String>,
    /// Methods, separated by commas [default: all].
    #[arg(long, value_name = "IDS", value_delimiter = ',')]
    methods: Vec<String>,
    /// Sphere counts, separated by commas.
    #[arg(long, value_name = "COUNTS", value_delimiter = ',', default_values_t = [1000, 500, 200, 100])]
    spheres: Vec<usize>,
    /// Also run each method at its published level.
    #[arg(long)]
    published: bool,
    /// Set a parameter of one method; can be given several times.
    #[arg(long = "set", value_name = "METHOD.KEY=VALUE")]
    set: Vec<String>,
    /// Time each item so many times; the median is reported, all are kept.
    #[arg(long, value_name = "N", default_value_t = 1)]
    repeat: usize,
    /// Folder of the results.
    #[arg(long, value_name = "DIR", default_value = "medial-report")]
    out: PathBuf,
    #[command(flatten)]
    substrate: SubstrateArguments,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// Runs the verb.
///
/// # Errors
/// When the command line is wrong or the results cannot be written. Meshes that are refused and
/// methods that fail are rows of the results.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let sources = sources(arguments)?;
    let methods = methods(&arguments.methods)?;
    let items = items(arguments, &methods)?;
    let names = unique_names(&sources);
    let shape_options = shape_options(&arguments.substrate)?;
    let judge_options = judge_options(&arguments.measure, QUICK, arguments.substrate.seed)?;
    if arguments.repeat == 0 {
        return Err(Failure::usage("--repeat 0: time each item at least once"));
    }
    check_params(&methods, &items)?;
    let options = RunOptions {
        seed: arguments.substrate.seed,
        repeat: arguments.repeat,
        out: Some(arguments.out.clone()),
    };
    let provenance = Provenance::here();
    let journal_path = fresh_journal(&arguments.out)?;
    let mut journal = Journal::open(&journal_path).map_err(Failure::input)?;
    let mut records = Vec::new();
    let mut progress = Progress::new(global.quiet, sources.len() * items.len());

    for (source, name) in sources.iter().zip(names) {
        let mut keep = |new: Vec<Record>| -> Result<(), Failure> {
            for record in new {
                journal.append(&record).map_err(Failure::input)?;
                records.push(record);
            }
            Ok(())
        };
        let prepared = Input::load(source).map_err(|error| error.to_string()).and_then(|input| {
            let input = Input { name: name.clone(), ..input };
            let shape = input.shape(shape_options.clone()).map_err(|error| error.to_string())?;
            Ok((input, shape))
        });
        let (input, shape) = match prepared {
            Ok(ready) => ready,
            Err(reason) => {
                progress.remark(&format!("{name}: refused: {reason}"));
                for item in &items {
                    keep(refused_records(&name, item, &reason, &provenance))?;
                    progress.done();
                }
                continue;
            }
        };
        progress.at(&format!("{}: initial medial mesh", input.name));
        let judge = shape
            .judge(input.axis.as_ref(), judge_options)
            .map_err(|error| Failure::of(source, error))?;
        let initial =
            shape.view().initial().ok().map(|mesh| Initial::of(&mesh, judge.truth().betti));
        let measure = Measure { input: &input, shape: &shape, judge: &judge, initial };
        for (method, item) in methods.iter().zip(&items) {
            progress.at(&format!("{}: {}", input.name, item.method));
            let new = run_item(method.as_ref(), item, &measure, &options, &provenance);
            failures(&new).iter().for_each(|remark| progress.remark(remark));
            keep(new)?;
            progress.done();
        }
    }
    drop(progress);
    let header = Header {
        title: "Medial axis simplification: a comparison".into(),
        command: provenance.command.clone(),
        version: provenance.version.clone(),
        date: Some(super::report::today()),
        machine: Some(provenance.machine.clone()),
        methods: methods.iter().map(|method| method.info().into()).collect(),
        notes: vec![],
    };
    let files = write_report(&arguments.out, &records, &header).map_err(Failure::input)?;
    finish(&records, &arguments.out, &files, global)
}

/// One remark for each failure, or a single one where all levels failed for the same reason.
fn failures(records: &[Record]) -> Vec<String> {
    let failed: Vec<&Record> = records.iter().filter(|r| r.status.is_failure()).collect();
    let alike = failed.len() == records.len()
        && failed.iter().all(|r| r.status == failed[0].status && r.reason == failed[0].reason);
    let remark = |record: &&Record| {
        let Record { mesh, simplify, status, reason, .. } = record;
        let reason = reason.as_deref().unwrap_or("no reason");
        let level = match records.len() {
            2.. if alike => "all levels".to_owned(),
            _ => simplify.level.to_string(),
        };
        format!("{mesh}, {}, {level}: {status}: {reason}", simplify.method)
    };
    failed.iter().take(if alike { 1 } else { failed.len() }).map(remark).collect()
}

/// Finds wrong parameters before anything is run, by preparing on the smallest of shapes.
fn check_params(methods: &[Box<dyn MedialSimplifier>], items: &[Item]) -> Result<(), Failure> {
    if items.iter().all(|item| item.params.0.is_empty()) {
        return Ok(());
    }
    let resolution = medial_datasets::find("sphere").map(|shape| *shape.resolutions().start());
    let probe = Input::load(&Source::BuiltIn { id: "sphere".into(), resolution })?;
    let probe = probe.shape(ShapeOptions::default()).map_err(Failure::input)?;
    for (method, item) in methods.iter().zip(items) {
        let prepared = method.prepare(&probe, &item.params, &RunContext::default());
        if let Err(error @ SimplifyError::Parameter(_)) = prepared {
            return Err(Failure::usage(format!("{}: {error}", item.method)));
        }
    }
    Ok(())
}

/// A name for each source, unlike every other even as the stem of a file: the file's stem, where
/// that is not enough its name with the extension, then with its folder, then a number.
fn unique_names(sources: &[Source]) -> Vec<String> {
    let key = |name: &String| medial_reports::file_stem(name).to_ascii_lowercase();
    let mut names: Vec<String> = sources.iter().map(Source::name).collect();
    for depth in 1..=2 {
        let keys: Vec<String> = names.iter().map(key).collect();
        for (name, source) in names.iter_mut().zip(sources) {
            if keys.iter().filter(|&other| *other == key(name)).count() > 1 {
                *name = source.long_name(depth);
            }
        }
    }
    for index in 0..names.len() {
        let base = names[index].clone();
        let mut number = 2;
        while names[..index].iter().any(|other| key(other) == key(&names[index])) {
            names[index] = format!("{base}-{number}");
            number += 1;
        }
    }
    names
}

fn sources(arguments: &Arguments) -> Result<Vec<Source>, Failure> {
    let mut sources = Vec::new();
    for mesh in &arguments.meshes {
        sources.push(Source::parse(mesh).map_err(Failure::usage)?);
    }
    match arguments.dataset.as_deref() {
        None if sources.is_empty() => sources = Source::built_ins(),
        None => {}
        Some("builtin") => sources.extend(Source::built_ins()),
        Some(other) => {
            return Err(Failure::usage(format!("--dataset {other}: the one set is `builtin`")));
        }
    }
    // The same mesh twice would be one row with twice the weight.
    let mut distinct: Vec<Source> = Vec::with_capacity(sources.len());
    for source in sources {
        if !distinct.contains(&source) {
            distinct.push(source);
        }
    }
    Ok(distinct)
}

/// The methods of some ids, each once; without any, all.
pub(super) fn methods(ids: &[String]) -> Result<Vec<Box<dyn MedialSimplifier>>, Failure> {
    if ids.is_empty() {
        return Ok(medial_methods::registry());
    }
    let distinct = ids.iter().enumerate().filter(|&(index, id)| !ids[..index].contains(id));
    distinct.map(|(_, id)| medial_methods::find(id).ok_or_else(|| unknown_method(id))).collect()
}

/// Levels of numbers of spheres, each once, from fine to coarse.
pub(super) fn sphere_levels(counts: &[usize]) -> Result<Vec<Level>, Failure> {
    let mut counts = counts.to_vec();
    counts.sort_unstable_by(|a, b| b.cmp(a));
    counts.dedup();
    if counts.last() == Some(&0) {
        return Err(Failure::usage("--spheres 0: ask for at least one sphere"));
    }
    Ok(counts.into_iter().map(Level::Spheres).collect())
}

/// One item for each method: its parameters, and the levels from fine to coarse.
fn items(
    arguments: &Arguments,
    methods: &[Box<dyn MedialSimplifier>],
) -> Result<Vec<Item>, Failure> {
    let mut levels = sphere_levels(&arguments.spheres)?;
    if arguments.published {
        levels.insert(0, Level::Published);
    }
    let mut items: Vec<Item> = methods
        .iter()
        .map(|method| Item {
            method: method.info().id.to_owned(),
            params: Params::none(),
            levels: levels.clone(),
        })
        .collect();
    for word in &arguments.set {
        let parts = word.split_once('=').and_then(|(name, value)| {
            let (method, key) = name.split_once('.')?;
            Some((method, key, value))
        });
        let (method, key, value) =
            parts.ok_or_else(|| Failure::usage(format!("--set {word}: write METHOD.KEY=VALUE")))?;
        let item = items.iter_mut().find(|item| item.method == method);
        let item = item.ok_or_else(|| {
            Failure::usage(format!("--set {word}: `{method}` is not among the methods that run"))
        })?;
        item.params.set(key, value);
    }
    Ok(items)
}

/// Makes the folder and removes the records of an earlier run.
fn fresh_journal(out: &Path) -> Result<PathBuf, Failure> {
    let fail = |error: std::io::Error| Failure::input(format!("{}: {error}", out.display()));
    if out.exists() && !out.is_dir() {
        return Err(Failure::input(format!("{}: not a folder", out.display())));
    }
    std::fs::create_dir_all(out).map_err(fail)?;
    let path = out.join(RESULTS);
    remove_artifacts(out, &path);
    match std::fs::remove_file(&path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(fail(error)),
        _ => Ok(path),
    }
}

/// Removes the medial meshes that the records of an earlier run name, so that none is taken for
/// a result of this one. What cannot be removed stays: it is no result either way.
fn remove_artifacts(out: &Path, results: &Path) {
    let Ok(earlier) = read_records(results) else { return };
    for artifact in earlier.records.iter().filter_map(|record| record.artifact.as_deref()) {
        let inside = Path::new(artifact).components().all(|c| matches!(c, Component::Normal(_)));
        if inside && artifact.ends_with(".ma") {
            let path = out.join(artifact);
            let _ = std::fs::remove_file(&path);
            // Succeeds for a folder that is empty now.
            let _ = path.parent().map(std::fs::remove_dir);
        }
    }
}

/// Prints the summary and decides the exit code.
fn finish(
    records: &[Record],
    out: &Path,
    files: &[PathBuf],
    global: &Global,
) -> Result<Exit, Failure> {
    let count = |status: Status| records.iter().filter(|r| r.status == status).count();
    let ok = count(Status::Ok);
    let page = out.join("index.html");
    if global.json {
        let by_status: serde_json::Map<String, serde_json::Value> =
            Status::ALL.iter().map(|&s| (s.key().to_owned(), count(s).into())).collect();
        let object = json!({
            "out": out, "records": records.len(), "status": by_status,
            "results": out.join(RESULTS), "page": page, "files": files,
        });
        print_json(&object, &[]);
    } else {
        if ok > 0 {
            print_line(&medial_reports::summary_text(records));
        }
        print_line(&format!(
            "{ok} of {} results measured; page: {}",
            records.len(),
            page.display()
        ));
    }
    Ok(match ok {
        0 => Exit::NothingMeasured,
        _ if ok < records.len() => Exit::SomeFailed,
        _ => Exit::Done,
    })
}
