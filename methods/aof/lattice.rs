//! The cubic lattice, its voxels in sparse bricks of 8 x 8 x 8, and the descent that finds them.
//!
//! Only bricks with voxels are allocated: 4.2 KB for each of them, and four bytes for each brick of the
//! bounding box.
//!
//! COARSETOFINE (Algorithm 1): voxels are dismissed where no sheet crosses their sphere, and split
//! elsewhere.
//!
//! 1. The bounding box is halved down to blocks of coarse voxels; blocks outside are left out.
//! 2. Each voxel gets its distance `D` to the surface. It has the side of its parent, without a test,
//!    if the parent's distance exceeds that of its farthest descendant.
//! 3. Above the finest level: where the sphere of radius `sigma` lies inside (`D >= sigma`), `AOF'`
//!    is evaluated, and the voxel with all its descendants dismissed if `AOF' >= 0`, with our rules down
//!    to minus the flux of the samples themselves in a constant field.
//! 4. At the finest level: `AOF'` of every voxel whose sphere lies inside. The final threshold is
//!    applied later, as it depends on the requested level. At the published level it is known: then
//!    a sphere is given up as soon as the samples left cannot bring its flux down to it.
//!
//! Blocks are independent; they run in parallel and are collected in order.

use std::sync::atomic::{AtomicUsize, Ordering};

use medial::Vec3;
use medial::complex::cubical_betti;
use medial::simplifier::RunContext;
use medial::surface::{Closest, Side, TriMesh};
use rayon::prelude::*;

use super::flux::{FEW, MANY, Near, SMALL, Sphere, Surface};
use super::{LatticeSetting, Rules, SAMPLES, SPLIT, SUBDIVISION};
use crate::Result;

/// A lattice whose voxels have `resolution` along the longest side of the bounding box; its lower
/// corner is that of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Lower corner.
    pub origin: Vec3,
    /// `sigma` at the finest level.
    pub side: f64,
    /// Voxels along each axis at the finest level, a multiple of the side of a coarse voxel.
    pub size: [u32; 3],
}

impl Grid {
    /// The lattice over a mesh.
    ///
    /// # Panics
    /// If the mesh has no vertices.
    pub fn new(mesh: &TriMesh, resolution: u32) -> Self {
        let (lo, hi) = mesh.bounding_box().expect("a shape has vertices");
        let extent = hi - lo;
        let side = extent.max_element() / f64::from(resolution);
        // Rounding must not add a voxel to a side that is a whole number of voxels.
        let size = extent.to_array().map(|length| {
            let voxels = (length / side * (1.0 - 1e-9)).ceil().max(1.0) as u32;
            voxels.next_multiple_of(SPLIT)
        });
        Self { origin: lo, side, size }
    }

    /// Lower corner of a coarse voxel.
    fn coarse_corner(&self, place: [u32; 3]) -> Vec3 {
        self.origin + Vec3::from(place.map(f64::from)) * f64::from(SPLIT) * self.side
    }

    /// Centre of a voxel of the finest level.
    pub fn centre(&self, place: Place) -> Vec3 {
        let [x, y, z] = place.map(|i| f64::from(i) + 0.5);
        self.origin + Vec3::new(x, y, z) * self.side
    }
}

/// The voxels of a lattice of the spheres of a result, one for each sphere in the same
/// order.
#[derive(Clone, Debug, PartialEq)]
pub struct LatticeVoxels {
    /// The lattice, normalised.
    pub grid: Grid,
    /// The voxels by `z`, then `y`, then `x`.
    pub voxels: Vec<Voxel>,
}

impl LatticeVoxels {
    /// All voxels of a set.
    pub(super) fn sorted(grid: Grid, voxels: &Bricks) -> Self {
        let mut voxels: Vec<Voxel> = voxels.iter().collect();
        voxels.sort_unstable_by_key(Voxel::key);
        Self { grid, voxels }
    }

    /// Centres of the voxels, normalised.
    pub fn points(&self) -> Vec<Vec3> {
        self.voxels.iter().map(|voxel| self.grid.centre(voxel.place)).collect()
    }

    /// Betti numbers of the union of the closed voxels.
    pub fn betti(&self) -> [u64; 3] {
        betti(self.voxels.iter().copied())
    }

    pub(super) fn bricks(&self) -> Bricks {
        let mut bricks = Bricks::new(self.grid.size);
        self.voxels.iter().for_each(|&voxel| bricks.insert(voxel));
        bricks
    }
}

