//! COARSETOFINE (Algorithm 1): voxels are dismissed where no sheet crosses their sphere, and split
//! elsewhere.
//!
//! 1. The bounding box is halved down to blocks of coarse voxels; blocks outside are left out.
//! 2. Each voxel gets the candidate triangles for its own sphere and those of its descendants from the
//!    candidates of its parent. They give its distance `D` to the surface. A voxel has the side of its
//!    parent, without a test, if the parent's distance exceeds that of its farthest descendant.
//! 3. Above the finest level: where the sphere of radius `sigma` lies inside (`D >= sigma`), `AOF'`
//!    is evaluated, and the voxel with all its descendants dismissed if `AOF' >= 0`, by default up
//!    to the flux of the samples themselves in a constant field.
//! 4. At the finest level: `AOF'` of every voxel whose sphere lies inside. The final threshold is
//!    applied later, as it depends on the level that is asked.
//!
//! Blocks are independent; they run in parallel and are collected in order.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::nearby::{NearSet, NearbyTriangles};
use medial::Vec3;
use medial::shape::Shape;
use medial::simplifier::{RunContext, SimplifyError};
use medial::surface::{InsideTest, Side};
use rayon::prelude::*;

use super::bricks::{Bricks, Voxel};
use super::flux::{Probe, Sphere};
use super::grid::Grid;
use super::params::{AofParams, Dismiss, Start};

/// Coarse voxels along a side of a block, at most.
const BLOCK: u32 = 4;
/// Blocks along the longest side of a small lattice, so that there is work for several threads.
const BLOCKS: u32 = 4;
/// Half the diagonal of a unit cube.
const HALF_DIAGONAL: f64 = 0.866_025_403_784_438_6;

/// The surface, as the flux sees it.
pub struct Surface {
    /// Closest points.
    pub triangles: NearbyTriangles,
    /// The inside test.
    pub inside: Arc<InsideTest>,
}

impl Surface {
    /// That of a shape.
    pub fn of(shape: &Shape) -> Self {
        Self { triangles: NearbyTriangles::new(shape.mesh()), inside: shape.inside_test() }
    }
}

/// The values of the voxels that are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// Places alone.
    Places,
    /// Values of all voxels that are not dismissed.
    Kept,
    /// Values of all voxels to begin with: distances of dismissed ones too.
    All,
}

/// Numbers of voxels, in voxels of the finest level.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Voxels to begin with.
    pub start: u64,
    /// Dismissed at each level above the finest.
    pub dismissed: Vec<u64>,
    /// Spheres evaluated at each level.
    pub evaluated: Vec<u64>,
    /// Largest distance of a finest voxel's centre that was met inside; 0 for none.
    pub deepest: f64,
}

/// The outcome of a descent.
pub struct Descent {
    /// The voxels.
    pub voxels: Bricks,
    /// Counts of what happened to them.
    pub tally: Tally,
}

/// Runs the algorithm.
///
/// # Errors
/// When the run was cancelled.
pub fn coarse_to_fine(
    surface: &Surface,
    grid: &Grid,
    params: &AofParams,
    wanted: Wanted,
    run: &RunContext,
) -> Result<Descent, SimplifyError> {
    let levels = Levels::new(grid, params)?;
    let blocks = blocks(surface, grid, &levels);
    let done = AtomicUsize::new(0);
    let descend = |block: &Block| {
        run.step(done.fetch_add(1, Ordering::Relaxed), blocks.len())?;
        let mut walk = Walk::new(surface, grid, &levels, wanted);
        walk.block(block);
        Ok((walk.voxels, walk.tally))
    };
    let parts: Result<Vec<_>, SimplifyError> = blocks.par_iter().map(descend).collect();
    run.step(blocks.len(), blocks.len())?;
    let mut descent = Descent { voxels: Bricks::new(grid.size), tally: levels.tally() };
    // In the order of the blocks: brick numbers, and with them every later order, are deterministic.
    for (voxels, tally) in parts? {
        voxels.into_iter().for_each(|voxel| descent.voxels.insert(voxel));
        descent.tally.add(&tally);
    }
    Ok(descent)
}

/// Sizes that depend on the level alone, from coarse to fine.
struct Levels {
    spheres: Vec<Sphere>,
    /// Finest voxels along a side.
    sizes: Vec<u32>,
    /// Radius around the centre that holds the spheres of a voxel and of its descendants.
    reaches: Vec<f64>,
    /// Flux from which on a voxel of the level is dismissed.
    dismissed_from: Vec<f64>,
    d: u32,
    start: Start,
}

