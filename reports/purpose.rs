//! Which method for which purpose: the answer, by how much it leads, and on how many meshes.
//!
//! Each answer is the best of values that belong to one method alone, mesh by mesh: medians and means are over
//! the meshes that the method was asked for, where one that it misses counts as infinitely bad. The lead is
//! measured between the first and the second method alone, on the meshes that both have. So another method
//! changes no number here unless it is itself the first or the second.
//!
//! A method that does it cheaply on half of the meshes and one that does it on nearly all are answers to two
//! questions, so both are named where they differ.

use std::cmp::Ordering;

use crate::comparison::{Comparison, Entry, reached};
use crate::metric::{HAUSDORFF, MIN_ANGLE, Mean, TOTAL_SECONDS};
use crate::tables::{Cell, Column, Row, Table};
use crate::text::{counted, grouped, significant};

/// Number of spheres that one level is compared at: of those that were asked the one nearest to it.
const USUAL: f64 = 100.0;

/// Error that the cost of a result is compared at, in % of the diagonal.
const BOUND: f64 = 1.0;

/// Triangles of a result with a larger error are no merit, in % of the diagonal.
const USABLE: f64 = 2.0;

/// Values that differ by a smaller share are called equal: about what other samples change.
const EQUAL: f64 = 0.01;

/// One value for each mesh, infinite where there is none; `None` where the method was not asked.
type Values = Vec<Option<f64>>;

/// A question and the value that decides it; less is better.
struct Question {
    title: String,
    /// The values of a series.
    values: Vec<Values>,
    /// A value as text, from many: median or mean.
    text: fn(f64) -> String,
    /// What is said of the best: `0.62 of the error`.
    lead: fn(f64) -> String,
}

/// The table of answers; `None` where nothing can be compared.
pub(crate) fn purpose_table(comparison: &Comparison<'_>, how: &str) -> Option<Table> {
    let mut rows = usual_level(comparison)
        .map_or_else(Vec::new, |(level, spheres)| at_count(comparison, level, spheres));
    rows.extend(within_bound(comparison));
    let titles =
        ["what matters", "method", "median", "on", "next", "beside it", "better, equal, worse"];
    (!rows.is_empty()).then(|| Table {
        caption: "Which one for me".to_owned(),
        notes: vec![
            how.to_owned(),
            format!(
                "Medians over the meshes that a method was asked for, of an even number the geometric mean of the \
                 middle two; one without such a result counts as infinitely bad, and half of them must have one. \
                 Among the levels that were run. The method of the \
                 best median is named, and where that is another the best one of those with a result on the most \
                 meshes. Beside the next one: the geometric mean of the ratios on the meshes \
                 where both have a result, and on how many of them the first one is better, equal within {:.0} %, \
                 worse.",
                100.0 * EQUAL
            ),
        ],
        columns: titles.map(Column::text).into(),
        rows,
    })
}

/// The answers at one number of spheres.
fn at_count(comparison: &Comparison<'_>, level: usize, spheres: usize) -> Vec<Row> {
    let spheres = counted(spheres, "sphere", "spheres");
    let error = error_question(errors_at(comparison, level), format!("lowest error at {spheres}"));
    let asked = |entry: &Entry<'_>| entry.level == level;
    let usable = |entry: &Entry<'_>| {
        entry.comparable() && HAUSDORFF.of(entry.record).is_some_and(|error| error <= USABLE)
    };
    // The distance from the angles of an equilateral triangle.
    let missing = |entry: &Entry<'_>| Some(60.0 - MIN_ANGLE.of(entry.record)?);
    let triangles = Question {
        title: format!("best triangles at {spheres}, of errors up to {USABLE} %"),
        values: values(comparison, asked, usable, missing),
        text: |value| format!("least angle {:.1}°", 60.0 - value),
        lead: |ratio| format!("{} of its distance from 60°", significant(ratio, 2)),
    };
    let mut rows: Vec<Row> = answers(comparison, &error);
    rows.push(right_everywhere(comparison, level, &spheres));
    rows.extend(answers(comparison, &triangles));
    rows
}

fn error_question(values: Vec<Values>, title: String) -> Question {
    Question {
        title,
        values,
        text: |value| format!("{} %", significant(value, 3)),
        lead: |ratio| format!("{} of its error", significant(ratio, 2)),
    }
}

