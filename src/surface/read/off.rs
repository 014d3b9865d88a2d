//! OFF, the object file format of Geomview, with the prefixes `ST`, `C` and `N`.
//!
//! Choices where files in the wild differ:
//! - The keyword is required. Counts may follow it on the same line, even without a blank
//!   (`OFF490 518 0` is how ModelNet40 begins). The number of edges may be missing.
//! - One vertex and one face on each line is the rule, and then a line with too few or too many
//!   numbers is an error. Only if the file has too few lines for that, vertices or faces are taken
//!   from one stream of numbers.
//! - Colours, normals and texture coordinates are passed over.
//! - Fewer vertices or faces than announced are an error, and so are numbers after the last face:
//!   one of the counts must be wrong. Other text after it gives a warning.
//! - `4OFF`, `nOFF` and `OFF BINARY` are refused.

use super::text::{Cursor, Token};
use crate::surface::error::{Fault, Place};
use crate::surface::soup::PolygonSoup;

/// What the keyword and the counts say.
struct Header {
    vertices: usize,
    faces: usize,
    normals: bool,
    colours: bool,
    texture: bool,
}

/// Parses an OFF file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let mut cursor = Cursor::new(bytes, Some(b'#'));
    let header = parse_header(&mut cursor)?;
    let mut soup = PolygonSoup::default();
    parse_vertices(&mut cursor, &header, &mut soup)?;
    parse_faces(&mut cursor, &header, &mut soup)?;
    let last = soup.lines.last().copied().unwrap_or(0);
    if cursor.skip_empty_lines() {
        let line = cursor.line();
        let token = cursor.token_on_line();
        if token.is_some_and(|t| t.number().is_some()) {
            let expected = format!("no number after the {} announced faces", header.faces);
            return Err(cursor.expected(expected, token));
        }
        soup.warnings
            .push(format!("line {line}: text after the last face (line {last}) is ignored"));
    }
    Ok(soup)
}

fn parse_header(cursor: &mut Cursor<'_>) -> Result<Header, Fault> {
    let keyword = cursor.token();
    let (prefix, glued) = keyword
        .and_then(|t| split_keyword(t.text))
        .ok_or_else(|| cursor.expected("the keyword OFF", keyword))?;
    if matches!(prefix.last(), Some(b'4' | b'n')) {
        return Err(Fault::Unsupported(
            "OFF with four or n dimensions is not a surface in space".into(),
        ));
    }
    let first = match glued {
        [] => cursor.token(),
        text => Some(Token { text, line: cursor.line() }),
    };
    if first.is_some_and(|t| t.is("BINARY")) {
        return Err(Fault::Unsupported("binary OFF is not read; write the surface as text".into()));
    }
    let vertices = count(cursor, first, "the number of vertices")?;
    let second = cursor.token();
    let faces = count(cursor, second, "the number of faces")?;
    let same_line = second.map(|t| t.line) == first.map(|t| t.line);
    let edges = if same_line { cursor.token_on_line() } else { cursor.token() };
    if edges.is_some() {
        count(cursor, edges, "the number of edges")?;
    }
    let has = |letters: &[u8]| prefix.windows(letters.len()).any(|w| w == letters);
    let room = cursor.bytes_left();
    // The shortest vertex is `0 0 0`, the shortest face `3 0 1 2`, with a blank after each.
    for (what, announced, least) in [("vertices", vertices, 6), ("faces", faces, 8)] {
        if announced > (room + 1) / least {
            let holds = format!("only {room} bytes more");
            return Err(Fault::Count { what, announced: announced as u64, holds });
        }
    }
    let (normals, colours, texture) = (has(b"N"), has(b"C"), has(b"ST"));
    Ok(Header { vertices, faces, normals, colours, texture })
}

/// The prefix before `OFF` and the digits glued to it.
fn split_keyword(text: &[u8]) -> Option<(&[u8], &[u8])> {
    let at = text.windows(3).position(|w| w == b"OFF")?;
    let (prefix, rest) = (&text[..at], &text[at + 3..]);
    let known = [&b""[..], b"ST", b"C", b"N", b"4", b"n"];
    // The prefixes come in this order, each at most once.
    let mut left = prefix;
    for word in known {
        left = left.strip_prefix(word).unwrap_or(left);
    }
    // Writers that put them in another order are understood all the same.
    let swapped = prefix == b"NC";
    ((left.is_empty() || swapped) && rest.iter().all(u8::is_ascii_digit)).then_some((prefix, rest))
}

