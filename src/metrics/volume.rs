//! Volume of the symmetric difference between a solid and the union of its medial primitives.
//!
//! 1. A box around both is divided into cells. A cell that neither the surface nor the boundary of
//!    the union can reach is wholly in the difference or wholly out: distances are 1-Lipschitz, so
//!    one query at its centre tells. Other cells are divided into eight.
//! 2. At the finest level each cell is decided by one random point.
//!
//! Only a shell around the two boundaries is ever refined, so the finest cells are those of a
//! stratified, jittered grid of `2^depth` cells along each side at a fraction of its cost.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::MetricError;
use crate::Vec3;
use crate::complex::MedialUnion;
use crate::geometry::TriangleBvh;
use crate::surface::TriMesh;

/// How finely to divide space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VolumeOptions {
    /// Levels of division: the finest cells have `2^-depth` of the side of the box.
    pub depth: u32,
    /// Seed of the random points.
    pub seed: u64,
}

impl Default for VolumeOptions {
    fn default() -> Self {
        Self { depth: 7, seed: 0 }
    }
}

/// Levels divided on one thread: `8^COARSE` independent tasks.
const COARSE: u32 = 2;

/// Signed volume that a closed surface encloses, exact up to rounding by the divergence theorem;
/// positive when its faces are counter-clockwise seen from outside.
pub fn enclosed_volume(surface: &TriMesh) -> f64 {
    let origin = surface.bounding_box().map_or(Vec3::ZERO, |(lo, hi)| lo.midpoint(hi));
    let six_times: f64 = (0..surface.faces.len())
        .map(|face| {
            let [a, b, c] = surface.triangle(face).map(|v| v - origin);
            a.dot(b.cross(c))
        })
        .sum();
    six_times / 6.0
}

/// Volume of the symmetric difference of the solid and the union, over the solid's volume.
///
/// `inside` tells whether a point lies in the solid that `surface` bounds, whose faces are in
/// `bvh`. The same number comes out for any number of threads.
///
/// # Errors
/// When the surface does not enclose a positive volume.
pub fn volume_error(
    surface: &TriMesh,
    bvh: &TriangleBvh,
    inside: impl Fn(Vec3) -> bool + Sync,
    union: &MedialUnion,
    options: &VolumeOptions,
) -> Result<f64, MetricError> {
    let volume = enclosed_volume(surface);
    if !(volume > 0.0 && volume.is_finite()) {
        return Err(MetricError::NoVolume(volume));
    }
    let (mut lo, mut hi) = union.bounding_box();
    if let Some((surface_lo, surface_hi)) = surface.bounding_box() {
        (lo, hi) = (lo.min(surface_lo), hi.max(surface_hi));
    }
    let division = Division { bvh, inside: &inside, union, depth: options.depth };
    let root = Cell { lo, size: hi - lo, level: 0 };
    let coarse = (0..options.depth.min(COARSE))
        .fold(vec![root], |cells, _| cells.iter().flat_map(Cell::children).collect());
    let parts: Vec<f64> = coarse
        .par_iter()
        .enumerate()
        .map(|(index, cell)| {
            let seed = options.seed ^ (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            division.difference(cell, &mut Pcg64::seed_from_u64(seed))
        })
        .collect();
    Ok(parts.iter().sum::<f64>() / volume)
}

#[derive(Clone, Copy)]
struct Cell {
    lo: Vec3,
    size: Vec3,
    level: u32,
}

impl Cell {
    fn children(&self) -> [Self; 8] {
        let size = self.size * 0.5;
        std::array::from_fn(|k| {
            let offset = Vec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
            Self { lo: self.lo + offset * size, size, level: self.level + 1 }
        })
    }

    fn volume(&self) -> f64 {
        self.size.x * self.size.y * self.size.z
    }
}

struct Division<'a, F> {
    bvh: &'a TriangleBvh,
    inside: &'a F,
    union: &'a MedialUnion,
    depth: u32,
}

impl<F: Fn(Vec3) -> bool> Division<'_, F> {
    /// Volume of the part of the difference in a cell.
    fn difference(&self, cell: &Cell, rng: &mut Pcg64) -> f64 {
        if cell.level >= self.depth {
            let jitter = Vec3::new(rng.random(), rng.random(), rng.random());
            let point = cell.lo + jitter * cell.size;
            let differs = (self.inside)(point) != self.union.buries(point, 0.0);
            return if differs { cell.volume() } else { 0.0 };
        }
        let (centre, reach) = (cell.lo + cell.size * 0.5, cell.size.length() * 0.5);
        // Most cells are near the surface, which is the quickest to find out; and none of these
        // questions needs the distance itself.
        if !self.bvh.any_within(centre, reach) {
            let covered = self.union.buries(centre, reach);
            if covered || !self.union.buries(centre, -reach) {
                let differs = (self.inside)(centre) != covered;
                return if differs { cell.volume() } else { 0.0 };
            }
        }
        cell.children().iter().map(|child| self.difference(child, rng)).sum()
    }
}
