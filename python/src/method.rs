//! Methods: those of the program by their ids, and Python classes as [`MedialSimplifier`].
//!
//! `medial_axis/_plugins.py` describes, checks, prepares and runs a class. This file converts its results to those of a
//! method, and its exceptions to errors. All inputs and outputs of a class are in normalised units: lengths are fractions
//! of the bounding-box diagonal.

use std::path::Path;
use std::sync::OnceLock;

use medial::complex::MedialMesh;
use medial::metrics::JudgeOptions;
use medial::shape::Shape;
use medial::simplifier::{
    Level, MedialSimplifier, MethodInfo, NativeLevel, ParamInfo, Params, Presentation, Registered,
    RunContext, Simplification, Simplified, SimplifyError,
};
use medial::surface::Side;
use medial_bench::plugin::ScriptLoader;
use medial_bench::study::no_such_method;
use medial_bench::study::registry::{Entry, Registry};
use medial_run::level::Target;
use medial_run::simplify::{Output as RunOutput, Request};
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};
use pyo3::prelude::*;
use serde::Deserialize;
use serde_json::{Map, Value, json};

use crate::axis::Axis;
use crate::calls::{Call, Failure, Kind, long, of_points, of_rows, points};

/// The Python module that calls the classes.
const BETWEEN: &str = "medial_axis._plugins";

fn registry() -> &'static Registry {
    static REGISTRY: OnceLock<Registry> = OnceLock::new();
    REGISTRY.get_or_init(|| {
        Registry::new(medial_methods::registry()).expect("the ids of the program differ")
    })
}

/// The descriptions of the methods of the program, as JSON.
#[pyfunction]
pub fn methods() -> PyResult<String> {
    Ok(serde_json::to_string(&registry().entries)
        .map_err(|error| Failure::new(Kind::Internal, error))?)
}

/// A method of either kind.
pub enum Method {
    /// Of the program.
    BuiltIn(&'static Entry),
    /// A class.
    Class(Box<ClassMethod>),
}

impl Method {
    /// The method that an id or a class names.
    pub fn find(name: &Bound<'_, PyAny>) -> PyResult<Self> {
        let Ok(id) = name.extract::<String>() else {
            return Ok(Self::Class(Box::new(ClassMethod::new(name)?)));
        };
        let known =
            || registry().entries.iter().map(|entry| entry.id().to_owned()).collect::<Vec<_>>();
        match registry().entry(&id) {
            Some(entry) => Ok(Self::BuiltIn(entry)),
            None => Err(Failure::parameter(no_such_method(&id, &known())).into()),
        }
    }

    /// The method.
    pub fn get(&self) -> &dyn MedialSimplifier {
        match self {
            Self::BuiltIn(entry) => entry.method(),
            Self::Class(method) => method.as_ref(),
        }
    }

