//! Plots. The page draws a [`Figure`] from its JSON, `svg` draws it for papers.
//!
//! Every number of a figure is computed here, so both drawings show the same points, the same
//! labels.

mod axis;
mod svg;

use medial_run::text::significant;
use serde_json::{Value, json};

use crate::comparison::{Comparison, Entry, reached};
use crate::header::Header;
use crate::metric::{
    Better, COMPLETENESS, GEOMETRIC, HAUSDORFF, LARGER_SIDE, MEAN_ERROR, MIN_ANGLE, Metric, SPIKES,
    TOTAL_SECONDS,
};
use crate::summary::{CountSummary, NativeCurve};

pub(crate) use self::axis::Scale;
pub(crate) use self::svg::symbol;

/// A figure before it is drawn. Its horizontal axis is logarithmic.
pub(crate) struct Figure {
    /// File name without folder and extension.
    pub(crate) stem: String,
    pub(crate) title: String,
    pub(crate) x: String,
    pub(crate) y: (String, Scale),
    /// Better direction along the vertical axis; along the bottom less is better.
    pub(crate) better: Better,
    pub(crate) curves: Vec<Curve>,
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
    /// The ends of a bar: a 95 % interval over meshes, or the range over seeds.
    pub(crate) bar: Option<[f64; 2]>,
}

/// The style of each series, for [`symbol`]: a method has the same one in every report.
///
/// The header lists all methods of the program in their order; other rows, as those with parameters, have the
/// styles after them.
pub(crate) fn styles(header: &Header, comparison: &Comparison<'_>) -> Vec<usize> {
    let mut other = header.methods.len()..;
    let style = |name: &String| {
        let own = header.methods.iter().position(|note| note.id == *name);
        own.or_else(|| other.next()).unwrap_or(0)
    };
    comparison.series.iter().map(style).collect()
}

impl Figure {
    /// The front: points that no other one beats in both directions, from left to right. Means over fewer meshes
    /// than the others are not among them.
    pub(crate) fn front(&self) -> Vec<&Point> {
        let mut points: Vec<&Point> = self.curves.iter().flat_map(|curve| &curve.points).collect();
        let most = points.iter().map(|point| point.n).max().flatten();
        points.retain(|point| point.n == most);
        points.sort_by(|a, b| a.x.total_cmp(&b.x).then_with(|| a.y.total_cmp(&b.y)));
        let mut front: Vec<&Point> = vec![];
        for point in points {
            if front.last().is_none_or(|last| self.better.prefers(point.y, last.y)) {
                front.push(point);
            }
        }
        front
    }

    /// The figure for the script of the page: numbers with five digits.
    pub(crate) fn to_json(&self) -> Value {
        let rounded = |value| significant(value, 5).parse().unwrap_or(value);
        let curves = self.curves.iter().map(|curve| {
            let points = curve.points.iter().map(|point| {
                let [x, y] = [point.x, point.y].map(rounded);
                let bar = point.bar.map(|ends| ends.map(rounded));
                json!([x, y, point.n, point.spheres.map(rounded), bar])
            });
            json!({
                "series": curve.series, "label": curve.label, "name": curve.name, "of": curve.of,
                "dashed": curve.dashed, "points": points.collect::<Vec<_>>(),
            })
        });
        json!({
            "title": self.title, "leading": self.leading,
            "x": {"title": self.x, "scale": Scale::Log}, "y": {"title": self.y.0, "scale": self.y.1},
            "higher": self.better == Better::Higher,
            "curves": curves.collect::<Vec<_>>(),
        })
    }
}

/// A kind of figures, one for each mesh and one of the means over all: name, title, the metric upwards and its axis.
struct Kind(&'static str, &'static str, &'static Metric, &'static str);

const ERROR: &str = "Hausdorff error (% of diagonal)";

