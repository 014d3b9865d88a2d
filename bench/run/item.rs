//! One item: one method on one shape at some levels, timed, checked and measured.

use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use medial::complex::{self, MedialMesh};
use medial::metrics::{Evaluation, Judge, MetricError};
use medial::shape::{Cost, Shape};
use medial::simplifier::{
    Level, MedialSimplifier, Params, RunContext, Simplified, SimplifyError, Work,
};
use medial_reports::{Initial, Record, Repetition, Simplify, Stages, Status};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Input, Lap, Provenance, Stopwatch, peak_bytes};

/// One method on one input at some levels. Plain data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Item {
    /// Id of the method.
    pub method: String,
    /// Parameters of the method.
    pub params: Params,
    /// Levels, from fine to coarse.
    pub levels: Vec<Level>,
}

/// What is the same for every item of a run.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Seed of the methods' random choices.
    pub seed: u64,
    /// How often each item is timed, at least once.
    pub repeat: usize,
    /// Folder of the results; medial meshes are saved below it.
    pub out: Option<PathBuf>,
}

/// What results are measured against.
pub struct Measure<'a> {
    /// The input.
    pub input: &'a Input,
    /// Its shape.
    pub shape: &'a Shape,
    /// Its judge.
    pub judge: &'a Judge,
    /// Its initial medial mesh, or why there is none.
    pub initial: Option<Initial>,
}

/// What came of one level in one repetition.
struct Answer {
    outcome: Result<Simplified, Failure>,
    prepare: Lap,
    simplify: Lap,
}

/// Why a level has no result.
#[derive(Clone, Debug)]
struct Failure {
    status: Status,
    reason: String,
}

impl From<SimplifyError> for Failure {
    fn from(error: SimplifyError) -> Self {
        let status = match &error {
            SimplifyError::Unsupported { .. } => Status::Unsupported,
            SimplifyError::Parameter(_) | SimplifyError::Level(_) => Status::Refused,
            SimplifyError::InvalidOutput(_) => Status::InvalidOutput,
            SimplifyError::Shape(_) | SimplifyError::Hierarchy(_) | SimplifyError::Cancelled => {
                Status::Failed
            }
        };
        Self { status, reason: error.to_string() }
    }
}

/// Runs an item and gives one record for each level, in the order of the levels. A method that
/// fails or panics gives records that say so.
pub fn run_item(
    method: &dyn MedialSimplifier,
    item: &Item,
    measure: &Measure<'_>,
    options: &RunOptions,
    provenance: &Provenance,
) -> Vec<Record> {
    let view = measure.shape.view();
    let mut answers = answer_levels(method, item, &view, options);
    let peak = peak_bytes();
    let mut repetitions: Vec<Vec<Repetition>> =
        answers.iter().map(|answer| vec![repetition(&view, answer)]).collect();
    for _ in 1..options.repeat {
        let view = measure.shape.view();
        let again = answer_levels(method, item, &view, options);
        for ((first, again), raw) in answers.iter_mut().zip(&again).zip(&mut repetitions) {
            raw.push(repetition(&view, again));
            warn_if_different(first, again);
        }
    }
    let measured = measure_all(measure.judge, &answers);
    let records = answers.into_iter().zip(measured).zip(repetitions).zip(&item.levels);
    records
        .map(|(((answer, measured), raw), &level)| {
            let simplify = Simplify {
                params: item.params.clone(),
                seed: options.seed,
                substrates: substrates(&view),
                seconds: Some(median(raw.iter().map(|r| r.seconds))),
                cpu_seconds: Some(median(raw.iter().map(|r| r.cpu_seconds))),
                peak_bytes: peak,
                threads: Some(rayon::current_num_threads()),
                version: provenance.version.clone(),
                ..Simplify::asked(&item.method, level, Status::Failed)
            };
            let seeds = [("method", options.seed), ("evaluation", measure.judge.options().seed)];
            let mut record = Record {
                dataset: measure.input.dataset.clone(),
                mesh_hash: Some(measure.input.hash.clone()),
                initial: measure.initial,
                seeds: seeds.map(|(purpose, seed)| (purpose.to_owned(), seed)).into(),
                repetitions: raw,
                ..blank_record(measure.input.name.clone(), simplify, provenance)
            };
            fill(&mut record, answer.outcome, measured, measure, options);
            record
        })
        .collect()
}

