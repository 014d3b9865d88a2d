//! PLY, the polygon file format of Stanford, for surfaces and medial meshes: text, and binary of either byte order.
//!
//! `ply-rs-bw` parses the header and binary rows. Around it:
//! - The header reaches the crate as UTF-8 with LF line ends: files exist with CR alone and with comments in other
//!   encodings, and the crate rejects both.
//! - Text rows are read here, because the crate rejects numbers such as `1.`, `.5` and `nan`. All of them are read in
//!   double precision, for any precision that the header declares.
//! - Counts of the header are compared with the bytes that follow before a row is read.
//! - Rows are handed on one by one, so that memory is that of the result, and faults name the line or the element.
//!
//! In a text file every element has its own line. Values behind the declared ones are ignored, as are other
//! elements and properties, and lines or bytes after the last element.

use std::collections::HashSet;
use std::fmt;

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::report::{Fault, Place};
use super::soup::{PolygonSoup, checked_index};
use super::text::{Cursor, count, quote};
use crate::{parser_message, quoted};

/// The values of one row that matter here, each 0 where the header does not declare it.
#[derive(Default)]
pub(crate) struct Row {
    /// `x`, `y`, `z`, `radius` and `r`.
    pub numbers: [f64; 5],
    /// `vertex1` and `vertex2` of an edge.
    pub ends: [f64; 2],
    /// `vertex_indices` (or `vertex_index`) of a face.
    pub corners: Vec<u32>,
}

/// Whether a property of [`Row`] is a number or a list.
fn kind_of(property: &str) -> Option<&'static str> {
    match property {
        "x" | "y" | "z" | "radius" | "r" | "vertex1" | "vertex2" => Some("number"),
        "vertex_indices" | "vertex_index" => Some("list"),
        _ => None,
    }
}

