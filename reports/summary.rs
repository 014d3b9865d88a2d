//! Means over meshes that no other method changes.
//!
//! 1. Each method has one *set* of meshes for all its means: those on which it reached every count
//!    that counts for it, so that a curve over counts never changes meshes on its way. Counts that
//!    it reached on few meshes do not count for it, the rarest first, until the set holds at least
//!    half of the meshes it was asked for. A count left out so has no mean; how often it was
//!    reached is said.
//! 2. Methods are ranked by ratios to one reference method, mesh by mesh, over the meshes that both
//!    reached. A mesh that a method misses costs that method its point, and nobody else.
//!
//! Which other methods ran decides no number here but where the reference itself is missing.

use std::collections::{BTreeMap, BTreeSet};

use crate::comparison::{Comparison, Entry};
use crate::metric::{COMPARED, HAUSDORFF, Mean, Metric};
use crate::record::Status;

/// Error bounds, in % of the diagonal, for which the fewest spheres are told.
pub(crate) const ERROR_BOUNDS: [f64; 4] = [2.0, 1.0, 0.5, 0.2];

/// The method that others are put in relation to, where it ran with its defaults.
const REFERENCE: &str = "qmat";

/// All methods at one number of spheres.
pub(crate) struct CountSummary {
    /// The number of spheres that was asked.
    pub(crate) count: usize,
    /// Number of meshes that any method was asked for.
    pub(crate) meshes: usize,
    /// One row for each series that was asked for this count.
    pub(crate) rows: Vec<SeriesSummary>,
}

/// One method at one number of spheres.
pub(crate) struct SeriesSummary {
    pub(crate) series: usize,
    /// Meshes that the means are over: the method's own set; 0 where this count has no mean.
    pub(crate) over: usize,
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
    /// Means of [`COMPARED`], in that order, and the number of meshes that each is over.
    pub(crate) means: [Option<(f64, usize)>; COMPARED.len()],
    /// Hausdorff error in relation to the reference's.
    pub(crate) ratio: Option<Ratio>,
    /// Arithmetic means of substrate, prepare and simplify seconds.
    pub(crate) stages: Option<[f64; 3]>,
    /// Results with the Betti numbers of the solid, of those where both are known; over all meshes
    /// on which it reached the count.
    pub(crate) topology: (usize, usize),
}

/// One method in relation to the reference, over the meshes that both reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ratio {
    /// Geometric mean of the ratios.
    pub(crate) value: f64,
    /// Number of meshes.
    pub(crate) meshes: usize,
}

impl SeriesSummary {
    /// The mean of one of [`COMPARED`].
    pub(crate) fn mean(&self, metric: &Metric) -> Option<f64> {
        self.mean_over(metric).map(|(mean, _)| mean)
    }

    /// Meshes that the mean of a metric is over: where a result has no triangle, say, there is no angle.
    pub(crate) fn over(&self, metric: &Metric) -> usize {
        self.mean_over(metric).map_or(0, |(_, over)| over)
    }

    fn mean_over(&self, metric: &Metric) -> Option<(f64, usize)> {
        let index = COMPARED.iter().position(|other| other.key == metric.key)?;
        self.means[index]
    }
}

impl CountSummary {
    /// Whether a row's means are over all meshes, and so read beside others of that kind.
    pub(crate) fn is_whole(&self, row: &SeriesSummary) -> bool {
        row.over == self.meshes && row.over > 0
    }

    /// Whether a row's mean of a metric is over all meshes.
    pub(crate) fn is_whole_of(&self, row: &SeriesSummary, metric: &Metric) -> bool {
        row.over(metric) == self.meshes && self.meshes > 0
    }
}

/// The series that others are put in relation to: Q-MAT as it is by default, or else the first
/// series that reached a count.
pub(crate) fn reference(comparison: &Comparison<'_>) -> Option<usize> {
    let plain = comparison.series.iter().position(|label| label == REFERENCE);
    let first = || comparison.entries.iter().filter(|e| e.comparable()).map(|e| e.series).min();
    plain.filter(|&series| comparison.entries.iter().any(|e| e.series == series)).or_else(first)
}

