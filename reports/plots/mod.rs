//! Plots: what stands in them. The page draws a [`Figure`] from its JSON, `svg` draws it for papers.
//!
//! Every number of a figure is computed here, so both drawings show the same points, the same
//! front and the same labels.

mod axis;
mod svg;

use serde_json::{Value, json};

use crate::comparison::{Comparison, reached, rises};
use crate::metric::{HAUSDORFF, MEAN_ERROR, MIN_ANGLE, Metric, SPIKES, TOTAL_SECONDS};
use crate::record::Record;
use crate::summary::{CountSummary, NativeCurve};
use crate::text::{grouped, significant};

pub(crate) use self::axis::Scale;
pub(crate) use self::svg::symbol;

/// A figure before it is drawn. Its horizontal axis is logarithmic.
pub(crate) struct Figure {
    /// File name without folder and extension.
    pub(crate) stem: String,
    pub(crate) title: String,
    pub(crate) x: String,
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
    /// Whether it is an error above one of fewer spheres.
    pub(crate) rising: bool,
}

impl Point {
    pub(crate) fn at(x: f64, y: f64) -> Self {
        Self { x, y, ..Self::default() }
    }
}

impl Figure {
    /// The figure without its empty curves; `None` where no curve is left.
    pub(crate) fn with_points(mut self) -> Option<Self> {
        self.curves.retain(|curve| !curve.points.is_empty()); // no legend without a mark
        (!self.curves.is_empty()).then_some(self)
    }

    /// The figure for the script of the page: numbers with five digits.
    pub(crate) fn to_json(&self) -> Value {
        let front = self.front();
        let rounded = |value| significant(value, 5).parse().unwrap_or(value);
        let curves = self.curves.iter().enumerate().map(|(index, curve)| {
            let points = curve.points.iter().enumerate().map(|(k, point)| {
                let is_front = u8::from(front.contains(&(index, k)));
                let [x, y] = [point.x, point.y].map(rounded);
                let is_rising = u8::from(point.rising);
                json!([x, y, point.n, point.spheres.map(rounded), is_front, point.tag, is_rising])
            });
            json!({
                "series": curve.series, "label": curve.label, "name": curve.name, "of": curve.of,
                "dashed": curve.dashed, "points": points.collect::<Vec<_>>(),
            })
        });
        json!({
            "title": self.title, "leading": self.leading,
            "x": {"title": self.x, "scale": Scale::Log}, "y": {"title": self.y.0, "scale": self.y.1},
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
                    all.push((p.x, p.y, index, k)); // indices break ties
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
            let is_lower = y < lowest; // strictly: of equal ones the left one stays
            lowest = lowest.min(y);
            is_lower
        });
        all.into_iter().map(|(_, _, curve, point)| (curve, point)).collect()
    }
}

