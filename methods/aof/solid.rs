//! One solid on any lattice: the lattice to work at, the loss on it, the axis at an angle or with a
//! number of voxels.

use std::cmp::Reverse;

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, Sphere as Ball};
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, RunContext, SimplifyError};
use rayon::prelude::*;

use super::flux::{Sphere, Spiral, Surface};
use super::lattice::{Descent, Grid, LatticeVoxels, Voxel, Wanted, betti, coarse_to_fine};
use super::output::{medial_mesh, megabytes};
use super::thinning::{FACES, Until, thin};
use super::{LatticeSetting, MAX_RESOLUTION, PUBLISHED_RESOLUTION, Resolution, Rules, SAMPLES};
use crate::Result;
use crate::levels::within;

/// A solid, ready for any lattice.
pub struct Solid<'s> {
    shape: &'s Shape,
    surface: Surface,
    pub(super) setting: LatticeSetting,
    run: RunContext,
    /// Volume of the solid, normalised.
    volume: f64,
    /// Area of the surface, normalised.
    area: f64,
}

impl<'s> Solid<'s> {
    /// The solid of a shape.
    ///
    /// # Errors
    /// When its surface has no face.
    pub fn new(shape: &'s Shape, setting: LatticeSetting, run: RunContext) -> Result<Self> {
        let surface = Surface::of(shape)?;
        let mesh = shape.mesh();
        let (mut volume, mut area) = (0.0, 0.0);
        for face in 0..mesh.faces.len() {
            let [a, b, c] = mesh.triangle(face);
            volume += a.dot(b.cross(c)) / 6.0;
            area += (b - a).cross(c - a).length() / 2.0;
        }
        Ok(Self { shape, surface, setting, run, volume, area })
    }

    /// The lattice of a resolution.
    pub fn grid(&self, resolution: u32) -> Grid {
        Grid::new(self.shape.mesh(), resolution)
    }

    /// Flux and distances at a resolution.
    ///
    /// # Errors
    /// When the lattice is too fine, or its voxels would not fit into memory; when the run was
    /// cancelled.
    pub fn descend(&self, resolution: u32, wanted: Wanted) -> Result<Descent> {
        self.check_resolution(resolution)?;
        coarse_to_fine(&self.surface, self.grid(resolution), &self.setting, wanted, &self.run)
    }

    fn wanted(&self) -> Wanted {
        match self.setting.rules {
            Rules::Published => Wanted::AtMost(self.setting.rules.threshold(self.setting.angle)),
            Rules::Own => Wanted::All,
        }
    }

    /// The axis of a lattice for an object angle in degrees.
    ///
    /// # Errors
    /// When the run was cancelled.
    pub fn axis(&self, start: &Descent, angle: f64) -> Result<LatticeVoxels> {
        let threshold = self.setting.rules.threshold(angle);
        if self.setting.rules == Rules::Published {
            let mut axis = LatticeVoxels::sorted(start.grid, &start.voxels);
            axis.voxels.retain(|voxel| voxel.flux <= threshold);
            return Ok(axis);
        }
        let mut voxels = start.voxels.clone();
        thin(&mut voxels, Until::EndPoints(threshold), &self.run)?;
        Ok(LatticeVoxels::sorted(start.grid, &voxels))
    }

    /// The medial mesh of an axis, with centres on the axis or in the voxels.
    ///
    /// # Errors
    /// When the run was cancelled.
    pub fn medial_mesh(&self, axis: &LatticeVoxels) -> Result<MedialMesh> {
        let centres = axis.points();
        let balls = if self.setting.rules == Rules::Own {
            let sphere = Sphere::new(Spiral::EqualArea, SAMPLES[2], axis.grid.side);
            let refined = self.surface.refine(&sphere, &centres, &self.run)?;
            refined.into_iter().map(|refined| refined.ball).collect()
        } else {
            centres
                .par_iter()
                .map(|&centre| Ball::new(centre, self.surface.closest(centre, None).distance))
                .collect()
        };
        medial_mesh(&axis.voxels, balls, &self.run)
    }
}

