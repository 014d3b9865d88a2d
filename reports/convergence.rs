//! How computed axes come near to known ones as the surface is sampled more finely: fitted orders, tables, plots.
//!
//! The *order* of an error is `p` in `error = C h^p`, with `h` the mean edge of the surface: the slope of the
//! least-squares line through the logarithms, with the 95 % interval of Student's t. Errors at the tolerance of the
//! known axis say nothing about the computed one and are left out of the fit.

use std::collections::BTreeMap;

use medial::metrics::AxisSpan;
use serde::{Deserialize, Serialize};

use crate::error::ReportError;
use crate::history::beyond;
use crate::plots::{ConvergenceCurve, against_edge_length};
use crate::tables::{Cell, Column, Row, Table, to_markdown};
use crate::text::significant;

/// A centre farther from the known axis than this, as a fraction of the diagonal, is *far*: spheres of slivers
/// stay so at every resolution.
pub const FAR: f64 = 0.01;

/// A fit needs so many resolutions.
const LEAST_POINTS: usize = 3;
/// The interval covers the order in so many of all cases.
const CONFIDENCE: f64 = 0.95;
/// Errors below this, as a fraction of the diagonal, are rounding.
const ROUNDING: f64 = 1e-9;

/// Which spheres are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisSet {
    /// The inner poles alone, as isolated spheres.
    Poles,
    /// The initial medial mesh: all Voronoi vertices inside, with edges and faces.
    Voronoi,
    /// What a filter leaves of it.
    Filtered,
}

impl AxisSet {
    /// All of them, in the order of the tables.
    pub const ALL: [Self; 3] = [Self::Poles, Self::Voronoi, Self::Filtered];

    fn title(self) -> &'static str {
        match self {
            Self::Poles => "poles",
            Self::Voronoi => "Voronoi",
            Self::Filtered => "filtered",
        }
    }
}

/// One set of spheres on one surface, measured against the known axis. Lengths are fractions of the diagonal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConvergenceRecord {
    /// Id of the shape.
    pub shape: String,
    /// Kind of the noise, or `none`.
    pub noise: String,
    /// Its magnitude.
    pub magnitude: f64,
    /// Its seed.
    pub seed: u64,
    /// 0 for the coarsest resolution.
    pub level: usize,
    /// The resolution of the shape.
    pub resolution: u32,
    /// Vertices of the surface.
    pub vertices: usize,
    /// Mean edge of the surface.
    pub edge: f64,
    /// Which spheres.
    pub set: AxisSet,
    /// How many.
    pub spheres: usize,
    /// How far the known axis itself may be from the true one.
    pub tolerance: f64,
    /// Distances to the known axis and back, radii ignored.
    pub in_space: AxisSpan,
    /// The same with radii as a fourth coordinate.
    pub with_radius: AxisSpan,
    /// Share of spheres with their centre farther than [`FAR`] from the known axis.
    pub far_share: f64,
}

/// The order of an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// The exponent of the edge length.
    pub order: f64,
    /// Half the width of its 95 % interval.
    pub half_width: f64,
    /// Resolutions in the fit.
    pub points: usize,
}

/// An error that orders are fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Largest distance from a sphere, edge or face to the known axis.
    ToAxisMax,
    /// Mean of it.
    ToAxisMean,
    /// Largest distance from the known axis.
    FromAxisMax,
    /// Mean distance to the known axis with radii.
    WithRadiusMean,
}

impl Measure {
    const ALL: [Self; 4] =
        [Self::ToAxisMax, Self::ToAxisMean, Self::FromAxisMax, Self::WithRadiusMean];

    /// Its value in a record.
    pub fn of(self, record: &ConvergenceRecord) -> f64 {
        match self {
            Self::ToAxisMax => record.in_space.computed_to_true_max,
            Self::ToAxisMean => record.in_space.computed_to_true_mean,
            Self::FromAxisMax => record.in_space.true_to_computed_max,
            Self::WithRadiusMean => record.with_radius.computed_to_true_mean,
        }
    }
}

