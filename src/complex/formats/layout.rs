//! The first line of a `.ma` file: what it announces, and how the lines below it look.

use super::error::{MaError, MaErrorKind};
use super::scan::{Line, shortened};

/// How the lines of a file look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// Spheres, edges and faces, each line with its letter.
    Complex,
    /// A number of spheres alone, with a letter or without.
    Counted,
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
pub(super) fn header(line: &Line<'_>) -> Result<Header, MaError> {
    if line.words().next_word() == Some("v") {
        return Ok(Header { announced: [0; 3], layout: Layout::Bare, four_counts: false });
    }
    let words: Vec<Option<u64>> = line.words().rest().map(|word| word.parse().ok()).collect();
    let complex =
        |counts, four_counts| Header { announced: counts, layout: Layout::Complex, four_counts };
    let counted = |n| Header { announced: [n, 0, 0], layout: Layout::Counted, four_counts: false };
    match *words.as_slice() {
        [Some(spheres), Some(edges), Some(faces)] => Ok(complex([spheres, edges, faces], false)),
        [Some(spheres), Some(edges), Some(faces), Some(_)] => {
            Ok(complex([spheres, edges, faces], true))
        }
        [Some(spheres)] | [Some(4), Some(spheres)] => Ok(counted(spheres)),
        [Some(3), Some(_)] => Err(line.error(MaErrorKind::NoRadii)),
        _ => {
            let found = shortened(line.text());
            let why = format!("expected three counts `nV nE nF` first, found {found:?}");
            Err(line.error(MaErrorKind::Malformed(why)))
        }
    }
}
