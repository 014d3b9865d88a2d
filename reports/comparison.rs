//! Records arranged for comparison: which meshes, which methods, which levels, and what stands
//! where they meet.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use medial::simplifier::Level;

use crate::record::{Record, Status};
use crate::text::{grouped, printable};

/// Largest relative difference between the spheres reached and the spheres asked at which two
/// results still count as results at the same number of spheres. Methods that search on a level
/// of their own cannot hit every count.
const COUNT_TOLERANCE: f64 = 0.02;

/// Every record that counts, by mesh, series and level.
pub(crate) struct Comparison<'a> {
    /// Labels of the meshes, in the order of the records.
    pub(crate) meshes: Vec<String>,
    /// Labels of the series: a method with its parameters, in the order of the records.
    pub(crate) series: Vec<String>,
    /// Ids of the methods behind the series.
    pub(crate) methods: Vec<&'a str>,
    /// The levels that were asked: sphere counts from many to few, published, native.
    pub(crate) levels: Vec<Level>,
    /// One entry for each combination that was run, by mesh, level and series.
    pub(crate) entries: Vec<Entry<'a>>,
    /// Records that a later one of the same item replaced.
    pub(crate) superseded: usize,
    /// The keys behind [`Comparison::series`], in that order.
    keys: Vec<SeriesKey<'a>>,
}

/// One record and where it belongs: indices into the lists of [`Comparison`].
#[derive(Clone, Copy)]
pub(crate) struct Entry<'a> {
    pub(crate) mesh: usize,
    pub(crate) series: usize,
    pub(crate) level: usize,
    pub(crate) record: &'a Record,
}

impl Entry<'_> {
    /// Whether a measured result stands here.
    pub(crate) fn measured(&self) -> bool {
        measured(self.record)
    }

    /// Whether the result may be compared with others asked for the same number of spheres.
    pub(crate) fn comparable(&self) -> bool {
        match (self.record.simplify.level, reached(self.record)) {
            (Level::Spheres(asked), Some(reached)) if self.measured() => {
                reached.abs_diff(asked) as f64 <= COUNT_TOLERANCE * asked as f64
            }
            _ => false,
        }
    }
}

/// Whether a record holds a result and its measures.
pub(crate) fn measured(record: &Record) -> bool {
    record.status.is_ok() && record.evaluate.is_some()
}

/// The number of spheres of the result.
pub(crate) fn reached(record: &Record) -> Option<usize> {
    let simplify = &record.simplify;
    simplify
        .reached
        .or(simplify.spheres)
        .or_else(|| record.evaluate.as_ref().map(|evaluation| evaluation.counts.spheres as usize))
}

/// The level as it stands in a table: `100`, `published`, `level 0.3`.
pub(crate) fn level_label(level: Level) -> String {
    match level {
        Level::Spheres(count) => grouped(count as u64),
        Level::Published => "published".to_owned(),
        Level::Native(value) => format!("level {value}"),
    }
}

/// Sphere counts from many to few, then published, then native levels ascending.
fn compare_levels(a: Level, b: Level) -> Ordering {
    let rank = |level| match level {
        Level::Spheres(_) => 0,
        Level::Published => 1,
        Level::Native(_) => 2,
    };
    match (a, b) {
        (Level::Spheres(a), Level::Spheres(b)) => b.cmp(&a),
        (Level::Native(a), Level::Native(b)) => a.total_cmp(&b),
        _ => rank(a).cmp(&rank(b)),
    }
}

impl<'a> Comparison<'a> {
    /// Arranges records. Of several records of one item the last one counts.
    pub(crate) fn new(records: &'a [Record]) -> Self {
        let mesh_keys = first_seen(records.iter().map(MeshKey::of));
        let series_keys = first_seen(records.iter().map(SeriesKey::of));
        let mut levels: Vec<Level> = records.iter().map(|record| record.simplify.level).collect();
        levels.sort_by(|&a, &b| compare_levels(a, b));
        levels.dedup_by(|a, b| compare_levels(*a, *b).is_eq());

        let mut by_item = BTreeMap::new();
        for record in records {
            let mesh = mesh_keys.1[&MeshKey::of(record)];
            let series = series_keys.1[&SeriesKey::of(record)];
            let level = levels
                .iter()
                .position(|&level| compare_levels(level, record.simplify.level).is_eq())
                .unwrap_or_default();
            by_item.insert((mesh, level, series), record);
        }
        let entries: Vec<Entry<'a>> = by_item
            .iter()
            .map(|(&(mesh, level, series), &record)| Entry { mesh, series, level, record })
            .collect();
        Self {
            meshes: mesh_labels(&mesh_keys.0),
            series: series_labels(&series_keys.0),
            methods: series_keys.0.iter().map(|key| key.method).collect(),
            levels,
            superseded: records.len() - entries.len(),
            entries,
            keys: series_keys.0,
        }
    }

