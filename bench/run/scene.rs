//! A scene: an input with its substrates and its judge, which items on it share.

use medial::complex::MedialMesh;
use medial::metrics::Judge;
use medial::shape::Shape;
use medial::surface::{self, SurfaceReport, TriMesh};
use medial_reports::Initial;

use super::{Input, Measure, Noise, SceneSpec};

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
        let input = Input { name: spec.mesh.clone(), ..input };
        let shape = input.shape(spec.shape_options()).map_err(|error| error.to_string())?;
        let judge = shape
            .judge(input.axis.as_ref(), spec.measure.judge_options())
            .map_err(|error| error.to_string())?;
        let clean = Ready::new(shape);
        let spec = spec.without_noise();
        Ok(Self { spec, input, judge, clean, noisy: None })
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

    /// A result in the unit of the surface that it is measured against.
    pub fn carried(&self, mesh: &MedialMesh) -> MedialMesh {
        let Some((_, noisy)) = &self.noisy else { return mesh.clone() };
        let (back, to) = (noisy.shape.normalisation(), self.clean.shape.normalisation());
        mesh.transformed(back.diagonal / to.diagonal, |p| to.forward(back.backward(p)))
    }

    /// A result in the units of the input.
    pub fn in_input_units(&self, mesh: &MedialMesh) -> MedialMesh {
        let back = self.shape().normalisation();
        mesh.transformed(back.diagonal, |p| back.backward(p))
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