/// The order of one measure of one set on one shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConvergenceFit {
    /// Id of the shape.
    pub shape: String,
    /// Kind of the noise, or `none`.
    pub noise: String,
    /// Which spheres.
    pub set: AxisSet,
    /// Which error.
    pub measure: Measure,
    /// The error at the finest resolution.
    pub finest: f64,
    /// Whether there is nothing left to converge: all errors are within the known axis's own tolerance, or that at
    /// the finest resolution is rounding.
    pub exact: bool,
    /// The order; `None` where exact, or without three resolutions whose errors are above that tolerance.
    pub order: Option<Order>,
}

/// What is written of a set of records.
#[derive(Clone, Debug)]
pub struct ConvergenceReport {
    /// All orders, by shape, noise, set and measure.
    pub fits: Vec<ConvergenceFit>,
    /// A table for each kind of noise.
    pub markdown: String,
    /// All records, one row each.
    pub csv: Vec<u8>,
    /// Stem and SVG of a plot for each kind of noise.
    pub plots: Vec<(String, String)>,
}

/// The slope of log error over log edge length.
///
/// `None` for fewer than three points, for points of one edge length, and where a coordinate is not positive.
pub fn fitted_order(points: &[(f64, f64)]) -> Option<Order> {
    let positive = |x: f64| x > 0.0 && x.is_finite();
    if points.len() < LEAST_POINTS || !points.iter().all(|&(h, e)| positive(h) && positive(e)) {
        return None;
    }
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(h, error)| (h.ln(), error.ln())).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|log| log.0), mean(|log| log.1));
    let spread: f64 = logs.iter().map(|log| (log.0 - x).powi(2)).sum();
    if spread <= 0.0 {
        return None;
    }
    let order = logs.iter().map(|log| (log.0 - x) * (log.1 - y)).sum::<f64>() / spread;
    let rest: f64 = logs.iter().map(|log| (log.1 - y - order * (log.0 - x)).powi(2)).sum();
    let freedom = points.len() - 2;
    let standard = (rest / freedom as f64 / spread).sqrt();
    let half_width = standard * beyond(1.0 - CONFIDENCE, freedom);
    Some(Order { order, half_width, points: points.len() })
}

/// Orders, tables and plots of records; `how` is the command that made them.
///
/// # Errors
/// When a plot or the CSV cannot be made.
pub fn convergence_report(
    records: &[ConvergenceRecord],
    how: &str,
) -> Result<ConvergenceReport, ReportError> {
    let fits = fits(records);
    let mut noises: Vec<&str> = Vec::new();
    for record in records {
        if !noises.contains(&record.noise.as_str()) {
            noises.push(&record.noise);
        }
    }
    let (mut markdown, mut plots) = (Vec::new(), Vec::new());
    for noise in noises {
        let of_noise: Vec<&ConvergenceRecord> =
            records.iter().filter(|record| record.noise == noise).collect();
        markdown.push(to_markdown(&table(&of_noise, &fits, how)));
        let stem = format!("convergence-{noise}");
        let title = format!("Largest distance to the known axis, {}", described(of_noise[0]));
        plots.extend(against_edge_length(stem, title, curves(&of_noise))?);
    }
    let plots = plots.into_iter().map(|plot| (plot.stem, plot.svg)).collect();
    Ok(ConvergenceReport { fits, markdown: markdown.join("\n"), csv: csv(records)?, plots })
}

/// By shape, noise, set and measure, in the order of the records.
fn fits(records: &[ConvergenceRecord]) -> Vec<ConvergenceFit> {
    let mut series: Vec<Vec<&ConvergenceRecord>> = Vec::new();
    let key = |record: &ConvergenceRecord| (record.shape.clone(), record.noise.clone(), record.set);
    let mut places = BTreeMap::new();
    for record in records {
        let place = *places.entry(key(record)).or_insert(series.len());
        match series.get_mut(place) {
            Some(of_key) => of_key.push(record),
            None => series.push(vec![record]),
        }
    }
    let of_series =
        |series: &Vec<&ConvergenceRecord>| Measure::ALL.map(|measure| fit(series, measure));
    series.iter().flat_map(of_series).collect()
}

