//! From an output to a record: the scene of an item, the evaluation of its results, the record of each.
//!
//! Methods are timed in [`answer`](mod@answer) alone, and error bounds searched in [`search`]; nothing that is
//! measured here counts as a method's time.

pub mod answer;
pub mod search;

use std::path::Path;
use std::time::Instant;

use medial::complex::MedialMesh;
use medial::metrics::{Evaluation, Judge, MetricError};
use medial::shape::Shape;
use medial::simplifier::Simplified;
use medial::surface::{SurfaceReport, TriMesh};
use medial::{complex, surface};
use medial_reports::{
    COUNT_TOLERANCE, Conditions, Initial, Record, Repetition, Simplify, Stages, Status, Target,
    file_stem,
};
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use crate::measure::answer::{Fault, LevelRun, Times};
use crate::plugin;
use crate::plugin::ProgramPeak;
use crate::provenance::{Provenance, hex};
use crate::study::external::GIVEN;
use crate::study::item::{Item, Noise, SceneSpec};
use crate::study::source::Input;

/// An input, ready to be simplified and measured, with noise or without.
pub struct Scene {
    /// What it was made from, noise aside.
    spec: SceneSpec,
    /// The input as it was read.
    pub input: Input,
    /// Measures results against the surface as it was read.
    pub judge: Judge,
    clean: Ready,
    /// The shape with the noise of the last request.
    noisy: Option<(Noise, Ready)>,
}

/// A shape, and warnings about its initial medial mesh.
struct Ready {
    shape: Shape,
    initial: Option<Initial>,
}

impl Ready {
    fn new(shape: Shape) -> Self {
        let initial = shape.view().initial().ok();
        let initial = initial.map(|mesh| Initial::of(&mesh, shape.expected_betti()));
        Self { shape, initial }
    }
}

impl Scene {
    /// Reads or makes the input, and builds what every item on it needs.
    ///
    /// # Errors
    /// Why the input is refused, in a sentence that names it.
    pub fn load(spec: &SceneSpec) -> Result<Self, String> {
        let input = Input::load(&spec.source).map_err(|error| error.to_string())?;
        if let Some(planned) = spec.hash.as_ref().filter(|&hash| *hash != input.hash) {
            return Err(format!(
                "{}: the file has changed since the run was planned (SHA-256 {}, not {planned})",
                spec.source, input.hash
            ));
        }
        // The name in tables, which is unique in the study, not that of the file.
        let input = Input { name: spec.mesh.clone(), ..input };
        let shape = input.shape(spec.shape_options()).map_err(|error| error.to_string())?;
        let judge = shape
            .judge(input.axis.as_ref(), spec.measure.judge_options())
            .map_err(|error| error.to_string())?;
        let clean = Ready::new(shape);
        let spec = spec.without_noise();
        Ok(Self { spec, input, judge, clean, noisy: None })
    }

    /// Whether items of this spec run here, noise aside.
    pub fn serves(&self, spec: &SceneSpec) -> bool {
        self.spec == spec.without_noise()
    }

    /// Displaces the vertices, or takes them as they are: without noise, or with one of 0.
    ///
    /// # Errors
    /// Why the noisy surface is refused.
    pub fn set_noise(&mut self, noise: Option<Noise>) -> Result<(), String> {
        let noise = noise.filter(|noise| noise.eta > 0.0);
        if self.noisy.as_ref().map(|(noise, _)| *noise) == noise {
            return Ok(());
        }
        // The old one goes first, so that two are never there together.
        self.noisy = None;
        if let Some(noise) = noise {
            let (mesh, report) = displaced(&self.input.mesh, noise)?;
            let options = self.spec.shape_options();
            let shape = Shape::new(self.input.name.clone(), &mesh, report, options);
            let shape = shape.map_err(|error| error.to_string())?;
            self.noisy = Some((noise, Ready::new(shape)));
        }
        Ok(())
    }

    /// The shape that methods run on.
    pub fn shape(&self) -> &Shape {
        &self.ready().shape
    }

    fn ready(&self) -> &Ready {
        self.noisy.as_ref().map_or(&self.clean, |(_, ready)| ready)
    }

    /// A result as it is measured: in the unit of the clean surface, and without edges and faces where the study
    /// measures spheres alone.
    pub fn judged(&self, mesh: &MedialMesh) -> MedialMesh {
        let mesh = match &self.noisy {
            None => mesh.clone(),
            Some((_, noisy)) => {
                let (back, to) = (noisy.shape.normalisation(), self.clean.shape.normalisation());
                mesh.transformed(back.diagonal / to.diagonal, |p| to.forward(back.backward(p)))
            }
        };
        if self.spec.measure.spheres_alone { mesh.spheres_alone() } else { mesh }
    }

    /// A result in the units of the input.
    pub fn in_input_units(&self, mesh: &MedialMesh) -> MedialMesh {
        let back = self.shape().normalisation();
        mesh.to_input(back)
    }
}

/// A surface with its vertices displaced, or why that bounds no solid.
fn displaced(mesh: &TriMesh, noise: Noise) -> Result<(TriMesh, SurfaceReport), String> {
    let Noise { eta, seed } = noise;
    let mesh = medial_datasets::add_noise(mesh, eta, seed);
    let report = surface::validate(&mesh);
    let report = report.map_err(|error| format!("with noise {eta}, seed {seed}: {error}"))?;
    Ok((mesh, report))
}