impl Levels {
    fn new(grid: &Grid, params: &AofParams) -> Result<Self, SimplifyError> {
        let counts = params.sample_counts()?;
        let sizes: Vec<u32> =
            (0..params.levels).map(|level| params.d.pow(params.levels - 1 - level)).collect();
        let radius = |size: u32| grid.side * f64::from(size);
        let mut reaches: Vec<f64> = sizes.iter().map(|&size| radius(size)).collect();
        // From fine to coarse: a reach covers the shift to a child's centre plus the child's reach.
        for level in (0..reaches.len() - 1).rev() {
            let moved = HALF_DIAGONAL * (radius(sizes[level]) - radius(sizes[level + 1]));
            reaches[level] = reaches[level].max(moved + reaches[level + 1]);
        }
        let spheres = sizes.iter().zip(counts);
        let spheres: Vec<Sphere> =
            spheres.map(|(&size, n)| Sphere::new(params.spiral, n, radius(size))).collect();
        let from = |sphere: &Sphere| match params.dismiss {
            Dismiss::Zero => 0.0,
            Dismiss::Bias => -sphere.bias,
        };
        let dismissed_from = spheres.iter().map(from).collect();
        Ok(Self { spheres, sizes, reaches, dismissed_from, d: params.d, start: params.start })
    }

    fn tally(&self) -> Tally {
        let levels = self.sizes.len();
        Tally { dismissed: vec![0; levels - 1], evaluated: vec![0; levels], ..Tally::default() }
    }
}

impl Tally {
    fn add(&mut self, other: &Self) {
        self.start += other.start;
        self.deepest = self.deepest.max(other.deepest);
        let pairs =
            [(&mut self.dismissed, &other.dismissed), (&mut self.evaluated, &other.evaluated)];
        for (mine, theirs) in pairs {
            mine.iter_mut().zip(theirs).for_each(|(a, b)| *a += b);
        }
    }
}

/// A box of coarse voxels, with the triangles near it.
struct Block {
    lo: [u32; 3],
    hi: [u32; 3],
    set: NearSet,
}

/// Step 1.
fn blocks(surface: &Surface, grid: &Grid, levels: &Levels) -> Vec<Block> {
    let whole = Block {
        lo: [0; 3],
        hi: grid.coarse_size(),
        set: surface
            .triangles
            .all(grid.origin + Vec3::from(grid.size.map(f64::from)) * 0.5 * grid.side),
    };
    let longest = whole.hi.into_iter().max().unwrap_or(0);
    let most = (longest / BLOCKS).clamp(1, BLOCK);
    let (mut open, mut done) = (vec![whole], Vec::new());
    while let Some(block) = open.pop() {
        let extent = [0, 1, 2].map(|axis| block.hi[axis] - block.lo[axis]);
        let longest = (0..3).max_by_key(|&axis| (extent[axis], 2 - axis)).unwrap_or(0);
        if extent[longest] <= most {
            done.push(block);
            continue;
        }
        let middle = block.lo[longest] + extent[longest] / 2;
        let (mut low, mut high) = (block.hi, block.lo);
        low[longest] = middle;
        high[longest] = middle;
        for (lo, hi) in [(block.lo, low), (high, block.hi)] {
            let split = f64::from(grid.split);
            let corner =
                |c: [u32; 3]| grid.origin + Vec3::from(c.map(f64::from)) * split * grid.side;
            let centre = (corner(lo) + corner(hi)) * 0.5;
            let half = (corner(hi) - corner(lo)).length() * 0.5;
            let mut set = NearSet::default();
            surface.triangles.narrow(&block.set, centre, half + levels.reaches[0], &mut set);
            // A block farther from the surface than its own corners is on one side as a whole.
            if set.distance() <= half || surface.inside.side(centre) == Side::Inside {
                open.push(Block { lo, hi, set });
            }
        }
    }
    done.sort_by_key(|block| [block.lo[2], block.lo[1], block.lo[0]]);
    done
}

/// The walk through one block.
struct Walk<'a> {
    surface: &'a Surface,
    grid: &'a Grid,
    levels: &'a Levels,
    wanted: Wanted,
    probes: Vec<Probe<'a>>,
    /// For the block, then for the current voxel of each level.
    sets: Vec<NearSet>,
    voxels: Vec<Voxel>,
    tally: Tally,
}

