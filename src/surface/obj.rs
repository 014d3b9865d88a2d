//! Wavefront OBJ: the statements `v` and `f`. A face may name vertices that follow it; negative indices count back from
//! the last vertex before the face. Weights and colours of vertices are passed over. The crate `tobj` joins no lines
//! that end with a backslash, takes a face of two corners for a line, and numbers vertices by their first use: other
//! vertex order, other samples, other results.

use super::report::{Fault, Place};
use super::soup::PolygonSoup;
use super::text::{Cursor, Token, quote};

/// Keywords of the format that do not concern the surface. Others give a warning: the format may be another one.
const PASSED_OVER: &str = " vn vt vp g o s l p usemtl mtllib usemap maplib mg vc bevel bmat bsp bzp c_interp call con csh \
    cstype ctech curv curv2 d_interp deg end hole lod parm res scrv shadow_obj sp stech step trace_obj trim ";

/// Parses an OBJ file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let mut cursor = Cursor { joins: true, ..Cursor::new(bytes, Some(b'#')) };
    let mut soup = PolygonSoup::default();
    // The largest corner so far, from 1, and the face that names it: vertices may follow their faces.
    let mut largest = (0, 0);
    let mut unknown = (0, String::new());
    while let Some(keyword) = cursor.token() {
        match keyword.text {
            b"v" => {
                let xyz = cursor.position_on_line("3 coordinates after v")?;
                soup.push_vertex(xyz, || Place::Line(keyword.line))?;
            }
            b"f" | b"fo" => {
                let (face, vertices) = (soup.len(), soup.vertices.len());
                while let Some(token) = cursor.token_on_line() {
                    let index = obj_index(token)
                        .ok_or_else(|| cursor.expected("v, v/vt, v//vn or v/vt/vn", Some(token)))?;
                    let from_one = match index {
                        0.. => Some(index),
                        _ => (vertices as i64).checked_add(index).map(|before| before + 1),
                    };
                    match from_one.filter(|&corner| (1..=i64::from(u32::MAX)).contains(&corner)) {
                        Some(corner) => {
                            // Of equal corners the first face wins, hence the reversed index.
                            largest = largest.max((corner, usize::MAX - face));
                            soup.corners.push((corner - 1) as u32);
                        }
                        None => {
                            let at = Place::Line(token.line);
                            return Err(Fault::Index { at, face, index, vertices });
                        }
                    }
                }
                soup.end_polygon(Some(keyword.line))?;
            }
            b"surf" => {
                let what = "free-form surfaces are not read; export the surface as polygons";
                return Err(Fault::Unsupported(format!("line {}: {what}", keyword.line)));
            }
            other => {
                let known = PASSED_OVER.split(' ').any(|word| word.as_bytes() == other);
                if !known && unknown.0 == 0 {
                    unknown.1 = format!("{} on line {}", quote(other), keyword.line);
                }
                unknown.0 += usize::from(!known);
            }
        }
        cursor.next_line();
    }
    let (index, face, vertices) = (largest.0, usize::MAX - largest.1, soup.vertices.len());
    if index > vertices as i64 {
        return Err(Fault::Index { at: soup.place(face), face, index, vertices });
    }
    if unknown.0 > 0 {
        let (lines, first) = unknown;
        let what = "lines with unknown keywords are ignored, the first is";
        soup.warnings.push(format!("{lines} {what} {first}"));
    }
    Ok(soup)
}

/// The first of the up to three indices of a corner; all have to be integers where present.
fn obj_index(token: Token<'_>) -> Option<i64> {
    let mut parts = token.text.split(|&b| b == b'/').map(|text| Token { text, line: token.line });
    let vertex = parts.next()?.parse()?;
    let others: Vec<Token<'_>> = parts.collect();
    let are_indices =
        others.iter().all(|part| part.text.is_empty() || part.parse::<i64>().is_some());
    (others.len() <= 2 && are_indices).then_some(vertex)
}
