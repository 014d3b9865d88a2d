//! Hierarchies in files.
//!
//! All numbers are little-endian. A file is a header and five sections, each followed by the
//! CRC-32 (of ISO 3309, as in PNG) of its bytes, and nothing else:
//!
//! | part | bytes | content |
//! |---|---|---|
//! | header | 32 | signature `89 4d 41 48 0d 0a 1a 0a`, then as `u32`: version (1), bytes of the label, spheres, edges, faces, steps |
//! | label | as announced | UTF-8, for whoever wrote the file |
//! | spheres | 32 each | centre `x y z` and radius, `f64` |
//! | edges | 8 each | ascending pair of `u32`, from 0; the edges ascend |
//! | faces | 12 each | ascending triple of `u32`; the faces ascend |
//! | steps | 16 each | removed and kept sphere, `u32`, and the cost, `f64`, possibly infinite |
//!
//! Only the initial mesh and the record of the collapses are stored: 16 bytes for each removed
//! sphere. All that follows from them is derived when a file is read, so that it cannot contradict
//! them, and each step is checked to be the collapse of an edge.

use std::fmt;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use super::{Hierarchy, HierarchyError, Step};
use crate::Vec3;
use crate::atomic::write_atomically;
use crate::complex::{ComplexError, MedialMesh, Sphere};

/// Neither text nor cut by a transfer that takes it for text, as the signature of PNG.
const SIGNATURE: [u8; 8] = *b"\x89MAH\r\n\x1a\n";
const VERSION: u32 = 1;
const HEADER: usize = 32;
const CHECKSUM: usize = 4;

/// The sections: name, and bytes of one item.
const SECTIONS: [(&str, usize); 5] =
    [("label", 1), ("spheres", 32), ("edges", 8), ("faces", 12), ("steps", 16)];

/// Why a file does not hold a hierarchy: the file, the byte, the reason.
#[derive(Debug, thiserror::Error)]
pub struct HierarchyFileError {
    /// The file's name as it was given.
    pub file: String,
    /// Where the trouble is, in bytes from the start of the file.
    pub offset: u64,
    /// The reason.
    pub kind: HierarchyFileErrorKind,
}

impl fmt::Display for HierarchyFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind {
            HierarchyFileErrorKind::Io(_) => write!(f, "{}: {}", self.file, self.kind),
            _ => write!(f, "{}, byte {}: {}", self.file, self.offset, self.kind),
        }
    }
}

