//! Reads VTK PolyData.
//!
//! 1. The XML is walked up to `AppendedData`, behind whose underscore any bytes may follow: every `DataArray` of
//!    points, point data and cells is noted with its place.
//! 2. Radii, positions and cells of each piece are decoded (`arrays.rs`), each array checked against the numbers of
//!    points and cells that the piece announces.
//! 3. Polylines and strips are taken apart, and the whole is brought to canonical form.

use std::collections::BTreeMap;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::VtpError;
use super::arrays::{Coding, DataArray, Decoder};
use crate::Vec3;
use crate::complex::formats::canonical::{canonical, note};
use crate::complex::formats::lone::with_sides;
use crate::complex::formats::{LoadedMa, MaError, Radii};
use crate::complex::{ComplexError, Sphere};

/// Reads a medial mesh from the content of a `.vtp` file; `name` stands for the file in errors.
///
/// Points need an array `radius` (or `r`). Lines and strips of any length are taken apart; vertices are passed over,
/// since every point is a sphere; other arrays are not used.
///
/// # Errors
/// When it is not VTK PolyData, is cut off, is compressed by anything but zlib, has polygons other than triangles, or a
/// radius or coordinate that is not finite, or a negative radius. The error names the array or the cell.
///
/// # Cost
/// Linear in the file, and in what it holds uncompressed, which may be at most 100 times as much.
pub fn parse_vtp(content: impl AsRef<[u8]>, name: &str) -> Result<LoadedMa, MaError> {
    let bytes = content.as_ref();
    let fail = |kind| MaError::of(name, kind);
    let (spheres, edges, faces, notes) = parse(bytes).map_err(|error| fail(error.into()))?;
    let is_valid = |s: &Sphere| s.centre.is_finite() && s.radius.is_finite() && s.radius >= 0.0;
    if let Some(sphere) = spheres.iter().position(|s| !is_valid(s)) {
        let Sphere { centre, radius } = spheres[sphere];
        return Err(fail(ComplexError::Sphere { sphere, centre, radius }.into()));
    }
    let edges = with_sides(edges, &faces);
    canonical(spheres, edges, faces, Radii::Needed, notes).map_err(fail)
}

type Simplices = (Vec<Sphere>, Vec<[u32; 2]>, Vec<[u32; 3]>, Vec<String>);

fn parse(bytes: &[u8]) -> Result<Simplices, VtpError> {
    let Outline { coding, pieces, appended } = outline(bytes)?;
    let mut decoder = Decoder::new(coding, appended, bytes.len());
    let (mut spheres, mut edges, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    let mut others = 0;
    for piece in &pieces {
        let first = spheres.len() as u64;
        let total = first.saturating_add(piece.points);
        if total > u64::from(u32::MAX) {
            return Err(VtpError::TooLarge(total));
        }
        if piece.points == 0 {
            continue;
        }
        spheres.extend(piece.spheres(&mut decoder)?);
        // Sums fit: they are below the number of points.
        let shift = |v: u32| v + first as u32;
        for line in piece.cells("Lines", &mut decoder)? {
            edges.extend(line.windows(2).map(|ends| [shift(ends[0]), shift(ends[1])]));
        }
        for strip in piece.cells("Strips", &mut decoder)? {
            faces.extend(
                strip.windows(3).map(|corners| [corners[0], corners[1], corners[2]].map(shift)),
            );
        }
        for (cell, polygon) in piece.cells("Polys", &mut decoder)?.into_iter().enumerate() {
            let corners: [u32; 3] = polygon
                .as_slice()
                .try_into()
                .map_err(|_| VtpError::Corners { cell, corners: polygon.len() as u64 })?;
            faces.push(corners.map(shift));
        }
        others += piece
            .arrays
            .keys()
            .filter(|(section, name)| section == "PointData" && !RADII.contains(&name.as_str()))
            .count();
    }
    let mut notes = Vec::new();
    note(&mut notes, others, "array of point data", "arrays of point data", "not used");
    Ok((spheres, edges, faces, notes))
}

/// Names that arrays of radii have.
const RADII: [&str; 3] = ["radius", "Radius", "r"];

/// What a file holds, and where.
struct Outline<'a> {
    coding: Coding,
    pieces: Vec<Piece<'a>>,
    /// What follows the underscore of the appended data, and whether it is base64.
    appended: Option<(&'a [u8], bool)>,
}

#[derive(Default)]
struct Piece<'a> {
    points: u64,
    /// Numbers of cells by their element.
    cells: BTreeMap<&'static str, u64>,
    /// By section and name.
    arrays: BTreeMap<(String, String), DataArray<'a>>,
}

