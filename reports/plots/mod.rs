//! Plots: which figures there are and what stands in them.

mod axis;
mod bars;
mod figure;
mod palette;
mod points;
mod scaling;

use std::fmt::Display;

use crate::Target;

use crate::comparison::{Comparison, Entry, level_label, reached};
use crate::equal_error::BoundSummary;
use crate::metric::{BELOW_30, HAUSDORFF, MEAN_ERROR, MIN_ANGLE, Metric, SPIKES, TOTAL_SECONDS};
use crate::native::{NativeCurve, NativePoint};
use crate::purpose::Profile;
use crate::summary::{CountSummary, SeriesSummary};

use self::axis::Scale;
use self::bars::Bars;
use self::figure::{Curve, Figure};
use self::points::{Drawing, Origin};

pub(crate) use self::palette::style;
pub(crate) use self::scaling::scaling_plots;

/// Why a plot could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("plot: {0}")]
pub(crate) struct PlotError(String);

impl PlotError {
    fn new(error: impl Display) -> Self {
        Self(error.to_string())
    }
}

/// A drawn plot.
pub(crate) struct Plot {
    /// File name without folder and extension.
    pub(crate) stem: String,
    /// What it shows, for those who cannot see it.
    pub(crate) title: String,
    pub(crate) svg: String,
    /// Its points for the script of the page; null where it has none.
    pub(crate) points: serde_json::Value,
}

impl Plot {
    fn new(stem: String, title: String, drawing: Drawing) -> Self {
        Self { stem, title, svg: drawing.svg, points: drawing.points }
    }
}

/// What stands on the axes of a family of figures.
struct Kind {
    name: &'static str,
    title: &'static str,
    y: &'static Metric,
    scale: Scale,
    /// Seconds rather than spheres along the bottom.
    against_time: bool,
}

static KINDS: [Kind; 6] = [
    Kind {
        name: "hausdorff",
        title: "Hausdorff error against spheres",
        y: &HAUSDORFF,
        scale: Scale::Log,
        against_time: false,
    },
    Kind {
        name: "mean",
        title: "Mean error against spheres",
        y: &MEAN_ERROR,
        scale: Scale::Log,
        against_time: false,
    },
    Kind {
        name: "time",
        title: "Hausdorff error against time",
        y: &HAUSDORFF,
        scale: Scale::Log,
        against_time: true,
    },
    Kind {
        name: "angles",
        title: "Triangle quality: mean smallest angle",
        y: &MIN_ANGLE,
        scale: Scale::Linear,
        against_time: false,
    },
    Kind {
        name: "below-30",
        title: "Triangle quality: smallest angle below 30°",
        y: &BELOW_30,
        scale: Scale::Linear,
        against_time: false,
    },
    Kind {
        name: "spikes",
        title: "Spikes left",
        y: &SPIKES,
        scale: Scale::LogOfOneMore,
        against_time: false,
    },
];

impl Kind {
    fn figure(&self, title: String, curves: Vec<Curve>) -> Figure {
        let spheres = || ("spheres".to_owned(), Scale::Log);
        let x =
            if self.against_time { (TOTAL_SECONDS.axis_title(), Scale::Log) } else { spheres() };
        // Fewer spheres, less time, a smaller error: all of them are better where they are less.
        let front = matches!(self.name, "hausdorff" | "mean" | "time");
        Figure { title, x, y: (self.axis_title(), self.scale), curves, front }
    }

    fn axis_title(&self) -> String {
        match self.name {
            "hausdorff" | "time" => "Hausdorff error (% of diagonal)".to_owned(),
            "mean" => "mean error (% of diagonal)".to_owned(),
            "angles" => "mean smallest angle (degrees)".to_owned(),
            "below-30" => "triangles below 30° (%)".to_owned(),
            _ => self.y.axis_title(),
        }
    }

    fn draw(
        &self,
        stem: String,
        title: String,
        curves: Vec<Curve>,
    ) -> Result<Option<Plot>, PlotError> {
        let svg = self.figure(title.clone(), curves).to_svg()?;
        Ok(svg.map(|drawing| Plot::new(stem, title, drawing)))
    }
}

/// The figures of one mesh; those without a point are left out.
pub(crate) fn mesh_plots(
    comparison: &Comparison<'_>,
    mesh: usize,
    stem: &str,
) -> Result<Vec<Plot>, PlotError> {
    let mut plots = Vec::new();
    for kind in &KINDS {
        let series = 0..comparison.series.len();
        let curves = series.flat_map(|series| mesh_curves(comparison, mesh, series, kind));
        let title = format!("{}: {}", comparison.meshes[mesh], kind.title);
        plots.extend(kind.draw(format!("mesh-{stem}-{}", kind.name), title, curves.collect())?);
    }
    Ok(plots)
}

