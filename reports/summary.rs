//! Means over meshes that no other method changes.
//!
//! 1. Each method has one *set* of meshes for all its means: those on which it reached every count that counts for
//!    it, so that a curve over counts never changes meshes on its way. Counts reached on the fewest meshes are
//!    dropped until the set covers at least half of the requested meshes. A dropped count has no mean, but the table
//!    still shows how often it was reached.
//! 2. Methods are ranked by ratios to one reference method, mesh by mesh, over the meshes that both reached. A mesh
//!    that a method misses changes that method's values alone.
//!
//! Which other methods ran decides no number here but where the reference itself is missing.

use std::collections::{BTreeMap, BTreeSet};

use medial_run::level::Target;
use medial_run::record::{Record, Status};
use medial_run::text::{counted, grouped, significant, trimmed};

use crate::comparison::{Comparison, Entry, level_label, reached};
use crate::header::Header;
use crate::metric::{
    COMPLETENESS, GEOMETRIC, HAUSDORFF, LARGER_SIDE, MEAN_ERROR, Metric, TOTAL_SECONDS,
};
use crate::statistics::{Ratio, interval};
use crate::tables::{Cell, Table};

/// The method that others are put in relation to, where it ran with its defaults.
const REFERENCE: &str = "qmat";

/// All methods at one number of spheres.
pub(crate) struct CountSummary {
    /// The requested number of spheres.
    pub(crate) count: usize,
    /// Number of meshes that any method ran on.
    pub(crate) meshes: usize,
    /// One row for each series that ran at this count.
    pub(crate) rows: Vec<SeriesSummary>,
}

/// One method at one number of spheres.
pub(crate) struct SeriesSummary {
    pub(crate) series: usize,
    /// Meshes that the means are over: the method's own set; 0 where this count has no mean.
    pub(crate) over: usize,
    /// Meshes that the method ran on.
    pub(crate) requested: usize,
    /// Meshes without such a result, by status.
    pub(crate) without: BTreeMap<Status, usize>,
    /// Means of the columns by their keys, the number of meshes that each is over, and for errors the 95 % interval.
    means: BTreeMap<&'static str, (f64, usize, Option<[f64; 2]>)>,
    /// Hausdorff error in relation to the reference's.
    pub(crate) ratio: Option<Ratio>,
    /// Results with the Betti numbers of the solid, of those where both are known; over all meshes
    /// on which it reached the count.
    pub(crate) topology: (usize, usize),
}

impl SeriesSummary {
    /// The mean of one of [`COMPARED`](crate::metric::COMPARED).
    pub(crate) fn mean(&self, metric: &Metric) -> Option<f64> {
        self.means.get(metric.key).map(|(mean, ..)| *mean)
    }

    /// The 95 % interval of the mean of an error.
    pub(crate) fn interval(&self, metric: &Metric) -> Option<[f64; 2]> {
        self.means.get(metric.key)?.2
    }

    /// Meshes that the mean of a metric is over: a result without a triangle, for example, has no angle.
    pub(crate) fn over(&self, metric: &Metric) -> usize {
        self.means.get(metric.key).map_or(0, |(_, over, _)| *over)
    }
}

impl CountSummary {
    /// Whether a row's mean of a metric is over all meshes, and so compares with others of that kind.
    pub(crate) fn is_whole_of(&self, row: &SeriesSummary, metric: &Metric) -> bool {
        row.over(metric) == self.meshes && self.meshes > 0
    }
}

/// The series that others are put in relation to: Q-MAT as it is by default, or else the first
/// series that reached a count.
pub(crate) fn reference(comparison: &Comparison<'_>) -> Option<usize> {
    // Every series has an entry: its label comes from a record. That of an edition has its name in parentheses.
    let plain = comparison.series.iter().position(|label| label == REFERENCE);
    let frozen =
        || comparison.series.iter().position(|label| label.split(" (").next() == Some(REFERENCE));
    plain.or_else(frozen).or_else(|| {
        comparison.entries.iter().filter(|e| e.comparable()).map(|entry| entry.series).min()
    })
}

/// Summaries for every requested number of spheres, from many to few.
pub(crate) fn by_count(comparison: &Comparison<'_>) -> Vec<CountSummary> {
    let counts: BTreeSet<usize> = comparison.counts().map(|(level, _)| level).collect();
    let mut sets = vec![];
    for series in 0..comparison.series.len() {
        let own = comparison.entries.iter().filter(|entry| entry.series == series);
        let own = own.filter(|entry| counts.contains(&entry.level));
        sets.push(OwnSet::of(own.map(|entry| (entry.level, entry.mesh, entry.comparable()))));
    }
    let reference = reference(comparison);
    let counts = comparison.counts();
    counts.map(|(level, count)| at_count(comparison, &sets, reference, (level, count))).collect()
}

