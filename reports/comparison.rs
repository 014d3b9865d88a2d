//! Records arranged for comparison: meshes, methods, levels, and one entry for each combination that was run.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use medial_run::level::Target;
use medial_run::record::{Record, Status, is_near};
use medial_run::text::{counted, grouped, printable, trimmed};

use crate::metric::{
    CLAIMED_SECONDS, COMPARED, FROZEN_SECONDS, HAUSDORFF, Metric, TIME_SPREAD, own_metrics,
};

/// Every record that counts, by mesh, series and level.
pub(crate) struct Comparison<'a> {
    /// Labels of the meshes, in the order of the records.
    pub(crate) meshes: Vec<String>,
    /// Labels of the series: a method with its parameters, in the order of the records.
    pub(crate) series: Vec<String>,
    /// Ids of the methods behind the series; of external results their name.
    pub(crate) methods: Vec<&'a str>,
    /// The requested levels: sphere counts from many to few, published, native.
    pub(crate) levels: Vec<Target>,
    /// One entry for each combination that was run, by mesh, level and series. With several seeds its record is that of
    /// the median error.
    pub(crate) entries: Vec<Entry<'a>>,
    /// The records of entries with several seeds, by mesh, level and series.
    repeats: BTreeMap<(usize, usize, usize), Vec<&'a Record>>,
    /// Records that a later one of the same item replaced.
    pub(crate) superseded: usize,
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
    /// Whether the entry has a measured result.
    pub(crate) fn measured(&self) -> bool {
        self.record.status.has_result() && self.record.evaluate.is_some()
    }

    /// Whether the result may be compared with others at the same requested number of spheres.
    pub(crate) fn comparable(&self) -> bool {
        match (self.record.simplify.level, reached(self.record)) {
            (Target::Spheres(requested), Some(reached)) if self.measured() => {
                is_near(reached, requested)
            }
            _ => false,
        }
    }
}

/// The number of spheres of the result.
pub(crate) fn reached(record: &Record) -> Option<usize> {
    let simplify = &record.simplify;
    simplify
        .reached
        .or(simplify.spheres)
        .or_else(|| record.evaluate.as_ref().map(|evaluation| evaluation.counts.spheres as usize))
}

/// The level as tables show it: `100`, `published`, `level 0.3`.
pub(crate) fn level_label(level: Target) -> String {
    match level {
        Target::Spheres(count) => grouped(count as u64),
        Target::Published => "published".to_owned(),
        Target::Native(value) => format!("level {}", trimmed(value)),
        Target::MaxError(_) => level.to_string(),
    }
}

/// The row of a record: its name, or method and parameters.
pub(crate) fn row_name(record: &Record) -> String {
    SeriesKey::of(record).name()
}

/// Sphere counts from many to few, error bounds from large to small, published, native levels
/// ascending.
fn compare_levels(a: Target, b: Target) -> Ordering {
    // Numbers that fall along the order are negated.
    let [a, b] = [a, b].map(|level| match level {
        Target::Spheres(count) => (0, -(count as f64)),
        Target::MaxError(bound) => (1, -bound), // loose to tight, as counts get fewer
        Target::Published => (2, 0.0),
        Target::Native(value) => (3, value),
    });
    a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
}

impl<'a> Comparison<'a> {
    /// Arranges records. Of several records of one item the last one counts.
    pub(crate) fn new(records: &'a [Record]) -> Self {
        let hashes = Hashes::of(records);
        let latest = latest_records(records, &hashes);
        let superseded = records.len() - latest.len();
        let mesh_keys = first_seen(latest.iter().map(|record| hashes.key(record)));
        let series_keys = first_seen(latest.iter().copied().map(SeriesKey::of));
        let mut levels: Vec<Target> = latest.iter().map(|record| record.simplify.level).collect();
        levels.sort_by(|&a, &b| compare_levels(a, b));
        levels.dedup_by(|a, b| compare_levels(*a, *b).is_eq());

        let mut by_item: BTreeMap<_, Vec<&Record>> = BTreeMap::new();
        for record in latest {
            let mesh = mesh_keys.1[&hashes.key(record)];
            let series = series_keys.1[&SeriesKey::of(record)];
            let level = levels
                .partition_point(|&level| compare_levels(level, record.simplify.level).is_lt());
            by_item.entry((mesh, level, series)).or_default().push(record);
        }
        // The order of the map is that of the tables: by mesh, level and series.
        let entry = |(&(mesh, level, series), records): (&_, &Vec<&'a Record>)| Entry {
            mesh,
            series,
            level,
            record: median_seed(records),
        };
        let entries = by_item.iter().map(entry).collect();
        by_item.retain(|_, records| records.len() > 1);
        Self {
            meshes: mesh_labels(&mesh_keys.0),
            series: series_labels(&series_keys.0),
            methods: (series_keys.0.iter())
                .map(|key| key.variant.filter(|_| key.is_external).unwrap_or(key.method))
                .collect(),
            levels,
            superseded,
            entries,
            repeats: by_item,
        }
    }

