//! The indexed triangle mesh, its normalisation to unit diagonal, the scaling for exact predicates, and writing.
//!
//! OFF, OBJ and PLY are written as text. Coordinates are the shortest decimals (at most 17 digits) that read back as the
//! same double.

use std::io::{self, Write};
use std::path::Path;

use super::format::Format;
use super::report::{Fault, SurfaceError};
use crate::Vec3;
use crate::atomic::write_atomically;

/// An indexed triangle mesh. Faces are counter-clockwise seen from outside once oriented.
///
/// The type itself guarantees only valid indices; [`crate::surface`] holds the checks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Positions, in the unit of the file or of the generator.
    pub vertices: Vec<Vec3>,
    /// Vertex indices of each triangle.
    pub faces: Vec<[u32; 3]>,
}

impl TriMesh {
    /// The three corner positions of a face.
    ///
    /// # Panics
    /// If `face` or one of its indices is out of range.
    pub fn triangle(&self, face: usize) -> [Vec3; 3] {
        self.faces[face].map(|v| self.vertices[v as usize])
    }

    /// Smallest and largest corner of the axis-parallel bounding box, or `None` without vertices.
    pub fn bounding_box(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.vertices.first()?;
        Some(self.vertices.iter().fold((first, first), |(lo, hi), &v| (lo.min(v), hi.max(v))))
    }
}

/// The similarity that carries input coordinates to normalised ones: `x -> (x - origin) / diagonal`.
///
/// Normalised shapes have a bounding-box diagonal of 1, so every error is a fraction of it and
/// constants such as Q-MAT's `k` keep the meaning of their paper.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Normalisation {
    /// Centre of the input's bounding box, in input units.
    pub origin: Vec3,
    /// Bounding-box diagonal, in input units; positive and finite.
    pub diagonal: f64,
}

impl Normalisation {
    /// The normalisation of a mesh, or `None` when its diagonal is zero or not finite.
    pub fn of(mesh: &TriMesh) -> Option<Self> {
        let (lo, hi) = mesh.bounding_box()?;
        let extent = hi - lo;
        // Divide by the largest side before squaring: 1e200 must not overflow, 1e-200 not vanish.
        let side = extent.max_element();
        if !(side > 0.0 && side.is_finite()) {
            return None;
        }
        let diagonal = (extent / side).length() * side;
        let origin = lo + extent * 0.5;
        (diagonal.is_finite() && origin.is_finite()).then_some(Self { origin, diagonal })
    }

    /// Input point to normalised point.
    pub fn forward(&self, point: Vec3) -> Vec3 {
        (point - self.origin) / self.diagonal
    }

    /// Normalised point to input point.
    pub fn backward(&self, point: Vec3) -> Vec3 {
        point * self.diagonal + self.origin
    }
}

// The power-of-two scaling that keeps exact predicates within the range of `f64`.
//
// [`Unit`] scales so that the largest coordinate lies in [1/2, 1), which loses nothing, and sets
// coordinates below 2^-150 to zero. A product of five coordinates and of their rounding errors then stays
// above 2^-1015, so that no predicate of [`crate::geometry::predicates`] can underflow.

/// Scaling by a power of two to coordinates below 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Unit {
    exponent: i32,
}

/// Smaller scaled coordinates are taken as zero.
const FLUSH: f64 = 1.0 / (1u128 << 75) as f64 / (1u128 << 75) as f64;

impl Unit {
    /// The scaling that suits these points.
    pub(super) fn of(points: &[Vec3]) -> Self {
        let largest = points.iter().fold(0.0_f64, |m, p| m.max(p.abs().max_element()));
        Self { exponent: if largest.is_finite() { exponent(largest) } else { 0 } }
    }

    /// From the unit of the file to scaled coordinates, tiny ones flushed.
    #[inline]
    pub(super) fn forward(self, p: Vec3) -> Vec3 {
        Vec3::from(p.to_array().map(|x| {
            let scaled = times_power(x, -self.exponent);
            // Adding zero turns -0 into 0.
            if scaled.abs() < FLUSH { 0.0 } else { scaled + 0.0 }
        }))
    }

    /// From scaled coordinates to the unit of the file.
    pub(super) fn restore(self, p: Vec3) -> Vec3 {
        Vec3::from(p.to_array().map(|x| times_power(x, self.exponent)))
    }

    /// [`Self::forward`] for many points.
    pub(super) fn forward_all(self, points: &[Vec3]) -> Vec<Vec3> {
        points.iter().map(|&p| self.forward(p)).collect()
    }

    /// A quantity of the given dimension (1 length, 2 area, 3 volume) in the unit of the file, or
    /// `None` where that is not representable.
    pub(super) fn backward(self, value: f64, dimension: i32) -> Option<f64> {
        let scaled = times_power(value, dimension * self.exponent);
        (scaled.is_finite() && (scaled.is_normal() || value == 0.0)).then_some(scaled)
    }
}