/// Betti numbers of the union of closed voxels.
pub(super) fn betti(voxels: impl Iterator<Item = Voxel>) -> [u64; 3] {
    cubical_betti(&voxels.map(|voxel| voxel.place.map(u32::from)).collect::<Vec<_>>())
}

/// Voxels along a side of a brick.
const SIDE: u32 = 8;
/// Entry of a brick that is not allocated.
const ABSENT: u32 = u32::MAX;

/// Indices of a voxel along the three axes, from the lower corner of the bounding box.
pub type Place = [u16; 3];

/// A voxel and its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voxel {
    /// Indices along the axes.
    pub place: Place,
    /// Distance of its centre to the surface, a fraction of the diagonal.
    pub distance: f32,
    /// `AOF'`; 0 if the voxel was dismissed at a coarser level, infinite if larger than wanted.
    pub flux: f32,
}

impl Voxel {
    /// Its rank in a result: by `z`, then `y`, then `x`.
    pub(super) fn key(&self) -> [u16; 3] {
        let [x, y, z] = self.place;
        [z, y, x]
    }
}

/// A set of voxels with values.
#[derive(Clone, Debug)]
pub struct Bricks {
    there: Bits,
    values: Vec<Box<Values>>,
    /// Number of voxels.
    pub(super) len: usize,
}

/// Distance and flux of each voxel of a brick.
type Values = [[f32; 2]; (SIDE * SIDE * SIDE) as usize];

impl Bricks {
    /// An empty set for a lattice with these numbers of voxels along the axes.
    pub(super) fn new(size: [u32; 3]) -> Self {
        Self { there: Bits::new(size), values: Vec::new(), len: 0 }
    }

    /// Inserts a voxel that is not there yet.
    pub(super) fn insert(&mut self, voxel: Voxel) {
        let brick = self.there.brick_or_new(voxel.place);
        if brick == self.values.len() {
            self.values.push(Box::new([[0.0; 2]; (SIDE * SIDE * SIDE) as usize]));
        }
        self.there.set(voxel.place);
        let (layer, bit) = inside(voxel.place);
        self.values[brick][64 * layer + bit] = [voxel.distance, voxel.flux];
        self.len += 1;
    }

    /// Removes a voxel that is there.
    pub(super) fn remove(&mut self, place: Place) {
        self.there.clear(place);
        self.len -= 1;
    }

    pub(super) fn get(&self, place: Place) -> Option<Voxel> {
        let brick = self.there.brick(place)?;
        let (layer, bit) = inside(place);
        let [distance, flux] = self.values[brick][64 * layer + bit];
        let is_there = self.there.words[brick][layer] >> bit & 1 == 1;
        is_there.then_some(Voxel { place, distance, flux })
    }

    /// See [`Bits::neighbourhood`].
    #[inline]
    pub(super) fn neighbourhood(&self, place: Place) -> u32 {
        self.there.neighbourhood(place)
    }

    /// No bit, with room for one at each place of these bricks.
    pub(super) fn no_marks(&self) -> Bits {
        Bits { words: vec![[0; 8]; self.there.words.len()], ..self.there.clone() }
    }

    /// All voxels, brick by brick.
    pub fn iter(&self) -> impl Iterator<Item = Voxel> + '_ {
        (0..self.values.len()).flat_map(move |brick| {
            (0..8).flat_map(move |layer| {
                let mut bits = self.there.words[brick][layer];
                std::iter::from_fn(move || {
                    let bit = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
                    bits &= bits - 1;
                    let at = [bit as u16 % 8, bit as u16 / 8, layer as u16];
                    let place = [0, 1, 2].map(|k| self.there.at[brick][k] * SIDE as u16 + at[k]);
                    let [distance, flux] = self.values[brick][64 * layer + bit];
                    Some(Voxel { place, distance, flux })
                })
            })
        })
    }
}

/// A bit for each place; only bricks with a bit are allocated.
#[derive(Clone, Debug)]
pub(super) struct Bits {
    /// Bricks along each axis.
    size: [u32; 3],
    table: Vec<u32>,
    /// For each brick its place among the bricks.
    at: Vec<Place>,
    /// For each brick a byte for each row along x, a word for each layer.
    words: Vec<[u64; 8]>,
}

impl Bits {
    fn new(grid: [u32; 3]) -> Self {
        let size = grid.map(|n| n.div_ceil(SIDE));
        let table = vec![ABSENT; size.iter().map(|&n| n as usize).product()];
        Self { size, table, at: Vec::new(), words: Vec::new() }
    }

