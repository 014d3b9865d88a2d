//! Which method for which purpose: at equal numbers of spheres and at equal errors.
//!
//! For each criterion the table names the best method. Its value belongs to that method alone: a median or mean over
//! the meshes that it ran on, where a missing result counts as infinite. The ratio to the runner-up is over the
//! meshes where both have a result. A further method changes these numbers only if it becomes first or second.
//! Whether a difference is established also depends on the number of methods, for whose pairs the test is corrected.

use std::cmp::Ordering;

use medial_run::level::Target;
use medial_run::record::{Record, Status};
use medial_run::text::{counted, grouped, significant};

use crate::comparison::{Comparison, Entry, reached};
use crate::metric::{
    Better, CENTRALITY, COMPLETENESS, HAUSDORFF, MIN_ANGLE, Metric, TOTAL_SECONDS, median,
};
use crate::statistics::{FEWEST, Pairs, Ratio, Sample};
use crate::summary::{reference, topology};
use crate::tables::{Cell, Column, Table};

/// The table compares results at the requested count nearest to this one.
const USUAL: f64 = 100.0;

/// The structure of results is compared at the requested count nearest to this one.
const DETAILED: f64 = 500.0;

/// Error that the cost of a result is compared at, in % of the diagonal.
const BOUND: f64 = 1.0;

/// Results with a larger error are not ranked by triangle quality, in % of the diagonal.
const USABLE: f64 = 2.0;

/// Results with a larger error are not ranked by error, in % of the diagonal.
const RANKED: f64 = 5.0;

/// The quantity of the criterion whose values are in the column of the time.
const TIME: &str = "its time";

/// The quantity of a criterion where more is better. The ratio of two is that of the values, the runner-up's to the best.
const RECIPROCAL: &str = "its reciprocal";

/// For each mesh the least value of a method; `None` where the method did not run.
pub(crate) type Values = Vec<Option<Found>>;

/// A value and the seconds of the result that has it; infinite and unknown without a result.
#[derive(Clone, Copy)]
pub(crate) struct Found {
    value: f64,
    seconds: f64,
}

/// The values alone, for tests over meshes.
pub(crate) fn samples(values: &[Values]) -> Vec<Sample> {
    let sample =
        |values: &Values| values.iter().map(|found| found.map(|found| found.value)).collect();
    values.iter().map(sample).collect()
}

/// A criterion and its values; less is better.
struct Criterion {
    title: String,
    /// The values of a series.
    values: Vec<Values>,
    /// A median of them as text.
    text: fn(f64) -> String,
    /// The quantity of the runner-up that the ratio is a share of: `its error`.
    of: &'static str,
}

/// The table "Which method?"; `None` where nothing compares. With one mesh it shows results instead of medians.
pub(crate) fn purpose_table(comparison: &Comparison<'_>, how: &str) -> Option<Table> {
    let mut rows = vec![];
    if let Some((level, spheres)) = usual_level(comparison) {
        rows.extend(at_count(comparison, level, spheres));
    }
    if let Some((level, spheres)) = level_nearest(comparison, DETAILED) {
        rows.extend(closest_structure(comparison, level, spheres));
    }
    rows.extend(within_bound(comparison));
    let meshes = comparison.meshes.len();
    let is_one = meshes == 1;
    let has_few = meshes < FEWEST;
    let rule = format!(
        "Among the levels that were run, without the initial medial mesh and results with errors above {RANKED} %."
    );
    let few = format!(
        "No difference is established: {meshes} meshes are too few (the test needs {FEWEST})."
    );
    let established = "A difference is established if the signed-rank test over meshes, corrected for all pairs of \
         methods, has p < 0.05.";
    let medians = "Medians over the meshes that a method ran on. A missing result counts as infinite. A method needs \
         results on at least half of its meshes. The ratio to the runner-up is a geometric mean over the meshes where \
         both have a result, with its 95 % interval if they are at least six. ";
    let medians = medians.to_owned() + if has_few { &few } else { established };
    let notes = [how.to_owned(), rule].into_iter().chain((!is_one).then_some(medians));
    let columns = [
        "criterion",
        "method",
        if is_one { "result" } else { "median" },
        "time (s)",
        "meshes",
        "runner-up",
        "ratio to it",
        "difference established",
    ];
    let table = Table {
        caption: "Which method?".to_owned(),
        notes: notes.collect(),
        columns: columns.map(Column::text).into(),
        rows,
        grouped: false,
    };
    let table = if has_few { table.without(&["difference established"]) } else { table };
    // Counts of meshes are redundant for one mesh.
    let table = if is_one { table.without(&["meshes"]) } else { table };
    (!table.rows.is_empty()).then_some(table)
}