/// The levels that have means for a method, and the meshes that these are over.
pub(crate) struct OwnSet {
    pub(crate) levels: BTreeSet<usize>,
    pub(crate) meshes: BTreeSet<usize>,
    /// Meshes that the method ran on.
    pub(crate) requested: usize,
}

impl OwnSet {
    /// From each requested level and mesh, and whether the result there counts.
    pub(crate) fn of(entries: impl Iterator<Item = (usize, usize, bool)>) -> Self {
        let mut requested = BTreeSet::new(); // failures included
        let mut reached: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        for (level, mesh, counts) in entries {
            requested.insert(mesh);
            reached.entry(level).or_default().extend(counts.then_some(mesh));
        }
        let requested = requested.len();
        loop {
            let meshes = reached.values().cloned().reduce(|a, b| &a & &b).unwrap_or_default();
            // Levels are from many spheres to few: of two as rare, the finer one goes.
            let rarest = reached.iter().min_by_key(|(level, meshes)| (meshes.len(), **level));
            match rarest.map(|(&level, _)| level) {
                Some(rarest) if 2 * meshes.len() < requested || meshes.is_empty() => {
                    reached.remove(&rarest); // each round drops one, so the loop ends
                }
                _ => return Self { levels: reached.into_keys().collect(), meshes, requested },
            }
        }
    }

    /// The meshes of the set on which a metric is known at each level that has means: so that the curve of a
    /// metric does not change its meshes either.
    fn known(
        &self,
        comparison: &Comparison<'_>,
        series: usize,
        metric: &Metric,
    ) -> BTreeSet<usize> {
        let mut known = self.meshes.clone();
        for entry in &comparison.entries {
            let is_own = entry.series == series && self.levels.contains(&entry.level);
            if is_own && metric.of(entry.record).is_none() {
                known.remove(&entry.mesh); // at one level unknown, at all levels left out
            }
        }
        known
    }
}

fn at_count(
    comparison: &Comparison<'_>,
    sets: &[OwnSet],
    reference: Option<usize>,
    (level, count): (usize, usize),
) -> CountSummary {
    let yardstick = reference.map_or(vec![], |series| comparison.at(series, level));
    let mut meshes = BTreeSet::new();
    let mut rows = vec![];
    for (series, set) in sets.iter().enumerate() {
        let entries = comparison.at(series, level);
        if entries.is_empty() {
            continue; // this method was not requested at this count
        }
        meshes.extend(entries.iter().map(|entry| entry.mesh)); // of any method
        // A count that has no mean leaves no entry.
        let mut averaged = entries.clone();
        averaged.retain(|entry| {
            set.levels.contains(&level) && entry.comparable() && set.meshes.contains(&entry.mesh)
        });
        let mut means = BTreeMap::new();
        // Two more for plots.
        for metric in comparison.columns().into_iter().chain([&COMPLETENESS, &LARGER_SIDE]) {
            let known = set.known(comparison, series, metric);
            let values = averaged.iter().filter(|entry| known.contains(&entry.mesh));
            let values: Vec<f64> = values.filter_map(|entry| metric.of(entry.record)).collect();
            // A mean over less than half of the meshes would not represent the requested ones.
            let enough = 2 * values.len() >= entries.len();
            let mean = metric.mean.of(&values).filter(|_| enough);
            let is_error = [HAUSDORFF.key, MEAN_ERROR.key].contains(&metric.key);
            let ends = interval(&values).filter(|_| is_error);
            means.extend(mean.map(|mean| (metric.key, (mean, values.len(), ends))));
        }
        let mut reached = entries.clone();
        reached.retain(|entry| entry.comparable()); // of all meshes, not of the own set
        let mut without = BTreeMap::new();
        for entry in entries.iter().filter(|entry| !entry.comparable()) {
            let status = entry.record.status;
            let status = if status.is_ok() { Status::OtherCount } else { status };
            *without.entry(status).or_default() += 1;
        }
        rows.push(SeriesSummary {
            series,
            over: averaged.len(),
            requested: entries.len(),
            without,
            means,
            ratio: ratio(&entries, &yardstick),
            topology: topology(&reached),
        });
    }
    CountSummary { count, meshes: meshes.len(), rows }
}

