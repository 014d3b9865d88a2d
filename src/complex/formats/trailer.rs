//! The parts of a medial mesh that MATStruct writes behind its last record.

use super::annotations::PartKind;
use super::error::{MaError, MaErrorKind};
use super::scan::Line;

/// One part, as it stands in the file.
pub(super) struct RawPart {
    pub(super) id: u64,
    pub(super) kind: PartKind,
    /// Indices of records of the file.
    pub(super) members: Vec<u64>,
}

/// The parts of a trailer that starts with `first`, their number: each `id type m` with the indices of `m` records, of faces for
/// type 0, edges for 1 and 2, spheres for 3. Line breaks mean nothing in it.
///
/// `records` are the numbers of spheres, edges and faces.
pub(super) fn parts<'a>(
    first: &Line<'_>,
    rest: &mut impl Iterator<Item = Line<'a>>,
    records: [u64; 3],
) -> Result<Vec<RawPart>, MaError> {
    let broken = || first.error(MaErrorKind::Trailer);
    let count: u64 = first.text().parse().map_err(|_| broken())?;
    let mut words = Words { rest, line: Vec::new() };
    let mut parts = Vec::new();
    for _ in 0..count {
        let mut word = || words.next()?.ok_or_else(broken);
        let (id, kind, members) = (word()?, word()?, word()?);
        let kind = PartKind::of(kind).ok_or_else(broken)?;
        let indices: Vec<u64> = (0..members).map(|_| word()).collect::<Result<_, _>>()?;
        if indices.iter().any(|&index| index >= records[kind.members()]) {
            return Err(broken());
        }
        parts.push(RawPart { id, kind, members: indices });
    }
    // What is left on the line of the last index belongs to nothing.
    if words.line.is_empty() { Ok(parts) } else { Err(broken()) }
}

/// The numbers of many lines, one after the other.
struct Words<'r, R> {
    rest: &'r mut R,
    /// What is left of the line, last first.
    line: Vec<u64>,
}

impl<'a, R: Iterator<Item = Line<'a>>> Words<'_, R> {
    fn next(&mut self) -> Result<Option<u64>, MaError> {
        while self.line.is_empty() {
            let Some(line) = self.rest.next() else { return Ok(None) };
            let number = |word: &str| word.parse().map_err(|_| line.error(MaErrorKind::Trailer));
            self.line = line.words().rest().map(number).collect::<Result<_, _>>()?;
            self.line.reverse();
        }
        Ok(self.line.pop())
    }
}
