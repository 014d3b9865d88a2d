//! The `.ma` format in its dialects, and the `.obj` files with radii of the tools around Q-MAT.
//!
//! ```text
//! nV nE nF          numbers of spheres, edges, faces
//! v x y z r         nV times: centre and radius
//! e i j             nE times: indices of two spheres, from 0
//! f i j k           nF times: indices of three spheres
//! ```
//!
//! # Dialects
//! - Lists of spheres alone, by their first line: `n` or nothing before lines `v x y z r` (MATFP, Coverage Axis), `n` or
//!   `4 n` before lines `x y z r` (Point2Skeleton, MATTopo's `.sph`), `3 n` before lines `x y z`.
//! - A fourth count and lines `t a b c d` of tetrahedra (MATTopo's `.ma_dup`), lines `n x y z` of normals (SEG-MAT), a
//!   trailer of parts (MATStruct): checked, counted in a note, and not used.
//! - Several medial meshes in one file, since some tools open their file for appending ([`ReadOptions::block`]).
//! - Words after the values of a record: types of features and marks of deletion. Marked elements are dropped, with
//!   everything that uses them, and counted. The number of words determines their meaning:
//!
//! | record | 1 word | 2 words | 3 words |
//! |---|---|---|---|
//! | `v` | type | type, deleted | type, deleted, copies |
//! | `e` | type | type, deleted | type, deleted, copies |
//! | `f` | deleted | importance, deleted | importance, deleted, copies |
//!
//! So MATFP writes two words for a sphere and one for an edge, which is its *type*; MATTopo's `.ma_dup` writes three
//! everywhere. Three words behind a face are a colour in other files.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::io::{self, Write};
use std::str::SplitAsciiWhitespace;

use super::{LoadedMa, MaError, MaErrorKind, Radii, ReadOptions};
use crate::complex::{MedialMesh, Sphere};
use crate::{Vec3, quoted};

/// Reads a medial mesh from the text of a `.ma` file; `name` is the file in errors.
///
/// Empty lines, comments (`#`), carriage returns and any order of the lines are accepted. Edges and
/// faces may be in any order and orientation; missing sides of faces are added. Elements that a trailing flag
/// marks as deleted are dropped, with the edges and faces that use them. Of negative radii the absolute values are
/// taken. [`LoadedMa::notes`] and [`LoadedMa::warnings`] list the changes.
///
/// ```
/// use medial::complex::{ReadOptions, parse_ma};
///
/// let text = "3 0 1\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 0 1 2\n";
/// let loaded = parse_ma(text, "triangle.ma", ReadOptions::default())?;
/// assert_eq!(loaded.mesh.edges, [[0, 1], [0, 2], [1, 2]]);
/// assert_eq!(loaded.notes, ["3 edges were added: sides of faces that were not listed"]);
/// # Ok::<(), medial::complex::MaError>(())
/// ```
///
/// # Errors
/// When the header or a line is not as above, a number is not finite, an
/// index is out of range, trailing words are the flags of no known tool, the lines are not as
/// many as announced (but for edges and faces of a writer that is known to miscount them), a second medial mesh was
/// appended, or the file has no such block, unless the options allow it.
pub fn parse_ma(
    text: impl AsRef<[u8]>,
    name: &str,
    options: ReadOptions,
) -> Result<LoadedMa, MaError> {
    let bytes = text.as_ref();
    let mut rest = lines(bytes, name);
    let Some(first) = rest.next() else {
        let why = "the file is empty; expected a line `nV nE nF`".to_owned();
        return Err(MaError::of(name, MaErrorKind::Malformed(why)));
    };
    let mut records = Records::announced(&first, bytes.len(), options)?;
    if records.layout == Layout::Bare {
        if has_obj_elements(bytes) {
            return parse_obj(bytes, name, options);
        }
        records.take(&first)?;
    }
    let mut block = 1;
    while let Some(line) = rest.next() {
        let is_complete = records.layout == Layout::Complex
            && records.found().map(|count| count as u64) == records.announced;
        if is_complete && line.words().rest.count() == 1 && records.parts == 0 {
            records.parts = trailer(&line, &mut rest, records.announced)?;
        } else if is_complete && counts(&line).is_some() {
            match options.block {
                None => return Err(line.malformed(APPENDED)),
                Some(wanted) if wanted == block => break,
                Some(_) => {
                    block += 1;
                    records = Records::announced(&line, bytes.len(), options)?;
                }
            }
        } else {
            records.take(&line)?;
        }
    }
    match options.block {
        Some(wanted) if wanted != block => {
            let why = format!("there is no block {wanted}: the file holds {block}, counted from 1");
            Err(MaError::of(name, MaErrorKind::Malformed(why)))
        }
        _ => records.finish(name),
    }
}