fn count(cursor: &Cursor<'_>, token: Option<Token<'_>>, what: &str) -> Result<usize, Fault> {
    token
        .and_then(|t| t.integer())
        .and_then(|n| usize::try_from(n).ok())
        .ok_or_else(|| cursor.expected(what, token))
}

fn parse_vertices(
    cursor: &mut Cursor<'_>,
    header: &Header,
    soup: &mut PolygonSoup,
) -> Result<(), Fault> {
    if header.vertices == 0 {
        return Ok(());
    }
    // Vertices may begin on the line of the counts, and then surely are not one on each line.
    let fresh_line = cursor.clone().token_on_line().is_none();
    let needed = header.vertices + header.faces;
    let by_line = fresh_line && cursor.lines_left(needed) >= needed;
    let extra = 3 * usize::from(header.normals) + 2 * usize::from(header.texture);
    if !by_line && header.colours {
        let (what, announced) = ("vertices and faces", needed as u64);
        let holds =
            format!("{} lines, and coloured vertices need one each", cursor.lines_left(needed));
        return Err(Fault::Count { what, announced, holds });
    }
    soup.vertices.reserve_exact(header.vertices);
    for vertex in 0..header.vertices {
        let what = || format!("3 coordinates of vertex {vertex} of {}", header.vertices);
        let mut xyz = [0.0; 3];
        if by_line {
            cursor.skip_empty_lines();
        }
        for x in &mut xyz {
            *x = if by_line { cursor.number_on_line("") } else { cursor.number("") }
                .map_err(|fault| rename(fault, what))?;
        }
        let line = cursor.line();
        soup.push_vertex(xyz, || Place::Line(line))?;
        if by_line {
            finish_vertex_line(cursor, header, extra)?;
        } else {
            for _ in 0..extra {
                cursor.number("a normal or texture coordinate")?;
            }
        }
    }
    Ok(())
}

/// Fills in what was expected, without building the sentence for every number that is fine.
fn rename(fault: Fault, what: impl FnOnce() -> String) -> Fault {
    match fault {
        Fault::Syntax { at, found, .. } => Fault::Syntax { at, expected: what(), found },
        other => other,
    }
}

/// Passes over normal, colour and texture coordinates. The number of colour components is free.
fn finish_vertex_line(cursor: &mut Cursor<'_>, header: &Header, extra: usize) -> Result<(), Fault> {
    for _ in 0..extra {
        cursor.number_on_line("a normal or texture coordinate")?;
    }
    let more = cursor.token_on_line();
    if more.is_some() && !header.colours {
        let expected = "the end of the line (colours and normals need COFF and NOFF)";
        return Err(cursor.expected(expected, more));
    }
    cursor.next_line();
    Ok(())
}

fn parse_faces(
    cursor: &mut Cursor<'_>,
    header: &Header,
    soup: &mut PolygonSoup,
) -> Result<(), Fault> {
    let by_line = cursor.lines_left(header.faces) >= header.faces;
    soup.ends.reserve_exact(header.faces);
    soup.lines.reserve_exact(header.faces);
    for face in 0..header.faces {
        if by_line {
            cursor.skip_empty_lines();
        }
        let corners = cursor
            .integer("")
            .map_err(|fault| rename(fault, || format!("face {face} of {}", header.faces)))?;
        let line = cursor.line();
        for corner in 0..corners.max(0) {
            let what = || format!("{corners} vertices of face {face}, got {corner}");
            let index = if by_line { cursor.integer_on_line("") } else { cursor.integer("") }
                .map_err(|fault| rename(fault, what))?;
            soup.corners.push(checked_index(index, soup.vertices.len(), Place::Line(line), face)?);
        }
        soup.end_polygon(Some(line))?;
        if by_line {
            finish_face_line(cursor)?;
        }
    }
    Ok(())
}

/// A face index from a file that counts from 0.
pub(super) fn checked_index(
    index: i64,
    vertices: usize,
    at: Place,
    face: usize,
) -> Result<u32, Fault> {
    match usize::try_from(index) {
        Ok(i) if i < vertices => Ok(i as u32),
        _ => Err(Fault::Index { at, face, index, vertices }),
    }
}