    /// Native levels of a default comparison.
    pub fn sweep(&self) -> &[f64] {
        match self {
            Self::BuiltIn(entry) => &entry.presentation.sweep,
            Self::Class(method) => &method.presentation.sweep,
        }
    }
}

/// The level of a call: at most one of the three is given.
fn level(
    spheres: Option<usize>,
    native: Option<f64>,
    bound: Option<f64>,
) -> Result<Target, Failure> {
    let given = [spheres.is_some(), native.is_some(), bound.is_some()];
    if given.iter().filter(|is_given| **is_given).count() > 1 {
        return Err(Failure::parameter("several levels; give one of spheres, level and max_error"));
    }
    if let Some(bound) = bound.filter(|bound| !(*bound > 0.0 && *bound < 1.0)) {
        let message = format!("max_error = {bound}: expected a fraction between 0 and 1");
        return Err(Failure::parameter(message));
    }
    let of_count = spheres.map(Target::Spheres);
    Ok(of_count
        .or(native.map(Target::Native))
        .or(bound.map(Target::MaxError))
        .unwrap_or(Target::Published))
}

/// A simplification of a medial mesh by a method, at a level, and the facts of the run as JSON.
#[pyfunction]
#[pyo3(signature = (axis, method, spheres, native, bound, params, call))]
#[allow(clippy::too_many_arguments)]
pub fn simplify(
    py: Python<'_>,
    axis: &Axis,
    method: &Bound<'_, PyAny>,
    spheres: Option<usize>,
    native: Option<f64>,
    bound: Option<f64>,
    params: &str,
    call: Call,
) -> PyResult<(Axis, String)> {
    let method = Method::find(method)?;
    let level = level(spheres, native, bound)?;
    let map: Map<String, Value> = serde_json::from_str(params)
        .map_err(|error| Failure::parameter(format!("parameters: {error}")))?;
    let start = axis.start()?;
    let home = axis.shape.clone();
    let params = Params(map);
    let (simplified, facts) = long(py, &call, move |context, monitor| {
        let judge = JudgeOptions { seed: context.seed, ..JudgeOptions::default() };
        let request = Request {
            shape: &start,
            method: method.get(),
            sweep: method.sweep(),
            params: &params,
            context,
            judge,
            certify: false,
            spheres_alone: false,
            on_stage: &|stage| monitor.at(stage),
        };
        let RunOutput { simplify, result, search } =
            request.run(level).map_err(Failure::of_fault)?;
        let mesh = result.mesh.to_input(start.normalisation());
        let asked = simplify.level.to_string();
        let facts = json!({ "asked": asked, "simplify": simplify, "max_error": search });
        Ok((mesh, facts.to_string()))
    })?;
    Ok((Axis::new(simplified, home), facts))
}

/// A Python class as a method.
pub struct ClassMethod {
    class: Py<PyAny>,
    info: MethodInfo,
    presentation: Presentation,
}

/// The description of a class, from `_plugins.describe`.
#[derive(Deserialize)]
struct Described {
    id: String,
    title: String,
    citation: String,
    summary: String,
    native: Option<NativeLevel>,
    sweep: Vec<f64>,
    params: Vec<ParamInfo>,
    published: Option<String>,
    on_request: bool,
    incremental: bool,
    seeded: bool,
}

impl ClassMethod {
    fn new(class: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = class.py();
        let text: String = py.import(BETWEEN)?.call_method1("describe", (class,))?.extract()?;
        let described: Described = serde_json::from_str(&text)
            .map_err(|error| Failure::new(Kind::Internal, format!("describe: {error}")))?;
        let presentation = Presentation {
            sweep: described.sweep.clone(),
            on_request: described.on_request,
            ..Presentation::default()
        };
        Ok(Self { class: class.clone().unbind(), info: described.into(), presentation })
    }
}

impl From<Described> for MethodInfo {
    fn from(described: Described) -> Self {
        let Described {
            id,
            title,
            citation,
            summary,
            native,
            params,
            published,
            incremental,
            seeded,
            ..
        } = described;
        let info = Self::new(id, title).citation(citation).summary(summary).params(params);
        let info = Self { native, incremental, seeded, ..info };
        match published {
            Some(published) => info.published(published),
            None => info,
        }
    }
}

impl MedialSimplifier for ClassMethod {
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        let params = serde_json::to_string(params).expect("plain data");
        Python::attach(|py| {
            let between = py.import(BETWEEN)?;
            let shape = ShapeHandle { shape: shape.clone() };
            let given = (&self.class, shape, params, RunHandle { run: run.clone() });
            let prepared = between.call_method1("prepare", given)?;
            Ok(Box::new(Prepared(prepared.unbind())) as Box<dyn Simplification + 's>)
        })
        .map_err(of_exception)
    }
}

/// An instance that is prepared for a shape.
struct Prepared(Py<PyAny>);

impl Simplification for Prepared {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let (kind, value) = match level {
            Level::Published => ("published", 0.0),
            Level::Spheres(0) => {
                return Err(SimplifyError::Level("give at least one sphere".into()));
            }
            Level::Spheres(count) => ("spheres", count as f64),
            Level::Native(value) if !value.is_finite() => {
                return Err(SimplifyError::Level(format!("{value}: expected a finite number")));
            }
            Level::Native(value) => ("native", value),
        };
        let output = Python::attach(|py| {
            let output = py.import(BETWEEN)?.call_method1("at", (&self.0, kind, value))?;
            output.extract::<Output>()
        });
        let output = output.map_err(of_exception)?;
        let mesh = MedialMesh::clone(&output.axis.get().mesh);
        let mut simplified = Simplified::new(mesh, level);
        simplified.native_level = output.native_level;
        output.warnings.into_iter().for_each(|warning| simplified.diagnostics.warn(warning));
        Ok(simplified)
    }
}

/// The return value of `_plugins.at`.
#[derive(FromPyObject)]
struct Output {
    axis: Py<Axis>,
    native_level: Option<f64>,
    warnings: Vec<String>,
}