/// Writes a medial mesh as `.ma`.
pub(super) fn write_ma(out: &mut dyn Write, mesh: &MedialMesh) -> io::Result<()> {
    writeln!(out, "{} {} {}", mesh.spheres.len(), mesh.edges.len(), mesh.faces.len())?;
    write_records(out, mesh, ["v ", "e ", "f "])
}

/// Writes a line for each sphere, edge and face, with a text before those of each kind.
pub(super) fn write_records(
    out: &mut dyn Write,
    mesh: &MedialMesh,
    [sphere, edge, face]: [&str; 3],
) -> io::Result<()> {
    for Sphere { centre: c, radius } in &mesh.spheres {
        writeln!(out, "{sphere}{:.16e} {:.16e} {:.16e} {radius:.16e}", c.x, c.y, c.z)?;
    }
    for [a, b] in &mesh.edges {
        writeln!(out, "{edge}{a} {b}")?;
    }
    for [a, b, c] in &mesh.faces {
        writeln!(out, "{face}{a} {b} {c}")?;
    }
    Ok(())
}

// Lines and words, with the place of each for error messages.

/// A line that holds something.
pub(super) struct Line<'a> {
    file: &'a str,
    number: usize,
    pub(super) text: Cow<'a, str>,
}

/// The lines of `bytes` that are neither empty nor comments (`#`), numbered from 1.
///
/// Bytes that are not UTF-8 become replacement characters: harmless in a comment, and refused
/// with their line number anywhere else.
pub(super) fn lines<'a>(bytes: &'a [u8], file: &'a str) -> impl Iterator<Item = Line<'a>> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    bytes.split(|&byte| byte == b'\n').enumerate().filter_map(move |(index, raw)| {
        let content = raw.split(|&byte| byte == b'#').next().unwrap_or(raw).trim_ascii();
        let line = Line { file, number: index + 1, text: String::from_utf8_lossy(content) };
        (!content.is_empty()).then_some(line)
    })
}

/// The texts of the comments before the first line of [`lines`].
pub(super) fn comments_above(bytes: &[u8]) -> Vec<String> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let raw = bytes.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
    let comments = raw.take_while(|line| line.is_empty() || line.starts_with(b"#"));
    let comments = comments.filter(|line| !line.is_empty());
    comments
        .map(|line| String::from_utf8_lossy(line).trim_start_matches('#').trim().to_owned())
        .collect()
}

impl Line<'_> {
    fn words(&self) -> Words<'_> {
        Words { line: self, rest: self.text.split_ascii_whitespace() }
    }

    pub(super) fn malformed(&self, why: impl Into<String>) -> MaError {
        let kind = MaErrorKind::Malformed(why.into());
        MaError { file: self.file.to_owned(), line: Some(self.number), kind }
    }
}

/// The words of one line, taken one by one.
struct Words<'a> {
    line: &'a Line<'a>,
    rest: SplitAsciiWhitespace<'a>,
}

impl<'a> Words<'a> {
    fn required(&mut self, field: &'static str) -> Result<&'a str, MaError> {
        self.rest.next().ok_or_else(|| self.line.malformed(format!("the {field} is missing")))
    }

    fn number(&mut self, field: &'static str) -> Result<f64, MaError> {
        let text = self.required(field)?;
        finite(text, field).map_err(|why| self.line.malformed(why))
    }

    fn point(&mut self) -> Result<Vec3, MaError> {
        let x = self.number("x coordinate")?;
        let y = self.number("y coordinate")?;
        let z = self.number("z coordinate")?;
        Ok(Vec3::new(x, y, z))
    }

    /// Centre and radius, which may be negative; radius 0 where there is none and none is needed.
    fn sphere(&mut self, radii: Radii) -> Result<Sphere, MaError> {
        let centre = self.point()?;
        if radii == Radii::NotNeeded && self.rest.clone().next().is_none() {
            return Ok(Sphere::new(centre, 0.0));
        }
        let radius = self.number("radius")?;
        if radii == Radii::NotNegative && radius < 0.0 {
            return Err(self.line.malformed(format!("the radius {radius} is negative")));
        }
        Ok(Sphere::new(centre, radius))
    }
}

pub(super) fn finite(text: &str, field: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("the {field} {} is not a finite number", quoted(text)))
}

