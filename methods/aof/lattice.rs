//! The voxels of a result as data for others.

use medial::Vec3;
use medial::complex::cubical_betti;

/// The voxels of a cubic lattice that the spheres of a result stand for, one for each sphere in the
/// same order.
#[derive(Clone, Debug, PartialEq)]
pub struct LatticeVoxels {
    /// Lower corner of the lattice, in normalised units.
    pub origin: Vec3,
    /// Side of a voxel, in normalised units.
    pub side: f64,
    /// Voxels of the lattice along each axis.
    pub size: [u32; 3],
    /// The voxels, by `z`, then `y`, then `x`.
    pub voxels: Vec<LatticeVoxel>,
}

/// A voxel with what was measured there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticeVoxel {
    /// Indices along the axes, from the lower corner.
    pub place: [u32; 3],
    /// Distance of its centre to the surface, in normalised units, to single precision.
    pub distance: f64,
    /// Average outward flux of the gradient of the distance, `AOF'`; 0 where it was not measured.
    pub flux: f64,
}

impl LatticeVoxels {
    /// Centre of a voxel, in normalised units.
    pub fn centre(&self, voxel: &LatticeVoxel) -> Vec3 {
        self.origin + (Vec3::from(voxel.place.map(f64::from)) + 0.5) * self.side
    }

    /// Betti numbers of the union of the closed voxels.
    pub fn betti(&self) -> [u64; 3] {
        cubical_betti(&self.voxels.iter().map(|voxel| voxel.place).collect::<Vec<_>>())
    }
}
