//! From a result and its measurements to its record.

use std::path::Path;

use medial::complex;
use medial::simplifier::Simplified;

use crate::item::{GIVEN, Item};
use crate::level::Target;
use crate::record::{
    Conditions, OwnSeconds, Provenance, Record, Repetition, Simplify, Stages, Status, is_near,
};
use crate::scene::{Scene, Verdict};
use crate::text::file_stem;
use crate::timed::{Fault, LevelRun, ProgramPeak, Times};

/// The record of a level that was not run, or did not finish.
pub fn failure_record(
    item: &Item,
    level: Target,
    fault: &Fault,
    provenance: &Provenance,
) -> Record {
    let Fault { status, reason } = fault;
    let simplify = Simplify {
        variant: item.method.name.clone(),
        params: item.method.params.clone(),
        seed: item.seed,
        threads: Some(item.scene.settings.threads),
        version: provenance.version.clone(),
        ..Simplify::asked(&item.method.id, level, *status)
    };
    let scene = &item.scene;
    let seeds = [("method", item.seed), ("evaluation", scene.settings.seed)];
    Record {
        key: item.key(level),
        mesh: scene.mesh.clone(),
        dataset: scene.source.dataset().map(str::to_owned),
        mesh_hash: scene.hash.clone(),
        status: *status,
        reason: Some(reason.clone()),
        simplify,
        conditions: Conditions {
            sampling: scene.settings.sampling.to_string(),
            dual: scene.settings.dual.to_string(),
            samples: scene.settings.samples,
            seconds_limit: item.limits.seconds,
            bytes_limit: item.limits.bytes,
            budget: item.limits.budget,
            jobs: 1,
            fingerprint: item.method.fingerprint.clone(),
        },
        seeds: seeds.map(|(purpose, seed)| (purpose.to_owned(), seed)).into(),
        machine: provenance.machine.clone(),
        method_version: item.version.clone(),
        binary_hash: item.binary.clone(),
        command: provenance.command.clone(),
        version: provenance.version.clone(),
        ..Record::default()
    }
}

/// The record of one level. If the folder `axes` is given, the result is saved there as `.ma` in input
/// units; the path in the record begins with the name of this folder.
pub fn record(
    item: &Item,
    scene: &Scene,
    run: &LevelRun,
    verdict: Option<Verdict>,
    provenance: &Provenance,
    axes: Option<&Path>,
) -> Record {
    let is_given = item.method.id == GIVEN;
    let fault = match &run.outcome {
        Ok(_) if is_given => Fault { status: Status::External, reason: String::new() },
        Ok(result) => count_fault(run.level, result),
        Err(fault) => fault.clone(),
    };
    // Built from the failure of the level, so that both kinds of records have the same fields.
    let mut record = failure_record(item, run.level, &fault, provenance);
    record.mesh_hash = Some(scene.input.hash.clone());
    record.initial = scene.initial();
    // To read a file says nothing of the time that its program took, and a level that was not begun took none.
    if !is_given && record.status != Status::Skipped {
        record.repetitions = vec![repetition(&run.times)];
        fill_costs(&mut record.simplify, &run.times);
    }
    let Ok(result) = &run.outcome else { return record };
    if record.status.is_ok() {
        record.reason = None;
    }
    fill_result(&mut record.simplify, result);
    record.simplify.warnings.extend(scene.shape().remarks());
    if let Some(ProgramPeak(bytes)) = result.extras.get() {
        // The program ran while this process held its input, so both peaks add up.
        record.simplify.peak_bytes = Some(run.times.peak_bytes + bytes);
    }
    if let Some(Verdict { evaluation, seconds, hash }) = verdict {
        record.result_hash = Some(hash);
        match evaluation {
            Ok(evaluation) => {
                record.evaluate = Some(evaluation);
                record.evaluate_seconds = Some(seconds);
            }
            Err(error) => record.simplify.warnings.push(format!("not measured: {error}")),
        }
    }
    let spheres = result.mesh.spheres.len();
    if let Some(axes) = axes.filter(|_| item.keeps(run.level, spheres)) {
        match save(result, &record, scene, axes) {
            Ok(artifact) => record.artifact = Some(artifact),
            Err(error) => record.simplify.warnings.push(format!("not saved: {error}")),
        }
    }
    record
}

