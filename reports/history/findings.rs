//! What many nights tell: which series stepped at which night, and which results changed.
//!
//! A series is compared with itself alone, on one machine, under one set of conditions, on one content of its mesh: such
//! nights make a [`Track`]. Where one of these changes, another track begins; where the old one comes back (machines that
//! take turns), its track goes on.
//!
//! Seconds and memory are noisy: [`steps`](super::steps()) finds their steps, corrected for all series together. Counts,
//! errors, topology and the results themselves are exact: each difference from the night before is a [`Change`].
//!
//! A step of the seconds that most series make is that of the machine, or of what all share (the compiler, the allocator),
//! and not one of a method: [`Shared`].

use std::collections::{BTreeMap, BTreeSet};

use super::steps::{Step, StepOptions, median, steps};
use super::{Figures, History, Night, SeriesName};
use crate::record::Status;
use crate::text::significant;

/// Nights before and after a step over which other series are asked whether they moved alike.
const ASIDE: usize = 10;

/// Fewer nights than this on either side tell nothing of a series that is asked.
const LEAST_ASIDE: usize = 3;

/// Fewer rows than this cannot be most methods.
const LEAST_ROWS: usize = 3;

/// A step found one night later may lie this many nights beside where it lay before.
const SAME_STEP: usize = 3;

/// An error that rises by less than this share is a change, not one for the worse.
const LEAST_RISE: f64 = 1e-3;

/// A noisy figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// CPU seconds.
    Seconds,
    /// The most memory at one time.
    Memory,
}

impl Quantity {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Seconds, Self::Memory];

    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Memory => "memory",
        }
    }

    pub(super) fn of(self, figures: &Figures) -> Option<f64> {
        match self {
            Self::Seconds => figures.seconds,
            Self::Memory => figures.bytes.map(|bytes| bytes as f64),
        }
    }

    /// Other programs make seconds longer, but need none of our memory.
    fn spikes(self) -> f64 {
        match self {
            Self::Seconds => StepOptions::default().spikes,
            Self::Memory => 0.0,
        }
    }
}

/// Nights that may be compared: one machine, one set of conditions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// The machine.
    pub machine: String,
    /// The conditions.
    pub conditions: String,
    /// Indices of its nights.
    pub nights: Vec<usize>,
}

/// The nights of one series that are compared with each other.
#[derive(Clone, Debug)]
pub struct Track<'a> {
    /// The series.
    pub name: &'a SeriesName,
    /// Index of the group of its nights.
    pub group: usize,
    /// The nights and what they measured.
    pub nights: Vec<(usize, &'a Figures)>,
}

/// A step of a noisy figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundStep {
    /// Index of the track.
    pub track: usize,
    /// What stepped.
    pub quantity: Quantity,
    /// Index of the last night of the track before the step.
    pub before: usize,
    /// Index of the first night after it.
    pub night: usize,
    /// Its size.
    pub step: Step,
    /// Whether most series moved alike.
    pub shared: bool,
    /// Whether the newest night brought it to light: without that night it is not found.
    pub news: bool,
}

impl FoundStep {
    /// Whether it went up.
    pub fn is_worse(&self) -> bool {
        self.step.ratio > 1.0
    }
}

/// An exact figure that is another one than in the night before.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Which: `status`, `hausdorff`, `mean`, `spheres`, `topology`, `result`.
    pub what: &'static str,
    /// Before.
    pub from: String,
    /// After.
    pub to: String,
    /// After over before, of errors.
    pub ratio: Option<f64>,
    /// Whether it is for the worse: a result, the topology or a part of the accuracy was lost.
    pub worse: bool,
}

/// The exact figures of a series that changed from one night to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Index of the track.
    pub track: usize,
    /// Index of the track's night before.
    pub before: usize,
    /// Index of the night.
    pub night: usize,
    /// What changed, at least one thing.
    pub differences: Vec<Difference>,
}

impl Change {
    /// Whether anything is for the worse.
    pub fn is_worse(&self) -> bool {
        self.differences.iter().any(|difference| difference.worse)
    }
}