impl PropertyAccess for Row {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if let "vertex_indices" | "vertex_index" = name {
            // Neither numbers with a fraction nor negative ones are indices.
            let Some(corners) = property.to_u32_list() else {
                return PropertyAccessResult::UnsupportedType;
            };
            self.corners = corners;
            return PropertyAccessResult::Set;
        }
        let place = match name {
            "x" => &mut self.numbers[0],
            "y" => &mut self.numbers[1],
            "z" => &mut self.numbers[2],
            "radius" => &mut self.numbers[3],
            "r" => &mut self.numbers[4],
            "vertex1" => &mut self.ends[0],
            "vertex2" => &mut self.ends[1],
            _ => return PropertyAccessResult::Ignored,
        };
        *place = match property {
            Property::Char(value) => value.into(),
            Property::UChar(value) => value.into(),
            Property::Short(value) => value.into(),
            Property::UShort(value) => value.into(),
            Property::Int(value) => value.into(),
            Property::UInt(value) => value.into(),
            Property::Float(value) => value.into(),
            Property::Double(value) => value,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// The elements of a header, and the bytes of their rows.
pub(crate) struct Ply<'a> {
    pub elements: Vec<ElementDef>,
    encoding: Encoding,
    rows: &'a [u8],
    /// Number of the first line of the rows.
    pub line: usize,
}

/// Reads the header of a PLY file.
///
/// # Errors
/// When it is not understood, or announces more rows than the file has bytes for.
pub(crate) fn header(bytes: &[u8]) -> Result<Ply<'_>, Fault> {
    // The first line decides: in the bytes of binary rows LF and CR mean nothing.
    let first = bytes.iter().position(|byte| b"\r\n".contains(byte)).unwrap_or(bytes.len());
    let is_cr = bytes[first..].starts_with(b"\r") && !bytes[first..].starts_with(b"\r\n");
    let line_end = if is_cr { b'\r' } else { b'\n' };
    let mut length = 0;
    for line in bytes.split_inclusive(|&byte| byte == line_end) {
        length += line.len();
        if line.trim_ascii() == b"end_header" {
            break;
        }
    }
    let (head, rows) = bytes.split_at(length);
    // Comments may be in any encoding; bytes replaced there harm nothing.
    let mut head = String::from_utf8_lossy(head).into_owned();
    if is_cr {
        head = head.replace('\r', "\n");
    }
    let mut reader = Reader::new(head.as_bytes());
    let header = Parser::<Row>::new()
        .read_header(&mut reader)
        .map_err(|error| fault(Place::Line(error.line().unwrap_or(1)), "a PLY header", &error))?;
    // The parser keeps one of several with a name, and would take columns or rows of the others for its. It takes numbers
    // for lists and lists for numbers.
    let (mut names, mut element) = (HashSet::new(), None);
    for (row, line) in (1..).zip(head.lines()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        if let ["property", kind, .., name] = words[..]
            && ["vertex", "edge", "face"].map(Some).contains(&element)
            && let Some(expected) =
                kind_of(name).filter(|expected| (*expected == "list") != (kind == "list"))
        {
            let expected = format!("a {expected} as the property {name}");
            return Err(Fault::Syntax { at: Place::Line(row), expected, found: quoted(kind) });
        }
        let (name, kind) = match words[..] {
            ["element", name, ..] => {
                element = Some(name);
                ((None, name), "elements")
            }
            ["property", .., name] => ((element, name), "properties"),
            _ => continue,
        };
        if !names.insert(name) {
            let expected = format!("{kind} of different names");
            let name = name.1;
            return Err(Fault::Syntax { at: Place::Line(row), expected, found: quoted(name) });
        }
    }
    if header.elements.contains_key("tristrips") {
        let what = "PLY triangle strips are not read; export faces";
        return Err(Fault::Unsupported(what.into()));
    }
    let line = reader.line();
    let text = header.encoding == Encoding::Ascii;
    let elements: Vec<ElementDef> = header.elements.into_values().collect();
    for element in &elements {
        let sizes = element.properties.values().map(|property| match &property.data_type {
            PropertyType::List(scalar, _) | PropertyType::Scalar(scalar) => match scalar {
                // A digit and a blank.
                _ if text => 2,
                ScalarType::Char | ScalarType::UChar => 1,
                ScalarType::Short | ScalarType::UShort => 2,
                ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
                ScalarType::Double => 8,
            },
        });
        // At least 1: elements without properties could otherwise be announced in any number.
        let least = sizes.sum::<usize>().max(1);
        if element.count.checked_mul(least).is_none_or(|size| size > rows.len() + 1) {
            let what = match element.name.as_str() {
                "vertex" => "vertices",
                "edge" => "edges",
                "face" => "faces",
                _ => "elements",
            };
            let holds = format!("only {} bytes more", rows.len());
            return Err(Fault::Count { what, announced: element.count as u64, holds });
        }
    }
    Ok(Ply { elements, encoding: header.encoding, rows, line })
}

impl Ply<'_> {
    /// Whether an element has a property, under one of these names.
    pub fn has(&self, element: &str, names: &[&str]) -> bool {
        let mut elements = self.elements.iter().filter(|e| e.name == element);
        elements.any(|e| names.iter().any(|&name| e.properties.contains_key(name)))
    }

    /// Number of rows of an element.
    pub fn count(&self, element: &str) -> usize {
        self.elements.iter().filter(|e| e.name == element).map(|e| e.count).sum()
    }

    /// Hands all rows on in their order: the name of the element, the number of the row in it, its place, its values.
    ///
    /// # Errors
    /// When a row is missing or contradicts the header, or `take` fails.
    pub fn rows<E: From<Fault>>(
        &self,
        mut take: impl FnMut(&str, usize, &Place, Row) -> Result<(), E>,
    ) -> Result<(), E> {
        let parser = Parser::<Row>::new();
        // The binary reader advances this slice, so each row starts where the last one ended.
        let mut rest = self.rows;
        let mut cursor = Cursor::at_line(self.rows, self.line);
        for element in &self.elements {
            // Static, for the places of faults.
            let name = match element.name.as_str() {
                "vertex" => "vertex",
                "edge" => "edge",
                "face" => "face",
                _ => "element",
            };
            for row in 0..element.count {
                if self.encoding == Encoding::Ascii {
                    let values = text_row(&mut cursor, element, format_args!("{name} {row}"))?;
                    take(name, row, &Place::Line(cursor.line), values)?;
                    cursor.next_line();
                    continue;
                }
                let place = Place::Element(name, row);
                let values = match self.encoding {
                    Encoding::BinaryBigEndian => parser.read_big_endian_element(&mut rest, element),
                    _ => parser.read_little_endian_element(&mut rest, element),
                };
                let values = values.map_err(|error| {
                    let what = format!("{name} {row} of {}", element.count);
                    fault(place.clone(), &what, &error)
                })?;
                take(name, row, &place, values)?;
            }
        }
        Ok(())
    }
}

