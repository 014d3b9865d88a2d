//! A medial mesh, in the units of its surface.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use medial::Vec3;
use medial::complex::{self, Contacts, Look, MedialMesh, ReadOptions, SphereValues};
use medial::geometry::Sphere;
use medial::metrics::JudgeOptions;
use medial::shape::{Shape, ShapeOptions};
use medial::surface::{self, Loaded, SurfaceReport, TriMesh};
use medial_run::axis::{AxisOptions, read_axis};
use medial_run::evaluate::Evaluator;
use medial_run::reconstruct::union_boundary;
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::calls::{
    Call, Failure, Kind, Once, advice_in_python, long, of_points, of_rows, points, triples,
};
use crate::surface::{Surface, shape_options};

/// A medial mesh in input units, with its shape if that is known.
#[pyclass(frozen, module = "medial_axis._medial")]
pub struct Axis {
    /// In input units.
    pub mesh: Arc<MedialMesh>,
    /// Its shape, if that is known.
    pub shape: Option<Shape>,
    /// Whether it is the initial medial mesh of its shape.
    is_initial: bool,
    centres: Once,
    radii: Once,
    edges: Once,
    faces: Once,
}

impl Axis {
    /// A medial mesh, in input units.
    pub fn new(mesh: MedialMesh, shape: Option<Shape>) -> Self {
        Self {
            mesh: Arc::new(mesh),
            shape,
            is_initial: false,
            centres: Once::default(),
            radii: Once::default(),
            edges: Once::default(),
            faces: Once::default(),
        }
    }

    /// The initial medial mesh of a shape, which has normalised units.
    pub fn initial(mesh: &MedialMesh, shape: Shape) -> Self {
        let mesh = mesh.to_input(shape.normalisation());
        Self { is_initial: true, ..Self::new(mesh, Some(shape)) }
    }

    /// The start of a method: the shape, with this mesh as the initial one.
    pub fn start(&self) -> Result<Shape, Failure> {
        let shape = self.shape.as_ref().ok_or_else(|| {
            Failure::input("this medial axis has no surface; read it by Mesh.read_axis, or set one by axis.of(mesh)")
        })?;
        let view = shape.view();
        Ok(if self.is_initial { view } else { view.with_initial(&self.mesh) })
    }
}

/// Contact samples and their indices, words of the shape's options, whether it is the initial medial mesh.
type State<'py> = (Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>, Option<(String, String)>, bool);

#[pymethods]
impl Axis {
    /// Arrays, as a complex in canonical form.
    #[staticmethod]
    fn from_arrays(
        centres: PyReadonlyArray2<'_, f64>,
        radii: numpy::PyReadonlyArray1<'_, f64>,
        edges: PyReadonlyArray2<'_, u32>,
        faces: PyReadonlyArray2<'_, u32>,
    ) -> PyResult<Self> {
        let (centres, radii) = (points(&centres)?, radii.as_array());
        if centres.len() != radii.len() {
            let (n, m) = (centres.len(), radii.len());
            return Err(Failure::input(format!("{n} centres, but {m} radii")).into());
        }
        let both = centres.into_iter().zip(radii);
        let spheres = both.map(|(centre, &radius)| Sphere::new(centre, radius)).collect();
        let faces = triples(&faces)?;
        let edges = edges.as_array().rows().into_iter().map(|row| [row[0], row[1]]).collect();
        let mesh = MedialMesh::from_simplices(spheres, edges, faces).map_err(Failure::from)?;
        Ok(Self::new(mesh, None))
    }

    /// The mesh in a file, or one of several (`block`, from 1), and remarks on it.
    #[staticmethod]
    fn read(path: &str, block: Option<usize>) -> PyResult<(Self, Vec<String>)> {
        let options = ReadOptions { block, ..ReadOptions::default() };
        let loaded = complex::read_with(Path::new(path), options).map_err(Failure::from)?;
        let (mesh, remarks) = loaded.with_remarks();
        Ok((Self::new(mesh, None), remarks))
    }

    /// The initial Voronoi medial mesh of a surface.
    #[staticmethod]
    fn of_surface(
        py: Python<'_>,
        surface: &Surface,
        sampling: &str,
        dual: &str,
        call: Call,
    ) -> PyResult<Self> {
        let options = shape_options(sampling, dual, call.seed)?;
        let model = Arc::clone(&surface.model);
        long(py, &call, move |_, monitor| {
            monitor.at("computing the medial axis");
            let shape = model.shape(&options)?;
            let initial = shape.initial()?;
            Ok(Self::initial(&initial, shape))
        })
    }