/// A night at which most series stepped alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shared {
    /// Index of the last night before.
    pub before: usize,
    /// Index of the night.
    pub night: usize,
    /// Seconds after over seconds before, median over all series.
    pub ratio: f64,
    /// How many series moved by half as much at least.
    pub moved: usize,
    /// Of how many.
    pub of: usize,
}

/// What a history tells.
#[derive(Debug, Default)]
pub struct Findings<'a> {
    /// The nights, the oldest first.
    pub nights: &'a [Night],
    /// Nights that may be compared, by the first night of each.
    pub groups: Vec<Group>,
    /// By series; of one series by group.
    pub tracks: Vec<Track<'a>>,
    /// The newest first; of one night the largest first.
    pub steps: Vec<FoundStep>,
    /// The newest first; of one night by track.
    pub changes: Vec<Change>,
    /// The newest first.
    pub shared: Vec<Shared>,
}

impl<'a> Findings<'a> {
    /// Looks through all series for steps of at least this size, a share.
    pub fn of(history: &'a History, least_size: f64) -> Self {
        let (groups, tracks) = tracks(&history.nights);
        let mut findings = Self { nights: &history.nights, groups, tracks, ..Self::default() };
        findings.find_steps(least_size);
        findings.find_changes();
        findings
    }

    /// Steps that the newest night brought to light, and its changes, as far as they are for the worse.
    pub fn regressions(&self) -> (Vec<&FoundStep>, Vec<&Change>) {
        let steps = self.steps.iter().filter(|s| s.news && s.is_worse() && !s.shared);
        let newest = self.nights.len().checked_sub(1);
        let changes = self.changes.iter().filter(|c| Some(c.night) == newest && c.is_worse());
        (steps.collect(), changes.collect())
    }

    /// The tracks by how much worse they are than they were at their best, the worst first.
    pub fn worst_first(&self) -> Vec<usize> {
        let mut order: Vec<(bool, f64, usize)> = (0..self.tracks.len())
            .map(|track| (self.lost(track), self.decline(track), track))
            .collect();
        order.sort_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
        order.into_iter().map(|(_, _, track)| track).collect()
    }

    /// The steps of a track's figure, the oldest first.
    pub fn steps_of(&self, track: usize, quantity: Quantity) -> Vec<&FoundStep> {
        let own = |step: &&FoundStep| step.track == track && step.quantity == quantity;
        let mut steps: Vec<&FoundStep> = self.steps.iter().filter(own).collect();
        steps.sort_by_key(|step| step.night);
        steps
    }

    /// Whether a track had a result or the right topology once, and has not now.
    pub(super) fn lost(&self, track: usize) -> bool {
        let nights = &self.tracks[track].nights;
        let Some((_, last)) = nights.last() else { return false };
        let right = |figures: &Figures| figures.topology == Some(true);
        let had = |of: &dyn Fn(&Figures) -> bool| nights.iter().any(|(_, figures)| of(figures));
        (had(&right) && !right(last))
            || (had(&|f| f.status.has_result()) && !last.status.has_result())
    }

    /// The largest of its present seconds, memory and error, over the least that they were between steps.
    fn decline(&self, track: usize) -> f64 {
        let noisy = Quantity::ALL.map(|quantity| {
            let (mut level, mut best) = (1.0_f64, 1.0_f64);
            for step in self.steps_of(track, quantity).into_iter().filter(|step| !step.shared) {
                level *= step.step.ratio;
                best = best.min(level);
            }
            level / best
        });
        let errors = self.tracks[track].nights.iter().filter_map(|(_, f)| f.hausdorff);
        let (mut last, mut best) = (1.0, f64::INFINITY);
        for error in errors {
            (last, best) = (error, f64::min(best, error));
        }
        let error = if best > 0.0 && best.is_finite() { last / best } else { 1.0 };
        noisy.into_iter().fold(error, f64::max)
    }

