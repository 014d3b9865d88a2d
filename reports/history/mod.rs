//! The results of many runs: at which run and commits a series changed.
//!
//! A series is compared with itself alone, on one machine, under one set of conditions, on one content of its mesh: such
//! runs make a `Track`. Machines that take turns have a track each.
//!
//! - Seconds and memory are noisy: [`change_points`] finds their steps. A step that most series of the same runs make is
//!   that of the machine or of the compiler, and raises no alarm.
//! - Status, errors, counts, topology and results are exact: each difference from the run before is a [`Change`].

mod change_points;
mod report;
mod run;

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Value, json};

pub use change_points::{ChangePoint, change_points};
pub use run::{HistoryError, Point, Run, read_runs};

use crate::metric::median;

/// A change point that is found one run later may lie this many runs from its earlier place.
const SAME_PLACE: usize = 3;

/// An error that rises by less than this share is no regression.
const LEAST_RISE: f64 = 1e-3;

/// A run by date and commit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RunName {
    /// Date of the commit.
    pub date: String,
    /// Hash of the commit.
    pub commit: String,
}

/// The runs of one series that are compared with each other.
#[derive(Clone, Debug)]
struct Track<'a> {
    /// Machine and conditions.
    setting: [&'a str; 2],
    /// Indices of the runs, and their measurements.
    points: Vec<(usize, &'a Point)>,
}

/// Where a track changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Index of the first run after it.
    #[serde(skip)]
    pub run: usize,
    /// Mesh, method and level of the series.
    pub series: String,
    /// The changed quantity: `seconds`, `bytes`, `status`, `hausdorff`, `mean`, `spheres`, `topology` or `result`.
    pub what: &'static str,
    /// The value before; of seconds and memory the last one.
    pub from: Value,
    /// The value after; of seconds and memory the newest one.
    pub to: Value,
    /// After over before: of levels for seconds and memory, of values for errors.
    pub ratio: Option<f64>,
    /// The last run of the track before it.
    pub last_before: RunName,
    /// The first run after it.
    pub first_after: RunName,
    /// Whether it is for the worse: slower, larger, less accurate; a result or its topology lost.
    pub worse: bool,
    /// Whether most series moved alike.
    pub shared: bool,
    /// Whether the newest run brought it to light.
    pub news: bool,
}

/// Change points and changed results of a history.
#[derive(Clone, Debug, Serialize)]
pub struct Findings<'a> {
    /// The runs, the oldest first.
    pub runs: Vec<RunName>,
    #[serde(skip)]
    tracks: Vec<Track<'a>>,
    /// Number of changes that the newest run brought for the worse.
    pub regressions: usize,
    /// Change points of seconds and memory, the newest first.
    pub change_points: Vec<Change>,
    /// Differences of exact values, the newest first.
    pub changes: Vec<Change>,
}

/// A noisy quantity; `None` where a run did not measure it.
type Noisy = fn(&Point) -> Option<f64>;

/// Fewest values on either side of a run that make a level.
const FEWEST: usize = 3;

/// The noisy quantities.
const NOISY: [(&str, Noisy); 2] =
    [("seconds", |point| point.seconds), ("bytes", |point| point.bytes.map(|bytes| bytes as f64))];

