//! Figures of errors against the edge length of the surface.

use super::axis::Scale;
use super::figure::{Curve, Figure};
use super::{Plot, PlotError};

/// One line: its errors, as fractions of the diagonal, against edge lengths.
pub(crate) struct ConvergenceCurve {
    pub(crate) series: usize,
    pub(crate) label: String,
    pub(crate) points: Vec<(f64, f64)>,
}

/// Errors against edge lengths, both in percent of the diagonal; `None` without a point.
pub(crate) fn against_edge_length(
    stem: String,
    title: String,
    curves: Vec<ConvergenceCurve>,
) -> Result<Option<Plot>, PlotError> {
    let percent = |(edge, error): (f64, f64)| (100.0 * edge, 100.0 * error);
    let curve = |curve: ConvergenceCurve| Curve {
        series: curve.series,
        name: curve.label.clone(),
        label: curve.label,
        of: "median over shapes".to_owned(),
        points: curve.points.into_iter().map(percent).collect(),
        origins: vec![],
        line: None,
        tags: vec![],
        dashed: false,
    };
    let figure = Figure {
        title: title.clone(),
        x: ("mean edge of the surface (% of diagonal)".to_owned(), Scale::Log),
        y: ("distance, median over shapes (% of diagonal)".to_owned(), Scale::Log),
        curves: curves.into_iter().map(curve).collect(),
        front: false,
    };
    Ok(figure.to_svg()?.map(|drawing| Plot::new(stem, title, drawing)))
}