    #[inline]
    fn slot(&self, [x, y, z]: Place) -> usize {
        let [width, depth, _] = self.size.map(|n| n as usize);
        usize::from(x / 8) + width * (usize::from(y / 8) + depth * usize::from(z / 8))
    }

    #[inline]
    fn brick(&self, place: Place) -> Option<usize> {
        let brick = self.table[self.slot(place)];
        (brick != ABSENT).then_some(brick as usize)
    }

    fn brick_or_new(&mut self, place: Place) -> usize {
        let slot = self.slot(place);
        if self.table[slot] == ABSENT {
            self.table[slot] = self.words.len() as u32;
            self.words.push([0; 8]);
            self.at.push(place.map(|x| x / 8));
        }
        self.table[slot] as usize
    }

    /// Sets the bit of a place in an allocated brick.
    pub(super) fn set(&mut self, place: Place) {
        let (layer, bit) = inside(place);
        let brick = self.table[self.slot(place)] as usize;
        self.words[brick][layer] |= 1 << bit;
    }

    /// Clears the bit of a place in an allocated brick.
    pub(super) fn clear(&mut self, place: Place) {
        let (layer, bit) = inside(place);
        let brick = self.table[self.slot(place)] as usize;
        self.words[brick][layer] &= !(1 << bit);
    }

    /// The bits of the 27 places around and at a place, as bits `dx + 1 + 3 (dy + 1) + 9 (dz + 1)`.
    #[inline]
    pub(super) fn neighbourhood(&self, place: Place) -> u32 {
        // All neighbours in one brick: three words instead of nine rows. Most voxels are inside.
        if place.iter().all(|v| (1..7).contains(&(v % 8))) {
            let Some(brick) = self.brick(place) else {
                return 0;
            };
            let (layer, bit) = inside(place);
            return (0..3).fold(0, |bits, k| {
                let rows = self.words[brick][layer + k - 1] >> (bit - 9);
                let nine = (rows & 7) | (rows >> 8 & 7) << 3 | (rows >> 16 & 7) << 6;
                bits | (nine as u32) << (9 * k)
            });
        }
        self.across_bricks(place.map(i32::from))
    }

    fn across_bricks(&self, [x, y, z]: [i32; 3]) -> u32 {
        (0..9).fold(0, |bits, k| {
            let (y, z) = (y + k % 3 - 1, z + k / 3 - 1);
            // The row with one bit of room on either side, for neighbours in the next bricks.
            let mut ten = self.row([x, y, z]) << 1;
            match x % 8 {
                0 => ten |= self.row([x - 1, y, z]) >> 7,
                7 => ten |= (self.row([x + 1, y, z]) & 1) << 9,
                _ => {}
            }
            bits | (ten >> (x % 8) & 7) << (3 * k)
        })
    }

    /// The row of a brick that holds a place; empty outside.
    #[inline]
    fn row(&self, place: [i32; 3]) -> u32 {
        if (0..3).any(|axis| place[axis] < 0 || place[axis] >= (self.size[axis] * SIDE) as i32) {
            return 0;
        }
        let place = place.map(|x| x as u16);
        self.brick(place).map_or(0, |brick| {
            let layer = self.words[brick][inside(place).0];
            u32::from((layer >> (8 * (place[1] % 8))) as u8)
        })
    }
}

/// Layer of a place in its brick, and bit in the layer.
#[inline]
fn inside([x, y, z]: Place) -> (usize, usize) {
    (usize::from(z % 8), usize::from(x % 8 + 8 * (y % 8)))
}

/// Largest number of coarse voxels along a side of a block.
const BLOCK: u32 = 4;
/// Blocks along the longest side of a small lattice, so that there is work for several threads.
const BLOCKS: u32 = 4;
/// Half the diagonal of a unit cube.
const HALF_DIAGONAL: f64 = 0.866_025_403_784_438_6;

/// The values of the voxels that are computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wanted {
    /// Places alone.
    Places,
    /// Values of voxels with at most this flux; that of others that are not dismissed is infinite.
    AtMost(f32),
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
    /// Spheres evaluated at all levels.
    pub evaluated: u64,
}

/// The outcome of a descent.
pub struct Descent {
    /// The lattice.
    pub grid: Grid,
    /// The voxels.
    pub voxels: Bricks,
    /// Their numbers.
    pub tally: Tally,
}

