//! The cubic lattice: levels of voxels over the bounding box.

use medial::Vec3;
use medial::surface::TriMesh;

use super::bricks::Place;

/// A lattice whose voxels have `resolution` along the longest side of the bounding box; its lower
/// corner is that of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Lower corner.
    pub origin: Vec3,
    /// `sigma` at the finest level.
    pub side: f64,
    /// Voxels along each axis at the finest level, a multiple of `split`.
    pub size: [u32; 3],
    /// Voxels of the finest level along a side of the coarsest.
    pub split: u32,
}

impl Grid {
    /// The lattice over a mesh.
    ///
    /// # Panics
    /// If the mesh has no vertices.
    pub fn new(mesh: &TriMesh, resolution: u32, split: u32) -> Self {
        let (lo, hi) = mesh.bounding_box().expect("a shape has vertices");
        let extent = hi - lo;
        let side = extent.max_element() / f64::from(resolution);
        // Rounding must not add a voxel to a side that is a whole number of voxels.
        let size = extent.to_array().map(|length| {
            let voxels = (length / side * (1.0 - 1e-9)).ceil().max(1.0) as u32;
            voxels.next_multiple_of(split)
        });
        Self { origin: lo, side, size, split }
    }

    /// Centre of a voxel of the finest level.
    pub fn centre(&self, place: Place) -> Vec3 {
        let [x, y, z] = place.map(|i| f64::from(i) + 0.5);
        self.origin + Vec3::new(x, y, z) * self.side
    }

    /// Voxels of the coarsest level along each axis.
    pub fn coarse_size(&self) -> [u32; 3] {
        self.size.map(|n| n / self.split)
    }
}
