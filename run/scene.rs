//! The scene of an item, and the evaluation of its results. Nothing that is measured here counts as a method's time.

use std::time::Instant;

use medial::complex::MedialMesh;
use medial::metrics::{Evaluation, Judge, MetricError};
use medial::shape::Shape;
use medial::surface::{self, SurfaceReport, TriMesh};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::hash::mesh_hash;
use crate::input::{Input, Source};
use crate::record::Initial;
use crate::settings::Settings;
use crate::timed::LevelRun;

/// The state that consecutive items can share: the input with its substrates, and the judge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// Name of the input in tables.
    pub mesh: String,
    /// Origin of the input.
    pub source: Source,
    /// SHA-256 of the input's file; of a built-in shape its surface and known axis.
    pub hash: Option<String>,
    /// Displacements of the vertices. Results are measured against the input without them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// How the input is prepared and results are measured.
    pub settings: Settings,
}

/// Random displacements of the vertices of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// The largest displacement, as a fraction of the bounding-box diagonal.
    pub eta: f64,
    /// Seed of the displacements.
    pub seed: u64,
}

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
        let shape =
            input.shape(spec.settings.shape_options()).map_err(|error| error.to_string())?;
        let judge = shape
            .judge(input.axis.as_ref(), spec.settings.judge_options())
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
            let options = self.spec.settings.shape_options();
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

    /// Counts and topology of the start of all methods.
    pub fn initial(&self) -> Option<Initial> {
        self.ready().initial
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
        if self.spec.settings.spheres_alone { mesh.spheres_alone() } else { mesh }
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
    let evaluation = scene.judge.evaluate_certified(&mesh, scene.spec.settings.certify);
    let seconds = begun.elapsed().as_secs_f64();
    Verdict { evaluation, seconds, hash }
}