/// The defect, without the place.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HierarchyFileErrorKind {
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The file does not begin with the signature.
    #[error("this is no file of a hierarchy: its signature is missing")]
    Signature,
    /// The file has a later version.
    #[error("the file has version {0} of the format, and only version {VERSION} is known")]
    Version(u32),
    /// The file is shorter or longer than its header announces.
    #[error("the header announces {announced} bytes in all, the file has {found}")]
    Length {
        /// Bytes that the counts of the header add up to; those of the header alone where it is
        /// not complete.
        announced: u64,
        /// Bytes of the file.
        found: u64,
    },
    /// A part is not what was written.
    #[error("the {part} is damaged: its checksum does not match")]
    Checksum {
        /// `header`, or the name of a section.
        part: &'static str,
    },
    /// The label is not UTF-8.
    #[error("the label is not text")]
    Label,
    /// The initial mesh is not in canonical form.
    #[error("the initial mesh is not valid: {0}")]
    Mesh(#[from] ComplexError),
    /// The steps are not collapses of edges.
    #[error(transparent)]
    Steps(#[from] HierarchyError),
}

impl Hierarchy {
    /// Writes the hierarchy and a label into a file, which appears under its name only when it is
    /// complete.
    ///
    /// # Errors
    /// When writing fails, or the label or a list is too long for 32-bit counts.
    pub fn write(&self, path: impl AsRef<Path>, label: &str) -> io::Result<()> {
        write_atomically(path, |out| self.write_to(out, label))
    }

    /// Writes the bytes of a file.
    ///
    /// # Errors
    /// As [`Hierarchy::write`].
    pub fn write_to(&self, out: &mut dyn Write, label: &str) -> io::Result<()> {
        let mesh = &self.initial;
        let lengths =
            [label.len(), mesh.spheres.len(), mesh.edges.len(), mesh.faces.len(), self.steps.len()];
        let mut header = SIGNATURE.to_vec();
        header.extend(VERSION.to_le_bytes());
        for length in lengths {
            let length = u32::try_from(length).map_err(io::Error::other)?;
            header.extend(length.to_le_bytes());
        }
        write_part(out, [header])?;
        write_part(out, [label.as_bytes()])?;
        write_part(out, mesh.spheres.iter().map(|&sphere| bytes_of_sphere(sphere)))?;
        write_part(out, mesh.edges.iter().map(|&[a, b]| bytes_of_ids::<8>(&[a, b])))?;
        write_part(out, mesh.faces.iter().map(|face| bytes_of_ids::<12>(face)))?;
        write_part(out, self.steps.iter().map(|&step| bytes_of_step(step)))
    }

    /// Reads a file that [`Hierarchy::write`] wrote: the hierarchy and the label.
    ///
    /// # Errors
    /// When the file cannot be read, or does not hold a hierarchy; see [`Hierarchy::parse`].
    pub fn read(path: impl AsRef<Path>) -> Result<(Self, String), HierarchyFileError> {
        let (path, name) = (path.as_ref(), path.as_ref().display().to_string());
        // Anything but a regular file may never end.
        let is_endless = fs::metadata(path).is_ok_and(|target| !target.is_file());
        let bytes = match is_endless {
            true => Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file")),
            false => fs::read(path),
        };
        match bytes {
            Ok(bytes) => Self::parse(&bytes, &name),
            Err(error) => Err(HierarchyFileError { file: name, offset: 0, kind: error.into() }),
        }
    }

    /// The hierarchy and the label in the bytes of a file; `name` is for messages. Allocates in
    /// proportion to the bytes that are there, whatever the header announces, and to what the
    /// steps make of them.
    ///
    /// # Errors
    /// When a byte is missing, too many or changed, or the content is no hierarchy; the error says
    /// where.
    pub fn parse(bytes: &[u8], name: &str) -> Result<(Self, String), HierarchyFileError> {
        parse(bytes).map_err(|(offset, kind)| HierarchyFileError {
            file: name.to_owned(),
            offset: offset as u64,
            kind,
        })
    }
}

fn write_part<B: AsRef<[u8]>>(
    out: &mut dyn Write,
    items: impl IntoIterator<Item = B>,
) -> io::Result<()> {
    let mut checksum = crc32fast::Hasher::new();
    let mut chunk = Vec::with_capacity(1 << 16);
    for item in items {
        chunk.extend_from_slice(item.as_ref());
        if chunk.len() >= 1 << 15 {
            checksum.update(&chunk);
            out.write_all(&chunk)?;
            chunk.clear();
        }
    }
    checksum.update(&chunk);
    out.write_all(&chunk)?;
    out.write_all(&checksum.finalize().to_le_bytes())
}

fn bytes_of_sphere(sphere: Sphere) -> [u8; 32] {
    let [x, y, z] = sphere.centre.to_array();
    let mut bytes = [0; 32];
    for (place, number) in bytes.chunks_exact_mut(8).zip([x, y, z, sphere.radius]) {
        place.copy_from_slice(&number.to_le_bytes());
    }
    bytes
}

fn bytes_of_ids<const BYTES: usize>(ids: &[u32]) -> [u8; BYTES] {
    let mut bytes = [0; BYTES];
    for (place, id) in bytes.chunks_exact_mut(4).zip(ids) {
        place.copy_from_slice(&id.to_le_bytes());
    }
    bytes
}

fn bytes_of_step(step: Step) -> [u8; 16] {
    let mut bytes = [0; 16];
    bytes[..8].copy_from_slice(&bytes_of_ids::<8>(&[step.removed, step.kept]));
    bytes[8..].copy_from_slice(&step.cost.to_le_bytes());
    bytes
}

/// An offset and what is wrong there.
type Trouble = (usize, HierarchyFileErrorKind);

fn parse(bytes: &[u8]) -> Result<(Hierarchy, String), Trouble> {
    let lengths = parse_header(bytes)?;
    let [label, spheres, edges, faces, steps] = sections(bytes, lengths)?;
    let text = str::from_utf8(label.bytes)
        .map_err(|error| (label.offset + error.valid_up_to(), HierarchyFileErrorKind::Label))?;
    let mesh = MedialMesh {
        spheres: spheres.bytes.chunks_exact(32).map(sphere_at).collect(),
        edges: edges.bytes.chunks_exact(8).map(ids_at).collect(),
        faces: faces.bytes.chunks_exact(12).map(ids_at).collect(),
        contacts: None,
    };
    mesh.check().map_err(|error| {
        let offset = match &error {
            ComplexError::Sphere { sphere, .. } => spheres.offset_of(*sphere, 32),
            ComplexError::Edge { edge, .. } => edges.offset_of(*edge, 8),
            ComplexError::Order { what: "edge", index } => edges.offset_of(*index, 8),
            ComplexError::Face { face, .. } | ComplexError::MissingEdge { face, .. } => {
                faces.offset_of(*face, 12)
            }
            ComplexError::Order { index, .. } => faces.offset_of(*index, 12),
            ComplexError::Contacts(_) => spheres.offset,
        };
        (offset, error.into())
    })?;
    let all = steps.bytes.chunks_exact(16).map(step_at).collect();
    let hierarchy = Hierarchy::new(Arc::new(mesh), all).map_err(|error| {
        let step = match error {
            HierarchyError::Vertex { step, .. }
            | HierarchyError::Edge { step, .. }
            | HierarchyError::Cost { step } => step,
            HierarchyError::TooManySimplices => 0,
        };
        (steps.offset_of(step, 16), error.into())
    })?;
    Ok((hierarchy, text.to_owned()))
}

/// The numbers of items of the sections.
fn parse_header(bytes: &[u8]) -> Result<[u32; 5], Trouble> {
    use HierarchyFileErrorKind as Kind;
    let known = bytes.len().min(SIGNATURE.len());
    if bytes[..known] != SIGNATURE[..known] {
        return Err((0, Kind::Signature));
    }
    let [found, announced] = [bytes.len(), HEADER + CHECKSUM].map(|length| length as u64);
    if found < announced {
        return Err((bytes.len(), Kind::Length { announced, found }));
    }
    let [version, lengths @ ..] = ids_at::<6>(&bytes[SIGNATURE.len()..HEADER]);
    if version != VERSION {
        return Err((SIGNATURE.len(), Kind::Version(version)));
    }
    if ids_at::<1>(&bytes[HEADER..]) != [crc32fast::hash(&bytes[..HEADER])] {
        return Err((0, Kind::Checksum { part: "header" }));
    }
    Ok(lengths)
}

/// Part of a file.
#[derive(Clone, Copy)]
struct Section<'a> {
    bytes: &'a [u8],
    offset: usize,
}