/// Copies the costs of the result.
pub fn fill_costs(simplify: &mut Simplify, times: &Times) {
    simplify.substrates =
        times.substrates.iter().map(|(s, cost)| (s.name().to_owned(), cost.seconds)).collect();
    simplify.seconds = Some(times.seconds());
    simplify.cpu_seconds = Some(times.cpu_seconds());
    simplify.peak_bytes = Some(times.peak_bytes);
}

/// Copies the facts of the result itself: counts, level, remarks.
pub fn fill_result(simplify: &mut Simplify, result: &Simplified) {
    let mesh = &result.mesh;
    simplify.reached = Some(mesh.spheres.len());
    simplify.native_level = result.native_level;
    simplify.spheres = Some(mesh.spheres.len());
    simplify.edges = Some(mesh.edges.len());
    simplify.faces = Some(mesh.faces.len());
    simplify.warnings.clone_from(&result.diagnostics.warnings);
    simplify.diagnostics = result.diagnostics.counts.iter().cloned().collect();
    simplify.own_seconds = result.extras.get::<OwnSeconds>().copied();
}

/// `ok`, or the fault of a result whose count is more than 2 % off the requested one.
pub fn count_fault(level: Target, result: &Simplified) -> Fault {
    let reached = result.mesh.spheres.len();
    match level {
        Target::Spheres(requested) if !is_near(reached, requested) => {
            let why = result.diagnostics.warnings.join("; ");
            let why = if why.is_empty() { why } else { format!(": {why}") };
            let reason = format!("{reached} spheres where {requested} were requested{why}");
            Fault { status: Status::OtherCount, reason }
        }
        _ => Fault { status: Status::Ok, reason: String::new() },
    }
}

/// One timed repetition.
pub fn repetition(times: &Times) -> Repetition {
    Repetition { seconds: times.seconds(), cpu_seconds: times.cpu_seconds() }
}

/// The stages of the repetition with the median total; the lower one of an even number.
pub fn median(repetitions: &[Repetition], part: fn(&Repetition) -> Stages) -> Option<Stages> {
    let mut stages: Vec<Stages> = repetitions.iter().map(part).collect();
    // A whole repetition, not a median of each stage: the stages must add up to the total.
    stages.sort_by(|a, b| a.total.total_cmp(&b.total));
    stages.get(stages.len().saturating_sub(1) / 2).copied()
}

/// Saves a result and returns its path from the folder above `axes`, with `/`.
fn save(
    result: &Simplified,
    record: &Record,
    scene: &Scene,
    axes: &Path,
) -> Result<String, Box<dyn std::error::Error>> {
    let level = match record.simplify.level {
        Target::Published => "published".to_owned(),
        Target::Spheres(count) => count.to_string(),
        Target::Native(value) => format!("level-{value}"),
        Target::MaxError(bound) => format!("error-{bound}"),
    };
    let mesh = file_stem(&record.mesh);
    let method = file_stem(record.simplify.variant.as_ref().unwrap_or(&record.simplify.method));
    // The key covers everything else that affects the result: parameters, seed, sampling, build.
    let key = &record.key[..12];
    let name = format!("{method}-{level}-{key}.ma");
    std::fs::create_dir_all(axes.join(&mesh))?;
    complex::write(axes.join(&mesh).join(&name), &scene.in_input_units(&result.mesh))?;
    let folder = axes.file_name().map_or_else(String::new, |name| name.to_string_lossy().into());
    Ok(format!("{folder}/{mesh}/{name}"))
}