/// Passes over the colour of a face: an index or up to four components.
fn finish_face_line(cursor: &mut Cursor<'_>) -> Result<(), Fault> {
    for _ in 0..4 {
        if cursor.token_on_line().is_none() {
            break;
        }
    }
    let more = cursor.token_on_line();
    if more.is_some() {
        return Err(cursor.expected("at most four colour components after a face", more));
    }
    cursor.next_line();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

    fn parse_text(text: &str) -> Result<PolygonSoup, Fault> {
        parse(text.as_bytes())
    }

    #[test]
    fn layouts_of_the_same_tetrahedron() {
        let stream = TETRAHEDRON.replace('\n', " ");
        let glued = format!("OFF4 4 6\n{TETRAHEDRON}");
        for text in [
            format!("OFF\n4 4 6\n{TETRAHEDRON}"),
            format!("OFF 4 4 6\n{TETRAHEDRON}"),
            format!("OFF 4 4\n{TETRAHEDRON}"),
            format!("\u{feff}OFF\n4\n4\n6\n{TETRAHEDRON}"),
            format!("OFF 4 4 6 {stream}"),
            format!("OFF\r\n# c\r\n4 4 6 # d\r\n\r\n{}", TETRAHEDRON.replace('\n', "\r\n")),
            format!("OFF\r4 4 6\r{}", TETRAHEDRON.replace('\n', "\r")),
            TETRAHEDRON.lines().fold("COFF\n4 4 0\n".to_owned(), |t, l| {
                t + l + if l.starts_with('3') { " 0.5 0.5 0.5\n" } else { " 255 0 0 255\n" }
            }),
            TETRAHEDRON.lines().fold("NOFF\n4 4 0\n".to_owned(), |t, l| {
                t + l + if l.starts_with('3') { "\n" } else { " 0 0 1\n" }
            }),
            glued,
        ] {
            let soup = parse_text(&text).unwrap_or_else(|e| panic!("{text:?}: {e}"));
            assert_eq!((soup.vertices.len(), soup.len()), (4, 4), "{text:?}");
            assert_eq!(soup.polygon(3), [1, 2, 3], "{text:?}");
            assert_eq!(soup.vertices[3].z, 1.0);
        }
    }

    #[test]
    fn errors_name_the_line() {
        for (text, expected) in [
            ("", "end of file: expected the keyword OFF, found nothing more"),
            ("OFF", "end of file: expected the number of vertices, found nothing more"),
            ("ply\n", "line 1: expected the keyword OFF, found \"ply\""),
            ("OFF\n1 -1 0\n0 0 0\n", "line 2: expected the number of faces, found \"-1\""),
            (
                "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n",
                "line 6: expected 3 vertices of face 0, got 2, found the end of the line",
            ),
            (
                "OFF\n3 1 0\n0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n",
                "line 4: expected 3 coordinates of vertex 1 of 3, found \"x\"",
            ),
            (
                "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
                "line 6: face 0 names the vertex 3 of 3 vertices",
            ),
            (
                "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n",
                "line 6: face 0 has 2 corners; three are the least",
            ),
            (
                "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 2 1\n",
                "line 7: expected no number after the 1 announced faces, found \"3\"",
            ),
            (
                "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
                "end of file: expected face 1 of 2, found nothing more",
            ),
            (
                "OFF\n1000000000 2 0\n0 0 0\n",
                "the header announces 1000000000 vertices, but the file holds only 7 bytes more",
            ),
            (
                "OFF\n1 1 0\n0 1e999 0\n3 0 0 0\n",
                "line 3: vertex 0 has the coordinate inf, which is not finite",
            ),
            ("OFF BINARY\n", "binary OFF is not read; write the surface as text"),
            ("4OFF\n", "OFF with four or n dimensions is not a surface in space"),
        ] {
            assert_eq!(parse_text(text).unwrap_err().to_string(), expected, "{text:?}");
        }
        let trailing = parse_text(&format!("OFF\n4 4 6\n{TETRAHEDRON}\nthe end\n")).unwrap();
        assert_eq!(trailing.warnings.len(), 1);
    }
}