/// Runs the algorithm.
///
/// # Errors
/// When the run was cancelled.
pub(super) fn coarse_to_fine(
    surface: &Surface,
    grid: Grid,
    setting: &LatticeSetting,
    wanted: Wanted,
    run: &RunContext,
) -> Result<Descent> {
    let levels = levels(&grid, setting.rules);
    let blocks = blocks(surface, &grid);
    let done = AtomicUsize::new(0);
    let none = Tally { dismissed: vec![0; levels.len() - 1], ..Tally::default() };
    let parts: Result<Vec<_>> = blocks
        .par_iter()
        .map(|block| {
            run.step(done.fetch_add(1, Ordering::Relaxed), blocks.len())?;
            let mut walk = Walk {
                surface,
                grid: &grid,
                levels: &levels,
                starts_coarse: setting.starts_coarse,
                wanted,
                voxels: Vec::new(),
                tally: none.clone(),
            };
            walk.block(block);
            Ok((walk.voxels, walk.tally))
        })
        .collect();
    run.step(blocks.len(), blocks.len())?;
    let (mut voxels, mut tally) = (Bricks::new(grid.size), none);
    // In the order of the blocks: brick numbers, and with them every later order, are deterministic.
    for (of_block, counts) in parts? {
        of_block.into_iter().for_each(|voxel| voxels.insert(voxel));
        tally.start += counts.start;
        tally.evaluated += counts.evaluated;
        tally.dismissed.iter_mut().zip(counts.dismissed).for_each(|(all, own)| *all += own);
    }
    Ok(Descent { grid, voxels, tally })
}

/// One level of resolution.
struct LatticeLevel {
    sphere: Sphere,
    /// Finest voxels along a side.
    size: u32,
    /// Flux from which on a voxel is dismissed.
    dismissed_from: f64,
}

/// From coarse to fine.
fn levels(grid: &Grid, rules: Rules) -> Vec<LatticeLevel> {
    let levels = SAMPLES.into_iter().zip((0..SAMPLES.len() as u32).rev()).map(|(count, finer)| {
        let size = SUBDIVISION.pow(finer);
        let sphere = Sphere::new(rules.spiral(), count, grid.side * f64::from(size));
        let dismissed_from = if rules == Rules::Published { 0.0 } else { -sphere.bias };
        LatticeLevel { sphere, size, dismissed_from }
    });
    levels.collect()
}

/// A box of coarse voxels, and a face near it.
struct Block {
    lo: [u32; 3],
    hi: [u32; 3],
    face: u32,
}