/// The rows at one number of spheres.
fn at_count(comparison: &Comparison<'_>, level: usize, spheres: usize) -> Vec<Vec<Cell>> {
    let spheres = counted(spheres, "sphere", "spheres");
    let error = error_criterion(errors_at(comparison, level), format!("lowest error at {spheres}"));
    let triangles = Criterion {
        title: format!("best triangles at {spheres}, errors up to {USABLE} %"),
        values: values(comparison, Some(level), |entry| {
            HAUSDORFF.of(entry.record).filter(|&e| entry.comparable() && e <= USABLE)?;
            // Less must be better: the distance from the angles of an equilateral triangle.
            Some(60.0 - MIN_ANGLE.of(entry.record)?)
        }),
        text: |value| format!("least angle {:.1}°", 60.0 - value),
        of: "its distance from 60°",
    };
    let mut rows: Vec<Vec<Cell>> = criterion_row(comparison, &error).into_iter().collect();
    rows.push(right_everywhere(comparison, level, &spheres));
    rows.extend(criterion_row(comparison, &triangles));
    rows.extend(
        comparison
            .own_metrics()
            .into_iter()
            .filter_map(|metric| own_criterion(comparison, metric, level, &spheres)),
    );
    rows
}

/// The row of a metric of the user whose values are all positive: others have no ratio.
fn own_criterion(
    comparison: &Comparison<'_>,
    metric: &Metric,
    level: usize,
    spheres: &str,
) -> Option<Vec<Cell>> {
    let is_positive = comparison
        .entries
        .iter()
        .filter(|entry| entry.level == level)
        .filter_map(|entry| metric.of(entry.record))
        .all(|v| v > 0.0);
    let own = |entry: &Entry<'_>| metric.of(entry.record).filter(|_| entry.comparable());
    let title = metric.title;
    let criterion = match metric.better {
        Better::Lower => Criterion {
            title: format!("lowest {title} at {spheres}"),
            values: values(comparison, Some(level), own),
            text: |value| significant(value, 3),
            of: "its value",
        },
        // Less must be better.
        Better::Higher => Criterion {
            title: format!("highest {title} at {spheres}"),
            values: values(comparison, Some(level), |entry| Some(own(entry)?.recip())),
            text: |value| significant(value.recip(), 3),
            of: RECIPROCAL,
        },
        Better::Neither => return None,
    };
    criterion_row(comparison, &criterion).filter(|_| is_positive)
}

/// The row of the medial mesh nearest to the axis that the surface implies, both ways.
fn closest_structure(
    comparison: &Comparison<'_>,
    level: usize,
    spheres: usize,
) -> Option<Vec<Cell>> {
    let values = values(comparison, Some(level), |entry| {
        HAUSDORFF.of(entry.record).filter(|&e| entry.comparable() && e <= RANKED)?;
        Some(COMPLETENESS.of(entry.record)?.max(CENTRALITY.of(entry.record)?))
    });
    let title = format!("closest structure at {}", counted(spheres, "sphere", "spheres"));
    let text = |value| format!("axis missed and off centre {} %", significant(value, 3));
    criterion_row(comparison, &Criterion { title, values, text, of: "its distance" })
}

fn error_criterion(values: Vec<Values>, title: String) -> Criterion {
    Criterion {
        title,
        values,
        text: |value| format!("{} %", significant(value, 3)),
        of: "its error",
    }
}

/// The cost of an error of at most [`BOUND`], at whichever level costs least on a mesh.
fn within_bound(comparison: &Comparison<'_>) -> Vec<Vec<Cell>> {
    type Cost = (&'static str, fn(&Record) -> Option<f64>, fn(f64) -> String, &'static str);
    let costs: [Cost; 3] = [
        (
            "fewest spheres",
            |record| Some(reached(record)? as f64),
            // A count that did not run can be smaller.
            |value| format!("at most {}", counted(value.round() as usize, "sphere", "spheres")),
            "its spheres",
        ),
        (
            "smallest file",
            stored_numbers,
            |value| format!("at most {} numbers", grouped(value.round() as u64)),
            "its numbers",
        ),
        ("fastest", |record| TOTAL_SECONDS.of(record), |value| significant(value, 3), TIME),
    ];
    let mut rows = vec![];
    for (title, cost, text, of) in costs {
        let values = values(comparison, None, |entry| {
            HAUSDORFF.of(entry.record).filter(|&e| entry.measured() && e <= BOUND)?;
            cost(entry.record)
        });
        let title = format!("{title} within {BOUND} % error");
        rows.extend(criterion_row(comparison, &Criterion { title, values, text, of }));
    }
    rows
}