    fn find_steps(&mut self, least_size: f64) {
        let options = StepOptions { least_size, series: self.searched(), ..StepOptions::default() };
        for index in 0..self.tracks.len() {
            for quantity in Quantity::ALL {
                let found = self.steps_in(index, quantity, &options);
                self.steps.extend(found);
            }
        }
        let shared: Vec<Option<Shared>> = self.steps.iter().map(|step| self.share(step)).collect();
        for (step, shared) in self.steps.iter_mut().zip(&shared) {
            step.shared = shared.is_some();
        }
        self.steps.sort_by(|a, b| {
            let size = |step: &FoundStep| step.step.ratio.ln().abs();
            let by_size = size(b).total_cmp(&size(a));
            b.night
                .cmp(&a.night)
                .then(by_size)
                .then((a.track, a.quantity).cmp(&(b.track, b.quantity)))
        });
        let mut shared: Vec<Shared> = shared.into_iter().flatten().collect();
        shared.sort_by(|a, b| b.moved.cmp(&a.moved).then(b.night.cmp(&a.night)));
        for event in shared {
            let same = |known: &Shared| {
                known.night.abs_diff(event.night) <= SAME_STEP
                    && (known.ratio > 1.0) == (event.ratio > 1.0)
            };
            if !self.shared.iter().any(same) {
                self.shared.push(event);
            }
        }
        self.shared.sort_by_key(|event| std::cmp::Reverse(event.night));
    }

    /// How many sequences are looked through: what the level of the test is divided by.
    fn searched(&self) -> usize {
        let long = |quantity: Quantity| {
            let least = 2 * StepOptions::default().least_nights;
            let known = |track: &Track<'_>| {
                track.nights.iter().filter(|(_, f)| quantity.of(f).is_some()).count()
            };
            self.tracks.iter().filter(move |track| known(track) >= least).count()
        };
        Quantity::ALL.into_iter().map(long).sum()
    }

    fn steps_in(&self, index: usize, quantity: Quantity, options: &StepOptions) -> Vec<FoundStep> {
        let track = &self.tracks[index];
        let options = StepOptions { spikes: quantity.spikes(), ..*options };
        let known: Vec<(usize, f64)> =
            track.nights.iter().filter_map(|&(night, f)| Some((night, quantity.of(f)?))).collect();
        let values: Vec<f64> = known.iter().map(|(_, value)| *value).collect();
        let found = steps(&values, &options);
        let newest = known.last().is_some_and(|(night, _)| night + 1 == self.nights.len());
        let earlier = match newest && !found.is_empty() {
            true => steps(&values[..values.len() - 1], &options),
            false => found.clone(),
        };
        let was_known = |step: &Step| {
            earlier.iter().any(|other| {
                other.at.abs_diff(step.at) <= SAME_STEP && (other.ratio > 1.0) == (step.ratio > 1.0)
            })
        };
        let told = |step: Step| FoundStep {
            track: index,
            quantity,
            before: known[step.at - 1].0,
            night: known[step.at].0,
            step,
            shared: false,
            news: !was_known(&step),
        };
        found.into_iter().map(told).collect()
    }

    /// Whether most series moved like a step of the seconds, by half its size at least. Asked of all series, not of the steps
    /// found: of a slower machine the least noisy series tell first.
    fn share(&self, step: &FoundStep) -> Option<Shared> {
        if step.quantity != Quantity::Seconds {
            return None;
        }
        let size = step.step.ratio.ln();
        let group = self.tracks[step.track].group;
        let mut moves = Vec::new();
        let mut rows = BTreeSet::new();
        for track in self.tracks.iter().filter(|track| track.group == group) {
            if let Some(moved) = moved(track, step.night) {
                moves.push(moved);
                rows.insert(&track.name.row);
            }
        }
        let alike =
            moves.iter().filter(|&&moved| moved * size.signum() >= size.abs() / 2.0).count();
        let most = 2 * alike > moves.len() && rows.len() >= LEAST_ROWS;
        most.then(|| Shared {
            before: step.before,
            night: step.night,
            ratio: median(&moves).exp(),
            moved: alike,
            of: moves.len(),
        })
    }

    fn find_changes(&mut self) {
        for (index, track) in self.tracks.iter().enumerate() {
            for pair in track.nights.windows(2) {
                let [(before, old), (night, new)] = pair else { continue };
                let differences = differences(old, new);
                if !differences.is_empty() {
                    let (before, night) = (*before, *night);
                    self.changes.push(Change { track: index, before, night, differences });
                }
            }
        }
        self.changes.sort_by(|a, b| b.night.cmp(&a.night).then(a.track.cmp(&b.track)));
    }
}