/// The three counts of a line that is the header of a complex, and a fourth, of tetrahedra.
fn counts(line: &Line<'_>) -> Option<([u64; 3], Option<u64>)> {
    let words = line.words().rest.map(|word| word.parse().ok());
    match *words.collect::<Option<Vec<u64>>>()?.as_slice() {
        [spheres, edges, faces] => Some(([spheres, edges, faces], None)),
        [spheres, edges, faces, cells] => Some(([spheres, edges, faces], Some(cells))),
        _ => None,
    }
}

/// The number of parts in a trailer that starts with `first`, their number: each `id type m` with the indices of `m`
/// records, of faces for type 0, edges for 1 and 2, spheres for 3. Line breaks mean nothing in it.
///
/// `records` are the numbers of spheres, edges and faces.
fn trailer<'a>(
    first: &Line<'_>,
    rest: &mut impl Iterator<Item = Line<'a>>,
    records: [u64; 3],
) -> Result<u64, MaError> {
    let broken = || first.malformed(TRAILER);
    let parts: u64 = first.text.parse().map_err(|_| broken())?;
    let mut numbers: VecDeque<u64> = VecDeque::new();
    for _ in 0..parts {
        while (numbers.len() as u64) < numbers.get(2).map_or(3, |members| members.saturating_add(3))
        {
            let line = rest.next().ok_or_else(broken)?;
            for word in line.words().rest {
                numbers.push_back(word.parse().map_err(|_| broken())?);
            }
        }
        let members = numbers[2] as usize;
        let kind = match numbers[1] {
            0 => FACE,
            1 | 2 => EDGE,
            3 => SPHERE,
            _ => return Err(broken()),
        };
        if numbers.range(3..).take(members).any(|&index| index >= records[kind]) {
            return Err(broken());
        }
        numbers.drain(..3 + members);
    }
    // The rest of the line of the last index belongs to nothing.
    if numbers.is_empty() { Ok(parts) } else { Err(broken()) }
}

const SPHERE: usize = 0;
const EDGE: usize = 1;
const FACE: usize = 2;
const KINDS: [&str; 3] = ["spheres", "edges", "faces"];

/// Bytes of the shortest possible line, `e 0 1`: bounds allocations by the size of the file.
const SHORTEST_RECORD: usize = 5;

/// More words than this follow no record.
const MAX_WORDS: usize = 3;

/// The form of the lines of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layout {
    /// Spheres, edges and faces, each line with its letter.
    Complex,
    /// A number of spheres alone, with a letter or without.
    Counted,
    /// A number of points alone, `x y z`.
    Points,
    /// Spheres alone, without a number: the first line is one.
    Bare,
}

/// The records read so far, compared with the header.
struct Records {
    options: ReadOptions,
    layout: Layout,
    announced: [u64; 3],
    /// The fourth count of the header, of tetrahedra.
    announced_cells: Option<u64>,
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    cells: u64,
    /// Those that are not marked as deleted.
    tetrahedra: usize,
    normals: usize,
    parts: u64,
    /// For each kind, which records are marked as deleted.
    deleted: [Vec<bool>; 3],
    /// Number of records by kind and by number of words behind their values.
    words: [[usize; MAX_WORDS + 1]; 3],
    /// Marks of spheres and edges that leave open whether they are deleted: kept.
    unknown: usize,
    /// Faces with three words under a header of three counts, and their mark of deletion if the words are flags: `None`
    /// where they can only be a colour.
    doubtful: Vec<(usize, Option<bool>)>,
    /// The line of the first edge and face beyond those announced.
    excess: [Option<usize>; 3],
    /// The largest index so far and its line. The number of spheres is known only at the end.
    largest: Option<(u32, usize)>,
}