/// Floats of the medial mesh as a file.
fn stored_numbers(record: &Record) -> Option<f64> {
    Some(record.evaluate.as_ref()?.counts.numbers() as f64)
}

/// The requested number of spheres nearest to [`USUAL`], among those that any method reached.
pub(crate) fn usual_level(comparison: &Comparison<'_>) -> Option<(usize, usize)> {
    level_nearest(comparison, USUAL)
}

fn level_nearest(comparison: &Comparison<'_>, usual: f64) -> Option<(usize, usize)> {
    comparison
        .counts()
        .filter(|&(level, _)| comparison.entries.iter().any(|e| e.level == level && e.comparable()))
        // By ratio: 50 and 200 are equally far from 100. Of two the larger one, which comes first.
        .min_by(|a, b| {
            let [a, b] = [a, b].map(|count| (count.1.max(1) as f64 / usual).ln().abs());
            a.total_cmp(&b)
        })
}

/// For each series and mesh the least value of its results, at one level or at all of them. The medial mesh that all
/// methods start from is no method's result.
fn values(
    comparison: &Comparison<'_>,
    level: Option<usize>,
    value: impl Fn(&Entry<'_>) -> Option<f64>,
) -> Vec<Values> {
    let mut all: Vec<Values> = vec![vec![None; comparison.meshes.len()]; comparison.series.len()];
    for entry in &comparison.entries {
        if level.is_none_or(|level| entry.level == level)
            && comparison.methods[entry.series] != "initial"
        {
            let seconds = TOTAL_SECONDS.of(entry.record).unwrap_or(f64::INFINITY);
            // A run without a result counts as infinitely bad, a mesh without a run not at all.
            let value = value(entry).unwrap_or(f64::INFINITY);
            let least = all[entry.series][entry.mesh].get_or_insert(Found { value, seconds });
            if value < least.value {
                *least = Found { value, seconds };
            }
        }
    }
    all
}

/// The errors of the results at a count, up to [`RANKED`].
pub(crate) fn errors_at(comparison: &Comparison<'_>, level: usize) -> Vec<Values> {
    values(comparison, Some(level), |entry| {
        HAUSDORFF.of(entry.record).filter(|&error| entry.comparable() && error <= RANKED)
    })
}

/// The median; infinities count. Of an even number the geometric mean of the middle two, or the lower one where the
/// upper is infinite. `None` where more than half are infinite.
fn middle(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut known: Vec<f64> = values.collect();
    known.sort_by(f64::total_cmp); // infinities last
    let middle =
        [known.len().saturating_sub(1) / 2, known.len() / 2].map(|k| known.get(k).copied());
    match middle {
        [Some(low), Some(high)] if high.is_finite() && low != high => Some((low * high).sqrt()),
        [low, _] => low.filter(|value| value.is_finite()),
    }
}

/// The rank of a series by one criterion.
pub(crate) struct Rank {
    pub(crate) series: usize,
    /// `None` where fewer than half of the meshes have a result.
    median: Option<f64>,
    /// Meshes that the method ran on without a result.
    missed: usize,
    /// Mean of the logarithms of the results, for equal medians.
    mean: f64,
}

impl Rank {
    fn of(series: usize, values: &Values) -> Self {
        let known: Vec<f64> = values.iter().flatten().map(|found| found.value).collect();
        // A perfect result is zero and has no logarithm.
        let results: Vec<f64> = known.iter().copied().filter(|value| value.is_finite()).collect();
        let sum: f64 = results.iter().map(|value| value.max(1e-9).ln()).sum();
        Self {
            series,
            median: middle(known.iter().copied()),
            missed: known.len() - results.len(),
            mean: sum / results.len().max(1) as f64,
        }
    }
}

/// The best median first.
fn by_median(a: &Rank, b: &Rank) -> Ordering {
    let [medians_a, medians_b] = [a, b].map(|rank| rank.median.unwrap_or(f64::INFINITY));
    medians_a
        .total_cmp(&medians_b)
        .then(a.missed.cmp(&b.missed))
        .then(a.mean.total_cmp(&b.mean))
        .then(a.series.cmp(&b.series))
}

/// The series that have a median, the best first.
pub(crate) fn ranked(values: &[Values]) -> Vec<Rank> {
    let ranks = values.iter().enumerate().map(|(series, values)| Rank::of(series, values));
    let mut ranks: Vec<Rank> = ranks.filter(|rank| rank.median.is_some()).collect();
    ranks.sort_by(by_median);
    ranks
}

/// The row of a criterion: that of the best median. None if no method has a median.
fn criterion_row(comparison: &Comparison<'_>, criterion: &Criterion) -> Option<Vec<Cell>> {
    row_of(comparison, criterion, &ranked(&criterion.values))
}

/// The row of the first of the ranked methods, if there is one.
fn row_of(comparison: &Comparison<'_>, criterion: &Criterion, ranks: &[Rank]) -> Option<Vec<Cell>> {
    let first = ranks.first()?.series;
    let pairs =
        Pairs::of(ranks.iter().map(|rank| rank.series).collect(), &samples(&criterion.values));
    let known = criterion.values[first].iter().flatten();
    let met = known.clone().filter(|found| found.value.is_finite());
    let seconds = middle(met.clone().map(|found| found.seconds));
    let is_time = criterion.of == TIME;
    let mut cells = vec![
        Cell::from(criterion.title.clone()),
        Cell { best: true, ..Cell::from(comparison.series[first].as_str()) },
        Cell::from(
            ranks[0]
                .median
                .map(|median| (criterion.text)(median) + if is_time { " s" } else { "" }),
        ),
        Cell::from(match is_time {
            true => ranks[0].median.map(criterion.text),
            false => seconds.map(|seconds| significant(seconds, 3)),
        }),
        Cell::from(format!("{} of {}", met.count(), counted(known.count(), "mesh", "meshes"))),
    ];
    let runner_up = ranks.get(1).map(|rank| rank.series);
    let pair = runner_up.and_then(|second| pairs.between(first, second));
    let ratio = pair.as_ref().and_then(|pair| pair.ratio);
    let ratio = ratio.map(|ratio| match criterion.of {
        RECIPROCAL => format!("{} of this value", ratio.text(2)),
        of => format!("{} of {of}", ratio.text(2)),
    });
    cells.extend([
        Cell::from(runner_up.map_or("no other", |second| comparison.series[second].as_str())),
        Cell::from(ratio),
        Cell::from(pair.map(|pair| match (pair.meshes(), pair.is_established()) {
            (meshes, true) => format!("yes, n = {meshes}"),
            (meshes, false) => format!("no, n = {meshes}"),
        })),
    ]);
    Some(cells)
}

/// The row of the methods with the topology of the solid on every mesh, the one of the lowest error first.
fn right_everywhere(comparison: &Comparison<'_>, level: usize, spheres: &str) -> Vec<Cell> {
    let errors = errors_at(comparison, level);
    let mut ranks = ranked(&errors);
    ranks.retain(|&Rank { series, .. }| {
        let mut own = comparison.at(series, level);
        own.retain(|entry| entry.comparable());
        let (right, _) = topology(&own);
        // Of all meshes that it ran on: one without a result is not right.
        right > 0 && right == errors[series].iter().flatten().count()
    });
    let title = format!("topology right everywhere, lowest error at {spheres}");
    let criterion = error_criterion(errors, title);
    row_of(comparison, &criterion, &ranks).unwrap_or_else(|| {
        let none = [(); 6].map(|()| Cell::from(None));
        [criterion.title.into(), "none".into()].into_iter().chain(none).collect()
    })
}

/// One method at one error bound.
struct BoundRow<'c> {
    /// The bound, in % of the diagonal.
    percent: f64,
    /// The entries of the method, at least one.
    entries: Vec<&'c Entry<'c>>,
    /// Those with a level within the bound.
    met: Vec<&'c Entry<'c>>,
    /// Ratio of spheres to the reference method's.
    ratio: Option<Ratio>,
}

