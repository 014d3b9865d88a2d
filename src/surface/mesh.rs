//! The indexed triangle mesh and its normalisation to unit diagonal.

use crate::Vec3;

/// An indexed triangle mesh. Faces are counter-clockwise seen from outside once oriented.
///
/// The type itself promises nothing but valid indices; [`crate::surface`] holds the checks.
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
/// constants such as Q-MAT's `k` mean what their paper says.
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
