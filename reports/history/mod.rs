//! The results of many runs: at which run and commits a series changed.
//!
//! A series is compared with itself alone, on one machine, under one set of conditions, on one content of its mesh: such
//! runs make a `Track`. Machines that take turns have a track each.
//!
//! - Seconds are noisy: [`change_points()`] finds their steps. A step that most series of the same runs make is that of the
//!   machine or of the compiler, and raises no alarm.
//! - All other values are compared with the run before, by the comparison and the thresholds of [`diff`](crate::diff).

mod change_points;
mod report;
mod run;

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use serde_json::json;

pub use change_points::{ChangePoint, change_points};
pub use run::{Point, Run, read_runs};

use crate::diff::results::compare;
use crate::diff::text::headline;
use crate::diff::{Change, ItemName, LEAST_SLOWDOWN, Meaning, items, meshes_of};
use crate::metric::median;

/// A change point that is found one run later may lie this many runs from its earlier place.
const SAME_PLACE: usize = 3;

/// Quantity of the change points.
const SECONDS: &str = "seconds";

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
pub struct DatedChange {
    /// Index of the first run after it.
    #[serde(skip)]
    pub run: usize,
    /// The change; of seconds from the last value before it to the newest one, its size from level to level.
    #[serde(flatten)]
    pub change: Change,
    /// The last run of the track before it.
    pub last_before: RunName,
    /// The first run after it.
    pub first_after: RunName,
    /// Whether most series moved alike.
    pub shared: bool,
    /// Whether the newest run brought it to light.
    pub news: bool,
}

impl DatedChange {
    /// Whether it is a regression of the newest run.
    fn is_alarm(&self) -> bool {
        self.news && !self.shared && self.change.meaning == Meaning::Regression
    }
}

/// Change points and changed results of a history.
#[derive(Clone, Debug, Serialize)]
pub struct Findings<'a> {
    /// The runs, the oldest first.
    pub runs: Vec<RunName>,
    #[serde(skip)]
    tracks: Vec<Track<'a>>,
    /// Results that are worse in the newest run, and methods that are slower.
    pub regressions: usize,
    /// Results of the newest run with an earlier one to compare.
    pub compared: usize,
    /// The regressions in one sentence, if there are any.
    pub headline: Option<String>,
    /// Change points of seconds, the newest first.
    pub change_points: Vec<DatedChange>,
    /// Differences of other values, the newest first.
    pub changes: Vec<DatedChange>,
}

/// Fewest values on either side of a run that make a level.
const FEWEST: usize = 3;

