//! Plots: what stands in them. The page draws a [`Figure`] from its JSON, `svg` draws it for papers.
//!
//! Every number of a figure is computed here, so both drawings show the same points, the same
//! front and the same labels.

mod axis;
mod svg;

use serde_json::{Value, json};

use crate::comparison::{Comparison, Entry, reached};
use crate::metric::{HAUSDORFF, MEAN_ERROR, MIN_ANGLE, Metric, SPIKES, TOTAL_SECONDS};
use crate::record::Target;
use crate::summary::{CountSummary, NativeCurve};
use crate::text::{grouped, significant};

pub(crate) use self::axis::Scale;
pub(crate) use self::svg::{FONTS, symbol};

/// A figure before it is drawn.
pub(crate) struct Figure {
    /// File name without folder and extension.
    pub(crate) stem: String,
    pub(crate) title: String,
    pub(crate) x: (String, Scale),
    pub(crate) y: (String, Scale),
    pub(crate) curves: Vec<Curve>,
    /// Whether less is better on both axes, so that some points dominate others.
    pub(crate) front: bool,
    /// Whether the page shows it unfolded.
    pub(crate) leading: bool,
}

/// The points of one series.
#[derive(Clone, Default)]
pub(crate) struct Curve {
    pub(crate) series: usize,
    /// Text of its row in the legend; none where it is empty.
    pub(crate) label: String,
    /// Name of the method, and the kind of its points: a mesh, a mean, a median.
    pub(crate) name: String,
    pub(crate) of: String,
    /// In the order in which they are joined.
    pub(crate) points: Vec<Point>,
    /// Drawn instead of a line through the points, such as a fit.
    pub(crate) line: Option<Vec<(f64, f64)>>,
    pub(crate) dashed: bool,
}

/// One point of a curve.
#[derive(Clone, Default)]
pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Number of meshes behind it, where known.
    pub(crate) n: Option<usize>,
    /// Spheres of the result, or their mean, where no axis shows them.
    pub(crate) spheres: Option<f64>,
    /// Whether it is over the same meshes as the others, and so may dominate them.
    pub(crate) compared: bool,
    /// Text next to the point.
    pub(crate) tag: Option<String>,
}

impl Point {
    pub(crate) fn at(x: f64, y: f64) -> Self {
        Self { x, y, ..Self::default() }
    }
}

impl Figure {
    /// The figure without its empty curves; `None` where no curve is left.
    pub(crate) fn with_points(mut self) -> Option<Self> {
        self.curves.retain(|curve| !curve.points.is_empty());
        (!self.curves.is_empty()).then_some(self)
    }

    /// The figure for the script of the page: numbers with five digits.
    pub(crate) fn to_json(&self) -> Value {
        let front = self.front();
        let curves = self.curves.iter().enumerate().map(|(index, curve)| {
            let points = curve.points.iter().enumerate().map(|(k, point)| {
                let is_front = u8::from(front.contains(&(index, k)));
                let spheres = point.spheres.map(rounded);
                json!([rounded(point.x), rounded(point.y), point.n, spheres, is_front])
            });
            // By index, since few points have a tag.
            let tags = curve.points.iter().enumerate();
            let tags = tags.filter_map(|(k, point)| Some(json!([k, point.tag.as_ref()?])));
            let line: Option<Vec<[f64; 2]>> = (curve.line.as_ref())
                .map(|line| line.iter().map(|&(x, y)| [rounded(x), rounded(y)]).collect());
            json!({
                "series": curve.series, "label": curve.label, "name": curve.name, "of": curve.of,
                "dashed": curve.dashed, "line": line,
                "points": points.collect::<Vec<_>>(), "tags": tags.collect::<Vec<_>>(),
            })
        });
        let [x, y] =
            [&self.x, &self.y].map(|(title, scale)| json!({"title": title, "scale": scale.key()}));
        json!({
            "title": self.title, "leading": self.leading, "x": x, "y": y,
            "curves": curves.collect::<Vec<_>>(),
        })
    }

    /// The non-dominated points, by curve and index, from left to right: no other point is at most
    /// as large in both coordinates. Empty where fewer than two series compare.
    fn front(&self) -> Vec<(usize, usize)> {
        let mut all = vec![];
        for (index, curve) in self.curves.iter().enumerate().filter(|_| self.front) {
            for (k, p) in curve.points.iter().enumerate() {
                if p.compared && p.x > 0.0 && p.y.is_finite() {
                    all.push((p.x, p.y, index, k));
                }
            }
        }
        let first = all.first().map(|point| self.curves[point.2].series);
        if all.iter().all(|point| Some(self.curves[point.2].series) == first) {
            return Vec::new();
        }
        // From left to right a point is dominated unless it is lower than all before it.
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut lowest = f64::INFINITY;
        all.retain(|&(_, y, _, _)| {
            let is_lower = y < lowest;
            lowest = lowest.min(y);
            is_lower
        });
        all.into_iter().map(|(_, _, curve, point)| (curve, point)).collect()
    }
}

