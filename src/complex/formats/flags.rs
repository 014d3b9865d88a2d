//! Words after the values of a `.ma` record: types of features and marks of deletion.
//!
//! Known tools write different numbers of them, and the number determines their meaning:
//!
//! | record | 1 word | 2 words | 3 words |
//! |---|---|---|---|
//! | `v` | type | type, deleted | type, deleted, copies |
//! | `e` | type | type, deleted | type, deleted, copies |
//! | `f` | deleted | importance, deleted | importance, deleted, copies |
//!
//! So MATFP writes two words for a sphere and one for an edge, which is its *type*; MATTopo's
//! `.ma_dup`, whose header has four counts, writes three everywhere. Three words behind a face are
//! a colour in other files. Types and importances are kept as they are, since they mean different things in different
//! tools.

use super::error::MaErrorKind;
use super::records::KINDS;
use super::scan::shortened;

pub(super) const SPHERE: usize = 0;
pub(super) const EDGE: usize = 1;
pub(super) const FACE: usize = 2;

/// More words than this follow no record.
const MAX_WORDS: usize = 3;

/// The flags of all records read so far.
#[derive(Default)]
pub(super) struct Flags {
    /// Whether the header has a fourth count, that of tetrahedra.
    four_counts: bool,
    /// Whether the file is a list of spheres alone, behind which three words are usual.
    is_list: bool,
    /// Number of records by kind and by number of words behind their values.
    records: [[usize; MAX_WORDS + 1]; 3],
    /// For each kind, which records are marked as deleted.
    deleted: [Vec<bool>; 3],
    /// For each kind, the type or the importance of each record that has one.
    values: [Vec<Option<f64>>; 3],
    /// Spheres and edges of which the writer did not know whether they are deleted: kept.
    unknown: usize,
    /// Faces with three words under a header of three counts, and what the words say if they are
    /// flags: `None` where they can only be a colour.
    doubtful: Vec<(usize, Option<bool>)>,
}

impl Flags {
    /// No records yet, under a header with a fourth count or without, of a list of spheres or not.
    pub(super) fn of(four_counts: bool, is_list: bool) -> Self {
        Self { four_counts, is_list, ..Self::default() }
    }

    /// Whether lines of tetrahedra may follow.
    pub(super) fn four_counts(&self) -> bool {
        self.four_counts
    }