/// The exact quantities.
fn exact(point: &Point) -> [(&'static str, Value); 6] {
    [
        ("status", json!(point.status.to_string())),
        ("topology", json!(point.topology.map(|right| if right { "right" } else { "wrong" }))),
        ("hausdorff", json!(point.hausdorff)),
        ("mean", json!(point.mean)),
        ("spheres", json!(point.spheres)),
        ("result", json!(point.result)),
    ]
}

impl<'a> Findings<'a> {
    /// Findings in runs, the oldest first. `least_step` is the least change of seconds and memory, as a share.
    pub fn of(runs: &'a [Run], least_step: f64) -> Self {
        let mut tracks: BTreeMap<_, Track<'a>> = BTreeMap::new();
        for (index, run) in runs.iter().enumerate() {
            for point in &run.series {
                let setting = [run.machine.as_str(), run.conditions.as_str()];
                let series = (&point.mesh, &point.method, &point.level);
                let track = tracks.entry((series, setting, &point.mesh_hash));
                let track = track.or_insert_with(|| Track { setting, points: vec![] });
                track.points.push((index, point));
            }
        }
        let mut findings = Self {
            runs: (runs.iter())
                .map(|run| RunName { date: run.date.clone(), commit: run.commit.clone() })
                .collect(),
            tracks: tracks.into_values().collect(), // sorted by series, for equal pages
            regressions: 0,
            change_points: vec![],
            changes: vec![],
        };
        let tracks = 0..findings.tracks.len();
        let steps = tracks.clone().flat_map(|track| NOISY.map(|quantity| (track, quantity)));
        let steps = steps.flat_map(|(track, of)| findings.steps(track, of, least_step)).collect();
        let changes = tracks.flat_map(|track| findings.differences(track)).collect();
        (findings.change_points, findings.changes) = (steps, changes);
        for changes in [&mut findings.change_points, &mut findings.changes] {
            // Stable: within a run the order of the series remains.
            changes.sort_by_key(|change| std::cmp::Reverse(change.run));
        }
        findings.regressions = findings.news().count();
        findings
    }

    /// The changes for the worse that the newest run brought to light.
    pub fn news(&self) -> impl Iterator<Item = &Change> {
        let all = self.change_points.iter().chain(&self.changes);
        all.filter(|change| change.news && change.worse && !change.shared)
    }

    /// The change points of a noisy quantity.
    fn steps(&self, track: usize, (what, of): (&'static str, Noisy), least: f64) -> Vec<Change> {
        let measured = measured(&self.tracks[track], of);
        let values: Vec<f64> = measured.iter().map(|(_, value)| *value).collect();
        let Some((&(newest, last), before)) = measured.split_last() else { return vec![] };
        let steps = change_points(&values, least);
        // A change point is news on one run alone: where it was not found without that run.
        let earlier = match steps.is_empty() {
            true => vec![],
            false => change_points(&values[..before.len()], least),
        };
        let change = |step: ChangePoint| {
            let was_found = earlier.iter().any(|other| {
                other.at.abs_diff(step.at) <= SAME_PLACE
                    && (other.ratio > 1.0) == (step.ratio > 1.0)
            });
            let [before, after] = [measured[step.at - 1], measured[step.at]];
            Change {
                from: json!(before.1),
                to: json!(last),
                ratio: Some(step.ratio),
                worse: step.ratio > 1.0,
                shared: self.is_shared(track, of, after.0, step.ratio),
                // A series that the newest run lacks has its change points from an earlier run.
                news: newest + 1 == self.runs.len() && !was_found,
                ..self.change(track, what, [before.0, after.0])
            }
        };
        steps.into_iter().map(change).collect()
    }

    /// Whether the series that ran with this one moved alike at a run, by at least half as much in the median. All are
    /// compared, not only those with a change point of their own: some are found a few runs later.
    fn is_shared(&self, track: usize, of: Noisy, run: usize, ratio: f64) -> bool {
        let setting = self.tracks[track].setting;
        let alike = self.tracks.iter().filter(|other| other.setting == setting);
        let shifts: Vec<f64> = alike.filter_map(|other| shift(&measured(other, of), run)).collect();
        // As shares of the own one: positive in the same direction.
        let usual = median(&shifts).map_or(0.0, |shift| shift / ratio.ln());
        shifts.len() > FEWEST && usual >= 0.5
    }

    /// The differences of exact quantities between neighbouring runs.
    fn differences(&self, track: usize) -> Vec<Change> {
        let mut found = vec![];
        for pair in self.tracks[track].points.windows(2) {
            let [(before, old), (after, new)] = [pair[0], pair[1]];
            for ((what, from), (_, to)) in exact(old).into_iter().zip(exact(new)) {
                if from == to {
                    continue; // nearly always
                }
                let ratio = from.as_f64().zip(to.as_f64()).map(|(from, to)| to / from);
                let worse = match what {
                    "status" => old.status.is_ok() && !new.status.is_ok(),
                    "topology" => old.topology == Some(true) && new.topology == Some(false),
                    "hausdorff" | "mean" => ratio.is_some_and(|ratio| ratio > 1.0 + LEAST_RISE),
                    _ => false, // other spheres or bytes are neither better nor worse
                };
                let news = after + 1 == self.runs.len();
                let change = self.change(track, what, [before, after]);
                found.push(Change { from, to, ratio, worse, news, ..change });
            }
        }
        found
    }

    /// A change of a track between two runs, of which nothing else is known yet.
    fn change(&self, track: usize, what: &'static str, [before, after]: [usize; 2]) -> Change {
        let first = self.tracks[track].points[0].1; // a track begins with its first point
        Change {
            run: after,
            series: format!("{} · {} · {}", first.mesh, first.method, first.level),
            what,
            from: Value::Null,
            to: Value::Null,
            ratio: None,
            last_before: self.runs[before].clone(),
            first_after: self.runs[after].clone(),
            worse: false,
            shared: false,
            news: false,
        }
    }
}

/// The logarithm by which values moved at a run: the median after it less that before it.
fn shift(measured: &[(usize, f64)], run: usize) -> Option<f64> {
    const AROUND: usize = 10;
    let (before, after) = measured.split_at(measured.partition_point(|(index, _)| *index < run));
    let near = [&before[before.len().saturating_sub(AROUND)..], &after[..after.len().min(AROUND)]];
    let [before, after] = near.map(|near| {
        let values: Vec<f64> = near.iter().map(|(_, value)| value.ln()).collect();
        median(&values).filter(|_| values.len() >= FEWEST)
    });
    Some(after? - before?)
}

/// The positive values of a quantity by run.
fn measured(track: &Track<'_>, of: Noisy) -> Vec<(usize, f64)> {
    let points = track.points.iter();
    points.filter_map(|&(run, p)| Some((run, of(p).filter(|value| *value > 0.0)?))).collect()
}
