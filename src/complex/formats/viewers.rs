//! Formats for viewers as text: `.ply`, which is read as well, `.obj` without radii, and VTK PolyData (`.vtp`).
//!
//! In `.vtp` points are the spheres, with the point data `radius` and, on request, a second array. Cells are all faces
//! (`Polys`), the edges *without a face* (`Lines`) and the spheres without an edge (`Verts`): a face brings its sides
//! along, so that nothing is lost, and ParaView draws no line over a sheet except by "Surface With Edges".
//! Arrays are in base64 without compression: every number as it is in memory, bit for bit.
//!
//! Source: The VTK file formats, <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.

use std::io::{self, Write};

use base64::prelude::{BASE64_STANDARD, Engine};

use super::ma::{canonical, write_records};
use super::{LoadedMa, MaError, MaErrorKind, Radii, ReadOptions};
use crate::complex::{MedialMesh, Sphere, stability_ratio};
use crate::surface::{Fault, Place, ply};
use crate::{ColourMap, Vec3};

/// Values at the spheres, and their colours.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereValues {
    /// The word for it in files: `radius`, `stability`, `error`. Letters, digits and `_` only.
    pub name: &'static str,
    /// A finite value for each sphere.
    pub values: Vec<f64>,
    /// The value at the low end of the colours; lower values have the same colour.
    pub low: f64,
    /// The value at the high end.
    pub high: f64,
    /// The colours.
    pub map: ColourMap,
    /// The value's meaning, in a few words, with its unit.
    pub meaning: &'static str,
}

impl SphereValues {
    /// The radii, from the least to the largest.
    pub fn radius(mesh: &MedialMesh) -> Self {
        let values: Vec<f64> = mesh.spheres.iter().map(|sphere| sphere.radius).collect();
        let high = values.iter().copied().fold(0.0, f64::max);
        let low = values.iter().copied().fold(high, f64::min);
        let meaning = "radius, in the unit of the coordinates";
        Self { name: "radius", values, low, high, map: ColourMap::Viridis, meaning }
    }

    /// Stability ratios ([`stability_ratio`]), 0 to 1: of a sphere the least of its edges', of one without edges 1,
    /// since a ball alone is no spike. `diagonal` is the length that counts as 1 for edges without length, in the
    /// unit of the mesh.
    ///
    /// # Panics
    /// If the mesh is not in canonical form; see [`MedialMesh::check`].
    pub fn stability(mesh: &MedialMesh, diagonal: f64) -> Self {
        let mut values = vec![1.0_f64; mesh.spheres.len()];
        for &[a, b] in &mesh.edges {
            let [p, q] = [a, b].map(|v| {
                let Sphere { centre, radius } = mesh.spheres[v as usize];
                Sphere::new(centre / diagonal, radius / diagonal)
            });
            let ratio = stability_ratio(p, q);
            for v in [a, b] {
                values[v as usize] = values[v as usize].min(ratio);
            }
        }
        let meaning = "stability ratio, the least of the sphere's edges";
        Self { name: "stability", values, low: 0.0, high: 1.0, map: ColourMap::Viridis, meaning }
    }

    /// Places in [`ColourMap::Parts`], of spheres that each belong to one sheet; see
    /// [`SheetGraph::painted`](crate::complex::SheetGraph::painted).
    pub fn sheet(values: Vec<f64>) -> Self {
        let meaning = "sheets by colour, seams and curves black";
        Self { name: "sheet", values, low: 0.0, high: 1.0, map: ColourMap::Parts, meaning }
    }

    /// Errors of either sign, zero in the middle of the colours: of each sphere, by how much it reaches out of the
    /// surface (positive) or falls short of it (negative), in the unit of the mesh. 99 % of them are within the ends,
    /// so that a single bad sphere does not make all others look alike.
    pub fn error(values: Vec<f64>) -> Self {
        let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let place = (sizes.len().saturating_sub(1) as f64 * SPANNED) as usize;
        let high = sizes.get(place).copied().unwrap_or(0.0);
        let meaning = "radius less the depth of the centre below the surface, in the unit of the coordinates: positive \
                       outside";
        Self { name: "error", values, low: -high, high, map: ColourMap::Diverging, meaning }
    }

