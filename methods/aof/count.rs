//! The axis with a number of voxels: a lattice as coarse as the count allows, then deletion.
//!
//! 1. The axis of the base has too many voxels. Of these, those on sheets grow in number with the
//!    square of the resolution, those on curves with the resolution itself. This gives the resolution
//!    that should have the count; every lattice that is tried corrects the estimate.
//! 2. The search ends with a lattice that has the topology of the base and a few more voxels than
//!    asked. Where the topology is lost, the next one lies half way to the coarsest lattice that has it.
//! 3. The rest is deleted, simple voxels of the largest flux first.
//!
//! Which lattices are tried depends on the count alone, so that the same count has the same answer
//! whatever was asked before. Lattices that are there already are not made again.

use std::sync::Arc;

use medial::simplifier::{Diagnostics, SimplifyError};

use super::bricks::Bricks;
use super::output::sorted;
use super::params::Variant;
use super::solid::{Axis, Base, Solid, betti_of};
use super::thinning::{Order, thin};
use crate::reuse::Reuse;

/// Lattices tried by resolution; `None` where the topology of the base is lost.
pub type Lattices = Reuse<u32, Option<Axis>>;

/// A lattice with at most this share of voxels above the count is not made coarser.
const ENOUGH: f64 = 1.15;
/// What the estimate aims at, in counts.
const AIM: f64 = 1.06;
/// Lattices that are tried for a count.
const MOST_TRIES: usize = 8;
/// Neighbours from which on a voxel of a thinned axis is taken to be on a sheet.
const ON_A_SHEET: u32 = 4;

impl Solid<'_> {
    /// The axis of a lattice about as coarse as `count` voxels allow, with the topology of the base,
    /// taken down to the count.
    ///
    /// # Errors
    /// When the run was cancelled.
    pub(super) fn with_count(
        &self,
        base: &Base,
        count: usize,
        lattices: &mut Lattices,
        diagnostics: &mut Diagnostics,
    ) -> Result<Axis, SimplifyError> {
        let angle = self.params().angle;
        let mut best = lattices
            .get(base.resolution, || self.axis(base.resolution, &base.descent, angle).map(Some))?;
        let size = |lattice: &Arc<Option<Axis>>| lattice.as_ref().as_ref().map_or(0, Axis::len);
        if size(&best) <= count {
            if size(&best) < count {
                diagnostics.warn(format!(
                    "{} spheres instead of {count}: the axis has no more voxels at resolution {}",
                    size(&best),
                    base.resolution
                ));
            }
            return Ok(taken(&best));
        }
        let mut growth = Growth::of(&taken(&best), base.resolution);
        let (mut low, mut high) = (1, base.resolution);
        let (mut tried, mut is_lost) = (0, false);
        while tried < MOST_TRIES && size(&best) as f64 > ENOUGH * count as f64 {
            // Below a lattice that lost the topology not much is gained by going close to it.
            if high - low <= 1 + high / if is_lost { 8 } else { 16 } {
                break;
            }
            tried += 1;
            let ideal = growth.resolution_of(AIM * count as f64);
            let next = if low < ideal && ideal < high { ideal } else { low.midpoint(high) };
            let lattice = lattices.get(next, || self.axis_with_topology(next, base.topology))?;
            is_lost |= lattice.is_none();
            match size(&lattice) {
                0 => low = next,
                found => {
                    growth.correct(next, found);
                    if found >= count {
                        (best, high) = (lattice, next);
                    } else {
                        low = next;
                    }
                }
            }
        }
        let mut axis = taken(&best);
        if axis.len() > count {
            self.take_down(&mut axis, count, diagnostics)?;
        }
        diagnostics.count("lattice", high as usize);
        diagnostics.count("lattices_tried", tried);
        Ok(axis)
    }

    fn axis_with_topology(
        &self,
        resolution: u32,
        topology: Option<[u64; 3]>,
    ) -> Result<Option<Axis>, SimplifyError> {
        let base = self.descend(resolution, self.wanted())?;
        if topology.is_some_and(|topology| betti_of(&base.voxels) != topology) {
            return Ok(None);
        }
        self.axis(resolution, &base, self.params().angle).map(Some)
    }

    fn take_down(
        &self,
        axis: &mut Axis,
        count: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), SimplifyError> {
        let before = axis.voxels.len();
        if self.params().variant == Variant::Plain {
            axis.voxels.sort_by(|a, b| a.flux.total_cmp(&b.flux));
            axis.voxels.truncate(count);
            axis.voxels.sort_unstable_by_key(|v| [v.place[2], v.place[1], v.place[0]]);
        } else {
            let mut voxels = bricks_of(axis);
            thin(&mut voxels, Order::Down { to: count }, self.run())?;
            axis.voxels = sorted(&voxels);
            if axis.voxels.len() > count {
                diagnostics.warn(format!(
                    "{} spheres instead of {count}: to delete another voxel would change the \
                     topology",
                    axis.voxels.len()
                ));
            }
        }
        diagnostics.count("deleted_to_the_count", before - axis.voxels.len());
        Ok(())
    }
}

fn taken(lattice: &Option<Axis>) -> Axis {
    lattice.clone().expect("a lattice with voxels")
}

fn bricks_of(axis: &Axis) -> Bricks {
    let mut voxels = Bricks::new(axis.grid.size);
    axis.voxels.iter().for_each(|&voxel| voxels.insert(voxel));
    voxels
}

/// Number of voxels by resolution `R`: `sheets R^2 + curves R`.
struct Growth {
    sheets: f64,
    curves: f64,
}

impl Growth {
    fn of(axis: &Axis, resolution: u32) -> Self {
        let voxels = bricks_of(axis);
        let neighbours = |place| voxels.neighbourhood(place).count_ones() - 1;
        let places = axis.voxels.iter().map(|voxel| voxel.place);
        let sheets = places.filter(|&place| neighbours(place) >= ON_A_SHEET).count();
        let r = f64::from(resolution);
        Self { sheets: sheets as f64 / (r * r), curves: (axis.voxels.len() - sheets) as f64 / r }
    }

    /// The resolution, rounded up, that should have so many voxels.
    fn resolution_of(&self, voxels: f64) -> u32 {
        // The root of a quadratic without cancellation, and without division where it is linear.
        let root = (self.curves * self.curves + 4.0 * self.sheets * voxels).sqrt();
        (2.0 * voxels / (self.curves + root)).ceil() as u32
    }

    /// Makes the numbers fit those of a lattice.
    fn correct(&mut self, resolution: u32, found: usize) {
        let r = f64::from(resolution);
        let factor = found as f64 / (self.sheets * r * r + self.curves * r);
        self.sheets *= factor;
        self.curves *= factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_solved_for_the_resolution() {
        for (sheets, curves) in [(2.0, 0.0), (0.0, 3.0), (0.5, 7.0)] {
            let mut growth = Growth { sheets, curves };
            let at = |r: f64| sheets * r * r + curves * r;
            assert_eq!(growth.resolution_of(at(40.0) * (1.0 - 1e-12)), 40);
            assert_eq!(growth.resolution_of(at(40.0) * 1.001), 41);
            growth.correct(20, (2.0 * at(20.0)) as usize);
            assert_eq!(growth.resolution_of(2.0 * at(30.0) * (1.0 - 1e-12)), 30);
        }
    }
}