/// What an error of at most [`BOUND`] costs.
fn within_bound(comparison: &Comparison<'_>) -> Vec<Row> {
    let within = |entry: &Entry<'_>| {
        entry.measured() && HAUSDORFF.of(entry.record).is_some_and(|error| error <= BOUND)
    };
    let least = |value: &dyn Fn(&Entry<'_>) -> Option<f64>| {
        values(comparison, |_: &Entry<'_>| true, within, value)
    };
    let bound = format!("within {BOUND} % error");
    let questions = [
        Question {
            title: format!("fewest spheres {bound}"),
            values: least(&|entry| Some(reached(entry.record)? as f64)),
            text: |value| counted(value.round() as usize, "sphere", "spheres"),
            lead: |ratio| format!("{} of its spheres", significant(ratio, 2)),
        },
        Question {
            title: format!("smallest file {bound}"),
            values: least(&|entry| Some(entry.record.evaluate.as_ref()?.counts.numbers() as f64)),
            text: |value| format!("{} numbers", grouped(value.round() as u64)),
            lead: |ratio| format!("{} of its numbers", significant(ratio, 2)),
        },
        Question {
            title: format!("fastest {bound}"),
            values: least(&|entry| TOTAL_SECONDS.of(entry.record)),
            text: |value| format!("{} s", significant(value, 2)),
            lead: |ratio| format!("{} of its time", significant(ratio, 2)),
        },
    ];
    questions.iter().flat_map(|question| answers(comparison, question)).collect()
}

/// The asked number of spheres that is nearest to [`USUAL`], of those that any method reached.
pub(crate) fn usual_level(comparison: &Comparison<'_>) -> Option<(usize, usize)> {
    let reached = |level: usize| {
        comparison.entries.iter().filter(|e| e.level == level && e.comparable()).count()
    };
    let far = |spheres: usize| (spheres.max(1) as f64 / USUAL).ln().abs();
    let counts = comparison.counts().filter(|&(level, _)| reached(level) > 0);
    counts.min_by(|a, b| far(a.1).total_cmp(&far(b.1)))
}

