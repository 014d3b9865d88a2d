//! Two sets of records of one study, an older and a newer one: regressions, improvements and other changes.
//!
//! 1. **Pairs** (`results`): records of one mesh, row, level and seed, measured under the same settings. Records
//!    without a partner or with other settings are listed with the reason.
//! 2. **Deterministic values** (`results`): results, errors, counts, topology. Compared exactly; every change is
//!    listed, and is a regression if it is for the worse by more than its threshold.
//! 3. **Seconds** (`timing`): the same work takes other seconds each time. A slowdown in CPU seconds is reported as a
//!    regression only if its confidence interval lies beyond a threshold, and the repetitions agree.

pub(crate) mod results;
pub(crate) mod text;
mod timing;

use std::collections::{BTreeMap, BTreeSet};

use medial_run::record::Record;
use results::Pairs;
use serde::Serialize;
use serde_json::Value;

pub use timing::Timing;

/// A larger increase of CPU seconds, as a share, is a regression; of a method on a single mesh, twice as much.
pub(crate) const LEAST_SLOWDOWN: f64 = 0.05;

/// The direction of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Meaning {
    /// For the worse, beyond the threshold.
    Regression,
    /// For the better, beyond the threshold.
    Improvement,
    /// Neither.
    Changed,
}

/// One of the two sets of records.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Side {
    /// Name, such as its folder.
    pub name: String,
    /// Records that count.
    pub records: usize,
    /// Versions of the program.
    pub versions: BTreeSet<String>,
    /// SHA-256 of the programs.
    pub builds: BTreeSet<String>,
    /// Machines.
    pub machines: BTreeSet<String>,
}

/// A result by its names in tables.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct ItemName {
    /// The mesh.
    pub mesh: String,
    /// The method with its parameters, or its name.
    pub method: String,
    /// The requested level.
    pub level: String,
}

/// One changed quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// The result.
    #[serde(flatten)]
    pub item: ItemName,
    /// The quantity, by its key in the record.
    pub what: String,
    /// Its older value.
    pub old: Value,
    /// Its newer value.
    pub new: Value,
    /// The change as a fraction of the older value, for numbers.
    pub relative: Option<f64>,
    /// Its direction.
    pub meaning: Meaning,
}

/// Two records that cannot be compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unlike {
    /// The result.
    #[serde(flatten)]
    pub item: ItemName,
    /// The reason.
    pub why: String,
}

/// The difference of two sets of records.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diff {
    /// The older and the newer one.
    pub sides: [Side; 2],
    /// Whether repetition `k` of both sides ran in direct succession, so that they are compared in pairs.
    pub alternating: bool,
    /// Pairs that were compared.
    pub compared: usize,
    /// Number of meshes that each method was compared on.
    #[serde(skip)]
    meshes: BTreeMap<String, usize>,
    /// Results of the older set alone.
    pub missing: Vec<ItemName>,
    /// Results of the newer set alone.
    pub added: Vec<ItemName>,
    /// Results of both sets, under other conditions.
    pub unlike: Vec<Unlike>,
    /// Changes of deterministic values, and of memory beyond its threshold; those for the worse first.
    pub changes: Vec<Change>,
    /// Seconds.
    pub timings: Vec<Timing>,
    /// Why some or all seconds were not compared.
    pub untimed: Vec<String>,
}

impl Diff {
    /// Compares an older and a newer set of records, named as given. Of several records of one result the last one
    /// counts. The same records give the same difference. `alternating` is [`Diff::alternating`].
    pub fn new(names: [String; 2], old: &[Record], new: &[Record], alternating: bool) -> Self {
        let Pairs { both, missing, added, unlike } = Pairs::new(old, new);
        let mut changes: Vec<Change> = both.iter().flat_map(results::changes).collect();
        // Stable: within one meaning the order of the pairs remains.
        changes.sort_by_key(|change| change.meaning);
        let (timings, untimed) = timing::timings(&both, alternating);
        let [first, second] = names; // as given, older first
        Self {
            sides: [side(first, old), side(second, new)],
            alternating,
            compared: both.len(),
            meshes: meshes_of(both.iter().map(|pair| &pair.item)),
            missing,
            added,
            unlike,
            changes,
            timings,
            untimed,
        }
    }

    /// Number of results with a change of a meaning, and of methods with a timing of it.
    pub fn count(&self, meaning: Meaning) -> usize {
        let of = |change: &&Change| change.meaning == meaning;
        let timings = self.timings.iter().filter(|timing| timing.meaning == Some(meaning));
        let methods: BTreeSet<&str> = timings.map(|timing| timing.method.as_str()).collect();
        items(self.changes.iter().filter(of)).len() + methods.len()
    }
}

/// Number of meshes of each method.
pub(crate) fn meshes_of<'i>(items: impl Iterator<Item = &'i ItemName>) -> BTreeMap<String, usize> {
    let mut meshes: BTreeMap<String, BTreeSet<&str>> = BTreeMap::new();
    for item in items {
        meshes.entry(item.method.clone()).or_default().insert(&item.mesh);
    }
    meshes.into_iter().map(|(method, meshes)| (method, meshes.len())).collect()
}

/// The results of some changes, each once.
pub(crate) fn items<'c>(changes: impl Iterator<Item = &'c Change>) -> BTreeSet<&'c ItemName> {
    changes.map(|change| &change.item).collect()
}

fn side(name: String, records: &[Record]) -> Side {
    let [mut versions, mut builds, mut machines] = [const { BTreeSet::new() }; 3];
    for record in records {
        versions.insert(record.version.clone());
        builds.insert(record.binary_hash.clone()); // resumed stores hold several
        machines.insert(record.machine.to_string());
    }
    // Records of external results know no build.
    builds.remove("");
    versions.remove("");
    Side { name, records: records.len(), versions, builds, machines }
}