impl<'a> Findings<'a> {
    /// Findings in runs, the oldest first.
    pub fn of(runs: &'a [Run]) -> Self {
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
            compared: 0,
            headline: None,
            change_points: vec![],
            changes: vec![],
        };
        let steps: Vec<_> = (0..findings.tracks.len()).map(|track| findings.steps(track)).collect();
        // Series of a method find one step some runs apart: it is news once.
        let earlier: Vec<_> = steps.iter().flat_map(|(_, earlier)| earlier.clone()).collect();
        findings.change_points = steps.into_iter().flat_map(|(steps, _)| steps).collect();
        for step in &mut findings.change_points {
            let is_known = |&(track, run, is_slower): &(usize, usize, bool)| {
                findings.tracks[track].points[0].1.method == step.change.item.method
                    && run.abs_diff(step.run) <= SAME_PLACE
                    && is_slower == (step.change.relative > Some(0.0))
            };
            step.news &= !earlier.iter().any(is_known);
        }
        findings.changes =
            (0..findings.tracks.len()).flat_map(|track| findings.differences(track)).collect();
        for changes in [&mut findings.change_points, &mut findings.changes] {
            // Stable: within a run the order of the series remains.
            changes.sort_by_key(|change| std::cmp::Reverse(change.run));
        }
        findings.summarise();
        findings
    }

    /// The regressions of the newest run: their number and a sentence.
    fn summarise(&mut self) {
        let newest = self.runs.len().wrapping_sub(1);
        let compared = self.tracks.iter().filter(|track| {
            track.points.len() > 1 && track.points.last().is_some_and(|(run, _)| *run == newest)
        });
        let compared: Vec<ItemName> = compared.map(|track| item(track.points[0].1)).collect();
        let alarms = |changes: &'_ [DatedChange]| -> Vec<Change> {
            let alarms = changes.iter().filter(|change| change.is_alarm());
            alarms.map(|alarm| alarm.change.clone()).collect()
        };
        let (worse, slower) = (alarms(&self.changes), alarms(&self.change_points));
        let methods: BTreeSet<&str> = slower.iter().map(|step| &*step.item.method).collect();
        self.regressions = items(worse.iter()).len() + methods.len();
        self.compared = compared.len();
        let slower = slower.iter().map(|step| {
            let ItemName { mesh, method, .. } = step.item.clone();
            (method, Some(mesh), 1.0 + step.relative.unwrap_or_default())
        });
        let worse: Vec<&Change> = worse.iter().collect();
        self.headline = headline(&worse, slower.collect(), &meshes_of(compared.iter()));
    }

    /// The regressions that the newest run brought to light.
    pub fn news(&self) -> impl Iterator<Item = &DatedChange> {
        self.change_points.iter().chain(&self.changes).filter(|change| change.is_alarm())
    }

    /// The change points of seconds, and those that were known before the newest run: track, run, and whether slower.
    fn steps(&self, track: usize) -> (Vec<DatedChange>, Vec<(usize, usize, bool)>) {
        let measured = measured(&self.tracks[track]);
        let values: Vec<f64> = measured.iter().map(|(_, value)| *value).collect();
        let Some((&(newest, last), before)) = measured.split_last() else {
            return (vec![], vec![]);
        };
        let is_newest = newest + 1 == self.runs.len();
        let known = if is_newest { before.len() } else { values.len() };
        let earlier = change_points(&values[..known], LEAST_SLOWDOWN);
        let earlier = earlier.iter().map(|step| (track, measured[step.at].0, step.ratio > 1.0));
        let change = |step: ChangePoint| {
            let [before, after] = [measured[step.at - 1], measured[step.at]];
            let change = Change {
                item: item(self.tracks[track].points[0].1),
                what: SECONDS.to_owned(),
                old: json!(before.1),
                new: json!(last),
                relative: Some(step.ratio - 1.0),
                meaning: match step.ratio > 1.0 {
                    true => Meaning::Regression,
                    false => Meaning::Improvement,
                },
            };
            DatedChange {
                shared: self.is_shared(track, after.0, step.ratio),
                // A series that the newest run lacks has its change points from an earlier run.
                news: is_newest,
                ..self.dated(change, [before.0, after.0])
            }
        };
        let steps = change_points(&values, LEAST_SLOWDOWN).into_iter().map(change).collect();
        (steps, earlier.collect())
    }

    /// Whether the series that ran with this one moved alike at a run, by at least half as much in the median. All are
    /// compared, not only those with a change point of their own: some are found a few runs later.
    fn is_shared(&self, track: usize, run: usize, ratio: f64) -> bool {
        let setting = self.tracks[track].setting;
        let alike = self.tracks.iter().filter(|other| other.setting == setting);
        let shifts: Vec<f64> = alike.filter_map(|other| shift(&measured(other), run)).collect();
        // As shares of the own one: positive in the same direction.
        let usual = median(&shifts).map_or(0.0, |shift| shift / ratio.ln());
        shifts.len() > FEWEST && usual >= 0.5
    }

    /// The differences of all values but seconds between neighbouring runs.
    fn differences(&self, track: usize) -> Vec<DatedChange> {
        let mut found = vec![];
        for pair in self.tracks[track].points.windows(2) {
            let [(before, old), (after, new)] = [pair[0], pair[1]];
            let expected = [old, new].map(|point| point.expected_betti.clone());
            let gates = [old, new].map(|point| point.gates.clone());
            let changes = compare(&item(new), gates, expected);
            found.extend(changes.into_iter().map(|change| DatedChange {
                news: after + 1 == self.runs.len(),
                ..self.dated(change, [before, after])
            }));
        }
        found
    }

    /// A change between two runs.
    fn dated(&self, change: Change, [before, after]: [usize; 2]) -> DatedChange {
        DatedChange {
            run: after,
            change,
            last_before: self.runs[before].clone(),
            first_after: self.runs[after].clone(),
            shared: false,
            news: false,
        }
    }
}

/// The name of a point's result.
fn item(point: &Point) -> ItemName {
    let Point { mesh, method, level, .. } = point.clone();
    ItemName { mesh, method, level }
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

/// The positive seconds by run.
fn measured(track: &Track<'_>) -> Vec<(usize, f64)> {
    let points = track.points.iter();
    points.filter_map(|&(run, p)| Some((run, p.seconds.filter(|value| *value > 0.0)?))).collect()
}