/// Every measured result of one method on one mesh, from many spheres to few: those at counts and
/// error bounds as a line, those at levels of its own as dashes.
fn mesh_curves(comparison: &Comparison<'_>, mesh: usize, series: usize, kind: &Kind) -> Vec<Curve> {
    let is_own = |entry: &Entry<'_>| {
        matches!(entry.record.simplify.level, Target::Native(_) | Target::Published)
    };
    let mut curves: Vec<Curve> = [false, true]
        .into_iter()
        .map(|own| {
            let entries = comparison.of_mesh(mesh).filter(|entry| entry.series == series);
            let entries = entries.filter(|entry| entry.measured() && is_own(entry) == own);
            Curve { dashed: own, ..mesh_curve(comparison, series, entries, kind) }
        })
        .filter(|curve| !curve.points.is_empty())
        .collect();
    // One row in the legend for both.
    curves.iter_mut().skip(1).for_each(|curve| curve.label.clear());
    curves
}

fn mesh_curve<'e>(
    comparison: &Comparison<'_>,
    series: usize,
    entries: impl Iterator<Item = &'e Entry<'e>>,
    kind: &Kind,
) -> Curve {
    let mut entries = entries.peekable();
    let mesh = entries.peek().map(|entry| comparison.meshes[entry.mesh].clone());
    let mesh = mesh.unwrap_or_default();
    let point = |entry: &Entry<'_>| {
        let spheres = reached(entry.record)?;
        let x = if kind.against_time { TOTAL_SECONDS.of(entry.record)? } else { spheres as f64 };
        Some((spheres, (x, kind.y.of(entry.record)?)))
    };
    let mut points: Vec<(usize, (f64, f64))> = entries.filter_map(point).collect();
    points.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.0.total_cmp(&b.1.0)));
    let tags =
        if kind.against_time { ends(points.iter().map(|point| point.0)) } else { Vec::new() };
    Curve {
        series,
        label: comparison.series[series].clone(),
        name: comparison.series[series].clone(),
        of: mesh,
        origins: points.iter().map(|point| Origin::of_result(point.0)).collect(),
        points: points.into_iter().map(|point| point.1).collect(),
        line: None,
        tags,
        dashed: false,
    }
}

/// The numbers of spheres at both ends of a curve.
fn ends(counts: impl ExactSizeIterator<Item = usize>) -> Vec<(usize, String)> {
    let last = counts.len().saturating_sub(1);
    counts
        .enumerate()
        .filter(|(index, _)| *index == 0 || *index == last)
        .map(|(index, count)| (index, crate::text::grouped(count as u64)))
        .collect()
}

/// Figures of the means over all meshes, and the bars of the stages.
pub(crate) fn mean_plots(
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
    natives: &[NativeCurve],
) -> Result<Vec<Plot>, PlotError> {
    let mut plots = Vec::new();
    for kind in &KINDS {
        let mut curves: Vec<Curve> = (0..comparison.series.len())
            .map(|series| mean_curve(comparison, summaries, series, kind))
            .filter(|curve| !curve.points.is_empty())
            .collect();
        curves.extend(own_levels(comparison, natives, kind, &curves));
        let title = format!("All meshes, {} means: {}", kind.y.mean.word(), kind.title);
        plots.extend(kind.draw(format!("overview-{}", kind.name), title, curves)?);
    }
    // The fewest spheres take the most work.
    if let Some(summary) =
        summaries.iter().rev().find(|summary| summary.rows.iter().any(|row| row.over > 0))
    {
        plots.extend(stage_bars(comparison, summary)?);
    }
    Ok(plots)
}

/// The means at levels of their own as dashes, for the figures of errors against spheres.
fn own_levels(
    comparison: &Comparison<'_>,
    natives: &[NativeCurve],
    kind: &Kind,
    named: &[Curve],
) -> Vec<Curve> {
    let error: fn(&NativePoint) -> f64 = match kind.name {
        "hausdorff" => |point| point.hausdorff,
        "mean" => |point| point.mean,
        _ => return Vec::new(),
    };
    let curve = |native: &NativeCurve| {
        let is_named = named.iter().any(|curve| curve.series == native.series);
        let label = &comparison.series[native.series];
        Curve {
            series: native.series,
            label: if is_named { String::new() } else { format!("{label} (own levels)") },
            name: format!("{label} (own levels)"),
            of: "mean".to_owned(),
            points: native.points.iter().map(|point| (point.spheres, error(point))).collect(),
            origins: own_origins(comparison, native, native.points.iter()),
            line: None,
            tags: vec![],
            dashed: true,
        }
    };
    natives.iter().map(curve).collect()
}

