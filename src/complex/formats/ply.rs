//! The `.ply` format, ASCII, for viewers: vertices with a property `radius`, edges, faces.

use std::io::{self, Write};

use super::canonical::canonical;
use super::scan::{Line, lines, shortened};
use super::{LoadedMa, MaError, MaErrorKind, Radii, ReadOptions};
use crate::Vec3;
use crate::complex::{MedialMesh, Sphere};

/// Writes a medial mesh as ASCII PLY.
pub(super) fn write_to(out: &mut dyn Write, mesh: &MedialMesh) -> io::Result<()> {
    writeln!(out, "ply\nformat ascii 1.0\ncomment medial mesh: spheres, edges, faces")?;
    writeln!(out, "element vertex {}", mesh.spheres.len())?;
    for property in ["x", "y", "z", "radius"] {
        writeln!(out, "property double {property}")?;
    }
    writeln!(out, "element edge {}", mesh.edges.len())?;
    writeln!(out, "property int vertex1\nproperty int vertex2")?;
    writeln!(out, "element face {}", mesh.faces.len())?;
    writeln!(out, "property list uchar int vertex_indices\nend_header")?;
    for Sphere { centre: c, radius } in &mesh.spheres {
        writeln!(out, "{:.16e} {:.16e} {:.16e} {radius:.16e}", c.x, c.y, c.z)?;
    }
    for [a, b] in &mesh.edges {
        writeln!(out, "{a} {b}")?;
    }
    for [a, b, c] in &mesh.faces {
        writeln!(out, "3 {a} {b} {c}")?;
    }
    Ok(())
}

/// Reads a medial mesh from the text of an ASCII PLY file; `name` stands for the file in errors.
///
/// Elements may come in any order and carry further scalar properties. Vertices need `x`, `y`,
/// `z` and `radius` (or `r`), edges `vertex1` and `vertex2`, faces one list of three indices.
///
/// # Errors
/// As for [`parse_ma`](super::parse_ma), and when the file is binary.
pub fn parse_ply(text: impl AsRef<[u8]>, name: &str) -> Result<LoadedMa, MaError> {
    parse_ply_with(text, name, ReadOptions::default())
}

/// [`parse_ply`] for files without radii, too.
///
/// # Errors
/// As [`parse_ply`], but for what the options allow.
pub fn parse_ply_with(
    text: impl AsRef<[u8]>,
    name: &str,
    options: ReadOptions,
) -> Result<LoadedMa, MaError> {
    let bytes = text.as_ref();
    let mut rest = lines(bytes, name);
    let elements = header(&mut rest, bytes.len(), name, options.radii)?;
    let spheres_announced = elements.iter().find(|e| e.kind == Kind::Vertex).map_or(0, |e| e.count);
    let (mut spheres, mut edges, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for element in &elements {
        for found in 0..element.count {
            let line = rest.next().ok_or_else(|| {
                let (what, announced) = (element.kind.plural(), element.count);
                MaError::of(name, MaErrorKind::Count { what, announced, found })
            })?;
            match element.kind {
                Kind::Vertex => spheres.push(element.sphere(&line)?),
                Kind::Edge => edges.push(element.edge(&line, spheres_announced)?),
                Kind::Face => faces.push(face(&line, spheres_announced)?),
                Kind::Other => {}
            }
        }
    }
    canonical(spheres, edges, faces, options.radii, Vec::new()).map_err(|kind| MaError {
        file: name.to_owned(),
        line: None,
        kind,
    })
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Vertex,
    Edge,
    Face,
    Other,
}

impl Kind {
    fn plural(self) -> &'static str {
        match self {
            Self::Vertex => "vertices",
            Self::Edge => "edges",
            Self::Face => "faces",
            Self::Other => "further elements",
        }
    }
}

/// One `element` of the header: how many lines, and what their words are.
struct Element {
    kind: Kind,
    count: u64,
    properties: Vec<String>,
}

