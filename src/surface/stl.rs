//! STL, text and binary, distinguished by content: a binary file has 84 bytes and 50 for each announced triangle,
//! with any first words. The crate `stl_io` takes a binary file that begins with `solid` for text, and reads
//! text in single precision.

use super::report::{Fault, Place, counted};
use super::soup::PolygonSoup;
use super::text::{Cursor, Token, quote};

const STL_HEADER: usize = 84;
const STL_TRIANGLE: usize = 50;

/// Parses an STL file, text or binary.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let count =
        bytes.get(80..).and_then(|rest| rest.first_chunk().copied()).map(u32::from_le_bytes);
    let Some((announced, triangles)) = count.map(|count| (count as usize, &bytes[STL_HEADER..]))
    else {
        return parse_stl_text(bytes);
    };
    let mut soup = PolygonSoup::default();
    // Many binary files begin with `solid`, so the size decides.
    if announced.checked_mul(STL_TRIANGLE) != Some(triangles.len()) {
        if is_stl_text(bytes) {
            return parse_stl_text(bytes);
        }
        let rest =
            announced.checked_mul(STL_TRIANGLE).and_then(|all| triangles.len().checked_sub(all));
        // A remainder with whole triangles means that the count is wrong.
        let Some(rest) = rest.filter(|&rest| announced > 0 && rest < STL_TRIANGLE) else {
            let holds = format!(
                "{} bytes after its header, {STL_TRIANGLE} for each triangle",
                triangles.len()
            );
            return Err(Fault::Count { what: "triangles", announced: announced as u64, holds });
        };
        let behind = counted(announced, "triangle");
        soup.warnings.push(format!("{} after {behind} ignored", counted(rest, "byte")));
    }
    for (face, triangle) in triangles.chunks_exact(STL_TRIANGLE).take(announced).enumerate() {
        // Behind the normal; attribute bytes follow.
        let (numbers, _) = triangle[12..48].as_chunks();
        for corner in numbers.chunks_exact(3) {
            let xyz = [corner[0], corner[1], corner[2]].map(|x| f64::from(f32::from_le_bytes(x)));
            soup.push_corner(xyz, || Place::Element("face", face))?;
        }
        soup.end_polygon(None)?;
    }
    Ok(soup)
}

fn is_stl_text(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let word = bytes.trim_ascii_start().get(..5);
    word.is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !bytes.contains(&0)
}

fn parse_stl_text(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    if !is_stl_text(bytes) {
        let (at, found) = (Place::Line(1), quote(bytes));
        let expected = "the word solid or a binary header of 84 bytes".to_owned();
        return Err(Fault::Syntax { at, expected, found });
    }
    let mut cursor = Cursor::new(bytes, None);
    let mut soup = PolygonSoup::default();
    let mut is_inside = false;
    while let Some(token) = cursor.token() {
        let line = cursor.line;
        if is_inside && token.is("facet") {
            // The normal may be anything, also `-nan(ind)`.
            keyword(&mut cursor, "normal")?;
            for _ in 0..3 {
                if cursor.token_on_line().is_none() {
                    return Err(cursor.expected("3 components of a normal", None));
                }
            }
            keyword(&mut cursor, "outer")?;
            keyword(&mut cursor, "loop")?;
            for _ in 0..3 {
                keyword(&mut cursor, "vertex")?;
                let xyz = cursor.position_on_line("3 coordinates after vertex")?;
                soup.push_corner(xyz, || Place::Line(cursor.line))?;
            }
            end_of(&mut cursor, "loop")?;
            end_of(&mut cursor, "facet")?;
            soup.end_polygon(Some(line))?;
        } else if token.is("solid") != is_inside
            && (token.is("solid") || ends(&mut cursor, token, "solid"))
        {
            is_inside = !is_inside;
            cursor.next_line();
        } else {
            let expected = if is_inside { "facet or endsolid" } else { "solid" };
            return Err(cursor.expected(expected, Some(token)));
        }
    }
    if is_inside { Err(cursor.expected("facet or endsolid", None)) } else { Ok(soup) }
}

fn keyword(cursor: &mut Cursor<'_>, word: &str) -> Result<(), Fault> {
    let token = cursor.token();
    if token.is_some_and(|t| t.is(word)) { Ok(()) } else { Err(cursor.expected(word, token)) }
}

/// Whether a token, with the next one of the line where it is `end` alone, ends a block: some programs write `end loop`.
fn ends(cursor: &mut Cursor<'_>, token: Token<'_>, block: &str) -> bool {
    let [first, rest] = token.text.split_at_checked(3).map_or([token.text, b""], |(a, b)| [a, b]);
    if !first.eq_ignore_ascii_case(b"end") {
        return false;
    }
    match rest {
        [] => cursor.token_on_line().is_some_and(|next| next.is(block)),
        rest => rest.eq_ignore_ascii_case(block.as_bytes()),
    }
}

fn end_of(cursor: &mut Cursor<'_>, block: &str) -> Result<(), Fault> {
    let token = cursor.token();
    match token {
        Some(token) if ends(cursor, token, block) => Ok(()),
        _ => Err(cursor.expected(format_args!("end{block}"), token)),
    }
}