/// Step 1.
fn blocks(surface: &Surface, grid: &Grid) -> Vec<Block> {
    let whole = Block { lo: [0; 3], hi: grid.size.map(|n| n / SPLIT), face: 0 };
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
            let (low, high) = (grid.coarse_corner(lo), grid.coarse_corner(hi));
            let centre = (low + high) * 0.5;
            let half = (high - low).length() * 0.5;
            let Closest { distance, face, .. } = surface.closest(centre, Some(block.face));
            // A block farther from the surface than its own corners is on one side as a whole.
            if distance <= half || surface.inside.side(centre) == Side::Inside {
                open.push(Block { lo, hi, face });
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
    levels: &'a [LatticeLevel],
    starts_coarse: bool,
    wanted: Wanted,
    voxels: Vec<Voxel>,
    tally: Tally,
}

/// The facts about a voxel that follow from its ancestors.
#[derive(Clone, Copy)]
struct Known {
    /// Whether it and its descendants are known to be inside.
    is_inside: bool,
    dismissed: bool,
    /// The closest face of the parent.
    face: u32,
}

impl Walk<'_> {
    fn block(&mut self, block: &Block) {
        let known = Known { is_inside: false, dismissed: false, face: block.face };
        for z in block.lo[2]..block.hi[2] {
            for y in block.lo[1]..block.hi[1] {
                for x in block.lo[0]..block.hi[0] {
                    self.visit(0, [x, y, z].map(|i| i * SPLIT), known, None);
                }
            }
        }
    }

    /// Steps 2 to 4 for the voxel of a level whose lowest finest voxel is at `base`.
    /// `around` is the surface near its parent.
    fn visit(&mut self, level: usize, base: [u32; 3], mut known: Known, around: Option<&Near<'_>>) {
        let LatticeLevel { ref sphere, size, dismissed_from } = self.levels[level];
        let middle = Vec3::from(base.map(|i| f64::from(i) + f64::from(size) * 0.5));
        let centre = self.grid.origin + middle * self.grid.side;
        let foot = match around {
            Some(near) => near.closest(centre, known.face),
            None => self.surface.closest(centre, Some(known.face)),
        };
        let Closest { distance, face, .. } = foot;
        known.face = face;
        // Farthest centre of a descendant.
        let spread = HALF_DIAGONAL * (sphere.radius - self.grid.side);
        let finest = level + 1 == self.levels.len();
        let sphere_fits = distance >= sphere.radius;
        if !sphere_fits && (finest || level == 0 && self.starts_coarse) {
            return;
        }
        // Farther from the surface than any descendant's centre is away: all have this side.
        if distance > spread && !known.is_inside {
            if self.surface.inside.side(centre) != Side::Inside {
                return;
            }
            known.is_inside = true;
        }
        let evaluate = !known.dismissed && self.wanted != Wanted::Places && sphere_fits;
        let most = match self.wanted {
            _ if !finest => dismissed_from,
            Wanted::AtMost(most) => f64::from(most),
            _ => f64::INFINITY,
        };
        let most_near = if finest || sphere.radius > SMALL { FEW } else { MANY };
        // The spheres of all descendants lie in that of the voxel.
        let near = (evaluate || self.wanted != Wanted::Places && !finest).then(|| match around {
            Some(near) => near.within(centre, sphere.radius, &foot, most_near),
            None => self.surface.near(centre, sphere.radius, &foot, most_near),
        });
        let flux = match &near {
            Some(near) if evaluate => {
                self.tally.evaluated += 1;
                near.flux(sphere, centre, &foot, most).unwrap_or(f64::INFINITY)
            }
            _ => 0.0,
        };
        if finest {
            self.emit(base, distance, flux);
            return;
        }
        if evaluate && flux >= dismissed_from {
            self.tally.dismissed[level] += u64::from(size).pow(3);
            known.dismissed = true;
            if matches!(self.wanted, Wanted::AtMost(_)) {
                self.tally.start += u64::from(size).pow(3);
                return;
            }
        }
        // The spheres of all descendants fit, and no values are needed: skip the recursion.
        if self.wanted == Wanted::Places && distance >= spread + self.grid.side {
            for at in cube(size) {
                self.emit([0, 1, 2].map(|axis| base[axis] + at[axis]), distance, 0.0);
            }
            return;
        }
        let step = self.levels[level + 1].size;
        for at in cube(size / step) {
            self.visit(
                level + 1,
                [0, 1, 2].map(|axis| base[axis] + at[axis] * step),
                known,
                near.as_ref(),
            );
        }
    }

    fn emit(&mut self, place: [u32; 3], distance: f64, flux: f64) {
        self.tally.start += 1;
        let place = place.map(|i| i as u16);
        self.voxels.push(Voxel { place, distance: distance as f32, flux: flux as f32 });
    }
}

/// The places of a cube of `n` voxels along each side.
fn cube(n: u32) -> impl Iterator<Item = [u32; 3]> {
    (0..n.pow(3)).map(move |k| [k % n, k / n % n, k / n / n])
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    #[test]
    fn voxels_come_back_and_neighbourhoods_cross_bricks() {
        let mut bricks = Bricks::new([20, 17, 30]);
        let mut rng = Pcg64::seed_from_u64(5);
        let mut kept = Vec::new();
        for k in 0..20 * 17 * 30_u16 {
            let place = [k % 20, k / 20 % 17, k / 340];
            if rng.random_range(0..4) == 0 {
                let voxel = Voxel { place, distance: f32::from(k), flux: -f32::from(k) };
                bricks.insert(voxel);
                kept.push(voxel);
            }
        }
        assert_eq!(bricks.len, kept.len());
        assert_eq!(bricks.iter().count(), kept.len());
        for voxel in &kept {
            assert_eq!(bricks.get(voxel.place), Some(*voxel));
            let around = bricks.neighbourhood(voxel.place);
            for k in 0..27 {
                let at = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
                let at = [0, 1, 2].map(|i| i32::from(voxel.place[i]) + at[i]);
                let there = kept.iter().any(|v| v.place.map(i32::from) == at);
                assert_eq!(around >> k & 1 == 1, there);
            }
        }
        let gone = kept[kept.len() / 2];
        bricks.remove(gone.place);
        assert_eq!((bricks.get(gone.place), bricks.len), (None, kept.len() - 1));
        assert_eq!(bricks.neighbourhood(gone.place) >> 13 & 1, 0);
    }
}