const CELLS: [(&str, &str); 3] =
    [("Lines", "NumberOfLines"), ("Strips", "NumberOfStrips"), ("Polys", "NumberOfPolys")];
const SECTIONS: [&str; 5] = ["PointData", "Points", "Lines", "Strips", "Polys"];

fn outline(bytes: &[u8]) -> Result<Outline<'_>, VtpError> {
    let mut reader = Reader::from_reader(bytes);
    let mut coding = None;
    let mut pieces: Vec<Piece<'_>> = Vec::new();
    let mut section = String::new();
    let mut appended = None;
    // Elements that are open; in a file that was cut off some stay so.
    let mut open = 0_usize;
    loop {
        let event = reader.read_event().map_err(|error| VtpError::Xml {
            at: reader.error_position(),
            why: error.to_string(),
        })?;
        let after = reader.buffer_position() as usize;
        let (Event::Start(tag) | Event::Empty(tag)) = &event else {
            match event {
                Event::Eof if open > 0 => {
                    let why = "the file ends within an element: it is cut off".to_owned();
                    return Err(VtpError::Xml { at: bytes.len() as u64, why });
                }
                Event::Eof => break,
                Event::End(_) => open = open.saturating_sub(1),
                _ => {}
            }
            continue;
        };
        open += usize::from(matches!(event, Event::Start(_)));
        // An attribute does not know where it stands.
        let placed = |error| match error {
            VtpError::Xml { why, .. } => VtpError::Xml { at: after as u64, why },
            other => other,
        };
        let name = String::from_utf8_lossy(tag.name().as_ref()).into_owned();
        match name.as_str() {
            "VTKFile" => coding = Some(coding_of(tag).map_err(placed)?),
            "Piece" => pieces.push(piece(tag).map_err(placed)?),
            "AppendedData" => {
                let is_base64 =
                    attribute(tag, "encoding").map_err(placed)?.as_deref() != Some("raw");
                let rest = &bytes[after.min(bytes.len())..];
                let start =
                    rest.iter().position(|&byte| byte == b'_').map_or(rest.len(), |at| at + 1);
                appended = Some((&rest[start..], is_base64));
                // What follows may not be XML.
                break;
            }
            "DataArray" | "Array" => {
                if let Some(piece) = pieces.last_mut()
                    && SECTIONS.contains(&section.as_str())
                {
                    let rest = &bytes[after.min(bytes.len())..];
                    let length = rest.iter().position(|&byte| byte == b'<').unwrap_or(rest.len());
                    let (name, array) =
                        data_array(tag, &section, &rest[..length]).map_err(placed)?;
                    piece.arrays.entry((section.clone(), name)).or_insert(array);
                }
            }
            // Of arrays: their children tell about ranges.
            "InformationKey" | "Value" => {}
            _ => section = name,
        }
    }
    let coding = coding.ok_or(VtpError::Missing("VTKFile"))?;
    if pieces.is_empty() {
        return Err(VtpError::Missing("Piece"));
    }
    Ok(Outline { coding, pieces, appended })
}

fn coding_of(tag: &BytesStart<'_>) -> Result<Coding, VtpError> {
    let kind = attribute(tag, "type")?.unwrap_or_default();
    if kind != "PolyData" {
        return Err(VtpError::Kind(kind));
    }
    let one_of = |name: &'static str, known: [&str; 2], expected| {
        let found = attribute(tag, name)?;
        match found.as_deref() {
            None => Ok(false),
            Some(word) if word == known[0] => Ok(false),
            Some(word) if word == known[1] => Ok(true),
            Some(word) => Err(unexpected("VTKFile", name, word, expected)),
        }
    };
    let order = ["LittleEndian", "BigEndian"];
    let is_big_endian = one_of("byte_order", order, "LittleEndian or BigEndian")?;
    let is_wide = one_of("header_type", ["UInt32", "UInt64"], "UInt32 or UInt64")?;
    let is_compressed = match attribute(tag, "compressor")?.as_deref() {
        None | Some("") => false,
        Some("vtkZLibDataCompressor") => true,
        Some(other) => return Err(VtpError::Compressor(other.to_owned())),
    };
    Ok(Coding { is_big_endian, header: if is_wide { 8 } else { 4 }, is_compressed })
}

