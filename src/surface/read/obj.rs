//! Wavefront OBJ: the statements `v` and `f`; everything else is passed over.
//!
//! An own reader because the crate `tobj` does not do what is needed here: its errors carry no
//! line numbers, it splits vertices by material and joins positions with texture coordinates, and
//! it does not join lines that end with a backslash. It serves as an oracle in the tests.
//!
//! - A face may name vertices that follow it; negative indices count back from the last vertex
//!   before the face.
//! - A fourth coordinate (weight) and vertex colours are passed over.
//! - Keywords that are not of the format give one warning, since the file may be another thing.

use super::text::{Cursor, Token, quote};
use crate::surface::error::{Fault, Place};
use crate::surface::soup::PolygonSoup;

/// Keywords of the format that have no bearing on the surface. Sorted.
const PASSED_OVER: [&str; 40] = [
    "bevel",
    "bmat",
    "bsp",
    "bzp",
    "c_interp",
    "call",
    "con",
    "csh",
    "cstype",
    "ctech",
    "curv",
    "curv2",
    "d_interp",
    "deg",
    "end",
    "g",
    "hole",
    "l",
    "lod",
    "maplib",
    "mg",
    "mtllib",
    "o",
    "p",
    "parm",
    "res",
    "s",
    "scrv",
    "shadow_obj",
    "sp",
    "stech",
    "step",
    "trace_obj",
    "trim",
    "usemap",
    "usemtl",
    "vc",
    "vn",
    "vp",
    "vt",
];

/// Parses an OBJ file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let mut cursor = Cursor::new(bytes, Some(b'#')).joining_lines();
    let mut soup = PolygonSoup::default();
    // The largest index so far and the face that names it: vertices may follow their faces.
    let mut largest = (0, 0);
    let mut unknown = (0, String::new());
    while let Some(keyword) = cursor.token() {
        match keyword.text {
            b"v" => parse_vertex(&mut cursor, &mut soup)?,
            b"f" | b"fo" => parse_face(&mut cursor, keyword.line, &mut soup, &mut largest)?,
            b"surf" => {
                let what = "free-form surfaces are not read; export the surface as polygons";
                return Err(Fault::Unsupported(format!("line {}: {what}", keyword.line)));
            }
            other if is_known(other) => {}
            other => {
                if unknown.0 == 0 {
                    unknown.1 = format!("{} on line {}", quote(other), keyword.line);
                }
                unknown.0 += 1;
            }
        }
        cursor.next_line();
    }
    let (index, face) = largest;
    if index > soup.vertices.len() {
        let (at, vertices) = (soup.place(face), soup.vertices.len());
        return Err(Fault::Index { at, face, index: index as i64, vertices });
    }
    if unknown.0 > 0 {
        soup.warnings.push(format!(
            "{} lines with unknown keywords are ignored, the first is {}",
            unknown.0, unknown.1
        ));
    }
    Ok(soup)
}

fn is_known(keyword: &[u8]) -> bool {
    PASSED_OVER.binary_search_by(|k| k.as_bytes().cmp(keyword)).is_ok()
}

fn parse_vertex(cursor: &mut Cursor<'_>, soup: &mut PolygonSoup) -> Result<(), Fault> {
    let mut xyz = [0.0; 3];
    let line = cursor.line();
    for x in &mut xyz {
        *x = cursor.number_on_line("3 coordinates after v")?;
    }
    soup.push_vertex(xyz, || Place::Line(line))
}

fn parse_face(
    cursor: &mut Cursor<'_>,
    line: usize,
    soup: &mut PolygonSoup,
    largest: &mut (usize, usize),
) -> Result<(), Fault> {
    let face = soup.len();
    while let Some(token) = cursor.token_on_line() {
        let index = vertex_index(token)
            .ok_or_else(|| cursor.expected("v, v/vt, v//vn or v/vt/vn", Some(token)))?;
        let vertices = soup.vertices.len();
        let corner = match usize::try_from(index) {
            Ok(forward) => forward,
            Err(_) => vertices.saturating_add_signed(index as isize) + 1,
        };
        let refused = index == 0
            || (index < 0 && index.unsigned_abs() > vertices as u64)
            || corner > u32::MAX as usize;
        if refused {
            return Err(Fault::Index { at: Place::Line(token.line), face, index, vertices });
        }
        if corner > largest.0 {
            *largest = (corner, face);
        }
        soup.corners.push(corner as u32 - 1);
    }
    soup.end_polygon(Some(line))
}

/// The first of the up to three indices of a corner; all have to be integers where present.
fn vertex_index(token: Token<'_>) -> Option<i64> {
    let mut parts = token.text.split(|&b| b == b'/').map(|text| Token { text, line: token.line });
    let vertex = parts.next()?.integer()?;
    let mut optional = || parts.next().is_none_or(|t| t.text.is_empty() || t.integer().is_some());
    (optional() && optional() && parts.next().is_none()).then_some(vertex)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_that_matter() {
        let text = "# c\nmtllib a b.mtl\nf 1 2/1 3//1 \\\n 4/1/1\nv 0 0 0\nv 1 0 0 1.0\n\
                    v 1 1 0 255 0 0\nv 0 1 0\nf -4 -3 -2\r\nusemtl x\n";
        let soup = parse(text.as_bytes()).unwrap();
        assert_eq!(soup.vertices.len(), 4);
        assert_eq!(soup.polygon(0), [0, 1, 2, 3]);
        assert_eq!(soup.polygon(1), [0, 1, 2]);
        assert_eq!(soup.lines, [3, 9]);
        assert!(soup.warnings.is_empty());
        assert_eq!(parse(b"hello world\n\nvx\n").unwrap().warnings.len(), 1);
        assert!(PASSED_OVER.is_sorted());
    }

    #[test]
    fn errors_name_the_line() {
        for (text, expected) in [
            ("v 0 0 zero\n", "line 1: expected 3 coordinates after v, found \"zero\""),
            ("v 0 0\nv", "line 1: expected 3 coordinates after v, found the end of the line"),
            ("v 0 0", "end of file: expected 3 coordinates after v, found nothing more"),
            ("v 0 0 nan\n", "line 1: vertex 0 has the coordinate NaN, which is not finite"),
            ("v 0 0 0\nf 1 1 x\n", "line 2: expected v, v/vt, v//vn or v/vt/vn, found \"x\""),
            ("v 0 0 0\nf 1 1 1/a\n", "line 2: expected v, v/vt, v//vn or v/vt/vn, found \"1/a\""),
            ("v 0 0 0\n\nf 1 0 1\n", "line 3: face 0 names the vertex 0 of 1 vertex"),
            ("v 0 0 0\nf 1 -2 1\n", "line 2: face 0 names the vertex -2 of 1 vertex"),
            ("v 0 0 0\nf 1 1 1\nf 1 2 1\n", "line 3: face 1 names the vertex 2 of 1 vertex"),
            (
                "v 0 0 0\nf 1 -9223372036854775808 1\n",
                "line 2: face 0 names the vertex -9223372036854775808 of 1 vertex",
            ),
            ("v 0 0 0\nf 1 1\n", "line 2: face 0 has 2 corners; three are the least"),
        ] {
            assert_eq!(parse(text.as_bytes()).unwrap_err().to_string(), expected, "{text:?}");
        }
    }
}