    /// A file as a medial mesh of a surface, read and fitted by options in JSON.
    #[staticmethod]
    fn read_for(
        py: Python<'_>,
        surface: &Surface,
        path: PathBuf,
        options: &str,
        call: Call,
    ) -> PyResult<(Self, Vec<String>)> {
        let options: AxisOptions = serde_json::from_str(options).map_err(Failure::parameter)?;
        let model = Arc::clone(&surface.model);
        long(py, &call, move |_, monitor| {
            monitor.at("reading");
            let shape = model.shape(&ShapeOptions::default())?;
            let (loaded, _) = read_axis(&path, &shape, options).map_err(Failure::input)?;
            let (mesh, remarks) = loaded.with_remarks();
            Ok((Self::new(mesh, Some(shape)), remarks))
        })
    }

    /// The exactly known medial axis of a built-in shape, for copies.
    #[staticmethod]
    fn truth(surface: &Surface) -> Option<Self> {
        surface.model.truth.clone().map(|mesh| Self::new(mesh, None))
    }

    /// The same mesh as one of a surface.
    fn of(&self, surface: &Surface, sampling: &str, dual: &str, seed: u64) -> PyResult<Self> {
        let shape = surface.model.shape(&shape_options(sampling, dual, seed)?)?;
        let mesh = Arc::clone(&self.mesh);
        Ok(Self { mesh, ..Self::new(MedialMesh::default(), Some(shape)) })
    }

