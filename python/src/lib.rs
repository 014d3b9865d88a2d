//! The Rust part of the Python package `medialaxis`: thin objects around the library, for `medial_axis/*.py`, which has
//! the public types and their documentation.
//!
//! | file | content |
//! |---|---|
//! | `lib` | the module; the command `medial`, which loads Python classes; triangulations of points |
//! | `surface` | a closed surface with its substrates, each built once |
//! | `axis` | a medial mesh, in the units of its surface |
//! | `method` | a Python class as a `MedialSimplifier` |
//! | `picture` | pictures, rows of `results.csv` |
//! | `calls` | long calls, numpy arrays, exceptions |

mod axis;
mod calls;
mod method;
mod picture;
mod surface;

use std::ffi::OsString;
use std::path::PathBuf;

use medial::geometry::delaunay::Delaunay;
use medial::geometry::regular::Regular;
use medial::geometry::triangulation::Triangulation;
use medial_bench::host::Host;
use medial_bench::own_metric::OwnMetric;
use medial_bench::{main_hosted, measure_own};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::calls::{Call, Failure, long, of_rows, points};
use crate::method::Classes;
use crate::surface::Surface;

/// In the order of `_medial.pyi`.
#[pymodule]
fn _medial(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("DEFAULT_METHOD", medial_bench::study::registry::DEFAULT)?;
    module.add_class::<surface::Surface>()?;
    module.add_class::<axis::Axis>()?;
    module.add_class::<method::ShapeHandle>()?;
    module.add_class::<method::RunHandle>()?;
    module.add_function(wrap_pyfunction!(triangulate, module)?)?;
    module.add_function(wrap_pyfunction!(axis::surface_from_parts, module)?)?;
    module.add_function(wrap_pyfunction!(method::methods, module)?)?;
    module.add_function(wrap_pyfunction!(method::simplify, module)?)?;
    module.add_function(wrap_pyfunction!(picture::render, module)?)?;
    module.add_function(wrap_pyfunction!(picture::results_row, module)?)?;
    module.add_function(wrap_pyfunction!(measure, module)?)?;
    module.add_function(wrap_pyfunction!(run_command, module)?)?;
    Ok(())
}

/// Runs the command and returns its exit code. `program` with `arguments` starts it again; `code` is the file of this
/// module.
#[pyfunction]
fn run_command(
    py: Python<'_>,
    program: PathBuf,
    arguments: Vec<OsString>,
    code: PathBuf,
    words: Vec<OsString>,
) -> u8 {
    let host = Host { program, arguments, code, words };
    py.detach(|| main_hosted(medial_methods::registry(), host, Box::new(Classes)) as u8)
}

/// Values of a metric of the user for the results of a store: `value` gets a surface and the file of a medial mesh. Returns
/// remarks on results without a number; an exception of `value` ends it.
#[pyfunction]
fn measure(dir: PathBuf, metric: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    let metric: OwnMetric =
        metric.parse().map_err(|why| Failure::parameter(format!("metric {metric}: {why}")))?;
    let mut raised = None;
    let mut known: Option<(String, Py<Surface>)> = None; // results of one mesh follow each other
    let remarks = measure_own(&dir, &metric, |saved| {
        if raised.is_some() {
            return Err("not measured".to_owned());
        }
        let py = value.py();
        if known.as_ref().is_none_or(|(hash, _)| hash != saved.hash) {
            let mesh = saved.surface;
            let loaded = medial::surface::read_triangles(&mesh.vertices, &mesh.faces);
            let loaded = loaded.map_err(|error| error.to_string())?;
            let given = Surface::new(saved.name.to_owned(), loaded, None);
            let given = Py::new(py, given).map_err(|error| error.to_string())?;
            known = Some((saved.hash.to_owned(), given));
        }
        let given = known.as_ref().map(|(_, given)| given.clone_ref(py));
        let number = value.call1((given, saved.path)).and_then(|number| number.extract());
        number.map_err(|error| {
            let why = error.to_string();
            raised = Some(error);
            why
        })
    });
    match raised {
        Some(error) => Err(error),
        None => Ok(remarks.map_err(|failure| Failure::input(failure.message))?),
    }
}

/// Finite cells, hidden points, and pairs of a repeated point with the one that it repeats.
type Arrays<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// The Delaunay triangulation of points, or the regular one where they have weights.
#[pyfunction]
fn triangulate<'py>(
    py: Python<'py>,
    sites: PyReadonlyArray2<'py, f64>,
    weights: Option<PyReadonlyArray1<'py, f64>>,
    call: Call,
) -> PyResult<Arrays<'py>> {
    let sites = points(&sites)?;
    let weights = weights.map(|weights| weights.as_array().to_vec());
    let (triangulation, hidden, repeated) = long(py, &call, move |_, monitor| {
        monitor.at("triangulating");
        let made = match &weights {
            None => {
                let made = Delaunay::new(&sites)?;
                let repeated = made.duplicates().to_vec();
                (made.into_triangulation(), vec![], repeated)
            }
            Some(weights) => {
                let made = Regular::new(&sites, weights)?;
                let (hidden, repeated) = (made.hidden().to_vec(), made.duplicates().to_vec());
                (made.into_triangulation(), hidden, repeated)
            }
        };
        Ok::<_, Failure>(made)
    })?;
    let hidden = of_rows(py, hidden.iter().map(|vertex| [vertex.0]))?;
    let repeated = of_rows(py, repeated.iter().map(|(vertex, of)| [vertex.0, of.0]))?;
    Ok((cells(py, &triangulation)?, hidden.into_any(), repeated.into_any()))
}

fn cells<'py>(py: Python<'py>, triangulation: &Triangulation) -> PyResult<Bound<'py, PyAny>> {
    // One vector of the right size: there are seven cells for each point.
    let mut flat = Vec::with_capacity(4 * triangulation.finite_cell_count());
    flat.extend(
        triangulation.finite_cells().flat_map(|cell| triangulation.vertices(cell).map(|v| v.0)),
    );
    let rows = flat.len() / 4;
    Ok(PyArray1::from_vec(py, flat).reshape([rows, 4])?.into_any())
}