/// The logarithm of a track's seconds around a night, after less before; `None` where it has too few nights.
fn moved(track: &Track<'_>, night: usize) -> Option<f64> {
    let known: Vec<(usize, f64)> = track
        .nights
        .iter()
        .filter_map(|&(night, figures)| Some((night, figures.seconds?.max(1e-9).ln())))
        .collect();
    let middle = known.partition_point(|(other, _)| *other < night);
    let before = &known[middle.saturating_sub(ASIDE)..middle];
    let after = &known[middle..known.len().min(middle + ASIDE)];
    let values = |nights: &[(usize, f64)]| nights.iter().map(|(_, v)| *v).collect::<Vec<f64>>();
    let enough = before.len().min(after.len()) >= LEAST_ASIDE;
    enough.then(|| median(&values(after)) - median(&values(before)))
}

/// A series, its group, and the content of its mesh.
type TrackKey<'a> = (&'a SeriesName, usize, Option<&'a String>);

/// Groups by their first night, and tracks by series and group.
fn tracks(nights: &[Night]) -> (Vec<Group>, Vec<Track<'_>>) {
    let mut groups: Vec<Group> = Vec::new();
    let mut tracks: BTreeMap<TrackKey<'_>, Vec<(usize, &Figures)>> = BTreeMap::new();
    for (index, night) in nights.iter().enumerate() {
        let same =
            |group: &Group| group.machine == night.machine && group.conditions == night.conditions;
        let group = groups.iter().position(same).unwrap_or_else(|| {
            let (machine, conditions) = (night.machine.clone(), night.conditions.clone());
            groups.push(Group { machine, conditions, nights: Vec::new() });
            groups.len() - 1
        });
        groups[group].nights.push(index);
        for (name, figures) in &night.series {
            let key = (name, group, night.meshes.get(&name.mesh));
            tracks.entry(key).or_default().push((index, figures));
        }
    }
    let tracks = tracks.into_iter().map(|((name, group, _), nights)| Track { name, group, nights });
    (groups, tracks.collect())
}

fn differences(old: &Figures, new: &Figures) -> Vec<Difference> {
    let mut found = Vec::new();
    let mut tell = |what, from: String, to: String, ratio: Option<f64>, worse| {
        if from != to {
            found.push(Difference { what, from, to, ratio, worse });
        }
    };
    let lost = old.status.has_result() && !new.status.has_result();
    let off = old.status == Status::Ok && new.status == Status::OtherCount;
    tell("status", old.status.to_string(), new.status.to_string(), None, lost || off);
    let topology = |right: Option<bool>| match right {
        Some(true) => "right".to_owned(),
        Some(false) => "wrong".to_owned(),
        None => "none".to_owned(),
    };
    let wrong = old.topology == Some(true) && new.topology == Some(false);
    tell("topology", topology(old.topology), topology(new.topology), None, wrong);
    for (what, from, to) in
        [("hausdorff", old.hausdorff, new.hausdorff), ("mean", old.mean, new.mean)]
    {
        let ratio = from.zip(to).filter(|(from, _)| *from > 0.0).map(|(from, to)| to / from);
        let from_nothing = from == Some(0.0) && to.is_some_and(|to| to > 0.0);
        let worse = from_nothing || ratio.is_some_and(|ratio| ratio > 1.0 + LEAST_RISE);
        let text = |error: Option<f64>| error.map_or("none".to_owned(), |e| significant(e, 6));
        tell(what, text(from), text(to), ratio, worse);
    }
    let count = |count: Option<u64>| count.map_or("none".to_owned(), |count| count.to_string());
    tell("spheres", count(old.spheres), count(new.spheres), None, false);
    let hash = |hash: &Option<String>| hash.clone().unwrap_or_else(|| "none".to_owned());
    tell("result", hash(&old.result), hash(&new.result), None, false);
    found
}
