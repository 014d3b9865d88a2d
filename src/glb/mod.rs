//! Binary glTF 2.0 (`.glb`): the container, and the geometry of its scene.
//!
//! ```text
//! "glTF" 2 length | length "JSON" text | length "BIN\0" bytes
//! ```
//!
//! An own reader, since geometry needs few of the parts of glTF, every error is to name its element, and every length
//! is to be checked before memory is reserved for it. Read are triangles, lines and points of all meshes of the scene,
//! under the transforms of their nodes. Materials, textures, skins, morph targets, cameras and lights are passed over;
//! compressed meshes are refused by name.
//!
//! glTF is right-handed with `y` up, the files of this field have no declared up, and most tools that look at them
//! take `z`. So coordinates are turned by a quarter on the way: `(x, y, z)` of a glTF file is `(x, -z, y)` here, and
//! `(x, y, z)` here is written as `(x, z, -y)`. Both are exact, and are what Blender does: what it shows of a file
//! has the coordinates that this crate wrote.
//!
//! Source: The Khronos Group, glTF 2.0 Specification, <https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>.

mod accessor;
mod document;
mod error;
mod scene;

pub use error::GlbError;
pub(crate) use scene::{Part, parts};

use crate::Vec3;
use document::Document;

const MAGIC: &[u8; 4] = b"glTF";
const JSON: &[u8; 4] = b"JSON";
const BINARY: &[u8; 4] = b"BIN\0";
const HEADER: usize = 12;

/// The attribute that holds a medial mesh's radii; names that begin with `_` are the application's own.
pub(crate) const RADIUS: &str = "_RADIUS";

/// What the generator's name begins with in files that this crate wrote.
pub(crate) const GENERATOR: &str = "medial";

/// Carries a point of a glTF file, `y` up, to one with `z` up.
pub(crate) fn z_up(point: Vec3) -> Vec3 {
    Vec3::new(point.x, -point.z, point.y)
}

/// Carries a point with `z` up to one of a glTF file.
pub(crate) fn y_up(point: Vec3) -> Vec3 {
    Vec3::new(point.x, point.z, -point.y)
}

/// Whether a file has a mesh with radii.
///
/// # Errors
/// When it is no binary glTF file or its text cannot be read.
pub(crate) fn has_radii(bytes: &[u8]) -> Result<bool, GlbError> {
    let (json, _) = chunks(bytes)?;
    let document = Document::parse(json)?;
    let mut primitives = document.meshes.iter().flat_map(|mesh| &mesh.primitives);
    Ok(primitives.any(|primitive| primitive.attributes.contains_key(RADIUS)))
}

/// The file of a JSON text and its binary chunk, both filled up to whole words.
///
/// # Errors
/// [`GlbError::TooLarge`] when it has more than 4 GB.
pub(crate) fn pack(json: &str, binary: &[u8]) -> Result<Vec<u8>, GlbError> {
    let padded = |length: usize| length.next_multiple_of(4);
    let total = HEADER + 8 + padded(json.len()) + 8 + padded(binary.len());
    let announced = u32::try_from(total).map_err(|_| GlbError::TooLarge { bytes: total as u64 })?;
    let mut file = Vec::with_capacity(total);
    file.extend(MAGIC);
    file.extend(2_u32.to_le_bytes());
    file.extend(announced.to_le_bytes());
    for (bytes, kind, filler) in [(json.as_bytes(), JSON, b' '), (binary, BINARY, 0)] {
        let end = file.len() + 8 + padded(bytes.len());
        // Below the total, which fits.
        file.extend((padded(bytes.len()) as u32).to_le_bytes());
        file.extend(kind);
        file.extend(bytes);
        file.resize(end, filler);
    }
    Ok(file)
}

/// The JSON text and the binary chunk, which may be missing.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), GlbError> {
    if !bytes.starts_with(MAGIC) {
        return Err(GlbError::Magic);
    }
    let holds = bytes.len();
    let word = |at: usize| {
        let bytes = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    };
    let version = word(4).unwrap_or(0);
    if version != 2 {
        return Err(GlbError::Version(version));
    }
    let announced = word(8).unwrap_or(0);
    if announced as usize != holds {
        return Err(GlbError::Length { announced, holds });
    }
    let mut at = HEADER;
    let mut found = Vec::new();
    // Chunks behind these two are for extensions.
    while found.len() < 2 && at < holds {
        let (chunk, left) = (found.len(), holds.saturating_sub(at + 8));
        let announced = word(at).unwrap_or(0);
        let kind = bytes.get(at + 4..at + 8).ok_or(GlbError::Chunk { chunk, announced, left })?;
        if announced as usize > left {
            return Err(GlbError::Chunk { chunk, announced, left });
        }
        at += 8;
        found.push((kind, &bytes[at..at + announced as usize]));
        at += announced as usize;
    }
    match found.as_slice() {
        [(first, json), rest @ ..] if first == JSON => {
            let binary = rest.first().filter(|(kind, _)| kind == BINARY);
            Ok((json, binary.map_or(&[], |(_, binary)| binary)))
        }
        _ => Err(GlbError::NoJson),
    }
}

#[cfg(test)]
pub(crate) mod tests;