/// The smallest `e` with `value < 2^e`, for finite `value`.
fn exponent(value: f64) -> i32 {
    if value == 0.0 {
        return 0;
    }
    if value < f64::MIN_POSITIVE {
        // Subnormal: scaled into the normal range first.
        return exponent(value * TWO_POW_64) - 64;
    }
    ((value.to_bits() >> 52) & 0x7ff) as i32 - 1022
}

const TWO_POW_64: f64 = 18_446_744_073_709_551_616.0;

/// `value * 2^power`, in steps small enough to be representable.
#[inline]
fn times_power(mut value: f64, mut power: i32) -> f64 {
    while power != 0 {
        // 2^1000 is a normal number; 2^2000 is none.
        let step = power.clamp(-1000, 1000);
        value *= f64::from_bits(((1023 + step) as u64) << 52);
        power -= step;
    }
    value
}

/// Writes a mesh in the format of the extension: `.off`, `.obj`, `.ply` or `.stl`.
///
/// A file of that name is replaced, but only by a complete one. STL is written as text with all digits, because its
/// binary form has single precision. It holds a vertex once for every face: when it is read, vertices are in another
/// order, and those at one position are one.
///
/// # Errors
/// When the extension is unknown, or the file cannot be written.
///
/// ```no_run
/// let loaded = medial::surface::read("scan.stl")?;
/// medial::surface::write("repaired.ply", &loaded.mesh)?;
/// # Ok::<(), medial::surface::SurfaceError>(())
/// ```
pub fn write(path: impl AsRef<Path>, mesh: &TriMesh) -> Result<(), SurfaceError> {
    let path = path.as_ref();
    let written = Format::of(path).and_then(|format| replace(path, mesh, format));
    written.map_err(|fault| SurfaceError { file: Some(path.to_owned()), fault })
}

fn replace(path: &Path, mesh: &TriMesh, format: Format) -> Result<(), Fault> {
    write_atomically(path, |out| write_to(out, mesh, format))
        .map_err(|error| Fault::Io(format!("cannot be written: {error}")))
}

/// The text of a mesh in a format of text.
fn write_to(out: &mut dyn Write, mesh: &TriMesh, format: Format) -> io::Result<()> {
    if format == Format::Stl {
        return write_stl(out, mesh);
    }
    let (vertices, faces) = (mesh.vertices.len(), mesh.faces.len());
    let (vertex_word, face_word, base) = match format {
        Format::Obj => ("v ", "f", 1),
        _ => ("", "3", 0),
    };
    match format {
        Format::Off => writeln!(out, "OFF\n{vertices} {faces} 0")?,
        Format::Ply => {
            writeln!(out, "ply\nformat ascii 1.0\nelement vertex {vertices}")?;
            writeln!(out, "property double x\nproperty double y\nproperty double z")?;
            writeln!(out, "element face {faces}")?;
            writeln!(out, "property list uchar uint vertex_indices\nend_header")?;
        }
        Format::Obj | Format::Stl => {}
    }
    for v in &mesh.vertices {
        writeln!(out, "{vertex_word}{:?} {:?} {:?}", v.x, v.y, v.z)?;
    }
    for face in &mesh.faces {
        let [a, b, c] = face.map(|v| u64::from(v) + base);
        writeln!(out, "{face_word} {a} {b} {c}")?;
    }
    Ok(())
}

fn write_stl(out: &mut dyn Write, mesh: &TriMesh) -> io::Result<()> {
    writeln!(out, "solid medial")?;
    for face in 0..mesh.faces.len() {
        let corners = mesh.triangle(face);
        // In the unit of its longest side: squares of very small or large ones are not representable.
        let [a, b] = [corners[1] - corners[0], corners[2] - corners[0]];
        let longest = a.abs().max_element().max(b.abs().max_element());
        let normal = (a / longest).cross(b / longest).normalize_or_zero();
        writeln!(out, "facet normal {:?} {:?} {:?}\nouter loop", normal.x, normal.y, normal.z)?;
        for v in corners {
            writeln!(out, "vertex {:?} {:?} {:?}", v.x, v.y, v.z)?;
        }
        writeln!(out, "endloop\nendfacet")?;
    }
    writeln!(out, "endsolid medial")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_scaling_is_exact_over_the_whole_range() {
        for largest in [1.0, 0.75, 1e200, 1e-160, f64::MAX, f64::MIN_POSITIVE, 5e-324, 1e12 + 1.0] {
            let unit = Unit::of(&[Vec3::new(largest, 0.0, -largest)]);
            let scaled = unit.forward(Vec3::new(largest, 0.0, -largest));
            assert!(scaled.x < 1.0 && scaled.x >= 0.5, "{largest} became {}", scaled.x);
            assert_eq!(times_power(scaled.x, unit.exponent), largest);
        }
    }
}

#[cfg(test)]
pub(crate) mod fixtures {
    use super::{TriMesh, Vec3};

    /// An axis-parallel box of 12 triangles, outward.
    pub(crate) fn cuboid(lo: Vec3, hi: Vec3) -> TriMesh {
        let corner = |k: u32| {
            let at = [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { lo[axis] } else { hi[axis] });
            Vec3::from(at)
        };
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        TriMesh { vertices: (0..8).map(corner).collect(), faces }
    }
}
