//! From the bytes of a file to a polygon soup.
//!
//! - OFF, the object file format of Geomview, with the prefixes `ST`, `C` and `N`. Where files in the wild differ: the
//!   keyword is required, counts may follow it even without a blank (`OFF490 518 0` is how ModelNet40 begins), the
//!   number of edges may be missing. A line with too few or too many numbers is an error; only if the file has too few
//!   lines for one vertex or face on each, they are taken from one stream of numbers. Numbers after the last face are an
//!   error, since a count must be wrong; other text after it gives a warning. `4OFF`, `nOFF`, `OFF BINARY` are errors.
//! - Wavefront OBJ: the statements `v` and `f`. A face may name vertices that follow it; negative indices count back from
//!   the last vertex before the face. Weights and colours of vertices are passed over. The crate `tobj` joins no lines
//!   that end with a backslash, takes a face of two corners for a line, and numbers vertices by their first use: other
//!   vertex order, other samples, other results.
//! - STL, text and binary, distinguished by content: a binary file has 84 bytes and 50 for each announced triangle,
//!   with any first words. The crate `stl_io` takes a binary file that begins with `solid` for text, and reads
//!   text in single precision.
//! - PLY: [`super::ply`].
//!
//! Counts are compared with the size of the file before memory is reserved for them.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use super::ply;
use super::report::{Fault, Place};
use crate::{Vec3, quoted, read_regular};

/// A surface file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Geomview's object file format, with colours and normals passed over.
    Off,
    /// Wavefront OBJ.
    Obj,
    /// Stanford polygon file format, text or binary.
    Ply,
    /// Stereolithography, text or binary.
    Stl,
}

impl Format {
    /// The format of a path's extension, in upper or lower case.
    ///
    /// # Errors
    /// [`Fault::UnknownFormat`] when it is unknown.
    pub fn of(path: &Path) -> Result<Self, Fault> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match extension.as_str() {
            "off" | "coff" | "noff" | "cnoff" | "stoff" => Ok(Self::Off),
            "obj" => Ok(Self::Obj),
            "ply" => Ok(Self::Ply),
            "stl" => Ok(Self::Stl),
            _ => Err(Fault::UnknownFormat { extension }),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Off => "OFF",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
        })
    }
}

/// Parses the content of a file.
pub(super) fn parse(bytes: &[u8], format: Format) -> Result<PolygonSoup, Fault> {
    let soup = match format {
        Format::Off => parse_off(bytes),
        Format::Obj => parse_obj(bytes),
        Format::Ply => parse_ply(bytes),
        Format::Stl => parse_stl(bytes),
    }?;
    match soup.len() {
        0 => Err(Fault::NoFaces { vertices: soup.vertices.len() }),
        _ => Ok(soup),
    }
}

/// The content of a regular file: a pipe or a device may never end.
pub(super) fn content(path: &Path) -> Result<Vec<u8>, Fault> {
    read_regular(path).map_err(|error| Fault::Io(format!("cannot be read: {error}")))
}

// The soup.

/// Positions and polygons as read, with the lines they came from.
#[derive(Clone, Debug, Default)]
pub(super) struct PolygonSoup {
    /// Finite positions in the unit of the file.
    pub vertices: Vec<Vec3>,
    /// Corners of all polygons, one polygon after the other; valid vertex indices.
    pub corners: Vec<u32>,
    /// For each polygon the end of its corners in `corners`.
    pub ends: Vec<u32>,
    /// Line of each polygon, or nothing for a binary file.
    pub lines: Vec<u32>,
    /// Skipped parts of the file.
    pub warnings: Vec<String>,
}

