//! How time and memory grow with the input: one power law for each method, from its own records
//! alone.

use crate::answers::usual_level;
use crate::comparison::{Comparison, Entry};
use crate::plots::{Curve, Figure, Point, Scale};
use crate::record::Record;
use crate::tables::{Cell, Column, Row, Table};
use crate::text::{counted, grouped, significant};

/// A fit needs results on so many meshes.
const LEAST_MESHES: usize = 4;

/// And sizes that span such a factor: over less, noise decides the exponent.
const LEAST_SPAN: f64 = 3.0;

/// Size that the factor of a fit is told at, in spheres of the initial medial mesh.
const REFERENCE_SIZE: f64 = 10_000.0;

/// What one level costs each method, against the size of its input.
pub(crate) struct Scaling {
    /// The number of spheres that was asked.
    pub(crate) spheres: usize,
    /// One for each series that reached it on any mesh.
    pub(crate) rows: Vec<Growth>,
}

/// The costs of one series.
pub(crate) struct Growth {
    pub(crate) series: usize,
    /// Meshes that it was asked for.
    pub(crate) asked: usize,
    /// CPU seconds, shared substrates included, against the spheres of the initial medial mesh;
    /// one point for each mesh, from small to large.
    pub(crate) seconds: Vec<(f64, f64)>,
    /// The same of peak memory, in MB of a million bytes.
    pub(crate) megabytes: Vec<(f64, f64)>,
}

/// y = `factor` (x / 10,000)^`exponent`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PowerLaw {
    pub(crate) exponent: f64,
    /// Standard error of the exponent.
    pub(crate) error: f64,
    /// The value at 10,000.
    pub(crate) factor: f64,
}

impl PowerLaw {
    /// The value at a size.
    pub(crate) fn at(&self, size: f64) -> f64 {
        self.factor * (size / REFERENCE_SIZE).powf(self.exponent)
    }
}

/// The costs at the number of spheres that is nearest to 100; `None` without two meshes of one
/// method.
pub(crate) fn scaling(comparison: &Comparison<'_>) -> Option<Scaling> {
    let (level, spheres) = usual_level(comparison)?;
    let mut rows: Vec<Growth> = (0..comparison.series.len())
        .map(|series| growth(series, &comparison.at(series, level)))
        .collect();
    rows.retain(|row| !row.seconds.is_empty() || !row.megabytes.is_empty());
    let most = rows.iter().map(|row| row.seconds.len().max(row.megabytes.len())).max()?;
    (most >= 2).then_some(Scaling { spheres, rows })
}

