//! The header of a PLY file.

use super::super::text::quote;
use crate::surface::error::{Fault, Place};

/// How values are stored.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// The types of the format, under both of their names.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The value in these `size()` bytes. Exact: every type of the format fits a double.
    pub fn decode(self, bytes: &[u8], encoding: Encoding) -> f64 {
        let mut b = [0; 8];
        let n = bytes.len();
        b[..n].copy_from_slice(bytes);
        if encoding == Encoding::BigEndian {
            b[..n].reverse();
        }
        match self {
            Self::I8 => f64::from(b[0] as i8),
            Self::U8 => f64::from(b[0]),
            Self::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
            Self::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
            Self::I32 => f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Self::U32 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Self::F32 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Self::F64 => f64::from_le_bytes(b),
        }
    }
}

/// What a property means for the surface.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// The coordinate with this number.
    Coordinate(usize),
    /// The corners of a face.
    Corners,
    Passed,
}

/// A property, or a list of them.
pub(super) struct Property {
    /// Type of the length, for a list.
    pub length: Option<Scalar>,
    pub scalar: Scalar,
    pub role: Role,
}

/// What an element means for the surface.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Vertex,
    Face,
    Other,
}

/// An element with the rows it announces.
pub(super) struct Element {
    pub kind: Kind,
    pub count: usize,
    pub properties: Vec<Property>,
}

/// The header, and where the data begin.
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// First byte of the data.
    pub end: usize,
    /// Line of that byte.
    pub line: usize,
}

/// Parses everything up to `end_header`.
pub(super) fn parse(bytes: &[u8]) -> Result<Header, Fault> {
    let mut header = HeaderLines::new(bytes);
    let first = header.next().unwrap_or_default();
    if first.trim_ascii_end() != b"ply" {
        return Err(header.unexpected("the keyword ply", first));
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let Some(line) = header.next() else {
            let (expected, found) = ("end_header".to_owned(), "nothing more".to_owned());
            return Err(Fault::Syntax { at: Place::End, expected, found });
        };
        let mut words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        match words.next() {
            None | Some(b"comment" | b"obj_info") => {}
            Some(b"format") => encoding = Some(parse_format(&header, line, words.next())?),
            Some(b"element") => elements.push(parse_element(&header, line, words, &elements)?),
            Some(b"property") => {
                let property = parse_property(&header, line, words, elements.last())?;
                if let Some(element) = elements.last_mut() {
                    element.properties.push(property);
                }
            }
            Some(b"end_header") => break,
            Some(_) => return Err(header.unexpected("a header keyword", line)),
        }
    }
    let encoding =
        encoding.ok_or_else(|| header.unexpected("a format line before it", b"end_header"))?;
    check_elements(&header, &elements)?;
    Ok(Header { encoding, elements, end: header.at, line: header.line + 1 })
}

/// Whether the header describes a surface at all.
fn check_elements(header: &HeaderLines<'_>, elements: &[Element]) -> Result<(), Fault> {
    let has = |kind: Kind, role: Role| {
        elements.iter().any(|e| e.kind == kind && e.properties.iter().any(|p| p.role == role))
    };
    if (0..3).any(|axis| !has(Kind::Vertex, Role::Coordinate(axis))) {
        return Err(header.unexpected("element vertex with x, y and z before it", b"end_header"));
    }
    if !elements.iter().any(|e| e.kind == Kind::Face) {
        let vertices = elements.iter().filter(|e| e.kind == Kind::Vertex).map(|e| e.count).sum();
        return Err(Fault::NoFaces { vertices });
    }
    if !has(Kind::Face, Role::Corners) {
        return Err(
            header.unexpected("a list vertex_indices in element face before it", b"end_header")
        );
    }
    Ok(())
}

fn parse_format(
    header: &HeaderLines<'_>,
    line: &[u8],
    name: Option<&[u8]>,
) -> Result<Encoding, Fault> {
    match name {
        Some(b"ascii") => Ok(Encoding::Text),
        Some(b"binary_little_endian") => Ok(Encoding::LittleEndian),
        Some(b"binary_big_endian") => Ok(Encoding::BigEndian),
        _ => Err(header.unexpected("ascii, binary_little_endian or binary_big_endian", line)),
    }
}

fn parse_element<'a>(
    header: &HeaderLines<'_>,
    line: &[u8],
    mut words: impl Iterator<Item = &'a [u8]>,
    before: &[Element],
) -> Result<Element, Fault> {
    let kind = match words.next() {
        Some(b"vertex") => Kind::Vertex,
        Some(b"face") => Kind::Face,
        Some(b"tristrips") => {
            let what = "PLY triangle strips are not read; export the surface as faces";
            return Err(Fault::Unsupported(what.into()));
        }
        Some(_) => Kind::Other,
        None => return Err(header.unexpected("element NAME COUNT", line)),
    };
    if kind != Kind::Other && before.iter().any(|e| e.kind == kind) {
        return Err(header.unexpected("each of vertex and face once", line));
    }
    let count = words.next().and_then(|w| std::str::from_utf8(w).ok()?.parse().ok());
    let count = count.ok_or_else(|| header.unexpected("element NAME COUNT", line))?;
    Ok(Element { kind, count, properties: Vec::new() })
}

fn parse_property<'a>(
    header: &HeaderLines<'_>,
    line: &[u8],
    mut words: impl Iterator<Item = &'a [u8]>,
    element: Option<&Element>,
) -> Result<Property, Fault> {
    let wrong = || header.unexpected("property TYPE NAME or property list TYPE TYPE NAME", line);
    let element =
        element.ok_or_else(|| header.unexpected("an element before its properties", line))?;
    let mut word = words.next().ok_or_else(wrong)?;
    let mut length = None;
    if word == b"list" {
        length = Some(words.next().and_then(Scalar::named).ok_or_else(wrong)?);
        word = words.next().ok_or_else(wrong)?;
    }
    let scalar = Scalar::named(word).ok_or_else(wrong)?;
    let name = words.next().ok_or_else(wrong)?;
    let role = match (element.kind, length, name) {
        (Kind::Vertex, None, b"x") => Role::Coordinate(0),
        (Kind::Vertex, None, b"y") => Role::Coordinate(1),
        (Kind::Vertex, None, b"z") => Role::Coordinate(2),
        (Kind::Face, Some(_), b"vertex_indices" | b"vertex_index") => Role::Corners,
        _ => Role::Passed,
    };
    let repeated = role != Role::Passed && element.properties.iter().any(|p| p.role == role);
    if repeated {
        return Err(header.unexpected("each property once", line));
    }
    if length.is_some_and(|l| !l.is_integer()) || (role == Role::Corners && !scalar.is_integer()) {
        return Err(header.unexpected("lists with integer lengths and corners", line));
    }
    Ok(Property { length, scalar, role })
}

/// The lines of the header. They end as the first one does, since a binary file may go on with
/// any byte after the last.
struct HeaderLines<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    end: u8,
}

impl<'a> HeaderLines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let first = bytes.iter().position(|b| matches!(b, b'\r' | b'\n'));
        let end = match first.map(|at| &bytes[at..]) {
            Some([b'\r', next, ..]) if *next != b'\n' => b'\r',
            _ => b'\n',
        };
        Self { bytes, at: 0, line: 0, end }
    }

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&b| b == self.end)?;
        self.at += length + 1;
        self.line += 1;
        let line = &rest[..length];
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }

    fn unexpected(&self, expected: &str, found: &[u8]) -> Fault {
        let (at, expected) = (Place::Line(self.line.max(1)), expected.to_owned());
        Fault::Syntax { at, expected, found: quote(found) }
    }
}
