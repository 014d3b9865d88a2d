//! OFF, the object file format of Geomview, with the prefixes `ST`, `C` and `N`. Where files in the wild differ: the
//! keyword is required, counts may follow it even without a blank (`OFF490 518 0` is how ModelNet40 begins), the
//! number of edges may be missing. A line with too few or too many numbers is an error; only if the file has too few
//! lines for one vertex or face on each, they are taken from one stream of numbers. Numbers after the last face are an
//! error, since a count must be wrong; other text after it gives a warning. `4OFF`, `nOFF`, `OFF BINARY` are errors.

use super::report::{Fault, Place};
use super::soup::{PolygonSoup, checked_index};
use super::text::{Cursor, Token, count};

/// The keyword and the counts of an OFF file.
struct OffHeader {
    vertices: usize,
    faces: usize,
    normals: bool,
    colours: bool,
    texture: bool,
}

/// Parses an OFF file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let mut cursor = Cursor::new(bytes, Some(b'#'));
    let header = parse_off_header(&mut cursor)?;
    let mut soup = PolygonSoup::default();
    parse_vertices(&mut cursor, &header, &mut soup)?;
    parse_faces(&mut cursor, &header, &mut soup)?;
    let last = soup.lines.last().copied().unwrap_or(0);
    if cursor.skip_empty_lines() {
        let line = cursor.line;
        let token = cursor.token_on_line();
        if token.is_some_and(|t| t.parse::<f64>().is_some()) {
            let faces = header.faces;
            let expected = format_args!("no number after the {faces} announced faces");
            return Err(cursor.expected(expected, token));
        }
        soup.warnings
            .push(format!("line {line}: text after the last face (line {last}) is ignored"));
    }
    Ok(soup)
}

fn parse_off_header(cursor: &mut Cursor<'_>) -> Result<OffHeader, Fault> {
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
        text => Some(Token { text, line: cursor.line }),
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
    let room = cursor.bytes.len() - cursor.at;
    // The shortest vertex is `0 0 0`, the shortest face `3 0 1 2`, with a blank after each.
    for (what, announced, least) in [("vertices", vertices, 6), ("faces", faces, 8)] {
        if announced > (room + 1) / least {
            let holds = format!("only {room} bytes more");
            return Err(Fault::Count { what, announced: announced as u64, holds });
        }
    }
    // The prefix is made of ST, C and N alone, so no letter is ambiguous.
    let (normals, colours) = (prefix.contains(&b'N'), prefix.contains(&b'C'));
    let texture = prefix.starts_with(b"ST");
    Ok(OffHeader { vertices, faces, normals, colours, texture })
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
    // Writers that put them in another order are still understood.
    let swapped = prefix == b"NC";
    ((left.is_empty() || swapped) && rest.iter().all(u8::is_ascii_digit)).then_some((prefix, rest))
}

fn parse_vertices(
    cursor: &mut Cursor<'_>,
    header: &OffHeader,
    soup: &mut PolygonSoup,
) -> Result<(), Fault> {
    if header.vertices == 0 {
        return Ok(());
    }
    // Vertices may begin on the line of the counts, and then surely are not one on each line.
    let fresh_line = cursor.clone().token_on_line().is_none();
    // No overflow: both were compared with the size of the file.
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
    let mut is_ignored = false;
    for vertex in 0..header.vertices {
        let mut xyz = [0.0; 3];
        if by_line {
            cursor.skip_empty_lines();
        }
        for x in &mut xyz {
            let what = format_args!("3 coordinates of vertex {vertex} of {}", header.vertices);
            *x = if by_line { cursor.number_on_line(what)? } else { cursor.number(what)? };
        }
        let line = cursor.line;
        soup.push_vertex(xyz, || Place::Line(line))?;
        if by_line {
            is_ignored |= finish_vertex_line(cursor, header, extra)?;
        } else {
            for _ in 0..extra {
                cursor.number::<f64>("a normal or texture coordinate")?;
            }
        }
    }
    if is_ignored {
        soup.warnings.push("numbers after the coordinates of vertices are ignored".to_owned());
    }
    Ok(())
}

/// Passes over normal, colour and texture coordinates. The number of colour components is free. Returns whether the line
/// has a colour or normal that the header does not announce.
fn finish_vertex_line(
    cursor: &mut Cursor<'_>,
    header: &OffHeader,
    extra: usize,
) -> Result<bool, Fault> {
    for _ in 0..extra {
        cursor.number_on_line::<f64>("a normal or texture coordinate")?;
    }
    let more = cursor.token_on_line();
    let is_ignored = more.is_some() && !header.colours;
    if is_ignored {
        let mut line = cursor.clone();
        let rest: Vec<_> = std::iter::from_fn(|| line.token_on_line()).chain(more).collect();
        // Red, green, blue, with or without a fourth component; or a normal.
        let is_colour = rest.len() == 3 || rest.len() == 4;
        if !is_colour || rest.iter().any(|token| token.parse::<f64>().is_none()) {
            let expected = "the end of the line (other numbers than a colour need a prefix of OFF)";
            return Err(cursor.expected(expected, more));
        }
    }
    cursor.next_line();
    Ok(is_ignored)
}

fn parse_faces(
    cursor: &mut Cursor<'_>,
    header: &OffHeader,
    soup: &mut PolygonSoup,
) -> Result<(), Fault> {
    let by_line = cursor.lines_left(header.faces) >= header.faces;
    // Bounded by the size of the file, see `parse_off_header`; corners grow as they come.
    soup.ends.reserve_exact(header.faces);
    soup.lines.reserve_exact(header.faces);
    for face in 0..header.faces {
        if by_line {
            cursor.skip_empty_lines();
        }
        let corners: i64 = cursor.number(format_args!("face {face} of {}", header.faces))?;
        let line = cursor.line;
        for corner in 0..corners.max(0) {
            let what = format_args!("{corners} vertices of face {face}, got {corner}");
            let index = if by_line { cursor.number_on_line(what)? } else { cursor.number(what)? };
            soup.corners.push(checked_index(index, soup.vertices.len(), &Place::Line(line), face)?);
        }
        soup.end_polygon(Some(line))?;
        if by_line {
            finish_face_line(cursor)?;
        }
    }
    Ok(())
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
