//! Voxels in sparse bricks of 8 x 8 x 8.
//!
//! Only bricks with voxels are allocated: 4.2 KB for each of them, and four bytes for each brick of the
//! bounding box.

/// Voxels along a side of a brick.
const SIDE: u32 = 8;
const ABSENT: u32 = u32::MAX;

/// Indices of a voxel along the three axes, from the lower corner of the bounding box.
pub type Place = [u16; 3];

/// A voxel and its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voxel {
    /// Where it is.
    pub place: Place,
    /// Distance of its centre to the surface, a fraction of the diagonal.
    pub distance: f32,
    /// `AOF'`; 0 if the voxel was dismissed at a coarser level.
    pub flux: f32,
}

/// A set of voxels with values.
#[derive(Clone, Debug)]
pub struct Bricks {
    there: Bits,
    values: Vec<Box<Values>>,
    len: usize,
}

/// Distance and flux of each voxel of a brick.
type Values = [[f32; 2]; (SIDE * SIDE * SIDE) as usize];

impl Bricks {
    /// An empty set of voxels of a grid with these numbers along the axes.
    pub fn new(grid: [u32; 3]) -> Self {
        Self { there: Bits::new(grid), values: Vec::new(), len: 0 }
    }

    /// Whether there is no voxel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Puts in a voxel that is not there yet.
    pub fn insert(&mut self, voxel: Voxel) {
        let brick = self.there.brick_or_new(voxel.place);
        if brick == self.values.len() {
            self.values.push(Box::new([[0.0; 2]; (SIDE * SIDE * SIDE) as usize]));
        }
        let (layer, bit) = inside(voxel.place);
        let word = &mut self.there.words[brick][layer];
        debug_assert!(*word >> bit & 1 == 0, "inserted twice");
        *word |= 1 << bit;
        self.values[brick][64 * layer + bit] = [voxel.distance, voxel.flux];
        self.len += 1;
    }

    /// Takes out a voxel that is there.
    pub fn remove(&mut self, place: Place) {
        *self.there.word(place) &= !(1 << inside(place).1);
        self.len -= 1;
    }

    /// The voxel at a place, if there is one.
    pub fn get(&self, place: Place) -> Option<Voxel> {
        let brick = self.there.brick(place)?;
        let (layer, bit) = inside(place);
        let [distance, flux] = self.values[brick][64 * layer + bit];
        let is_there = self.there.words[brick][layer] >> bit & 1 == 1;
        is_there.then_some(Voxel { place, distance, flux })
    }

    /// The existing voxels among the 27 around and at a place, as bits
    /// `dx + 1 + 3 (dy + 1) + 9 (dz + 1)`.
    #[inline]
    pub fn neighbourhood(&self, place: Place) -> u32 {
        self.there.neighbourhood(place)
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

    /// Approximate number of bytes in memory.
    pub fn bytes(&self) -> usize {
        self.there.bytes() + (size_of::<Values>() + size_of::<usize>()) * self.values.len()
    }
}

/// A mark for each place of a set of bricks.
pub struct Marks(Bits);

impl Marks {
    /// No mark on any place of these bricks.
    pub fn of(bricks: &Bricks) -> Self {
        let mut marks = bricks.there.clone();
        marks.words.fill([0; 8]);
        Self(marks)
    }

    /// Marks a place; whether it had no mark.
    pub fn set(&mut self, place: Place) -> bool {
        let bit = 1 << inside(place).1;
        let word = self.0.word(place);
        let new = *word & bit == 0;
        *word |= bit;
        new
    }

    /// Takes the mark from a place.
    pub fn clear(&mut self, place: Place) {
        *self.0.word(place) &= !(1 << inside(place).1);
    }

    /// The marked places among the 27 around and at a place, as bits as in [`Bricks::neighbourhood`].
    #[inline]
    pub fn neighbourhood(&self, place: Place) -> u32 {
        self.0.neighbourhood(place)
    }
}

/// A bit for each place; only bricks with a bit are allocated.
#[derive(Clone, Debug)]
struct Bits {
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

    fn bytes(&self) -> usize {
        4 * self.table.len() + (size_of::<Place>() + 64) * self.words.len()
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

    /// The word of a place in a brick that is there.
    #[inline]
    fn word(&mut self, place: Place) -> &mut u64 {
        let brick = self.table[self.slot(place)] as usize;
        &mut self.words[brick][inside(place).0]
    }

    #[inline]
    fn neighbourhood(&self, place: Place) -> u32 {
        // All neighbours in one brick: three words instead of nine rows. Most voxels are inside.
        let within = |v: u16| (1..7).contains(&(v % 8));
        if place.into_iter().all(within) {
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
            let row = |x: i32| u32::from(self.row([x, y, z]));
            // The row with one bit of room on either side, for neighbours in the bricks beside.
            let mut ten = row(x) << 1;
            match x % 8 {
                0 => ten |= row(x - 1) >> 7,
                7 => ten |= (row(x + 1) & 1) << 9,
                _ => {}
            }
            bits | (ten >> (x % 8) & 7) << (3 * k)
        })
    }

    /// The row of a brick that holds a place; empty outside.
    #[inline]
    fn row(&self, place: [i32; 3]) -> u8 {
        if (0..3).any(|axis| place[axis] < 0 || place[axis] >= (self.size[axis] * SIDE) as i32) {
            return 0;
        }
        let place = place.map(|x| x as u16);
        let brick = self.brick(place);
        brick.map_or(0, |brick| (self.words[brick][inside(place).0] >> (8 * (place[1] % 8))) as u8)
    }
}

/// Layer of a place in its brick, and bit in the layer.
#[inline]
fn inside([x, y, z]: Place) -> (usize, usize) {
    (usize::from(z % 8), usize::from(x % 8 + 8 * (y % 8)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_come_back_and_neighbourhoods_cross_bricks() {
        let mut bricks = Bricks::new([20, 17, 30]);
        let mut state = 5_u64;
        let mut kept = Vec::new();
        for k in 0..20 * 17 * 30_u64 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let place = [k % 20, k / 20 % 17, k / 340].map(|x| x as u16);
            if state >> 62 == 0 {
                let voxel = Voxel { place, distance: k as f32, flux: -(k as f32) };
                bricks.insert(voxel);
                kept.push(voxel);
            }
        }
        assert_eq!(bricks.len(), kept.len());
        assert_eq!(bricks.iter().count(), kept.len());
        for voxel in &kept {
            assert_eq!(bricks.get(voxel.place), Some(*voxel));
            let around = bricks.neighbourhood(voxel.place);
            for k in 0..27 {
                let [dx, dy, dz] = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
                let at = [dx, dy, dz];
                let at = [0, 1, 2].map(|i| i32::from(voxel.place[i]) + at[i]);
                let there = kept.iter().any(|v| v.place.map(i32::from) == at);
                assert_eq!(around >> k & 1 == 1, there);
            }
        }
        let gone = kept[kept.len() / 2];
        bricks.remove(gone.place);
        assert_eq!((bricks.get(gone.place), bricks.len()), (None, kept.len() - 1));
        assert_eq!(bricks.neighbourhood(gone.place) >> 13 & 1, 0);
    }
}