// The lattice to work at: that of the parameters, or with our rules a finer one if that loses parts of the
// solid.
//
// Thinning keeps the topology of its start set, which therefore needs the solid's topology and no
// missing limbs. Lattices finer by half are tried until one has both; else the best is taken:
// the least difference of Betti numbers, then the least loss (below), then the finest. A
// warning names the difference or the loss.

/// Limit of the refinements of the lattice, by half each.
const REFINEMENTS: u32 = 3;

/// The lattice to work at.
pub struct Base {
    /// Voxels along the longest side.
    pub resolution: u32,
    /// Its flux.
    pub descent: Descent,
    /// Betti numbers of its voxels; zeros with the published rules, which do not keep them.
    pub topology: [u64; 3],
    /// The part of the surface that it loses.
    pub loss: Option<Loss>,
    /// Counts and warnings about it.
    pub diagnostics: Diagnostics,
}

/// A start set that was tried.
struct TriedStart {
    resolution: u32,
    /// Betti numbers; zeros with the published rules, which do not keep them.
    betti: [u64; 3],
    voxels: u64,
    loss: Option<Loss>,
}

impl TriedStart {
    fn difference(&self, expected: Option<[u64; 3]>) -> u64 {
        let expected = expected.unwrap_or(self.betti);
        self.betti.iter().zip(expected).map(|(&b, e)| b.abs_diff(e)).sum()
    }
}

impl Base {
    /// Memory for the voxels of this base and for the medial mesh of an axis, in megabytes.
    pub(super) fn megabytes_with_output(&self, axis: &LatticeVoxels) -> f64 {
        megabytes(axis, self.descent.tally.start as f64 * BYTES_PER_VOXEL)
    }
}

impl Solid<'_> {
    /// The lattice to work at.
    ///
    /// # Errors
    /// When no voxel fits into the solid; as [`Solid::descend`].
    pub fn base(&self) -> Result<Base> {
        let mut diagnostics = Diagnostics::default();
        let requested = self.setting.resolution;
        let mut descent = self.descend(requested, self.wanted())?;
        let mut start = self.tried(requested, &descent);
        if self.setting.rules == Rules::Own {
            start = self.faithful(start, &mut diagnostics)?;
        }
        if start.resolution != requested {
            descent = self.descend(start.resolution, self.wanted())?;
        }
        let TriedStart { resolution, betti, loss, .. } = start;
        let tally = &descent.tally;
        if tally.start == 0 {
            let refined = if resolution == requested {
                String::new()
            } else {
                format!(" (and {resolution})")
            };
            return Err(SimplifyError::Parameter(format!(
                "resolution = {requested}{refined}: no voxel fits into the solid; raise resolution"
            )));
        }
        diagnostics.count("resolution", resolution as usize);
        diagnostics.count("start_voxels", tally.start as usize);
        for (level, &dismissed) in tally.dismissed.iter().enumerate() {
            diagnostics.count(&format!("dismissed_at_level_{}", level + 1), dismissed as usize);
        }
        diagnostics.count("spheres_evaluated", tally.evaluated as usize);
        Ok(Base { resolution, descent, topology: betti, loss, diagnostics })
    }

    fn tried(&self, resolution: u32, start: &Descent) -> TriedStart {
        let betti = match self.setting.rules {
            Rules::Published => [0; 3],
            Rules::Own => betti(start.voxels.iter()),
        };
        let loss = self.loss_of_start(start, self.accepted_loss());
        TriedStart { resolution, betti, voxels: start.tally.start, loss }
    }

    /// The largest loss that is accepted, a fraction of the diagonal.
    fn accepted_loss(&self) -> f64 {
        // That of the requested lattice on finer ones too: else each would fail by its own measure.
        LOST * self.grid(self.setting.resolution).side
    }

    /// The least resolution from the requested one whose start set has the topology of the solid and
    /// loses nothing, else the best that was tried.
    fn faithful(&self, first: TriedStart, diagnostics: &mut Diagnostics) -> Result<TriedStart> {
        let expected = self.shape.expected_betti();
        let requested = first.resolution;
        let mut all = vec![first];
        for refinement in 1..=REFINEMENTS {
            if all.last().is_some_and(|start| {
                start.voxels > 0 && start.loss.is_none() && start.difference(expected) == 0
            }) {
                break;
            }
            let resolution =
                (f64::from(requested) * 1.5_f64.powi(refinement as i32)).round() as u32;
            match self.descend(resolution, Wanted::Places) {
                Ok(start) => all.push(self.tried(resolution, &start)),
                // It does not fit into memory.
                Err(SimplifyError::Parameter(_)) => break,
                Err(other) => return Err(other),
            }
        }
        let best = all.into_iter().min_by_key(|start| {
            // Distances are not negative, so their bits are in the order of their values.
            let lost = start.loss.map_or(0.0, |loss| loss.distance).to_bits();
            (start.voxels == 0, start.difference(expected), lost, Reverse(start.resolution))
        });
        let best = best.expect("the first was tried");
        if best.resolution != requested {
            diagnostics.warn(format!(
                "resolution {} instead of {requested}: coarser voxels lose a part or the topology of \
                 the solid",
                best.resolution
            ));
        }
        if let Some(expected) = expected
            && best.voxels > 0
            && best.betti != expected
        {
            diagnostics.warn(format!(
                "resolution = {}: the voxels have the Betti numbers {:?} instead of the solid's \
                 {expected:?}; raise resolution",
                best.resolution, best.betti
            ));
        }
        Ok(best)
    }
}