impl Records {
    /// None yet, below the header `line` of a file of `bytes` bytes.
    fn announced(line: &Line<'_>, bytes: usize, options: ReadOptions) -> Result<Self, MaError> {
        let numbers: Vec<Option<u64>> = line.words().rest.map(|word| word.parse().ok()).collect();
        let (announced, layout, announced_cells) = match (counts(line), numbers.as_slice()) {
            (Some((announced, cells)), _) => (announced, Layout::Complex, cells),
            _ if line.words().rest.next() == Some("v") => ([0; 3], Layout::Bare, None),
            (_, &[Some(n)] | &[Some(4), Some(n)]) => ([n, 0, 0], Layout::Counted, None),
            (_, &[Some(3), Some(n)]) if options.radii == Radii::NotNeeded => {
                ([n, 0, 0], Layout::Points, None)
            }
            (_, &[Some(3), Some(_)]) => return Err(line.malformed(NO_RADII)),
            _ => {
                let found = quoted(&line.text);
                let why = format!("expected three counts `nV nE nF` first, found {found}");
                return Err(line.malformed(why));
            }
        };
        let room = bytes / SHORTEST_RECORD;
        for (what, &announced) in KINDS.into_iter().zip(&announced) {
            if announced > u64::from(u32::MAX) || (announced > room as u64 && !options.lenient) {
                let file = format!("but the file is only {bytes} bytes long");
                return Err(
                    line.malformed(format!("the header announces {announced} {what}, {file}"))
                );
            }
        }
        let [spheres, edges, faces] = announced.map(|count| room.min(count as usize));
        Ok(Self {
            options,
            layout,
            announced,
            announced_cells,
            spheres: Vec::with_capacity(spheres),
            edges: Vec::with_capacity(edges),
            faces: Vec::with_capacity(faces),
            cells: 0,
            tetrahedra: 0,
            normals: 0,
            parts: 0,
            deleted: Default::default(),
            words: Default::default(),
            unknown: 0,
            doubtful: Vec::new(),
            excess: [None; 3],
            largest: None,
        })
    }

    fn found(&self) -> [usize; 3] {
        [self.spheres.len(), self.edges.len(), self.faces.len()]
    }

    /// Takes the next line.
    fn take(&mut self, line: &Line<'_>) -> Result<(), MaError> {
        let mut words = line.words();
        let is_list = self.layout != Layout::Complex;
        // Lists have their letter in every line or in none.
        let has_letter = !is_list || self.layout == Layout::Bare || line.text.starts_with('v');
        let letter = if has_letter { words.rest.next().unwrap_or_default() } else { "v" };
        let kind = match letter {
            "v" if self.layout == Layout::Points => {
                self.spheres.push(Sphere::new(words.point()?, 0.0));
                SPHERE
            }
            "v" => {
                self.spheres.push(words.sphere(self.options.radii)?);
                SPHERE
            }
            _ if is_list => {
                let found = quoted(letter);
                let why = format!("a list of spheres alone has lines `v x y z r`, found {found}");
                return Err(line.malformed(why));
            }
            "e" => {
                let edge = self.indices(&mut words)?;
                self.edges.push(edge);
                EDGE
            }
            "f" => {
                let face = self.indices(&mut words)?;
                self.faces.push(face);
                FACE
            }
            "t" if self.announced_cells.is_some() => {
                self.indices::<4>(&mut words)?;
                self.cells += 1;
                self.tetrahedra += usize::from(words.rest.next().is_none_or(|mark| mark == "0"));
                return Ok(());
            }
            "n" => {
                self.normals += 1;
                return Ok(());
            }
            _ => return Err(unknown_record(line, 'e', letter)),
        };
        let flags: Vec<&str> = words.rest.take(MAX_WORDS + 1).collect();
        let deleted = self.mark(kind, &flags).map_err(|why| line.malformed(why))?;
        self.words[kind][flags.len()] += 1;
        self.deleted[kind].push(deleted);
        let (announced, found) = (self.announced[kind], self.found()[kind] as u64);
        if found > announced && !self.options.lenient && self.layout != Layout::Bare {
            // More spheres than announced would make every index doubtful; of the others a known tool may write more.
            if kind == SPHERE {
                return Err(line.malformed(miscount(kind, announced, found)));
            }
            self.excess[kind].get_or_insert(line.number);
        }
        Ok(())
    }

    /// The next `N` words as indices, which are compared with the number of spheres at the end.
    fn indices<const N: usize>(&mut self, words: &mut Words<'_>) -> Result<[u32; N], MaError> {
        let mut indices = [0; N];
        for index in &mut indices {
            let text = words.required("index of a sphere")?;
            *index = text
                .parse()
                .map_err(|_| words.line.malformed(no_sphere(text, self.announced[SPHERE])))?;
            if self.largest.is_none_or(|(largest, _)| *index > largest) {
                self.largest = Some((*index, words.line.number));
            }
        }
        Ok(indices)
    }

