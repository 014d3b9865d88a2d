//! PLY, the polygon file format of Stanford: text, and binary of either byte order.
//!
//! - Needed are `element vertex` with the properties `x, y, z` and `element face` with a list
//!   `vertex_indices` (or `vertex_index`); other elements and properties are passed over.
//! - In a text file every element has a line of its own, as the format says; a line with too few
//!   or too many values is an error.
//! - Bytes or lines after the last element give a warning.
//! - Triangle strips (`element tristrips`) are refused.

use super::off::checked_index;
use super::text::{Cursor, quote};
use crate::surface::error::{Fault, Place};
use crate::surface::soup::PolygonSoup;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Scalar {
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

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The value in these `size()` bytes. Exact: every type of the format fits a double.
    fn decode(self, bytes: &[u8], encoding: Encoding) -> f64 {
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
enum Role {
    /// The coordinate with this number.
    Coordinate(usize),
    /// The corners of a face.
    Corners,
    Passed,
}

struct Property {
    /// Type of the length, for a list.
    length: Option<Scalar>,
    scalar: Scalar,
    role: Role,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Vertex,
    Face,
    Other,
}

struct Element {
    kind: Kind,
    count: usize,
    properties: Vec<Property>,
}

/// Parses a PLY file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let (encoding, elements, data) = parse_header(bytes)?;
    let mut rows = Rows { encoding, bytes, at: data.at, text: data };
    let announced = elements.iter().find(|e| e.kind == Kind::Vertex).map_or(0, |e| e.count);
    let mut soup = PolygonSoup::default();
    for element in &elements {
        check_room(element, &rows)?;
        // An element without properties takes no room, so its count could be anything.
        let count = if element.properties.is_empty() { 0 } else { element.count };
        for row in 0..count {
            parse_row(&mut rows, element, row, announced, &mut soup)?;
        }
    }
    if let Some(rest) = rows.rest() {
        soup.warnings.push(format!("{rest} after the last element are ignored"));
    }
    Ok(soup)
}

/// A header that announces more than can follow is refused before memory is reserved for it.
fn check_room(element: &Element, rows: &Rows<'_>) -> Result<(), Fault> {
    let size = |p: &Property| match (rows.encoding, p.length) {
        (Encoding::Text, _) => 2,
        (_, Some(length)) => length.size(),
        (_, None) => p.scalar.size(),
    };
    let least: usize = element.properties.iter().map(size).sum();
    let room = rows.room() + usize::from(rows.encoding == Encoding::Text);
    if element.count.checked_mul(least).is_none_or(|needed| needed > room) {
        let what = match element.kind {
            Kind::Vertex => "vertices",
            Kind::Face => "faces",
            Kind::Other => "elements",
        };
        let holds = format!("only {} bytes more", rows.room());
        return Err(Fault::Count { what, announced: element.count as u64, holds });
    }
    Ok(())
}

fn parse_row(
    rows: &mut Rows<'_>,
    element: &Element,
    row: usize,
    vertices: usize,
    soup: &mut PolygonSoup,
) -> Result<(), Fault> {
    let name = ["vertex", "face", "element"][element.kind as usize];
    rows.begin(name, row)?;
    let mut xyz = [0.0; 3];
    for property in &element.properties {
        let length = match property.length {
            None => 1,
            Some(scalar) => {
                let length = rows.value(scalar, name, row)?;
                if !(length >= 0.0 && length.fract() == 0.0) {
                    let expected = "the length of a list".to_owned();
                    let found = length.to_string();
                    return Err(Fault::Syntax { at: rows.place(name, row), expected, found });
                }
                length as usize
            }
        };
        if property.role == Role::Passed && rows.encoding != Encoding::Text {
            rows.skip(length, property.scalar, name, row)?;
            continue;
        }
        for _ in 0..length {
            let value = rows.value(property.scalar, name, row)?;
            match property.role {
                Role::Coordinate(axis) => xyz[axis] = value,
                Role::Corners => {
                    let at = rows.place(name, row);
                    soup.corners.push(checked_index(value as i64, vertices, at, row)?);
                }
                Role::Passed => {}
            }
        }
    }
    let line = rows.end()?;
    match element.kind {
        Kind::Vertex => soup.push_vertex(xyz, || rows.place(name, row)),
        Kind::Face => soup.end_polygon(line),
        Kind::Other => Ok(()),
    }
}

/// The data after the header, as text or as bytes.
struct Rows<'a> {
    encoding: Encoding,
    bytes: &'a [u8],
    at: usize,
    text: Data<'a>,
}