/// An exception of a class as the error of a method.
fn of_exception(error: PyErr) -> SimplifyError {
    Python::attach(|py| {
        let message = error.value(py).to_string();
        if is_error(py, &error, "UnsupportedError") {
            return SimplifyError::unsupported(message);
        }
        if is_error(py, &error, "ParameterError") {
            return SimplifyError::Parameter(message);
        }
        if is_error(py, &error, "CancelledError") || error.is_instance_of::<PyKeyboardInterrupt>(py)
        {
            return SimplifyError::Cancelled;
        }
        // The type, the message and the innermost line of the user's file.
        let text = py.import(BETWEEN).and_then(|m| m.call_method1("error_text", (&error,)));
        let text = text.and_then(|text| text.extract::<String>()).unwrap_or(message);
        if error.is_instance_of::<PyMemoryError>(py) {
            return SimplifyError::OutOfMemory(text);
        }
        SimplifyError::Failed(text)
    })
}

/// Whether an exception is of this class of `medial_axis/errors.py`.
fn is_error(py: Python<'_>, error: &PyErr, name: &str) -> bool {
    let class = py.import("medial_axis.errors").and_then(|module| module.getattr(name));
    class.is_ok_and(|class| error.is_instance(py, &class))
}

/// Loads the classes of a file.
pub struct Classes;

impl ScriptLoader for Classes {
    fn load(&self, path: &Path) -> Result<Vec<Registered>, String> {
        Python::attach(|py| {
            let classes = py.import(BETWEEN)?.call_method1("load", (path,))?;
            let methods = classes.try_iter()?.map(|class| {
                let method = ClassMethod::new(&class?)?;
                let presentation = method.presentation.clone();
                Ok(Registered { method: Box::new(method), presentation, version: None })
            });
            methods.collect::<PyResult<Vec<_>>>()
        })
        .map_err(|error: PyErr| match of_exception(error) {
            SimplifyError::Failed(why) | SimplifyError::Parameter(why) => why,
            other => other.to_string(),
        })
    }
}

/// The shape for a class, in normalised units. Substrates are built once for all methods, on demand, and recorded as
/// used by the class.
#[pyclass(frozen, module = "medial_axis._medial")]
pub struct ShapeHandle {
    shape: Shape,
}

#[pymethods]
impl ShapeHandle {
    #[getter]
    fn name(&self) -> &str {
        self.shape.name()
    }

    /// Bounding-box diagonal of the input, in its units.
    #[getter]
    fn diagonal(&self) -> f64 {
        self.shape.normalisation().diagonal
    }

    #[getter]
    fn expected_betti(&self) -> Option<(u64, u64, u64)> {
        self.shape.expected_betti().map(Into::into)
    }

    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(of_points(py, self.shape.mesh().vertices.iter().copied())?.into_any())
    }

    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(of_rows(py, self.shape.mesh().faces.iter().copied())?.into_any())
    }

    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let samples = py.detach(|| self.shape.samples());
        Ok(of_points(py, samples.iter().copied())?.into_any())
    }

    fn initial(&self, py: Python<'_>) -> PyResult<Axis> {
        let initial = py.detach(|| self.shape.initial()).map_err(Failure::from)?;
        Ok(Axis::new(MedialMesh::clone(&initial), None))
    }

    /// Which points are inside.
    fn inside<'py>(
        &self,
        py: Python<'py>,
        queries: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let queries = points(&queries)?;
        let sides = py.detach(|| self.shape.inside_test().sides(&queries));
        Ok(PyArray1::from_iter(py, sides.into_iter().map(|side| side == Side::Inside)))
    }

    /// The distances of points to the surface.
    fn distances<'py>(
        &self,
        py: Python<'py>,
        queries: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let queries = points(&queries)?;
        let tree = py.detach(|| self.shape.surface_tree()).map_err(Failure::from)?;
        Ok(PyArray1::from_vec(py, py.detach(|| tree.distance_batch(&queries))))
    }
}

/// The context of a run, for a class.
#[pyclass(frozen, module = "medial_axis._medial")]
pub struct RunHandle {
    run: RunContext,
}

#[pymethods]
impl RunHandle {
    #[getter]
    fn seed(&self) -> u64 {
        self.run.seed
    }

    /// Number of threads to use.
    #[getter]
    fn threads(&self) -> usize {
        rayon::current_num_threads()
    }

    /// Reports progress; raises when the run was cancelled.
    fn step(&self, done: usize, total: usize) -> PyResult<()> {
        Ok(self.run.step(done, total).map_err(|_| Failure::new(Kind::Cancelled, "cancelled"))?)
    }
}