    /// Whether the words behind the values of a record mark it as deleted.
    fn mark(&mut self, kind: usize, words: &[&str]) -> Result<bool, String> {
        match (kind, words) {
            (_, []) => Ok(false),
            (FACE, ["0"]) => Ok(false),
            (FACE, ["1"]) => Ok(true),
            (FACE, [word]) => Err(format!(
                "a face has three spheres; the fourth word {} is no mark of deletion (0 or 1)",
                quoted(word)
            )),
            (FACE, [importance, deleted]) => {
                finite(importance, "flag")?;
                Ok(integer(deleted)? != 0.0)
            }
            (FACE, [first, deleted, copies]) => {
                let are_flags = finite(first, "flag").is_ok() && integer(copies).is_ok();
                let mark = integer(deleted).ok().filter(|_| are_flags);
                if self.announced_cells.is_some() {
                    return mark.map(|mark| mark != 0.0).ok_or_else(|| not_flags(words));
                }
                let mark = mark.filter(|&mark| mark == 0.0 || mark == 1.0);
                self.doubtful.push((self.deleted[FACE].len(), mark.map(|mark| mark != 0.0)));
                Ok(false)
            }
            (_, [feature]) => integer(feature).map(|_| false),
            (_, [feature, deleted, copies @ ..]) if copies.len() <= 1 => {
                for word in [feature].into_iter().chain(copies) {
                    integer(word)?;
                }
                // MATFP writes -1 where it does not know.
                let mark = integer(deleted)?;
                self.unknown += usize::from(mark < 0.0);
                Ok(mark > 0.0)
            }
            _ => Err(not_flags(words)),
        }
    }

    /// The medial mesh of all records; `name` is the file in errors.
    fn finish(mut self, name: &str) -> Result<LoadedMa, MaError> {
        let (mut notes, mut warnings) = (Vec::new(), Vec::new());
        self.check_counts(name, &mut notes, &mut warnings)?;
        let spheres = self.spheres.len() as u64;
        if let Some((largest, line)) = self.largest.filter(|&(i, _)| u64::from(i) >= spheres) {
            let kind = MaErrorKind::Malformed(no_sphere(&largest.to_string(), spheres));
            return Err(MaError { line: Some(line), ..MaError::of(name, kind) });
        }
        self.warn_of_doubts(&mut warnings);
        let flagged = self.flagged();
        if flagged > 0 {
            notes.push(format!("{flagged} lines carry flags; marks of deletion were obeyed"));
        }
        note(&mut notes, self.normals, "normal", "not used");
        note(&mut notes, self.tetrahedra, "tetrahedron", "not used");
        note(&mut notes, self.parts as usize, "part of the structure", "not used");
        self.drop_deleted(&mut notes);
        let loaded = canonical(self.spheres, self.edges, self.faces, self.options.radii, notes);
        let mut loaded = loaded.map_err(|kind| MaError::of(name, kind))?;
        loaded.warnings.splice(0..0, warnings);
        Ok(loaded)
    }

    /// Number of records that have flags of any kind.
    fn flagged(&self) -> usize {
        self.words.iter().flat_map(|records| &records[1..]).sum()
    }

    fn check_counts(
        &self,
        name: &str,
        notes: &mut Vec<String>,
        warnings: &mut Vec<String>,
    ) -> Result<(), MaError> {
        let found = self.found().map(|count| count as u64);
        if self.layout != Layout::Complex {
            notes.push("a list of spheres without edges and faces".to_owned());
        }
        // libmat counts edges and faces of internal lists instead of the lines; its flags identify its files.
        let with_its_flags = [self.words[SPHERE][2], self.words[EDGE][2], self.words[FACE][1]];
        let is_libmat = found[EDGE] > 0 && with_its_flags.map(|count| count as u64) == found;
        let miscounts = self.normals > 0 || is_libmat;
        for kind in [SPHERE, EDGE, FACE] {
            let (what, announced, found) = (KINDS[kind], self.announced[kind], found[kind]);
            if found == announced || self.layout == Layout::Bare {
                continue;
            }
            let differ = format!("the header announces {announced} {what}, the file holds {found}");
            if self.layout == Layout::Counted && self.flagged() > 0 && found < announced {
                // MATFP leaves out spheres that it has announced.
                let left = announced - found;
                notes.push(format!("the header announces {left} spheres more than the file holds"));
            } else if kind != SPHERE && miscounts {
                let why = "taken as they are, since writers of these flags count otherwise";
                notes.push(format!("{differ}: {why}"));
            } else if self.options.lenient {
                warnings.push(format!("{differ}: taken as they are"));
            } else {
                // At the first record too many the message counts up to it.
                let line = self.excess[kind];
                let found = if line.is_some() { announced + 1 } else { found };
                let kind = MaErrorKind::Malformed(miscount(kind, announced, found));
                return Err(MaError { line, ..MaError::of(name, kind) });
            }
        }
        if let Some(announced) = self.announced_cells.filter(|&count| count != self.cells) {
            let found = self.cells;
            let why =
                format!("the header announces {announced} tetrahedra, the file holds {found}");
            if !self.options.lenient {
                return Err(MaError::of(name, MaErrorKind::Malformed(why)));
            }
            warnings.push(format!("{why}: taken as they are"));
        }
        Ok(())
    }

