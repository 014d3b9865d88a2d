//! The `.ma` format.
//!
//! ```text
//! nV nE nF          numbers of spheres, edges, faces
//! v x y z r         nV times: centre and radius
//! e i j             nE times: indices of two spheres, from 0
//! f i j k           nF times: indices of three spheres
//! ```
//!
//! Tools of the field add types of features and marks of deletion at the end of a line, and a
//! fourth count with lines `t a b c d` of tetrahedra: `flags.rs` says which. What is marked as
//! deleted is dropped, with whatever uses it, and counted.

use std::io::{self, Write};

use super::canonical::{canonical, note};
use super::flags::{EDGE, FACE, Flags, SPHERE};
use super::scan::{Line, lines, shortened};
use super::{LoadedMa, MaError, MaErrorKind};
use crate::complex::{MedialMesh, Sphere};

/// Bytes of the shortest possible line, `e 0 1`: bounds allocations by the size of the file.
const SHORTEST_RECORD: usize = 5;

/// Reads a medial mesh from the text of a `.ma` file; `name` stands for the file in errors.
///
/// Empty lines, comments (`#`), carriage returns and any order of the lines are accepted. Edges and
/// faces may be in any order and orientation; missing sides of faces are added. What a trailing flag
/// marks as deleted is dropped, with the edges and faces that use it. [`LoadedMa::notes`] says what
/// was done.
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
/// index is out of range, trailing words are the flags of no known tool, or the lines are not as
/// many as announced (but for edges and faces of a writer that is known to miscount them).
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

/// The records read so far, and the numbers still to come.
struct Records {
    announced: [u64; 3],
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    tetrahedra: usize,
    flags: Flags,
    /// The first record of a kind beyond those announced.
    excess: [Option<MaError>; 3],
}

pub(super) const KINDS: [&str; 3] = ["spheres", "edges", "faces"];

impl Records {
    fn announced(header: &Line<'_>, bytes: usize) -> Result<Self, MaError> {
        let (announced, four_counts) = counts(header)?;
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
            tetrahedra: 0,
            flags: Flags::of(four_counts),
            excess: [const { None }; 3],
        })
    }

    fn take(&mut self, line: &Line<'_>) -> Result<(), MaError> {
        let spheres = self.announced[SPHERE];
        let mut words = line.words();
        let (kind, found) = match words.next_word() {
            Some("v") => {
                self.spheres.push(words.sphere()?);
                (SPHERE, self.spheres.len())
            }
            Some("e") => {
                self.edges.push(words.indices(spheres)?);
                (EDGE, self.edges.len())
            }
            Some("f") => {
                self.faces.push(words.indices(spheres)?);
                (FACE, self.faces.len())
            }
            Some("t") if self.flags.four_counts() => {
                words.indices::<4>(spheres)?;
                self.tetrahedra += 1;
                return Ok(());
            }
            other => {
                let found = shortened(other.unwrap_or_default());
                return Err(line.error(MaErrorKind::Record(found)));
            }
        };
        self.flags.take(kind, words.rest()).map_err(|kind| line.error(kind))?;
        if found as u64 > self.announced[kind] {
            let error = line.error(count_error(kind, self.announced[kind], found));
            if kind == SPHERE {
                return Err(error);
            }
            self.excess[kind].get_or_insert(error);
        }
        Ok(())
    }

    fn finish(mut self, name: &str) -> Result<LoadedMa, MaError> {
        let mut notes = Vec::new();
        self.check_counts(name, &mut notes)?;
        let mut warnings = Vec::new();
        self.flags.settle(&mut warnings);
        if self.flags.flagged() > 0 {
            let lines = self.flags.flagged();
            notes.push(format!("{lines} lines carry flags; marks of deletion were obeyed"));
        }
        note(&mut notes, self.tetrahedra, "tetrahedron", "tetrahedra", "not used");
        let kept = self.drop_deleted(&mut notes);
        let loaded = canonical(self.spheres, self.edges, self.faces, notes);
        Ok(LoadedMa { warnings, kept, ..loaded })
    }

    fn check_counts(&mut self, name: &str, notes: &mut Vec<String>) -> Result<(), MaError> {
        let found = [self.spheres.len(), self.edges.len(), self.faces.len()];
        for kind in [SPHERE, EDGE, FACE] {
            let announced = self.announced[kind];
            if found[kind] as u64 == announced {
                continue;
            }
            if kind != SPHERE && self.flags.counts_may_lie() {
                let (what, found) = (KINDS[kind], found[kind]);
                notes.push(format!(
                    "the header announces {announced} {what}, the file holds {found}: taken as \
                     they are, since writers of these flags count otherwise"
                ));
                continue;
            }
            return Err(self.excess[kind].take().unwrap_or_else(|| {
                let kind = count_error(kind, announced, found[kind]);
                MaError { file: name.to_owned(), line: None, kind }
            }));
        }
        Ok(())
    }

    /// Drops what is marked as deleted and what uses it; the places that the spheres left had in
    /// the file, where any were dropped.
    fn drop_deleted(&mut self, notes: &mut Vec<String>) -> Option<Vec<u32>> {
        let Self { spheres, edges, faces, flags, .. } = self;
        let dead = flags.deleted(SPHERE);
        drop_simplices(edges, EDGE, flags, notes);
        drop_simplices(faces, FACE, flags, notes);
        if !dead.contains(&true) {
            return None;
        }
        // Indices fit: the header's counts were checked against 32 bits.
        let kept: Vec<u32> = (0..dead.len() as u32).filter(|&v| !dead[v as usize]).collect();
        let number = dead.len() - kept.len();
        note(notes, number, "sphere", "spheres", "dropped: marked as deleted");
        let mut renumbered = vec![0; dead.len()];
        for (new, &old) in kept.iter().enumerate() {
            renumbered[old as usize] = new as u32;
        }
        *spheres = kept.iter().map(|&v| spheres[v as usize]).collect();
        edges.iter_mut().flatten().for_each(|v| *v = renumbered[*v as usize]);
        faces.iter_mut().flatten().for_each(|v| *v = renumbered[*v as usize]);
        Some(kept)
    }
}

fn drop_simplices<const N: usize>(
    simplices: &mut Vec<[u32; N]>,
    kind: usize,
    flags: &Flags,
    notes: &mut Vec<String>,
) {
    let [marked, dead] = [flags.deleted(kind), flags.deleted(SPHERE)];
    let (one, many) = (KINDS[kind].trim_end_matches('s'), KINDS[kind]);
    let number = marked.iter().filter(|&&deleted| deleted).count();
    note(notes, number, one, many, "dropped: marked as deleted");
    let mut marked = marked.iter();
    simplices.retain(|_| marked.next() != Some(&true));
    let all = simplices.len();
    simplices.retain(|simplex| !simplex.iter().any(|&v| dead[v as usize]));
    note(notes, all - simplices.len(), one, many, "dropped: on a deleted sphere");
}

/// The counts of the header, and whether there is a fourth one, of tetrahedra.
fn counts(header: &Line<'_>) -> Result<([u64; 3], bool), MaError> {
    let words: Vec<Option<u64>> = header.words().rest().map(|word| word.parse().ok()).collect();
    match *words.as_slice() {
        [Some(spheres), Some(edges), Some(faces)] => Ok(([spheres, edges, faces], false)),
        [Some(spheres), Some(edges), Some(faces), Some(_)] => Ok(([spheres, edges, faces], true)),
        _ => {
            let found = shortened(header.text());
            let why = format!("expected three counts `nV nE nF` first, found {found:?}");
            Err(header.error(MaErrorKind::Malformed(why)))
        }
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