fn fit(series: &[&ConvergenceRecord], measure: Measure) -> ConvergenceFit {
    let is_told = |record: &&&ConvergenceRecord| measure.of(record) > floor(record);
    let told: Vec<_> = series.iter().filter(is_told).collect();
    let points: Vec<(f64, f64)> = told.iter().map(|r| (r.edge, measure.of(r))).collect();
    let finest = series.iter().min_by(|a, b| a.edge.total_cmp(&b.edge)).expect("a record");
    let exact = told.is_empty() || measure.of(finest) <= ROUNDING;
    ConvergenceFit {
        shape: finest.shape.clone(),
        noise: finest.noise.clone(),
        set: finest.set,
        measure,
        finest: measure.of(finest),
        exact,
        order: if exact { None } else { fitted_order(&points) },
    }
}

/// Below this an error is that of the known axis or of rounding.
fn floor(record: &ConvergenceRecord) -> f64 {
    2.0 * record.tolerance + ROUNDING
}

fn described(record: &ConvergenceRecord) -> String {
    let percent = significant(100.0 * record.magnitude, 2);
    match record.noise.as_str() {
        "none" => "no noise".to_owned(),
        "dropped" => format!("{percent} % of the vertices dropped"),
        noise => format!("{noise} noise of {percent} % of the diagonal"),
    }
}

/// Columns of the table: a set and a measure, or the share of far spheres of a set.
const COLUMNS: [(AxisSet, Option<Measure>, &str); 9] = [
    (AxisSet::Poles, Some(Measure::ToAxisMax), "poles: to axis"),
    (AxisSet::Poles, Some(Measure::WithRadiusMean), "poles: mean, with radius"),
    (AxisSet::Poles, Some(Measure::FromAxisMax), "poles: from axis"),
    (AxisSet::Voronoi, Some(Measure::ToAxisMax), "Voronoi: to axis"),
    (AxisSet::Voronoi, Some(Measure::FromAxisMax), "Voronoi: from axis"),
    (AxisSet::Voronoi, None, "Voronoi: far"),
    (AxisSet::Filtered, Some(Measure::ToAxisMax), "filtered: to axis"),
    (AxisSet::Filtered, Some(Measure::FromAxisMax), "filtered: from axis"),
    (AxisSet::Filtered, None, "filtered: far"),
];

fn table(records: &[&ConvergenceRecord], fits: &[ConvergenceFit], how: &str) -> Table {
    let mut shapes: Vec<&str> = Vec::new();
    for record in records {
        if !shapes.contains(&record.shape.as_str()) {
            shapes.push(&record.shape);
        }
    }
    let columns = [Column::text("shape"), Column::text("vertices")].into_iter();
    let row = |shape: &&str| {
        let own: Vec<_> = records.iter().filter(|record| record.shape == *shape).copied().collect();
        let cells = COLUMNS.iter().map(|&(set, measure, _)| match measure {
            Some(measure) => Cell::new(order_cell(&own, fits, set, measure)),
            None => Cell::new(far_cell(&own, set)),
        });
        let first = [Cell::new(*shape), Cell::new(range(own.iter().map(|record| record.vertices)))];
        Row { cells: first.into_iter().chain(cells).collect(), starts_group: false }
    };
    Table {
        caption: format!("Distances to known axes, {}", described(records[0])),
        notes: vec![
            how.to_owned(),
            format!(
                "Error at the finest resolution in % of the diagonal, and the order p of error = C h^p with its 95 % \
                 interval, h the mean edge. To axis: the largest distance from the computed spheres, edges and faces to \
                 the known axis; from axis: the largest one back. Far: the share of spheres whose centre is more than \
                 {} % of the diagonal away, at the coarsest and at the finest resolution.",
                100.0 * FAR
            ),
        ],
        columns: columns.chain(COLUMNS.map(|(_, _, title)| Column::text(title))).collect(),
        rows: shapes.iter().map(row).collect(),
    }
}