/// Where means at levels of their own come from.
fn own_origins<'p>(
    comparison: &Comparison<'_>,
    native: &NativeCurve,
    points: impl Iterator<Item = &'p NativePoint>,
) -> Vec<Origin> {
    let whole = native.over == comparison.meshes.len();
    points.map(|point| Origin::of_mean(native.over, point.spheres, whole)).collect()
}

/// One figure for each method with a scalar of its own: what it does to the error, on its own axis.
pub(crate) fn native_plots(
    comparison: &Comparison<'_>,
    natives: &[NativeCurve],
    axis: &dyn Fn(&str) -> Option<String>,
) -> Result<Vec<Plot>, PlotError> {
    let mut plots = Vec::new();
    let stems = crate::text::file_stems(comparison.series.iter().map(String::as_str));
    for native in natives {
        let at = |point: &NativePoint| match point.level {
            Target::Native(value) => Some((value, point.hausdorff)),
            _ => None,
        };
        let points: Vec<(f64, f64)> = native.points.iter().filter_map(at).collect();
        if points.len() < 2 {
            continue;
        }
        let (least, most) = (points.iter().map(|p| p.0), points.iter().map(|p| p.0));
        let (least, most) = (least.fold(f64::INFINITY, f64::min), most.fold(0.0, f64::max));
        let scale = if least > 0.0 && most > 20.0 * least { Scale::Log } else { Scale::Linear };
        let label = &comparison.series[native.series];
        let axis = axis(comparison.methods[native.series]);
        let title = format!("{label}: Hausdorff error against its own level");
        let spheres = native.points.iter().filter(|point| at(point).is_some());
        let origins = own_origins(comparison, native, spheres.clone());
        let spheres: Vec<f64> = spheres.map(|point| point.spheres).collect();
        let tags = apart(&points, scale).into_iter();
        let tags = tags.map(|k| (k, crate::text::grouped(spheres[k].round() as u64)));
        let curve = Curve {
            series: native.series,
            label: format!("spheres, over {}", crate::text::counted(native.over, "mesh", "meshes")),
            name: label.clone(),
            of: "mean".to_owned(),
            points,
            origins,
            line: None,
            tags: tags.collect(),
            dashed: true,
        };
        let figure = Figure {
            title: title.clone(),
            x: (axis.unwrap_or_else(|| "own level".to_owned()), scale),
            y: ("Hausdorff error (% of diagonal)".to_owned(), Scale::Log),
            curves: vec![curve],
            front: false,
        };
        let stem = format!("overview-level-{}", stems[native.series]);
        plots.extend(figure.to_svg()?.map(|drawing| Plot::new(stem, title, drawing)));
    }
    Ok(plots)
}

/// The points whose tags would not cover each other: from the first on, each an eighth of the axis
/// away from the one before.
fn apart(points: &[(f64, f64)], scale: Scale) -> Vec<usize> {
    let place = |k: usize| if matches!(scale, Scale::Log) { points[k].0.ln() } else { points[k].0 };
    let places = || (0..points.len()).map(place);
    let range = places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min);
    let mut kept: Vec<usize> = Vec::new();
    for k in 0..points.len() {
        if kept.last().is_none_or(|&last| (place(k) - place(last)).abs() >= range / 8.0) {
            kept.push(k);
        }
    }
    kept
}

/// Fewest spheres against the error that they keep, from a search.
pub(crate) fn equal_error_plot(
    comparison: &Comparison<'_>,
    bounds: &[BoundSummary],
) -> Result<Option<Plot>, PlotError> {
    let curve = |series: usize| {
        let point = |bound: &BoundSummary| {
            let row = bound.rows.iter().find(|row| row.series == series)?;
            Some((bound.percent, row.spheres?))
        };
        let points = bounds.iter().filter_map(point).collect();
        let known = |bound: &BoundSummary| {
            let row =
                bound.rows.iter().find(|row| row.series == series && row.spheres.is_some())?;
            Some(Origin { n: Some(row.asked), ..Origin::default() })
        };
        let origins = bounds.iter().filter_map(known).collect();
        let (label, of) = (comparison.series[series].clone(), "median".to_owned());
        Curve {
            series,
            name: label.clone(),
            label,
            of,
            points,
            origins,
            line: None,
            tags: vec![],
            dashed: false,
        }
    };
    let title = "Equal error: median of the fewest spheres, searched for".to_owned();
    let figure = Figure {
        title: title.clone(),
        x: ("Hausdorff error kept (% of diagonal)".to_owned(), Scale::Log),
        y: ("spheres".to_owned(), Scale::Log),
        curves: (0..comparison.series.len())
            .map(curve)
            .filter(|curve| !curve.points.is_empty())
            .collect(),
        front: false,
    };
    let stem = "overview-equal-error".to_owned();
    Ok(figure.to_svg()?.map(|drawing| Plot::new(stem, title, drawing)))
}

