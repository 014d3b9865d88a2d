//! Pictures as PNG, and evaluations as rows of `results.csv`.

use std::str::FromStr;
use std::sync::Arc;

use medial::complex::MedialMesh;
use medial::shape::ShapeOptions;
use medial_reports::drawing::{ColourBy, DrawError, Drawing, Show};
use medial_reports::results_csv;
use medial_run::record::Record;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::axis::Axis;
use crate::calls::{Call, Failure, Kind, long};
use crate::surface::Surface;

/// The options of a picture, from `medial_axis/picture.py`.
#[derive(Deserialize)]
struct Options {
    show: Option<String>,
    color: String,
    camera: Option<String>,
    up: Option<String>,
    size: [usize; 2],
    background: String,
    max_error: Option<f64>,
    tolerance: f64,
}

/// A value of an option from its text.
fn parsed<T: FromStr<Err: std::fmt::Display>>(option: &str, text: &str) -> Result<T, Failure> {
    text.parse().map_err(|error| Failure::parameter(format!("{option} = {text:?}: {error}")))
}

/// A value among the words of an enumeration.
fn word<T: for<'de> Deserialize<'de>>(option: &str, text: String) -> Result<T, Failure> {
    let shown = format!("{option} = {text:?}");
    let found = serde_json::from_value(text.into());
    found.map_err(|error| Failure::parameter(format!("{shown}: {error}")))
}

impl Options {
    fn drawing(self) -> Result<Drawing, Failure> {
        Ok(Drawing {
            show: self.show.map(|text| word::<Show>("show", text)).transpose()?,
            colour: word::<ColourBy>("color", self.color)?,
            camera: self.camera.map(|text| parsed("camera", &text)).transpose()?,
            up: self.up.map(|text| parsed("up", &text)).transpose()?,
            size: self.size,
            background: parsed("background", &self.background)?,
            max_error: self.max_error,
            tolerance: self.tolerance,
        })
    }
}

/// A picture of a surface and of medial meshes of it, each with its caption, and figures about it as JSON. `options` are
/// those of `medial_axis/picture.py` as JSON.
#[pyfunction]
pub fn render<'py>(
    py: Python<'py>,
    surface: &Surface,
    axes: Vec<(String, Py<Axis>)>,
    options: &str,
    call: Call,
) -> PyResult<(Bound<'py, PyBytes>, String)> {
    let model = Arc::clone(&surface.model);
    let axes: Vec<(String, Arc<MedialMesh>)> =
        axes.into_iter().map(|(name, axis)| (name, Arc::clone(&axis.get().mesh))).collect();
    let options: Options = serde_json::from_str(options).map_err(Failure::parameter)?;
    let drawing = options.drawing()?;
    let (png, object) = long(py, &call, move |_, monitor| {
        monitor.at("reading");
        let shape = model.shape(&ShapeOptions::default())?;
        let units = *shape.normalisation();
        let normal = |mesh: &MedialMesh| mesh.to_normal(&units);
        let axes: Vec<_> = axes.into_iter().map(|(name, mesh)| (name, normal(&mesh))).collect();
        let drawn = drawing.draw(&shape, &axes, &|stage| monitor.at(stage));
        let drawn = drawn.map_err(|error: DrawError| {
            let kind = if error.error.is_option { Kind::Parameter } else { Kind::Input };
            Failure::new(kind, error)
        })?;
        let object = json!({
            "width": drawn.width, "height": drawn.height, "direction": drawn.direction.to_array(),
            "up": drawn.up.to_array(), "errors": drawn.errors,
        });
        Ok((drawn.png, object))
    })?;
    Ok((PyBytes::new(py, &png), object.to_string()))
}

/// The table `results.csv` of one record, a JSON object.
#[pyfunction]
pub fn results_row(record: &str) -> PyResult<String> {
    // One mesh has no machine, no seeds and no conditions of a comparison.
    let parsed = || -> serde_json::Result<Record> {
        let mut whole = serde_json::to_value(Record::default())?;
        overlay(&mut whole, serde_json::from_str(record)?);
        serde_json::from_value(whole)
    };
    let record =
        parsed().map_err(|error| Failure::new(Kind::Internal, format!("record: {error}")))?;
    let csv = results_csv(&[record]).map_err(|error| Failure::new(Kind::Internal, error))?;
    Ok(String::from_utf8_lossy(&csv).into_owned())
}

/// Replaces the values of an object by those of another one, also within objects of both.
fn overlay(whole: &mut Value, part: Value) {
    match (whole, part) {
        (Value::Object(whole), Value::Object(part)) => {
            part.into_iter()
                .for_each(|(key, value)| overlay(whole.entry(key).or_insert(Value::Null), value));
        }
        (whole, part) => *whole = part,
    }
}