    /// The records behind an entry: one for each seed.
    pub(crate) fn records_of<'e>(&'e self, entry: &'e Entry<'a>) -> &'e [&'a Record] {
        let repeats = self.repeats.get(&(entry.mesh, entry.level, entry.series));
        repeats.map_or(std::slice::from_ref(&entry.record), Vec::as_slice)
    }

    /// The least and largest value of a metric over the seeds of an entry; `None` with one seed.
    pub(crate) fn range(&self, entry: &Entry<'_>, metric: &Metric) -> Option<[f64; 2]> {
        let repeats = self.repeats.get(&(entry.mesh, entry.level, entry.series))?;
        let values: Vec<f64> = repeats.iter().filter_map(|record| metric.of(record)).collect();
        let ends = [f64::min, f64::max].map(|end| values.iter().copied().reduce(end));
        Some([ends[0]?, ends[1]?])
    }

    /// A sentence on the rows of several seeds; `None` without any.
    pub(crate) fn seeds_note(&self) -> Option<String> {
        let names = self
            .repeats
            .iter()
            .map(|((_, _, series), records)| (&self.series[*series], records.len()));
        let most = names.clone().map(|(_, seeds)| seeds).max()?;
        let names: BTreeSet<&String> = names.map(|(name, _)| name).collect();
        let names: Vec<&str> = names.into_iter().map(String::as_str).collect();
        Some(format!(
            "With {most} seeds: {}. Their numbers are those of the seed with the median Hausdorff error on each mesh, \
             a failure being infinite.",
            names.join(", ")
        ))
    }

    /// The entries of one mesh, by level and series.
    pub(crate) fn of_mesh(&self, mesh: usize) -> impl Iterator<Item = &Entry<'a>> {
        // They are sorted by mesh.
        let begin = self.entries.partition_point(|entry| entry.mesh < mesh);
        self.entries[begin..].iter().take_while(move |entry| entry.mesh == mesh)
    }

    /// The entries of one series at one level, by mesh.
    pub(crate) fn at(&self, series: usize, level: usize) -> Vec<&Entry<'a>> {
        let here = self.entries.iter().filter(|e| e.series == series && e.level == level);
        here.collect()
    }

    /// The requested sphere counts, with their level indices, from many to few.
    pub(crate) fn counts(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.levels.iter().enumerate().filter_map(|(index, level)| match level {
            Target::Spheres(count) => Some((index, *count)),
            _ => None,
        })
    }

    /// Number of entries with a measured result.
    pub(crate) fn measured(&self) -> usize {
        self.entries.iter().filter(|entry| entry.measured()).count()
    }

    /// The origin of the rows of an edition and of their seconds; `None` without such rows.
    pub(crate) fn edition_note(&self) -> Option<String> {
        let frozen = self.entries.iter().filter(|entry| entry.record.edition.is_some());
        let machines: BTreeSet<String> =
            frozen.clone().map(|entry| entry.record.machine.to_string()).collect();
        let machines: Vec<String> = machines.into_iter().collect();
        let name = frozen.clone().find_map(|entry| entry.record.edition.as_deref())?;
        let mut note = format!(
            "Rows marked ({name}) are frozen results of edition {name} and did not run here. Frozen time: their \
             seconds on {}, which are in no other column and no plot.",
            machines.join("; ")
        );
        if frozen.clone().any(|entry| entry.record.is_other_version) {
            note += " Other version: sources or compiler of the method have changed since, so its results here can differ.";
        }
        Some(note)
    }

    /// The columns of tables: [`COMPARED`], with the spread of repeated times, the seconds of an edition, claimed seconds and the
    /// metrics of the user if there are any.
    pub(crate) fn columns(&self) -> Vec<&'static Metric> {
        let has_any =
            |metric: &&Metric| self.entries.iter().any(|entry| metric.of(entry.record).is_some());
        let times = [&TIME_SPREAD, &FROZEN_SECONDS, &CLAIMED_SECONDS].into_iter().filter(has_any);
        COMPARED.into_iter().chain(times).chain(self.own_metrics()).collect()
    }

    /// The metrics of the user.
    pub(crate) fn own_metrics(&self) -> Vec<&'static Metric> {
        own_metrics(self.entries.iter().map(|entry| entry.record))
    }

    /// Warnings on comparing these records.
    pub(crate) fn cautions(&self) -> Vec<String> {
        // An edition is marked in each row.
        let records = || {
            self.entries.iter().map(|entry| entry.record).filter(|record| record.edition.is_none())
        };
        let mut cautions = Vec::new();
        if self.superseded > 0 {
            let records = counted(self.superseded, "earlier record was", "earlier records were");
            cautions.push(format!("{records} replaced by a later one of the same item."));
        }
        let builds: BTreeSet<&str> = records().map(|r| r.binary_hash.as_str()).collect();
        if builds.len() > 1 {
            cautions.push(format!("The results come from {} different builds.", builds.len()));
        }
        let processors: BTreeSet<&str> = records().map(|r| r.machine.cpu.as_str()).collect();
        if processors.len() > 1 {
            cautions.push(format!(
                "The results come from {} different processors: their seconds do not compare.",
                processors.len()
            ));
        }
        let has_result = |record: &&Record| record.status.has_result();
        let unmeasured = records().filter(|r| has_result(r) && r.evaluate.is_none()).count();
        if unmeasured > 0 {
            cautions.push(format!("{unmeasured} results were never evaluated."));
        }
        cautions.extend(remarks_of_meshes(records()));
        cautions
    }
}