/// Summaries for every number of spheres that was asked, from many to few.
pub(crate) fn by_count(comparison: &Comparison<'_>) -> Vec<CountSummary> {
    let sets: Vec<OwnSet> =
        (0..comparison.series.len()).map(|s| OwnSet::at_counts(comparison, s)).collect();
    let reference = reference(comparison);
    let counts = comparison.counts();
    counts.map(|(level, count)| at_count(comparison, &sets, reference, (level, count))).collect()
}

/// The levels that have means for a method, and the meshes that these are over.
pub(crate) struct OwnSet {
    pub(crate) levels: BTreeSet<usize>,
    pub(crate) meshes: BTreeSet<usize>,
    /// Meshes that it was asked for.
    pub(crate) asked: usize,
}

impl OwnSet {
    /// From each level and mesh that was asked, and whether the result there counts.
    pub(crate) fn of(entries: impl Iterator<Item = (usize, usize, bool)>) -> Self {
        let mut asked = BTreeSet::new();
        let mut reached: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        for (level, mesh, counts) in entries {
            asked.insert(mesh);
            reached.entry(level).or_default().extend(counts.then_some(mesh));
        }
        let asked = asked.len();
        loop {
            let meshes = reached.values().cloned().reduce(|a, b| &a & &b).unwrap_or_default();
            // Levels are from many spheres to few: of two as rare, the finer one goes.
            let rarest = reached.iter().min_by_key(|(level, meshes)| (meshes.len(), **level));
            match rarest.map(|(&level, _)| level) {
                Some(rarest) if 2 * meshes.len() < asked || meshes.is_empty() => {
                    reached.remove(&rarest);
                }
                _ => return Self { levels: reached.into_keys().collect(), meshes, asked },
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
        let own = comparison.entries.iter().filter(|entry| entry.series == series);
        let own = own.filter(|entry| self.levels.contains(&entry.level));
        let unknown: BTreeSet<usize> =
            own.filter(|entry| metric.of(entry.record).is_none()).map(|entry| entry.mesh).collect();
        &self.meshes - &unknown
    }

    /// The set of a series for its counts.
    fn at_counts(comparison: &Comparison<'_>, series: usize) -> Self {
        let counts: BTreeSet<usize> = comparison.counts().map(|(level, _)| level).collect();
        let own = comparison.entries.iter().filter(|entry| entry.series == series);
        let own = own.filter(|entry| counts.contains(&entry.level));
        Self::of(own.map(|entry| (entry.level, entry.mesh, entry.comparable())))
    }
}

fn at_count(
    comparison: &Comparison<'_>,
    sets: &[OwnSet],
    reference: Option<usize>,
    (level, count): (usize, usize),
) -> CountSummary {
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
    let yardstick = reference.map(of_series).unwrap_or_default();
    let row = |(series, entries): &(usize, Vec<&Entry<'_>>)| {
        let set = &sets[*series];
        let kept = entries.iter().copied().filter(|entry| {
            set.levels.contains(&level) && entry.comparable() && set.meshes.contains(&entry.mesh)
        });
        let known = |metric: &Metric| set.known(comparison, *series, metric);
        let mut row = summarise(*series, entries, &kept.collect::<Vec<_>>(), &known);
        row.ratio = ratio(entries, &yardstick);
        row
    };
    CountSummary { count, meshes: meshes.len(), rows: all.iter().map(row).collect() }
}

/// Hausdorff errors in relation to those of the reference, on the meshes where both reached a count.
fn ratio(entries: &[&Entry<'_>], reference: &[&Entry<'_>]) -> Option<Ratio> {
    let error = |entry: &Entry<'_>| {
        HAUSDORFF.of(entry.record).filter(|&error| entry.comparable() && error > 0.0)
    };
    let pair = |entry: &&Entry<'_>| {
        let other = reference.iter().find(|other| other.mesh == entry.mesh)?;
        Some(error(entry)? / error(other)?)
    };
    let ratios: Vec<f64> = entries.iter().filter_map(pair).collect();
    let value = Mean::Geometric { floor: f64::MIN_POSITIVE }.of(&ratios)?;
    Some(Ratio { value, meshes: ratios.len() })
}