/// The records of an item whose input, here by its name, was refused: one for each level, each with the reason.
pub fn refused_records(
    name: &str,
    item: &Item,
    reason: &str,
    provenance: &Provenance,
) -> Vec<Record> {
    let record = |&level: &Level| {
        let asked = Simplify::asked(&item.method, level, Status::Refused);
        let simplify =
            Simplify { params: item.params.clone(), version: provenance.version.clone(), ..asked };
        Record {
            reason: Some(reason.to_owned()),
            ..blank_record(name.to_owned(), simplify, provenance)
        }
    };
    item.levels.iter().map(record).collect()
}

/// Prepares once and asks for every level, each within a guard against panics.
fn answer_levels(
    method: &dyn MedialSimplifier,
    item: &Item,
    shape: &Shape,
    options: &RunOptions,
) -> Vec<Answer> {
    let run = RunContext::with_seed(options.seed);
    let (prepared, mut prepare) =
        Stopwatch::time(|| guarded(|| method.prepare(shape, &item.params, &run)));
    // Substrates are shared: what was spent on them here is told apart from the method's own work.
    let spent = shape.spent();
    prepare.seconds = (prepare.seconds - spent.seconds).max(0.0);
    prepare.cpu_seconds = (prepare.cpu_seconds - spent.cpu_seconds).max(0.0);
    let mut simplification = match prepared {
        Ok(simplification) => simplification,
        Err(failure) => {
            let fail =
                |_| Answer { outcome: Err(failure.clone()), prepare, simplify: Lap::default() };
            return item.levels.iter().map(fail).collect();
        }
    };
    let mut so_far = Lap::default();
    let mut broken: Option<Failure> = None;
    let answer = |&level: &Level| {
        if let Some(failure) = &broken {
            return Answer { outcome: Err(failure.clone()), prepare, simplify: Lap::default() };
        }
        let (outcome, lap) = Stopwatch::time(|| guarded(|| simplification.at(level)));
        match outcome.as_ref().map_or(Work::Anew, |simplified| simplified.work) {
            Work::Continued => so_far += lap,
            Work::Anew => so_far = lap,
            Work::Reused(Cost { seconds, cpu_seconds }) => {
                so_far = lap;
                so_far += Lap { seconds, cpu_seconds };
            }
        }
        if let Err(failure) = &outcome
            && failure.status == Status::Panicked
        {
            broken = Some(Failure {
                status: Status::Panicked,
                reason: format!("not run: the method panicked at {level}"),
            });
        }
        Answer { outcome, prepare, simplify: so_far }
    };
    item.levels.iter().map(answer).collect()
}

fn guarded<T>(work: impl FnOnce() -> Result<T, SimplifyError>) -> Result<T, Failure> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(outcome) => Ok(outcome?),
        Err(payload) => {
            Err(Failure { status: Status::Panicked, reason: panic_message(payload.as_ref()) })
        }
    }
}

fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
    format!("panicked: {}", text.unwrap_or_else(|| "no message".into()))
}

fn warn_if_different(first: &mut Answer, again: &Answer) {
    if let (Ok(first), Ok(again)) = (&mut first.outcome, &again.outcome)
        && first.mesh != again.mesh
    {
        first
            .diagnostics
            .warn("a repetition gave another medial mesh: the method is not deterministic");
    }
}

fn substrates(shape: &Shape) -> BTreeMap<String, f64> {
    let used = shape.used().into_iter();
    used.map(|(substrate, cost)| (substrate.name().to_owned(), cost.seconds)).collect()
}

fn substrate_lap(shape: &Shape) -> Lap {
    let mut sum = Lap::default();
    for (_, cost) in shape.used() {
        sum += Lap { seconds: cost.seconds, cpu_seconds: cost.cpu_seconds };
    }
    sum
}

fn repetition(shape: &Shape, answer: &Answer) -> Repetition {
    let substrate = substrate_lap(shape);
    let Answer { prepare, simplify, .. } = answer;
    Repetition {
        seconds: Stages::new(substrate.seconds, prepare.seconds, simplify.seconds),
        cpu_seconds: Stages::new(substrate.cpu_seconds, prepare.cpu_seconds, simplify.cpu_seconds),
    }
}

/// The stages of the repetition with the median total; the lower one of an even number.
fn median(stages: impl Iterator<Item = Stages>) -> Stages {
    let mut stages: Vec<Stages> = stages.collect();
    stages.sort_by(|a, b| a.total.total_cmp(&b.total));
    stages[(stages.len() - 1) / 2]
}