// Losses.
//
// A part thinner than two voxels has no voxel whose sphere fits inside. If it is a limb, its loss does
// not change the Betti numbers. So points of the surface, its vertices and the middles of its faces,
// are measured against the spheres of the voxels. The point that is farthest from all of them is lost
// where it is farther than [`LOST`] voxels: along sharp edges spheres stay one to three voxels away
// without anything being lost.

/// Distance from all spheres above which a point of the surface is lost, in voxels.
const LOST: f64 = 3.0;
/// Limit of the measured points of the surface.
const MAX_POINTS: usize = 60_000;

/// A part of the surface that is far from every voxel's sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// The farthest point, normalised.
    pub place: Vec3,
    /// Its distance from the nearest sphere, a fraction of the diagonal.
    pub distance: f64,
}

impl Solid<'_> {
    /// The loss of a start set, if it is more than `accepted`, a fraction of the diagonal.
    fn loss_of_start(&self, start: &Descent, accepted: f64) -> Option<Loss> {
        // Spheres of voxels inside reach no farther than those at the border.
        let border: Vec<Voxel> = start
            .voxels
            .iter()
            .filter(|voxel| start.voxels.neighbourhood(voxel.place) & FACES != FACES)
            .collect();
        self.loss(&start.grid, &border, accepted)
    }

    /// The part of the surface that is farthest from the spheres of voxels, if that is more than
    /// `accepted`, a fraction of the diagonal.
    fn loss(&self, grid: &Grid, voxels: &[Voxel], accepted: f64) -> Option<Loss> {
        let balls: Vec<Ball> = voxels
            .iter()
            .map(|voxel| Ball::new(grid.centre(voxel.place), f64::from(voxel.distance)))
            .collect();
        // Without voxels everything is lost, which has a separate message.
        let union = MedialUnion::of_spheres(&balls).ok()?;
        let places = self.surface_points();
        let distances = union.signed_batch(&places);
        // Reversed, because `max_by` returns the last of equal elements.
        let farthest =
            (0..places.len()).rev().max_by(|&a, &b| distances[a].total_cmp(&distances[b]))?;
        let (place, distance) = (places[farthest], distances[farthest]);
        (distance > accepted).then_some(Loss { place, distance })
    }

    /// The vertices and the middles of faces, or a part of them. Degenerate faces count for nothing.
    fn surface_points(&self) -> Vec<Vec3> {
        let mesh = self.shape.mesh();
        let mut seen = vec![false; mesh.vertices.len()];
        let mut points = Vec::with_capacity(mesh.faces.len() + seen.len());
        for face in &mesh.faces {
            let [a, b, c] = face.map(|v| mesh.vertices[v as usize]);
            if (b - a).cross(c - a).normalize_or_zero() == Vec3::ZERO {
                continue;
            }
            points.push((a + b + c) / 3.0);
            for &v in face {
                if !std::mem::replace(&mut seen[v as usize], true) {
                    points.push(mesh.vertices[v as usize]);
                }
            }
        }
        let step = points.len().div_ceil(MAX_POINTS).max(1);
        points.into_iter().step_by(step).collect()
    }

    /// Warns about a loss, with the place in the units of the surface.
    pub(super) fn warn_of(
        &self,
        loss: Option<Loss>,
        resolution: u32,
        diagnostics: &mut Diagnostics,
    ) {
        let Some(Loss { place, distance }) = loss else { return };
        let Vec3 { x, y, z } = self.shape.normalisation().backward(place);
        diagnostics.warn(format!(
            "resolution = {resolution}: the surface at ({x:.6}, {y:.6}, {z:.6}) is {:.1} % of the \
             diagonal away from every sphere; raise resolution or the number of spheres",
            100.0 * distance
        ));
    }
}