const KINDS: [Kind; 7] = [
    Kind("hausdorff", "Hausdorff error against spheres", &HAUSDORFF, ERROR),
    Kind("time", "Hausdorff error against time", &HAUSDORFF, ERROR),
    Kind("mean", "Mean error against spheres", &MEAN_ERROR, "mean error (% of diagonal)"),
    Kind(
        "angles",
        "Triangle quality: mean smallest angle",
        &MIN_ANGLE,
        "mean smallest angle (degrees)",
    ),
    Kind("spikes", "Spikes left", &SPIKES, "spikes"),
    Kind(
        "structure",
        "Axis missed against spheres",
        &COMPLETENESS,
        "axis missed, p95 (% of diagonal)",
    ),
    Kind(
        "cover",
        "Uncovered or overshoot against spheres",
        &LARGER_SIDE,
        "larger of uncovered and overshoot (% of diagonal)",
    ),
];

impl Kind {
    /// Seconds rather than spheres along the bottom.
    fn is_over_time(&self) -> bool {
        self.0 == "time"
    }

    fn figure(&self, stem: &str, of: &str, mut curves: Vec<Curve>) -> Option<Figure> {
        let Self(name, title, metric, y) = self;
        // Lengths span orders of magnitude.
        let scale = if metric.mean == GEOMETRIC { Scale::Log } else { Scale::Linear };
        curves.retain(|curve| !curve.points.is_empty()); // no legend without a mark
        (!curves.is_empty()).then(|| Figure {
            stem: format!("{stem}-{name}"),
            title: format!("{of}: {title}"),
            x: if self.is_over_time() { "time (s)".to_owned() } else { "spheres".to_owned() },
            y: ((*y).to_owned(), scale),
            better: metric.better,
            curves,
            leading: matches!(*name, "hausdorff" | "time"),
        })
    }

    /// A curve of results or means. Over time the points have their number of spheres, which no axis shows. Dashes are at
    /// native levels.
    fn curve(
        &self,
        series: usize,
        (name, of): (&str, &str),
        dashed: bool,
        points: impl IntoIterator<Item = Place>,
    ) -> Curve {
        let points: Vec<Point> = (points.into_iter())
            .filter_map(|Place { spheres, seconds, y, n, bar }| {
                let (x, spheres) =
                    if self.is_over_time() { (seconds?, Some(spheres)) } else { (spheres, None) };
                Some(Point { x, y: y?, n: Some(n), spheres, bar })
            })
            .collect();
        let [label, name, of] = [name, name, of].map(str::to_owned);
        Curve { series, label, name, of, points, dashed }
    }
}

/// A result or a mean before it is a point: the number of meshes behind it, and the ends of its bar.
struct Place {
    spheres: f64,
    seconds: Option<f64>,
    y: Option<f64>,
    n: usize,
    bar: Option<[f64; 2]>,
}

/// The figures of one mesh: every measured result of each method, from many spheres to few. Those at counts and error
/// bounds are a line, those at native levels dashes.
pub(crate) fn mesh_figures(comparison: &Comparison<'_>, mesh: usize, stem: &str) -> Vec<Figure> {
    let mut figures = vec![];
    for kind in &KINDS {
        let mut curves: Vec<Curve> = vec![];
        for (series, dashed) in (0..comparison.series.len()).flat_map(|s| [(s, false), (s, true)]) {
            let mut entries: Vec<&Entry<'_>> = (comparison.of_mesh(mesh))
                .filter(|entry| entry.series == series && entry.measured())
                .filter(|entry| entry.record.simplify.level.is_native() == dashed)
                .collect();
            entries.sort_by_key(|entry| std::cmp::Reverse(reached(entry.record)));
            let points = entries.into_iter().filter_map(|entry| {
                let record = entry.record;
                let spheres = reached(record)? as f64;
                let (seconds, y) = (TOTAL_SECONDS.of(record), kind.2.of(record));
                Some(Place { spheres, seconds, y, n: 1, bar: comparison.range(entry, kind.2) })
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
                Place { spheres: point.spheres, seconds: None, y, n: native.over, bar: None }
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
        let (spheres, seconds) = (summary.count as f64, row.mean(&TOTAL_SECONDS));
        Some(Place { spheres, seconds, y: Some(y), n: over, bar: row.interval(kind.2) })
    });
    let curve = kind.curve(series, (name, "mean"), false, points);
    Curve { label, ..curve }
}