    /// Warns of words that could be read in more than one way. Three words behind faces are flags if the spheres have
    /// flags and all of them can be.
    fn warn_of_doubts(&mut self, warnings: &mut Vec<String>) {
        if self.unknown > 0 {
            let many = self.unknown;
            warnings.push(format!("{many} marks of deletion are negative, for unknown: kept"));
        }
        let unusual = "type, deleted and copies, though the header has three counts";
        let is_complex = self.layout == Layout::Complex && self.announced_cells.is_none();
        for (kind, words, is_doubtful, read) in [
            (SPHERE, 1, true, "a type, though a mark of deletion usually follows it"),
            (FACE, 2, true, "importance and deleted"),
            (SPHERE, 3, is_complex, unusual),
            (EDGE, 3, is_complex, unusual),
        ] {
            let many = self.words[kind][words];
            if many > 0 && is_doubtful {
                let (what, noun) = (KINDS[kind], if words == 1 { "word" } else { "words" });
                warnings.push(format!("{words} {noun} behind {many} {what}: read as {read}"));
            }
        }
        let many = self.doubtful.len();
        if many == 0 || self.words[SPHERE][1..] == [0; MAX_WORDS] {
            return;
        }
        if self.doubtful.iter().all(|(_, mark)| mark.is_some()) {
            warnings.push(format!(
                "three words behind {many} faces: read as importance, deleted and copies, though \
                 they could be a colour"
            ));
            for &(face, mark) in &self.doubtful {
                self.deleted[FACE][face] = mark == Some(true);
            }
        } else {
            warnings.push(format!(
                "three words behind {many} faces: read as a colour, though spheres have flags"
            ));
        }
    }

    /// Drops marked elements and the edges and faces that use a dropped sphere.
    fn drop_deleted(&mut self, notes: &mut Vec<String>) {
        let [dead, dead_edges, dead_faces] = &self.deleted;
        drop_simplices(&mut self.edges, "edge", dead_edges, dead, notes);
        drop_simplices(&mut self.faces, "face", dead_faces, dead, notes);
        // Spheres before each one that stay; only those of spheres that stay are used.
        let mut kept = 0;
        let renumbered: Vec<u32> = dead
            .iter()
            .map(|&dead| {
                kept += u32::from(!dead);
                kept.wrapping_sub(1)
            })
            .collect();
        let dropped = dead.len() - kept as usize;
        note(notes, dropped, "sphere", "dropped: marked as deleted");
        if dropped > 0 {
            let mut dead = dead.iter();
            self.spheres.retain(|_| dead.next() != Some(&true));
            self.edges.iter_mut().flatten().for_each(|v| *v = renumbered[*v as usize]);
            self.faces.iter_mut().flatten().for_each(|v| *v = renumbered[*v as usize]);
        }
    }
}

fn drop_simplices<const N: usize>(
    simplices: &mut Vec<[u32; N]>,
    what: &str,
    marked: &[bool],
    dead: &[bool],
    notes: &mut Vec<String>,
) {
    let all = simplices.len();
    let mut marks = marked.iter();
    simplices.retain(|_| marks.next() != Some(&true));
    note(notes, all - simplices.len(), what, "dropped: marked as deleted");
    let all = simplices.len();
    simplices.retain(|simplex| !simplex.iter().any(|&v| dead[v as usize]));
    note(notes, all - simplices.len(), what, "dropped: on a deleted sphere");
}

fn integer(word: &str) -> Result<f64, String> {
    let value = finite(word, "flag")?;
    if value.fract() != 0.0 || value.abs() > f64::from(i32::MAX) {
        return Err(format!("the flag {} is not a whole number", quoted(word)));
    }
    Ok(value)
}

fn not_flags(words: &[&str]) -> String {
    format!("{} behind the values: flags of no known tool", quoted(&words.join(" ")))
}

/// The message of counts that differ. `found` stops at the first record too many.
fn miscount(kind: usize, announced: u64, found: u64) -> String {
    let bound = if found > announced { "at least" } else { "only" };
    let what = KINDS[kind];
    format!("the header announces {announced} {what}, the file holds {bound} {found}")
}