impl PolygonSoup {
    /// The triangles of arrays; places are numbers of rows.
    ///
    /// # Errors
    /// When a coordinate is not finite, a corner is no vertex, or there are too many.
    pub fn of_triangles(vertices: &[Vec3], faces: &[[u32; 3]]) -> Result<Self, Fault> {
        let mut soup = Self::default();
        for (row, vertex) in vertices.iter().enumerate() {
            soup.push_vertex(vertex.to_array(), || Place::Element("vertex", row))?;
        }
        for (face, corners) in faces.iter().enumerate() {
            let at = Place::Element("face", face);
            for &corner in corners {
                soup.corners.push(checked_index(corner.into(), vertices.len(), &at, face)?);
            }
            soup.end_polygon(None)?;
        }
        Ok(soup)
    }

    /// Number of polygons.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// The corners of a polygon.
    pub fn polygon(&self, index: usize) -> &[u32] {
        let start = if index == 0 { 0 } else { self.ends[index - 1] as usize };
        &self.corners[start..self.ends[index] as usize]
    }

    /// The place of a polygon in the file.
    pub fn place(&self, index: usize) -> Place {
        match self.lines.get(index) {
            Some(&line) => Place::Line(line as usize),
            None => Place::Element("face", index),
        }
    }

    /// Adds a position.
    ///
    /// # Errors
    /// When a coordinate is not finite, or there are too many vertices.
    pub fn push_vertex(
        &mut self,
        [x, y, z]: [f64; 3],
        at: impl FnOnce() -> Place,
    ) -> Result<(), Fault> {
        let vertex = self.vertices.len();
        if let Some(value) = [x, y, z].into_iter().find(|c| !c.is_finite()) {
            return Err(Fault::Coordinate { at: at(), vertex, value });
        }
        if vertex >= MAX_FACES {
            return Err(Fault::TooLarge { what: "vertices", count: vertex as u64 + 1 });
        }
        self.vertices.push(Vec3::new(x, y, z));
        Ok(())
    }

    /// Adds a position with a new corner.
    fn push_corner(&mut self, xyz: [f64; 3], at: impl FnOnce() -> Place) -> Result<(), Fault> {
        self.push_vertex(xyz, at)?;
        self.corners.push(self.vertices.len() as u32 - 1);
        Ok(())
    }

    /// Ends the polygon whose corners were pushed since the last one.
    ///
    /// # Errors
    /// When it has fewer than three corners, or there are too many.
    pub fn end_polygon(&mut self, line: Option<usize>) -> Result<(), Fault> {
        let start = self.ends.last().map_or(0, |&end| end as usize);
        let (face, corners) = (self.len(), self.corners.len() - start);
        if corners < 3 {
            let at = line.map_or(Place::Element("face", face), Place::Line);
            return Err(Fault::TooFewCorners { at, face, corners });
        }
        if self.corners.len() > MAX_FACES {
            return Err(Fault::TooLarge { what: "corners", count: self.corners.len() as u64 });
        }
        self.ends.push(self.corners.len() as u32);
        self.lines.extend(line.map(|line| line.min(u32::MAX as usize) as u32));
        Ok(())
    }
}

/// Bound on the number of faces: half-edge indices, three for each triangle, have to fit 32 bits with
/// one value to spare.
const MAX_FACES: usize = (u32::MAX - 1) as usize / 3;

// Tokens of a text file with their line numbers.

/// A position in a text file. Lines end with LF, CRLF or CR.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Number of the current line, from 1.
    pub line: usize,
    /// Starts a comment that lasts to the end of the line.
    comment: Option<u8>,
    /// Whether a backslash at the end of a line joins it with the next.
    joins: bool,
}

/// A run of bytes between blanks.
#[derive(Clone, Copy)]
pub(super) struct Token<'a> {
    text: &'a [u8],
    line: usize,
}

impl<'a> Cursor<'a> {
    /// The start of a file, after a byte-order mark.
    fn new(bytes: &'a [u8], comment: Option<u8>) -> Self {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self { bytes, at: 0, line: 1, comment, joins: false }
    }