// Memory, and the effort of a lattice.

/// Bytes for each voxel of the start set: values in bricks that are not full, twice while one is
/// thinned, lists of blocks, the heap.
const BYTES_PER_VOXEL: f64 = 64.0;
/// Limit of the voxels that a lattice for a count may visit.
const MAX_VISITS: f64 = 2e7;

impl Solid<'_> {
    /// Refuses lattices that have too many voxels along a side or do not fit into memory.
    fn check_resolution(&self, resolution: u32) -> Result<()> {
        within("resolution", resolution, 1..=MAX_RESOLUTION)?;
        self.check_memory(resolution, self.megabytes(resolution))
    }

    /// Refuses a lattice that needs more megabytes than the limit.
    pub(super) fn check_memory(&self, resolution: u32, megabytes: f64) -> Result<()> {
        let limit = self.setting.max_megabytes;
        if megabytes <= limit {
            return Ok(());
        }
        Err(SimplifyError::Parameter(format!(
            "resolution = {resolution}: about {:.0} MB, above the limit of {limit} MB; lower resolution",
            megabytes.ceil()
        )))
    }

    /// Memory for the voxels of a resolution, in megabytes. That of the medial mesh is known when its
    /// voxels are (`output.rs`).
    fn megabytes(&self, resolution: u32) -> f64 {
        let grid = self.grid(resolution);
        let voxels = self.volume / grid.side.powi(3);
        let bricks: f64 = grid.size.iter().map(|&n| f64::from(n) / 8.0).product();
        (voxels * BYTES_PER_VOXEL + bricks * 4.0) / 1e6
    }

    /// The largest resolution up to the one of the parameters whose voxels fit into memory; 1 if
    /// none does.
    fn fitting_resolution(&self) -> u32 {
        let (resolution, limit) = (self.setting.resolution, self.setting.max_megabytes);
        // Not quite a cube root: the lattice is a whole number of coarse voxels.
        let estimate = f64::from(resolution) * (limit / self.megabytes(resolution)).cbrt();
        let mut fits = (estimate.ceil() as u32).clamp(1, resolution);
        while fits > 1 && self.megabytes(fits) > limit {
            fits -= 1;
        }
        fits
    }
}

// The published level: the paper's lattice, or the finest that fits.
//
// A resolution set by the user is not changed. Otherwise it is lowered until the voxels and the medial
// mesh fit into memory. A solid without a coarse voxel starts with fine ones.

/// Limit of the times that the resolution is lowered for the medial mesh.
const MAX_LOWERINGS: usize = 4;
/// Memory that a lower resolution aims at, as a share of the limit.
const AIMED_MEMORY: f64 = 0.95;

/// The solid at the published level.
///
/// # Errors
/// As [`Solid::base`].
pub(super) fn published<'s>(
    shape: &'s Shape,
    resolution: Resolution,
    run: &RunContext,
) -> Result<(Solid<'s>, Base)> {
    let setting = LatticeSetting::published(resolution.or(PUBLISHED_RESOLUTION));
    let mut solid = Solid::new(shape, setting, run.clone())?;
    let base = solid.published(resolution == Resolution::Auto)?;
    Ok((solid, base))
}

