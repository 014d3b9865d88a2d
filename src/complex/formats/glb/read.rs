//! Reads the medial mesh of a binary glTF file.

use std::collections::HashMap;

use crate::complex::formats::canonical::{canonical, note};
use crate::complex::formats::lone::with_sides;
use crate::complex::formats::{LoadedMa, MaError, MaErrorKind, Radii};
use crate::complex::{ComplexError, Sphere};
use crate::glb::{GlbError, Part, parts};

/// Reads a medial mesh from the content of a `.glb` file; `name` stands for the file in errors.
///
/// All primitives of the scene with an attribute `_RADIUS`, where their nodes put them, radii scaled along; coordinates
/// turned to `z` up. Numbers are those of single precision.
///
/// # Errors
/// When the file cannot be read as glTF, has no radii, or a node scales its axes differently; when a coordinate or
/// radius is not finite, or a radius negative.
///
/// # Cost
/// Linear in the file and in the copies of meshes that its scene makes, which are bounded.
pub fn parse_glb(content: impl AsRef<[u8]>, name: &str) -> Result<LoadedMa, MaError> {
    let fail = |kind: MaErrorKind| MaError::of(name, kind);
    let scene = parts(content.as_ref()).map_err(|error| fail(error.into()))?;
    let mut notes = scene.passed_over;
    let all = scene.parts.len();
    let parts: Vec<Part> = scene.parts.into_iter().filter(|part| part.radii.is_some()).collect();
    if parts.is_empty() {
        return Err(fail(GlbError::Unsupported(NO_RADII.to_owned()).into()));
    }
    // The balls of own files are no surprise.
    if !scene.is_own {
        note(
            &mut notes,
            all - parts.len(),
            "mesh without radii",
            "meshes without radii",
            "not used",
        );
    }
    let mut found = Found::default();
    for part in parts {
        found.add(part, !scene.is_own).map_err(|error| fail(error.into()))?;
    }
    note(&mut notes, found.welded, "sphere", "spheres", "merged with an equal one");
    found.faces.sort_unstable();
    let edges = with_sides(found.edges, &found.faces);
    canonical(found.spheres, edges, found.faces, Radii::Needed, notes).map_err(fail)
}

const NO_RADII: &str = "no mesh of the scene has the attribute _RADIUS: a surface, no medial mesh";

#[derive(Default)]
struct Found {
    spheres: Vec<Sphere>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    known: HashMap<[u64; 4], u32>,
    welded: usize,
}

impl Found {
    fn add(&mut self, part: Part, welds: bool) -> Result<(), ComplexError> {
        let Part { points, radii, triangles, segments } = part;
        let mut ids = Vec::with_capacity(points.len());
        for (centre, radius) in points.into_iter().zip(radii.into_iter().flatten()) {
            let next = self.spheres.len();
            if !(centre.is_finite() && radius.is_finite() && radius >= 0.0) {
                return Err(ComplexError::Sphere { sphere: next, centre, radius });
            }
            // The number of vertices is bounded far below 2^32 by the size of the file.
            let mut id = next as u32;
            if welds {
                // Zeros of either sign are equal.
                let bits = |x: f64| (x + 0.0).to_bits();
                let key = [bits(centre.x), bits(centre.y), bits(centre.z), bits(radius)];
                id = *self.known.entry(key).or_insert(id);
            }
            match id as usize == next {
                true => self.spheres.push(Sphere::new(centre, radius)),
                false => self.welded += 1,
            }
            ids.push(id);
        }
        self.edges.extend(segments.into_iter().map(|ends| ends.map(|v| ids[v as usize])));
        self.faces.extend(triangles.into_iter().map(|corners| {
            let mut face = corners.map(|v| ids[v as usize]);
            // Windings are for viewers; the canonical form has none, and their loss needs no note.
            face.sort_unstable();
            face
        }));
        Ok(())
    }
}