/// What all results of a mesh are warned of, as of repairs of its surface, with the mesh; at most 20, and how many more.
pub fn remarks_of_meshes<'a>(records: impl IntoIterator<Item = &'a Record>) -> Vec<String> {
    let mut common: Vec<(&str, Vec<&str>)> = Vec::new();
    for record in records.into_iter().filter(|record| record.status.has_result()) {
        // Those of the evaluation are about each result.
        let own: Vec<&str> = record.simplify.warnings.iter().map(String::as_str).collect();
        match common.iter_mut().find(|(mesh, _)| *mesh == record.mesh) {
            Some((_, known)) => known.retain(|warning| own.contains(warning)),
            None => common.push((&record.mesh, own)),
        }
    }
    let mut remarks: Vec<String> = common
        .into_iter()
        .flat_map(|(mesh, warnings)| warnings.into_iter().map(move |w| format!("{mesh}: {w}")))
        .map(|remark| printable(&remark))
        .collect();
    let more = remarks.len().saturating_sub(MOST_REMARKS);
    if more > 0 {
        remarks.truncate(MOST_REMARKS);
        remarks.push(format!("{more} more remarks on meshes: column `warnings` of results.csv"));
    }
    remarks
}

/// Limit of the remarks on meshes.
const MOST_REMARKS: usize = 20;

/// The record of the median Hausdorff error, where one without a result is infinite; of an even number the larger one.
fn median_seed<'a>(records: &[&'a Record]) -> &'a Record {
    let mut sorted = records.to_vec();
    let error = |record: &Record| {
        let error = HAUSDORFF.of(record).filter(|_| record.status.has_result());
        error.unwrap_or(f64::INFINITY)
    };
    sorted.sort_by(|a, b| error(a).total_cmp(&error(b)));
    sorted[sorted.len() / 2]
}

/// The records that count: of one mesh, row, level and seed the last one, of any build. Records
/// of an older build stay where the newer one has none.
fn latest_records<'a>(records: &'a [Record], hashes: &Hashes<'a>) -> Vec<&'a Record> {
    let mut last = BTreeMap::new(); // by item, the index of its last record
    for (index, record) in records.iter().enumerate() {
        let level = serde_json::to_string(&record.simplify.level).unwrap_or_default();
        let seed = record.simplify.seed;
        last.insert((hashes.key(record), SeriesKey::of(record).request(), level, seed), index);
    }
    let counted: BTreeSet<usize> = last.into_values().collect();
    counted.into_iter().map(|index| &records[index]).collect()
}