fn header<'a>(
    rest: &mut impl Iterator<Item = Line<'a>>,
    bytes: usize,
    name: &str,
    radii: Radii,
) -> Result<Vec<Element>, MaError> {
    let bad = |line: &Line<'_>, why: &str| line.error(MaErrorKind::Malformed(why.to_owned()));
    let mut elements: Vec<Element> = Vec::new();
    let mut magic = false;
    for line in rest {
        let words: Vec<&str> = line.words().rest().collect();
        match (words.as_slice(), elements.last_mut()) {
            (["ply"], _) if !magic => magic = true,
            _ if !magic => break,
            (["format", "ascii", ..], _) | (["comment" | "obj_info", ..], _) => {}
            (["format", ..], _) => {
                return Err(bad(&line, "only ASCII PLY is read; convert the file to ASCII or .ma"));
            }
            (["element", kind, count], _) => elements.push(element(&line, kind, count, bytes)?),
            (["property", "list", _, _, name], Some(e)) if e.kind == Kind::Face => {
                e.properties.push((*name).to_owned());
            }
            (["property", _, "r"], Some(e)) if e.kind == Kind::Vertex => {
                e.properties.push("radius".to_owned());
            }
            (["property", _, name], Some(e)) => e.properties.push((*name).to_owned()),
            (["end_header"], _) => return checked(elements, &line, radii),
            _ => {
                let text = shortened(line.text());
                return Err(bad(&line, &format!("header line {text:?} is not understood")));
            }
        }
    }
    let why = if magic { "the header has no end" } else { "not a PLY file" };
    Err(MaError::of(name, MaErrorKind::Malformed(why.into())))
}

fn element(line: &Line<'_>, kind: &str, count: &str, bytes: usize) -> Result<Element, MaError> {
    let kind = match kind {
        "vertex" => Kind::Vertex,
        "edge" => Kind::Edge,
        "face" => Kind::Face,
        _ => Kind::Other,
    };
    let count: u64 = count.parse().map_err(|_| {
        line.error(MaErrorKind::Malformed(format!("{:?} is not a count", shortened(count))))
    })?;
    if count > bytes as u64 || count > u64::from(u32::MAX) {
        let kind = MaErrorKind::Announced { what: kind.plural(), announced: count, bytes };
        return Err(line.error(kind));
    }
    Ok(Element { kind, count, properties: Vec::new() })
}

/// The elements, once each has the properties that it needs.
fn checked(elements: Vec<Element>, line: &Line<'_>, radii: Radii) -> Result<Vec<Element>, MaError> {
    for element in &elements {
        let needed: &[&str] = match element.kind {
            Kind::Vertex if radii == Radii::NotNeeded => &["x", "y", "z"],
            Kind::Vertex => &["x", "y", "z", "radius"],
            Kind::Edge => &["vertex1", "vertex2"],
            Kind::Face if element.properties.len() != 1 => {
                let why = "faces must have one property, a list of corners";
                return Err(line.error(MaErrorKind::Malformed(why.into())));
            }
            Kind::Face | Kind::Other => &[],
        };
        if let Some(name) = needed.iter().find(|name| element.column(name).is_none()) {
            let what = element.kind.plural();
            let help = if *name == "radius" {
                " (`--radii surface` takes distances to a surface)"
            } else {
                ""
            };
            let why = format!("{what} have no property {name}: not a medial mesh{help}");
            return Err(line.error(MaErrorKind::Malformed(why)));
        }
    }
    Ok(elements)
}

impl Element {
    fn column(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|property| property == name)
    }

    /// The values of the named columns, in the order of the names.
    fn sphere(&self, line: &Line<'_>) -> Result<Sphere, MaError> {
        let mut values = [0.0; 4];
        let mut words = line.words();
        for property in &self.properties {
            match ["x", "y", "z", "radius"].into_iter().position(|name| name == property) {
                Some(slot) => values[slot] = words.number("coordinate or radius")?,
                None => _ = words.required("value of a property")?,
            }
        }
        let [x, y, z, radius] = values;
        Ok(Sphere::new(Vec3::new(x, y, z), radius))
    }

    fn edge(&self, line: &Line<'_>, spheres: u64) -> Result<[u32; 2], MaError> {
        let mut ends = [0; 2];
        let mut words = line.words();
        for property in &self.properties {
            match ["vertex1", "vertex2"].into_iter().position(|name| name == property) {
                Some(slot) => [ends[slot]] = words.indices(spheres)?,
                None => _ = words.required("value of a property")?,
            }
        }
        Ok(ends)
    }
}

fn face(line: &Line<'_>, spheres: u64) -> Result<[u32; 3], MaError> {
    let mut words = line.words();
    let corners = words.required("number of corners")?;
    if corners != "3" {
        let why = format!("faces must be triangles, found {:?} corners", shortened(corners));
        return Err(line.error(MaErrorKind::Malformed(why)));
    }
    words.indices(spheres)
}