    /// Where the value of a sphere is between the ends, 0 to 1 inside; in the middle where they are equal.
    pub fn place(&self, sphere: usize) -> f64 {
        let extent = self.high - self.low;
        if extent > 0.0 { (self.values[sphere] - self.low) / extent } else { 0.5 }
    }
}

/// Share of the errors within the ends of their colours.
const SPANNED: f64 = 0.99;

/// How a file for viewers shows a medial mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Look {
    /// The colouring; the radii by default. Only `.vtp` and `.glb` hold it.
    pub values: Option<SphereValues>,
    /// The spheres themselves as well, as round bodies of 80 triangles. Only in `.glb`.
    pub balls: bool,
}

/// Reads a medial mesh from a PLY file, text or binary; `name` is the file in errors.
///
/// Elements may come in any order and carry further properties. Vertices need `x`, `y`, `z` and `radius` (or `r`), edges
/// `vertex1` and `vertex2`, faces a list `vertex_indices` (or `vertex_index`) of three.
///
/// # Errors
/// As for [`parse_ma`](super::parse_ma).
pub fn parse_ply(
    bytes: impl AsRef<[u8]>,
    name: &str,
    options: ReadOptions,
) -> Result<LoadedMa, MaError> {
    read_ply(bytes.as_ref(), options).map_err(|kind| MaError::of(name, kind))
}

