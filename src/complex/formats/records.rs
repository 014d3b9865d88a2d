//! The records of a `.ma` file: taken line by line, compared with what the header announces, rid of what is marked as
//! deleted.

use super::LoadedMa;
use super::annotations::{Annotations, InFile};
use super::canonical::{canonical, note};
use super::error::{MaError, MaErrorKind};
use super::flags::{EDGE, FACE, Flags, SPHERE};
use super::layout::{Header, Layout, header};
use super::options::ReadOptions;
use super::scan::{Line, shortened};
use super::trailer::RawPart;
use crate::complex::Sphere;

/// Bytes of the shortest possible line, `e 0 1`: bounds allocations by the size of the file.
const SHORTEST_RECORD: usize = 5;

pub(super) const KINDS: [&str; 3] = ["spheres", "edges", "faces"];

/// The records read so far, and the numbers still to come.
pub(super) struct Records {
    options: ReadOptions,
    pub(super) announced: [u64; 3],
    pub(super) layout: Layout,
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    tetrahedra: Vec<[u32; 4]>,
    normals: usize,
    flags: Flags,
    /// The first record of a kind beyond those announced.
    excess: [Option<MaError>; 3],
    /// The largest index so far and the error for it if there are not so many spheres, where the header is not trusted.
    largest: Option<(u32, MaError)>,
    /// What a trailer says.
    pub(super) parts: Vec<RawPart>,
}

impl Records {
    /// None yet, below the header `line` of a file of `bytes` bytes.
    pub(super) fn announced(
        line: &Line<'_>,
        bytes: usize,
        options: ReadOptions,
    ) -> Result<Self, MaError> {
        let Header { announced, layout, four_counts } = header(line, options.radii)?;
        let room = bytes / SHORTEST_RECORD;
        for (what, &announced) in KINDS.into_iter().zip(&announced) {
            if announced > u64::from(u32::MAX) || (announced > room as u64 && !options.lenient) {
                let kind = MaErrorKind::Announced { what, announced, bytes };
                return Err(line.error(kind));
            }
        }
        let [spheres, edges, faces] = announced.map(|count| room.min(count as usize));
        Ok(Self {
            options,
            announced,
            layout,
            spheres: Vec::with_capacity(spheres),
            edges: Vec::with_capacity(edges),
            faces: Vec::with_capacity(faces),
            tetrahedra: Vec::new(),
            normals: 0,
            flags: Flags::of(four_counts, layout != Layout::Complex),
            excess: [const { None }; 3],
            largest: None,
            parts: Vec::new(),
        })
    }

    /// Takes the next line.
    pub(super) fn take(&mut self, line: &Line<'_>) -> Result<(), MaError> {
        if self.layout != Layout::Complex {
            return self.take_of_list(line);
        }
        let mut words = line.words();
        let (kind, found) = match words.next_word() {
            Some("v") => {
                self.spheres.push(words.sphere(self.options.radii)?);
                (SPHERE, self.spheres.len())
            }
            Some("e") => {
                let edge = self.indices(line, words.indices(self.room())?);
                self.edges.push(edge);
                (EDGE, self.edges.len())
            }
            Some("f") => {
                let face = self.indices(line, words.indices(self.room())?);
                self.faces.push(face);
                (FACE, self.faces.len())
            }
            Some("t") if self.flags.four_counts() => {
                let corners = self.indices(line, words.indices(self.room())?);
                if words.next_word().is_none_or(|deleted| deleted == "0") {
                    self.tetrahedra.push(corners);
                }
                return Ok(());
            }
            Some("n") => {
                self.normals += 1;
                return Ok(());
            }
            other => {
                let found = shortened(other.unwrap_or_default());
                return Err(line.error(MaErrorKind::Record(found)));
            }
        };
        self.flags.take(kind, words.rest()).map_err(|kind| line.error(kind))?;
        if found as u64 > self.announced[kind] && !self.options.lenient {
            let error = line.error(count_error(kind, self.announced[kind], found));
            // More spheres than announced would make every index doubtful.
            if kind == SPHERE {
                return Err(error);
            }
            self.excess[kind].get_or_insert(error);
        }
        Ok(())
    }

    /// Takes the next line of a list of spheres.
    fn take_of_list(&mut self, line: &Line<'_>) -> Result<(), MaError> {
        let mut words = line.words();
        if self.layout == Layout::Bare || line.text().starts_with('v') {
            let word = words.next_word().unwrap_or_default();
            if word != "v" {
                return Err(line.error(MaErrorKind::NoSphere(shortened(word))));
            }
        }
        self.spheres.push(match self.layout {
            Layout::Points => Sphere::new(words.point()?, 0.0),
            _ => words.sphere(self.options.radii)?,
        });
        self.flags.take(SPHERE, words.rest()).map_err(|kind| line.error(kind))?;
        let (announced, found) = (self.announced[SPHERE], self.spheres.len());
        let counted = self.layout != Layout::Bare && !self.options.lenient;
        if counted && found as u64 > announced {
            return Err(line.error(count_error(SPHERE, announced, found)));
        }
        Ok(())
    }

    /// How many spheres there are to name, as far as the header is trusted.
    fn room(&self) -> u64 {
        if self.options.lenient { u64::from(u32::MAX) } else { self.announced[SPHERE] }
    }

    /// Remembers where the largest index stands, until it is known how many spheres there are.
    fn indices<const N: usize>(&mut self, line: &Line<'_>, corners: [u32; N]) -> [u32; N] {
        let most = corners.into_iter().max().unwrap_or_default();
        if self.options.lenient && self.largest.as_ref().is_none_or(|(largest, _)| most > *largest)
        {
            let kind = MaErrorKind::Index { text: most.to_string(), spheres: 0 };
            self.largest = Some((most, line.error(kind)));
        }
        corners
    }

