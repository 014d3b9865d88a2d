//! Which record of one set belongs to which of the other.

use std::collections::BTreeMap;

use crate::Target;

use super::{ItemName, Unlike};
use crate::comparison::{level_label, row_name};
use crate::record::Record;
use crate::text::printable;

/// Records of both sets, sorted out.
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

/// What was asked: the same in both sets.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Asked<'a> {
    mesh: &'a str,
    row: String,
    seed: u64,
    level: LevelKey,
}

/// A level with an order: counts from many to few, then the others.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
enum LevelKey {
    Spheres(std::cmp::Reverse<usize>),
    Other(String),
}

/// How it was run and measured: has to agree.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Settings<'a> {
    sampling: &'a str,
    dual: &'a str,
    samples: usize,
    threads: Option<usize>,
}

type Arranged<'a> = BTreeMap<Asked<'a>, BTreeMap<Settings<'a>, &'a Record>>;

impl<'a> Pairs<'a> {
    pub(super) fn new(old: &'a [Record], new: &'a [Record]) -> Self {
        let (old, mut new) = (arranged(old), arranged(new));
        let mut pairs = Self { both: vec![], missing: vec![], added: vec![], unlike: vec![] };
        for (asked, records) in old {
            pairs.sort_out(&records, &new.remove(&asked).unwrap_or_default());
        }
        let rest = new.into_values().flat_map(BTreeMap::into_values);
        pairs.added.extend(rest.map(name));
        pairs
    }

    /// Sorts out the records of one question.
    fn sort_out(
        &mut self,
        old: &BTreeMap<Settings<'a>, &'a Record>,
        new: &BTreeMap<Settings<'a>, &'a Record>,
    ) {
        for (settings, old) in old {
            let item = name(old);
            match (new.get(settings), new.first_key_value()) {
                (Some(new), _) => match other_mesh(old, new) {
                    None => self.both.push(Pair { item, old, new }),
                    Some(why) => self.unlike.push(Unlike { item, why }),
                },
                (None, Some((others, _))) => {
                    self.unlike.push(Unlike { item, why: settings.differences(others) });
                }
                (None, None) => self.missing.push(item),
            }
        }
    }
}

/// The records that count: of several of one question and one way of running the last one.
fn arranged(records: &[Record]) -> Arranged<'_> {
    let mut arranged = Arranged::new();
    for record in records {
        let asked = Asked {
            mesh: &record.mesh,
            row: row_name(record),
            seed: record.simplify.seed,
            level: match record.simplify.level {
                Target::Spheres(count) => LevelKey::Spheres(std::cmp::Reverse(count)),
                level => LevelKey::Other(level_label(level)),
            },
        };
        arranged.entry(asked).or_default().insert(Settings::of(record), record);
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
    let short = |hash: &str| -> String { hash.chars().take(12).collect() };
    (a != b).then(|| format!("the mesh has other content: {}, {} before", short(b), short(a)))
}

impl<'a> Settings<'a> {
    fn of(record: &'a Record) -> Self {
        let conditions = record.conditions.as_ref();
        Self {
            sampling: conditions.map_or("", |c| &c.sampling),
            dual: conditions.map_or("", |c| &c.dual),
            samples: conditions.map_or(0, |c| c.samples),
            threads: record.simplify.threads,
        }
    }

    /// In words, what another one has otherwise.
    fn differences(&self, other: &Self) -> String {
        let threads = |count: Option<usize>| count.map_or("unknown".to_owned(), |n| n.to_string());
        let all = [
            ("sampling", self.sampling.to_owned(), other.sampling.to_owned()),
            ("dual", self.dual.to_owned(), other.dual.to_owned()),
            ("samples", self.samples.to_string(), other.samples.to_string()),
            ("threads", threads(self.threads), threads(other.threads)),
        ];
        let told = all.iter().filter(|(_, old, new)| old != new);
        let told: Vec<String> =
            told.map(|(what, old, new)| format!("{what} {new}, {old} before")).collect();
        told.join("; ")
    }
}