/// The share of the meshes on which each series is within an error at one number of spheres, of the
/// meshes that it was asked for.
pub(crate) fn profile_plot(
    comparison: &Comparison<'_>,
    spheres: usize,
    profiles: &[Profile],
) -> Result<Option<Plot>, PlotError> {
    let share = |number: usize, asked: usize| 100.0 * number as f64 / asked as f64;
    let curve = |(series, Profile { errors, asked }): (usize, &Profile)| {
        // Up at each error.
        let step =
            |(k, &error): (usize, &f64)| [(error, share(k, *asked)), (error, share(k + 1, *asked))];
        let points: Vec<(f64, f64)> = errors.iter().enumerate().flat_map(step).collect();
        let origins = vec![Origin { n: Some(*asked), ..Origin::default() }; points.len()];
        let label = comparison.series[series].clone();
        let (name, of) = (label.clone(), "share".to_owned());
        Curve { series, label, name, of, points, origins, line: None, tags: vec![], dashed: false }
    };
    let level = crate::text::counted(spheres, "sphere", "spheres");
    let title = format!("Meshes within an error at {level}");
    let curves = profiles.iter().enumerate().map(curve).filter(|curve| !curve.points.is_empty());
    let figure = Figure {
        title: title.clone(),
        x: ("Hausdorff error (% of diagonal)".to_owned(), Scale::Log),
        y: ("meshes (%)".to_owned(), Scale::Linear),
        curves: curves.collect(),
        front: false,
    };
    let stem = "overview-profile".to_owned();
    Ok(figure.to_svg()?.map(|drawing| Plot::new(stem, title, drawing)))
}

fn mean_curve(
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
    series: usize,
    kind: &Kind,
) -> Curve {
    let means: Vec<(usize, (f64, f64), Origin)> = summaries
        .iter()
        .filter_map(|summary| {
            let row = summary.rows.iter().find(|row| row.series == series)?;
            let x =
                if kind.against_time { row.mean(&TOTAL_SECONDS)? } else { summary.count as f64 };
            let whole = summary.is_whole_of(row, kind.y);
            let origin = Origin::of_mean(row.over(kind.y), summary.count as f64, whole);
            Some((summary.count, (x, row.mean(kind.y)?), origin))
        })
        .collect();
    let tags = if kind.against_time { ends(means.iter().map(|mean| mean.0)) } else { Vec::new() };
    // The set is the same at each count that has a mean.
    let row_of = |summary: &'_ CountSummary| {
        let row = summary.rows.iter().find(|row| row.series == series && row.over(kind.y) > 0)?;
        Some(label_over(&comparison.series[series], summary, row.over(kind.y)))
    };
    let label = summaries.iter().find_map(row_of);
    Curve {
        series,
        label: label.unwrap_or_else(|| comparison.series[series].clone()),
        name: comparison.series[series].clone(),
        of: "mean".to_owned(),
        points: means.iter().map(|mean| mean.1).collect(),
        origins: means.iter().map(|mean| mean.2).collect(),
        line: None,
        tags,
        dashed: false,
    }
}

/// The label of a curve of means, with the number of meshes where these are not all.
fn label_over(label: &str, summary: &CountSummary, over: usize) -> String {
    match over == summary.meshes {
        true => label.to_owned(),
        false => format!("{label} ({over} of {})", summary.meshes),
    }
}

fn stage_bars(
    comparison: &Comparison<'_>,
    summary: &CountSummary,
) -> Result<Option<Plot>, PlotError> {
    let label = |row: &SeriesSummary| label_over(&comparison.series[row.series], summary, row.over);
    let rows = summary.rows.iter().filter(|row| row.over > 0);
    let rows: Vec<_> = rows.filter_map(|row| Some((label(row), row.stages?))).collect();
    let level = level_label(Target::Spheres(summary.count));
    let title = format!("Seconds by stage, to {level} spheres");
    let svg = Bars { title: title.clone(), rows }.to_svg()?;
    let points = serde_json::Value::Null;
    Ok(svg.map(|svg| Plot { stem: "overview-stages".to_owned(), title, svg, points }))
}