impl Solid<'_> {
    /// The lattice of the published level. Its resolution may be lowered if it `is_free`.
    pub(super) fn published(&mut self, is_free: bool) -> Result<Base> {
        let published = self.setting.resolution;
        if is_free {
            self.setting.resolution = self.fitting_resolution();
        }
        let has_coarse = self.descend(self.setting.resolution, Wanted::Places)?.tally.start > 0;
        self.setting.starts_coarse = has_coarse;
        let mut base = self.base()?;
        for _ in 0..if is_free { MAX_LOWERINGS } else { 0 } {
            let axis = self.axis(&base.descent, self.setting.angle)?;
            let share = base.megabytes_with_output(&axis) / self.setting.max_megabytes;
            if share <= 1.0 {
                break;
            }
            // Voxels of sheets grow with the square of the resolution.
            let resolution = self.setting.resolution;
            let lower = f64::from(resolution) * (AIMED_MEMORY / share).sqrt();
            self.setting.resolution = (lower as u32).clamp(1, (resolution - 1).max(1));
            base = self.base()?;
        }
        if self.setting.resolution != published {
            base.diagnostics.warn(format!(
                "resolution {} instead of the published {published}: more does not fit into {} MB",
                self.setting.resolution, self.setting.max_megabytes
            ));
        }
        if !has_coarse {
            base.diagnostics
                .warn("started with fine voxels: the solid is too thin for a coarse one");
        }
        Ok(base)
    }
}

// The axis with a number of voxels: a lattice as coarse as the count allows, then deletion.
//
// 1. The axis of the base has too many voxels, or too few. Of these, those on sheets grow in number
//    with the square of the resolution, those on curves with the resolution itself. This gives the
//    resolution that should have the count; every lattice that is tried corrects the estimate.
// 2. Too few: finer lattices are tried, each at most twice as fine as the one before, until one has
//    the count, memory or effort ends, or finer lattices bring no more voxels.
// 3. Too many: the search ends with a lattice that has the topology of the base, loses no more of the
//    surface, and has a few more voxels than requested. Where either is lost, the next one lies half way
//    to the coarsest lattice that has both.
// 4. The rest is deleted, simple voxels of the largest flux first.
//
// No lattice is tried twice.

/// Size of a lattice up to which none coarser is tried, in requested counts.
const ENOUGH: f64 = 1.15;
/// Limit of the loss of a lattice, in losses of the base.
const WORSE: f64 = 1.2;
/// Size that the estimate aims at, in requested counts.
const AIM: f64 = 1.06;
/// Limit of the lattices that are tried for a count.
const MAX_TRIES: usize = 8;
/// Number of neighbours, itself included, up to which a voxel of a thinned axis is on a curve.
const ON_A_SHEET: u32 = 4;