fn read_ply(bytes: &[u8], options: ReadOptions) -> Result<LoadedMa, MaErrorKind> {
    let file = ply::header(bytes)?;
    let has_colour = file.has("vertex", &["g", "green"]);
    let needed: [(&str, &[&str]); 7] = [
        ("vertex", &["x"]),
        ("vertex", &["y"]),
        ("vertex", &["z"]),
        // With green, it is red.
        ("vertex", if has_colour { &["radius"] } else { &["radius", "r"] }),
        ("edge", &["vertex1"]),
        ("edge", &["vertex2"]),
        ("face", &["vertex_indices", "vertex_index"]),
    ];
    for (element, names) in needed {
        let is_radius = names[0] == "radius";
        if file.count(element) > 0
            && !file.has(element, names)
            && !(is_radius && options.radii == Radii::NotNeeded)
        {
            let help = "; `--radii surface` takes distances to a surface";
            let help = if is_radius { help } else { "" };
            let why = format!("element {element} has no property {}: not a medial mesh", names[0]);
            return Err(MaErrorKind::Malformed(why + help));
        }
    }
    let vertices = file.count("vertex");
    let has_radius = has_colour || file.has("vertex", &["radius"]);
    let (mut spheres, mut edges, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    file.rows(|element, vertex, at, values| -> Result<(), MaErrorKind> {
        match (element, values.corners.as_slice()) {
            ("vertex", _) => {
                if let Some(&value) = values.numbers.iter().find(|number| !number.is_finite()) {
                    return Err(Fault::Coordinate { at: at.clone(), vertex, value }.into());
                }
                let [x, y, z, radius, r] = values.numbers;
                let radius = if has_radius { radius } else { r };
                spheres.push(Sphere::new(Vec3::new(x, y, z), radius));
            }
            ("edge", _) => edges.push(indices(values.ends, vertices, at)?),
            ("face", &[a, b, c]) => faces.push(indices([a, b, c].map(f64::from), vertices, at)?),
            ("face", corners) => {
                let found = corners.len();
                let why = format!("{at}: faces must be triangles, found {found} corners");
                return Err(MaErrorKind::Malformed(why));
            }
            _ => {}
        }
        Ok(())
    })?;
    canonical(spheres, edges, faces, options.radii, Vec::new())
}

fn indices<const N: usize>(
    numbers: [f64; N],
    spheres: usize,
    at: &Place,
) -> Result<[u32; N], MaErrorKind> {
    let range = 0.0..spheres as f64;
    if let Some(number) = numbers.iter().find(|x| !range.contains(*x) || x.fract() != 0.0) {
        let why = format!("{at}: {number} is not one of the {spheres} spheres; indices start at 0");
        return Err(MaErrorKind::Malformed(why));
    }
    Ok(numbers.map(|number| number as u32))
}

impl From<Fault> for MaErrorKind {
    fn from(fault: Fault) -> Self {
        Self::Malformed(fault.to_string())
    }
}

/// Writes a medial mesh as PLY.
pub(super) fn write_ply(out: &mut dyn Write, mesh: &MedialMesh) -> io::Result<()> {
    writeln!(out, "ply\nformat ascii 1.0\ncomment medial mesh: spheres, edges, faces")?;
    writeln!(out, "element vertex {}", mesh.spheres.len())?;
    for property in ["x", "y", "z", "radius"] {
        writeln!(out, "property double {property}")?;
    }
    writeln!(out, "element edge {}", mesh.edges.len())?;
    writeln!(out, "property int vertex1\nproperty int vertex2")?;
    writeln!(out, "element face {}", mesh.faces.len())?;
    writeln!(out, "property list uchar int vertex_indices\nend_header")?;
    write_records(out, mesh, ["", "", "3 "])
}

/// Writes the centres, edges and faces of a medial mesh as Wavefront OBJ.
pub(super) fn write_obj(out: &mut dyn Write, mesh: &MedialMesh) -> io::Result<()> {
    for Sphere { centre: c, .. } in &mesh.spheres {
        writeln!(out, "v {:.16e} {:.16e} {:.16e}", c.x, c.y, c.z)?;
    }
    // In 64 bits: the last of 2^32 spheres still has a successor.
    for [a, b] in mesh.edges.iter().map(|edge| edge.map(|i| u64::from(i) + 1)) {
        writeln!(out, "l {a} {b}")?;
    }
    for [a, b, c] in mesh.faces.iter().map(|face| face.map(|i| u64::from(i) + 1)) {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

/// Writes a medial mesh as VTK PolyData.
pub(super) fn write_vtp(out: &mut dyn Write, mesh: &MedialMesh, look: &Look) -> io::Result<()> {
    let (points, lines) = (mesh.isolated(), mesh.lone_edges());
    let shown = look.values.as_ref().filter(|values| values.name != RADIUS);
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(
        out,
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
    )?;
    writeln!(
        out,
        "<!-- medial mesh: points are spheres; vertices those without an edge, lines edges without a face -->\n\
         <PolyData>\n<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"{}\">",
        mesh.spheres.len(),
        points.len(),
        lines.len(),
        mesh.faces.len()
    )?;
    writeln!(out, "<PointData Scalars=\"{}\">", shown.map_or(RADIUS, |values| values.name))?;
    let radii = mesh.spheres.iter().flat_map(|s| s.radius.to_le_bytes());
    array(out, "Float64", RADIUS, 1, radii)?;
    if let Some(SphereValues { name, values, .. }) = shown {
        array(out, "Float64", name, 1, values.iter().flat_map(|v| v.to_le_bytes()))?;
    }
    writeln!(out, "</PointData>\n<CellData>\n</CellData>\n<Points>")?;
    let coordinates = mesh.spheres.iter().flat_map(|sphere| sphere.centre.to_array());
    array(out, "Float64", "Points", 3, coordinates.flat_map(f64::to_le_bytes))?;
    writeln!(out, "</Points>")?;
    let points: Vec<[u32; 1]> = points.into_iter().map(|v| [v]).collect();
    cells(out, "Verts", &points)?;
    cells(out, "Lines", &lines)?;
    cells::<3>(out, "Strips", &[])?;
    cells(out, "Polys", &mesh.faces)?;
    writeln!(out, "</Piece>\n</PolyData>\n</VTKFile>")
}

const RADIUS: &str = "radius";

/// Cells of `N` points each.
fn cells<const N: usize>(out: &mut dyn Write, element: &str, cells: &[[u32; N]]) -> io::Result<()> {
    writeln!(out, "<{element}>")?;
    let connectivity = cells.iter().flatten().flat_map(|&v| i64::from(v).to_le_bytes());
    array(out, "Int64", "connectivity", 1, connectivity)?;
    let ends = (1..=cells.len()).flat_map(|k| ((k * N) as i64).to_le_bytes());
    array(out, "Int64", "offsets", 1, ends)?;
    writeln!(out, "</{element}>")
}

/// An array with its length in bytes in front, both encoded together.
fn array(
    out: &mut dyn Write,
    kind: &str,
    name: &str,
    components: usize,
    bytes: impl Iterator<Item = u8>,
) -> io::Result<()> {
    let mut content = vec![0; 8];
    content.extend(bytes);
    let length = content.len() as u64 - 8;
    content[..8].copy_from_slice(&length.to_le_bytes());
    writeln!(
        out,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">\n{}\n\
         </DataArray>",
        BASE64_STANDARD.encode(&content)
    )
}