fn rounded(value: f64) -> f64 {
    significant(value, 5).parse().unwrap_or(value)
}

/// A family of figures: one for each mesh, and one of the means over all.
struct Kind {
    name: &'static str,
    title: &'static str,
    axis: &'static str,
    y: &'static Metric,
    scale: Scale,
    /// Seconds rather than spheres along the bottom.
    against_time: bool,
    /// Whether less is better on both axes.
    front: bool,
}

impl Kind {
    const fn of(name: &'static str, axis: &'static str, y: &'static Metric) -> Self {
        Self { name, title: name, axis, y, scale: Scale::Log, against_time: false, front: true }
    }
}

static KINDS: [Kind; 5] = [
    Kind {
        title: "Hausdorff error against spheres",
        ..Kind::of("hausdorff", "Hausdorff error (% of diagonal)", &HAUSDORFF)
    },
    Kind {
        title: "Hausdorff error against time",
        against_time: true,
        ..Kind::of("time", "Hausdorff error (% of diagonal)", &HAUSDORFF)
    },
    Kind {
        title: "Mean error against spheres",
        ..Kind::of("mean", "mean error (% of diagonal)", &MEAN_ERROR)
    },
    Kind {
        title: "Triangle quality: mean smallest angle",
        scale: Scale::Linear,
        front: false,
        ..Kind::of("angles", "mean smallest angle (degrees)", &MIN_ANGLE)
    },
    Kind {
        title: "Spikes left",
        scale: Scale::Linear,
        front: false,
        ..Kind::of("spikes", "spikes", &SPIKES)
    },
];

impl Kind {
    fn figure(&self, stem: &str, of: &str, curves: Vec<Curve>) -> Option<Figure> {
        let x = if self.against_time { TOTAL_SECONDS.axis_title() } else { "spheres".to_owned() };
        let figure = Figure {
            stem: format!("{stem}-{}", self.name),
            title: format!("{of}: {}", self.title),
            x: (x, Scale::Log),
            y: (self.axis.to_owned(), self.scale),
            curves,
            front: self.front,
            leading: matches!(self.name, "hausdorff" | "time"),
        };
        figure.with_points()
    }

    /// The point of a result or mean with so many spheres; the count is a tag where no axis has it.
    fn point(&self, spheres: f64, seconds: Option<f64>, y: Option<f64>) -> Option<Point> {
        let x = if self.against_time { seconds? } else { spheres };
        Some(Point {
            spheres: self.against_time.then_some(spheres),
            compared: true,
            ..Point::at(x, y?)
        })
    }

    /// Tags both ends of a curve over time with their counts.
    fn tag_ends(&self, points: &mut [Point]) {
        let last = points.len().saturating_sub(1);
        for (k, point) in points.iter_mut().enumerate() {
            let spheres = point.spheres.filter(|_| k == 0 || k == last);
            point.tag = spheres.map(|spheres| grouped(spheres as u64));
        }
    }
}

/// The figures of one mesh.
pub(crate) fn mesh_figures(comparison: &Comparison<'_>, mesh: usize, stem: &str) -> Vec<Figure> {
    (KINDS.iter())
        .filter_map(|kind| {
            let series = 0..comparison.series.len();
            let curves = series.flat_map(|series| mesh_curves(comparison, mesh, series, kind));
            kind.figure(&format!("mesh-{stem}"), &comparison.meshes[mesh], curves.collect())
        })
        .collect()
}