    /// Rows whose first line has this number, without comments.
    pub fn at_line(bytes: &'a [u8], line: usize) -> Self {
        Self { bytes, at: 0, line, comment: None, joins: false }
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// Length of the line end at `at`, or 0.
    fn line_end(&self, at: usize) -> usize {
        match self.bytes.get(at) {
            Some(b'\n') => 1,
            Some(b'\r') if self.bytes.get(at + 1) == Some(&b'\n') => 2,
            Some(b'\r') => 1,
            _ => 0,
        }
    }

    /// Length of a backslash and line end at `at`, or 0.
    fn line_join(&self, at: usize) -> usize {
        if !self.joins || self.bytes.get(at) != Some(&b'\\') {
            return 0;
        }
        // Blanks between the backslash and the line end are forgiven.
        let blanks = self.bytes[at + 1..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
        match self.line_end(at + 1 + blanks) {
            0 => 0,
            end => 1 + blanks + end,
        }
    }

    fn skip_blanks(&mut self) {
        while let Some(byte) = self.peek() {
            let join = self.line_join(self.at);
            if join > 0 {
                self.at += join;
                self.line += 1;
            } else if matches!(byte, b' ' | b'\t' | 0x0b | 0x0c) {
                self.at += 1;
            } else {
                break;
            }
        }
        if self.comment.is_some() && self.peek() == self.comment {
            while self.at < self.bytes.len() && self.line_end(self.at) == 0 {
                self.at += 1;
            }
        }
    }

    /// The next token of this line.
    pub fn token_on_line(&mut self) -> Option<Token<'a>> {
        self.skip_blanks();
        let start = self.at;
        while let Some(byte) = self.peek() {
            if byte.is_ascii_whitespace()
                || byte == 0x0b
                || Some(byte) == self.comment
                || self.line_join(self.at) > 0
            {
                break;
            }
            self.at += 1;
        }
        (self.at > start).then(|| Token { text: &self.bytes[start..self.at], line: self.line })
    }

    /// The next token of this or a later line.
    fn token(&mut self) -> Option<Token<'a>> {
        loop {
            if let Some(token) = self.token_on_line() {
                return Some(token);
            }
            if !self.next_line() {
                return None;
            }
        }
    }

    /// Passes over the rest of this line; false at the end of the file.
    pub fn next_line(&mut self) -> bool {
        while self.at < self.bytes.len() {
            let join = self.line_join(self.at);
            let end = self.line_end(self.at);
            self.at += (join + end).max(1);
            if join + end > 0 {
                self.line += 1;
            }
            if end > 0 && join == 0 {
                return true;
            }
        }
        false
    }

    /// Goes to the next line that holds a token, unless one is left on this line.
    pub fn skip_empty_lines(&mut self) -> bool {
        loop {
            self.skip_blanks();
            if self.at >= self.bytes.len() {
                return false;
            }
            if self.line_end(self.at) == 0 {
                return true;
            }
            self.next_line();
        }
    }

    /// Number of lines with a token, from here on, counted no further than `limit`.
    fn lines_left(&self, limit: usize) -> usize {
        let mut ahead = self.clone();
        let mut count = 0;
        while count < limit && ahead.skip_empty_lines() {
            count += 1;
            ahead.next_line();
        }
        count
    }

    /// A fault: another text, or none, in place of the expected one.
    pub fn expected(&self, expected: impl fmt::Display, found: Option<Token<'_>>) -> Fault {
        let (at, found) = match found {
            Some(token) => (Place::Line(token.line), quote(token.text)),
            None if self.at >= self.bytes.len() => (Place::End, "nothing more".to_owned()),
            None => (Place::Line(self.line), "the end of the line".to_owned()),
        };
        Fault::Syntax { at, expected: expected.to_string(), found }
    }

    // Expectations are formatted for faults alone: millions of numbers are as expected.

    /// The next token of this line as a number.
    pub fn number_on_line<T: FromStr>(&mut self, what: impl fmt::Display) -> Result<T, Fault> {
        let token = self.token_on_line();
        token.and_then(|t| t.parse()).ok_or_else(|| self.expected(what, token))
    }