fn range(counts: impl Iterator<Item = usize> + Clone) -> String {
    let (least, most) = (counts.clone().min().unwrap_or(0), counts.max().unwrap_or(0));
    format!("{least} to {most}")
}

fn order_cell(
    own: &[&ConvergenceRecord],
    fits: &[ConvergenceFit],
    set: AxisSet,
    measure: Measure,
) -> String {
    let fit = own.first().and_then(|record| {
        fits.iter().find(|fit| {
            fit.shape == record.shape
                && fit.noise == record.noise
                && fit.set == set
                && fit.measure == measure
        })
    });
    let Some(fit) = fit else { return "–".to_owned() };
    if fit.exact {
        return "exact".to_owned();
    }
    let error = significant(100.0 * fit.finest, 2);
    match fit.order {
        Some(fit) => format!("{error}; {} ± {:.1}", exponent(fit.order), fit.half_width),
        None => format!("{error}; no order"),
    }
}

/// One decimal, and no minus before a zero.
fn exponent(order: f64) -> String {
    format!("{:.1}", if order.abs() < 0.05 { 0.0 } else { order })
}

fn far_cell(own: &[&ConvergenceRecord], set: AxisSet) -> String {
    let of_set: Vec<_> = own.iter().filter(|record| record.set == set).collect();
    match (of_set.first(), of_set.last()) {
        (Some(first), Some(last)) => {
            format!("{:.1} to {:.1} %", 100.0 * first.far_share, 100.0 * last.far_share)
        }
        _ => "–".to_owned(),
    }
}

/// For each set the median over shapes, level by level: shapes differ too much for a mean.
fn curves(records: &[&ConvergenceRecord]) -> Vec<ConvergenceCurve> {
    let levels = records.iter().map(|record| record.level).max().map_or(0, |level| level + 1);
    let point = |set: AxisSet, level: usize| {
        let own = records.iter().filter(|record| record.set == set && record.level == level);
        let error = median(own.clone().map(|record| Measure::ToAxisMax.of(record)).collect())?;
        Some((median(own.map(|record| record.edge).collect())?, error.max(ROUNDING)))
    };
    AxisSet::ALL
        .into_iter()
        .enumerate()
        .map(|(series, set)| {
            let points: Vec<_> = (0..levels).filter_map(|level| point(set, level)).collect();
            let label = match fitted_order(&points) {
                Some(fit) => format!("{}, h^{}", set.title(), exponent(fit.order)),
                None => set.title().to_owned(),
            };
            ConvergenceCurve { series, label, points }
        })
        .collect()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[middle]),
        _ => Some((values[middle - 1] + values[middle]) / 2.0),
    }
}