fn no_sphere(text: &str, spheres: u64) -> String {
    let text = quoted(text);
    format!("{text} is not one of the {spheres} spheres; indices start at 0")
}

/// The message of a line that is no `v`, no `f` and no record of `letter`, that of edges.
fn unknown_record(line: &Line<'_>, letter: char, word: &str) -> MaError {
    let found = quoted(word);
    line.malformed(format!("expected a line that starts with v, {letter} or f, found {found}"))
}

const NO_RADII: &str = "points without radii: `--radii surface` takes their distances to a surface";

const APPENDED: &str = "all records of the header come before this line: another medial mesh begins here, \
                        appended to the first; select one with `--block 1`, `--block 2` ...";

const TRAILER: &str = "expected the parts of the structure behind the last record: a number of them, \
                       and for each `id type m` with m indices";

/// Statements of OBJ that do not concern spheres, edges and faces.
const IGNORED: [&str; 11] =
    ["vn", "vt", "vp", "o", "g", "s", "p", "usemtl", "mtllib", "mg", "usemap"];

/// Whether a text has lines of edges or faces: they distinguish OBJ from a list of spheres.
fn has_obj_elements(bytes: &[u8]) -> bool {
    bytes.split(|&byte| byte == b'\n').any(|line| {
        matches!(line.trim_ascii_start(), [b'l' | b'f', next, ..] if next.is_ascii_whitespace())
    })
}