impl Section<'_> {
    fn offset_of(&self, item: usize, size: usize) -> usize {
        self.offset + item * size
    }
}

fn sections(bytes: &[u8], lengths: [u32; 5]) -> Result<[Section<'_>; 5], Trouble> {
    use HierarchyFileErrorKind as Kind;
    let sizes = SECTIONS.iter().zip(lengths).map(|(&(_, size), n)| size as u64 * u64::from(n));
    let parts = (SECTIONS.len() + 1) * CHECKSUM;
    let announced = sizes.sum::<u64>() + (HEADER + parts) as u64;
    let found = bytes.len() as u64;
    if found != announced {
        return Err((found.min(announced) as usize, Kind::Length { announced, found }));
    }
    let mut offset = HEADER + CHECKSUM;
    let mut sections = [Section { bytes: &[], offset }; 5];
    for ((section, (part, size)), length) in sections.iter_mut().zip(SECTIONS).zip(lengths) {
        let (content, rest) = bytes[offset..].split_at(size * length as usize);
        if ids_at::<1>(rest) != [crc32fast::hash(content)] {
            return Err((offset, Kind::Checksum { part }));
        }
        *section = Section { bytes: content, offset };
        offset += content.len() + CHECKSUM;
    }
    Ok(sections)
}

/// The first `N` numbers of 32 bits.
fn ids_at<const N: usize>(bytes: &[u8]) -> [u32; N] {
    let id = |index: usize| bytes[4 * index..].first_chunk().copied().map(u32::from_le_bytes);
    std::array::from_fn(|index| id(index).expect("the section holds whole items"))
}

/// The first `N` numbers of 64 bits.
fn numbers_at<const N: usize>(bytes: &[u8]) -> [f64; N] {
    let number = |index: usize| bytes[8 * index..].first_chunk().copied().map(f64::from_le_bytes);
    std::array::from_fn(|index| number(index).expect("the section holds whole items"))
}

fn sphere_at(bytes: &[u8]) -> Sphere {
    let [x, y, z, radius] = numbers_at(bytes);
    Sphere::new(Vec3::new(x, y, z), radius)
}

fn step_at(bytes: &[u8]) -> Step {
    let [removed, kept] = ids_at(bytes);
    let [cost] = numbers_at(&bytes[8..]);
    Step { removed, kept, cost }
}
