//! Pictures as PNG, by the verb `render`, and evaluations as rows of `results.csv`.

use std::sync::Arc;

use medial::complex::MedialMesh;
use medial::shape::ShapeOptions;
use medial_bench::cmd::render::draw;
use medial_bench::exit::Exit;
use medial_reports::{Record, results_csv};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::axis::Axis;
use crate::calls::{Call, Failure, Kind, long};
use crate::surface::Surface;

/// A picture of a surface and of medial meshes of it, each with its caption; `words` are options of the verb. With it
/// the figures that the verb prints as JSON.
#[pyfunction]
pub fn render<'py>(
    py: Python<'py>,
    surface: &Surface,
    axes: Vec<(String, Py<Axis>)>,
    words: Vec<String>,
    call: Call,
) -> PyResult<(Bound<'py, PyBytes>, String)> {
    let model = Arc::clone(&surface.model);
    let axes: Vec<(String, Arc<MedialMesh>)> =
        axes.into_iter().map(|(name, axis)| (name, Arc::clone(&axis.get().mesh))).collect();
    let (png, object) = long(py, &call, move |_, monitor| {
        monitor.at("reading");
        let shape = model.shape(&ShapeOptions::default())?;
        let units = *shape.normalisation();
        let normal = |mesh: &MedialMesh| mesh.to_normal(&units);
        let axes = axes.into_iter().map(|(name, mesh)| (name, normal(&mesh))).collect();
        draw(words, shape, axes, &|stage| monitor.at(stage)).map_err(|failure| {
            let kind = if failure.code == Exit::Usage { Kind::Parameter } else { Kind::Input };
            Failure::new(kind, failure.message)
        })
    })?;
    Ok((PyBytes::new(py, &png), object.to_string()))
}

/// The table `results.csv` of one record, a JSON object.
#[pyfunction]
pub fn results_row(record: &str) -> PyResult<String> {
    let record: Record = serde_json::from_str(record)
        .map_err(|error| Failure::new(Kind::Internal, format!("record: {error}")))?;
    let csv = results_csv(&[record]).map_err(|error| Failure::new(Kind::Internal, error))?;
    Ok(String::from_utf8_lossy(&csv).into_owned())
}
