//! PLY, the polygon file format of Stanford: text, and binary of either byte order.
//!
//! - Needed are `element vertex` with the properties `x, y, z` and `element face` with a list
//!   `vertex_indices` (or `vertex_index`); other elements and properties are passed over.
//! - In a text file every element has a line of its own, as the format says; a line with too few
//!   or too many values is an error.
//! - Bytes or lines after the last element give a warning.
//! - An own reader because `ply-rs` keeps a map of properties for each element, and does not say which line or
//!   element is at fault.
//! - Triangle strips (`element tristrips`) are refused.

mod header;

use self::header::{Element, Encoding, Header, Kind, Property, Role, Scalar};
use super::off::checked_index;
use super::text::Cursor;
use crate::surface::error::{Fault, Place};
use crate::surface::soup::PolygonSoup;

/// Parses a PLY file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let Header { encoding, elements, end, line } = header::parse(bytes)?;
    let mut rows = Rows { encoding, bytes, at: end, cursor: Cursor::continue_at(bytes, end, line) };
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
    /// The same place for text, which is not moved for binary data.
    cursor: Cursor<'a>,
}

impl Rows<'_> {
    fn room(&self) -> usize {
        match self.encoding {
            Encoding::Text => self.cursor.bytes_left(),
            _ => self.bytes.len() - self.at,
        }
    }

    fn place(&self, name: &'static str, row: usize) -> Place {
        match self.encoding {
            Encoding::Text => Place::Line(self.cursor.line()),
            _ => Place::Element(name, row),
        }
    }

    fn begin(&mut self, name: &'static str, row: usize) -> Result<(), Fault> {
        if self.encoding == Encoding::Text && !self.cursor.skip_empty_lines() {
            return Err(self.cursor.expected(format!("{name} {row}"), None));
        }
        Ok(())
    }

    fn value(&mut self, scalar: Scalar, name: &'static str, row: usize) -> Result<f64, Fault> {
        if self.encoding == Encoding::Text {
            let token = self.cursor.token_on_line();
            let value = token.and_then(|t| match scalar.is_integer() {
                true => t.integer().map(|i| i as f64),
                false => t.number(),
            });
            let kind = if scalar.is_integer() { "an integer" } else { "a number" };
            return value
                .ok_or_else(|| self.cursor.expected(format!("{kind} of {name} {row}"), token));
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
        let line = self.cursor.line();
        let more = self.cursor.token_on_line();
        if more.is_some() {
            let expected = "the end of the line (no more properties are declared)";
            return Err(self.cursor.expected(expected, more));
        }
        Ok(Some(line))
    }

    fn rest(&mut self) -> Option<String> {
        match self.encoding {
            Encoding::Text if self.cursor.skip_empty_lines() => {
                Some(format!("line {} and more", self.cursor.line()))
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

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n";
    const ROWS: &str = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

    #[test]
    fn errors_name_the_line() {
        let file = format!("{HEADER}{ROWS}");
        assert_eq!(parse(file.as_bytes()).unwrap().lines, [13]);
        assert_eq!(parse(file.replace('\n', "\r").as_bytes()).unwrap().lines, [13]);
        assert_eq!(parse(format!("{file}\n9\n").as_bytes()).unwrap().warnings.len(), 1);
        for (from, to, expected) in [
            ("ply", "pyl", "line 1: expected the keyword ply, found \"pyl\""),
            (
                "ascii",
                "text",
                "line 2: expected ascii, binary_little_endian or binary_big_endian, found \"format text 1.0\"",
            ),
            (
                "format ascii 1.0\n",
                "",
                "line 8: expected a format line before it, found \"end_header\"",
            ),
            (
                "float z",
                "float w",
                "line 9: expected element vertex with x, y and z before it, found \"end_header\"",
            ),
            (
                "float y",
                "floot y",
                "line 5: expected property TYPE NAME or property list TYPE TYPE NAME, found \"property floot y\"",
            ),
            (
                "list uchar int",
                "list float int",
                "line 8: expected lists with integer lengths and corners, found \"property list float int vertex_indices\"",
            ),
            (
                "element face 1",
                "element face x",
                "line 7: expected element NAME COUNT, found \"element face x\"",
            ),
            (
                "element face 1\nproperty list uchar int vertex_indices\n",
                "",
                "no face among 3 vertices; a closed surface is needed, not a point set",
            ),
            (
                "element face",
                "element tristrips",
                "PLY triangle strips are not read; export the surface as faces",
            ),
            ("end_header", "end", "line 9: expected a header keyword, found \"end\""),
            (
                "1 0 0\n",
                "1 0\n",
                "line 11: expected a number of vertex 1, found the end of the line",
            ),
            (
                "1 0 0\n",
                "1 0 0 0\n",
                "line 11: expected the end of the line (no more properties are declared), found \"0\"",
            ),
            ("3 0 1 2", "3 0 1 3", "line 13: face 0 names the vertex 3 of 3 vertices"),
            ("3 0 1 2", "3 0 1 -1", "line 13: face 0 names the vertex -1 of 3 vertices"),
            ("3 0 1 2", "3 0 1 1.5", "line 13: expected an integer of face 0, found \"1.5\""),
            ("3 0 1 2", "2 0 1", "line 13: face 0 has 2 corners; three are the least"),
            ("3 0 1 2", "-1 0 1", "line 13: expected the length of a list, found -1"),
            (
                "0 1 0\n",
                "0 nan 0\n",
                "line 12: vertex 2 has the coordinate NaN, which is not finite",
            ),
            ("3 0 1 2\n", "", "end of file: expected face 0, found nothing more"),
            (
                "vertex 3",
                "vertex 99",
                "the header announces 99 vertices, but the file holds only 26 bytes more",
            ),
        ] {
            let altered = file.replacen(from, to, 1);
            assert_eq!(parse(altered.as_bytes()).unwrap_err().to_string(), expected);
        }
    }

    #[test]
    fn binary_errors_name_the_element() {
        let header = HEADER.replace("ascii", "binary_big_endian");
        let mut file = header.into_bytes();
        for x in [0_f32, 0., 0., 1., 0., 0., 0., 1., 0.] {
            file.extend(x.to_be_bytes());
        }
        file.push(3);
        file.extend([0_i32, 1, 2].iter().flat_map(|i| i.to_be_bytes()));
        assert_eq!(parse(&file).unwrap().polygon(0), [0, 1, 2]);
        let message = |bytes: &[u8]| parse(bytes).unwrap_err().to_string();
        assert_eq!(
            message(&file[..file.len() - 1]),
            "end of file: expected the rest of face 0, found nothing more"
        );
        let last = file.len() - 1;
        file[last] = 9;
        assert_eq!(message(&file), "face 0 names the vertex 9 of 3 vertices");
        let from_end = file.len() - 13 - 4;
        file[from_end..from_end + 4].copy_from_slice(&f32::INFINITY.to_be_bytes());
        assert_eq!(message(&file), "vertex 2 has the coordinate inf, which is not finite");
        file.extend([0; 5]);
        file[last] = 2;
        file[from_end..from_end + 4].copy_from_slice(&[0; 4]);
        assert_eq!(parse(&file).unwrap().warnings, ["5 bytes after the last element are ignored"]);
    }
}
