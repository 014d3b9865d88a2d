//! VTK PolyData in XML (`.vtp`), the format of ParaView.
//!
//! Points are the spheres, with the point data `radius` and, where asked, a second array. Cells are all faces
//! (`Polys`), the edges *without a face* (`Lines`) and the spheres without an edge (`Verts`): a face brings its sides
//! along, so that nothing is lost, and ParaView draws no line over a sheet unless asked ("Surface With Edges").
//!
//! Written with arrays in base64 without compression: numbers are as they are in memory, bit for bit, and the file is
//! plain XML. Read are what VTK's own writers make: text, base64, or appended bytes (raw or base64), of either byte
//! order, compressed by zlib or not, of any type of number; polylines and triangle strips are taken apart.
//!
//! Source: The VTK file formats, <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.

mod arrays;
mod error;
mod read;
mod write;

pub use error::VtpError;
pub use read::parse_vtp;
pub(super) use write::write_to;

#[cfg(test)]
mod tests;
