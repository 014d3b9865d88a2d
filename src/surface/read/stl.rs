//! STL, text and binary. Every triangle comes with its own three corners.
//!
//! What a file is, is told by its content: a binary file has 84 bytes and 50 for each announced
//! triangle, whatever its first words are; many binary files begin with `solid`. Anything else is
//! text if it begins with `solid` and has no zero byte, and otherwise a binary file whose count
//! lies, which is an error. An own reader because `stl_io` does not say which line or triangle is at fault.
//! Normals, names and attribute bytes are passed over.

use super::text::Cursor;
use crate::surface::error::{Fault, Place};
use crate::surface::soup::PolygonSoup;

const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Parses an STL file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let announced =
        bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let size = announced.and_then(|n| n.checked_mul(TRIANGLE)?.checked_add(HEADER));
    if size == Some(bytes.len()) {
        return parse_binary(&bytes[HEADER..]);
    }
    let solid = bytes.trim_ascii_start().get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    if solid && !bytes.contains(&0) {
        return parse_text(bytes);
    }
    match announced {
        Some(announced) => {
            let rest = bytes.len() - HEADER;
            let holds = format!("{rest} bytes after its header, {TRIANGLE} for each triangle");
            Err(Fault::Count { what: "triangles", announced: announced as u64, holds })
        }
        None => Err(Fault::Syntax {
            at: Place::Line(1),
            expected: "the word solid or a binary header of 84 bytes".into(),
            found: super::text::quote(bytes),
        }),
    }
}

fn parse_binary(triangles: &[u8]) -> Result<PolygonSoup, Fault> {
    let mut soup = PolygonSoup::default();
    for (face, triangle) in triangles.chunks_exact(TRIANGLE).enumerate() {
        for corner in triangle[12..48].chunks_exact(12) {
            let float = |i: usize| {
                f64::from(f32::from_le_bytes([
                    corner[i],
                    corner[i + 1],
                    corner[i + 2],
                    corner[i + 3],
                ]))
            };
            push_corner(&mut soup, [float(0), float(4), float(8)], || {
                Place::Element("face", face)
            })?;
        }
        soup.end_polygon(None)?;
    }
    Ok(soup)
}

fn push_corner(
    soup: &mut PolygonSoup,
    xyz: [f64; 3],
    at: impl FnOnce() -> Place,
) -> Result<(), Fault> {
    let index = soup.vertices.len() as u32;
    soup.push_vertex(xyz, at)?;
    soup.corners.push(index);
    Ok(())
}

fn parse_text(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let mut cursor = Cursor::new(bytes, None);
    let mut soup = PolygonSoup::default();
    let mut inside_solid = false;
    while let Some(token) = cursor.token() {
        match () {
            () if !inside_solid && token.is("solid") => {
                inside_solid = true;
                cursor.next_line();
            }
            () if inside_solid && token.is("facet") => parse_facet(&mut cursor, &mut soup)?,
            () if inside_solid && token.is("endsolid") => {
                inside_solid = false;
                cursor.next_line();
            }
            () => {
                let expected = if inside_solid { "facet or endsolid" } else { "solid" };
                return Err(cursor.expected(expected, Some(token)));
            }
        }
    }
    if inside_solid {
        return Err(cursor.expected("facet or endsolid", None));
    }
    Ok(soup)
}

/// One triangle, from after the word `facet` on.
fn parse_facet(cursor: &mut Cursor<'_>, soup: &mut PolygonSoup) -> Result<(), Fault> {
    let line = cursor.line();
    keyword(cursor, "normal")?;
    for _ in 0..3 {
        // Exporters write normals of thin triangles as `-nan(ind)`; they are not needed.
        if cursor.token_on_line().is_none() {
            return Err(cursor.expected("3 components of a normal", None));
        }
    }
    keyword(cursor, "outer")?;
    keyword(cursor, "loop")?;
    for _ in 0..3 {
        keyword(cursor, "vertex")?;
        let mut xyz = [0.0; 3];
        for x in &mut xyz {
            *x = cursor.number_on_line("3 coordinates after vertex")?;
        }
        let line = cursor.line();
        push_corner(soup, xyz, || Place::Line(line))?;
    }
    keyword(cursor, "endloop")?;
    keyword(cursor, "endfacet")?;
    soup.end_polygon(Some(line))
}

fn keyword(cursor: &mut Cursor<'_>, word: &str) -> Result<(), Fault> {
    let token = cursor.token();
    if token.is_some_and(|t| t.is(word)) { Ok(()) } else { Err(cursor.expected(word, token)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACET: &str = "facet normal 0 0 -nan(ind)\n outer loop\n  vertex 0 0 0\n  \
                         vertex 1 0 0\n  vertex 0 1 0\n endloop\nendfacet\n";

    /// A binary file with a header, an announced count and some equal triangles.
    fn binary(name: &str, announced: u32, triangles: usize) -> Vec<u8> {
        let mut bytes = name.as_bytes().to_vec();
        bytes.resize(80, b' ');
        bytes.extend(announced.to_le_bytes());
        for _ in 0..triangles {
            let corners: [f32; 12] = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
            bytes.extend(corners.iter().flat_map(|c| c.to_le_bytes()));
            bytes.extend([0, 0]);
        }
        bytes
    }

    #[test]
    fn text_and_binary_by_content() {
        for text in [
            format!("solid a b\n{FACET}{FACET}endsolid a b\n"),
            format!("SOLID\n{}endsolid\nsolid\n{FACET}endsolid", FACET.to_uppercase()),
        ] {
            assert_eq!(parse(text.as_bytes()).unwrap().len(), 2, "{text}");
        }
        for name in ["", "solid x", "solid\nfacet normal 0 0 0\n"] {
            let soup = parse(&binary(name, 2, 2)).unwrap();
            assert_eq!((soup.len(), soup.vertices.len()), (2, 6));
            assert_eq!(soup.vertices[4].x, 1.0);
        }
    }

    #[test]
    fn lies_and_cuts_are_errors() {
        for (bytes, expected) in [
            (
                binary("solid", 1000, 1),
                "the header announces 1000 triangles, but the file holds 50 bytes after its header, 50 for each triangle",
            ),
            (
                binary("x", 1, 2),
                "the header announces 1 triangles, but the file holds 100 bytes after its header, 50 for each triangle",
            ),
            (
                binary("x", u32::MAX, 0),
                "the header announces 4294967295 triangles, but the file holds 0 bytes after its header, 50 for each triangle",
            ),
            (b"solid x\n".to_vec(), "end of file: expected facet or endsolid, found nothing more"),
            (
                format!("solid\n{}", &FACET[..60]).into_bytes(),
                "line 5: expected vertex, found \"vert\"",
            ),
            (
                format!("solid\n{}endsolid", FACET.replace(" endloop", " vertex 0 0 0"))
                    .into_bytes(),
                "line 7: expected endloop, found \"vertex\"",
            ),
            (
                b"PK".to_vec(),
                "line 1: expected the word solid or a binary header of 84 bytes, found \"PK\"",
            ),
        ] {
            let message = parse(&bytes).unwrap_err().to_string();
            assert_eq!(message, expected);
        }
    }
}