fn csv(records: &[ConvergenceRecord]) -> Result<Vec<u8>, ReportError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let spans = ["in_space", "with_radius"].into_iter().flat_map(|what| {
        ["to_axis_max", "to_axis_mean", "from_axis_max", "from_axis_mean"]
            .map(|of| format!("{what}_{of}"))
    });
    let first = [
        "shape",
        "noise",
        "magnitude",
        "seed",
        "level",
        "resolution",
        "vertices",
        "edge",
        "set",
        "spheres",
        "tolerance",
        "far_share",
    ];
    let titles = first.into_iter().map(str::to_owned).chain(spans);
    let failed = |error: csv::Error| ReportError::Content {
        what: "convergence.csv",
        message: error.to_string(),
    };
    writer.write_record(titles).map_err(failed)?;
    for record in records {
        let span = |span: &AxisSpan| {
            [
                span.computed_to_true_max,
                span.computed_to_true_mean,
                span.true_to_computed_max,
                span.true_to_computed_mean,
            ]
        };
        let mut fields = vec![
            record.shape.clone(),
            record.noise.clone(),
            record.magnitude.to_string(),
            record.seed.to_string(),
            record.level.to_string(),
            record.resolution.to_string(),
            record.vertices.to_string(),
            record.edge.to_string(),
            record.set.title().to_owned(),
            record.spheres.to_string(),
            record.tolerance.to_string(),
            record.far_share.to_string(),
        ];
        let spans = [span(&record.in_space), span(&record.with_radius)];
        fields.extend(spans.as_flattened().iter().map(f64::to_string));
        writer.write_record(fields).map_err(failed)?;
    }
    writer.into_inner().map_err(|error| failed(error.into_error().into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(shape: &str, set: AxisSet, level: usize, error: f64) -> ConvergenceRecord {
        let span = AxisSpan {
            computed_to_true_max: error,
            computed_to_true_mean: error / 2.0,
            true_to_computed_max: 2.0 * error,
            true_to_computed_mean: error,
        };
        ConvergenceRecord {
            shape: shape.to_owned(),
            noise: "none".to_owned(),
            magnitude: 0.0,
            seed: 0,
            level,
            resolution: 10 << level,
            vertices: 100 << (2 * level),
            edge: 0.1 / f64::from(1 << level),
            set,
            spheres: 10,
            tolerance: 1e-4,
            in_space: span,
            with_radius: span,
            far_share: 0.25,
        }
    }

    #[test]
    fn an_order_is_found_as_it_is() {
        let points: Vec<(f64, f64)> =
            [0.1, 0.05, 0.02].map(|h: f64| (h, 3.0 * h.powf(1.5))).to_vec();
        let fit = fitted_order(&points).unwrap();
        assert!(
            (fit.order - 1.5).abs() < 1e-12 && fit.half_width < 1e-6 && fit.points == 3,
            "{fit:?}"
        );
        assert_eq!(fitted_order(&points[..2]), None);
        assert_eq!(fitted_order(&[(0.1, 1.0), (0.1, 2.0), (0.1, 3.0)]), None);
        assert_eq!(fitted_order(&[(0.1, 1.0), (0.2, 0.0), (0.3, 3.0)]), None);
    }

    #[test]
    fn the_interval_is_that_of_the_textbook() {
        // ln h = 0, 1, 2, 3 and ln e = 0, 1, 2, 4: slope 1.3, standard error sqrt(0.3 / 2 / 5), t = 4.30265.
        let points = [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 4.0)];
        let points = points.map(|(x, y): (f64, f64)| (x.exp(), y.exp()));
        let fit = fitted_order(&points).unwrap();
        let expected = 4.302_65 * (0.3_f64 / 2.0 / 5.0).sqrt();
        assert!(
            (fit.order - 1.3).abs() < 1e-12 && (fit.half_width - expected).abs() < 1e-4,
            "{fit:?}"
        );
    }

    #[test]
    fn errors_within_the_tolerance_of_the_truth_are_not_fitted() {
        let series = |shape: &str, errors: [f64; 4]| -> Vec<ConvergenceRecord> {
            (0..4).map(|level| record(shape, AxisSet::Poles, level, errors[level])).collect()
        };
        let falls = series("falls", [0.08, 0.02, 0.005, 1.5e-4]);
        let exact = series("exact", [1e-4, 1e-15, 0.0, 0.0]);
        let report = convergence_report(&[falls, exact].concat(), "by hand").unwrap();
        let of = |shape: &str| {
            let is =
                |fit: &&ConvergenceFit| fit.shape == shape && fit.measure == Measure::ToAxisMax;
            report.fits.iter().find(is).unwrap()
        };
        let order = of("falls").order.unwrap();
        assert!((order.order - 2.0).abs() < 1e-9 && order.points == 3, "{order:?}");
        assert!(of("exact").exact && of("exact").order.is_none());
        assert!(report.markdown.contains("| exact | 100 to 6400 | exact |"), "{}", report.markdown);
        assert!(
            report.markdown.contains("| falls | 100 to 6400 | 0.015; 2.0 ± 0.0 |"),
            "{}",
            report.markdown
        );
        assert_eq!(String::from_utf8(report.csv).unwrap().lines().count(), 9);
        assert_eq!(report.plots.len(), 1);
        assert!(report.plots[0].1.starts_with("<svg"));
    }
}
