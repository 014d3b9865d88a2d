//! Figures about baselines and noise.

use super::axis::Scale;
use super::figure::{Curve, Figure};
use super::points::Origin;
use super::{BASELINE, KINDS, Plot, PlotError, mean_curve, mesh_curves};
use crate::comparison::Comparison;
use crate::metric::{HAUSDORFF, Metric};
use crate::summary::CountSummary;

/// Error against stored numbers: the medial methods, and a baseline in ink and dashes. Of one mesh,
/// or of the means over all.
pub(crate) fn against_numbers(
    comparison: &Comparison<'_>,
    mesh: Option<usize>,
    summaries: &[CountSummary],
    metric: &'static Metric,
    baseline: &str,
    points: Vec<(f64, f64)>,
) -> Result<Option<Plot>, PlotError> {
    let name = if metric.key == HAUSDORFF.key { "hausdorff" } else { "mean" };
    let Some(kind) = KINDS.iter().find(|kind| kind.name == name) else { return Ok(None) };
    let numbers = |spheres: f64| 4.0 * spheres;
    let curve = |series| match mesh {
        Some(mesh) => mesh_curves(comparison, mesh, series, kind),
        None => vec![mean_curve(comparison, summaries, series, kind)],
    };
    let mut curves: Vec<Curve> = (0..comparison.series.len())
        .flat_map(curve)
        .map(|mut curve| {
            curve.points.iter_mut().for_each(|point| point.0 = numbers(point.0));
            curve
        })
        .filter(|curve| !curve.points.is_empty())
        .collect();
    curves.push(Curve {
        series: BASELINE,
        label: baseline.to_owned(),
        name: baseline.to_owned(),
        of: mesh.map_or("mean", |mesh| comparison.meshes[mesh].as_str()).to_owned(),
        origins: vec![Origin { n: mesh.map(|_| 1), ..Origin::default() }; points.len()],
        points,
        line: None,
        tags: vec![],
        dashed: true,
    });
    let (stem, of) = match mesh {
        None => ("overview".to_owned(), "All meshes, geometric means".to_owned()),
        Some(mesh) => {
            let stems = crate::text::file_stems(comparison.meshes.iter().map(String::as_str));
            (format!("mesh-{}", stems[mesh]), comparison.meshes[mesh].clone())
        }
    };
    let what = if name == "mean" { "Mean" } else { "Hausdorff" };
    let title = format!("{of}: {what} error against stored numbers");
    let x = ("stored numbers (floats)".to_owned(), Scale::Log);
    let figure = Figure {
        title: title.clone(),
        x,
        y: (kind.axis_title(), Scale::Log),
        curves,
        front: false,
    };
    let svg = figure.to_svg()?;
    Ok(svg.map(|drawing| Plot::new(format!("{stem}-numbers-{name}"), title, drawing)))
}

/// One line of a figure about noise: series, label, and points.
pub(crate) type NoiseCurve = (usize, String, Vec<(f64, f64)>);

/// A measure against the level of noise, one curve for each method.
pub(crate) fn against_noise(
    stem: String,
    title: String,
    y: &str,
    spikes: bool,
    curves: Vec<NoiseCurve>,
) -> Result<Option<Plot>, PlotError> {
    let curve = |(series, label, points): NoiseCurve| Curve {
        series,
        name: label.clone(),
        label,
        of: "mean".to_owned(),
        points,
        origins: vec![],
        line: None,
        tags: vec![],
        dashed: false,
    };
    let scale = if spikes { Scale::LogOfOneMore } else { Scale::Log };
    let figure = Figure {
        title: title.clone(),
        x: ("noise (% of diagonal)".to_owned(), Scale::Linear),
        y: (y.to_owned(), scale),
        curves: curves.into_iter().map(curve).collect(),
        front: false,
    };
    Ok(figure.to_svg()?.map(|drawing| Plot::new(stem, title, drawing)))
}