    /// Whether all that the header announces has been read.
    pub(super) fn are_complete(&self) -> bool {
        let found = self.found().map(|count| count as u64);
        self.layout == Layout::Complex && found == self.announced
    }

    fn found(&self) -> [usize; 3] {
        [self.spheres.len(), self.edges.len(), self.faces.len()]
    }

    /// The medial mesh of all records; `name` stands for the file in errors.
    pub(super) fn finish(mut self, name: &str) -> Result<LoadedMa, MaError> {
        let (mut notes, mut warnings) = (Vec::new(), Vec::new());
        self.check_counts(name, &mut notes, &mut warnings)?;
        self.flags.settle(&mut warnings);
        if self.flags.flagged() > 0 {
            let lines = self.flags.flagged();
            notes.push(format!("{lines} lines carry flags; marks of deletion were obeyed"));
        }
        note(&mut notes, self.normals, "normal", "normals", "not used");
        let Self { spheres, edges, faces, tetrahedra, flags, parts, options, .. } = self;
        note(&mut notes, tetrahedra.len(), "tetrahedron", "tetrahedra", "kept as data");
        note(
            &mut notes,
            parts.len(),
            "part of the structure",
            "parts of the structure",
            "kept as data",
        );
        // Most files have neither flags nor parts.
        let annotated = flags.flagged() > 0 || !parts.is_empty() || !tetrahedra.is_empty();
        let in_file = annotated.then(|| (edges.clone(), faces.clone()));
        let mut live = Live { spheres, edges, faces };
        let (renumbered, kept) = live.drop_deleted(&flags, &mut notes);
        let mut loaded = canonical(live.spheres, live.edges, live.faces, options.radii, notes)
            .map_err(|kind| MaError::of(name, kind))?;
        let annotations = in_file.map_or_else(Annotations::default, |(edges, faces)| {
            let records = InFile { renumbered, edges, faces, tetrahedra, parts };
            records.annotate(&loaded.mesh, &flags, &mut warnings)
        });
        loaded.warnings.splice(0..0, warnings);
        Ok(LoadedMa { kept, annotations, ..loaded })
    }

    fn check_counts(
        &mut self,
        name: &str,
        notes: &mut Vec<String>,
        warnings: &mut Vec<String>,
    ) -> Result<(), MaError> {
        let found = self.found();
        let spheres = found[SPHERE] as u64;
        if let Some((largest, mut error)) = self.largest.take()
            && u64::from(largest) >= spheres
        {
            error.kind = MaErrorKind::Index { text: largest.to_string(), spheres };
            return Err(error);
        }
        if self.layout != Layout::Complex {
            notes.push("a list of spheres without edges and faces".to_owned());
        }
        if self.layout == Layout::Bare {
            return Ok(());
        }
        // MATFP leaves out spheres that it has announced.
        if self.layout == Layout::Counted
            && self.flags.flagged() > 0
            && spheres < self.announced[SPHERE]
        {
            let left = self.announced[SPHERE] - spheres;
            notes.push(format!("the header announces {left} spheres more than the file holds"));
            return Ok(());
        }
        for kind in [SPHERE, EDGE, FACE] {
            let (announced, what, found) = (self.announced[kind], KINDS[kind], found[kind]);
            if found as u64 == announced {
                continue;
            }
            if kind != SPHERE && (self.flags.counts_may_lie() || self.normals > 0) {
                notes.push(format!(
                    "the header announces {announced} {what}, the file holds {found}: taken as \
                     they are, since writers of these flags count otherwise"
                ));
            } else if self.options.lenient {
                warnings.push(format!(
                    "the header announces {announced} {what}, the file holds {found}: taken as they are"
                ));
            } else {
                return Err(self.excess[kind]
                    .take()
                    .unwrap_or_else(|| MaError::of(name, count_error(kind, announced, found))));
            }
        }
        Ok(())
    }
}

/// What is not deleted.
struct Live {
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
}

impl Live {
    /// Drops what is marked as deleted and what uses it.
    ///
    /// The new place of each sphere (`u32::MAX` for dropped ones), and, where any were dropped, the old places of the
    /// others.
    fn drop_deleted(
        &mut self,
        flags: &Flags,
        notes: &mut Vec<String>,
    ) -> (Vec<u32>, Option<Vec<u32>>) {
        let dead = flags.deleted(SPHERE);
        drop_simplices(&mut self.edges, EDGE, flags, notes);
        drop_simplices(&mut self.faces, FACE, flags, notes);
        // Indices fit: the header's counts were checked against 32 bits.
        let kept: Vec<u32> = (0..dead.len() as u32).filter(|&v| !dead[v as usize]).collect();
        let number = dead.len() - kept.len();
        note(notes, number, "sphere", "spheres", "dropped: marked as deleted");
        let mut renumbered = vec![u32::MAX; dead.len()];
        for (new, &old) in kept.iter().enumerate() {
            renumbered[old as usize] = new as u32;
        }
        if number == 0 {
            return (renumbered, None);
        }
        self.spheres = kept.iter().map(|&v| self.spheres[v as usize]).collect();
        self.edges.iter_mut().flatten().for_each(|v| *v = renumbered[*v as usize]);
        self.faces.iter_mut().flatten().for_each(|v| *v = renumbered[*v as usize]);
        (renumbered, Some(kept))
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

fn count_error(kind: usize, announced: u64, found: usize) -> MaErrorKind {
    MaErrorKind::Count { what: KINDS[kind], announced, found: found as u64 }
}