/// The values of the next line that has any. The cursor stays on that line.
fn text_row(
    cursor: &mut Cursor<'_>,
    element: &ElementDef,
    what: fmt::Arguments<'_>,
) -> Result<Row, Fault> {
    if !cursor.skip_empty_lines() {
        return Err(cursor.expected(what, None));
    }
    let mut row = Row::new();
    for (name, property) in &element.properties {
        if let PropertyType::Scalar(_) = property.data_type {
            let value = Property::Double(cursor.number_on_line(what)?);
            row.set_property(name, value);
            continue;
        }
        let length = cursor.token_on_line();
        // No memory is reserved for the announced length, which may be anything.
        for _ in 0..count(cursor, length, what)? {
            if let "vertex_indices" | "vertex_index" = &**name {
                let index = cursor.token_on_line();
                // The largest index names no vertex, so that a larger number is rejected, too.
                let index = count(cursor, index, what)?.min(u32::MAX as usize);
                row.corners.push(index as u32);
            } else {
                cursor.number_on_line::<f64>(what)?;
            }
        }
    }
    Ok(row)
}

/// A fault of the crate in one line: the problem and the text, without line number and Rust's debug output.
fn fault(at: Place, expected: &str, error: &ParseError) -> Fault {
    const MOST: usize = 80;
    let text = error.to_string();
    if text.ends_with("failed to fill whole buffer") {
        return Fault::Ends { expected: expected.to_owned() };
    }
    let text = text.split_once(": ").filter(|_| text.starts_with("Line ")).map_or(&*text, |t| t.1);
    if text.contains("magic number") {
        let found = "another first line than `ply`".to_owned();
        return Fault::Syntax { at, expected: expected.to_owned(), found };
    }
    let parts: Vec<&str> = text.splitn(3, "\n\t").take(2).map(str::trim).collect();
    let found = parser_message(&parts.join(" ")).chars().take(MOST).collect();
    Fault::Syntax { at, expected: expected.to_owned(), found }
}

/// The vertices and faces of a PLY file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let file = header(bytes)?;
    let vertices = file.count("vertex");
    if ["x", "y", "z"].iter().any(|axis| !file.has("vertex", &[axis])) {
        return Err(missing_in(&file, "element vertex with x, y and z before it"));
    }
    let has_faces = file.elements.iter().any(|element| element.name == "face");
    if has_faces && !file.has("face", &["vertex_indices", "vertex_index"]) {
        return Err(missing_in(&file, "a list vertex_indices in element face before it"));
    }
    let mut soup = PolygonSoup::default();
    file.rows(|element, row, at, values| match element {
        "vertex" => {
            soup.push_vertex(*values.numbers.first_chunk().unwrap_or(&[0.0; 3]), || at.clone())
        }
        "face" => {
            for &corner in &values.corners {
                soup.corners.push(checked_index(corner.into(), vertices, at, row)?);
            }
            soup.end_polygon(if let Place::Line(line) = *at { Some(line) } else { None })
        }
        _ => Ok(()),
    })?;
    Ok(soup)
}

fn missing_in(file: &Ply<'_>, expected: &str) -> Fault {
    let (at, found) = (Place::Line(file.line - 1), quote(b"end_header"));
    Fault::Syntax { at, expected: expected.to_owned(), found }
}
