//! Results of both sets: pairs of records, and their differences.
//!
//! The same input always gives the same result, so that any difference is one of the program and needs no statistics.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use medial_run::level::Target;
use medial_run::record::Record;
use medial_run::text::printable;
use serde_json::Value;

use super::{Change, ItemName, Meaning, Unlike};
use crate::comparison::{level_label, row_name};
use crate::metric::METRICS;

/// Paired and unpaired records of both sets.
pub(super) struct Pairs<'a> {
    /// Comparable ones, the older first.
    pub(super) both: Vec<Pair<'a>>,
    pub(super) missing: Vec<ItemName>,
    pub(super) added: Vec<ItemName>,
    pub(super) unlike: Vec<Unlike>,
}

/// Two records of the same result.
pub(super) struct Pair<'a> {
    pub(super) item: ItemName,
    pub(super) old: &'a Record,
    pub(super) new: &'a Record,
}

/// The request, which is the same in both sets: mesh, row, seed, level. Counts are from many to few, before other levels.
type Request<'a> = (&'a str, String, u64, (Reverse<usize>, String));

/// How it was run and measured, by name: has to agree.
pub(crate) type Settings = [(&'static str, String); 4];

type Arranged<'a> = BTreeMap<Request<'a>, BTreeMap<Settings, &'a Record>>;

impl<'a> Pairs<'a> {
    pub(super) fn new(old: &'a [Record], new: &'a [Record]) -> Self {
        let (old, mut new) = (arranged(old), arranged(new));
        let mut pairs = Self { both: vec![], missing: vec![], added: vec![], unlike: vec![] };
        for (request, old) in old {
            let new = new.remove(&request).unwrap_or_default();
            for (settings, old) in &old {
                let item = name(old);
                match (new.get(settings), new.first_key_value()) {
                    (Some(new), _) => match other_mesh(old, new) {
                        None => pairs.both.push(Pair { item, old, new }),
                        Some(why) => pairs.unlike.push(Unlike { item, why }),
                    },
                    // The newer set has this result under other settings alone: name the first difference found.
                    (None, Some((others, _))) => {
                        pairs.unlike.push(Unlike { item, why: differences(settings, others) });
                    }
                    (None, None) => pairs.missing.push(item),
                }
            }
        }
        let rest = new.into_values().flat_map(BTreeMap::into_values);
        pairs.added.extend(rest.map(name));
        pairs
    }
}

/// The last record of each result and settings.
fn arranged(records: &[Record]) -> Arranged<'_> {
    let mut arranged = Arranged::new();
    for record in records {
        let level = match record.simplify.level {
            Target::Spheres(count) => (Reverse(count), String::new()),
            level => (Reverse(0), level_label(level)),
        };
        let request = (record.mesh.as_str(), row_name(record), record.simplify.seed, level);
        arranged.entry(request).or_default().insert(settings(record), record);
    }
    arranged
}

fn name(record: &Record) -> ItemName {
    ItemName {
        mesh: printable(&record.mesh),
        method: printable(&row_name(record)),
        level: level_label(record.simplify.level),
    }
}

fn other_mesh(old: &Record, new: &Record) -> Option<String> {
    let (a, b) = (old.mesh_hash.as_deref()?, new.mesh_hash.as_deref()?);
    // Twelve digits name a content as surely as all 64.
    (a != b).then(|| format!("the mesh has other content: {b:.12}, {a:.12} before"))
}

pub(crate) fn settings(record: &Record) -> Settings {
    let conditions = record.conditions.clone();
    let threads = record.simplify.threads;
    [
        ("sampling", conditions.sampling),
        ("dual", conditions.dual),
        ("samples", conditions.samples.to_string()),
        ("threads", threads.map_or("unknown".to_owned(), |threads| threads.to_string())),
    ]
}

/// The first difference of the newer settings, in words.
fn differences(old: &Settings, new: &Settings) -> String {
    let differing = old.iter().zip(new).filter(|(old, new)| old != new);
    let lines = differing.map(|((what, old), (_, new))| format!("{what} {new}, {old} before"));
    lines.collect::<Vec<_>>().join("; ")
}

/// A larger increase of an error, as a share, is a regression.
const LARGER_ERROR: f64 = 0.005;

/// A larger increase of the peak of memory, as a share, is a regression.
const LARGER_MEMORY: f64 = 0.05;

/// Errors below this share of the diagonal are rounding.
const NEGLIGIBLE: f64 = 1e-9;

/// More memory than this is needed before a share of it counts, in bytes.
const LEAST_MEMORY: f64 = 1e6;

/// Key of the peak of memory.
pub(super) const MEMORY: &str = "simplify.peak_bytes";

/// Key of the number of spheres under an error bound, where it is the result.
const BOUNDED: &str = "simplify.spheres within the error";

/// Values of a result by key.
pub(crate) type Facts = BTreeMap<String, Value>;

/// The changes from one record to the other. Time linear in the length of the records.
pub(super) fn changes(pair: &Pair<'_>) -> Vec<Change> {
    let expected = [pair.old, pair.new].map(expected_betti);
    let mut changes = compare(&pair.item, [facts(pair.old), facts(pair.new)], expected);
    // With several threads memory is not quite the same each time: within its threshold it is not listed. That of a
    // program is sampled while it runs.
    let is_program = |record: &Record| record.conditions.fingerprint.is_some();
    let is_sampled = [pair.old, pair.new].into_iter().any(is_program);
    changes.retain(|change: &Change| {
        change.what != MEMORY || change.meaning != Meaning::Changed && !is_sampled
    });
    changes
}

/// The changes from the older to the newer facts of a result.
pub(crate) fn compare(
    item: &ItemName,
    [old, mut new]: [Facts; 2],
    expected: [Value; 2],
) -> Vec<Change> {
    let mut changes = vec![];
    let mut add = |what: String, old: Value, new: Value| {
        let relative = match (old.as_f64(), new.as_f64()) {
            (Some(old), Some(new)) if old != 0.0 => Some((new - old) / old.abs()),
            _ => None,
        };
        let meaning = meaning(&what, [&old, &new], &expected);
        changes.push(Change { item: item.clone(), what, old, new, relative, meaning });
    };
    for (what, old) in old {
        let new = new.remove(&what).unwrap_or(Value::Null);
        if old != new {
            add(what, old, new);
        }
    }
    let appeared = new.into_iter().filter(|(_, value)| !value.is_null());
    appeared.for_each(|(what, new)| add(what, Value::Null, new));
    changes
}

/// The direction of a quantity's change.
fn meaning(what: &str, [old, new]: [&Value; 2], expected: &[Value; 2]) -> Meaning {
    let key = what.strip_prefix("evaluate.").unwrap_or(what);
    let is_ok = |status: &Value| ["ok", "external"].iter().any(|ok| status == ok);
    match key {
        "status" => of_truth(is_ok(old), is_ok(new)),
        "betti" | "union.betti" => of_truth(*old == expected[0], *new == expected[1]),
        MEMORY => of_size(old, new, LARGER_MEMORY, LEAST_MEMORY),
        BOUNDED => of_size(old, new, 0.0, 0.5),
        key if METRICS.iter().any(|metric| metric.is_gate && metric.path == key) => {
            of_size(old, new, LARGER_ERROR, NEGLIGIBLE)
        }
        _ => Meaning::Changed,
    }
}

/// The Betti numbers of the solid; `false`, which equals none, where they are unknown.
pub(crate) fn expected_betti(record: &Record) -> Value {
    let expected = record.evaluate.as_ref().and_then(|evaluation| evaluation.expected_betti);
    expected.map_or(Value::Bool(false), |expected| Value::from(expected.to_vec()))
}

fn of_truth(before: bool, now: bool) -> Meaning {
    match (before, now) {
        (true, false) => Meaning::Regression,
        (false, true) => Meaning::Improvement,
        _ => Meaning::Changed,
    }
}

/// Of a quantity of which less is better: larger changes than a share of the older value, and than `least`.
fn of_size(old: &Value, new: &Value, share: f64, least: f64) -> Meaning {
    let (Some(old), Some(new)) = (old.as_f64(), new.as_f64()) else { return Meaning::Changed };
    let enough = (share * old.abs()).max(least);
    match new - old {
        more if more > enough => Meaning::Regression,
        more if more < -enough => Meaning::Improvement,
        _ => Meaning::Changed,
    }
}

/// The parts of a record that are compared, one by one: seconds differ from run to run and are left out.
const COMPARED: [&str; 12] = [
    "status",
    "result_hash",
    "simplify/reached",
    "simplify/native_level",
    "simplify/spheres",
    "simplify/edges",
    "simplify/faces",
    "simplify/peak_bytes",
    "simplify/warnings",
    "simplify/diagnostics",
    "evaluate",
    "initial",
];

/// The values of a record whose changes have a direction, and the hash of its result.
pub(crate) fn gates(record: &Record) -> Facts {
    let mut gates = facts(record);
    let compared = |key: &str| {
        let metric = key.strip_prefix("evaluate.").unwrap_or_default();
        ["status", "result_hash", "simplify.spheres", BOUNDED, MEMORY].contains(&key)
            || ["betti", "union.betti"].contains(&metric)
            || METRICS.iter().any(|known| known.is_gate && known.path == metric)
    };
    gates.retain(|key, value| compared(key) && !value.is_null());
    gates
}

/// Every compared number of a record, by key.
fn facts(record: &Record) -> Facts {
    let mut facts = Facts::new();
    // A record that was read from JSON can be written as such.
    let whole = serde_json::to_value(record).unwrap_or_default();
    for path in COMPARED {
        let value = whole.pointer(&format!("/{path}")).cloned().unwrap_or_default();
        take_apart(&path.replace('/', "."), value, &mut facts);
    }
    if matches!(record.simplify.level, Target::MaxError(_))
        && let Some(spheres) = facts.remove("simplify.spheres")
    {
        facts.insert(BOUNDED.to_owned(), spheres);
    }
    facts
}

/// Objects by their keys, lists of objects by their places; other lists are one value.
fn take_apart(key: &str, value: Value, facts: &mut Facts) {
    match value {
        Value::Object(map) => {
            for (field, value) in map {
                take_apart(&format!("{key}.{field}"), value, facts);
            }
        }
        Value::Array(list) if list.iter().any(Value::is_object) => {
            for (place, value) in list.into_iter().enumerate() {
                take_apart(&format!("{key}.{place}"), value, facts);
            }
        }
        value => {
            facts.insert(key.to_owned(), value);
        }
    }
}
