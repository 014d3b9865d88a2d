//! Lattices that are refused, and which one to ask for instead.
//!
//! A suggested lattice was tried, or follows from a measured distance. The effort of trying is bounded:
//! for a nearly flat solid the voxels grow with the square of the resolution.

use medial::simplifier::SimplifyError;

use super::coarse_to_fine::Wanted;
use super::params::MAX_RESOLUTION;
use super::solid::Solid;

/// Bytes for each voxel of the start set: values in bricks that are not full, twice while one is
/// thinned, lists of blocks, the heap.
pub(super) const BYTES_PER_VOXEL: f64 = 64.0;

/// Voxels that a lattice tried for advice may visit.
pub(super) const MAX_VISITS: f64 = 2e7;

/// A lattice of this resolution tells how deep a solid is, where the one asked has too many voxels.
const SOUNDING: u32 = 54;

/// A voxel whose sphere fits is there wherever the distance is so many sides: its centre is at most
/// half a diagonal away.
pub(super) const SURELY: f64 = 1.9;

impl Solid<'_> {
    /// Refuses lattices that have too many voxels along a side or do not fit into memory.
    pub(super) fn check_resolution(&self, resolution: u32) -> Result<(), SimplifyError> {
        if resolution > MAX_RESOLUTION {
            return Err(SimplifyError::Parameter(format!(
                "resolution = {resolution}: above {MAX_RESOLUTION} voxels along the longest side"
            )));
        }
        let (megabytes, voxels) = self.megabytes(resolution);
        let limit = self.params().max_memory;
        if megabytes <= limit {
            return Ok(());
        }
        let advice = match self.fitting(resolution) {
            Some(fits) => format!("resolution = {fits} fits, or raise max_memory"),
            None => format!("give max_memory = {}", megabytes.ceil()),
        };
        Err(SimplifyError::Parameter(format!(
            "resolution = {resolution}: about {megabytes:.3} MB for {voxels:.3e} voxels, above \
             max_memory = {limit}; {advice}"
        )))
    }

    /// The largest resolution below a given one that fits into memory, if it surely has voxels.
    pub(super) fn fitting(&self, resolution: u32) -> Option<u32> {
        let limit = self.params().max_memory;
        // Not quite a cube root: the lattice is a whole number of coarse voxels.
        let estimate = f64::from(resolution) * (limit / self.megabytes(resolution).0).cbrt();
        let mut fits = (estimate.ceil() as u32).min(resolution - 1);
        while fits > 0 && self.megabytes(fits).0 > limit {
            fits -= 1;
        }
        let tried = if self.visits(fits.max(1)) > MAX_VISITS { SOUNDING } else { fits };
        if fits == 0 || tried > fits {
            return None;
        }
        let tally = self.descend(tried, Wanted::Places).ok()?.tally;
        let surely = tally.deepest >= SURELY * self.grid(fits).side;
        (surely || (tried == fits && tally.start > 0)).then_some(fits)
    }

    /// Memory for the voxels of a resolution, in megabytes, and their number. That of the medial mesh is
    /// known when its voxels are (file `output_size.rs`).
    pub(super) fn megabytes(&self, resolution: u32) -> (f64, f64) {
        let grid = self.grid(resolution);
        let voxels = self.volume / grid.side.powi(3);
        let bricks: f64 = grid.size.iter().map(|&n| f64::from(n) / 8.0).product();
        ((voxels * BYTES_PER_VOXEL + bricks * 4.0) / 1e6, voxels)
    }

    /// About how many voxels a lattice of a resolution visits: those inside, and a layer along the
    /// surface.
    pub(super) fn visits(&self, resolution: u32) -> f64 {
        let side = self.grid(resolution).side;
        self.volume / side.powi(3) + 2.0 * self.area / (side * side)
    }

    /// The error for a lattice without voxels. It names a resolution that was tried and has some,
    /// where there is one.
    pub(super) fn nothing_fits(&self, resolution: u32, deepest: f64) -> SimplifyError {
        match self.advice(resolution, deepest) {
            Ok(advice) => SimplifyError::Parameter(format!(
                "resolution = {resolution}: the solid is thinner than a voxel everywhere, no sphere \
                 of a voxel's side lies inside; {advice}"
            )),
            Err(error) => error,
        }
    }

    fn advice(&self, resolution: u32, mut deepest: f64) -> Result<String, SimplifyError> {
        let longest = self.grid(resolution).side * f64::from(resolution);
        // No ball inside is wider than the box around the solid.
        let extent =
            self.shape.mesh().bounding_box().map_or(0.0, |(lo, hi)| (hi - lo).min_element());
        let needed = (2.0 * longest / extent).ceil();
        if needed > f64::from(MAX_RESOLUTION) {
            return Ok(format!(
                "it would take {needed:.3e} voxels along the longest side, above the most of \
                 {MAX_RESOLUTION}: this solid is too thin for a lattice"
            ));
        }
        let mut tried = resolution;
        loop {
            // No voxel can be there while its side is above the largest distance.
            let least = if deepest > 0.0 { 1.1 * longest / deepest } else { 0.0 };
            let next = least.max(needed).max(1.5 * f64::from(tried));
            let next = next.min(3.0 * f64::from(tried)).ceil();
            let none = format!("none up to resolution = {tried} does");
            if next > f64::from(MAX_RESOLUTION) {
                return Ok(format!("{none}, and {MAX_RESOLUTION} is the most"));
            }
            let next = next as u32;
            if self.megabytes(next).0 > self.params().max_memory {
                return Ok(format!("{none}, beyond which max_memory ends; raise it"));
            }
            if self.visits(next) > MAX_VISITS {
                return Ok(format!("{none}, and finer lattices take too long to be tried here"));
            }
            let start = self.descend(next, Wanted::Places)?.tally;
            if start.start > 0 {
                return Ok(format!("resolution = {next} does"));
            }
            (tried, deepest) = (next, deepest.max(start.deepest));
        }
    }
}