impl<'c> BoundRow<'c> {
    fn new(percent: f64, entries: Vec<&'c Entry<'c>>, yardstick: &[&Entry<'_>]) -> Self {
        let met: Vec<&Entry<'_>> =
            entries.iter().copied().filter(|entry| entry.measured()).collect();
        let logs = met.iter().filter_map(|entry| {
            let other = yardstick.iter().find(|o| o.mesh == entry.mesh && o.measured())?;
            Some((reached(entry.record)? as f64 / reached(other.record)? as f64).ln())
        });
        let ratio = Ratio::of_logs(&logs.collect::<Vec<_>>());
        Self { percent, entries, met, ratio }
    }

    /// The median over the meshes that the method ran on, where a missing value counts as infinite; `None` where the
    /// median is infinite.
    fn median(&self, value: impl Fn(&Record) -> Option<f64>) -> Option<f64> {
        let mut values: Vec<f64> =
            self.met.iter().filter_map(|entry| value(entry.record)).collect();
        values.resize(self.entries.len(), f64::INFINITY); // a failure is no cheap result
        // The upper median: at least half of the meshes need no more.
        median(&values).filter(|value| value.is_finite())
    }

    fn spheres(&self) -> Option<f64> {
        self.median(|record| reached(record).map(|spheres| spheres as f64))
    }

    /// Meshes without a result for another reason than the bound.
    fn failed(&self) -> usize {
        let is_missed = |entry: &&&Entry<'_>| entry.record.status == Status::BoundMissed;
        self.entries.len() - self.met.len() - self.entries.iter().filter(is_missed).count()
    }
}

/// The table of all bounds, from loose to tight; `None` without a requested bound.
pub(crate) fn equal_error_table(comparison: &Comparison<'_>, how: &str) -> Option<Table> {
    let reference = reference(comparison);
    let mut rows: Vec<BoundRow<'_>> = vec![];
    for (level, target) in comparison.levels.iter().enumerate() {
        let Target::MaxError(bound) = target else { continue }; // others have tables of their own
        // In percent, without the digits that a fraction of two cannot hold: 0.3 %, not 0.30000000000000004 %.
        let percent = (bound * 1e12).round() / 1e10;
        let yardstick = reference.map_or(vec![], |series| comparison.at(series, level));
        let entries = (0..comparison.series.len()).map(|series| comparison.at(series, level));
        let entries = entries.filter(|entries| !entries.is_empty());
        let own = entries.map(|entries| BoundRow::new(percent, entries, &yardstick));
        let mut own: Vec<BoundRow<'_>> = own.collect();
        // Fewest spheres first. Rows without a median follow, most meshes within the bound first.
        own.sort_by(|a, b| {
            let [few, many] = [a, b].map(|row| row.spheres().unwrap_or(f64::INFINITY));
            few.total_cmp(&many).then(b.met.len().cmp(&a.met.len()))
        });
        rows.extend(own);
    }
    let yardstick = reference.map_or("reference", |series| &comparison.series[series]);
    let whole = |value: Option<f64>| value.map(|value| grouped(value.round() as u64));
    let rows = Table::of(&rows)
        .number("error (%)", |row| row.percent.to_string())
        .text("method", |row| comparison.series[row.entries[0].series].as_str())
        .text("valid on", |row| format!("{} of {}", row.met.len(), row.entries.len()))
        .number("spheres ↓", |row| whole(row.spheres()))
        .number(format!("÷ {yardstick}"), |row| row.ratio.map(|ratio| ratio.text(3)))
        .text("on", |row| row.ratio.map(|ratio| counted(ratio.meshes, "mesh", "meshes")))
        .number("stored numbers ↓", |row| whole(row.median(stored_numbers)))
        .number("total (s) ↓", |row| {
            let seconds = row.median(|record| TOTAL_SECONDS.of(record));
            seconds.map(|seconds| significant(seconds, 3))
        })
        .text("topology right", |row| Cell::share(topology(&row.met)))
        .text("failed", |row| match row.failed() {
            0 => "none".to_owned(),
            failed => failed.to_string(),
        });
    let note = "The search runs on each mesh over counts and native levels; fewer spheres at \
         the same error are better. Medians over all meshes; a mesh without a level within \
         the error counts as infinite; a dash: on half of them. The ratio is the \
         geometric mean of the ratios of spheres to those of the named method, on the \
         meshes where both keep the error. Stored numbers: floats of the medial mesh. Seconds \
         are those of the level found, without the search.";
    (!rows.table.rows.is_empty()).then(|| Table {
        caption: "Equal error: the fewest spheres within a Hausdorff error".to_owned(),
        notes: vec![how.to_owned(), note.to_owned()],
        grouped: true,
        ..rows.table
    })
}