impl Rows<'_> {
    fn room(&self) -> usize {
        match self.encoding {
            Encoding::Text => self.text.cursor.bytes_left(),
            _ => self.bytes.len() - self.at,
        }
    }

    fn place(&self, name: &'static str, row: usize) -> Place {
        match self.encoding {
            Encoding::Text => Place::Line(self.text.cursor.line()),
            _ => Place::Element(name, row),
        }
    }

    fn begin(&mut self, name: &'static str, row: usize) -> Result<(), Fault> {
        if self.encoding == Encoding::Text && !self.text.cursor.skip_empty_lines() {
            return Err(self.text.cursor.expected(format!("{name} {row}"), None));
        }
        Ok(())
    }

    fn value(&mut self, scalar: Scalar, name: &'static str, row: usize) -> Result<f64, Fault> {
        if self.encoding == Encoding::Text {
            let token = self.text.cursor.token_on_line();
            let value = token.and_then(|t| match scalar.is_integer() {
                true => t.integer().map(|i| i as f64),
                false => t.number(),
            });
            let kind = if scalar.is_integer() { "an integer" } else { "a number" };
            return value.ok_or_else(|| {
                self.text.cursor.expected(format!("{kind} of {name} {row}"), token)
            });
        }
        let end = self.at + scalar.size();
        let bytes = self.bytes.get(self.at..end).ok_or_else(|| cut_off(name, row))?;
        self.at = end;
        Ok(scalar.decode(bytes, self.encoding))
    }

    /// Passes over values of a binary file.
    fn skip(
        &mut self,
        length: usize,
        scalar: Scalar,
        name: &'static str,
        row: usize,
    ) -> Result<(), Fault> {
        let size = length.checked_mul(scalar.size()).filter(|&size| size <= self.room());
        self.at += size.ok_or_else(|| cut_off(name, row))?;
        Ok(())
    }

    /// Ends a row; a text row has to end with its line, whose number is returned.
    fn end(&mut self) -> Result<Option<usize>, Fault> {
        if self.encoding != Encoding::Text {
            return Ok(None);
        }
        let line = self.text.cursor.line();
        let more = self.text.cursor.token_on_line();
        if more.is_some() {
            let expected = "the end of the line (no more properties are declared)";
            return Err(self.text.cursor.expected(expected, more));
        }
        Ok(Some(line))
    }

    fn rest(&mut self) -> Option<String> {
        match self.encoding {
            Encoding::Text if self.text.cursor.skip_empty_lines() => {
                Some(format!("line {} and more", self.text.cursor.line()))
            }
            Encoding::Text => None,
            _ => (self.room() > 0).then(|| format!("{} bytes", self.room())),
        }
    }
}

fn cut_off(name: &str, row: usize) -> Fault {
    Fault::Syntax {
        at: Place::End,
        expected: format!("the rest of {name} {row}"),
        found: "nothing more".into(),
    }
}

/// Where the data begin.
struct Data<'a> {
    at: usize,
    cursor: Cursor<'a>,
}

fn parse_header(bytes: &[u8]) -> Result<(Encoding, Vec<Element>, Data<'_>), Fault> {
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
    let cursor = Cursor::continue_at(bytes, header.at, header.line + 1);
    Ok((encoding, elements, Data { at: header.at, cursor }))
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
