//! Shares of meshes and error targets that each method reaches.
//!
//! 1. Performance profile (Dolan and Moré, 2002, "Benchmarking optimization software with performance profiles"): the share
//!    of meshes where the error of a method is at most a factor above the least one of all methods, by that factor. It
//!    depends on the set of methods (Gould and Scott, 2016).
//! 2. Empirical distributions over pairs of a mesh and an error target (as in COCO, Hansen et al., 2021): the share of
//!    pairs that a method reaches within a number of spheres, and within seconds, by any of its results.

use medial_run::record::Record;
use medial_run::text::counted;

use super::{Curve, Figure, Point, Scale};
use crate::answers::{Values, errors_at, usual_level, values};
use crate::comparison::{Comparison, reached};
use crate::metric::{HAUSDORFF, TOTAL_SECONDS};

/// Error targets in % of the diagonal.
const TARGETS: [f64; 8] = [5.0, 3.0, 2.0, 1.0, 0.5, 0.3, 0.2, 0.1];

/// The figures of shares over at least two meshes.
pub(crate) fn profile_figures(comparison: &Comparison<'_>) -> Vec<Figure> {
    if comparison.meshes.len() < 2 {
        return vec![];
    }
    let mut figures = vec![];
    if let Some((level, count)) = usual_level(comparison) {
        let errors = errors_at(comparison, level);
        let least: Vec<f64> = (0..comparison.meshes.len())
            .map(|mesh| {
                let all = errors.iter().filter_map(|own| Some(own[mesh]?.value));
                all.fold(f64::INFINITY, f64::min).max(1e-9)
            })
            .collect();
        let factors = errors.iter().map(|own| {
            let found = own.iter().zip(&least).filter(|(_, least)| least.is_finite());
            found.filter_map(|(own, least)| Some(((*own)?.value / least).max(1.0))).collect()
        });
        figures.push(figure(
            comparison,
            "profile",
            format!(
                "Meshes with an error within a factor of the least, {}",
                counted(count, "sphere", "spheres")
            ),
            "factor above the least Hausdorff error",
            factors.collect(),
        ));
    }
    type Cost = fn(&Record) -> Option<f64>;
    let costs: [(&str, &str, Cost); 2] = [
        ("spheres", "spheres", |record| Some(reached(record)? as f64)),
        ("time", "time (s)", |record| TOTAL_SECONDS.of(record)),
    ];
    for (name, axis, cost) in costs {
        let mut all: Vec<Vec<f64>> = vec![vec![]; comparison.series.len()];
        for target in TARGETS {
            let costs: Vec<Values> = values(comparison, None, |entry| {
                HAUSDORFF.of(entry.record).filter(|&e| entry.measured() && e <= target)?;
                cost(entry.record)
            });
            for (all, own) in all.iter_mut().zip(costs) {
                all.extend(own.into_iter().flatten().map(|found| found.value));
            }
        }
        let title =
            format!("Error targets from {} to {} % reached, by {name}", TARGETS[7], TARGETS[0]);
        figures.push(figure(comparison, &format!("targets-{name}"), title, axis, all));
    }
    figures.retain(|figure| figure.curves.iter().any(|curve| !curve.points.is_empty()));
    figures
}

/// The shares of values up to each one, infinite values included in the whole.
fn figure(
    comparison: &Comparison<'_>,
    name: &str,
    title: String,
    axis: &str,
    values: Vec<Vec<f64>>,
) -> Figure {
    let last = values.iter().flatten().copied().filter(|value| value.is_finite());
    let last = last.fold(f64::MIN_POSITIVE, f64::max);
    let mut curves = vec![];
    for (series, mut own) in values.into_iter().enumerate() {
        let whole = own.len();
        own.retain(|value| value.is_finite());
        own.sort_by(f64::total_cmp);
        let point = |x: f64, count: usize| {
            let y = 100.0 * count as f64 / whole as f64;
            Point { x, y, n: Some(whole), ..Point::default() }
        };
        let mut points: Vec<Point> = vec![];
        for (k, &x) in own.iter().enumerate() {
            // Of equal values the last one has the share.
            if own.get(k + 1) != Some(&x) {
                points.push(point(x, k + 1));
            }
        }
        if let Some(&first) = own.first() {
            points.insert(0, point(first, 0));
            points.push(point(last, own.len()));
        }
        let name = comparison.series[series].clone();
        let of = if axis.starts_with("factor") { "meshes" } else { "pairs of mesh and target" };
        curves.push(Curve {
            series,
            label: name.clone(),
            name,
            of: of.to_owned(),
            points,
            dashed: false,
        });
    }
    curves.retain(|curve| !curve.points.is_empty());
    Figure {
        stem: format!("overview-{name}"),
        title,
        x: axis.to_owned(),
        y: ("share (%)".to_owned(), Scale::Linear),
        curves,
        leading: false,
        steps: true,
    }
}

/// The curves of some figures of shares as CSV.
pub(crate) fn profiles_csv(figures: &[Figure]) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(vec![]);
    writer.write_record(["figure", "method", "x", "share", "n"])?;
    for figure in figures {
        let name = figure.stem.trim_start_matches("overview-");
        for curve in &figure.curves {
            // Without the ends of the drawing.
            for point in &curve.points[1..curve.points.len() - 1] {
                let [x, share] = [point.x, point.y / 100.0].map(|value| value.to_string());
                let n = point.n.unwrap_or(0).to_string();
                writer.write_record([name, &curve.name, &x, &share, &n])?;
            }
        }
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}