fn piece<'a>(tag: &BytesStart<'_>) -> Result<Piece<'a>, VtpError> {
    let number = |name: &'static str| match attribute(tag, name)? {
        None => Ok(0),
        Some(word) => word.trim().parse().map_err(|_| unexpected("Piece", name, &word, "a number")),
    };
    let mut piece = Piece { points: number("NumberOfPoints")?, ..Piece::default() };
    for (element, attribute) in CELLS {
        piece.cells.insert(element, number(attribute)?);
    }
    Ok(piece)
}

fn data_array<'a>(
    tag: &BytesStart<'_>,
    section: &str,
    text: &'a [u8],
) -> Result<(String, DataArray<'a>), VtpError> {
    let named = attribute(tag, "Name")?;
    // The only array of `Points` may have any name.
    let name = if section == "Points" { "Points".to_owned() } else { named.unwrap_or_default() };
    let label = format!("{section}/{name}");
    let number = |attribute: &'static str, word: Option<String>| {
        let parsed = word.as_deref().map(|word| word.trim().parse::<u64>());
        match (parsed, word) {
            (Some(Ok(number)), _) => Ok(Some(number)),
            (Some(Err(_)), Some(word)) => Err(unexpected(&label, attribute, &word, "a number")),
            _ => Ok(None),
        }
    };
    let components = number("NumberOfComponents", attribute(tag, "NumberOfComponents")?)?;
    let offset = number("offset", attribute(tag, "offset")?)?;
    let format = attribute(tag, "format")?.unwrap_or_else(|| "ascii".to_owned());
    let kind = attribute(tag, "type")?.unwrap_or_default();
    let array = DataArray::new(label, &kind, components.unwrap_or(1), &format, offset, text);
    Ok((name, array))
}

fn attribute(tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, VtpError> {
    let bad = |why: String| VtpError::Xml { at: 0, why };
    let found = tag.try_get_attribute(name).map_err(|error| bad(error.to_string()))?;
    let value = found.map(|attribute| attribute.unescape_value());
    Ok(value.transpose().map_err(|error| bad(error.to_string()))?.map(std::borrow::Cow::into_owned))
}

/// Longest part of a word of the file's that is repeated in a message.
const WORD: usize = 40;

fn unexpected(
    element: &str,
    attribute: &'static str,
    found: &str,
    expected: &'static str,
) -> VtpError {
    let found = found.chars().take(WORD).collect();
    VtpError::Attribute { element: element.to_owned(), attribute, found, expected }
}

impl Piece<'_> {
    fn array(&self, section: &str, name: &str) -> Option<&DataArray<'_>> {
        self.arrays.get(&(section.to_owned(), name.to_owned()))
    }

    fn spheres(&self, decoder: &mut Decoder<'_>) -> Result<Vec<Sphere>, VtpError> {
        let radii = RADII.iter().find_map(|name| self.array("PointData", name));
        let radii = radii.ok_or(VtpError::NoRadius)?;
        let points = self.array("Points", "Points").ok_or(VtpError::Missing("Points"))?;
        let radii = decoder.floats(radii, self.points, 1)?;
        let points = decoder.floats(points, self.points, 3)?;
        let spheres = points.chunks_exact(3).zip(radii);
        Ok(spheres.map(|(c, radius)| Sphere::new(Vec3::new(c[0], c[1], c[2]), radius)).collect())
    }

    /// The points of each cell of a list.
    fn cells(
        &self,
        element: &'static str,
        decoder: &mut Decoder<'_>,
    ) -> Result<Vec<Vec<u32>>, VtpError> {
        let count = self.cells.get(element).copied().unwrap_or(0);
        if count == 0 {
            return Ok(Vec::new());
        }
        let array = |name| self.array(element, name).ok_or(VtpError::Missing(element));
        let ends = decoder.indices(array("offsets")?, count)?;
        let last = ends.last().copied().unwrap_or(0);
        let members = decoder.indices(array("connectivity")?, last)?;
        if let Some(&point) = members.iter().find(|&&point| point >= self.points) {
            return Err(VtpError::Point { element, point, points: self.points });
        }
        let mut start = 0;
        let mut cells = Vec::with_capacity(ends.len());
        for (cell, &end) in ends.iter().enumerate() {
            if end < start || end > last {
                return Err(VtpError::Offsets { element, cell, end });
            }
            // Below the number of members, which are in memory; points fit 32 bits.
            let members = &members[start as usize..end as usize];
            cells.push(members.iter().map(|&point| point as u32).collect());
            start = end;
        }
        Ok(cells)
    }
}