    /// The next token, on this line or a later one, as a number.
    fn number<T: FromStr>(&mut self, what: impl fmt::Display) -> Result<T, Fault> {
        let token = self.token();
        token.and_then(|t| t.parse()).ok_or_else(|| self.expected(what, token))
    }

    /// The next three tokens of this line as numbers.
    fn position_on_line(&mut self, what: &str) -> Result<[f64; 3], Fault> {
        Ok([self.number_on_line(what)?, self.number_on_line(what)?, self.number_on_line(what)?])
    }
}

impl Token<'_> {
    /// The token as a number; `nan` and `inf` are floating-point numbers here.
    fn parse<T: FromStr>(&self) -> Option<T> {
        std::str::from_utf8(self.text).ok()?.parse().ok()
    }

    /// Whether the token is this word, in upper or lower case.
    fn is(&self, word: &str) -> bool {
        self.text.eq_ignore_ascii_case(word.as_bytes())
    }
}

/// Text from a file for a message: shortened, unreadable bytes replaced.
fn quote(text: &[u8]) -> String {
    /// More bytes than [`quoted`] takes characters.
    const ENOUGH: usize = 400;
    quoted(&String::from_utf8_lossy(&text[..text.len().min(ENOUGH)]))
}

// OFF.

/// The keyword and the counts of an OFF file.
struct OffHeader {
    vertices: usize,
    faces: usize,
    normals: bool,
    colours: bool,
    texture: bool,
}

/// Parses an OFF file.
fn parse_off(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
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

/// A token as a number of things.
pub(super) fn count(
    cursor: &Cursor<'_>,
    token: Option<Token<'_>>,
    what: impl fmt::Display,
) -> Result<usize, Fault> {
    token
        .and_then(|t| t.parse::<i64>())
        .and_then(|n| usize::try_from(n).ok())
        .ok_or_else(|| cursor.expected(what, token))
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
            finish_vertex_line(cursor, header, extra)?;
        } else {
            for _ in 0..extra {
                cursor.number::<f64>("a normal or texture coordinate")?;
            }
        }
    }
    Ok(())
}