    /// The further state, for a copy: the contact samples of the spheres (s x 3, and n x 4 indices), the sampling and the
    /// dual of the shape, and whether it is the initial medial mesh.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<State<'py>> {
        let contacts = match &self.mesh.contacts {
            None => None,
            Some(contacts) => Some((
                of_points(py, contacts.samples.iter().copied())?.into_any(),
                of_rows(py, contacts.of_sphere.iter().copied())?.into_any(),
            )),
        };
        let options = self.shape.as_ref().map(Shape::options);
        let options =
            options.map(|options| (options.sampling.to_string(), options.dual.to_string()));
        Ok((contacts, options, self.is_initial))
    }

    /// The same mesh with the [`state`](Self::state) of another one.
    fn with_state(
        &self,
        samples: Option<PyReadonlyArray2<'_, f64>>,
        of_sphere: Option<PyReadonlyArray2<'_, u32>>,
        surface: Option<&Surface>,
        options: Option<(String, String)>,
        is_initial: bool,
    ) -> PyResult<Self> {
        let mut mesh = MedialMesh::clone(&self.mesh);
        if let (Some(samples), Some(of_sphere)) = (samples, of_sphere) {
            let samples: Arc<[Vec3]> = points(&samples)?.into();
            let of_sphere: Vec<[u32; 4]> =
                of_sphere.as_array().rows().into_iter().map(|r| [r[0], r[1], r[2], r[3]]).collect();
            mesh.contacts = Some(Contacts { samples, of_sphere });
            mesh.check().map_err(Failure::from)?;
        }
        let shape = match (surface, options) {
            (Some(surface), Some((sampling, dual))) => {
                // The word has the seed, unless that is 0.
                Some(surface.model.shape(&shape_options(&sampling, &dual, 0)?)?)
            }
            _ => None,
        };
        Ok(Self { is_initial, ..Self::new(mesh, shape) })
    }

    #[getter]
    fn centres<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.centres.get(py, || of_points(py, self.mesh.spheres.iter().map(|s| s.centre)))
    }

    #[getter]
    fn radii<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.radii.get(py, || {
            Ok(PyArray1::from_iter(py, self.mesh.spheres.iter().map(|sphere| sphere.radius)))
        })
    }

    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.edges.get(py, || of_rows(py, self.mesh.edges.iter().copied()))
    }

    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.faces.get(py, || of_rows(py, self.mesh.faces.iter().copied()))
    }

    /// The selected spheres with the edges and faces between them and their contacts.
    fn induced(&self, keep: Vec<bool>) -> PyResult<Self> {
        let (given, count) = (keep.len(), self.mesh.spheres.len());
        if given != count {
            let message = format!("keep: wrong length (found {given}, expected {count})");
            return Err(Failure::input(message).into());
        }
        Ok(Self::new(self.mesh.induced(&keep), self.shape.clone()))
    }

    #[getter]
    fn betti(&self) -> (u64, u64, u64) {
        complex::betti(&self.mesh).into()
    }

    #[getter]
    fn euler(&self) -> i64 {
        complex::euler(&self.mesh)
    }

    /// Writes it by the extension of the path, for viewers coloured by these values.
    fn save(&self, path: PathBuf, color: Option<&str>, balls: bool) -> PyResult<Option<String>> {
        let values = match color {
            None => None,
            Some("stability") => Some(SphereValues::stability(&self.mesh, 1.0)),
            Some("radius") => None,
            Some(other) => {
                let message = format!("color = {other:?}: expected radius or stability");
                return Err(Failure::parameter(message).into());
            }
        };
        let left_out = complex::left_out(&path, &self.mesh);
        complex::write_with(path, &self.mesh, &Look { values, balls }).map_err(Failure::from)?;
        Ok(left_out)
    }

    /// All metrics against a surface, as JSON.
    fn evaluate(
        &self,
        py: Python<'_>,
        surface: &Surface,
        samples: usize,
        certify: Option<f64>,
        call: Call,
    ) -> PyResult<String> {
        let options = JudgeOptions { samples, seed: call.seed, ..JudgeOptions::default() };
        let (model, mesh) = (Arc::clone(&surface.model), Arc::clone(&self.mesh));
        long(py, &call, move |_, monitor| {
            monitor.at("preparing the surface");
            let shape = model.shape(&ShapeOptions::default())?;
            let judge = model.judge(options)?;
            monitor.at(if certify.is_some() { "measuring and certifying" } else { "measuring" });
            let (shape, judge) = (&shape, &*judge);
            let evaluator =
                Evaluator { shape, judge, certify, spheres_alone: false, reference: None };
            let evaluation = evaluator.evaluate(&mesh)?;
            serde_json::to_string(&evaluation).map_err(|error| Failure::new(Kind::Internal, error))
        })
    }

    /// The boundary of the union of spheres, cones and slabs, and the reason if it bounds no solid.
    fn reconstruct(
        &self,
        py: Python<'_>,
        tolerance: Option<f64>,
        name: String,
        call: Call,
    ) -> PyResult<(Surface, Option<String>)> {
        let mesh = Arc::clone(&self.mesh);
        let diagonal = self.shape.as_ref().map(|shape| shape.normalisation().diagonal);
        long(py, &call, move |_, monitor| {
            monitor.at("reconstructing");
            let made = union_boundary(&mesh, diagonal, tolerance)?.mesh;
            let (report, problem) = match surface::validate(&made) {
                Ok(report) => (report, None),
                // It can still be viewed and written.
                Err(error) => {
                    (SurfaceReport::default(), Some(advice_in_python(&error.to_string())))
                }
            };
            Ok((Surface::new(name, Loaded { mesh: made, report }, None), problem))
        })
    }
}

/// A surface from the parts of another one, unchanged. Validated again if `is_solid`.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn surface_from_parts(
    py: Python<'_>,
    vertices: PyReadonlyArray2<'_, f64>,
    faces: PyReadonlyArray2<'_, u32>,
    name: String,
    report: &str,
    truth: Option<PyRef<'_, Axis>>,
    is_solid: bool,
    call: Call,
) -> PyResult<Surface> {
    let mesh = TriMesh { vertices: points(&vertices)?, faces: triples(&faces)? };
    let report: SurfaceReport = serde_json::from_str(report)
        .map_err(|error| Failure::input(format!("report of {name}: {error}")))?;
    let truth = truth.map(|axis| MedialMesh::clone(&axis.mesh));
    let named = mesh.faces.iter().flatten().max();
    if named.is_some_and(|&vertex| vertex as usize >= mesh.vertices.len()) {
        return Err(Failure::input(format!("{name}: a face has a missing vertex")).into());
    }
    long(py, &call, move |_, monitor| {
        monitor.at("checking");
        if is_solid {
            surface::validate(&mesh)?;
        }
        Ok(Surface::new(name, Loaded { mesh, report }, truth))
    })
}