/// For each series and mesh the least value of the results that count, of those that were asked.
fn values(
    comparison: &Comparison<'_>,
    is_asked: impl Fn(&Entry<'_>) -> bool,
    counts: impl Fn(&Entry<'_>) -> bool,
    value: impl Fn(&Entry<'_>) -> Option<f64>,
) -> Vec<Values> {
    let mut all = vec![vec![None; comparison.meshes.len()]; comparison.series.len()];
    for entry in comparison.entries.iter().filter(|entry| is_asked(entry)) {
        let place: &mut Option<f64> = &mut all[entry.series][entry.mesh];
        let found = if counts(entry) { value(entry) } else { None };
        *place = Some(place.unwrap_or(f64::INFINITY).min(found.unwrap_or(f64::INFINITY)));
    }
    all
}

/// The errors of the results at a count.
fn errors_at(comparison: &Comparison<'_>, level: usize) -> Vec<Values> {
    let asked = |entry: &Entry<'_>| entry.level == level;
    values(
        comparison,
        asked,
        |entry: &Entry<'_>| entry.comparable(),
        |entry| HAUSDORFF.of(entry.record),
    )
}

/// What a series is ranked by.
struct Rank {
    series: usize,
    /// Of an even number the geometric mean of the middle two, or the lower one where the upper has no result: at
    /// least half of the meshes have one. `None` where fewer have.
    median: Option<f64>,
    /// Meshes without a result, of those asked.
    missed: usize,
    /// Mean of the logarithms of the results, for equal medians.
    mean: f64,
}

impl Rank {
    fn of(series: usize, values: &Values) -> Self {
        let mut known: Vec<f64> = values.iter().flatten().copied().collect();
        known.sort_by(f64::total_cmp);
        let middle =
            [known.len().saturating_sub(1) / 2, known.len() / 2].map(|k| known.get(k).copied());
        let median = match middle {
            [Some(low), Some(high)] if high.is_finite() && low != high => Some((low * high).sqrt()),
            [low, _] => low.filter(|value| value.is_finite()),
        };
        let results: Vec<f64> = known.iter().copied().filter(|value| value.is_finite()).collect();
        let logarithms = results.iter().map(|value| value.max(1e-9).ln());
        Self {
            series,
            median,
            missed: known.len() - results.len(),
            mean: logarithms.sum::<f64>() / results.len().max(1) as f64,
        }
    }
}

/// The best median first.
fn by_median(a: &Rank, b: &Rank) -> Ordering {
    let medians = a.median.unwrap_or(f64::INFINITY).total_cmp(&b.median.unwrap_or(f64::INFINITY));
    medians
        .then(a.missed.cmp(&b.missed))
        .then(a.mean.total_cmp(&b.mean))
        .then(a.series.cmp(&b.series))
}

/// The one with a result on the most meshes first.
fn by_meshes(a: &Rank, b: &Rank) -> Ordering {
    a.missed.cmp(&b.missed).then_with(|| by_median(a, b))
}

/// How one series stands beside another, on the meshes where both have a result.
struct Lead {
    /// Geometric mean of the ratios.
    ratio: f64,
    better: usize,
    equal: usize,
    worse: usize,
}

impl Lead {
    fn of(first: &Values, second: &Values) -> Option<Self> {
        let both = first.iter().zip(second).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
        let both: Vec<(f64, f64)> = both.filter(|(a, b)| a.is_finite() && b.is_finite()).collect();
        let ratios: Vec<f64> = both.iter().map(|(a, b)| a.max(1e-9) / b.max(1e-9)).collect();
        let ratio = Mean::Geometric { floor: f64::MIN_POSITIVE }.of(&ratios)?;
        let equal = ratios.iter().filter(|ratio| ratio.ln().abs() <= EQUAL).count();
        let better = ratios.iter().filter(|ratio| ratio.ln() < -EQUAL).count();
        Some(Self { ratio, better, equal, worse: ratios.len() - equal - better })
    }

    fn counts(&self) -> String {
        format!("{}, {}, {}", self.better, self.equal, self.worse)
    }
}

/// The rows of a question: the best median, and where that is another the best on the most meshes. None where no
/// method has a median.
fn answers(comparison: &Comparison<'_>, question: &Question) -> Vec<Row> {
    let values = question.values.iter().enumerate();
    let mut ranks: Vec<Rank> = values.map(|(series, values)| Rank::of(series, values)).collect();
    ranks.retain(|rank| rank.median.is_some());
    ranks.sort_by(by_median);
    let Some(first) = ranks.first().map(|rank| rank.series) else { return vec![] };
    let mut rows = vec![answer(comparison, question, question.title.clone(), &ranks)];
    ranks.sort_by(by_meshes);
    if ranks[0].series != first {
        let title = format!("{}, on the most meshes", question.title);
        rows.push(answer(comparison, question, title, &ranks));
    }
    rows
}

/// The row of the first of the ranked methods.
fn answer(comparison: &Comparison<'_>, question: &Question, title: String, ranks: &[Rank]) -> Row {
    let first = ranks[0].series;
    let mut cells = vec![Cell::new(title), Cell { best: true, ..name(comparison, first) }];
    cells.push(Cell::optional(ranks[0].median.map(question.text)));
    cells.push(Cell::new(on_meshes(&question.values[first])));
    let next = ranks.get(1).map(|rank| rank.series);
    cells.extend(lead_cells(comparison, next, |second| {
        let lead = Lead::of(&question.values[first], &question.values[second])?;
        Some([(question.lead)(lead.ratio), lead.counts()])
    }));
    Row { cells, starts_group: false }
}

/// The row of the methods with the topology of the solid on every mesh, the one of the lowest error first.
fn right_everywhere(comparison: &Comparison<'_>, level: usize, spheres: &str) -> Row {
    let at = |entry: &Entry<'_>| entry.level == level && entry.comparable();
    let is_right = |entry: &Entry<'_>| {
        let evaluate = entry.record.evaluate.as_ref()?;
        Some(evaluate.betti == evaluate.expected_betti?)
    };
    let errors = errors_at(comparison, level);
    let right = |series: usize| {
        let own = comparison.entries.iter().filter(|e| e.series == series && at(e));
        let known: Vec<bool> = own.filter_map(is_right).collect();
        let asked = errors[series].iter().flatten().count();
        (known.iter().filter(|&&right| right).count(), asked)
    };
    let mut ranks: Vec<Rank> = (0..comparison.series.len())
        .filter(|&series| matches!(right(series), (right, asked) if right == asked && asked > 0))
        .map(|series| Rank::of(series, &errors[series]))
        .filter(|rank| rank.median.is_some())
        .collect();
    ranks.sort_by(by_median);
    let title = format!("topology right everywhere, lowest error at {spheres}");
    if ranks.is_empty() {
        let mut cells = vec![Cell::new(title), Cell::new("none")];
        cells.extend([(); 5].map(|()| Cell::optional(None)));
        return Row { cells, starts_group: false };
    }
    answer(comparison, &error_question(errors, title.clone()), title, &ranks)
}

fn name(comparison: &Comparison<'_>, series: usize) -> Cell {
    Cell::new(comparison.series[series].as_str())
}

/// On how many meshes there is a result, of those asked.
fn on_meshes(values: &Values) -> String {
    let known = values.iter().flatten();
    let met = known.clone().filter(|value| value.is_finite()).count();
    format!("{met} of {}", counted(known.count(), "mesh", "meshes"))
}

fn lead_cells(
    comparison: &Comparison<'_>,
    next: Option<usize>,
    lead: impl Fn(usize) -> Option<[String; 2]>,
) -> Vec<Cell> {
    let next = next.and_then(|second| Some((second, lead(second)?)));
    match next {
        Some((second, [by, counts])) => {
            vec![name(comparison, second), Cell::new(by), Cell::new(counts)]
        }
        None => vec![Cell::new("no other"), Cell::optional(None), Cell::optional(None)],
    }
}

/// For each two methods, on how many meshes the one of the row has the lower error, an equal one, the higher one.
pub(crate) fn wins_table(comparison: &Comparison<'_>, how: &str) -> Option<Table> {
    let (level, spheres) = usual_level(comparison)?;
    let errors = errors_at(comparison, level);
    let has = |values: &Values| values.iter().flatten().any(|value| value.is_finite());
    let shown: Vec<usize> = (0..errors.len()).filter(|&series| has(&errors[series])).collect();
    if shown.len() < 2 {
        return None;
    }
    let mut columns = vec![Column::text("method")];
    columns.extend(shown.iter().map(|&s| Column::text(comparison.series[s].as_str())));
    let row = |&first: &usize| {
        let mut cells = vec![name(comparison, first)];
        cells.extend(shown.iter().map(|&second| {
            let lead = (first != second).then(|| Lead::of(&errors[first], &errors[second]));
            let lead = lead.flatten();
            let best = lead.as_ref().is_some_and(|lead| lead.worse == 0 && lead.better > 0);
            Cell { best, ..Cell::optional(lead.map(|lead| lead.counts())) }
        }));
        Row { cells, starts_group: false }
    };
    Some(Table {
        caption: format!("Method against method at {}", counted(spheres, "sphere", "spheres")),
        notes: vec![
            how.to_owned(),
            format!(
                "On how many meshes the Hausdorff error of the row's method is lower than that of the column's, equal \
                 within {:.0} %, higher; on the meshes where both reached the count. Bold: never higher.",
                100.0 * EQUAL
            ),
        ],
        rows: shown.iter().map(row).collect(),
        columns,
    })
}

/// The errors of one series on its meshes at one number of spheres.
pub(crate) struct Profile {
    /// Errors, ascending.
    pub(crate) errors: Vec<f64>,
    /// Meshes that it was asked for.
    pub(crate) asked: usize,
}

/// The number of spheres that the answers are for, and a profile for each series.
pub(crate) fn error_profiles(comparison: &Comparison<'_>) -> Option<(usize, Vec<Profile>)> {
    let (level, spheres) = usual_level(comparison)?;
    let profile = |values: &Values| {
        let known = values.iter().flatten();
        let asked = known.clone().count();
        let mut errors: Vec<f64> = known.copied().filter(|value| value.is_finite()).collect();
        errors.sort_by(f64::total_cmp);
        Profile { errors, asked }
    };
    Some((spheres, errors_at(comparison, level).iter().map(profile).collect()))
}