impl Solid<'_> {
    /// The axis of a lattice about as coarse as `count` voxels allow, with the topology of the base,
    /// reduced to the count.
    ///
    /// # Errors
    /// When the run was cancelled.
    pub(super) fn with_count(
        &self,
        base: &Base,
        count: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<LatticeVoxels> {
        let first = self.axis(&base.descent, self.setting.angle)?;
        let mut search = Search {
            growth: Growth::of(&first, base.resolution),
            best: first,
            high: base.resolution,
            low: 1,
            tried: 0,
        };
        if search.best.voxels.len() < count {
            self.climb(base, count, &mut search)?;
        }
        if search.best.voxels.len() > count {
            self.descend_to(base, count, &mut search)?;
        }
        let Search { best: mut axis, high: lattice, tried, .. } = search;
        let found = axis.voxels.len();
        let loss = if found <= count && lattice == base.resolution {
            base.loss
        } else {
            if found > count {
                let mut voxels = axis.bricks();
                thin(&mut voxels, Until::Count(count), &self.run)?;
                axis = LatticeVoxels::sorted(axis.grid, &voxels);
                diagnostics.count("deleted_to_the_count", found - axis.voxels.len());
            }
            self.loss(&axis.grid, &axis.voxels, LOST * axis.grid.side)
        };
        self.warn_of(loss, lattice, diagnostics);
        let left = axis.voxels.len();
        if left != count {
            let why = match left < count {
                true => "the axis has no more voxels",
                false => "fewer would change the topology",
            };
            diagnostics
                .warn(format!("{left} spheres instead of {count}: at resolution {lattice} {why}"));
        }
        diagnostics.count("lattice", lattice as usize);
        diagnostics.count("lattices_tried", tried);
        Ok(axis)
    }

    /// Step 2.
    fn climb(&self, base: &Base, count: usize, search: &mut Search) -> Result<()> {
        let mut at = search.high;
        while search.tried < MAX_TRIES && search.best.voxels.len() < count {
            let ideal = search.growth.resolution_of(AIM * count as f64);
            // At least a sixteenth finer, so that few tries suffice; at most twice, since estimates
            // from a coarse lattice are poor.
            let next = ideal.clamp(at + 1 + at / 16, 2 * at + 1);
            // A descent visits the voxels inside, and a layer along the surface.
            let side = self.grid(next).side;
            let visits = self.volume / side.powi(3) + 2.0 * self.area / (side * side);
            if self.check_resolution(next).is_err() || visits > MAX_VISITS {
                break;
            }
            search.tried += 1;
            let lattice = self.faithful_axis(next, base)?;
            let found = lattice.as_ref().map_or(0, |axis| axis.voxels.len());
            if let Some(lattice) = lattice
                && found > search.best.voxels.len()
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
    fn descend_to(&self, base: &Base, count: usize, search: &mut Search) -> Result<()> {
        let mut is_lost = false;
        while search.tried < MAX_TRIES && search.best.voxels.len() as f64 > ENOUGH * count as f64 {
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
            let found = lattice.as_ref().map_or(0, |axis| axis.voxels.len());
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
    fn faithful_axis(&self, resolution: u32, base: &Base) -> Result<Option<LatticeVoxels>> {
        let start = self.descend(resolution, self.wanted())?;
        let betti = betti(start.voxels.iter());
        // Another topology than the base's is accepted if it is the solid's: the base may lack it.
        if betti != base.topology && Some(betti) != self.shape.expected_betti() {
            return Ok(None);
        }
        let base_loss = base.loss.map_or(0.0, |loss| loss.distance);
        if self.loss_of_start(&start, WORSE * base_loss.max(self.accepted_loss())).is_some() {
            return Ok(None);
        }
        self.axis(&start, self.setting.angle).map(Some)
    }
}

/// Lattices on both sides of a count.
struct Search {
    growth: Growth,
    /// The coarsest with the count, or the finest that was tried.
    best: LatticeVoxels,
    /// Its resolution.
    high: u32,
    /// A coarser resolution that has too few voxels, or not the topology.
    low: u32,
    tried: usize,
}

/// Number of voxels by resolution `R`: `sheets R^2 + curves R`.
struct Growth {
    sheets: f64,
    curves: f64,
}

impl Growth {
    fn of(axis: &LatticeVoxels, resolution: u32) -> Self {
        let voxels = axis.bricks();
        let sheets = axis
            .voxels
            .iter()
            .filter(|v| voxels.neighbourhood(v.place).count_ones() > ON_A_SHEET)
            .count();
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

    #[test]
    fn lattices_beyond_memory_are_lowered_where_free_and_refused_elsewhere() {
        let shape = crate::test_shape("box", 8);
        let solid = |resolution, max_megabytes| {
            let setting = LatticeSetting { max_megabytes, ..LatticeSetting::published(resolution) };
            Solid::new(&shape, setting, RunContext::default()).expect("faces")
        };
        let lowered = solid(200, 20.0).published(true).expect("a lattice").diagnostics.warnings;
        assert!(lowered.iter().any(|w| w.contains("instead of the published 200")), "{lowered:?}");
        for mut refused in [solid(369, 60.0), solid(10, 1e-9)] {
            match refused.published(false).err() {
                Some(SimplifyError::Parameter(why)) => {
                    assert!(why.contains("above the limit"), "{why}");
                }
                other => panic!("{other:?}"),
            }
        }
        // The voxels fit, their medial mesh does not.
        let setting = LatticeSetting { max_megabytes: 4.0, ..LatticeSetting::own(60) };
        let solid = Solid::new(&shape, setting, RunContext::default()).expect("faces");
        let base = solid.base().expect("fits");
        let axis = solid.axis(&base.descent, 20.0).expect("not cancelled");
        let needed = base.megabytes_with_output(&axis);
        assert!(needed > 4.0 && solid.check_memory(60, needed).is_err());
    }
}
