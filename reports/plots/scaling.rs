//! Figures of time and memory against the size of the input.

use super::axis::Scale;
use super::figure::{Curve, Figure};
use super::points::Origin;
use super::{Plot, PlotError};
use crate::comparison::Comparison;
use crate::scaling::{Growth, Scaling, power_law};
use crate::text::counted;

/// A cost of a series: its points.
type Cost = fn(&Growth) -> &Vec<(f64, f64)>;

/// One point for each mesh and method, with the line of its power law where there is one.
pub(crate) fn scaling_plots(
    comparison: &Comparison<'_>,
    scaling: &Scaling,
) -> Result<Vec<Plot>, PlotError> {
    let seconds: Cost = |growth| &growth.seconds;
    let megabytes: Cost = |growth| &growth.megabytes;
    let kinds = [
        ("overview-scaling", "CPU time", "CPU time (s)", seconds),
        ("overview-scaling-memory", "Peak memory", "peak memory (MB)", megabytes),
    ];
    let mut plots = Vec::new();
    for (stem, what, axis, cost) in kinds {
        let curves = scaling.rows.iter().map(|growth| curve(comparison, scaling, growth, cost));
        let to = counted(scaling.spheres, "sphere", "spheres");
        let title = format!("{what} against input size, to {to}; one point a mesh");
        let figure = Figure {
            title: title.clone(),
            x: ("spheres of the initial medial mesh".to_owned(), Scale::Log),
            y: (axis.to_owned(), Scale::Log),
            curves: curves.filter(|curve| !curve.points.is_empty()).collect(),
            front: false,
        };
        let drawing = figure.to_svg()?;
        plots.extend(drawing.map(|drawing| Plot::new(stem.to_owned(), title, drawing)));
    }
    Ok(plots)
}

fn curve(comparison: &Comparison<'_>, scaling: &Scaling, growth: &Growth, cost: Cost) -> Curve {
    let points = cost(growth).clone();
    let law = power_law(&points).ok();
    let name = comparison.series[growth.series].clone();
    let ends = points.first().zip(points.last());
    let line = law
        .zip(ends)
        .map(|(law, (first, last))| [first.0, last.0].map(|size| (size, law.at(size))).to_vec());
    let label = match law {
        Some(law) => format!("{name} x^{:.2}, n={}", law.exponent, points.len()),
        None => format!("{name}, n={}", points.len()),
    };
    Curve {
        series: growth.series,
        label,
        name,
        of: "one mesh".to_owned(),
        origins: vec![
            Origin { spheres: Some(scaling.spheres as f64), ..Origin::default() };
            points.len()
        ],
        points,
        // What grows with no law has points alone.
        line: Some(line.unwrap_or_default()),
        tags: vec![],
        dashed: false,
    }
}
