//! A scene: an input with its substrates and its judge, which items on it share.

use std::collections::BTreeMap;

use medial::complex::MedialMesh;
use medial::metrics::{AxisOptions, Judge, axis_distance};
use medial::shape::Shape;
use medial::surface::{self, SurfaceReport, TriMesh};
use medial_reports::{AxisShift, Initial, Target};

use super::{Input, Measure, MethodSpec, Noise, SceneSpec};

/// An input, ready to be simplified and measured, with noise or without.
pub struct Scene {
    /// What it was made from, noise aside.
    spec: SceneSpec,
    /// The input as it was read.
    pub input: Input,
    /// Measures results against the surface as it was read.
    pub judge: Judge,
    clean: Ready,
    /// The shape with the noise that was asked last.
    noisy: Option<(Noise, Ready)>,
    /// Results without noise, by method and level, that noisy ones are compared with.
    references: BTreeMap<String, MedialMesh>,
}

/// A shape, and what is to be said of its initial medial mesh.
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
        let mut input = Input { name: spec.mesh.clone(), ..input };
        if let Some(factor) = spec.scaled {
            input = scaled(input, factor)?;
        }
        if let Some(noise) = spec.displaced {
            (input.mesh, input.report) = displaced(&input.mesh, noise)?;
            input.axis = None;
        }
        let shape = input.shape(spec.shape_options()).map_err(|error| error.to_string())?;
        let judge = shape
            .judge(input.axis.as_ref(), spec.measure.judge_options())
            .map_err(|error| error.to_string())?;
        let clean = Ready::new(shape);
        let spec = spec.without_noise();
        Ok(Self { spec, input, judge, clean, noisy: None, references: BTreeMap::new() })
    }

    /// How results are measured.
    pub fn measure(&self) -> Measure {
        self.spec.measure
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

    /// The initial medial mesh of that shape; `None` where there is none.
    pub fn initial(&self) -> Option<Initial> {
        self.ready().initial
    }

    fn ready(&self) -> &Ready {
        self.noisy.as_ref().map_or(&self.clean, |(_, ready)| ready)
    }

    /// The shape without noise, where there is noise.
    pub fn clean(&self) -> Option<&Shape> {
        self.noisy.as_ref().map(|_| &self.clean.shape)
    }

    /// Spheres of the initial medial mesh over those of the one without noise.
    pub fn growth(&self) -> Option<f64> {
        Some(self.initial()?.spheres as f64 / self.clean.initial?.spheres as f64)
    }

    /// A result in the unit of the surface that it is measured against.
    pub fn carried(&self, mesh: &MedialMesh) -> MedialMesh {
        let Some(clean) = self.clean() else { return mesh.clone() };
        let (back, to) = (self.shape().normalisation(), clean.normalisation());
        mesh.transformed(back.diagonal / to.diagonal, |p| to.forward(back.backward(p)))
    }

    /// A result in the units of the input.
    pub fn in_input_units(&self, mesh: &MedialMesh) -> MedialMesh {
        let back = self.shape().normalisation();
        mesh.transformed(back.diagonal, |p| back.backward(p))
    }

    /// Keeps a result without noise, for [`Scene::reference`].
    pub fn remember(&mut self, key: String, mesh: MedialMesh) {
        self.references.insert(key, mesh);
    }

    /// A result without noise that was kept.
    pub fn reference(&self, key: &str) -> Option<&MedialMesh> {
        self.references.get(key)
    }

    /// Distances of a carried result to the one without noise.
    pub fn shift(&self, carried: &MedialMesh, reference: &MedialMesh) -> Option<AxisShift> {
        let options = self.judge.options();
        let options = AxisOptions { samples: options.samples, seed: options.seed };
        let shift = axis_distance(carried, reference, &options).ok()?;
        Some(AxisShift { in_space: shift.in_space, with_radius: shift.with_radius })
    }
}

/// An input in another unit of length, or why that bounds no solid.
fn scaled(input: Input, factor: f64) -> Result<Input, String> {
    let Input { name, hash, mut mesh, axis, .. } = input;
    mesh.vertices.iter_mut().for_each(|v| *v *= factor);
    let report = surface::validate(&mesh).map_err(|error| format!("times {factor}: {error}"))?;
    let axis = axis.map(|axis| axis.transformed(factor, |p| p * factor));
    Ok(Input { name, hash, mesh, report, axis })
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

/// Under which name a result without noise is kept.
pub fn reference_key(method: &MethodSpec, seed: u64, level: Target) -> String {
    serde_json::to_string(&(method, seed, level)).expect("plain data")
}

#[cfg(test)]
mod tests {
    use medial::metrics::JudgeOptions;
    use medial::surface::Sampling;

    use super::*;
    use crate::run::{Dual, Source};

    #[test]
    fn another_unit_of_length_changes_the_diagonal_alone() {
        let spec = |scaled| SceneSpec {
            mesh: "torus".into(),
            source: Source::BuiltIn { id: "torus".into(), resolution: Some(16) },
            hash: None,
            scaled,
            displaced: None,
            noise: None,
            sampling: Sampling::default(),
            dual: Dual::Fan,
            measure: JudgeOptions { samples: 200, volume_depth: 0, seed: 0 }.into(),
        };
        let [plain, large] =
            [None, Some(1024.0)].map(|scaled| Scene::load(&spec(scaled)).expect("a solid"));
        let diagonal = |scene: &Scene| scene.shape().normalisation().diagonal;
        assert_eq!(diagonal(&large), 1024.0 * diagonal(&plain));
        let initial = |scene: &Scene| scene.shape().view().initial().expect("an axis");
        // A power of two leaves all digits as they are.
        assert_eq!(initial(&large), initial(&plain));
        let axis = |scene: &Scene| {
            let measured = scene.judge.evaluate(&initial(scene)).expect("measured");
            measured.axis.expect("the axis of a torus is known").in_space
        };
        assert_eq!(axis(&large), axis(&plain));
    }
}
