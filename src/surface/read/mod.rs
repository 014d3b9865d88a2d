//! From bytes to a polygon soup, one file for each format.

mod obj;
mod off;
mod ply;
mod stl;
mod text;

use std::fmt;
use std::path::Path;

use super::error::Fault;
use super::soup::PolygonSoup;

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
    /// The format that the extension of a path stands for, in upper or lower case.
    ///
    /// # Errors
    /// [`Fault::UnknownFormat`] when it stands for none.
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
        Format::Off => off::parse(bytes),
        Format::Obj => obj::parse(bytes),
        Format::Ply => ply::parse(bytes),
        Format::Stl => stl::parse(bytes),
    }?;
    match soup.len() {
        0 => Err(Fault::NoFaces { vertices: soup.vertices.len() }),
        _ => Ok(soup),
    }
}

/// The content of a regular file: a pipe or a device could go on for ever.
pub(super) fn content(path: &Path) -> Result<Vec<u8>, Fault> {
    let io = |error: std::io::Error| Fault::Io(format!("cannot be read: {error}"));
    if !std::fs::metadata(path).map_err(io)?.is_file() {
        return Err(Fault::Io("cannot be read: not a regular file".into()));
    }
    std::fs::read(path).map_err(io)
}
