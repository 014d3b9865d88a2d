//! The axis with a number of voxels: a lattice as coarse as the count allows, then deletion.
//!
//! 1. The axis of the base has too many voxels, or too few. Of these, those on sheets grow in number
//!    with the square of the resolution, those on curves with the resolution itself. This gives the
//!    resolution that should have the count; every lattice that is tried corrects the estimate.
//! 2. Too few: finer lattices are tried, each at most twice as fine as the one before, until one has
//!    the count, memory or effort ends, or finer lattices bring no more voxels.
//! 3. Too many: the search ends with a lattice that has the topology of the base, loses no more of the
//!    surface, and has a few more voxels than asked. Where either is lost, the next one lies half way
//!    to the coarsest lattice that has both.
//! 4. The rest is deleted, simple voxels of the largest flux first.
//!
//! No lattice is tried twice.

use medial::simplifier::{Diagnostics, SimplifyError};

use super::advice::MAX_VISITS;
use super::base::Base;
use super::bricks::Bricks;
use super::losses::LOST;
use super::output::sorted;
use super::params::Variant;
use super::solid::{Axis, Solid, betti_of};
use super::thinning::{Order, thin};

/// A lattice with at most this share of voxels above the count is not made coarser.
const ENOUGH: f64 = 1.15;
/// A lattice may lose so much more of the surface than the base does or may.
const WORSE: f64 = 1.2;
/// The size that the estimate aims at, in requested counts.
const AIM: f64 = 1.06;
/// Lattices that are tried for a count.
const MAX_TRIES: usize = 8;
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
        diagnostics: &mut Diagnostics,
    ) -> Result<Axis, SimplifyError> {
        let angle = self.params().angle;
        let first = self.axis(base.resolution, &base.descent, angle)?;
        let mut search = Search {
            growth: Growth::of(&first, base.resolution),
            best: first,
            high: base.resolution,
            low: 1,
            tried: 0,
        };
        if search.best.len() < count {
            self.climb(base, count, &mut search)?;
        }
        if search.best.len() > count {
            self.descend_to(base, count, &mut search)?;
        }
        let mut axis = search.best;
        if axis.len() < count {
            diagnostics.warn(format!(
                "{} spheres instead of {count}: the axis has no more voxels at resolution {}, the \
                 finest that was tried",
                axis.len(),
                search.high
            ));
        }
        if axis.len() > count {
            self.take_down(&mut axis, count, diagnostics)?;
            self.say_what_the_count_loses(&axis, search.high, diagnostics)?;
        }
        self.say_what_is_lost(base, search.high, diagnostics)?;
        diagnostics.count("lattice", search.high as usize);
        diagnostics.count("lattices_tried", search.tried);
        Ok(axis)
    }

    /// Step 2.
    fn climb(&self, base: &Base, count: usize, search: &mut Search) -> Result<(), SimplifyError> {
        let mut at = search.high;
        while search.tried < MAX_TRIES && search.best.len() < count {
            let ideal = search.growth.resolution_of(AIM * count as f64);
            // At least a sixteenth finer, so that few tries suffice; at most twice, since estimates
            // from a coarse lattice are poor.
            let next = ideal.clamp(at + 1 + at / 16, 2 * at + 1);
            if self.check_resolution(next).is_err() || self.visits(next) > MAX_VISITS {
                break;
            }
            search.tried += 1;
            let lattice = self.faithful_axis(next, base)?;
            let found = lattice.as_ref().map_or(0, Axis::len);
            if let Some(lattice) = lattice
                && found > search.best.len()
            {
                search.growth.correct(next, found);
                (search.low, search.high) = (search.high, next);
                search.best = lattice;
            } else if found > 0 && 2 * next >= 3 * at {
                // The axis is a curve's end, or a point: it has no more voxels on any lattice.
                break;
            }
            at = next;
        }
        Ok(())
    }

    /// Step 3.
    fn descend_to(
        &self,
        base: &Base,
        count: usize,
        search: &mut Search,
    ) -> Result<(), SimplifyError> {
        let mut is_lost = false;
        while search.tried < MAX_TRIES && search.best.len() as f64 > ENOUGH * count as f64 {
            let Search { low, high, .. } = *search;
            // The bracket is narrow enough, the sooner if its lower end lost the topology.
            if high - low <= 1 + high / if is_lost { 8 } else { 16 } {
                break;
            }
            search.tried += 1;
            let ideal = search.growth.resolution_of(AIM * count as f64);
            // An estimate outside the bracket has been refuted: bisect.
            let next = if low < ideal && ideal < high { ideal } else { low.midpoint(high) };
            let lattice = self.faithful_axis(next, base)?;
            is_lost |= lattice.is_none();
            let found = lattice.as_ref().map_or(0, Axis::len);
            if found > 0 {
                search.growth.correct(next, found);
            }
            match lattice {
                Some(lattice) if found >= count => {
                    (search.best, search.high) = (lattice, next);
                }
                _ => search.low = next,
            }
        }
        Ok(())
    }

    /// The axis of a lattice; `None` where the topology or a part of the base is lost.
    fn faithful_axis(&self, resolution: u32, base: &Base) -> Result<Option<Axis>, SimplifyError> {
        let start = self.descend(resolution, self.wanted())?;
        let (topology, base_loss) = (base.topology, base.loss.map_or(0.0, |loss| loss.distance));
        // Another topology than the base's is accepted if it is the solid's: the base may lack it.
        let is_other = |b, t| b != t && Some(b) != self.shape.expected_betti();
        if topology.is_some_and(|t| is_other(betti_of(&start.voxels), t)) {
            return Ok(None);
        }
        let most = base_loss.max(LOST * self.grid(self.params().resolution).side);
        if self.loss(resolution, &start.voxels, WORSE * most)?.is_some() {
            return Ok(None);
        }
        self.axis(resolution, &start, self.params().angle).map(Some)
    }

    /// Warns about parts of the surface far from all spheres of an axis that was taken down to a count.
    fn say_what_the_count_loses(
        &self,
        axis: &Axis,
        resolution: u32,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), SimplifyError> {
        let allowed = LOST * axis.grid.side;
        if let Some(loss) = self.loss_of(resolution, &axis.voxels, allowed)? {
            let place = self.shape.normalisation().backward(loss.place);
            diagnostics.warn(format!(
                "the surface at ({:.6}, {:.6}, {:.6}) is {:.1} % of the diagonal away from every sphere: \
                 {} of them do not reach all of the solid",
                place.x,
                place.y,
                place.z,
                100.0 * loss.distance,
                axis.len()
            ));
        }
        Ok(())
    }

    fn take_down(
        &self,
        axis: &mut Axis,
        count: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), SimplifyError> {
        let before = axis.voxels.len();
        if self.params().variant == Variant::Plain {
            // Most negative flux first. Stable, so ties go by place; then back to the order of places.
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

/// Lattices on both sides of a count.
struct Search {
    growth: Growth,
    /// The coarsest with the count, or the finest that was tried.
    best: Axis,
    /// Its resolution.
    high: u32,
    /// A coarser resolution that has too few voxels, or not the topology.
    low: u32,
    tried: usize,
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

    /// The resolution, rounded up, that should give this number of voxels.
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
