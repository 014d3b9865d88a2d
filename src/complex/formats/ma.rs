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
//!
//! Lists of spheres alone are read, too, by their first line: `n` or nothing before lines `v x y z r` (MATFP, Coverage
//! Axis), `n` or `4 n` before lines `x y z r` (Point2Skeleton, MATTopo's `.sph`). So are lines `n x y z` of normals
//! (SEG-MAT) and a trailer of parts (MATStruct), which are counted and not used.

use std::io::{self, Write};

use super::canonical::{canonical, note};
use super::flags::{EDGE, FACE, Flags, SPHERE};
use super::layout::{Header, Layout, header};
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
    if records.layout == Layout::Bare {
        records.take(&header)?;
    }
    while let Some(line) = rest.next() {
        if records.are_complete() && line.words().rest().count() == 1 {
            records.parts = parts(&line, &mut rest, &records)?;
            break;
        }
        records.take(&line)?;
    }
    records.finish(name)
}

/// The records read so far, and the numbers still to come.
struct Records {
    announced: [u64; 3],
    layout: Layout,
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    tetrahedra: usize,
    normals: usize,
    /// Parts of a trailer.
    parts: usize,
    flags: Flags,
    /// The first record of a kind beyond those announced.
    excess: [Option<MaError>; 3],
}

/// A few spheres of radius 0 are a medial mesh of little use; so many are the vertices of a surface.
const FEWEST_OF_A_SURFACE: usize = 4;

pub(super) const KINDS: [&str; 3] = ["spheres", "edges", "faces"];

impl Records {
    fn announced(line: &Line<'_>, bytes: usize) -> Result<Self, MaError> {
        let Header { announced, layout, four_counts } = header(line)?;
        for (what, &announced) in KINDS.into_iter().zip(&announced) {
            let room = bytes / SHORTEST_RECORD;
            if announced > room as u64 || announced > u64::from(u32::MAX) {
                let kind = MaErrorKind::Announced { what, announced, bytes };
                return Err(line.error(kind));
            }
        }
        Ok(Self {
            announced,
            layout,
            spheres: Vec::with_capacity(announced[0] as usize),
            edges: Vec::with_capacity(announced[1] as usize),
            faces: Vec::with_capacity(announced[2] as usize),
            tetrahedra: 0,
            normals: 0,
            parts: 0,
            flags: Flags::of(four_counts),
            excess: [const { None }; 3],
        })
    }

    fn take(&mut self, line: &Line<'_>) -> Result<(), MaError> {
        let spheres = self.announced[SPHERE];
        let mut words = line.words();
        if self.layout != Layout::Complex {
            if self.layout == Layout::Bare || line.text().starts_with('v') {
                let word = words.next_word().unwrap_or_default();
                if word != "v" {
                    return Err(line.error(MaErrorKind::NoSphere(shortened(word))));
                }
            }
            self.spheres.push(words.sphere()?);
            self.flags.take(SPHERE, words.rest()).map_err(|kind| line.error(kind))?;
            let found = self.spheres.len();
            if self.layout != Layout::Bare && found as u64 > spheres {
                return Err(line.error(count_error(SPHERE, spheres, found)));
            }
            return Ok(());
        }
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
            Some("n") => {
                self.normals += 1;
                return Ok(());
            }
            Some(word) if self.are_complete() && word.parse::<u64>().is_ok() => {
                return Err(line.error(MaErrorKind::Appended));
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

    /// Whether all that the header announces has been read.
    fn are_complete(&self) -> bool {
        let found = [self.spheres.len(), self.edges.len(), self.faces.len()];
        self.layout == Layout::Complex && found.map(|count| count as u64) == self.announced
    }

    fn finish(mut self, name: &str) -> Result<LoadedMa, MaError> {
        let mut notes = Vec::new();
        self.check_counts(name, &mut notes)?;
        let all_are_points = self.spheres.iter().all(|sphere| sphere.radius == 0.0);
        if self.spheres.len() >= FEWEST_OF_A_SURFACE && all_are_points {
            let file = name.to_owned();
            return Err(MaError { file, line: None, kind: MaErrorKind::Points });
        }
        let mut warnings = Vec::new();
        self.flags.settle(&mut warnings);
        if self.flags.flagged() > 0 {
            let lines = self.flags.flagged();
            notes.push(format!("{lines} lines carry flags; marks of deletion were obeyed"));
        }
        note(&mut notes, self.tetrahedra, "tetrahedron", "tetrahedra", "not used");
        note(&mut notes, self.normals, "normal", "normals", "not used");
        note(&mut notes, self.parts, "part of the structure", "parts of the structure", "not used");
        let kept = self.drop_deleted(&mut notes);
        let loaded = canonical(self.spheres, self.edges, self.faces, notes);
        Ok(LoadedMa { warnings, kept, ..loaded })
    }

    fn check_counts(&mut self, name: &str, notes: &mut Vec<String>) -> Result<(), MaError> {
        let found = [self.spheres.len(), self.edges.len(), self.faces.len()];
        if self.layout == Layout::Bare {
            notes.push("a list of spheres without edges and faces".to_owned());
            return Ok(());
        }
        if self.layout == Layout::Counted {
            // MATFP leaves out spheres that it has announced.
            let left = self.announced[SPHERE] - found[SPHERE] as u64;
            notes.push("a list of spheres without edges and faces".to_owned());
            if left > 0 && self.flags.flagged() > 0 {
                notes.push(format!("the header announces {left} spheres more than the file holds"));
                return Ok(());
            }
        }
        for kind in [SPHERE, EDGE, FACE] {
            let announced = self.announced[kind];
            if found[kind] as u64 == announced {
                continue;
            }
            if kind != SPHERE && (self.flags.counts_may_lie() || self.normals > 0) {
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

/// The number of parts of a trailer: each `id type m` with the indices of `m` records, of faces for type 0, edges for 1 and
/// 2, spheres for 3. Line breaks mean nothing in it.
fn parts<'a>(
    first: &Line<'_>,
    rest: &mut impl Iterator<Item = Line<'a>>,
    records: &Records,
) -> Result<usize, MaError> {
    let broken = |line: &Line<'_>| line.error(MaErrorKind::Trailer);
    let number = |line: &Line<'_>, word: &str| word.parse::<u64>().map_err(|_| broken(line));
    let count = number(first, first.text())?;
    let mut words: Vec<u64> = Vec::new();
    for line in rest {
        for word in line.words().rest() {
            words.push(number(&line, word)?);
        }
    }
    let mut words = words.into_iter();
    for _ in 0..count {
        let (Some(_), Some(kind), Some(members)) = (words.next(), words.next(), words.next())
        else {
            return Err(broken(first));
        };
        let of = [FACE, EDGE, EDGE, SPHERE].get(kind as usize).ok_or_else(|| broken(first))?;
        for _ in 0..members {
            if words.next().is_none_or(|index| index >= records.announced[*of]) {
                return Err(broken(first));
            }
        }
    }
    // Each part took three words at least, so the count fits.
    if words.next().is_some() { Err(broken(first)) } else { Ok(count as usize) }
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