/// Reads a medial mesh from the text of an OBJ file: vertices `v x y z r`, lines `l i j ...`, triangles `f i j k`, with indices
/// from 1 or, if negative, back from the last vertex; `name` is the file in errors.
///
/// ```
/// use medial::complex::{ReadOptions, parse_obj};
///
/// let loaded = parse_obj("v 0 0 0 1\nv 1 0 0 0.5\nl 1 2\n", "x.obj", ReadOptions::default())?;
/// assert_eq!((loaded.mesh.spheres[1].radius, loaded.mesh.edges[0]), (0.5, [0, 1]));
/// # Ok::<(), medial::complex::MaError>(())
/// ```
///
/// # Errors
/// When a vertex has no fourth number and radii are needed, a face is no triangle, a line is not of this format, a
/// number is not finite, or an index is out of range.
pub fn parse_obj(
    text: impl AsRef<[u8]>,
    name: &str,
    options: ReadOptions,
) -> Result<LoadedMa, MaError> {
    let (mut spheres, mut edges, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for line in lines(text.as_ref(), name) {
        let mut words = line.words();
        match words.rest.next().unwrap_or_default() {
            "v" => spheres.push(match (words.rest.clone().count(), options.radii) {
                (4, radii) => words.sphere(radii)?,
                // Behind the coordinates there may be colours.
                (_, Radii::NotNeeded) => Sphere::new(words.point()?, 0.0),
                (3, _) => return Err(line.malformed(NO_RADII)),
                (numbers, _) => {
                    let why = "a vertex has 4 numbers, x y z and a radius";
                    return Err(line.malformed(format!("{why}; found {numbers}")));
                }
            }),
            "l" => {
                let corners = obj_indices(words, spheres.len())?;
                if corners.len() < 2 {
                    return Err(line.malformed("the index of a sphere is missing"));
                }
                edges.extend(corners.windows(2).map(|pair| [pair[0], pair[1]]));
            }
            "f" => match *obj_indices(words, spheres.len())? {
                [a, b, c] => faces.push([a, b, c]),
                ref corners => {
                    let found = corners.len();
                    let why = format!("faces must be triangles, found {found} corners");
                    return Err(line.malformed(why));
                }
            },
            word if IGNORED.contains(&word) => {}
            word => return Err(unknown_record(&line, 'l', word)),
        }
    }
    canonical(spheres, edges, faces, options.radii, Vec::new())
        .map_err(|kind| MaError::of(name, kind))
}

/// The vertices that a line names, out of those above it.
fn obj_indices(words: Words<'_>, vertices: usize) -> Result<Vec<u32>, MaError> {
    let mut indices = Vec::new();
    for word in words.rest {
        // Texture coordinates and normals follow a slash.
        let number = word.split('/').next().and_then(|text| text.parse::<i64>().ok());
        let from_zero = number.and_then(|number| match number {
            1.. => Some(number - 1),
            0 => None,
            _ => (vertices as i64).checked_add(number),
        });
        let index = from_zero.filter(|&index| index < vertices as i64);
        let Some(index) = index.and_then(|index| u32::try_from(index).ok()) else {
            let (found, why) = (quoted(word), "is not one of the");
            let why = format!("{found} {why} {vertices} vertices above, counted from 1");
            return Err(words.line.malformed(why));
        };
        indices.push(index);
    }
    Ok(indices)
}

/// A few spheres of radius 0 are a medial mesh of little use; at least this many are the vertices of a surface.
const FEWEST_OF_A_SURFACE: usize = 4;

/// Brings the simplices of a file to canonical form: indices ascend, lists are sorted, every
/// simplex is listed once, every side of a face is an edge. The set of points covered stays the same.
///
/// Precondition: indices are below the number of spheres, and numbers are finite.
///
/// # Errors
/// When radii are needed and all are 0.
pub(super) fn canonical(
    mut spheres: Vec<Sphere>,
    mut edges: Vec<[u32; 2]>,
    mut faces: Vec<[u32; 3]>,
    radii: Radii,
    mut notes: Vec<String>,
) -> Result<LoadedMa, MaErrorKind> {
    let all_are_points = spheres.iter().all(|sphere| sphere.radius == 0.0);
    if radii != Radii::NotNeeded && spheres.len() >= FEWEST_OF_A_SURFACE && all_are_points {
        return Err(MaErrorKind::Points);
    }
    // Some tools write negative radii for spheres outside of a surface.
    let negative = spheres.iter().filter(|sphere| sphere.radius < 0.0).count();
    spheres.iter_mut().for_each(|sphere| sphere.radius = sphere.radius.abs());
    let warnings = match negative {
        _ if radii == Radii::NotNeeded => Vec::new(),
        0 => Vec::new(),
        1 => vec!["1 radius is negative: its absolute value was taken".to_owned()],
        _ => vec![format!("{negative} radii are negative: their absolute values were taken")],
    };
    ascend(&mut edges, "edge", &mut notes);
    ascend(&mut faces, "face", &mut notes);
    // A face that names a sphere twice covers one edge: keep that, drop the face.
    let all = faces.len();
    faces.retain(|&[a, b, c]| {
        let is_proper = a != b && b != c;
        if !is_proper {
            edges.push([a, c]);
        }
        is_proper
    });
    let verb = "replaced by an edge: two corners are the same sphere";
    note(&mut notes, all - faces.len(), "face", verb);
    let all = edges.len();
    edges.retain(|[a, b]| a != b);
    note(&mut notes, all - edges.len(), "edge", "dropped: both ends are the same sphere");
    sort_once(&mut edges, "edge", &mut notes);
    sort_once(&mut faces, "face", &mut notes);
    let listed = edges.len();
    let sides = faces.iter().flat_map(|&[a, b, c]| [[a, b], [a, c], [b, c]]);
    edges.extend(sides);
    edges.sort_unstable();
    edges.dedup();
    let verb = "added: sides of faces that were not listed";
    note(&mut notes, edges.len() - listed, "edge", verb);
    let mesh = MedialMesh { spheres, edges, faces, contacts: None };
    debug_assert_eq!(mesh.check(), Ok(()));
    Ok(LoadedMa { mesh, notes, warnings })
}

/// Makes the indices of each simplex ascend, with a note for those who compare files.
fn ascend<const N: usize>(simplices: &mut [[u32; N]], what: &str, notes: &mut Vec<String>) {
    let descending = simplices.iter().filter(|simplex| !simplex.is_sorted()).count();
    note(notes, descending, what, "written with descending indices");
    if !simplices.is_sorted() {
        notes.push(format!("the {what}s were not in ascending order and were sorted"));
    }
    simplices.iter_mut().for_each(|simplex| simplex.sort_unstable());
}

fn sort_once<T: Ord>(simplices: &mut Vec<T>, what: &str, notes: &mut Vec<String>) {
    let all = simplices.len();
    simplices.sort_unstable();
    simplices.dedup();
    note(notes, all - simplices.len(), what, "listed more than once and merged");
}

/// Reports a change of a number of things, if there are any.
pub(super) fn note(notes: &mut Vec<String>, count: usize, one: &str, verb: &str) {
    match (count, one.split_once(' ')) {
        (0, _) => {}
        (1, _) => notes.push(format!("1 {one} was {verb}")),
        (_, Some((noun, rest))) => notes.push(format!("{count} {noun}s {rest} were {verb}")),
        (_, None) => {
            let many = one.strip_suffix("on").map_or(format!("{one}s"), |stem| format!("{stem}a"));
            notes.push(format!("{count} {many} were {verb}"));
        }
    }
}