/// A family of figures, one for each mesh and one of the means over all: name, title, and the metric upwards.
struct Kind(&'static str, &'static str, &'static Metric);

const KINDS: [Kind; 5] = [
    Kind("hausdorff", "Hausdorff error against spheres", &HAUSDORFF),
    Kind("time", "Hausdorff error against time", &HAUSDORFF),
    Kind("mean", "Mean error against spheres", &MEAN_ERROR),
    Kind("angles", "Triangle quality: mean smallest angle", &MIN_ANGLE),
    Kind("spikes", "Spikes left", &SPIKES),
];

impl Kind {
    /// Seconds rather than spheres along the bottom.
    fn is_over_time(&self) -> bool {
        self.0 == "time"
    }

    /// Whether the metric is an error, which spans orders of magnitude and of which less is better at any cost.
    fn is_error(&self) -> bool {
        !matches!(self.0, "angles" | "spikes")
    }

    fn figure(&self, stem: &str, of: &str, curves: Vec<Curve>) -> Option<Figure> {
        let Self(name, title, _) = self;
        let y = match *name {
            "angles" => "mean smallest angle (degrees)",
            "spikes" => "spikes",
            "mean" => "mean error (% of diagonal)",
            _ => "Hausdorff error (% of diagonal)",
        };
        let scale = if self.is_error() { Scale::Log } else { Scale::Linear };
        let figure = Figure {
            stem: format!("{stem}-{name}"),
            title: format!("{of}: {title}"),
            x: if self.is_over_time() { "time (s)".to_owned() } else { "spheres".to_owned() },
            y: (y.to_owned(), scale),
            curves,
            front: self.is_error(),
            leading: matches!(*name, "hausdorff" | "time"),
        };
        figure.with_points()
    }

    /// A curve of results or means: spheres, seconds and y of each, the meshes behind it, and of how many. Those over
    /// all meshes are compared. Over time both ends are tagged with their number of spheres, which no axis shows. Dashes
    /// are at native levels, where an error that rises has no mark.
    fn curve(
        &self,
        series: usize,
        (name, of): (&str, &str),
        dashed: bool,
        points: impl IntoIterator<Item = (f64, Option<f64>, Option<f64>, [usize; 2])>,
    ) -> Curve {
        let points: Vec<_> = points.into_iter().collect();
        let errors: Vec<(f64, f64)> = (points.iter())
            .filter_map(|&(spheres, _, y, _)| {
                Some((spheres, y.filter(|_| self.is_error() && !dashed)?))
            })
            .collect();
        let mut points: Vec<Point> = (points.into_iter())
            .filter_map(|(spheres, seconds, y, [n, all])| {
                let rising = rises((spheres, y?), &errors);
                let (x, spheres) =
                    if self.is_over_time() { (seconds?, Some(spheres)) } else { (spheres, None) };
                let compared = n == all;
                Some(Point { x, y: y?, n: Some(n), spheres, compared, tag: None, rising })
            })
            .collect();
        for k in [0, points.len().saturating_sub(1)] {
            if let Some(point) = points.get_mut(k) {
                point.tag = point.spheres.map(|spheres| grouped(spheres as u64));
            }
        }
        let [label, name, of] = [name, name, of].map(str::to_owned);
        Curve { series, label, name, of, points, dashed }
    }
}

/// The figures of one mesh: every measured result of each method, from many spheres to few. Those at counts and error
/// bounds are a line, those at native levels dashes.
pub(crate) fn mesh_figures(comparison: &Comparison<'_>, mesh: usize, stem: &str) -> Vec<Figure> {
    let mut figures = vec![];
    for kind in &KINDS {
        let mut curves: Vec<Curve> = vec![];
        for (series, dashed) in (0..comparison.series.len()).flat_map(|s| [(s, false), (s, true)]) {
            let mut records: Vec<&Record> = (comparison.of_mesh(mesh))
                .filter(|entry| entry.series == series && entry.measured())
                .map(|entry| entry.record)
                .filter(|record| record.simplify.level.is_native() == dashed)
                .collect();
            records.sort_by_key(|record| std::cmp::Reverse(reached(record)));
            let points = records.into_iter().filter_map(|record| {
                Some((reached(record)? as f64, TOTAL_SECONDS.of(record), kind.2.of(record), [1, 1]))
            });
            let names = (&*comparison.series[series], &*comparison.meshes[mesh]);
            let mut curve = kind.curve(series, names, dashed, points);
            // One row in the legend for both.
            if dashed && curves.last().is_some_and(|solid| !solid.points.is_empty()) {
                curve.label.clear();
            }
            curves.push(curve);
        }
        figures.extend(kind.figure(&format!("mesh-{stem}"), &comparison.meshes[mesh], curves));
    }
    figures
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
            let series = native.series;
            let name = format!("{} (native levels)", comparison.series[series]);
            let points = native.points.iter().map(|point| {
                let y = match kind.0 {
                    "hausdorff" => Some(point.hausdorff),
                    "mean" => Some(point.mean),
                    _ => None,
                };
                (point.spheres, None, y, [native.over, comparison.meshes.len()])
            });
            let mut curve = kind.curve(series, (&name, "mean"), true, points);
            if !curves[series].points.is_empty() {
                curve.label.clear();
            }
            curves.push(curve);
        }
        let of = format!("All meshes, {} means", kind.2.mean.word());
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
    let name = &comparison.series[series];
    let mut label = name.clone();
    let points = summaries.iter().filter_map(|summary| {
        let row = summary.rows.iter().find(|row| row.series == series)?;
        let (y, over) = (row.mean(kind.2)?, row.over(kind.2));
        // The set of meshes is the same at each count that has a mean.
        if over != summary.meshes {
            label = format!("{name} ({over} of {})", summary.meshes);
        }
        let of = [over, summary.meshes];
        Some((summary.count as f64, row.mean(&TOTAL_SECONDS), Some(y), of))
    });
    let curve = kind.curve(series, (name, "mean"), false, points);
    Curve { label, ..curve }
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
        let mut figure = Figure {
            stem: String::new(),
            title: String::new(),
            x: String::new(),
            y: (String::new(), Scale::Log),
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
