//! A closed surface with its substrates, each built once.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use medial::complex::{DualTriangulation, MedialMesh};
use medial::metrics::{Judge, JudgeOptions};
use medial::shape::{Shape, ShapeOptions};
use medial::surface::{
    self, Components, InsideTest, Loaded, MendOptions, Normalisation, Sampling, SignedDistance,
    SurfaceError, SurfaceReport, TriMesh, TriangleBvh, WrapOptions,
};
use medial_run::input::{Input, Source};
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::calls::{Call, Failure, Kind, Once, long, of_points, of_rows, points, triples};

/// A surface that bounds a solid, in its own units.
#[pyclass(frozen, module = "medial_axis._medial")]
pub struct Surface {
    /// Shared with the threads of long calls.
    pub model: Arc<Model>,
    vertices: Once,
    faces: Once,
}

/// The surface and its substrates.
pub struct Model {
    pub name: String,
    /// In its own units.
    pub mesh: TriMesh,
    report: SurfaceReport,
    /// The exactly known medial axis of a built-in shape.
    pub truth: Option<MedialMesh>,
    tree: OnceLock<TriangleBvh>,
    inside: OnceLock<InsideTest>,
    /// Shapes by their options.
    shapes: Mutex<Vec<(ShapeOptions, Shape)>>,
    /// The last judge, which serves calls with the same options.
    judge: Mutex<Option<Arc<Judge>>>,
}

impl Model {
    fn new(name: String, loaded: Loaded, truth: Option<MedialMesh>) -> Self {
        let Loaded { mesh, report } = loaded;
        let (tree, inside) = (OnceLock::new(), OnceLock::new());
        let (shapes, judge) = (Mutex::default(), Mutex::default());
        Self { name, mesh, report, truth, tree, inside, shapes, judge }
    }

    /// The shape with these options. Equal options give the same shape with its substrates.
    pub fn shape(&self, options: &ShapeOptions) -> Result<Shape, Failure> {
        let mut shapes = self.shapes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, shape)) = shapes.iter().find(|(known, _)| known == options) {
            return Ok(shape.view());
        }
        let shape =
            Shape::new(self.name.clone(), &self.mesh, self.report.clone(), options.clone())?;
        shapes.push((options.clone(), shape.view()));
        Ok(shape)
    }

    /// The judge for medial meshes of this surface.
    pub fn judge(&self, options: JudgeOptions) -> Result<Arc<Judge>, Failure> {
        let mut judge = self.judge.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = judge.as_ref().filter(|known| known.options() == options) {
            return Ok(Arc::clone(known));
        }
        let made = self.shape(&ShapeOptions::default())?.judge(self.truth.as_ref(), options)?;
        Ok(Arc::clone(judge.insert(Arc::new(made))))
    }

    fn tree(&self) -> Result<&TriangleBvh, Failure> {
        if let Some(tree) = self.tree.get() {
            return Ok(tree);
        }
        let tree = TriangleBvh::new(&self.mesh)?;
        Ok(self.tree.get_or_init(|| tree))
    }

    fn inside(&self) -> &InsideTest {
        self.inside.get_or_init(|| InsideTest::new(&self.mesh))
    }
}

impl Surface {
    /// A surface that was validated before.
    pub fn new(name: String, loaded: Loaded, truth: Option<MedialMesh>) -> Self {
        let model = Arc::new(Model::new(name, loaded, truth));
        Self { model, vertices: Once::default(), faces: Once::default() }
    }
}

/// Samples and dual of a shape from their words.
pub fn shape_options(sampling: &str, dual: &str, seed: u64) -> Result<ShapeOptions, Failure> {
    let parsed: Sampling =
        sampling.parse().map_err(|error| Failure::parameter(format!("sampling: {error}")))?;
    // A seed in the word itself takes precedence over that of the call.
    let has_seed = sampling.split(':').count() > 2;
    let dual = match dual {
        "fan" => DualTriangulation::Fan,
        "delaunay" => DualTriangulation::Delaunay,
        dual => return Err(Failure::parameter(format!("{dual:?}: expected dual fan or delaunay"))),
    };
    let sampling = if has_seed { parsed } else { parsed.with_seed(seed) };
    Ok(ShapeOptions { sampling, dual })
}