/// The facts about a voxel that follow from its ancestors.
#[derive(Clone, Copy)]
struct Known {
    /// Whether it and its descendants are inside, if that is the same for all.
    inside: Option<bool>,
    dismissed: bool,
}

impl<'a> Walk<'a> {
    fn new(surface: &'a Surface, grid: &'a Grid, levels: &'a Levels, wanted: Wanted) -> Self {
        Self {
            surface,
            grid,
            levels,
            wanted,
            probes: levels.spheres.iter().map(Probe::new).collect(),
            sets: vec![NearSet::default(); levels.sizes.len() + 1],
            voxels: Vec::new(),
            tally: levels.tally(),
        }
    }

    fn block(&mut self, block: &Block) {
        self.sets[0].clone_from(&block.set);
        for z in block.lo[2]..block.hi[2] {
            for y in block.lo[1]..block.hi[1] {
                for x in block.lo[0]..block.hi[0] {
                    let base = [x, y, z].map(|i| i * self.grid.split);
                    self.visit(0, base, Known { inside: None, dismissed: false });
                }
            }
        }
    }

    /// Steps 2 to 4 for the voxel of a level whose lowest finest voxel is at `base`.
    fn visit(&mut self, level: usize, base: [u32; 3], mut known: Known) {
        let size = self.levels.sizes[level];
        let sigma = self.levels.spheres[level].radius;
        let middle = Vec3::from(base.map(|i| f64::from(i) + f64::from(size) * 0.5));
        let centre = self.grid.origin + middle * self.grid.side;
        let (outer, inner) = self.sets.split_at_mut(level + 1);
        let triangles = &self.surface.triangles;
        triangles.narrow(&outer[level], centre, self.levels.reaches[level], &mut inner[0]);
        let distance = inner[0].distance();
        // Farthest centre of a descendant.
        let spread = HALF_DIAGONAL * (sigma - self.grid.side);
        let finest = level + 1 == self.levels.sizes.len();
        // The sphere does not fit. Only the depth of the solid, for messages, may need the side.
        if finest && distance < sigma {
            if distance > self.tally.deepest && self.is_inside(known, centre) {
                self.tally.deepest = distance;
            }
            return;
        }
        // Farther from the surface than any descendant's centre is away: all have this side.
        if distance > spread {
            if !self.is_inside(known, centre) {
                return;
            }
            known.inside = Some(true);
        }
        if level == 0 && self.levels.start == Start::Coarse && distance < sigma {
            self.tally.deepest = self.tally.deepest.max(distance);
            return;
        }
        let evaluate = !known.dismissed && self.wanted != Wanted::Places && distance >= sigma;
        let flux = if evaluate { self.flux(level) } else { 0.0 };
        if finest {
            self.emit(base, distance, flux);
            return;
        }
        if evaluate && flux >= self.levels.dismissed_from[level] {
            self.tally.dismissed[level] += u64::from(size).pow(3);
            known.dismissed = true;
            if self.wanted == Wanted::Kept {
                self.tally.start += u64::from(size).pow(3);
                return;
            }
        }
        // The spheres of all descendants fit, and no values are needed: skip the recursion.
        if self.wanted == Wanted::Places && distance >= spread + self.grid.side {
            self.emit_all(base, size, distance);
            return;
        }
        let step = self.levels.sizes[level + 1];
        for k in 0..self.levels.d.pow(3) {
            let d = self.levels.d;
            let at = [k % d, k / d % d, k / d / d];
            let child = [0, 1, 2].map(|axis| base[axis] + at[axis] * step);
            self.visit(level + 1, child, known);
        }
    }

    fn flux(&mut self, level: usize) -> f64 {
        self.tally.evaluated[level] += 1;
        self.probes[level].flux(&self.surface.triangles, &self.sets[level + 1])
    }

    fn is_inside(&self, known: Known, centre: Vec3) -> bool {
        known.inside.unwrap_or_else(|| self.surface.inside.side(centre) == Side::Inside)
    }

    fn emit(&mut self, place: [u32; 3], distance: f64, flux: f64) {
        self.tally.start += 1;
        self.tally.deepest = self.tally.deepest.max(distance);
        let place = place.map(|i| i as u16);
        self.voxels.push(Voxel { place, distance: distance as f32, flux: flux as f32 });
    }

    fn emit_all(&mut self, base: [u32; 3], size: u32, distance: f64) {
        for k in 0..size.pow(3) {
            let at = [k % size, k / size % size, k / size / size];
            self.emit([0, 1, 2].map(|axis| base[axis] + at[axis]), distance, 0.0);
        }
    }
}
