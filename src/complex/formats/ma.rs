//! The `.ma` format.
//!
//! ```text
//! nV nE nF          numbers of spheres, edges, faces
//! v x y z r         nV times: centre and radius
//! e i j             nE times: indices of two spheres, from 0
//! f i j k           nF times: indices of three spheres
//! ```
//!
//! Tools of the field add feature and deletion flags at the end of a line; no two of them agree
//! on what these mean, so they are read over, and the reader says so.

use std::io::{self, Write};

use super::canonical::canonical;
use super::scan::{Line, lines, shortened};
use super::{LoadedMa, MaError, MaErrorKind};
use crate::complex::{MedialMesh, Sphere};

/// Bytes of the shortest possible line, `e 0 1`: what bounds an allocation by the file's size.
const SHORTEST_RECORD: usize = 5;

/// Reads a medial mesh from the text of a `.ma` file; `name` stands for the file in errors.
///
/// Empty lines, comments (`#`), trailing flags, carriage returns and any order of the lines are
/// accepted. Edges and faces may be in any order and orientation; missing sides of faces are
/// added, and [`LoadedMa::notes`] says what was done.
///
/// ```
/// let text = "3 0 1\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 0 1 2\n";
/// let loaded = medial::complex::parse_ma(text, "triangle.ma")?;
/// assert_eq!(loaded.mesh.edges, [[0, 1], [0, 2], [1, 2]]);
/// assert_eq!(loaded.notes, ["3 edges were added: sides of faces that were not listed"]);
/// # Ok::<(), medial::complex::MaError>(())
/// ```
///
/// # Errors
/// When the header or a line is not as above, a number is not finite, a radius is negative, an
/// index is out of range, or the lines are not as many as announced.
pub fn parse_ma(text: impl AsRef<[u8]>, name: &str) -> Result<LoadedMa, MaError> {
    let bytes = text.as_ref();
    let mut rest = lines(bytes, name);
    let header = rest.next().ok_or_else(|| MaError {
        file: name.to_owned(),
        line: None,
        kind: MaErrorKind::Malformed("the file is empty; expected a line `nV nE nF`".into()),
    })?;
    let mut records = Records::announced(&header, bytes.len())?;
    for line in rest {
        records.take(&line)?;
    }
    records.finish(name)
}

/// What has been read so far, and how much is to come.
struct Records {
    announced: [u64; 3],
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    flagged: usize,
    nonzero_last_flag: usize,
}

const KINDS: [&str; 3] = ["spheres", "edges", "faces"];

impl Records {
    fn announced(header: &Line<'_>, bytes: usize) -> Result<Self, MaError> {
        let mut words = header.words();
        let mut announced = [0; 3];
        for count in &mut announced {
            *count = words.next_word().and_then(|word| word.parse().ok()).ok_or_else(|| {
                let found = shortened(header.text());
                let why = format!("expected three counts `nV nE nF` first, found {found:?}");
                header.error(MaErrorKind::Malformed(why))
            })?;
        }
        for (what, &announced) in KINDS.into_iter().zip(&announced) {
            let room = bytes / SHORTEST_RECORD;
            if announced > room as u64 || announced > u64::from(u32::MAX) {
                let kind = MaErrorKind::Announced { what, announced, bytes };
                return Err(header.error(kind));
            }
        }
        Ok(Self {
            announced,
            spheres: Vec::with_capacity(announced[0] as usize),
            edges: Vec::with_capacity(announced[1] as usize),
            faces: Vec::with_capacity(announced[2] as usize),
            flagged: 0,
            nonzero_last_flag: 0,
        })
    }

    fn take(&mut self, line: &Line<'_>) -> Result<(), MaError> {
        let spheres = self.announced[0];
        let mut words = line.words();
        let (kind, found) = match words.next_word() {
            Some("v") => {
                self.spheres.push(words.sphere()?);
                (0, self.spheres.len())
            }
            Some("e") => {
                self.edges.push(words.indices(spheres)?);
                (1, self.edges.len())
            }
            Some("f") => {
                self.faces.push(words.indices(spheres)?);
                (2, self.faces.len())
            }
            other => {
                let found = shortened(other.unwrap_or_default());
                return Err(line.error(MaErrorKind::Record(found)));
            }
        };
        if let Some(last) = words.rest().last() {
            self.flagged += 1;
            self.nonzero_last_flag += usize::from(last.parse() != Ok(0.0));
        }
        if found as u64 > self.announced[kind] {
            return Err(line.error(count_error(kind, self.announced[kind], found)));
        }
        Ok(())
    }

    fn finish(self, name: &str) -> Result<LoadedMa, MaError> {
        let found = [self.spheres.len(), self.edges.len(), self.faces.len()];
        for kind in 0..KINDS.len() {
            if (found[kind] as u64) < self.announced[kind] {
                let kind = count_error(kind, self.announced[kind], found[kind]);
                return Err(MaError { file: name.to_owned(), line: None, kind });
            }
        }
        let mut notes = Vec::new();
        if self.flagged > 0 {
            notes.push(format!(
                "{} lines carry flags after their values, which were ignored; the last one is not \
                 zero on {} of them (some tools mark deleted elements so)",
                self.flagged, self.nonzero_last_flag
            ));
        }
        Ok(canonical(self.spheres, self.edges, self.faces, notes))
    }
}

fn count_error(kind: usize, announced: u64, found: usize) -> MaErrorKind {
    MaErrorKind::Count { what: KINDS[kind], announced, found: found as u64 }
}

/// Writes a medial mesh as `.ma`.
pub(super) fn write_to(out: &mut dyn Write, mesh: &MedialMesh) -> io::Result<()> {
    writeln!(out, "{} {} {}", mesh.spheres.len(), mesh.edges.len(), mesh.faces.len())?;
    for Sphere { centre: c, radius } in &mesh.spheres {
        writeln!(out, "v {:.16e} {:.16e} {:.16e} {radius:.16e}", c.x, c.y, c.z)?;
    }
    for [a, b] in &mesh.edges {
        writeln!(out, "e {a} {b}")?;
    }
    for [a, b, c] in &mesh.faces {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