/// Hausdorff errors in relation to those of the reference, on the meshes where both reached a count.
fn ratio(entries: &[&Entry<'_>], reference: &[&Entry<'_>]) -> Option<Ratio> {
    let logs = entries.iter().filter_map(|entry| {
        let other = reference.iter().find(|other| other.mesh == entry.mesh)?;
        let [own, others] = [entry, other]
            .map(|e| HAUSDORFF.of(e.record).filter(|&error| e.comparable() && error > 0.0));
        Some((own? / others?).ln())
    });
    Ratio::of_logs(&logs.collect::<Vec<_>>())
}

/// Results with the solid's Betti numbers, and results where both are known.
pub(crate) fn topology(entries: &[&Entry<'_>]) -> (usize, usize) {
    let known =
        entries.iter().filter_map(|entry| entry.record.evaluate.as_ref()?.has_right_topology());
    known.fold((0, 0), |(right, all), same| (right + usize::from(same), all + 1))
}

/// The best mean among those over all meshes, where there are at least two.
pub(crate) fn best(summary: &CountSummary, metric: &Metric) -> Option<f64> {
    let whole = summary.rows.iter().filter(|row| summary.is_whole_of(row, metric));
    let means: Vec<f64> = whole.filter_map(|row| row.mean(metric)).collect();
    (means.len() > 1).then(|| means.into_iter().reduce(|a, b| pick(metric, a, b))).flatten()
}

/// The better of two values.
pub(crate) fn pick(metric: &Metric, a: f64, b: f64) -> f64 {
    if metric.better.prefers(b, a) { b } else { a }
}

/// One method at native levels.
pub(crate) struct NativeCurve {
    pub(crate) series: usize,
    /// Meshes that all means are over.
    pub(crate) over: usize,
    /// Meshes that the method ran on at such levels.
    pub(crate) requested: usize,
    /// From fine to coarse.
    pub(crate) points: Vec<NativePoint>,
}

/// Means at one level.
pub(crate) struct NativePoint {
    pub(crate) level: Target,
    /// Geometric means: spheres, errors in % of the diagonal, seconds.
    pub(crate) spheres: f64,
    pub(crate) hausdorff: f64,
    pub(crate) mean: f64,
    /// Unknown for an edition, and where items disturbed each other.
    pub(crate) seconds: Option<f64>,
    /// Results with the solid's Betti numbers, of those where both are known.
    pub(crate) topology: (usize, usize),
}

/// The curves of all series that ran at native levels, the published one included.
pub(crate) fn native_curves(comparison: &Comparison<'_>) -> Vec<NativeCurve> {
    (0..comparison.series.len()).filter_map(|series| native_curve(comparison, series)).collect()
}

fn native_curve(comparison: &Comparison<'_>, series: usize) -> Option<NativeCurve> {
    let mut own: Vec<&Entry<'_>> =
        comparison.entries.iter().filter(|entry| entry.series == series).collect();
    own.retain(|entry| comparison.levels[entry.level].is_native());
    let set = OwnSet::of(own.iter().map(|entry| (entry.level, entry.mesh, entry.measured())));
    let mut points = Vec::new();
    for &level in &set.levels {
        let mut averaged = comparison.at(series, level);
        averaged.retain(|entry| set.meshes.contains(&entry.mesh));
        points.extend(native_point(comparison.levels[level], &averaged));
    }
    points.sort_by(|a, b| b.spheres.total_cmp(&a.spheres)); // fine to coarse
    let (over, requested) = (set.meshes.len(), set.requested);
    (!points.is_empty()).then_some(NativeCurve { series, over, requested, points })
}

fn native_point(level: Target, entries: &[&Entry<'_>]) -> Option<NativePoint> {
    Some(NativePoint {
        level,
        spheres: mean_of(entries, |record| Some(reached(record)? as f64))?,
        hausdorff: mean_of(entries, |record| HAUSDORFF.of(record))?,
        mean: mean_of(entries, |record| MEAN_ERROR.of(record))?,
        seconds: mean_of(entries, |record| TOTAL_SECONDS.of(record)),
        topology: topology(entries),
    })
}

/// The geometric mean of a value that every entry must have: all means of a point are over the same meshes.
fn mean_of(entries: &[&Entry<'_>], value: fn(&Record) -> Option<f64>) -> Option<f64> {
    let values: Option<Vec<f64>> = entries.iter().map(|entry| value(entry.record)).collect();
    GEOMETRIC.of(&values?)
}

/// The table of all methods at native levels.
pub(crate) fn native_table(
    comparison: &Comparison<'_>,
    curves: &[NativeCurve],
    header: &Header,
    how: &str,
) -> Table {
    type NativePosition<'c> = (&'c NativeCurve, &'c NativePoint);
    let points: Vec<NativePosition<'_>> = curves
        .iter()
        .flat_map(|curve| curve.points.iter().map(move |point| (curve, point)))
        .collect();
    let rows = Table::of(&points)
        .text("method", |(curve, _)| comparison.series[curve.series].as_str())
        .text("level", |(curve, point)| {
            match (point.level, header.native_axis(comparison.methods[curve.series])) {
                (Target::Native(value), Some(axis)) => format!("{} {axis}", trimmed(value)),
                (level, _) => level_label(level),
            }
        })
        .text("means over", |(curve, _)| Cell::share((curve.over, curve.requested)))
        .number("spheres", |(_, point)| grouped(point.spheres.round() as u64))
        .number(HAUSDORFF.heading(), |(_, point)| significant(point.hausdorff, 3))
        .number(MEAN_ERROR.heading(), |(_, point)| significant(point.mean, 3))
        .number("total (s)", |(_, point)| point.seconds.map(|seconds| significant(seconds, 3)))
        .text("topology right", |(_, point)| Cell::share(point.topology));
    let note = "Geometric means over one set of meshes for each method: those with a result at all \
         its levels. The level is the method's own scalar, with its name and unit. Spheres are \
         those of the result; compare errors at equal numbers of them. Lengths in % of the \
         bounding-box diagonal.";
    Table {
        caption: "Every method at its native levels".to_owned(),
        notes: vec![how.to_owned(), note.to_owned()],
        grouped: true,
        ..rows.table
    }
}

/// Caption of the table of means.
pub(crate) const MEANS: &str = "Means over meshes at equal numbers of spheres";

/// The means of all methods at each number of spheres.
pub(crate) fn means_table(
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
    how: &str,
) -> Table {
    type MeanPosition<'s> = (&'s CountSummary, &'s SeriesSummary);
    let places: Vec<MeanPosition<'_>> = summaries
        .iter()
        .flat_map(|summary| summary.rows.iter().map(move |row| (summary, row)))
        .collect();
    let yardstick = reference(comparison).map_or("reference", |series| &comparison.series[series]);
    let mut rows = Table::of(&places)
        .number("spheres", |(summary, _)| grouped(summary.count as u64))
        .text("method", |(_, row)| comparison.series[row.series].as_str())
        .text("means over", |(_, row)| Cell::share((row.over, row.requested)))
        .number(format!("Hausdorff ÷ {yardstick}"), |(_, row)| row.ratio.map(|r| r.text(3)))
        .text("on", |(_, row)| row.ratio.map(|r| counted(r.meshes, "mesh", "meshes")));
    for metric in comparison.columns() {
        rows = rows.number(metric.heading(), |(summary, row)| mean_cell(summary, row, metric));
    }
    rows = rows.text("topology right", |(_, row)| Cell::share(row.topology));
    rows = rows.text("without a result", |(_, row)| match row.without.len() {
        0 => "none".to_owned(),
        _ => {
            let parts = row.without.iter().map(|(status, count)| format!("{count} {status}"));
            parts.collect::<Vec<_>>().join(", ")
        }
    });
    let notes = [
        how,
        "Geometric means of errors and total time, arithmetic means of angles, shares and \
         spikes. Each method has its own set of meshes, the same for all counts: \
         those with all counts that it reached on at least half of them. Means over \
         all meshes are comparable; in parentheses are those over fewer, with their number \
         where some of the set have no such value, as an angle without a triangle. Across \
         different sets, compare the ratio: the geometric mean of the Hausdorff errors in \
         relation to those of the named method, on the meshes where both reached the count, with \
         its 95 % interval over at least six meshes.",
        "Lengths in % of the bounding-box diagonal; wall-clock seconds. Arrows point in the better \
         direction. Bold: best of the means over all meshes.",
    ];
    Table {
        caption: MEANS.to_owned(),
        notes: (notes.into_iter().map(str::to_owned))
            .chain(comparison.seeds_note())
            .chain(comparison.edition_note())
            .collect(),
        grouped: true,
        ..rows.table
    }
}

/// A mean, in parentheses where it is not over all meshes.
fn mean_cell(summary: &CountSummary, row: &SeriesSummary, metric: &Metric) -> Cell {
    let Some(mean) = row.mean(metric) else { return Cell::from(None) };
    let (text, over) = (metric.format_mean(mean), row.over(metric));
    let is_whole = summary.is_whole_of(row, metric);
    // Two means that read the same are equally good.
    let best =
        is_whole && best(summary, metric).is_some_and(|best| metric.format_mean(best) == text);
    let text = match is_whole {
        true => text,
        false if over == row.over => format!("({text})"),
        false => format!("({text}; {over})"),
    };
    Cell { text, best }
}