impl SceneSpec {
    fn without_noise(&self) -> Self {
        Self { noise: None, ..self.clone() }
    }
}

/// The measurements of one result.
#[derive(Clone)]
pub struct Verdict {
    /// The evaluation.
    pub evaluation: Result<Evaluation, MetricError>,
    /// Wall-clock seconds of the evaluation.
    pub seconds: f64,
    /// SHA-256 of the result.
    pub hash: String,
}

/// Measures the results of all levels, in parallel. Equal results are measured once.
pub fn judge(scene: &Scene, runs: &[LevelRun]) -> Vec<Option<Verdict>> {
    let meshes: Vec<Option<&MedialMesh>> =
        runs.iter().map(|run| run.outcome.as_ref().ok().map(|result| &result.mesh)).collect();
    // The index of the first result that is equal, which can be its own.
    // Methods that stop early give one mesh for many counts, and measuring is the slow part.
    let firsts: Vec<usize> = (0..meshes.len())
        .map(|index| meshes.iter().position(|&mesh| mesh == meshes[index]).unwrap_or(index))
        .collect();
    let measured: Vec<Option<Verdict>> = (0..meshes.len())
        .into_par_iter()
        .map(|index| {
            let mesh = meshes[index].filter(|_| firsts[index] == index)?;
            Some(judge_one(scene, mesh))
        })
        .collect();
    firsts.into_iter().map(|first| measured[first].clone()).collect()
}

fn judge_one(scene: &Scene, mesh: &MedialMesh) -> Verdict {
    let hash = mesh_hash(mesh);
    // Hashed before: the hash is that of the method's own output.
    let mesh = scene.judged(mesh);
    let begun = Instant::now();
    let evaluation = scene.judge.evaluate_certified(&mesh, scene.spec.measure.certify);
    let seconds = begun.elapsed().as_secs_f64();
    Verdict { evaluation, seconds, hash }
}

/// SHA-256 of spheres, edges and faces: equal for equal meshes only.
pub fn mesh_hash(mesh: &MedialMesh) -> String {
    let mut hasher = Sha256::new();
    let counts = [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()];
    // Counts first: without them a face could pass for part of an edge list.
    counts.iter().for_each(|&count| hasher.update((count as u64).to_le_bytes()));
    for sphere in &mesh.spheres {
        let numbers = [sphere.centre.x, sphere.centre.y, sphere.centre.z, sphere.radius];
        numbers.iter().for_each(|number| hasher.update(number.to_le_bytes()));
    }
    let indices = mesh.edges.as_flattened().iter().chain(mesh.faces.as_flattened());
    indices.for_each(|index| hasher.update(index.to_le_bytes()));
    hex(&hasher.finalize())
}

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
        threads: Some(item.threads),
        version: provenance.version.clone(),
        ..Simplify::asked(&item.method.id, level, *status)
    };
    let scene = &item.scene;
    let seeds = [("method", item.seed), ("evaluation", scene.measure.seed)];
    Record {
        key: item.key(level),
        mesh: scene.mesh.clone(),
        dataset: scene.source.dataset().map(str::to_owned),
        mesh_hash: scene.hash.clone(),
        status: *status,
        reason: Some(reason.clone()),
        simplify,
        evaluate: None,
        evaluate_seconds: None,
        initial: None,
        conditions: Some(Conditions {
            sampling: scene.sampling.to_string(),
            dual: scene.dual.to_string(),
            samples: scene.measure.samples,
            seconds_limit: item.limits.seconds,
            bytes_limit: item.limits.bytes,
            budget: item.limits.budget,
            jobs: 1,
            fingerprint: item.method.fingerprint.clone(),
        }),
        result_hash: None,
        seeds: seeds.map(|(purpose, seed)| (purpose.to_owned(), seed)).into(),
        repetitions: vec![],
        machine: provenance.machine.clone(),
        method_version: item.version.clone(),
        binary_hash: item.binary.clone(),
        command: provenance.command.clone(),
        version: provenance.version.clone(),
        artifact: None,
        edition: None,
        is_other_version: false,
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
    record.initial = scene.ready().initial;
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
    record.simplify.warnings.extend(scene.shape().sampling_warning());
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
    if let Some(axes) = axes.filter(|_| item.keep.keeps(item, run.level, spheres)) {
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
    simplify.own_seconds = result.extras.get().map(|&plugin::OwnSeconds { prepare, simplify }| {
        medial_reports::OwnSeconds { prepare, simplify }
    });
}

/// `ok`, or the fault of a result whose count is more than 2 % off the requested one.
pub fn count_fault(level: Target, result: &Simplified) -> Fault {
    let reached = result.mesh.spheres.len();
    match level {
        Target::Spheres(asked)
            if reached.abs_diff(asked) as f64 > COUNT_TOLERANCE * asked as f64 =>
        {
            let why = result.diagnostics.warnings.join("; ");
            let why = if why.is_empty() { why } else { format!(": {why}") };
            let reason = format!("{reached} spheres where {asked} were asked{why}");
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