/// The distinct keys in the order of their first appearance, and the index of each.
fn first_seen<K: Ord + Clone>(keys: impl Iterator<Item = K>) -> (Vec<K>, BTreeMap<K, usize>) {
    let mut order = Vec::new();
    let mut index = BTreeMap::new();
    for key in keys {
        index.entry(key.clone()).or_insert_with(|| {
            order.push(key); // the user's order, which no map keeps
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

/// The contents that meshes of one name have.
struct Hashes<'a>(BTreeMap<&'a str, BTreeSet<&'a str>>);

impl<'a> Hashes<'a> {
    fn of(records: &'a [Record]) -> Self {
        let mut hashes: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for record in records {
            hashes.entry(&record.mesh).or_default().extend(record.mesh_hash.as_deref());
        }
        Self(hashes)
    }

    /// The mesh of a record. A run that ended before its input was read has no hash: it belongs to
    /// the one mesh of its name, where there is just one.
    fn key(&self, record: &'a Record) -> MeshKey<'a> {
        let known = self.0.get(record.mesh.as_str()).filter(|known| known.len() == 1);
        let only = known.and_then(|known| known.first().copied());
        MeshKey { name: &record.mesh, hash: record.mesh_hash.as_deref().or(only) }
    }
}

/// Names, with a prefix of the hash where several meshes share one.
fn mesh_labels(keys: &[MeshKey<'_>]) -> Vec<String> {
    let mut labels = vec![];
    for key in keys {
        let shared = keys.iter().filter(|other| other.name == key.name).count() > 1;
        let hash = key.hash.unwrap_or("no hash");
        labels.push(printable(&match shared {
            true => format!("{} ({hash:.8})", key.name),
            false => key.name.to_owned(), // hashes are noise where names suffice
        }));
    }
    labels
}

/// The identity of a row: the method with its parameters, and the conditions of the run. Records of two builds, of
/// two samplings or of two accuracies of measuring are never in one mean.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct SeriesKey<'a> {
    method: &'a str,
    variant: Option<&'a str>,
    params: String,
    seed: u64,
    build: &'a str,
    plugin: Option<&'a str>,
    sampling: &'a str,
    dual: &'a str,
    samples: usize,
    threads: Option<usize>,
    edition: Option<&'a str>,
    is_other_version: bool,
    is_external: bool,
}

impl<'a> SeriesKey<'a> {
    fn of(record: &'a Record) -> Self {
        let simplify = &record.simplify;
        // By name: the order in which parameters were set makes no separate row.
        let params: BTreeMap<&String, String> =
            simplify.params.0.iter().map(|(key, value)| (key, value.to_string())).collect();
        let params: Vec<String> = (params.iter())
            .map(|(key, value)| format!("{key}={}", value.trim_matches('"')))
            .collect();
        let conditions = &record.conditions;
        // The files of one external method are one row for all paths and hashes.
        let is_external = record.status == Status::External;
        Self {
            method: &simplify.method,
            variant: simplify.variant.as_deref(),
            params: if is_external { String::new() } else { params.join(" ") },
            // Methods that run with several seeds are measured with one.
            seed: record.seeds.get("evaluation").copied().unwrap_or(simplify.seed),
            // A rebuild that changed no method gives the same rows.
            build: match record.method_version.as_str() {
                "" => &record.binary_hash,
                version => version,
            },
            plugin: conditions.fingerprint.as_deref().filter(|_| !is_external),
            sampling: &conditions.sampling,
            dual: &conditions.dual,
            samples: conditions.samples,
            threads: simplify.threads,
            edition: record.edition.as_deref(),
            is_other_version: record.is_other_version,
            is_external,
        }
    }

    /// The row as requested, without the build or plug-in that ran it.
    fn request(&self) -> Self {
        Self { build: "", plugin: None, ..self.clone() }
    }

    fn name(&self) -> String {
        let name = self.variant.map_or_else(|| self.method_and_params(), str::to_owned);
        let other = if self.is_other_version { ", other version" } else { "" };
        self.edition.map_or(name.clone(), |edition| format!("{name} ({edition}{other})"))
    }

    fn method_and_params(&self) -> String {
        format!("{} {}", self.method, self.params).trim_end().to_owned()
    }

    /// The conditions that distinguish rows of one name, in words.
    fn conditions(&self) -> [String; 8] {
        [
            self.method_and_params(),
            format!("seed {}", self.seed),
            format!("sampling {}", self.sampling),
            format!("dual {}", self.dual),
            format!("{} samples", self.samples),
            self.threads.map_or_else(String::new, |threads| format!("{threads} threads")),
            format!("build {:.8}", self.build),
            format!("plug-in {:.8}", self.plugin.unwrap_or("none")),
        ]
    }
}

/// The row's name, or method and parameters, and each condition in which rows of one name differ.
fn series_labels(keys: &[SeriesKey<'_>]) -> Vec<String> {
    let mut labels = vec![];
    for key in keys {
        let mut label = key.name();
        let namesakes: Vec<[String; 8]> =
            keys.iter().filter(|other| other.name() == label).map(SeriesKey::conditions).collect();
        for (index, condition) in key.conditions().into_iter().enumerate() {
            // A condition that all rows of the name share does not distinguish them.
            if namesakes.iter().any(|other| other[index] != condition) {
                label = label + ", " + &condition;
            }
        }
        labels.push(printable(&label));
    }
    labels
}
