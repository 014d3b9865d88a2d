//! The first line of a `.ma` file: what it announces, and how the lines below it look.

use super::error::{MaError, MaErrorKind};
use super::options::Radii;
use super::scan::{Line, shortened};

/// How the lines of a file look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// Spheres, edges and faces, each line with its letter.
    Complex,
    /// A number of spheres alone, with a letter or without.
    Counted,
    /// A number of points alone, `x y z`.
    Points,
    /// Spheres alone, without a number: the first line is one.
    Bare,
}

/// What the first line says.
pub(super) struct Header {
    /// Spheres, edges, faces.
    pub(super) announced: [u64; 3],
    pub(super) layout: Layout,
    /// Whether there is a fourth count, of tetrahedra.
    pub(super) four_counts: bool,
}

/// Reads the first line.
pub(super) fn header(line: &Line<'_>, radii: Radii) -> Result<Header, MaError> {
    let list = |n, layout| Header { announced: [n, 0, 0], layout, four_counts: false };
    if line.words().next_word() == Some("v") {
        return Ok(list(0, Layout::Bare));
    }
    if let Some((announced, four_counts)) = counts(line) {
        return Ok(Header { announced, layout: Layout::Complex, four_counts });
    }
    let words: Vec<Option<u64>> = line.words().rest().map(|word| word.parse().ok()).collect();
    match *words.as_slice() {
        [Some(spheres)] | [Some(4), Some(spheres)] => Ok(list(spheres, Layout::Counted)),
        [Some(3), Some(points)] if radii == Radii::NotNeeded => Ok(list(points, Layout::Points)),
        [Some(3), Some(_)] => Err(line.error(MaErrorKind::NoRadii)),
        _ => {
            let found = shortened(line.text());
            let why = format!("expected three counts `nV nE nF` first, found {found:?}");
            Err(line.error(MaErrorKind::Malformed(why)))
        }
    }
}

/// The three counts of a line that is the header of a complex, and whether there is a fourth.
pub(super) fn counts(line: &Line<'_>) -> Option<([u64; 3], bool)> {
    let words = line.words().rest().map(|word| word.parse().ok());
    match *words.collect::<Option<Vec<u64>>>()?.as_slice() {
        [spheres, edges, faces] => Some(([spheres, edges, faces], false)),
        [spheres, edges, faces, _] => Some(([spheres, edges, faces], true)),
        _ => None,
    }
}