    /// The series that a record belongs to.
    pub(crate) fn series_of(&self, record: &Record) -> Option<usize> {
        let key = SeriesKey::of(record);
        self.keys.iter().position(|other| *other == key)
    }

    /// The entries of one mesh, by level and series.
    pub(crate) fn of_mesh(&self, mesh: usize) -> impl Iterator<Item = &Entry<'a>> {
        self.entries.iter().filter(move |entry| entry.mesh == mesh)
    }

    /// The sphere counts that were asked, with their level indices, from many to few.
    pub(crate) fn counts(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.levels.iter().enumerate().filter_map(|(index, level)| match level {
            Level::Spheres(count) => Some((index, *count)),
            _ => None,
        })
    }

    /// How many entries there are of each status that occurs.
    pub(crate) fn statuses(&self) -> Vec<(Status, usize)> {
        Status::ALL
            .into_iter()
            .map(|status| {
                (status, self.entries.iter().filter(|entry| entry.record.status == status).count())
            })
            .filter(|&(_, count)| count > 0)
            .collect()
    }

    /// Number of entries with a measured result.
    pub(crate) fn measured(&self) -> usize {
        self.entries.iter().filter(|entry| entry.measured()).count()
    }

    /// What the reader must know before trusting a comparison of these records.
    pub(crate) fn cautions(&self) -> Vec<String> {
        let distinct = |of: fn(&'a Record) -> &'a str| -> usize {
            let values: BTreeSet<&str> =
                self.entries.iter().map(|entry| of(entry.record)).collect();
            values.len()
        };
        let mut cautions = Vec::new();
        if self.superseded > 0 {
            cautions.push(format!(
                "{} earlier records of the same items were replaced by later ones.",
                self.superseded
            ));
        }
        let binaries = distinct(|record| &record.binary_hash);
        if binaries > 1 {
            cautions.push(format!("The results come from {binaries} different builds."));
        }
        let machines = distinct(|record| &record.machine.cpu);
        if machines > 1 {
            cautions.push(format!(
                "The results come from {machines} different processors: their seconds do not compare."
            ));
        }
        let unmeasured = self
            .entries
            .iter()
            .filter(|entry| entry.record.status.is_ok() && !entry.measured())
            .count();
        if unmeasured > 0 {
            cautions.push(format!("{unmeasured} results were never evaluated."));
        }
        cautions
    }
}

/// The distinct keys in the order of their first appearance, and the index of each.
fn first_seen<K: Ord + Clone>(keys: impl Iterator<Item = K>) -> (Vec<K>, BTreeMap<K, usize>) {
    let mut order = Vec::new();
    let mut index = BTreeMap::new();
    for key in keys {
        index.entry(key.clone()).or_insert_with(|| {
            order.push(key);
            order.len() - 1
        });
    }
    (order, index)
}

/// Meshes of one name and different contents are different meshes.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct MeshKey<'a> {
    name: &'a str,
    hash: Option<&'a str>,
}

impl<'a> MeshKey<'a> {
    fn of(record: &'a Record) -> Self {
        Self { name: &record.mesh, hash: record.mesh_hash.as_deref() }
    }
}

/// Names, with a piece of the hash where one name stands for several meshes.
fn mesh_labels(keys: &[MeshKey<'_>]) -> Vec<String> {
    let label = |key: &MeshKey<'_>| {
        let shared = keys.iter().filter(|other| other.name == key.name).count() > 1;
        let hash: String = key.hash.unwrap_or("no hash").chars().take(8).collect();
        printable(&if shared { format!("{} ({hash})", key.name) } else { key.name.to_owned() })
    };
    keys.iter().map(label).collect()
}

/// A method, its parameters in the order of their names, and its seed.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct SeriesKey<'a> {
    method: &'a str,
    params: String,
    seed: u64,
}

impl<'a> SeriesKey<'a> {
    fn of(record: &'a Record) -> Self {
        let params: BTreeMap<&String, String> =
            record.simplify.params.0.iter().map(|(key, value)| (key, value.to_string())).collect();
        let params: Vec<String> = params
            .iter()
            .map(|(key, value)| format!("{key}={}", value.trim_matches('"')))
            .collect();
        Self {
            method: &record.simplify.method,
            params: params.join(" "),
            seed: record.simplify.seed,
        }
    }
}

/// Method and parameters, and the seed where it makes a difference.
fn series_labels(keys: &[SeriesKey<'_>]) -> Vec<String> {
    let label = |key: &SeriesKey<'_>| {
        let mut label = key.method.to_owned();
        if !key.params.is_empty() {
            label.push(' ');
            label.push_str(&key.params);
        }
        let seeds = keys
            .iter()
            .filter(|other| (other.method, &other.params) == (key.method, &key.params))
            .count();
        if seeds > 1 {
            label.push_str(&format!(" seed {}", key.seed));
        }
        printable(&label)
    };
    keys.iter().map(label).collect()
}