fn growth(series: usize, entries: &[&Entry<'_>]) -> Growth {
    let costs: [fn(&Record) -> Option<f64>; 2] = [
        |record| Some(record.simplify.cpu_seconds?.total),
        |record| Some(record.simplify.peak_bytes? as f64 / 1e6),
    ];
    let [seconds, megabytes] = costs.map(|cost| {
        let mut points: Vec<(f64, f64)> = (entries.iter().filter(|entry| entry.comparable()))
            .filter_map(|entry| Some((entry.record.initial?.spheres as f64, cost(entry.record)?)))
            // Both are drawn and fitted as logarithms.
            .filter(|&(size, cost)| size > 0.0 && cost > 0.0 && cost.is_finite())
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        points
    });
    Growth { series, asked: entries.len(), seconds, megabytes }
}

/// The least-squares line through the logarithms of both coordinates, all of which are positive.
///
/// # Errors
/// Why there is none: too few points, or sizes that are too alike.
pub(crate) fn power_law(points: &[(f64, f64)]) -> Result<PowerLaw, String> {
    if points.len() < LEAST_MESHES {
        return Err("too few meshes".to_owned());
    }
    let sizes = || points.iter().map(|point| point.0);
    let span = sizes().fold(0.0, f64::max) / sizes().fold(f64::INFINITY, f64::min);
    if span < LEAST_SPAN {
        return Err(format!("sizes within a factor of {}", significant(span, 2)));
    }
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> =
        points.iter().map(|(x, y)| ((x / REFERENCE_SIZE).ln(), y.ln())).collect();
    let x = logs.iter().map(|log| log.0).sum::<f64>() / n;
    let y = logs.iter().map(|log| log.1).sum::<f64>() / n;
    let spread: f64 = logs.iter().map(|log| (log.0 - x).powi(2)).sum();
    let exponent = logs.iter().map(|log| (log.0 - x) * (log.1 - y)).sum::<f64>() / spread;
    let rest: f64 = logs.iter().map(|log| (log.1 - y - exponent * (log.0 - x)).powi(2)).sum();
    // Two numbers were fitted, so two degrees of freedom are gone.
    let error = (rest / (n - 2.0) / spread).sqrt();
    Ok(PowerLaw { exponent, error, factor: (y - exponent * x).exp() })
}

/// The exponents and factors of all methods.
pub(crate) fn scaling_table(comparison: &Comparison<'_>, scaling: &Scaling, how: &str) -> Table {
    let reference = grouped(REFERENCE_SIZE as u64);
    let columns = vec![
        Column::text("method"),
        Column::text("meshes"),
        Column::text("initial spheres"),
        Column::text("CPU time: exponent"),
        Column::number(format!("CPU s at {reference}")),
        Column::number("n"),
        Column::text("memory: exponent"),
        Column::number(format!("MB at {reference}")),
        Column::number("n"),
    ];
    let spheres = counted(scaling.spheres, "sphere", "spheres");
    Table {
        caption: format!("Time and memory against input size, to {spheres}"),
        notes: vec![
            how.to_owned(),
            format!(
                "Least squares of log y = a + p log x over a method's own meshes on which it \
                 reached the number of spheres, n of them: x the spheres of the initial medial \
                 mesh, y the CPU seconds of all stages, shared substrates included, or the peak \
                 of memory. The exponent p stands with its standard error; the factor is told as \
                 the value at x = {reference}, which may lie outside a method's sizes. No number \
                 without {LEAST_MESHES} meshes whose sizes span a factor of {LEAST_SPAN}. The \
                 meshes differ in shape too, so p describes these meshes."
            ),
        ],
        columns,
        rows: scaling.rows.iter().map(|growth| row(comparison, growth)).collect(),
    }
}

fn row(comparison: &Comparison<'_>, growth: &Growth) -> Row {
    // Every row has points of at least one cost.
    let points = if growth.seconds.is_empty() { &growth.megabytes } else { &growth.seconds };
    let sizes = points
        .first()
        .zip(points.last())
        .map(|(first, last)| format!("{} to {}", grouped(first.0 as u64), grouped(last.0 as u64)));
    let mut cells = vec![
        Cell::new(comparison.series[growth.series].as_str()),
        Cell::share((points.len(), growth.asked)),
        Cell::optional(sizes),
    ];
    for points in [&growth.seconds, &growth.megabytes] {
        let (exponent, factor) = match power_law(points) {
            Ok(law) => {
                let exponent = format!("{:.2} ± {:.2}", law.exponent, law.error);
                (Cell::new(exponent), Some(significant(law.factor, 2)))
            }
            Err(why) => (Cell::new(why), None),
        };
        cells.extend([exponent, Cell::optional(factor), Cell::new(points.len().to_string())]);
    }
    Row { cells, starts_group: false }
}

/// Costs against sizes: one point for each mesh and method, with the line of its power law where there is one.
pub(crate) fn scaling_figures(comparison: &Comparison<'_>, scaling: &Scaling) -> Vec<Figure> {
    type Cost = fn(&Growth) -> &Vec<(f64, f64)>;
    let kinds: [(&str, &str, &str, Cost); 2] = [
        ("overview-scaling", "CPU time", "CPU time (s)", |growth| &growth.seconds),
        ("overview-scaling-memory", "Peak memory", "peak memory (MB)", |growth| &growth.megabytes),
    ];
    let to = counted(scaling.spheres, "sphere", "spheres");
    let mut figures = vec![];
    for (stem, what, axis, cost) in kinds {
        let curve = |growth: &Growth| {
            let points = cost(growth);
            let name = comparison.series[growth.series].clone();
            let law = power_law(points).ok();
            let exponent = law.map_or(String::new(), |law| format!(" x^{:.2}", law.exponent));
            let ends = points.first().zip(points.last());
            let line = law.zip(ends).map(|(law, (first, last))| {
                [first.0, last.0].map(|size| (size, law.at(size))).to_vec()
            });
            let spheres = Some(scaling.spheres as f64);
            Curve {
                series: growth.series,
                label: format!("{name}{exponent}, n={}", points.len()),
                name,
                of: "one mesh".to_owned(),
                points: points.iter().map(|&(x, y)| Point { spheres, ..Point::at(x, y) }).collect(),
                // Points alone where no law holds.
                line: Some(line.unwrap_or_default()),
                dashed: false,
            }
        };
        let figure = Figure {
            stem: stem.to_owned(),
            title: format!("{what} against input size, to {to}; one point a mesh"),
            x: ("spheres of the initial medial mesh".to_owned(), Scale::Log),
            y: (axis.to_owned(), Scale::Log),
            curves: scaling.rows.iter().map(curve).collect(),
            front: false,
            leading: false,
        };
        figures.extend(figure.with_points());
    }
    figures
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_found_as_it_is() {
        let points: Vec<(f64, f64)> =
            [1e3, 2e3, 5e3, 4e4].map(|x: f64| (x, 0.25 * (x / 1e4).powf(1.3))).to_vec();
        let law = power_law(&points).unwrap();
        assert!((law.exponent - 1.3).abs() < 1e-12 && law.error < 1e-9, "{law:?}");
        assert!((law.factor - 0.25).abs() < 1e-12 && (law.at(4e4) - points[3].1).abs() < 1e-9);
    }

    #[test]
    fn the_standard_error_is_that_of_the_textbook() {
        // ln x = 0, 1, 2, 3 and ln y = 0, 1, 2, 4: slope 1.3, sum of squares 0.3, spread 5.
        let points = [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 4.0)];
        let points: Vec<(f64, f64)> =
            points.iter().map(|&(x, y): &(f64, f64)| (x.exp(), y.exp())).collect();
        let law = power_law(&points).unwrap();
        assert!((law.exponent - 1.3).abs() < 1e-12, "{law:?}");
        assert!((law.error - (0.3_f64 / 2.0 / 5.0).sqrt()).abs() < 1e-12, "{law:?}");
    }

    #[test]
    fn too_little_gives_no_number() {
        let of = |sizes: &[f64]| power_law(&sizes.iter().map(|&x| (x, x)).collect::<Vec<_>>());
        assert_eq!(of(&[1.0, 10.0, 100.0]).unwrap_err(), "too few meshes");
        assert_eq!(of(&[1.0, 1.0, 2.0, 2.5]).unwrap_err(), "sizes within a factor of 2.5");
        assert!(of(&[1.0, 1.0, 2.0, 3.0]).is_ok());
    }
}
