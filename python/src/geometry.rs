//! Triangulations of points.

use medial::geometry::delaunay::Delaunay;
use medial::geometry::regular::Regular;
use medial::geometry::triangulation::Triangulation;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::{numbers, of_rows, points};
use crate::error::Failure;
use crate::work::{Call, long};

/// Finite cells, hidden points, and pairs of a repeated point with the one that it repeats.
type Arrays<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// The Delaunay triangulation of points, or the regular one where they have weights.
#[pyfunction]
pub fn triangulate<'py>(
    py: Python<'py>,
    sites: PyReadonlyArray2<'py, f64>,
    weights: Option<PyReadonlyArray1<'py, f64>>,
    call: Call,
) -> PyResult<Arrays<'py>> {
    let sites = points(&sites)?;
    let weights = weights.as_ref().map(numbers).transpose()?;
    let (triangulation, hidden, repeated) = long(py, &call, move |_, monitor| {
        monitor.at("triangulating");
        let made = match &weights {
            None => {
                let made = Delaunay::new(sites.rows())?;
                let repeated = made.duplicates().to_vec();
                (made.into_triangulation(), vec![], repeated)
            }
            Some(weights) => {
                let made = Regular::new(sites.rows(), weights.rows())?;
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