fn blank_record(mesh: String, simplify: Simplify, provenance: &Provenance) -> Record {
    Record {
        mesh,
        dataset: None,
        mesh_hash: None,
        status: simplify.status,
        reason: None,
        simplify,
        evaluate: None,
        evaluate_seconds: None,
        initial: None,
        seeds: BTreeMap::new(),
        repetitions: vec![],
        machine: provenance.machine.clone(),
        binary_hash: provenance.binary_hash.clone(),
        command: provenance.command.clone(),
        version: provenance.version.clone(),
        artifact: None,
    }
}

/// An evaluation, and the seconds it took.
type Measured = (Result<Evaluation, MetricError>, f64);

/// Measures what came of each level, side by side, after all of them were timed. Levels with the
/// same result are measured once.
fn measure_all(judge: &Judge, answers: &[Answer]) -> Vec<Option<Measured>> {
    let outcomes = answers.iter().map(|answer| answer.outcome.as_ref().ok());
    let meshes: Vec<Option<&MedialMesh>> =
        outcomes.map(|outcome| outcome.map(|simplified| &simplified.mesh)).collect();
    // Its own index for the first of equal results.
    let first = |index: usize| meshes[..index].iter().position(|&m| m == meshes[index]);
    let firsts: Vec<usize> = (0..meshes.len()).map(|index| first(index).unwrap_or(index)).collect();
    let measure = |index: usize| -> Option<Measured> {
        let mesh = meshes[index].filter(|_| firsts[index] == index)?;
        mesh.check().ok()?;
        let (evaluation, lap) = Stopwatch::time(|| judge.evaluate(mesh));
        Some((evaluation, lap.seconds))
    };
    let measured: Vec<Option<Measured>> = (0..meshes.len()).into_par_iter().map(measure).collect();
    firsts.into_iter().map(|first| measured[first].clone()).collect()
}

/// Checks and saves a result, and writes it with its evaluation into its record.
fn fill(
    record: &mut Record,
    outcome: Result<Simplified, Failure>,
    measured: Option<Measured>,
    measure: &Measure<'_>,
    options: &RunOptions,
) {
    let outcome = outcome.and_then(|simplified| {
        simplified.mesh.check().map_err(SimplifyError::from)?;
        if simplified.mesh.spheres.is_empty() {
            let warnings = simplified.diagnostics.warnings.join("; ");
            let reason = format!("the result has no sphere: {warnings}");
            return Err(Failure { status: Status::Failed, reason });
        }
        Ok(simplified)
    });
    let simplified = match outcome {
        Ok(simplified) => simplified,
        Err(Failure { status, reason }) => {
            record.status = status;
            record.simplify.status = status;
            record.reason = Some(reason);
            return;
        }
    };
    record.status = Status::Ok;
    let simplify = &mut record.simplify;
    simplify.status = Status::Ok;
    simplify.reached = Some(simplified.mesh.spheres.len());
    simplify.native_level = simplified.native_level;
    simplify.spheres = Some(simplified.mesh.spheres.len());
    simplify.edges = Some(simplified.mesh.edges.len());
    simplify.faces = Some(simplified.mesh.faces.len());
    simplify.warnings = simplified.diagnostics.warnings;
    simplify.diagnostics = simplified.diagnostics.counts.into_iter().collect();
    if let Some((evaluation, seconds)) = measured {
        record.evaluate_seconds = Some(seconds);
        match evaluation {
            Ok(evaluation) => record.evaluate = Some(evaluation),
            Err(error) => record.simplify.warnings.push(format!("not measured: {error}")),
        }
    }
    if let Some(out) = &options.out {
        match save(&simplified.mesh, record, measure, out) {
            Ok(artifact) => record.artifact = Some(artifact),
            Err(error) => record.simplify.warnings.push(format!("not saved: {error}")),
        }
    }
}

/// Saves a result in input units below the folder of the results and returns its relative path.
fn save(
    mesh: &MedialMesh,
    record: &Record,
    measure: &Measure<'_>,
    out: &std::path::Path,
) -> Result<String, Box<dyn std::error::Error>> {
    let level = match record.simplify.level {
        Level::Published => "published".to_owned(),
        Level::Spheres(count) => count.to_string(),
        Level::Native(value) => format!("level-{value}"),
    };
    let folder = format!("axes/{}", medial_reports::file_stem(&record.mesh));
    let artifact =
        format!("{folder}/{}-{level}.ma", medial_reports::file_stem(&record.simplify.method));
    std::fs::create_dir_all(out.join(&folder))?;
    let back = measure.shape.normalisation();
    let mesh = mesh.transformed(back.diagonal, |p| back.backward(p));
    complex::write(out.join(&artifact), &mesh)?;
    Ok(artifact)
}