#[pymethods]
impl Surface {
    /// A file, `builtin:ID` or `dataset:NAME`.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, call: Call) -> PyResult<Self> {
        long(py, &call, move |_, monitor| {
            monitor.at("reading");
            let Input { name, mesh, report, axis, .. } = Input::load(&Source::parse(&path)?)?;
            Ok(Self::new(name, Loaded { mesh, report }, axis))
        })
    }

    /// Arrays, repaired and oriented as a file would be.
    #[staticmethod]
    fn from_arrays(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, u32>,
        name: String,
        call: Call,
    ) -> PyResult<Self> {
        let (vertices, faces) = (points(&vertices)?, triples(&faces)?);
        long(py, &call, move |_, monitor| {
            monitor.at("reading");
            let loaded = surface::read_triangles(&vertices, &faces)?;
            Ok(Self::new(name, loaded, None))
        })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.model.name
    }

    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.vertices.get(py, || of_points(py, self.model.mesh.vertices.iter().copied()))
    }

    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.faces.get(py, || of_rows(py, self.model.mesh.faces.iter().copied()))
    }

    /// Bounding-box diagonal; zero without an extent.
    #[getter]
    fn diagonal(&self) -> f64 {
        Normalisation::of(&self.model.mesh).map_or(0.0, |units| units.diagonal)
    }

    /// A surface that bounds a solid, from a file or from the text of an OFF file, after optional repairs.
    #[staticmethod]
    #[allow(clippy::too_many_arguments)]
    fn repair(
        py: Python<'_>,
        path: PathBuf,
        off: Option<Vec<u8>>,
        fill_holes: bool,
        wrap: Option<f64>,
        components: &str,
        name: Option<String>,
        call: Call,
    ) -> PyResult<Self> {
        let components = components.parse::<Components>();
        let components = components
            .map_err(|why| Failure::new(Kind::Parameter, format!("components: {why}")))?;
        let options = MendOptions { fill_holes, components };
        long(py, &call, move |_, monitor| {
            monitor.at("repairing");
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            // Arrays come as the text of a file that has no name.
            let is_array = off.is_some();
            let (path, text) = match off {
                Some(text) => (Path::new("mesh.off"), text),
                None => (&*path, surface::content(&path)?),
            };
            let inspected = match wrap {
                Some(alpha) => {
                    surface::inspect_wrapped(path, &text, WrapOptions::with_alpha(alpha))
                }
                None => surface::inspect_bytes(path, &text),
            };
            let loaded = inspected.and_then(|found| found.mend(options));
            let loaded = loaded.map_err(|error| SurfaceError {
                file: error.file.filter(|_| !is_array),
                ..error
            })?;
            Ok(Self::new(name.unwrap_or(stem), loaded, None))
        })
    }

    /// The report of reading it, as JSON.
    fn report(&self) -> PyResult<String> {
        let json = serde_json::to_string(&self.model.report);
        Ok(json.map_err(|error| Failure::new(Kind::Internal, error))?)
    }

    fn save(&self, path: PathBuf) -> PyResult<()> {
        Ok(surface::write(path, &self.model.mesh).map_err(Failure::from)?)
    }

    /// For each point the closest one of the surface, its distance and its face.
    fn closest_points<'py>(
        &self,
        py: Python<'py>,
        queries: PyReadonlyArray2<'py, f64>,
        call: Call,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let queries = points(&queries)?;
        let model = Arc::clone(&self.model);
        let found = long(py, &call, move |_, monitor| {
            monitor.at("searching the closest points");
            Ok(model.tree()?.closest_batch(&queries))
        })?;
        let distances = PyArray1::from_iter(py, found.iter().map(|closest| closest.distance));
        let faces = PyArray1::from_iter(py, found.iter().map(|closest| closest.face));
        let found = of_points(py, found.iter().map(|closest| closest.point))?;
        Ok((found.into_any(), distances.into_any(), faces.into_any()))
    }

    /// The distances of points to the surface, negative inside.
    fn signed_distance<'py>(
        &self,
        py: Python<'py>,
        queries: PyReadonlyArray2<'py, f64>,
        call: Call,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let queries = points(&queries)?;
        let model = Arc::clone(&self.model);
        let found = long(py, &call, move |_, monitor| {
            monitor.at("measuring signed distances");
            let distance = SignedDistance::closed(model.tree()?, model.inside());
            Ok(distance.batch(&queries))
        })?;
        Ok(PyArray1::from_vec(py, found))
    }
}
