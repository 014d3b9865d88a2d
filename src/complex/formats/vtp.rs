//! Writes VTK PolyData in XML (`.vtp`), the format of ParaView.
//!
//! Points are the spheres, with the point data `radius` and, on request, a second array. Cells are all faces
//! (`Polys`), the edges *without a face* (`Lines`) and the spheres without an edge (`Verts`): a face brings its sides
//! along, so that nothing is lost, and ParaView draws no line over a sheet unless asked ("Surface With Edges").
//! Arrays are in base64 without compression: every number as it is in memory, bit for bit.
//!
//! Source: The VTK file formats, <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.

use std::io::{self, Write};

use base64::prelude::{BASE64_STANDARD, Engine};

use super::{Look, SphereValues, isolated, lone_edges};
use crate::complex::{MedialMesh, Sphere};

/// Writes a medial mesh as VTK PolyData.
pub(super) fn write_to(out: &mut dyn Write, mesh: &MedialMesh, look: &Look) -> io::Result<()> {
    let (points, lines) = (isolated(mesh), lone_edges(mesh));
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
    let coordinates = |Sphere { centre, .. }: &Sphere| centre.to_array();
    let coordinates = mesh.spheres.iter().flat_map(coordinates).flat_map(f64::to_le_bytes);
    array(out, "Float64", "Points", 3, coordinates)?;
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
