//! Means over meshes, made so that no method gains by failing.
//!
//! At one number of spheres, methods are averaged over the meshes that all of them have in
//! common. A method that reached the count on less than half of the meshes would leave the others
//! nothing to be averaged over: it is averaged over its own meshes and marked as not compared.

use std::collections::BTreeSet;

use crate::comparison::{Comparison, Entry};
use crate::metric::{COMPARED, HAUSDORFF, Metric};
use crate::record::Status;

/// Error bounds, in % of the diagonal, for which the fewest spheres are told.
pub(crate) const ERROR_BOUNDS: [f64; 3] = [2.0, 1.0, 0.5];

/// All methods at one number of spheres.
pub(crate) struct CountSummary {
    /// The number of spheres that was asked.
    pub(crate) count: usize,
    /// Number of meshes that the compared methods have in common.
    pub(crate) common: usize,
    /// One row for each series that was asked for this count.
    pub(crate) rows: Vec<SeriesSummary>,
}

/// One method at one number of spheres.
pub(crate) struct SeriesSummary {
    pub(crate) series: usize,
    /// Whether the means are over the common meshes; otherwise over the method's own.
    pub(crate) compared: bool,
    /// Meshes that the method was asked for.
    pub(crate) asked: usize,
    /// Meshes on which it reached the count.
    pub(crate) reached: usize,
    /// Meshes on which a result came out with another number of spheres.
    pub(crate) missed: usize,
    /// Meshes on which it failed.
    pub(crate) failed: usize,
    /// Meshes for which it does not do this.
    pub(crate) unsupported: usize,
    /// Means of [`COMPARED`], in that order.
    pub(crate) means: [Option<f64>; COMPARED.len()],
    /// Arithmetic means of substrate, prepare and simplify seconds.
    pub(crate) stages: Option<[f64; 3]>,
    /// Results with the Betti numbers of the solid, of those where both are known.
    pub(crate) topology: (usize, usize),
}

impl SeriesSummary {
    /// The mean of one of [`COMPARED`].
    pub(crate) fn mean(&self, metric: &Metric) -> Option<f64> {
        let index = COMPARED.iter().position(|other| other.key == metric.key)?;
        self.means[index]
    }
}

/// Summaries for every number of spheres that was asked, from many to few.
pub(crate) fn by_count(comparison: &Comparison<'_>) -> Vec<CountSummary> {
    comparison.counts().map(|(level, count)| at_count(comparison, level, count)).collect()
}

fn at_count(comparison: &Comparison<'_>, level: usize, count: usize) -> CountSummary {
    let of_series = |series: usize| -> Vec<&Entry<'_>> {
        let here = |entry: &&Entry<'_>| entry.level == level && entry.series == series;
        comparison.entries.iter().filter(here).collect()
    };
    let all: Vec<(usize, Vec<&Entry<'_>>)> = (0..comparison.series.len())
        .map(|series| (series, of_series(series)))
        .filter(|(_, entries)| !entries.is_empty())
        .collect();
    let meshes: BTreeSet<usize> =
        all.iter().flat_map(|(_, entries)| entries.iter().map(|entry| entry.mesh)).collect();
    let reached_on = |entries: &[&Entry<'_>]| -> BTreeSet<usize> {
        entries.iter().filter(|entry| entry.comparable()).map(|entry| entry.mesh).collect()
    };
    let takes_part = |entries: &[&Entry<'_>]| {
        let reached = reached_on(entries).len();
        reached > 0 && 2 * reached >= meshes.len()
    };
    let common = all
        .iter()
        .filter(|(_, entries)| takes_part(entries))
        .map(|(_, entries)| reached_on(entries))
        .reduce(|a, b| &a & &b)
        .unwrap_or_default();
    let rows = all
        .iter()
        .map(|(series, entries)| {
            let compared = takes_part(entries) && !common.is_empty();
            let kept: Vec<&Entry<'_>> = entries
                .iter()
                .copied()
                .filter(|entry| entry.comparable() && (!compared || common.contains(&entry.mesh)))
                .collect();
            summarise(*series, compared, entries, &kept)
        })
        .collect();
    CountSummary { count, common: common.len(), rows }
}