/// The row of one series from all its entries and those that are averaged.
fn summarise(
    series: usize,
    entries: &[&Entry<'_>],
    kept: &[&Entry<'_>],
    known: &dyn Fn(&Metric) -> BTreeSet<usize>,
) -> SeriesSummary {
    let number = |of: &dyn Fn(&Entry<'_>) -> bool| entries.iter().filter(|entry| of(entry)).count();
    let reached: Vec<&Entry<'_>> =
        entries.iter().copied().filter(|entry| entry.comparable()).collect();
    let failed = number(&|entry| entry.record.status.is_failure());
    let unsupported = number(&|entry| entry.record.status == Status::Unsupported);
    SeriesSummary {
        series,
        over: kept.len(),
        asked: entries.len(),
        reached: reached.len(),
        missed: entries.len() - reached.len() - failed - unsupported,
        failed,
        unsupported,
        means: COMPARED.map(|metric| {
            let known = known(metric);
            let values = kept.iter().filter(|entry| known.contains(&entry.mesh));
            let values: Vec<f64> = values.filter_map(|entry| metric.of(entry.record)).collect();
            // A mean over less than half of the meshes tells of others than those that were asked for.
            let enough = 2 * values.len() >= entries.len();
            metric.mean.of(&values).filter(|_| enough).map(|mean| (mean, values.len()))
        }),
        ratio: None,
        stages: mean_stages(kept),
        topology: topology(&reached),
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
pub(crate) fn topology(entries: &[&Entry<'_>]) -> (usize, usize) {
    let known = entries.iter().filter_map(|entry| {
        let evaluation = entry.record.evaluate.as_ref()?;
        Some(evaluation.betti == evaluation.expected_betti?)
    });
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

/// The area under a series' curve of Hausdorff error against spheres, both as logarithms, over the
/// whole range of counts, told as the error of the level line with the same area: in % of the diagonal.
/// `None` where the series has no mean at some count, or there is only one.
pub(crate) fn curve_level(summaries: &[CountSummary], series: usize) -> Option<f64> {
    let point = |summary: &CountSummary| {
        let row = summary.rows.iter().find(|row| row.series == series)?;
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

/// One sentence for each number of spheres: who has the lowest error in relation to the reference,
/// on how many meshes, at what time.
pub(crate) fn headlines(comparison: &Comparison<'_>, summaries: &[CountSummary]) -> Vec<String> {
    let Some(reference) = reference(comparison) else { return Vec::new() };
    summaries.iter().filter_map(|summary| headline(comparison, reference, summary)).collect()
}

fn headline(
    comparison: &Comparison<'_>,
    reference: usize,
    summary: &CountSummary,
) -> Option<String> {
    let name = |series: usize| comparison.series[series].as_str();
    // A method that shares few meshes with the reference has not shown what it can do on the rest.
    let mut ranked: Vec<(Ratio, &SeriesSummary)> = summary
        .rows
        .iter()
        .filter_map(|row| Some((row.ratio.filter(|r| 2 * r.meshes >= summary.meshes)?, row)))
        .collect();
    ranked.sort_by(|a, b| a.0.value.total_cmp(&b.0.value).then(a.1.series.cmp(&b.1.series)));
    let &(ratio, row) = ranked.first()?;
    let spheres = crate::text::counted(summary.count, "sphere", "spheres");
    let told = |ratio: Ratio, row: &SeriesSummary| {
        let times = match row.series == reference {
            true => "the reference".to_owned(),
            false => {
                let value = crate::text::significant(ratio.value, 3);
                format!("{value} times the error of {}", name(reference))
            }
        };
        let meshes = crate::text::counted(ratio.meshes, "mesh", "meshes");
        format!("{} ({times}, on {meshes})", name(row.series))
    };
    let mut text = format!("{spheres}: lowest Hausdorff error by {}", told(ratio, row));
    if let Some(seconds) = row.mean(&crate::metric::TOTAL_SECONDS) {
        text.push_str(&format!(", {} s", crate::text::significant(seconds, 3)));
    }
    match ranked.get(1) {
        Some(&(next, other)) => text.push_str(&format!("; then {}", told(next, other))),
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
            meshes: 1,
            rows: vec![SeriesSummary {
                series: 0,
                over: usize::from(error.is_some()),
                asked: 1,
                reached: 1,
                missed: 0,
                failed: 0,
                unsupported: 0,
                means: COMPARED
                    .map(|metric| error.filter(|_| metric.key == HAUSDORFF.key).map(|e| (e, 1))),
                ratio: None,
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