/// Passes over normal, colour and texture coordinates. The number of colour components is free.
fn finish_vertex_line(
    cursor: &mut Cursor<'_>,
    header: &OffHeader,
    extra: usize,
) -> Result<(), Fault> {
    for _ in 0..extra {
        cursor.number_on_line::<f64>("a normal or texture coordinate")?;
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

/// A face index from a file that counts from 0.
fn checked_index(index: i64, vertices: usize, at: &Place, face: usize) -> Result<u32, Fault> {
    match usize::try_from(index) {
        Ok(i) if i < vertices => Ok(i as u32),
        _ => Err(Fault::Index { at: at.clone(), face, index, vertices }),
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

// OBJ.

/// Keywords of the format that do not concern the surface. Others give a warning: the format may be another one.
const PASSED_OVER: &str = " vn vt vp g o s l p usemtl mtllib usemap maplib mg vc bevel bmat bsp bzp c_interp call con csh \
    cstype ctech curv curv2 d_interp deg end hole lod parm res scrv shadow_obj sp stech step trace_obj trim ";

fn parse_obj(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
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

// STL.

const STL_HEADER: usize = 84;
const STL_TRIANGLE: usize = 50;

fn parse_stl(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let count =
        bytes.get(80..).and_then(|rest| rest.first_chunk().copied()).map(u32::from_le_bytes);
    let Some((announced, triangles)) = count.map(|count| (count as usize, &bytes[STL_HEADER..]))
    else {
        return parse_stl_text(bytes);
    };
    // Many binary files begin with `solid`, so the size decides.
    if announced.checked_mul(STL_TRIANGLE) != Some(triangles.len()) {
        if is_stl_text(bytes) {
            return parse_stl_text(bytes);
        }
        let rest = triangles.len();
        let holds = format!("{rest} bytes after its header, {STL_TRIANGLE} for each triangle");
        return Err(Fault::Count { what: "triangles", announced: announced as u64, holds });
    }
    let mut soup = PolygonSoup::default();
    for (face, triangle) in triangles.chunks_exact(STL_TRIANGLE).enumerate() {
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
            keyword(&mut cursor, "endloop")?;
            keyword(&mut cursor, "endfacet")?;
            soup.end_polygon(Some(line))?;
        } else if token.is(if is_inside { "endsolid" } else { "solid" }) {
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

// PLY.

fn parse_ply(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let file = ply::header(bytes)?;
    let vertices = file.count("vertex");
    if file.elements.iter().any(|element| element.name == "tristrips") {
        let what = "PLY triangle strips are not read; export the surface as faces";
        return Err(Fault::Unsupported(what.into()));
    }
    if ["x", "y", "z"].iter().any(|axis| !file.has("vertex", &[axis])) {
        return Err(missing_in(&file, "element vertex with x, y and z before it"));
    }
    if !file.elements.iter().any(|element| element.name == "face") {
        return Err(Fault::NoFaces { vertices });
    }
    if !file.has("face", &["vertex_indices", "vertex_index"]) {
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

fn missing_in(file: &ply::Ply<'_>, expected: &str) -> Fault {
    let (at, found) = (Place::Line(file.line - 1), quote(b"end_header"));
    Fault::Syntax { at, expected: expected.to_owned(), found }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
    const FACET: &str = "facet normal 0 0 -nan(ind)\n outer loop\n  vertex 0 0 0\n  \
                         vertex 1 0 0\n  vertex 0 1 0\n endloop\nendfacet\n";
    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 0.1 0\n3 0 1 2\n";

    fn refuses(format: Format, text: &str, expected: &str) {
        assert_eq!(parse(text.as_bytes(), format).unwrap_err().to_string(), expected, "{text:?}");
    }

    #[test]
    fn lines_are_counted_for_every_kind_of_line_end_and_joined_only_in_obj() {
        for end in ["\n", "\r\n", "\r"] {
            let text = ["a b", "# c", "", "d#e", "f"].join(end);
            let mut cursor = Cursor::new(text.as_bytes(), Some(b'#'));
            assert_eq!(cursor.lines_left(9), 3);
            let tokens: Vec<_> =
                std::iter::from_fn(|| cursor.token()).map(|t| (t.text, t.line)).collect();
            assert_eq!(tokens, [(&b"a"[..], 1), (b"b", 1), (b"d", 4), (b"f", 5)]);
        }
        let text = b"f 1 2\\\n 3 \\ \r\n4\ng";
        let mut cursor = Cursor { joins: true, ..Cursor::new(text, Some(b'#')) };
        let line: Vec<_> = std::iter::from_fn(|| cursor.token_on_line()).map(|t| t.text).collect();
        assert_eq!(line, [&b"f"[..], b"1", b"2", b"3", b"4"]);
        assert!(cursor.next_line());
        assert_eq!(cursor.line, 4);
        let mut cursor = Cursor::new(text, None);
        assert_eq!(std::iter::from_fn(|| cursor.token()).count(), 7);
    }

    #[test]
    fn layouts_of_the_same_tetrahedron_in_off() {
        let stream = TETRAHEDRON.replace('\n', " ");
        for text in [
            format!("OFF\n4 4 6\n{TETRAHEDRON}"),
            format!("OFF 4 4\n{TETRAHEDRON}"),
            format!("OFF4 4 6\n{TETRAHEDRON}"),
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
        ] {
            let soup = parse_off(text.as_bytes()).unwrap_or_else(|e| panic!("{text:?}: {e}"));
            assert_eq!((soup.vertices.len(), soup.len()), (4, 4), "{text:?}");
            assert_eq!((soup.polygon(3), soup.vertices[3]), (&[1, 2, 3][..], Vec3::Z), "{text:?}");
        }
        let trailing = parse_off(format!("OFF\n4 4 6\n{TETRAHEDRON}\nthe end\n").as_bytes());
        assert_eq!(trailing.unwrap().warnings.len(), 1);
    }

    #[test]
    fn statements_of_obj_that_matter() {
        let text = "# c\nmtllib a b.mtl\nf 1 2/1 3//1 \\\n 4/1/1\nv 0 0 0\nv 1 0 0 1.0\n\
                    v 1 1 0 255 0 0\nv 0 1 0\nf -4 -3 -2\r\nusemtl x\n";
        let soup = parse_obj(text.as_bytes()).unwrap();
        assert_eq!((soup.polygon(0), soup.polygon(1)), (&[0, 1, 2, 3][..], &[0, 1, 2][..]));
        assert_eq!((soup.vertices.len(), &*soup.lines, soup.warnings), (4, &[3, 9][..], vec![]));
        assert_eq!(parse_obj(b"hello world\n\nvx\n").unwrap().warnings.len(), 1);
    }

    /// A binary STL file with a header, an announced count and some equal triangles.
    fn binary_stl(name: &str, announced: u32, triangles: usize) -> Vec<u8> {
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
    fn text_and_binary_stl_by_content() {
        for text in [
            format!("solid a b\n{FACET}{FACET}endsolid a b\n"),
            format!("SOLID\n{}endsolid\nsolid\n{FACET}endsolid", FACET.to_uppercase()),
        ] {
            assert_eq!(parse_stl(text.as_bytes()).unwrap().len(), 2, "{text}");
        }
        for name in ["", "solid x", "solid\nfacet normal 0 0 0\n"] {
            let soup = parse_stl(&binary_stl(name, 2, 2)).unwrap();
            assert_eq!((soup.len(), soup.vertices.len(), soup.vertices[4].x), (2, 6, 1.0));
        }
        for (name, announced, triangles, holds) in
            [("solid", 1000, 1, 50), ("x", 1, 2, 100), ("x", u32::MAX, 0, 0)]
        {
            let error = parse_stl(&binary_stl(name, announced, triangles)).unwrap_err();
            let expected = format!(
                "the header announces {announced} triangles, but the file holds {holds} bytes after its header, 50 for \
                 each triangle"
            );
            assert_eq!(error.to_string(), expected);
        }
    }

    #[test]
    fn ply_in_double_precision_and_binary_with_the_element_at_fault() {
        let soup = parse_ply(PLY.as_bytes()).unwrap();
        assert_eq!((&*soup.lines, soup.vertices[2].y), (&[13][..], 0.1));
        assert_eq!(parse_ply(PLY.replace('\n', "\r\n").as_bytes()).unwrap().lines, [13]);
        let header = PLY.replace("ascii", "binary_big_endian");
        let mut file = header.as_bytes()[..header.find("0 0 0").unwrap()].to_vec();
        for x in [0_f32, 0., 0., 1., 0., 0., 0., 1., 0.] {
            file.extend(x.to_be_bytes());
        }
        file.push(3);
        file.extend([0_i32, 1, 2].iter().flat_map(|i| i.to_be_bytes()));
        assert_eq!(parse_ply(&file).unwrap().polygon(0), [0, 1, 2]);
        let message = |bytes: &[u8]| parse_ply(bytes).unwrap_err().to_string();
        let cut = message(&file[..file.len() - 1]);
        assert!(cut.starts_with("face 0: expected face 0, found "), "{cut}");
        let last = file.len() - 1;
        file[last] = 9;
        assert_eq!(message(&file), "face 0 names the vertex 9 of 3 vertices");
        let from_end = file.len() - 13 - 4;
        file[from_end..from_end + 4].copy_from_slice(&f32::INFINITY.to_be_bytes());
        assert_eq!(message(&file), "vertex 2 has the coordinate inf, which is not finite");
    }

    #[test]
    fn ply_as_other_programs_write_it() {
        let short = PLY.replace("1 0 0\n0 0.1 0", "1. -.0 +0\n0 .1 0.e1");
        let soup = parse_ply(short.as_bytes()).unwrap();
        assert_eq!(soup.vertices[1..], [Vec3::X, Vec3::new(0.0, 0.1, 0.0)]);
        let cr = short.replace('\n', "\r");
        assert_eq!(parse_ply(cr.as_bytes()).unwrap().lines, [13]);
        let error = parse_ply(cr.replace("3 0 1 2", "3 0 1 x").as_bytes()).unwrap_err();
        assert_eq!(error.to_string(), "line 13: expected face 0, found \"x\"");
        // A comment in Latin-1, and in binary files rows that begin with the byte of a line end.
        for end in ["\n", "\r\n", "\r"] {
            let header = PLY.replace("element vertex", "comment caf@\nelement vertex");
            let mut file = header.replace("ascii", "binary_little_endian").into_bytes();
            file.truncate(header.replace("ascii", "binary_little_endian").find("0 0 0").unwrap());
            let mut file = String::from_utf8(file).unwrap().replace('\n', end).into_bytes();
            *file.iter_mut().find(|byte| **byte == b'@').unwrap() = 0xe9;
            let first = f32::from_le_bytes([b'\n', b'\r', b'\n', 0]);
            for x in [first, 0., 0., 1., 0., 0., 0., 1., 0.] {
                file.extend(x.to_le_bytes());
            }
            file.push(3);
            file.extend([0_i32, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
            let soup = parse_ply(&file).unwrap_or_else(|error| panic!("{end:?}: {error}"));
            assert_eq!((soup.vertices[0].x, soup.polygon(0)), (first.into(), &[0, 1, 2][..]));
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
            refuses(Format::Off, text, expected);
        }
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
            refuses(Format::Obj, text, expected);
        }
        let open = format!("solid\n{}endsolid", FACET.replace(" endloop", " vertex 0 0 0"));
        for (text, expected) in [
            ("solid x\n", "end of file: expected facet or endsolid, found nothing more"),
            (&format!("solid\n{}", &FACET[..60]), "line 5: expected vertex, found \"vert\""),
            (&open, "line 7: expected endloop, found \"vertex\""),
            ("PK", "line 1: expected the word solid or a binary header of 84 bytes, found \"PK\""),
        ] {
            refuses(Format::Stl, text, expected);
        }
        for (from, to, expected) in [
            ("ply", "pyl", "line 1: expected a PLY header, found "),
            ("ascii", "text", "line 2: expected a PLY header, found "),
            (
                "format ascii 1.0\n",
                "",
                "line 1: expected a PLY header, found No format line found.",
            ),
            ("float z", "float w", "line 9: expected element vertex with x, y and z before it, "),
            ("float y", "floot y", "line 5: expected a PLY header, found "),
            ("element face 1", "element face x", "line 7: expected a PLY header, found "),
            (
                "element face 1\nproperty list uchar int vertex_indices\n",
                "",
                "no face among 3 vertices; a closed surface is needed, not a point set",
            ),
            ("element face", "element tristrips", "PLY triangle strips are not read; "),
            ("1 0 0\n", "1 0\n", "line 11: expected vertex 1, found "),
            ("3 0 1 2", "3 0 1 3", "line 13: face 0 names the vertex 3 of 3 vertices"),
            ("3 0 1 2", "3 0 1 -1", "line 13: expected face 0, found "),
            ("3 0 1 2", "3 0 1 1.5", "line 13: expected face 0, found "),
            ("3 0 1 2", "2 0 1", "line 13: face 0 has 2 corners; three are the least"),
            ("3 0 1 2", "-1 0 1", "line 13: expected face 0, found "),
            (
                "0 0.1 0\n",
                "0 nan 0\n",
                "line 12: vertex 2 has the coordinate NaN, which is not finite",
            ),
            ("1 0 0\n", "1 0 0..\n", "line 11: expected vertex 1, found \"0..\""),
            ("3 0 1 2\n", "", "end of file: expected face 0, found nothing more"),
            (
                "vertex 3",
                "vertex 99",
                "the header announces 99 vertices, but the file holds only 28",
            ),
        ] {
            let error = parse_ply(PLY.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{from} to {to}: {error}");
        }
    }
}