/// The row of one series from all its entries and those that are averaged.
fn summarise(
    series: usize,
    compared: bool,
    entries: &[&Entry<'_>],
    kept: &[&Entry<'_>],
) -> SeriesSummary {
    let number = |of: &dyn Fn(&Entry<'_>) -> bool| entries.iter().filter(|entry| of(entry)).count();
    let reached = number(&|entry| entry.comparable());
    let failed = number(&|entry| entry.record.status.is_failure());
    let unsupported = number(&|entry| entry.record.status == Status::Unsupported);
    SeriesSummary {
        series,
        compared,
        asked: entries.len(),
        reached,
        missed: entries.len() - reached - failed - unsupported,
        failed,
        unsupported,
        means: COMPARED.map(|metric| {
            let values: Vec<f64> =
                kept.iter().filter_map(|entry| metric.of(entry.record)).collect();
            // A mean over fewer meshes than the others' would not compare.
            if values.len() == kept.len() { metric.mean.of(&values) } else { None }
        }),
        stages: mean_stages(kept),
        topology: topology(kept),
    }
}

/// Arithmetic means of the stages, which add up as stages must.
fn mean_stages(entries: &[&Entry<'_>]) -> Option<[f64; 3]> {
    let stages: Vec<_> = entries.iter().filter_map(|entry| entry.record.simplify.seconds).collect();
    if stages.is_empty() {
        return None;
    }
    let mean = |of: fn(&crate::record::Stages) -> f64| {
        stages.iter().map(of).sum::<f64>() / stages.len() as f64
    };
    Some([mean(|s| s.substrate), mean(|s| s.prepare), mean(|s| s.simplify)])
}

/// Results with the solid's Betti numbers, and results where both are known.
fn topology(entries: &[&Entry<'_>]) -> (usize, usize) {
    let known = entries.iter().filter_map(|entry| {
        let evaluation = entry.record.evaluate.as_ref()?;
        Some(evaluation.betti == evaluation.expected_betti?)
    });
    known.fold((0, 0), |(right, all), same| (right + usize::from(same), all + 1))
}

/// The series with the best mean among those compared, where at least two are.
pub(crate) fn best(summary: &CountSummary, metric: &Metric) -> Option<f64> {
    let means: Vec<f64> =
        summary.rows.iter().filter(|row| row.compared).filter_map(|row| row.mean(metric)).collect();
    (means.len() > 1).then(|| means.into_iter().reduce(|a, b| pick(metric, a, b))).flatten()
}

/// The better of two values.
pub(crate) fn pick(metric: &Metric, a: f64, b: f64) -> f64 {
    if metric.better.prefers(b, a) { b } else { a }
}

/// The area under a series' curve of Hausdorff error against spheres, both as logarithms, over the
/// whole range of counts, told as the error of the level line with the same area: in % of the diagonal.
/// `None` where the series was not compared at some count, or there is only one.
pub(crate) fn curve_level(summaries: &[CountSummary], series: usize) -> Option<f64> {
    let point = |summary: &CountSummary| {
        let row = summary.rows.iter().find(|row| row.series == series && row.compared)?;
        Some(((summary.count as f64).ln(), row.mean(&HAUSDORFF)?.max(1e-6).ln()))
    };
    let points: Vec<(f64, f64)> = summaries.iter().map(point).collect::<Option<_>>()?;
    let width = points.first()?.0 - points.last()?.0;
    let trapezium = |pair: &[(f64, f64)]| (pair[0].0 - pair[1].0) * (pair[0].1 + pair[1].1) / 2.0;
    let area: f64 = points.windows(2).map(trapezium).sum();
    (width > 0.0).then(|| (area / width).exp())
}

/// The fewest spheres at which a series stayed within an error bound.
pub(crate) struct Fewest {
    /// Median over the meshes, where a mesh that never got there counts as infinitely many.
    /// `None` where the median mesh never got there.
    pub(crate) median: Option<usize>,
    /// Meshes that got there.
    pub(crate) meshes: usize,
    /// Meshes that the series was asked for.
    pub(crate) of: usize,
}

/// The fewest spheres of a series for a Hausdorff error of at most `bound` % of the diagonal,
/// among the levels that were run.
pub(crate) fn fewest_spheres(comparison: &Comparison<'_>, series: usize, bound: f64) -> Fewest {
    let mut fewest: Vec<Option<usize>> = Vec::new();
    for mesh in 0..comparison.meshes.len() {
        let entries: Vec<_> =
            comparison.of_mesh(mesh).filter(|entry| entry.series == series).collect();
        if entries.is_empty() {
            continue;
        }
        let within = entries.iter().filter(|entry| {
            entry.measured() && HAUSDORFF.of(entry.record).is_some_and(|error| error <= bound)
        });
        fewest.push(within.filter_map(|entry| crate::comparison::reached(entry.record)).min());
    }
    fewest.sort_by_key(|count| count.unwrap_or(usize::MAX));
    let middle = fewest.len().saturating_sub(1) / 2;
    Fewest {
        // The upper median: at least half of the meshes are within.
        median: fewest.get(fewest.len() / 2).or_else(|| fewest.get(middle)).copied().flatten(),
        meshes: fewest.iter().flatten().count(),
        of: fewest.len(),
    }
}

/// One sentence for each number of spheres: who has the lowest error, by how much, at what time.
pub(crate) fn headlines(comparison: &Comparison<'_>, summaries: &[CountSummary]) -> Vec<String> {
    summaries.iter().filter_map(|summary| headline(comparison, summary)).collect()
}

fn headline(comparison: &Comparison<'_>, summary: &CountSummary) -> Option<String> {
    let mut ranked: Vec<(f64, &SeriesSummary)> = summary
        .rows
        .iter()
        .filter(|row| row.compared)
        .filter_map(|row| Some((row.mean(&HAUSDORFF)?, row)))
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.series.cmp(&b.1.series)));
    let &(error, row) = ranked.first()?;
    let name = |row: &SeriesSummary| comparison.series[row.series].as_str();
    let spheres = crate::text::counted(summary.count, "sphere", "spheres");
    let meshes = crate::text::counted(summary.common, "mesh", "meshes");
    let mut text = format!(
        "{spheres}: {} has a Hausdorff error of {} % of the diagonal over {meshes}",
        name(row),
        HAUSDORFF.format_mean(error)
    );
    if let Some(seconds) = row.mean(&crate::metric::TOTAL_SECONDS) {
        text.push_str(&format!(" in {} s", crate::text::significant(seconds, 3)));
    }
    match ranked.get(1) {
        Some(&(next, other)) => text.push_str(&format!(
            ", the lowest; then {} with {} % ({} times)",
            name(other),
            HAUSDORFF.format_mean(next),
            crate::text::significant(next / error, 3)
        )),
        None => text.push_str("; nothing to compare it with"),
    }
    text.push('.');
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One series whose mean Hausdorff error is known at some counts.
    fn curve(errors: &[(usize, Option<f64>)]) -> Vec<CountSummary> {
        let summary = |&(count, error): &(usize, Option<f64>)| CountSummary {
            count,
            common: 1,
            rows: vec![SeriesSummary {
                series: 0,
                compared: error.is_some(),
                asked: 1,
                reached: 1,
                missed: 0,
                failed: 0,
                unsupported: 0,
                means: COMPARED
                    .map(|metric| if metric.key == HAUSDORFF.key { error } else { None }),
                stages: None,
                topology: (0, 0),
            }],
        };
        errors.iter().map(summary).collect()
    }

    #[test]
    fn the_level_of_a_curve_is_that_of_the_same_area() {
        let level = |errors: &[(usize, Option<f64>)]| curve_level(&curve(errors), 0);
        let close =
            |a: Option<f64>, b: f64| assert!((a.unwrap() / b - 1.0).abs() < 1e-12, "{a:?} {b}");
        let constant = [1000, 500, 100].map(|count| (count, Some(0.7)));
        close(level(&constant), 0.7);
        // A power law is a straight line: the geometric mean of its ends, whatever lies between.
        let power = |count: usize| (count, Some(40.0 * (count as f64).powf(-0.8)));
        let ends = (power(1000).1.unwrap() * power(50).1.unwrap()).sqrt();
        close(level(&[1000, 50].map(power)), ends);
        close(level(&[1000, 700, 90, 50].map(power)), ends);
        // A rise over the last third: half of its logarithm there.
        let steps = [(800, Some(1.0)), (400, Some(1.0)), (200, Some(1.0)), (100, Some(16.0))];
        close(level(&steps), 16_f64.powf(0.5 / 3.0));
        assert_eq!(level(&[(1000, Some(1.0)), (500, None), (100, Some(2.0))]), None);
        assert_eq!(level(&[(1000, Some(1.0))]), None);
        assert_eq!(level(&[]), None);
    }
}