    /// Takes the words behind the values of the next record of a kind.
    pub(super) fn take<'a>(
        &mut self,
        kind: usize,
        words: impl Iterator<Item = &'a str>,
    ) -> Result<(), MaErrorKind> {
        let words: Vec<&str> = words.take(MAX_WORDS + 1).collect();
        let mut value = None;
        let deleted = match (kind, words.as_slice()) {
            (_, []) => false,
            (FACE, [word]) => zero_or_one(word).ok_or_else(|| {
                let found = shortened(word);
                let why = format!(
                    "a face has three spheres; the fourth word {found:?} is no mark of deletion \
                     (0 or 1)"
                );
                MaErrorKind::Malformed(why)
            })?,
            (FACE, [importance, deleted]) => {
                value = Some(number(importance)?);
                integer(deleted)? != 0.0
            }
            (FACE, &[first, deleted, copies]) => {
                let said = number(first).and_then(|_| integer(deleted)).ok();
                let said = said.filter(|_| integer(copies).is_ok());
                // Of a colour it means nothing; `settle` takes it back.
                value = said.and(number(first).ok());
                if self.four_counts {
                    said.ok_or_else(|| not_flags(&words))? != 0.0
                } else {
                    let said = said.filter(|&flag| flag == 0.0 || flag == 1.0);
                    self.doubtful.push((self.deleted[FACE].len(), said.map(|flag| flag != 0.0)));
                    false
                }
            }
            (_, [kind_of_feature]) => {
                value = Some(integer(kind_of_feature)?);
                false
            }
            (_, &[kind_of_feature, deleted, ..]) if words.len() <= MAX_WORDS => {
                value = Some(integer(kind_of_feature)?);
                words.get(2).map_or(Ok(0.0), |copies| integer(copies))?;
                // MATFP writes -1 where it does not know.
                let deleted = integer(deleted)?;
                self.unknown += usize::from(deleted < 0.0);
                deleted > 0.0
            }
            _ => return Err(not_flags(&words)),
        };
        self.records[kind][words.len()] += 1;
        self.deleted[kind].push(deleted);
        self.values[kind].push(value);
        Ok(())
    }

    /// Whether every record has the flags of a writer that counts edges and faces of its own lists
    /// instead of the lines (libmat): two behind spheres and edges, one behind faces.
    pub(super) fn counts_may_lie(&self) -> bool {
        let only = |kind: usize, words: usize| {
            let all: usize = self.records[kind].iter().sum();
            self.records[kind][words] == all
        };
        self.records[EDGE][2] > 0 && only(SPHERE, 2) && only(EDGE, 2) && only(FACE, 1)
    }

    /// Decides what three words behind a face are, once the spheres are known.
    pub(super) fn settle(&mut self, warnings: &mut Vec<String>) {
        self.warn(warnings);
        if self.doubtful.is_empty() {
            return;
        }
        let many = self.doubtful.len();
        let flagged_spheres = self.records[SPHERE][1..].iter().any(|&count| count > 0);
        let all_may_be_flags = self.doubtful.iter().all(|(_, said)| said.is_some());
        if flagged_spheres && all_may_be_flags {
            warnings.push(format!(
                "three words behind {many} faces: read as importance, deleted and copies, though \
                 they could be a colour"
            ));
            for &(face, said) in &self.doubtful {
                self.deleted[FACE][face] = said == Some(true);
            }
            return;
        }
        for &(face, _) in &self.doubtful {
            self.values[FACE][face] = None;
        }
        if flagged_spheres {
            warnings.push(format!(
                "three words behind {many} faces: read as a colour, though spheres have flags"
            ));
        }
    }

    fn warn(&self, warnings: &mut Vec<String>) {
        if self.unknown > 0 {
            let many = self.unknown;
            warnings.push(format!("{many} marks of deletion are negative, for unknown: kept"));
        }
        let mut say = |kind: usize, words: usize, read: &str| {
            let many = self.records[kind][words];
            if many > 0 {
                let (what, noun) = (KINDS[kind], if words == 1 { "word" } else { "words" });
                warnings.push(format!("{words} {noun} behind {many} {what}: read as {read}"));
            }
        };
        say(SPHERE, 1, "a type, though a mark of deletion usually follows it");
        say(FACE, 2, "importance and deleted");
        if !self.four_counts && !self.is_list {
            let read = "type, deleted and copies, though the header has three counts";
            say(SPHERE, 3, read);
            say(EDGE, 3, read);
        }
    }

    /// Number of records that have flags of any kind.
    pub(super) fn flagged(&self) -> usize {
        self.records.iter().flat_map(|records| &records[1..]).sum()
    }

    /// The types of spheres or edges, the importances of faces, for each record.
    pub(super) fn values(&self, kind: usize) -> &[Option<f64>] {
        &self.values[kind]
    }

    /// The records of a kind that are marked as deleted.
    pub(super) fn deleted(&self, kind: usize) -> &[bool] {
        &self.deleted[kind]
    }
}

fn number(word: &str) -> Result<f64, MaErrorKind> {
    let value = word.parse::<f64>().ok().filter(|value| value.is_finite());
    value.ok_or_else(|| MaErrorKind::Number { field: "flag", text: shortened(word) })
}

fn integer(word: &str) -> Result<f64, MaErrorKind> {
    let value = number(word)?;
    if value.fract() != 0.0 || value.abs() > f64::from(i32::MAX) {
        return Err(MaErrorKind::Malformed(format!("the flag {word} is not a whole number")));
    }
    Ok(value)
}

fn zero_or_one(word: &str) -> Option<bool> {
    match word {
        "0" => Some(false),
        "1" => Some(true),
        _ => None,
    }
}

fn not_flags(words: &[&str]) -> MaErrorKind {
    let found = shortened(&words.join(" "));
    MaErrorKind::Malformed(format!("{found:?} behind the values: flags of no known tool"))
}