/// Every measured result of one method on one mesh, from many spheres to few: those at counts and
/// error bounds as a line, those at native levels as dashes.
fn mesh_curves(comparison: &Comparison<'_>, mesh: usize, series: usize, kind: &Kind) -> Vec<Curve> {
    let mut curves = vec![];
    for dashed in [false, true] {
        let mut entries: Vec<&Entry<'_>> = comparison
            .of_mesh(mesh)
            .filter(|entry| entry.series == series && entry.measured())
            .filter(|entry| {
                matches!(entry.record.simplify.level, Target::Native(_) | Target::Published)
                    == dashed
            })
            .collect();
        entries.sort_by_key(|entry| std::cmp::Reverse(reached(entry.record)));
        let mut points = vec![];
        for record in entries.into_iter().map(|entry| entry.record) {
            let Some(spheres) = reached(record) else { continue };
            let point = kind.point(spheres as f64, TOTAL_SECONDS.of(record), kind.y.of(record));
            points.extend(point.map(|point| Point { n: Some(1), ..point }));
        }
        kind.tag_ends(&mut points);
        curves.push(Curve {
            series,
            label: comparison.series[series].clone(),
            name: comparison.series[series].clone(),
            of: comparison.meshes[mesh].clone(),
            points,
            line: None,
            dashed,
        });
    }
    // One row in the legend for both.
    if !curves[0].points.is_empty() {
        curves[1].label.clear();
    }
    curves
}

/// Figures of the means over all meshes; with dashes the means at native levels.
pub(crate) fn mean_figures(
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
    natives: &[NativeCurve],
) -> Vec<Figure> {
    let mut figures = vec![];
    for kind in &KINDS {
        let mut curves: Vec<Curve> = (0..comparison.series.len())
            .map(|series| mean_curve(comparison, summaries, series, kind))
            .collect();
        for native in natives {
            let mut points = native_points(comparison, native, |point| match kind.name {
                "hausdorff" => Some((point.spheres, point.hausdorff)),
                "mean" => Some((point.spheres, point.mean)),
                _ => None,
            });
            // The axis shows the spheres.
            points.iter_mut().for_each(|point| point.spheres = None);
            let series = native.series;
            let is_named = !curves[series].points.is_empty();
            let name = format!("{} (native levels)", comparison.series[series]);
            curves.push(Curve {
                series,
                label: if is_named { String::new() } else { name.clone() },
                name,
                of: "mean".to_owned(),
                points,
                line: None,
                dashed: true,
            });
        }
        let of = format!("All meshes, {} means", kind.y.mean.word());
        figures.extend(kind.figure("overview", &of, curves));
    }
    figures
}

fn mean_curve(
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
    series: usize,
    kind: &Kind,
) -> Curve {
    let name = comparison.series[series].clone();
    let mut label = name.clone();
    let mut points = Vec::new();
    for summary in summaries {
        let Some(row) = summary.rows.iter().find(|row| row.series == series) else { continue };
        let (seconds, y) = (row.mean(&TOTAL_SECONDS), row.mean(kind.y));
        let Some(point) = kind.point(summary.count as f64, seconds, y) else { continue };
        let over = row.over(kind.y);
        let compared = summary.is_whole_of(row, kind.y);
        points.push(Point { n: Some(over), compared, ..point });
        // The set of meshes is the same at each count that has a mean.
        if over != summary.meshes {
            label = format!("{name} ({over} of {})", summary.meshes);
        }
    }
    kind.tag_ends(&mut points);
    Curve { series, label, name, of: "mean".to_owned(), points, line: None, dashed: false }
}

/// The means of a method at its native levels as points.
pub(crate) fn native_points(
    comparison: &Comparison<'_>,
    native: &NativeCurve,
    place: impl Fn(&crate::summary::NativePoint) -> Option<(f64, f64)>,
) -> Vec<Point> {
    (native.points.iter())
        .filter_map(|point| {
            let (x, y) = place(point)?;
            Some(Point {
                n: Some(native.over),
                spheres: Some(point.spheres),
                compared: native.over == comparison.meshes.len(),
                ..Point::at(x, y)
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(series: usize, points: &[(f64, f64)], compared: bool) -> Curve {
        let point = |&(x, y): &(f64, f64)| Point { compared, ..Point::at(x, y) };
        Curve { series, points: points.iter().map(point).collect(), ..Curve::default() }
    }

    #[test]
    fn the_front_holds_the_points_that_nothing_dominates() {
        let axis = || (String::new(), Scale::Log);
        let mut figure = Figure {
            stem: String::new(),
            title: String::new(),
            x: axis(),
            y: axis(),
            curves: vec![
                curve(0, &[(1.0, 5.0), (2.0, 3.0), (4.0, 3.0)], true),
                curve(1, &[(1.5, 6.0), (3.0, 1.0), (3.0, 0.5)], true),
                curve(2, &[(0.5, 0.1)], false),
            ],
            front: true,
            leading: false,
        };
        assert_eq!(figure.front(), [(0, 0), (0, 1), (1, 2)]);
        figure.curves.truncate(1);
        assert!(figure.front().is_empty(), "one series has nothing to dominate");
    }
}
