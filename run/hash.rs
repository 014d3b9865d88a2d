//! SHA-256 of bytes and of medial meshes, in hexadecimal.

use std::fmt::Write as _;

use medial::complex::MedialMesh;
use sha2::{Digest, Sha256};

/// SHA-256 in hexadecimal.
pub fn hex_digest(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Bytes in hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// SHA-256 of spheres, edges and faces: equal for equal meshes only.
pub fn mesh_hash(mesh: &MedialMesh) -> String {
    let mut hasher = Sha256::new();
    let counts = [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()];
    // Counts first: without them a face could pass for part of an edge list.
    counts.iter().for_each(|&count| hasher.update((count as u64).to_le_bytes()));
    for sphere in &mesh.spheres {
        let numbers = [sphere.centre.x, sphere.centre.y, sphere.centre.z, sphere.radius];
        numbers.iter().for_each(|number| hasher.update(number.to_le_bytes()));
    }
    let indices = mesh.edges.as_flattened().iter().chain(mesh.faces.as_flattened());
    indices.for_each(|index| hasher.update(index.to_le_bytes()));
    hex(&hasher.finalize())
}
